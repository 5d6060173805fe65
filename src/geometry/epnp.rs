//! The pose of a camera from points in the world and their pixels, in closed form (`EPnP`).

use super::absolute_orientation::absolute_orientation;
use super::{Error, PinholeCamera, Pose, p3p};
use nalgebra::linalg::SymmetricEigen;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Point2, Point3, SMatrix, SVector, Vector3, Vector4};

/// Ratio of the variances of points along two axes under which the smaller one is rounding: points on a line, or in a plane.
const FLAT: f64 = 1e-10;

/// Gauss-Newton steps that follow each closed-form start; they converge quadratically.
const STEPS: usize = 10;

/// What is sought here, in errors.
const WHAT: &str = "pose from points";

/// The most combinations of eigenvectors that are tried.
type Betas = Vector4<f64>;

/// The pose of a camera that sees known points.
///
/// `EPnP`: every point is a fixed combination of four control points (three where all points lie in a plane), so that projection is
/// linear in the control points' coordinates in the camera. These are a combination of the eigenvectors with the least eigenvalues of
/// `MᵀM`, whose coefficients follow from the distances of the control points. All of one to four eigenvectors are tried, each is refined by
/// Gauss-Newton over the coefficients, and the pose with the least reprojection error is given. Of four or five points, the poses of their
/// triples ([`p3p`]) are tried as well.
///
/// * `points` — point in the world (metres) and pixel; at least four.
///
/// Returns `camera_from_world`. The error that it makes least is algebraic; with noise,
/// [`refine_pose`](super::refine_pose) improves it. Four points that are not in one plane may have several poses; one of them comes out.
///
/// # Errors
/// [`Error::TooFew`], [`Error::NotFinite`], and [`Error::Degenerate`] for points on one line, at one place, or behind the camera.
///
/// # Source
/// Lepetit, Moreno-Noguer, Fua 2009, *`EPnP`: an accurate O(n) solution to the `PnP` problem*. Rows of `M` are weighted by the focal
/// lengths, so that errors count in pixels.
pub fn epnp(camera: &PinholeCamera, points: &[(Point3<f64>, Point2<f64>)]) -> Result<Pose, Error> {
    if points.len() < 4 {
        return Err(Error::TooFew { what: WHAT, expected: 4, found: points.len() });
    }
    for (point, pixel) in points {
        Error::check_finite(WHAT, point.iter())?;
        Error::check_finite(WHAT, pixel.iter())?;
    }
    let frame = ControlFrame::of(points)?;
    let vectors = if frame.planar {
        null_space::<9>(camera, points, &frame)
    } else {
        null_space::<12>(camera, points, &frame)
    };
    let vectors = vectors.ok_or(Error::Degenerate { what: WHAT, reason: "numbers too large" })?;
    let mut best: Option<(f64, Pose)> = None;
    let combined =
        frame.combinations(&vectors).into_iter().filter_map(|betas| frame.pose(points, &vectors, &betas));
    for pose in combined.chain(few(camera, points)) {
        let error = reprojection(camera, points, &pose);
        if error.is_finite() && best.is_none_or(|(least, _)| error < least) {
            best = Some((error, pose));
        }
    }
    best.map(|(_, pose)| pose)
        .ok_or(Error::Degenerate { what: WHAT, reason: "no pose has all points in front of the camera" })
}

/// Poses from the triples of four or five points: their `MᵀM` has a null space too wide for Gauss-Newton to be sure of the right place.
fn few(camera: &PinholeCamera, points: &[(Point3<f64>, Point2<f64>)]) -> Vec<Pose> {
    let mut poses = Vec::new();
    if points.len() > 5 {
        return poses;
    }
    for c in 2..points.len() {
        for b in 1..c {
            for a in 0..b {
                let triple = [a, b, c].map(|index| points[index]);
                poses.extend(p3p(
                    &triple.map(|(point, _)| point),
                    &triple.map(|(_, pixel)| camera.ray(pixel)),
                ));
            }
        }
    }
    poses
}

/// Sum of squared reprojection errors, px²; infinite when a point is behind the camera.
fn reprojection(camera: &PinholeCamera, points: &[(Point3<f64>, Point2<f64>)], pose: &Pose) -> f64 {
    points
        .iter()
        .map(|(point, pixel)| {
            camera.project(pose * *point).map_or(f64::INFINITY, |found| (found - pixel).norm_squared())
        })
        .sum()
}

/// The control points: the mean of all points, and one along each principal axis.
struct ControlFrame {
    mean: Vector3<f64>,
    /// Principal axes, each as long as the spread of the points along it.
    axes: [Vector3<f64>; 3],
    planar: bool,
}

