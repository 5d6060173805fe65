//! Paths of a camera.
