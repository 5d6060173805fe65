//! Converters from raw datasets to Open-Structure sequences.