impl ControlFrame {
    fn of(points: &[(Point3<f64>, Point2<f64>)]) -> Result<Self, Error> {
        let scale = 1.0 / points.len() as f64;
        let mean: Vector3<f64> = points.iter().map(|(point, _)| point.coords * scale).sum();
        let mut spread = Matrix3::<f64>::zeros();
        for (point, _) in points {
            let offset = point.coords - mean;
            spread.ger(scale, &offset, &offset, 1.0);
        }
        let eigen = SymmetricEigen::try_new(spread, f64::EPSILON, 200)
            .ok_or(Error::Degenerate { what: WHAT, reason: "points have no principal axes" })?;
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let variances = order.map(|index| eigen.eigenvalues[index]);
        // Under the rounding of the coordinates themselves there is no spread at all.
        if !(variances[0] > 1e-24 * (1.0 + mean.norm_squared()) && variances[1] > FLAT * variances[0]) {
            return Err(Error::Degenerate { what: WHAT, reason: "points lie on one line" });
        }
        let axes = [0, 1, 2].map(|k| eigen.eigenvectors.column(order[k]) * variances[k].max(0.0).sqrt());
        Ok(Self { mean, axes, planar: variances[2] <= FLAT * variances[0] })
    }

    /// How many control points there are.
    fn count(&self) -> usize {
        if self.planar { 3 } else { 4 }
    }

    /// A point as a combination of the control points.
    fn weights(&self, point: &Point3<f64>) -> Vector4<f64> {
        let offset = point.coords - self.mean;
        let mut weights = Vector4::zeros();
        for k in 1..self.count() {
            let axis = &self.axes[k - 1];
            weights[k] = offset.dot(axis) / axis.norm_squared();
        }
        weights[0] = 1.0 - weights.sum();
        weights
    }

    /// Pairs of control points.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let count = self.count();
        (0..count).flat_map(move |a| (a + 1..count).map(move |b| (a, b)))
    }

    /// Squared distance of two control points, m².
    fn distance_squared(&self, a: usize, b: usize) -> f64 {
        let place = |k: usize| if k == 0 { Vector3::zeros() } else { self.axes[k - 1] };
        (place(a) - place(b)).norm_squared()
    }

    /// Coefficients of the eigenvectors that may give the control points their distances.
    fn combinations(&self, vectors: &[DVector<f64>]) -> Vec<Betas> {
        // Distances are quadratic in the coefficients: row · [β₁², β₁β₂, β₂², β₁β₃, …] with d = Σ β_k (v_k(a) − v_k(b)).
        let difference = |k: usize, (a, b): (usize, usize)| -> Vector3<f64> {
            (vectors[k].fixed_rows::<3>(3 * a) - vectors[k].fixed_rows::<3>(3 * b)).into_owned()
        };
        let differences: Vec<[Vector3<f64>; 4]> =
            self.pairs().map(|pair| [0, 1, 2, 3].map(|k| difference(k, pair))).collect();
        let squares: Vec<f64> = self.pairs().map(|(a, b)| self.distance_squared(a, b)).collect();
        // With three control points there are three distances, so two eigenvectors at most.
        let starts: &[&[(usize, usize)]] = if self.planar {
            &[&[(0, 0)], &[(0, 0), (0, 1), (1, 1)]]
        } else {
            &[
                &[(0, 0)],
                &[(0, 0), (0, 1), (1, 1)],
                &[(0, 0), (0, 1), (1, 1), (0, 2), (1, 2)],
                &[(0, 0), (0, 1), (0, 2), (0, 3)],
            ]
        };
        starts
            .iter()
            .filter_map(|products| {
                let start = linearised(&differences, &squares, products)?;
                let free = 1 + products.iter().map(|(_, k)| *k).max().unwrap_or(0);
                Some(refined(&differences, &squares, start, free))
            })
            .collect()
    }

    /// The pose that coefficients lead to; `None` when points would be behind the camera.
    fn pose(
        &self,
        points: &[(Point3<f64>, Point2<f64>)],
        vectors: &[DVector<f64>],
        betas: &Betas,
    ) -> Option<Pose> {
        let mut controls = [Vector3::<f64>::zeros(); 4];
        for (a, control) in controls.iter_mut().enumerate().take(self.count()) {
            for k in 0..4 {
                *control += vectors[k].fixed_rows::<3>(3 * a) * betas[k];
            }
        }
        let place = |point: &Point3<f64>| -> Point3<f64> {
            let weights = self.weights(point);
            Point3::from((0..4).map(|a| controls[a] * weights[a]).sum::<Vector3<f64>>())
        };
        let depth: f64 = points.iter().map(|(point, _)| place(point).z).sum();
        let sign = if depth < 0.0 { -1.0 } else { 1.0 };
        absolute_orientation(points.iter().map(|(point, _)| (*point, place(point) * sign)))
    }
}

