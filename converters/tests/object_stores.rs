//! Raw datasets out of object stores, against a server on this machine; never the Internet.

#![expect(clippy::unwrap_used, reason = "tests")]

#[expect(dead_code, reason = "shared with a test that needs more of it")]
#[path = "../../tests/storage/server.rs"]
mod server;

use std::fs;
use std::path::Path;
use std::process::Command;

use server::{Kind, Server};

#[test]
fn datasets_are_copied_before_they_are_converted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let server = Server::new(Kind::Buckets);
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sequences/sample");
    server.keep_folder("bucket/sample", &sample);
    let convert = |input: &str, output: &str, code: &[i32]| {
        let output = Command::new(env!("CARGO_BIN_EXE_os-convert"))
            .current_dir(at)
            .args(["open-structure", input, "-o", output])
            .env("AWS_ENDPOINT_URL", format!("http://{}", server.address))
            .env("AWS_ACCESS_KEY_ID", "someone")
            .env("AWS_SECRET_ACCESS_KEY", "something")
            .output()
            .unwrap();
        let words = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code().is_some_and(|found| code.contains(&found)), "{words}");
        words
    };
    convert(sample.to_str().unwrap(), "local.mcap", &[0, 3]);
    convert("s3://bucket/sample", "s3://bucket/converted.mcap", &[0, 3]);
    assert!(server.objects()["bucket/converted.mcap"] == fs::read(at.join("local.mcap")).unwrap());

    let words = convert("s3://bucket/sample", "s3://bucket/converted.mcap", &[1]);
    assert!(words.contains("s3://bucket/converted.mcap"), "{words}");
    let words = convert("s3://bucket/none", "none.mcap", &[1]);
    assert!(words.contains("s3://bucket/none: nothing is there"), "{words}");
}
