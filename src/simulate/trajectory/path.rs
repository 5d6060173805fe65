//! Paths with a number of frames, given or chosen for a grade of rotation.

use crate::geometry::Pose;
use crate::simulate::Error;
use crate::structure::{MotionGrade, grade_of, typical_rotation};

use super::bounds::MOST_FRAMES;

/// A path that can be walked in any number of frames.
pub(super) trait Path {
    /// The frames and the grade that were asked for.
    fn asked(&self) -> (Option<u64>, Option<MotionGrade>);

    /// Refuses parameters that make no path.
    fn check(&self) -> Result<(), Error>;

    /// The fewest frames of which the path can be made.
    fn fewest(&self) -> usize;

    /// The poses `world_from_camera`, for parameters that are checked and at least the fewest frames.
    fn walk(&self, frames: usize) -> Result<Vec<Pose>, Error>;
}

/// The poses of a path.
pub(super) fn poses(path: &impl Path) -> Result<Vec<Pose>, Error> {
    path.check()?;
    let frames = match path.asked() {
        (Some(frames), None) => frame_count(frames, path.fewest())?,
        (None, Some(grade)) => frames_for(path, grade)?,
        (None, None) => return Err(Error::value("trajectory.frames", "`frames` or `motion`", "neither")),
        (Some(_), Some(_)) => {
            return Err(Error::value("trajectory.motion", "one of `frames` and `motion`", "both"));
        }
    };
    path.walk(frames)
}

/// A number of frames that a path can have.
pub(super) fn frame_count(frames: u64, fewest: usize) -> Result<usize, Error> {
    usize::try_from(frames).ok().filter(|frames| (fewest..=MOST_FRAMES).contains(frames)).ok_or_else(|| {
        let expected = format!("a whole number from {fewest} to {MOST_FRAMES}");
        Error::value("trajectory.frames", expected, frames)
    })
}

/// The median rotation of a path between frames that turn, radians.
pub(super) fn rotation_of(poses: &[Pose]) -> Option<f64> {
    typical_rotation(poses.windows(2).map(|pair| (pair[0].inverse() * pair[1]).rotation_angle()))
}

/// The number of frames with which a path's typical rotation is nearest to that of a grade.
///
/// The rotation falls as frames are added: as 1/N, and on a sphere's even spiral as 1/√N. Each step scales the number
/// by how far the rotation was off, to the power that the two steps before it suggest.
fn frames_for(path: &impl Path, grade: MotionGrade) -> Result<usize, Error> {
    let wanted = grade.rotation_rad();
    let refused = |found: String| {
        Err(Error::value("trajectory.motion", format!("a path that can turn as `{}`", grade.name()), found))
    };
    let mut frames = path.fewest().max(1000);
    let mut best: Option<(f64, usize, f64)> = None;
    let mut before: Option<(usize, f64)> = None;
    for _ in 0..16 {
        let Some(rotation) = rotation_of(&path.walk(frames)?) else {
            break;
        };
        let off = if rotation > wanted { rotation / wanted } else { wanted / rotation };
        if best.is_none_or(|(least, ..)| off < least) {
            best = Some((off, frames, rotation));
        }
        let power = before.map_or(1.0, |(fewer, faster)| {
            let power = libm::log(frames as f64 / fewer as f64) / libm::log(faster / rotation);
            if power.is_finite() { power.clamp(0.5, 3.0) } else { 1.0 }
        });
        let next = scaled(frames, libm::pow(rotation / wanted, power)).clamp(path.fewest(), MOST_FRAMES);
        if off < 1.002 || next == frames {
            break;
        }
        before = Some((frames, rotation));
        frames = next;
    }
    match best {
        None => refused("one that does not turn".to_owned()),
        Some((_, frames, rotation)) if grade_of(rotation) == grade => Ok(frames),
        Some((_, frames, rotation)) => {
            refused(format!("{:.3} degrees a frame with {frames} frames", rotation.to_degrees()))
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, and is clamped after"
)]
fn scaled(frames: usize, factor: f64) -> usize {
    (frames as f64 * factor).round() as usize
}
