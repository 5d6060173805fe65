//! Frames: stamps, cameras and true poses, and the way to them by id.

use nalgebra::{Matrix3, Vector3};

use super::finding::{Detail, Findings};
use super::ids::IdIndex;
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use crate::geometry::PinholeCamera;
use crate::structure::registry;
use crate::structure::{Camera, Frame, PoseRow, Record};

/// How far the length of a quaternion may be from one: four decimals are off by at most 1e-4.
const QUATERNION_TOLERANCE: f64 = 1e-3;

/// A camera, ready for projection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub(crate) pinhole: PinholeCamera,
    /// Where the image begins: the coordinate of the outer edge of the first pixel.
    pub(crate) edge: f64,
}

impl View {
    pub(crate) fn new(camera: &Camera) -> Self {
        let edge = if camera.pixel_origin == registry::PIXEL_CORNER { 0.0 } else { -0.5 };
        Self { pinhole: camera.projection(), edge }
    }

    /// Whether a pixel lies in the image widened by a margin.
    #[inline]
    pub(crate) fn contains(&self, u: f64, v: f64, margin: f64) -> bool {
        let low = self.edge - margin;
        let high = |size: u32| f64::from(size) + self.edge + margin;
        // A number that is not finite is another rule's finding.
        !(u < low || v < low || u > high(self.pinhole.width) || v > high(self.pinhole.height))
    }
}

/// A true pose, inverted and ready for projection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraFromWorld {
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) translation: Vector3<f64>,
}

/// What the other tables need of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameEntry {
    pub(crate) stamp: i64,
    /// Place of the camera in the manifest.
    pub(crate) camera: Option<usize>,
    pub(crate) pose: Option<CameraFromWorld>,
    /// Whether the pose is not known, rather than one that cannot be used.
    pub(crate) without_pose: bool,
}

/// The frames of a sequence by id.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameIndex {
    index: IdIndex,
    entries: Vec<FrameEntry>,
    /// Whether the table is in order, so that the frame before another one is the one before it here.
    pub(crate) ordered: bool,
    /// Stamps of the first and the last frame in table order.
    pub(crate) first_and_last_stamp: Option<(i64, i64)>,
}

impl FrameIndex {
    /// The place of a frame; `hint` is where the last one was.
    #[inline]
    pub(crate) fn find(&self, frame_id: i64, hint: &mut usize) -> Option<usize> {
        if self.index.ids().get(*hint) == Some(&frame_id) {
            return Some(*hint);
        }
        let place = self.index.get(frame_id)?;
        *hint = place;
        Some(place)
    }

    pub(crate) fn contains(&self, frame_id: i64) -> bool {
        self.index.get(frame_id).is_some()
    }

    pub(crate) fn ids(&self) -> &[i64] {
        self.index.ids()
    }

    pub(crate) fn entry(&self, place: usize) -> &FrameEntry {
        &self.entries[place]
    }

    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }
}

/// Checks a stored quaternion.
pub(crate) fn quaternion(pose: &PoseRow, row: u64, table: &'static str, findings: &mut Findings) {
    let norm = pose.rotation_xyzw.iter().map(|part| part * part).sum::<f64>().sqrt();
    if norm.is_finite() && (norm - 1.0).abs() > QUATERNION_TOLERANCE {
        findings.add(RuleId::QuaternionUnit, Some(table), || {
            Detail::new("a quaternion of length 1 within 1e-3", format!("length {norm:.6}")).row(row)
        });
    }
}

/// Checks the table `frames`; `cameras` is `None` when the manifest does not say.
pub(crate) fn frames(
    shared: &Shared<'_>,
    cameras: Option<&[Camera]>,
    findings: &mut Findings,
) -> (FrameIndex, Outcome) {
    const TABLE: &str = "frames";
    let mut rows: Vec<(i64, FrameEntry)> = Vec::new();
    let mut before: Option<i64> = None;
    let mut stamps: Option<(i64, i64)> = None;
    let outcome = check::<Frame>(shared, findings, |batch, first_row, _, findings| {
        for (row, frame) in (first_row..).zip(batch) {
            let stamp = frame.stamp_nanos;
            stamp_in_order(before, stamp, row, frame, findings);
            before = Some(stamp);
            stamps = Some((stamps.map_or(stamp, |stamps| stamps.0), stamp));
            let camera = cameras.and_then(|cameras| {
                let place = cameras.iter().position(|camera| camera.camera_id == frame.camera_id);
                if place.is_none() {
                    findings.add(RuleId::CameraKnown, Some(TABLE), || {
                        let expected = "a camera of the manifest";
                        Detail::new(expected, frame.camera_id.to_string()).row(row).id(frame.frame_id)
                    });
                }
                place
            });
            let pose = pose(frame, row, findings);
            let without_pose = frame.pose_columns().iter().all(Option::is_none);
            rows.push((frame.frame_id.0, FrameEntry { stamp, camera, pose, without_pose }));
        }
    });
    rows.sort_by_key(|(id, _)| *id);
    rows.dedup_by_key(|(id, _)| *id);
    let (ids, entries) = rows.into_iter().unzip();
    let ordered = outcome.ordered;
    (FrameIndex { index: IdIndex::new(ids), entries, ordered, first_and_last_stamp: stamps }, outcome)
}

fn stamp_in_order(before: Option<i64>, stamp: i64, row: u64, frame: &Frame, findings: &mut Findings) {
    let expected = match before {
        _ if stamp < 0 => "0 ns or more".to_owned(),
        Some(before) if stamp < before => format!("{before} ns or more"),
        _ => return,
    };
    findings.add(RuleId::StampsOrdered, Some(Frame::TABLE.name), || {
        Detail::new(expected, format!("{stamp} ns")).row(row).id(frame.frame_id)
    });
}

fn pose(frame: &Frame, row: u64, findings: &mut Findings) -> Option<CameraFromWorld> {
    let columns = frame.pose_columns();
    let present = columns.iter().flatten().count();
    if present != 0 && present != columns.len() {
        findings.add(RuleId::PoseWhole, Some(Frame::TABLE.name), || {
            let expected = "all seven pose columns, or none";
            Detail::new(expected, format!("{present} of them")).row(row).id(frame.frame_id)
        });
    }
    let stored = frame.world_from_camera()?;
    quaternion(&stored, row, Frame::TABLE.name, findings);
    let camera_from_world = stored.pose().ok()?.inverse();
    Some(CameraFromWorld {
        rotation: camera_from_world.rotation_matrix(),
        translation: camera_from_world.translation(),
    })
}
