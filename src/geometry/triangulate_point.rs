//! A point from the pixels where cameras saw it.

use super::camera::NEAREST_Z;
use super::direction::angle;
use super::least_squares::{Normal, minimise};
use super::parallax::{LEAST_PARALLAX, is_one_place, widest_angle};
use super::{PinholeCamera, Pose};
use nalgebra::{Matrix3, Point2, Point3, Vector3};

/// One observation of a point: camera, `camera_from_world`, pixel.
pub type PointView = (PinholeCamera, Pose, Point2<f64>);

/// A triangulated point and how well its observations agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangulation {
    /// The point in the world, metres.
    pub point: Point3<f64>,
    /// Root mean square of all residuals, two (u and v) to an observation, pixels.
    pub rms_px: f64,
    /// Widest angle under which two of the cameras see the point, radians; found by sweeps, at least half of the true one.
    pub parallax: f64,
    /// Observations used: all.
    pub count: usize,
}

/// The point with the least squared reprojection error.
///
/// `min Σ |u − π(ᶜT_w P)|²`
///
/// Starts from the linear solution and iterates over `(a, b, ρ)`, the point `(a, b, 1)/ρ` in the first camera, in which projection is
/// nearly linear even for far points.
///
/// * `observations` — camera, pose of the world in the camera (metres), pixel.
///
/// `None` when fewer than two observations, less than 1e-6 rad between them, or numbers that are not finite leave the depth open, or when
/// the point would lie behind one of the cameras.
#[must_use]
pub fn triangulate_point(observations: &[PointView]) -> Option<Triangulation> {
    let (first, rest) = observations.split_first()?;
    if rest.is_empty() {
        return None;
    }
    let world_from_first = first.1.inverse();
    let centre = world_from_first.translation();
    let spread = rest.iter().map(|view| (view.1.inverse().translation() - centre).norm()).fold(0.0, f64::max);
    if is_one_place(spread, centre.norm()) {
        return None;
    }

    let sights: Vec<Sight> = observations.iter().map(|view| Sight::new(view, &world_from_first)).collect();
    let (place, normal) =
        minimise(linear(&sights)?, |place| reprojection(&sights, place), |p, step| p + step)?;

    let depth = 1.0 / place.z;
    if !(depth > NEAREST_Z && depth.is_finite()) {
        return None;
    }
    let point = world_from_first * Point3::new(place.x * depth, place.y * depth, depth);
    if !observations.iter().all(|view| (view.1 * point).z > NEAREST_Z) {
        return None;
    }
    let rays: Vec<Vector3<f64>> =
        observations.iter().map(|view| point - view.1.inverse() * Point3::origin()).collect();
    let count = observations.len();
    let parallax = widest_angle(&rays.iter(), angle);
    let rms_px = (normal.cost / count as f64).sqrt();
    (parallax >= LEAST_PARALLAX).then_some(Triangulation { point, rms_px, parallax, count })
}

/// An observation, in the space of the first camera.
struct Sight {
    camera: PinholeCamera,
    /// Rotation and translation (metres) of `camera_from_first`.
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    pixel: Point2<f64>,
}

impl Sight {
    fn new((camera, camera_from_world, pixel): &PointView, world_from_first: &Pose) -> Self {
        let camera_from_first = camera_from_world * world_from_first;
        let (rotation, translation) = (camera_from_first.rotation_matrix(), camera_from_first.translation());
        Self { camera: *camera, rotation, translation, pixel: *pixel }
    }
}

/// `(a, b, ρ)` with the least algebraic error: `(r₁ − x r₃) · (a, b, 1) + ρ (t₁ − x t₃) = 0`, and the same for y.
fn linear(sights: &[Sight]) -> Option<Vector3<f64>> {
    let mut normal = Normal::<3>::new();
    for Sight { camera, rotation: r, translation: t, pixel } in sights {
        let seen = camera.normalised(*pixel);
        for (axis, focal) in [(0, camera.fx), (1, camera.fy)] {
            let row = r.row(axis) - r.row(2) * seen[axis];
            let derivative = Vector3::new(row[0], row[1], t[axis] - t.z * seen[axis]) * focal;
            normal.add(row[2] * focal, &derivative);
        }
    }
    normal.step(0.0).map(|(place, _)| place)
}

/// Normal equations of all reprojection errors at `(a, b, ρ)`; `None` when the point is not in front of every camera.
fn reprojection(sights: &[Sight], place: &Vector3<f64>) -> Option<Normal<3>> {
    let mut normal = Normal::new();
    for Sight { camera, rotation: r, translation: t, pixel } in sights {
        let seen = r * Vector3::new(place.x, place.y, 1.0) + t * place.z;
        if seen.z.is_nan() || seen.z <= 1e-12 {
            return None;
        }
        for (axis, focal, principal, measured) in
            [(0, camera.fx, camera.cx, pixel.x), (1, camera.fy, camera.cy, pixel.y)]
        {
            let slope = seen[axis] / seen.z;
            let row = (r.row(axis) - r.row(2) * slope) * (focal / seen.z);
            let derivative = Vector3::new(row[0], row[1], (t[axis] - t.z * slope) * (focal / seen.z));
            normal.add(focal * slope + principal - measured, &derivative);
        }
    }
    Some(normal)
}

