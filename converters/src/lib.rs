//! Converters from raw datasets to Open-Structure sequences.

pub mod command;
pub mod family;
pub mod ordered;
pub mod release;
pub mod rgbd;
pub mod text_release;
