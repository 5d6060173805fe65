//! The README shows what the programs print.
//!
//! `UPDATE_README=1 cargo test --workspace --test readme` writes the output anew.

#![expect(clippy::unwrap_used, reason = "tests")]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What stands before a block whose commands are run.
const MARKER: &str = "<!-- run -->\n```console\n";

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Runs the commands of a block in a folder, one after the other; gives the block with what they print now.
fn run(block: &str, programs: &Path, folder: &Path) -> String {
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let mut text = String::new();
    for command in block.lines().filter_map(|line| line.strip_prefix("$ ")) {
        let output = Command::new("sh")
            .args(["-c", command])
            .current_dir(folder)
            .env("PATH", &path)
            .env("COLUMNS", "100")
            .output()
            .unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command}: {:?}\n{errors}", output.status.code());
        let _ = writeln!(text, "$ {command}");
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
    text
}

#[test]
fn the_readme_shows_what_the_programs_print() {
    let programs = Path::new(env!("CARGO_BIN_EXE_os")).parent().unwrap();
    if !programs.join("os-convert").is_file() {
        eprintln!(
            "SKIPPED: the README's commands: os-convert is not built (cargo test --workspace builds it)"
        );
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(root().join("sequences"), folder.path().join("sequences")).unwrap();

    let path = root().join("README.md");
    let found = fs::read_to_string(&path).unwrap();
    let mut parts = found.split(MARKER);
    let mut expected = parts.next().unwrap().to_owned();
    let mut blocks = 0;
    for part in parts {
        let (block, after) = part.split_once("```").unwrap();
        let _ = write!(expected, "{MARKER}{}```{after}", run(block, programs, folder.path()));
        blocks += 1;
    }
    assert!(blocks > 0, "no block of the README is run");
    if std::env::var_os("UPDATE_README").is_some() {
        fs::write(&path, &expected).unwrap();
    } else if found != expected {
        let line = found.lines().zip(expected.lines()).position(|(found, expected)| found != expected);
        panic!(
            "README.md line {}: UPDATE_README=1 cargo test --workspace --test readme\n{expected}",
            line.map_or(0, |line| line + 1)
        );
    }
}
