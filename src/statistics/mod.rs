//! What a sequence is like, in numbers: features, tracks, covisibility, parallax, motion.
//!
//! ```
//! use open_structure::statistics::{Analysis, Counted};
//! use open_structure::structure::Sequence;
//!
//! let sequence = Sequence::default();
//! let mut analysis = Analysis::new(&sequence.manifest, &sequence.structural_groups, Counted::of(&sequence));
//! sequence.bundles().for_each(|frame| analysis.add(frame));
//! assert_eq!(analysis.finish().sequence.frame_count, 0);
//! ```

mod analysis;
mod covisibility;
mod difference;
mod distribution;
mod sequence_statistics;
mod widest_parallax;

pub use analysis::{Analysed, Analysis, Counted};
pub use covisibility::{COVISIBLE_POINTS, FRAMES_APART, SharedApart};
pub use difference::Difference;
pub use distribution::{Distribution, TrackBin};
pub use sequence_statistics::{FeatureStatistics, MotionStatistics, NoiseStatistics, SequenceStatistics};
