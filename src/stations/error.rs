//! What can go wrong between reading a sequence and writing it.

use std::path::PathBuf;

use crate::adjust;
use crate::covisibility;
use crate::evaluate;
use crate::geometry;
use crate::simulate;
use crate::structure::{CameraId, FrameId};
use crate::track;

/// Errors of this room.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A name that nothing can have.
    #[error("{name:?} is no name of {kind}: {reason}")]
    Name {
        /// What is named, with its article.
        kind: &'static str,
        /// The name.
        name: String,
        /// Why not.
        reason: &'static str,
    },
    /// A name that something has already.
    #[error("the sequence has {kind} `{name}` already: choose another name, or replace it")]
    Taken {
        /// What is named, with its article.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// Nothing of a name is there.
    #[error("expected {kind} {name}, found {there}")]
    Unknown {
        /// What is named, with its article.
        kind: &'static str,
        /// The name.
        name: String,
        /// What there is.
        there: String,
    },
    /// Several are there and none is meant more than the others.
    #[error("which {kind}? there are: {there}")]
    Several {
        /// What is named.
        kind: &'static str,
        /// What there is.
        there: String,
    },
    /// The sequence lacks what the work needs.
    #[error("the sequence has no {missing}{remedy}")]
    Missing {
        /// What it lacks.
        missing: &'static str,
        /// What makes it, from the punctuation on.
        remedy: &'static str,
    },
    /// Nothing of the reference has a true pose.
    #[error("expected frames with true poses, found none; an estimate can be the reference too ({there})")]
    NoTruth {
        /// Estimates that there are.
        there: String,
    },
    /// A camera that projects otherwise than estimators here do.
    #[error("sequence.json: {camera}: expected the model `{expected}`, found `{found}`")]
    CameraModel {
        /// The camera.
        camera: CameraId,
        /// The model that is known.
        expected: &'static str,
        /// Its model.
        found: String,
    },
    /// A frame's camera is not in the manifest.
    #[error("{frame}: its {camera} is not in the manifest")]
    UnknownCamera {
        /// The frame.
        frame: FrameId,
        /// Its camera.
        camera: CameraId,
    },
    /// A graph without factors.
    #[error(
        "the graph of `{estimate}` would be empty: none of its landmarks is seen in {least_views} frames or more ({not_in_map} landmarks that were measured are not in its map)"
    )]
    EmptyGraph {
        /// The estimate.
        estimate: String,
        /// Frames that have to see a landmark.
        least_views: usize,
        /// Landmarks that were measured and are not in the map.
        not_in_map: usize,
    },
    /// Options that do not go together.
    #[error("{option} goes with {with}")]
    Idle {
        /// The option.
        option: &'static str,
        /// What has a use for it.
        with: &'static str,
    },
    /// A row that no estimate can have.
    #[error("{table} row {row}: expected {expected}, found {found}")]
    Row {
        /// Table name.
        table: &'static str,
        /// Row number, counted from 0.
        row: usize,
        /// What should be there.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// Something stands twice.
    #[error("{table} row {row}: {id} stands there twice")]
    Twice {
        /// Table name.
        table: &'static str,
        /// Row number, counted from 0.
        row: usize,
        /// What stands twice.
        id: String,
    },
    /// The true pose of a frame is none.
    #[error("frames: the true pose of {frame}: {cause}")]
    FirstPose {
        /// The frame.
        frame: FrameId,
        /// What is wrong with it.
        cause: geometry::Error,
    },
    /// A name that only a dataset of images has.
    #[error(
        "{name} is not simulated, it comes from images: `os fetch {name}` gets them and says how to convert them"
    )]
    FromImages {
        /// The name.
        name: String,
    },
    /// A recipe cannot be read.
    #[error("{}: {cause}", path.display())]
    RecipeFile {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A recipe that is too long.
    #[error("{}: expected a recipe of at most {limit} bytes", path.display())]
    RecipeSize {
        /// The file.
        path: PathBuf,
        /// Permitted size.
        limit: u64,
    },
    /// A recipe that is none.
    #[error("{name}: {cause}")]
    Recipe {
        /// Its name or file.
        name: String,
        /// What is wrong with it.
        cause: simulate::Error,
    },
    /// A recipe in JSON that is none.
    #[error("{name}: {cause}")]
    RecipeJson {
        /// Its name or file.
        name: String,
        /// What is wrong with it.
        cause: serde_json::Error,
    },
    /// From the room `simulate`.
    #[error(transparent)]
    Simulate(#[from] simulate::Error),
    /// From the room `track`.
    #[error(transparent)]
    Track(#[from] track::Error),
    /// From the room `covisibility`.
    #[error(transparent)]
    Covisibility(#[from] covisibility::Error),
    /// From the room `adjust`.
    #[error(transparent)]
    Adjust(#[from] adjust::Error),
    /// From the room `evaluate`.
    #[error("{name}: {cause}")]
    Evaluate {
        /// The estimate, or `truth`.
        name: String,
        /// What is wrong with it.
        cause: evaluate::Error,
    },
    /// Threads could not be started.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}
