//! Laying an estimate on its reference.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::nearest_rotation::nearest_rotation;
use super::{Alignment, AlignmentKind, Error, Matched, Similarity};
use crate::geometry::Pose;

/// Positions count as lying on a line when the second singular value of their covariance is under this part of the first:
/// a micrometre across for a metre along, in both trajectories.
const FLATTEST: f64 = 1e-12;

/// The similarity transform that lays the estimate on the reference.
///
/// `s, R, t = argmin Σ |y_i − (s R x_i + t)|²` over the positions x of the estimate and y of the reference, with
/// `R = U S Vᵀ`, `s = trace(D S) / σ_x²` (1 for [`AlignmentKind::Se3`]) and `t = ȳ − s R x̄`, where
/// `U D Vᵀ = 1/n Σ (y_i − ȳ)(x_i − x̄)ᵀ`. For [`AlignmentKind::Origin`] it is `y_0 x_0⁻¹` of the first poses.
///
/// # Errors
/// [`Error::Degenerate`] when a rotation or scale is asked for and the positions that count lie on a line or are fewer than
/// three; [`Error::NotFinite`] when squares overflow.
///
/// # Source
/// Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991.
pub fn align<I>(matched: &Matched<I>, alignment: Alignment) -> Result<Similarity, Error> {
    let count = alignment.first.unwrap_or(usize::MAX).min(matched.reference.len());
    let (reference, estimate) = (&matched.reference[..count], &matched.estimate[..count]);
    match alignment.kind {
        AlignmentKind::None => Ok(Similarity::identity()),
        AlignmentKind::Origin => {
            let first = matched.reference.first().zip(matched.estimate.first());
            Ok(first.map_or_else(Similarity::identity, |(reference, estimate)| {
                (*reference * estimate.inverse()).into()
            }))
        }
        AlignmentKind::Se3 => Ok(umeyama(reference, estimate, false)?),
        AlignmentKind::Sim3 => Ok(umeyama(reference, estimate, true)?),
        AlignmentKind::Scale => {
            let scale = umeyama(reference, estimate, true)?.scale;
            Ok(Similarity { scale, pose: Pose::identity() })
        }
    }
}

fn umeyama(reference: &[Pose], estimate: &[Pose], with_scale: bool) -> Result<Similarity, Error> {
    let n = reference.len() as f64;
    let (to, from) = (mean(reference), mean(estimate));
    let mut covariance = Matrix3::zeros();
    let mut spread = 0.0;
    for (reference, estimate) in reference.iter().zip(estimate) {
        let (y, x) = (reference.translation() - to, estimate.translation() - from);
        covariance += y * x.transpose();
        spread += x.norm_squared();
    }
    covariance /= n;
    if let Some(found) = covariance.iter().chain([&spread]).find(|number| !number.is_finite()) {
        return Err(Error::NotFinite { of: "both", id: "their covariance".to_owned(), found: *found });
    }
    let nearest = nearest_rotation(&covariance);
    if nearest.ratio < FLATTEST || reference.len() < 3 {
        return Err(Error::Degenerate { poses: reference.len(), ratio: nearest.ratio });
    }
    let scale = if with_scale { nearest.trace / (spread / n) } else { 1.0 };
    let translation = to - nearest.rotation * from * scale;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nearest.rotation));
    // Through the components, which normalises.
    let pose = Pose::from_components(translation.into(), rotation.coords.into())
        .map_err(|source| Error::NoPose { of: "both", id: "their alignment".to_owned(), source })?;
    Ok(Similarity { scale, pose })
}

