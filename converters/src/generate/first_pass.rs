//! What one frame shows, in the world.

use open_structure::simulate::Random;

use super::{Error, Ledger, Options};
use crate::associate::{LiftedLine, LiftedPoint, PointRejection, lift, lift_point};
use crate::detect::{PointDetector, segments};
use crate::rgbd::{Raster, RawFrame, RawSequence};

/// What one frame shows, in the world.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) points: Vec<LiftedPoint>,
    pub(super) lines: Vec<LiftedLine>,
    pub(super) ledger: Ledger,
}

/// Detects points and segments of a frame and lifts them.
///
/// What is drawn depends on the seed, the frame's id and the segment's place, so neither threads nor other frames matter.
pub(super) fn look(
    raw: &RawSequence,
    raster: &Raster,
    options: &Options,
    frame: &RawFrame,
) -> Result<Shown, Error> {
    let images = raw.images(frame)?;
    let refused = |cause| Error::Detect { path: frame.colour.clone(), cause };
    let mut ledger = Ledger { frames: 1, ..Ledger::default() };

    let detected = PointDetector::new(options.points).and_then(|mut detector| detector.detect(&images.grey));
    let detected = detected.map_err(refused)?;
    ledger.points_detected = detected.len() as u64;
    let mut points = Vec::with_capacity(detected.len());
    for point in &detected {
        match lift_point(
            raster,
            &images.depth,
            &raw.depth_noise,
            raw.pose_sigma_m,
            &frame.world_from_camera,
            point,
            &options.point_landmarks,
        ) {
            Ok(point) => points.push(point),
            Err(PointRejection::NoDepth) => ledger.leave_out("point without depth", 1),
            Err(PointRejection::OnRim) => ledger.leave_out("point on a rim", 1),
        }
    }
    ledger.points_lifted = points.len() as u64;

    let detected = segments(&images.grey, &options.segments).map_err(refused)?;
    ledger.segments_detected = detected.len() as u64;
    let mut lines = Vec::with_capacity(detected.len());
    let mut random = Random::new(options.seed, "line trials", frame.frame_id.0.cast_unsigned());
    for segment in detected {
        match lift(
            raster,
            &images.depth,
            &frame.world_from_camera,
            segment,
            &raw.depth_noise,
            &options.lines,
            &mut random,
        ) {
            Ok(line) => lines.push(line),
            Err(rejected) => ledger.leave_out(rejected.reason(), 1),
        }
    }
    ledger.segments_lifted = lines.len() as u64;
    Ok(Shown { points, lines, ledger })
}
