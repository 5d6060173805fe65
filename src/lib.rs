//! Measurements instead of images: the Open-Structure format, its validator and its tools.
