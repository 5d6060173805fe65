//! What the page's own code is given of a sequence: a description in JSON and a block of columns.

use serde::Serialize;
use serde_json::Value;

use super::columns::{Column, Columns};
use super::error::Error;
use super::features::{FeatureColumns, Gathered, ViewCamera};
use super::scene::{self, Landmarks, Path, SceneColumns, ViewGroup};
use crate::structure::{CameraId, Frame, LineId, Manifest};
use nalgebra::{Point3, Vector3};
use std::collections::BTreeMap;

/// A path in the legend.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct ViewPath {
    /// `ground truth`, or the name of the estimate.
    pub(super) name: String,
    /// Classes that give its colour and dashes.
    pub(super) class: String,
}

/// A sequence, as the page draws it.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ViewData {
    cameras: Vec<ViewCamera>,
    frame_ids: Value,
    /// Seconds since the first frame.
    seconds: Column,
    /// Place in `cameras` of each frame's camera; 255 where it is not known.
    frame_cameras: Column,
    groups: Vec<ViewGroup>,
    paths: Vec<ViewPath>,
    scene: SceneColumns,
    points: FeatureColumns,
    lines: FeatureColumns,
    #[serde(skip)]
    block: String,
}

/// What a scene is made of.
pub(super) struct Shown<'a> {
    pub(super) manifest: &'a Manifest,
    pub(super) frames: &'a [Frame],
    pub(super) landmarks: &'a Landmarks,
    pub(super) groups: Vec<ViewGroup>,
    /// Place of each line's group.
    pub(super) places: &'a BTreeMap<LineId, usize>,
    pub(super) edges: &'a [[Point3<f64>; 2]],
    /// The true path first.
    pub(super) paths: Vec<(ViewPath, Path)>,
    pub(super) upward: Vector3<f64>,
    pub(super) gathered: &'a Gathered,
}

impl ViewData {
    pub(super) fn new(shown: Shown<'_>) -> Self {
        let mut columns = Columns::default();
        let frames = shown.frames;
        let first = frames.first().map_or(0, |frame| frame.stamp_nanos);
        let seconds: Vec<f64> = frames
            .iter()
            .map(|frame| (i128::from(frame.stamp_nanos) - i128::from(first)) as f64 * 1e-9)
            .collect();
        let cameras = &shown.manifest.cameras;
        let camera = |camera_id: CameraId| {
            let place = cameras.iter().position(|camera| camera.camera_id == camera_id);
            place.and_then(|place| u8::try_from(place).ok()).unwrap_or(u8::MAX)
        };
        let frame_cameras: Vec<u8> = frames.iter().map(|frame| camera(frame.camera_id)).collect();
        let (paths, poses): (Vec<ViewPath>, Vec<Path>) = shown.paths.into_iter().unzip();
        let scene =
            SceneColumns::new(shown.landmarks, shown.places, shown.edges, &poses, shown.upward, &mut columns);
        let points = shown.gathered.points.columns(&shown.landmarks.point_index(), &mut columns);
        let lines = shown.gathered.lines.columns(&shown.landmarks.line_index(), &mut columns);
        Self {
            cameras: cameras.iter().map(ViewCamera::of).collect(),
            frame_ids: scene::ids(frames.iter().map(|frame| frame.frame_id.0)),
            seconds: columns.f32(&seconds),
            frame_cameras: columns.u8(&frame_cameras),
            groups: shown.groups,
            paths,
            scene,
            points,
            lines,
            block: columns.base64(),
        }
    }

    /// The groups, the largest first.
    pub(super) fn groups(&self) -> &[ViewGroup] {
        &self.groups
    }

    /// The paths, the true one first.
    pub(super) fn paths(&self) -> &[ViewPath] {
        &self.paths
    }

    /// Whether there are edges of objects.
    pub(super) fn has_edges(&self) -> bool {
        self.scene.has_edges()
    }

    /// The description as JSON that may stand in a `script` element, where `<` would be read as markup.
    pub(super) fn description(&self) -> Result<String, Error> {
        Ok(serde_json::to_string(self).map_err(Error::Encode)?.replace('<', "\\u003c"))
    }

    /// The block of columns in base64.
    pub(super) fn block(&self) -> &str {
        &self.block
    }
}
