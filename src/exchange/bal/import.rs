//! From a problem of BAL to a sequence.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::problem::BalProblem;
use super::radial::Radial;
use crate::exchange::Error;
use crate::exchange::imported::{Draft, ImportNames, Imported};
use crate::geometry::{PinholeCamera, Pose};
use crate::structure::{Camera, CameraId, Distortion, FrameId, PointId, PoseRow, registry};

/// Half a turn about x: between BAL's camera (z backwards, y up) and ours (z forwards, y down), either way.
pub(super) fn half_turn() -> Pose {
    Pose::new(UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0)), Vector3::zeros())
}

/// A problem of BAL as a sequence: cameras, frames and points have their places in the file as ids.
///
/// Cameras get right-down-forward axes and an image just large enough for their pixels, whose middle is the principal
/// point: BAL says no size. Distortion is removed from the pixels and stands in the camera as `brown-conrady`; the
/// factor's information `JᵀJ`, with the derivative `J` of the distortion, keeps the weight of each pixel. Where
/// there is no distortion, the declared noise (1 px) applies.
///
/// # Errors
/// [`Error::Unfit`] for a focal length that is not above 0, or a camera that is no rigid transform.
pub fn from_bal(problem: &BalProblem, names: &ImportNames) -> Result<Imported, Error> {
    let mut draft = Draft { graph: names.graph.clone(), ..Draft::default() };
    let id = |place: usize| i64::try_from(place).unwrap_or(i64::MAX);
    // Undistorted pixels first: they say how large an image is.
    let mut seen = Vec::new();
    let mut reach = vec![[0.0_f64; 2]; problem.cameras.len()];
    let mut unseen = 0;
    for observation in &problem.observations {
        let Some(camera) = problem.cameras.get(observation.camera) else { continue };
        let flat = observation.pixel.map(|part| part / camera.focal);
        let ideal = Radial(camera.radial).undistort(flat).map(|flat| {
            let pixel = flat.map(|part| camera.focal * part);
            (flat, pixel, Radial(camera.radial).weight(flat))
        });
        let is_usable = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
        let ideal = ideal.filter(|(_, pixel, weight)| is_usable(pixel) && is_usable(weight));
        let Some((flat, [x, y], _)) = ideal else {
            unseen += 1;
            continue;
        };
        let most = &mut reach[observation.camera];
        *most = [most[0].max(x.abs()), most[1].max(y.abs())];
        seen.push((observation, flat, [x, y]));
    }
    draft
        .remarks
        .lost(unseen, "observations are left out: no ray of their camera's lens leads to their pixel");
    for (place, camera) in problem.cameras.iter().enumerate() {
        let what = || format!("camera {place}");
        if camera.focal.is_nan() || camera.focal <= 0.0 {
            return Err(Error::unfit(what(), "a focal length above 0", format!("{:?}", camera.focal)));
        }
        let [width, height] = reach[place].map(size);
        let centre = |size: u32| 0.5 * f64::from(size - 1);
        let (cx, cy) = (centre(width), centre(height));
        let pinhole = PinholeCamera { fx: camera.focal, fy: camera.focal, cx, cy, width, height };
        let mut row = Camera::pinhole(CameraId(id(place)), &pinhole, registry::PIXEL_CENTER);
        let [k1, k2] = camera.radial;
        if !Radial(camera.radial).is_none() {
            let coefficients = vec![k1, k2, 0.0, 0.0, 0.0];
            row.removed_distortion =
                Some(Distortion { model: registry::BROWN_CONRADY.to_owned(), coefficients });
        }
        draft.cameras.push(row);
        draft.camera_of_frame.insert(FrameId(id(place)), CameraId(id(place)));
        let camera_from_world = half_turn() * camera.camera_from_world();
        draft.add_pose(id(place), false, PoseRow::from(&camera_from_world.inverse()))?;
    }
    for (place, point) in problem.points.iter().enumerate() {
        draft.add_point(id(place), *point);
    }
    for (observation, flat, [x, y]) in seen {
        let camera = &draft.cameras[observation.camera];
        let pixel = vec![camera.cx + x, camera.cy - y];
        let radial = Radial(problem.cameras[observation.camera].radial);
        let information = (!radial.is_none()).then(|| {
            // y points the other way here, which turns the sign beside the diagonal.
            radial.weight([flat[0], -flat[1]]).to_vec()
        });
        let (frame, point) = (FrameId(id(observation.camera)), PointId(id(observation.point)));
        draft.add_view(frame, point, pixel, information);
    }
    Ok(draft.finish("bal", names))
}

/// The odd size of an image that reaches so far from its middle, at least 3 pixels.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
fn size(reach: f64) -> u32 {
    2 * (reach.ceil().clamp(1.0, 1e6) as u32) + 1
}
