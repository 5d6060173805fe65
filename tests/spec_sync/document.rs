//! Files of `spec/` and the generated parts in them.

use std::fs;
use std::path::PathBuf;

/// The beginning of a generated part: `<!-- kind:name -->`, ended by `<!-- /kind -->`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Marker<'a> {
    pub(crate) kind: &'a str,
    pub(crate) name: &'a str,
}

impl<'a> Marker<'a> {
    fn of_line(line: &'a str) -> Option<Self> {
        let inside = line.trim().strip_prefix("<!-- ")?.strip_suffix(" -->")?;
        if inside.starts_with('/') {
            return None;
        }
        let (kind, name) = inside.split_once(':').unwrap_or((inside, ""));
        Some(Self { kind, name })
    }
}

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("spec").join(name)
}

/// The text of a file of `spec/`; empty when it is not there yet.
pub(crate) fn read_spec(name: &str) -> String {
    fs::read_to_string(path(name)).unwrap_or_default()
}

/// Replaces what stands between markers.
pub(crate) fn fill(text: &str, generate: impl Fn(&Marker<'_>) -> Option<String>) -> String {
    let mut out = String::with_capacity(text.len());
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        out.push_str(line);
        out.push('\n');
        let Some(marker) = Marker::of_line(line) else { continue };
        let content = generate(&marker).unwrap_or_else(|| panic!("nothing generates {line}"));
        out.push_str(content.trim_end());
        out.push('\n');
        let end = format!("<!-- /{} -->", marker.kind);
        let closed = lines.by_ref().any(|line| line.trim() == end);
        assert!(closed, "{line} is not ended by {end}");
        out.push_str(&end);
        out.push('\n');
    }
    out
}

/// Compares a file of `spec/` with what it ought to be; writes it when `UPDATE_SPEC` is set.
pub(crate) fn sync(name: &str, expected: &str) {
    let found = read_spec(name);
    if found == expected {
        return;
    }
    if std::env::var_os("UPDATE_SPEC").is_some() {
        let path = path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, expected).unwrap();
        return;
    }
    let line = found.lines().zip(expected.lines()).take_while(|(found, expected)| found == expected).count();
    panic!(
        "spec/{name} line {}: found\n  {}\nexpected\n  {}\nrun UPDATE_SPEC=1 cargo test --workspace --test spec_sync",
        line + 1,
        found.lines().nth(line).unwrap_or("the end of the file"),
        expected.lines().nth(line).unwrap_or("the end of the file"),
    );
}

#[test]
fn only_what_stands_between_markers_is_replaced() {
    let text = "a\n<!-- table:x -->\nold\n<!-- /table -->\nb\n";
    let filled = fill(text, |marker| Some(format!("{} {}", marker.kind, marker.name)));
    assert_eq!(filled, "a\n<!-- table:x -->\ntable x\n<!-- /table -->\nb\n");
}
