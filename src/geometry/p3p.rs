//! The poses of a camera from three points and their directions.

use super::Pose;
use super::absolute_orientation::absolute_orientation;
use nalgebra::linalg::SymmetricEigen;
use nalgebra::{Matrix3, Point3, Vector3};

/// Newton steps on the three distances; the closed form is near enough for quadratic convergence.
const STEPS: usize = 8;

/// All poses of a camera in which three points lie in given directions: none to four.
///
/// Seeks the distances `λᵢ` along the rays with `|λᵢ yᵢ − λⱼ yⱼ|² = |xᵢ − xⱼ|²`. Any two of these equations, homogeneous in `λ`, are
/// conics; one conic of their pencil is a pair of lines, found by a cubic and an eigendecomposition, and each line meets the pencil
/// in at most two points. Newton's method over the three distances takes off the rounding.
///
/// * `points` — in the world, metres; `rays` — where the camera sees them, unit vectors in the camera.
///
/// Returns each `camera_from_world`; none when the points lie on one line.
///
/// # Source
/// Persson and Nordberg 2018, *Lambda Twist*: the pencil of conics; the pose itself is by absolute orientation.
#[must_use]
pub fn p3p(points: &[Point3<f64>; 3], rays: &[Vector3<f64>; 3]) -> Vec<Pose> {
    let sides = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| (points[i] - points[j]).norm_squared());
    let area = (points[1] - points[0]).cross(&(points[2] - points[0])).norm_squared();
    let longest = sides[0].max(sides[1]).max(sides[2]);
    let finite =
        points.iter().flat_map(|point| point.iter()).chain(rays.iter().flatten()).all(|n| n.is_finite());
    if !finite || area.is_nan() || area <= 1e-14 * longest * longest {
        return Vec::new();
    }
    // Lengths relative to the longest side.
    let sides = sides.map(|side| side / longest);
    let [b01, b02, b12] = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| rays[i].dot(&rays[j]));
    let forms = [
        Matrix3::new(1.0, -b01, 0.0, -b01, 1.0, 0.0, 0.0, 0.0, 0.0),
        Matrix3::new(1.0, 0.0, -b02, 0.0, 0.0, 0.0, -b02, 0.0, 1.0),
        Matrix3::new(0.0, 0.0, 0.0, 0.0, 1.0, -b12, 0.0, -b12, 1.0),
    ];
    let first = forms[0] * sides[2] - forms[2] * sides[0];
    let second = forms[1] * sides[2] - forms[2] * sides[1];
    let mut poses: Vec<Pose> = Vec::new();
    for distances in common_zeros(&first, &second) {
        let Some(distances) = scaled(distances, &forms, &sides) else { continue };
        let distances = distances * longest.sqrt();
        let in_camera = [0, 1, 2].map(|k| Point3::from(rays[k] * distances[k]));
        let pairs = [0, 1, 2].map(|k| (points[k], in_camera[k]));
        let Some(pose) = absolute_orientation(pairs.into_iter()) else { continue };
        let same = |other: &Pose| {
            let between = other.inverse() * pose;
            between.rotation_angle() < 1e-7 && between.translation().norm() < 1e-7 * distances.norm()
        };
        if !poses.iter().any(same) {
            poses.push(pose);
        }
    }
    poses
}

/// Directions `λ` at which two quadratic forms are zero.
fn common_zeros(first: &Matrix3<f64>, second: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    let mut zeros = Vec::new();
    let Some(root) = pencil_root(first, second) else { return zeros };
    let degenerate = first + second * root;
    let Some(eigen) = SymmetricEigen::try_new(degenerate, f64::EPSILON, 200) else { return zeros };
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let (low, high) = (eigen.eigenvalues[order[0]], eigen.eigenvalues[order[2]]);
    if !(low < 0.0 && high > 0.0) {
        return zeros;
    }
    let [low_axis, middle, high_axis] = order.map(|column| eigen.eigenvectors.column(column).into_owned());
    // The lines √high · (h·λ) = ± √−low · (l·λ): all λ = s (√−low h ± √high l) + t m.
    let other = if first.norm() > second.norm() { first } else { second };
    for sign in [-1.0, 1.0] {
        let along = high_axis * (-low).sqrt() + low_axis * (sign * high.sqrt());
        let along = along.normalize();
        let (a, b, c) = (
            (along.transpose() * other * along)[0],
            (along.transpose() * other * middle)[0],
            (middle.transpose() * other * middle)[0],
        );
        // a s² + 2 b s t + c t² = 0; a double root with rounding is kept.
        let root = (b * b - a * c).max(0.0).sqrt();
        if b * b - a * c < -1e-9 * (b * b + (a * c).abs()) {
            continue;
        }
        let larger = -b - root.copysign(b);
        for (s, t) in [(larger, a), (c, larger)] {
            let zero = along * s + middle * t;
            let zero = if zero.sum() < 0.0 { -zero } else { zero };
            if zero.norm() > 0.0 && zero.iter().all(|distance| *distance > 0.0) {
                zeros.push(zero.normalize());
            }
        }
    }
    zeros
}

/// A `γ` with `det(first + γ second) = 0`.
fn pencil_root(first: &Matrix3<f64>, second: &Matrix3<f64>) -> Option<f64> {
    let columns = |m: &Matrix3<f64>| [0, 1, 2].map(|k| m.column(k).into_owned());
    let ([f0, f1, f2], [s0, s1, s2]) = (columns(first), columns(second));
    let det = |a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>| a.dot(&b.cross(c));
    let c3 = det(&s0, &s1, &s2);
    let c2 = det(&f0, &s1, &s2) + det(&s0, &f1, &s2) + det(&s0, &s1, &f2);
    let c1 = det(&s0, &f1, &f2) + det(&f0, &s1, &f2) + det(&f0, &f1, &s2);
    let c0 = det(&f0, &f1, &f2);
    real_root([c0, c1, c2, c3])
}

