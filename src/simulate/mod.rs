//! Sequences out of nothing: scenes, trajectories, visibility and noise.
//!
//! Everything random takes a seed, and the same seed gives the same bits on every machine and any number
//! of threads: numbers come from `ChaCha8`, one stream per purpose and frame, and functions such as sine from
//! `libm`, for a platform's own differ in the last bit.

mod error;
pub mod noise;
mod random;
pub mod trajectory;

pub use error::Error;
pub use random::Random;
