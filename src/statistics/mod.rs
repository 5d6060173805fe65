//! What a sequence is like, in numbers: features, tracks, covisibility, parallax, motion.
