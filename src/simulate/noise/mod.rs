//! From observations to measurements.
