//! Measurements instead of images: the Open-Structure format, its validator and its tools.

pub mod adjust;
#[cfg(feature = "archive")]
pub mod archive;
pub mod benchmark;
#[cfg(feature = "cli")]
pub mod cli;
pub mod covisibility;
pub mod datasets;
pub mod evaluate;
pub mod exchange;
#[cfg(feature = "fetch")]
pub mod fetch;
pub mod format;
pub mod geometry;
pub mod plot;
pub mod report;
pub mod simulate;
pub mod stations;
pub mod statistics;
pub mod storage;
pub mod structure;
pub mod track;
mod unfinished;
pub mod validate;

/// The README's Rust compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
