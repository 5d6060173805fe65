//! The residual of a line observation.

use super::{Error, PinholeCamera, PluckerLine, Pose};
use nalgebra::{Point2, Vector2};

/// Signed distances from the two ends of a measured segment to the image of a line.
///
/// `r = [ d(s, l), d(e, l) ]`, `d(u, l) = uᵀ l / √(l₀² + l₁²)`, `l = K̃ · moment(ᶜL)`
///
/// * `camera_from_world` — pose of the world in the camera, metres.
/// * `line_in_world` — the landmark; only the endless line counts, not its ends.
/// * `segment_px` — start and end, pixels.
///
/// Returns `[start, end]`, pixels; the sign tells the side of the line.
///
/// # Errors
/// [`Error::NoImage`] when the line passes through the camera centre, or has its image at infinity.
///
/// # Source
/// Open-Structure (Li et al. 2024), section IV-A, residual `r_l`.
pub fn line_residual(
    camera: &PinholeCamera,
    camera_from_world: &Pose,
    line_in_world: &PluckerLine,
    segment_px: [Point2<f64>; 2],
) -> Result<Vector2<f64>, Error> {
    let image = line_in_world.image(camera, camera_from_world)?;
    let [start, end] = segment_px.map(|pixel| image.dot(&pixel.to_homogeneous()));
    Ok(Vector2::new(start, end))
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{camera, circle, in_front, visible_segment};
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn exact_observations_have_no_residual(
            camera in camera(), pose in circle(), segment in visible_segment(),
        ) {
            let ends = [segment.start, segment.end].map(|end| camera.project(pose * end).unwrap());
            let line = segment.plucker().unwrap();
            let Ok(residual) = line_residual(&camera, &pose, &line, ends) else { return Ok(()) };
            // Pixels up to 1000 from 4 m; a line seen nearly end-on loses digits.
            prop_assume!((ends[1] - ends[0]).norm() > 1.0);
            prop_assert!(residual.norm() < 1e-9, "{residual}");
        }

        #[test]
        fn a_shift_across_the_line_is_the_residual(
            camera in camera(), pose in circle(), segment in visible_segment(), shift in -9.0..9.0_f64,
        ) {
            let ends = [segment.start, segment.end].map(|end| camera.project(pose * end).unwrap());
            let along = ends[1] - ends[0];
            prop_assume!(along.norm() > 1.0);
            let line = segment.plucker().unwrap();
            // In image coordinates the normal is along turned by +90 degrees, for the moment comes from start × end.
            let across = Vector2::new(-along.y, along.x).normalize();
            let moved = [ends[0] + across * shift, ends[1] - across * shift];
            let residual = line_residual(&camera, &pose, &line, moved).unwrap();
            prop_assert!((residual - Vector2::new(shift, -shift)).norm() < 1e-9, "{residual}");
        }

        #[test]
        fn the_residual_does_not_depend_on_where_the_world_begins(
            camera in camera(), pose in circle(), segment in visible_segment(), p in in_front(),
            world_from_other in super::super::strategies::pose(),
        ) {
            let pixels = [camera.project(p).unwrap(); 2];
            let line = segment.plucker().unwrap();
            let moved = line.transformed(&world_from_other.inverse());
            let Ok(here) = line_residual(&camera, &pose, &line, pixels) else { return Ok(()) };
            prop_assume!(line.transformed(&pose).moment.cross(&Vector3::z()).norm() > 0.1);
            let there = line_residual(&camera, &(pose * world_from_other), &moved, pixels).unwrap();
            prop_assert!((here - there).norm() < 1e-8, "{here} {there}");
        }
    }
}
