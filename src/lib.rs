//! Measurements instead of images: the Open-Structure format, its validator and its tools.

pub mod format;
pub mod geometry;
pub mod structure;
