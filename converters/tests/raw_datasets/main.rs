//! Raw RGB-D datasets: real ones, rendered ones, and what is wrong with folders.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod damaged;
mod real;
mod rendered;
mod room;
