//! Which frames become vertices of a graph.

use std::collections::BTreeMap;

use super::{Error, GraphOptions, KeyFrameRule};
use crate::geometry::{PinholeCamera, Pose};
use crate::structure::{Camera, Estimate, LineId, MeasuredFrame, PointId, TrajectoryPose};

/// A frame of a graph: its measurements, its estimated pose, its camera.
pub(super) struct Vertex<'a> {
    pub(super) frame: &'a MeasuredFrame,
    pub(super) row: &'a TrajectoryPose,
    pub(super) world_from_camera: Pose,
    pub(super) camera: PinholeCamera,
}

/// The frames of a graph, in their order; those without an estimated pose are counted.
pub(super) fn vertices<'a>(
    frames: &'a [MeasuredFrame],
    estimate: &'a Estimate,
    cameras: &[Camera],
    options: &GraphOptions,
) -> Result<(Vec<Vertex<'a>>, usize), Error> {
    options.check()?;
    let poses: BTreeMap<_, &TrajectoryPose> =
        estimate.trajectory.iter().map(|row| (row.frame_id, row)).collect();
    let mut found = Vec::new();
    let mut without_pose = 0;
    for frame in frames {
        let Some(&row) = poses.get(&frame.frame_id) else {
            without_pose += 1;
            continue;
        };
        let world_from_camera = row.world_from_camera().pose().map_err(|cause| Error::Pose {
            estimate: estimate.name.clone(),
            frame_id: frame.frame_id,
            cause,
        })?;
        let camera = cameras.iter().find(|camera| camera.camera_id == frame.camera_id);
        let camera = camera.ok_or(Error::Camera { frame_id: frame.frame_id, camera_id: frame.camera_id })?;
        found.push(Vertex { frame, row, world_from_camera, camera: camera.projection() });
    }
    if found.is_empty() {
        return Err(Error::NoPoses { estimate: estimate.name.clone() });
    }
    if let Some(rule) = options.key_frames {
        let keep = select(&found.iter().map(|vertex| vertex.frame).collect::<Vec<_>>(), rule);
        let mut keep = keep.into_iter();
        found.retain(|_| keep.next().unwrap_or(false));
    }
    Ok((found, without_pose))
}

/// Which frames are key frames: the first, the last, and those that share too little with the key frame before.
fn select(frames: &[&MeasuredFrame], rule: KeyFrameRule) -> Vec<bool> {
    let mut keep = vec![false; frames.len()];
    let mut last: Option<usize> = None;
    for (place, frame) in frames.iter().enumerate() {
        let is_key = place + 1 == frames.len()
            || last.is_none_or(|last| {
                let seen = frames[last];
                let had = seen.points.len() + seen.lines.len();
                let few = shared(seen, frame) as f64 <= rule.most_shared * had as f64;
                // A frame without measurements ties nothing together.
                let empty = frame.points.is_empty() && frame.lines.is_empty();
                place - last >= rule.longest_gap || (few && !empty)
            });
        if is_key {
            keep[place] = true;
            last = Some(place);
        }
    }
    keep
}

/// Landmarks that two frames measured; rows are sorted by id.
pub(super) fn shared(a: &MeasuredFrame, b: &MeasuredFrame) -> usize {
    let points =
        |frame: &MeasuredFrame| frame.points.iter().map(|row| row.point_id).collect::<Vec<PointId>>();
    let lines = |frame: &MeasuredFrame| frame.lines.iter().map(|row| row.line_id).collect::<Vec<LineId>>();
    common(&points(a), &points(b)) + common(&lines(a), &lines(b))
}

fn common<T: Ord>(a: &[T], b: &[T]) -> usize {
    let (mut i, mut j, mut count) = (0, 0, 0);
    while i < a.len() && j < b.len() {
        match a[i].cmp(&b[j]) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                count += 1;
                i += 1;
                j += 1;
            }
        }
    }
    count
}
