//! The commands that make sequences of RGB-D images.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "tests")]

mod command;
mod files;
mod wall;
