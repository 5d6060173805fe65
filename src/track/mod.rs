//! Measurements to poses and a map: tracking from frame to frame, and from a map to each frame.
//!
//! A [`Tracker`] takes one [`MeasuredFrame`](crate::structure::MeasuredFrame) at a time and says where the camera was; [`track`] walks a
//! tracker over a sequence and gives an [`Estimate`](crate::structure::Estimate). The built-in ones come from [`TrackOptions::tracker`]; one
//! of your own implements the trait. No tracker sees ground truth: the first pose, which no measurement tells, is given.
//!
//! ```
//! use open_structure::geometry::Pose;
//! use open_structure::structure::{MeasuredFrame, MeasurementNoise, Sequence};
//! use open_structure::track::{TrackOptions, track};
//!
//! let sequence = Sequence::default();
//! let noise = MeasurementNoise::declared(&sequence.manifest);
//! let options = TrackOptions::default();
//! let mut tracker = options.tracker(&sequence.manifest.cameras, noise, Pose::identity())?;
//! let estimate = track(&MeasuredFrame::of(&sequence), "map-to-frame", tracker.as_mut(), &|_, _| {})?;
//! assert!(estimate.trajectory.is_empty());
//! # Ok::<(), open_structure::track::Error>(())
//! ```

mod alignment;
mod classic;
mod error;
mod fusion;
mod hindsight;
mod landmark_tracker;
mod line_landmark;
mod motion;
mod options;
mod point_landmark;
mod sighting;
mod tracker;
mod two_view_start;

pub use error::Error;
pub use options::{Method, Sensor, TrackOptions};
pub use tracker::{FrameTrack, TrackState, Tracker, TrackerMap, track};
