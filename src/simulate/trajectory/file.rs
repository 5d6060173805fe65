//! A path that a trajectory file holds.

use std::io::BufReader;
use std::path::{Path as FilePath, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{TimedPose, stamp_nanos};
use crate::geometry::Pose;
use crate::simulate::Error;
use crate::storage::{self, Found};
use crate::structure::{
    LARGEST_TRAJECTORY_FILE_BYTES, PoseRow, TrajectoryFileError, TrajectoryFormat, TrajectoryRow,
    read_trajectory,
};

/// The poses of a trajectory file: TUM, KITTI or EuRoC.
///
/// `world_from_camera = world_from_file · pose · body_from_camera`. Both are poses as `[tx, ty, tz, qx, qy, qz, qw]` and
/// leave things as they are if not given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// The file; a relative name begins at the recipe's folder.
    pub file: PathBuf,
    /// Its format; guessed from the content if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<TrajectoryFormat>,
    /// Where the file's world lies in the scene's, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world_from_file: Option<[f64; 7]>,
    /// Where the camera sits on the body whose poses the file holds, metres; EuRoC's files hold those of the inertial unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<[f64; 7]>,
}

impl File {
    /// The poses, with the file's stamps, or those of a rate where it has none.
    pub(super) fn poses(&self, rate_hz: f64, folder: &FilePath) -> Result<Vec<TimedPose>, Error> {
        let world_from_file = transform("trajectory.world_from_file", self.world_from_file)?;
        let body_from_camera = transform("trajectory.body_from_camera", self.body_from_camera)?;
        let path = storage::named(folder, &self.file);
        self.rows(&path)?
            .into_iter()
            .enumerate()
            .map(|(n, row)| {
                let pose = row.pose.pose().map_err(|source| Error::Geometry {
                    place: format!("{}, line {}", path.display(), row.line),
                    source,
                })?;
                Ok(TimedPose {
                    stamp_nanos: row.stamp_nanos.unwrap_or_else(|| stamp_nanos(n, rate_hz)),
                    world_from_camera: world_from_file * pose * body_from_camera,
                })
            })
            .collect()
    }

    fn rows(&self, path: &FilePath) -> Result<Vec<TrajectoryRow>, Error> {
        let io = |source| Error::Io { path: path.to_owned(), source };
        let content = |line, expected, found| Error::Content { path: path.to_owned(), line, expected, found };
        let Found::File(bytes) = storage::find(path).map_err(io)? else {
            return Err(content(None, "a file".to_owned(), "something else".to_owned()));
        };
        if bytes > LARGEST_TRAJECTORY_FILE_BYTES {
            let expected = format!("a file of at most {LARGEST_TRAJECTORY_FILE_BYTES} bytes");
            return Err(content(None, expected, format!("{bytes} bytes")));
        }
        let input = BufReader::new(storage::File::open(path).map_err(io)?);
        read_trajectory(input, self.format).map_err(|error| match error {
            TrajectoryFileError::Io(source) => io(source),
            TrajectoryFileError::Content { line, expected, found } => content(line, expected, found),
        })
    }
}

fn transform(place: &str, numbers: Option<[f64; 7]>) -> Result<Pose, Error> {
    let pose = |numbers| {
        PoseRow::from_numbers(numbers)
            .pose()
            .map_err(|source| Error::Geometry { place: place.to_owned(), source })
    };
    numbers.map_or(Ok(Pose::identity()), pose)
}
