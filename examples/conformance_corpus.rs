//! Writes the conformance corpus as files, for validators and readers of other makers.
//!
//! `cargo run --example conformance_corpus -- OUT`

#[path = "../tests/conformance/builder/mod.rs"]
mod builder;

use std::path::Path;
use std::process::ExitCode;

#[expect(clippy::print_stderr, reason = "a program speaks to its user")]
fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let [output] = arguments.as_slice() else {
        eprintln!("usage: conformance_corpus OUT   (a folder that is not there yet)");
        return ExitCode::from(2);
    };
    match builder::export(Path::new(output)) {
        Ok(cases) => {
            eprintln!("{} cases below {}", cases.len(), Path::new(output).display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