#[cfg(test)]
mod tests {
    use super::super::least_squares::gradient_error;
    use super::super::strategies::{camera, circle, visible_point};
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    fn views(point: Point3<f64>, cameras: &[(PinholeCamera, Pose)]) -> Vec<PointView> {
        cameras.iter().map(|(camera, pose)| (*camera, *pose, camera.project(pose * point).unwrap())).collect()
    }

    fn sigma(observations: &[PointView], point: Point3<f64>) -> f64 {
        let squares = observations.iter().map(|(camera, pose, pixel)| {
            camera.project(pose * point).map_or(f64::INFINITY, |found| (found - pixel).norm_squared())
        });
        (squares.sum::<f64>() / (2 * observations.len()) as f64).sqrt()
    }

    proptest! {
        #[test]
        fn exact_observations_give_back_the_point(
            point in visible_point(), cameras in prop::collection::vec((camera(), circle()), 2..12),
        ) {
            let found = triangulate_point(&views(point, &cameras));
            let Some(found) = found else { panic!("not triangulated") };
            prop_assume!(found.parallax > 0.01);
            // Metres: 1e-13 px of rounding at 4 m, over the parallax.
            prop_assert!((found.point - point).norm() < 1e-10, "{}", (found.point - point).norm());
            prop_assert!(found.rms_px < 1e-9);
            prop_assert_eq!(found.count, cameras.len());
        }

        #[test]
        fn no_nearby_point_agrees_better_with_noisy_observations(
            point in visible_point(),
            cameras in prop::collection::vec(((camera(), circle()), prop::array::uniform2(-3.0..3.0)), 3..12),
            step in prop::array::uniform3(-1e-3..1e-3),
        ) {
            let (cameras, noise): (Vec<_>, Vec<_>) = cameras.into_iter().unzip();
            let mut observations = views(point, &cameras);
            for (view, noise) in observations.iter_mut().zip(noise) {
                view.2 += nalgebra::Vector2::from(noise);
            }
            let Some(found) = triangulate_point(&observations) else { return Ok(()) };
            prop_assert!((found.rms_px - sigma(&observations, found.point)).abs() < 1e-9);
            let beside = found.point + Vector3::from(step);
            prop_assert!(found.rms_px <= sigma(&observations, beside) + 1e-12);
        }

        #[test]
        fn the_reprojection_has_the_gradient_of_its_cost(
            point in visible_point(), cameras in prop::collection::vec((camera(), circle()), 2..5),
        ) {
            let observations = views(point, &cameras);
            let world_from_first = cameras[0].1.inverse();
            let p = cameras[0].1 * (point + Vector3::new(0.1, -0.1, 0.1));
            let place = Vector3::new(p.x / p.z, p.y / p.z, 1.0 / p.z);
            let sights: Vec<Sight> = observations.iter().map(|view| Sight::new(view, &world_from_first)).collect();
            let normal = |place: &Vector3<f64>| reprojection(&sights, place);
            // Central differences of a cost of about 1e3 px² with 1e-6: rounding 1e-7 of a gradient of about 1e5.
            prop_assert!(gradient_error(&place, normal, |place, step| place + step, 1e-6) < 1e-5);
        }
    }

    #[test]
    fn a_far_point_keeps_its_digits_relative_to_the_parallax() {
        let camera = PinholeCamera::new(500.0, -480.0, 320.0, 240.0, 640, 480).unwrap();
        let point = Point3::new(30.0, -20.0, 1000.0);
        let pose = |x: f64| Pose::new(UnitQuaternion::identity(), Vector3::new(x, 0.0, 0.0));
        let found = triangulate_point(&views(point, &[(camera, pose(0.0)), (camera, pose(0.05))])).unwrap();
        assert!((found.parallax - 5e-5).abs() < 1e-6);
        assert!((found.point - point).norm() < 1e-4, "{}", found.point);
    }

    #[test]
    fn what_leaves_the_depth_open_gives_nothing() {
        let camera = PinholeCamera::new(500.0, 500.0, 320.0, 240.0, 640, 480).unwrap();
        let pose = |x: f64| Pose::new(UnitQuaternion::identity(), Vector3::new(x, 0.0, 0.0));
        let at = |x: f64, u: f64| (camera, pose(x), Point2::new(u, 240.0));
        assert_eq!(triangulate_point(&[]), None);
        assert_eq!(triangulate_point(&[at(0.0, 320.0)]), None);
        // One place, seen twice, even with noise.
        assert_eq!(triangulate_point(&[at(0.0, 320.0), at(0.0, 320.0)]), None);
        assert_eq!(triangulate_point(&[at(0.0, 320.0), at(0.0, 321.0)]), None);
        // Parallel rays, and rays that meet behind the cameras.
        assert_eq!(triangulate_point(&[at(0.0, 320.0), at(1.0, 320.0)]), None);
        assert_eq!(triangulate_point(&[at(0.0, 320.0), at(1.0, 200.0)]), None);
        assert!(triangulate_point(&[at(0.0, 320.0), at(1.0, 440.0)]).is_some());
        // Under a millionth of a radian.
        assert_eq!(triangulate_point(&[at(0.0, 320.0), at(1e-7, 320.0 + 500.0 * 2e-7)]), None);
        for hostile in [f64::NAN, f64::INFINITY, f64::MAX, -f64::MAX] {
            assert_eq!(triangulate_point(&[at(0.0, 320.0), at(1.0, hostile)]), None, "{hostile}");
        }
    }
}
