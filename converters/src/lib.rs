//! Converters from raw datasets to Open-Structure sequences.

mod agglomerate;
pub mod associate;
pub mod command;
pub mod detect;
pub mod family;
pub mod generate;
pub mod ordered;
pub mod release;
pub mod rgbd;
pub mod text_release;
