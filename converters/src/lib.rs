//! Converters from raw datasets to Open-Structure sequences.

pub mod text_release;
