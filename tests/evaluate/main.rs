//! Errors of estimates: the figures of evo, the published accuracy, and the command `os evaluate`.

#![expect(clippy::unwrap_used, reason = "tests")]

mod command;
mod golden;
mod published;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn os(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).args(arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Where test data is looked for: `../shared/data` beside the workspace, or where `OPEN_STRUCTURE_DATA` says.
fn data() -> PathBuf {
    std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from)
}