fn mean(poses: &[Pose]) -> Vector3<f64> {
    poses.iter().map(Pose::translation).sum::<Vector3<f64>>() / poses.len() as f64
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{path, pose, similarity};
    use super::*;
    use crate::structure::FrameId;
    use proptest::prelude::*;

    fn matched(reference: &[(FrameId, Pose)], estimate: &[(FrameId, Pose)]) -> Matched<FrameId> {
        Matched::by_id(reference, estimate).unwrap()
    }

    fn moved(path: &[(FrameId, Pose)], by: &Similarity) -> Vec<(FrameId, Pose)> {
        path.iter().map(|(id, pose)| (*id, by.pose(pose))).collect()
    }

    fn apart(a: &Similarity, b: &Similarity) -> f64 {
        (a.pose.inverse() * b.pose).log().norm() + (a.scale / b.scale - 1.0).abs()
    }

    proptest! {
        #[test]
        fn a_similarity_that_moved_a_path_is_found(path in path(), by in similarity()) {
            let found = align(&matched(&moved(&path, &by), &path), Alignment::SIM3).unwrap();
            // Rounding of coordinates up to about 30 m over a path of at least 1 m.
            prop_assert!(apart(&found, &by) < 1e-11, "{found:?} {by:?}");
        }

        #[test]
        fn a_motion_that_moved_a_path_is_found(path in path(), by in pose()) {
            let moved = matched(&moved(&path, &by.into()), &path);
            for alignment in [Alignment::SE3, Alignment::ORIGIN, Alignment::SE3.over_first(path.len())] {
                prop_assert!(apart(&align(&moved, alignment).unwrap(), &by.into()) < 1e-11);
            }
        }

        #[test]
        fn no_transform_near_the_best_is_better(
            path in path(),
            other in path(),
            by in prop::array::uniform6(-1e-3..1e-3_f64),
            scale in 0.999..1.001_f64,
        ) {
            let matched = matched(&path, &other);
            let sum = |by: &Similarity| -> f64 {
                let moved = matched.clone().moved(by);
                let pairs = moved.reference.iter().zip(&moved.estimate);
                pairs.map(|(y, x)| (y.translation() - x.translation()).norm_squared()).sum()
            };
            let nudge = Pose::exp(&by.into());
            for (alignment, scale) in [(Alignment::SE3, 1.0), (Alignment::SIM3, scale)] {
                let Ok(best) = align(&matched, alignment) else { continue };
                let near = Similarity { scale: best.scale * scale, pose: nudge * best.pose };
                // Rounding of a sum of some hundred square metres.
                prop_assert!(sum(&best) <= sum(&near) + 1e-11);
            }
        }
    }

    fn line(direction: Vector3<f64>, count: i64) -> Vec<(FrameId, Pose)> {
        let at =
            |id: i64| Pose::from_components((direction * id as f64).into(), [0.0, 0.0, 0.0, 1.0]).unwrap();
        (0..count).map(|id| (FrameId(id), at(id))).collect()
    }

    #[test]
    fn what_names_no_rotation_is_refused() {
        let direction = Vector3::new(0.3, 0.2, -0.7);
        for path in [line(direction, 50), line(Vector3::zeros(), 5), line(direction, 2), line(direction, 1)] {
            let matched = matched(&path, &path);
            for alignment in [Alignment::SE3, Alignment::SIM3, Alignment::SCALE] {
                let found = align(&matched, alignment);
                assert!(matches!(found, Err(Error::Degenerate { .. })), "{found:?}");
            }
            assert_eq!(align(&matched, Alignment::ORIGIN).map(|found| found.scale), Ok(1.0));
        }
    }

    #[test]
    fn a_path_as_flat_as_a_mirror_image_is_turned_and_not_mirrored() {
        let at = |x: f64, y: f64| Pose::from_components([x, y, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.5, 3.0)];
        let path: Vec<_> = (0..).map(FrameId).zip(corners.map(|(x, y)| at(x, y))).collect();
        let mirrored: Vec<_> = (0..).map(FrameId).zip(corners.map(|(x, y)| at(-x, y))).collect();
        let found = align(&matched(&path, &mirrored), Alignment::SE3).unwrap();
        // Half a turn about y does what the mirror did.
        assert!((found.pose.rotation_angle() - std::f64::consts::PI).abs() < 1e-14);
        assert!(
            (found.pose * nalgebra::Point3::new(-2.0, 1.0, 0.0) - nalgebra::Point3::new(2.0, 1.0, 0.0))
                .norm()
                < 1e-14
        );
    }
}
