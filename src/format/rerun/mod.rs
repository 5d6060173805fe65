//! Recordings of the Rerun viewer: a sequence as what moves and what stands, on the viewer's timeline.
//!
//! | entity below `/world` | archetype | when |
//! |---|---|---|
//! | | `ViewCoordinates`: which axis points up | always |
//! | `camera_N` | `Pinhole`; `Transform3D` of the truth, or of the first estimate of a sequence without any truth | always; each frame |
//! | `camera_N/points`, `camera_N/lines` | `Points2D`, `LineStrips2D` in the colours of the groups: measurements, or observations | each frame |
//! | `landmarks/points`, `landmarks/lines` | `Points3D`, `LineStrips3D` | always |
//! | `maps/NAME/points`, `maps/NAME/lines` | the same, of an estimate | always |
//! | `true_trajectory/camera_N`, `estimated_trajectories/NAME/camera_N` | `LineStrips3D`: the whole path | always |
//! | `…/now` below these | `Points3D`: where the path is | each frame |
//!
//! Timelines are `frame` (ids) and `time` (since the first frame). What is written is a rendering of 32-bit numbers: nothing is read
//! back. The file is a stream of Arrow record batches in the container of `.rrd` files, version 2, which viewers from 0.23 on read.

mod chunk;
mod recording;
mod rrd_stream;
mod shown;

pub use recording::{RerunCounts, write_rerun};