/// The four eigenvectors of `MᵀM` with the least eigenvalues, the least first.
fn null_space<const N: usize>(
    camera: &PinholeCamera,
    points: &[(Point3<f64>, Point2<f64>)],
    frame: &ControlFrame,
) -> Option<Vec<DVector<f64>>> {
    let mut square = SMatrix::<f64, N, N>::zeros();
    for (point, pixel) in points {
        let weights = frame.weights(point);
        let seen = camera.normalised(*pixel);
        for (axis, focal) in [(0, camera.fx), (1, camera.fy)] {
            let mut row = SVector::<f64, N>::zeros();
            for control in 0..frame.count() {
                row[3 * control + axis] = weights[control] * focal;
                row[3 * control + 2] = -weights[control] * focal * seen[axis];
            }
            square.ger(1.0, &row, &row, 1.0);
        }
    }
    if !square.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let square = DMatrix::from_fn(N, N, |row, column| square[(row, column)]);
    let eigen = SymmetricEigen::try_new(square, f64::EPSILON, 1000)?;
    let mut order: Vec<usize> = (0..N).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    Some(order[..4].iter().map(|column| eigen.eigenvectors.column(*column).into_owned()).collect())
}

/// Coefficients from a linear solution for some of their products.
fn linearised(
    differences: &[[Vector3<f64>; 4]],
    squares: &[f64],
    products: &[(usize, usize)],
) -> Option<Betas> {
    let entry = |row: usize, column: usize| {
        let (k, l) = products[column];
        let product = differences[row][k].dot(&differences[row][l]);
        if k == l { product } else { 2.0 * product }
    };
    let system = DMatrix::from_fn(squares.len(), products.len(), entry);
    let solution = system
        .try_svd(true, true, f64::EPSILON, 500)?
        .solve(&DVector::from_column_slice(squares), 1e-14)
        .ok()?;
    let value = |product: (usize, usize)| {
        products.iter().position(|candidate| *candidate == product).map(|column| solution[column])
    };
    let mut betas = Betas::zeros();
    let first = value((0, 0))?;
    let sign = if first < 0.0 { -1.0 } else { 1.0 };
    betas[0] = first.abs().sqrt();
    if betas[0] <= 0.0 {
        return None;
    }
    for k in 1..4 {
        if let Some(mixed) = value((0, k)) {
            betas[k] = match value((k, k)) {
                // Its own square is the better known of the two.
                Some(square) if square * sign > 0.0 => (square * sign).sqrt().copysign(mixed * sign),
                _ => sign * mixed / betas[0],
            };
        }
    }
    betas.iter().all(|beta| beta.is_finite()).then_some(betas)
}

