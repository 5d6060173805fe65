//! Any bytes as an MCAP file.

#![no_main]

mod use_all;

use std::fs;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tempfile::TempDir;

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| TempDir::new().expect("a temporary folder"));

fuzz_target!(|bytes: &[u8]| {
    let path = FOLDER.path().join("input.mcap");
    fs::write(&path, bytes).expect("room for the input");
    use_all::use_all(&path);
});