/// A real root of `c₀ + c₁x + c₂x² + c₃x³`: the one where the slope is steepest, for that root is the best known.
fn real_root(c: [f64; 4]) -> Option<f64> {
    let largest = c.iter().fold(0.0_f64, |most, k| most.max(k.abs()));
    if !(largest.is_finite() && largest > 0.0) {
        return None;
    }
    let value = |x: f64| ((c[3] * x + c[2]) * x + c[1]) * x + c[0];
    let slope = |x: f64| (3.0 * c[3] * x + 2.0 * c[2]) * x + c[1];
    let mut candidates = Vec::with_capacity(3);
    if c[3].abs() < 1e-13 * largest {
        let root = (c[1] * c[1] - 4.0 * c[2] * c[0]).max(0.0).sqrt();
        let q = -0.5 * (c[1] + root.copysign(c[1]));
        candidates.extend([q / c[2], c[0] / q]);
    } else {
        let [b0, b1, b2] = [c[0] / c[3], c[1] / c[3], c[2] / c[3]];
        let shift = b2 / 3.0;
        let p = b1 - b2 * shift;
        let q = (2.0 * shift * shift - b1) * shift + b0;
        let discriminant = 0.25 * q * q + p * p * p / 27.0;
        if discriminant >= 0.0 {
            let u = libm::cbrt(-0.5 * q - discriminant.sqrt().copysign(q));
            candidates.push(u - if u == 0.0 { 0.0 } else { p / (3.0 * u) } - shift);
        } else {
            let radius = 2.0 * (-p / 3.0).sqrt();
            let angle = libm::acos((3.0 * q / (p * radius)).clamp(-1.0, 1.0)) / 3.0;
            for turn in 0..3 {
                let angle = angle - f64::from(turn) * 2.0 * std::f64::consts::FRAC_PI_3;
                candidates.push(radius * libm::cos(angle) - shift);
            }
        }
    }
    let mut root = candidates
        .into_iter()
        .filter(|x| x.is_finite())
        .max_by(|a, b| slope(*a).abs().total_cmp(&slope(*b).abs()))?;
    for _ in 0..STEPS {
        let next = root - value(root) / slope(root);
        if !next.is_finite() || value(next).abs() >= value(root).abs() {
            break;
        }
        root = next;
    }
    Some(root)
}

/// The multiple of a direction that has the distances asked for, after Newton's method on them.
fn scaled(direction: Vector3<f64>, forms: &[Matrix3<f64>; 3], sides: &[f64; 3]) -> Option<Vector3<f64>> {
    let norms = forms.map(|form| (direction.transpose() * form * direction)[0]);
    let scale = sides.iter().sum::<f64>() / norms.iter().sum::<f64>();
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let mut distances = direction * scale.sqrt();
    let miss = |at: &Vector3<f64>| Vector3::from_fn(|k, _| (at.transpose() * forms[k] * at)[0] - sides[k]);
    let mut error = miss(&distances);
    for _ in 0..STEPS {
        let rows = [0, 1, 2].map(|k| (forms[k] * distances * 2.0).transpose());
        let Some(step) = Matrix3::from_rows(&rows).lu().solve(&error) else { break };
        let next = distances - step;
        let there = miss(&next);
        if there.norm().is_nan() || there.norm() >= error.norm() {
            break;
        }
        (distances, error) = (next, there);
    }
    // What Newton's method cannot bring to zero is the double root of a pencil without solution.
    (error.norm() < 1e-6 && distances.iter().all(|distance| *distance > 0.0)).then_some(distances)
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{circle, pose, visible_point};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn the_true_pose_is_among_the_poses(
            camera_from_world in circle(), points in prop::array::uniform3(visible_point()),
        ) {
            let area = (points[1] - points[0]).cross(&(points[2] - points[0])).norm();
            prop_assume!(area > 0.05);
            let rays = points.map(|point| (camera_from_world * point).coords.normalize());
            let poses = p3p(&points, &rays);
            prop_assert!(poses.len() <= 4);
            let error = |pose: &Pose| (pose.inverse() * camera_from_world).log().norm();
            let least = poses.iter().map(error).fold(f64::INFINITY, f64::min);
            // A double root keeps half of the digits.
            prop_assert!(least < 1e-5, "{least:e} of {}", poses.len());
        }

        #[test]
        fn every_pose_sees_the_points_along_their_rays(
            camera_from_world in circle(), points in prop::array::uniform3(visible_point()), world in pose(),
        ) {
            let rays = points.map(|point| (camera_from_world * point).coords.normalize());
            let moved = points.map(|point| world * point);
            for pose in p3p(&moved, &rays) {
                for (point, ray) in moved.iter().zip(&rays) {
                    prop_assert!(((pose * *point).coords.normalize() - ray).norm() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn points_on_a_line_and_numbers_that_are_none_have_no_pose() {
        let along = [0.0, 1.0, 3.0].map(|x| Point3::new(x, 0.0, 4.0));
        assert!(p3p(&along, &along.map(|point| point.coords.normalize())).is_empty());
        let hostile =
            [Point3::new(f64::NAN, 0.0, 1.0), Point3::new(1.0, 0.0, 4.0), Point3::new(0.0, 1.0, 4.0)];
        assert!(p3p(&hostile, &hostile.map(|point| point.coords.normalize())).is_empty());
        assert!(p3p(&[Point3::new(1.0, 2.0, 3.0); 3], &[Vector3::z(); 3]).is_empty());
    }
}