/// Gauss-Newton over the first `free` coefficients, towards the distances of the control points.
fn refined(differences: &[[Vector3<f64>; 4]], squares: &[f64], start: Betas, free: usize) -> Betas {
    let cost = |betas: &Betas| -> f64 {
        let miss = |(row, square): (&[Vector3<f64>; 4], &f64)| {
            let sum: Vector3<f64> = (0..4).map(|k| row[k] * betas[k]).sum();
            (sum.norm_squared() - square).powi(2)
        };
        differences.iter().zip(squares).map(miss).sum()
    };
    let (mut betas, mut least) = (start, cost(&start));
    for _ in 0..STEPS {
        let (mut hessian, mut gradient) = (Matrix4::<f64>::zeros(), Vector4::zeros());
        for (row, square) in differences.iter().zip(squares) {
            let sum: Vector3<f64> = (0..4).map(|k| row[k] * betas[k]).sum();
            let derivative = Vector4::from_fn(|k, _| if k < free { 2.0 * sum.dot(&row[k]) } else { 0.0 });
            hessian.ger(1.0, &derivative, &derivative, 1.0);
            gradient += derivative * (sum.norm_squared() - square);
        }
        let ridge = 1e-15 * hessian.trace();
        for k in 0..4 {
            hessian[(k, k)] += if k < free { ridge } else { 1.0 };
        }
        let Some(step) = hessian.cholesky().map(|factor| factor.solve(&gradient)) else { break };
        let candidate = betas - step;
        let there = cost(&candidate);
        if there.is_nan() || there >= least {
            break;
        }
        (betas, least) = (candidate, there);
    }
    betas
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{camera, circle, visible_point};
    use super::*;
    use proptest::prelude::*;

    fn seen(camera: &PinholeCamera, pose: &Pose, points: &[Point3<f64>]) -> Vec<(Point3<f64>, Point2<f64>)> {
        points.iter().map(|point| (*point, camera.project(pose * *point).unwrap())).collect()
    }

    fn error(found: &Pose, pose: &Pose) -> f64 {
        (found.inverse() * *pose).log().norm()
    }

    /// Spread of the points along their narrowest axis, metres.
    fn thickness(points: &[Point3<f64>]) -> f64 {
        let mean = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64;
        let spread: Matrix3<f64> =
            points.iter().map(|p| (p.coords - mean) * (p.coords - mean).transpose()).sum();
        (spread.symmetric_eigenvalues().min() / points.len() as f64).max(0.0).sqrt()
    }

    proptest! {
        #[test]
        fn exact_pixels_of_six_points_or_more_give_back_the_pose(
            camera in camera(), pose in circle(), points in prop::collection::vec(visible_point(), 6..40),
        ) {
            prop_assume!(thickness(&points) > 0.1);
            let found = epnp(&camera, &seen(&camera, &pose, &points)).unwrap();
            // Radians and metres: rounding over the gap between the eigenvalues.
            prop_assert!(error(&found, &pose) < 1e-9, "{:e}", error(&found, &pose));
        }

        #[test]
        fn exact_pixels_of_points_in_a_plane_give_back_the_pose(
            camera in camera(), pose in circle(), points in prop::collection::vec(visible_point(), 5..40),
            turn in super::super::strategies::pose(),
        ) {
            let flat: Vec<_> = points.iter().map(|p| Point3::from(turn.rotation() * Vector3::new(p.x, p.y, 0.0))).collect();
            let wide = points.iter().map(|p| p.x.abs().min(p.y.abs())).fold(0.0, f64::max);
            prop_assume!(wide > 0.5);
            // Two degrees from the plane itself: there all points lie on one line of the image.
            let centre = pose.inverse().translation();
            let normal = turn.rotation() * Vector3::z();
            prop_assume!(centre.dot(&normal).abs() > 0.04 * centre.norm());
            let Ok(found) = epnp(&camera, &seen(&camera, &pose, &flat)) else { panic!("not found") };
            prop_assert!(error(&found, &pose) < 1e-6, "{:e}", error(&found, &pose));
        }

        #[test]
        fn four_or_five_points_are_seen_where_they_were(
            camera in camera(), pose in circle(), points in prop::collection::vec(visible_point(), 4..6),
        ) {
            prop_assume!(thickness(&points) > 0.1);
            let pairs = seen(&camera, &pose, &points);
            let found = epnp(&camera, &pairs).unwrap();
            // Pixels; a double root of the triples keeps half of the digits.
            prop_assert!(reprojection(&camera, &pairs, &found).sqrt() < 1e-2);
        }

        #[test]
        fn noise_moves_the_pose_by_its_own_size(
            camera in camera(), pose in circle(), points in prop::collection::vec(visible_point(), 30..40),
            noise in prop::collection::vec(prop::array::uniform2(-1.0..1.0_f64), 40),
        ) {
            prop_assume!(thickness(&points) > 0.3);
            let mut pairs = seen(&camera, &pose, &points);
            for ((_, pixel), noise) in pairs.iter_mut().zip(&noise) {
                *pixel += nalgebra::Vector2::from(*noise);
            }
            let found = epnp(&camera, &pairs).unwrap();
            // 0.6 px of 300 at 8 m, spread over 30 points of a metre.
            prop_assert!(error(&found, &pose) < 0.15, "{}", error(&found, &pose));
        }
    }

    #[test]
    fn what_leaves_the_pose_open_is_refused() {
        let camera = PinholeCamera::new(500.0, -480.0, 320.0, 240.0, 640, 480).unwrap();
        let pair = |x: f64, y: f64, z: f64| {
            let point = Point3::new(x, y, z);
            (point, camera.project(point).unwrap_or(Point2::new(0.0, 0.0)))
        };
        assert!(matches!(epnp(&camera, &[]), Err(Error::TooFew { expected: 4, found: 0, .. })));
        assert!(matches!(epnp(&camera, &[pair(0.0, 0.0, 2.0); 3]), Err(Error::TooFew { .. })));
        assert!(matches!(epnp(&camera, &[pair(0.0, 0.0, 2.0); 9]), Err(Error::Degenerate { .. })));
        let line: Vec<_> = (0..9).map(|k| pair(f64::from(k) * 0.1, 0.3, 2.0)).collect();
        assert!(matches!(epnp(&camera, &line), Err(Error::Degenerate { .. })));
        let mut hostile: Vec<_> =
            (0..9).map(|k| pair(f64::from(k) * 0.1, f64::from(k * k) * 0.02, 2.0)).collect();
        hostile[3].0.x = f64::NAN;
        assert!(matches!(epnp(&camera, &hostile), Err(Error::NotFinite { .. })));
        for number in [f64::MAX, 1e200] {
            hostile[3].0.x = number;
            let _ = epnp(&camera, &hostile);
        }
    }
}
