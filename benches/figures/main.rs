//! The figures that the project promises, each a ratio or a bound, measured in one run.
//!
//! `cargo bench --bench figures` measures all, `cargo bench --bench figures -- size` those of one module.
//! Ends with exit code 1 when a bound does not hold.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a program that prints a table")]

#[path = "../data/mod.rs"]
mod data;
#[path = "../data/simulated.rs"]
#[expect(dead_code, reason = "shared with the criterion benches")]
mod simulated;

mod against_json;
mod against_pyarrow;
mod figure;
mod reading;
mod scale;
mod simulating;
mod size;
mod tracking;
mod validating;

use std::process::ExitCode;

use anyhow::Result;
use figure::Figures;

type Measure = fn(&mut Figures) -> Result<()>;

fn main() -> Result<ExitCode> {
    if scale::is_child() {
        scale::write_as_child()?;
        return Ok(ExitCode::SUCCESS);
    }
    let wanted: Vec<String> =
        std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let all: [(&str, Measure); 8] = [
        ("reading", reading::measure),
        ("pyarrow", against_pyarrow::measure),
        ("json", against_json::measure),
        ("tracking", tracking::measure),
        ("size", size::measure),
        ("validating", validating::measure),
        ("scale", scale::measure),
        ("simulating", simulating::measure),
    ];
    let mut figures = Figures::default();
    for (name, measure) in all {
        if wanted.is_empty() || wanted.iter().any(|word| name.contains(word.as_str())) {
            measure(&mut figures)?;
        }
    }
    print!("{figures}");
    Ok(if figures.hold() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
