//! The house: which room may name which, and who may name which library.
//!
//! Reads the source text, so that it also sees what no build of this machine compiles.

#![expect(clippy::unwrap_used, reason = "tests")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Rooms and the rooms they may name. A new room gets a row here.
const ROOMS: &[(&str, &[&str])] = &[
    ("geometry", &[]),
    ("structure", &["geometry"]),
    ("storage", &[]),
    ("unfinished", &["storage"]),
    ("archive", &["unfinished"]),
    ("datasets", &["structure"]),
    ("fetch", &["structure", "storage", "unfinished", "archive", "datasets"]),
    ("format", &["geometry", "structure", "storage", "unfinished"]),
    ("simulate", &["geometry", "structure", "storage"]),
    ("track", &["geometry", "structure"]),
    ("adjust", &["geometry", "structure"]),
    ("statistics", &["geometry", "structure"]),
    ("plot", &["geometry", "structure"]),
    ("evaluate", &["geometry", "structure"]),
    ("covisibility", &["geometry", "structure"]),
    ("exchange", &["geometry", "structure"]),
    (
        "benchmark",
        &[
            "geometry",
            "structure",
            "format",
            "simulate",
            "datasets",
            "storage",
            "unfinished",
            "track",
            "covisibility",
            "adjust",
            "evaluate",
            "plot",
        ],
    ),
    (
        "stations",
        &[
            "geometry",
            "structure",
            "storage",
            "datasets",
            "simulate",
            "track",
            "covisibility",
            "adjust",
            "evaluate",
        ],
    ),
    ("validate", &["geometry", "structure", "storage", "format", "simulate", "track", "adjust", "evaluate"]),
    ("report", &["geometry", "structure", "storage", "format", "statistics", "plot", "evaluate", "validate"]),
    (
        "cli",
        &[
            "geometry",
            "structure",
            "format",
            "simulate",
            "statistics",
            "plot",
            "archive",
            "datasets",
            "fetch",
            "track",
            "covisibility",
            "adjust",
            "evaluate",
            "exchange",
            "benchmark",
            "stations",
            "validate",
            "report",
            "storage",
        ],
    ),
];

/// Libraries that only some may name, and why.
const LIBRARIES: &[(&[&str], &[&str], &str)] = &[
    (
        &["arrow", "parquet", "mcap", "foxglove", "zstd", "lz4", "crc32fast"],
        &["src/format/"],
        "files are the business of the room `format`",
    ),
    (
        &["object_store", "reqwest", "tokio", "futures_util", "rustls"],
        &["src/storage/"],
        "where files lie is the business of the room `storage`",
    ),
    (
        &["krilla", "krilla_svg", "resvg", "ttf_parser"],
        &["src/plot/paper/"],
        "letters and files of figures are the business of `plot::paper`",
    ),
    (&["maud"], &["src/report/"], "pages are the business of the room `report`"),
    (&["ureq"], &["src/fetch/"], "the network is the business of the room `fetch`"),
    (
        &["tar", "flate2", "zip"],
        &["src/archive/", "src/simulate/trajectory/tests/", "converters/src/text_release/"],
        "archives are the business of the room `archive`",
    ),
    (
        &["clap", "clap_complete", "clap_mangen", "comfy_table", "anyhow", "indicatif", "ctrlc"],
        &["src/cli/", "src/main.rs", "converters/src/command", "converters/src/main.rs"],
        "a library neither parses arguments nor talks to people",
    ),
];

/// The lines of a source text without comments, numbered from 1.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..).zip(text.lines()).filter_map(|(number, line)| {
        let line = line.trim_start();
        let line = if line.starts_with("//") { "" } else { line.split(" // ").next().unwrap_or(line) };
        (!line.is_empty()).then_some((number, line))
    })
}

/// The first names of paths that begin with a prefix such as `crate::`.
fn names_after<'a>(line: &'a str, prefix: &str) -> Vec<&'a str> {
    let name_at = |(at, _): (usize, &str)| {
        let joined = line[..at].ends_with(|before: char| before.is_alphanumeric() || before == '_');
        let rest = &line[at + prefix.len()..];
        let end = rest.find(|after: char| !after.is_alphanumeric() && after != '_').unwrap_or(rest.len());
        (!joined && end > 0).then_some(&rest[..end])
    };
    line.match_indices(prefix).filter_map(name_at).collect()
}

/// Rooms that a line of a file names; `depth` is the number of `super::` that leads from the file to the crate.
fn rooms_named(line: &str, depth: usize) -> BTreeSet<&str> {
    let climb = "super::".repeat(depth);
    names_after(line, "crate::")
        .into_iter()
        .chain(names_after(line, &climb))
        .filter(|name| ROOMS.iter().any(|(room, _)| room == name))
        .collect()
}

/// Whether a line names a library, as `arrow::…` or `use arrow;`.
fn names_library(line: &str, library: &str) -> bool {
    line.match_indices(library).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        let after = &line[at + library.len()..];
        let begins =
            before.is_none_or(|before| !before.is_alphanumeric() && !matches!(before, '_' | ':' | '.'));
        begins && (after.starts_with("::") || (line.starts_with("use ") && after.starts_with([';', ' '])))
    })
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Rust files below a folder, by their path from the root.
fn files(folder: &str) -> Vec<(String, String)> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    walk(&root().join(folder), &mut found);
    found.sort();
    found
        .into_iter()
        .map(|path| {
            let text = fs::read_to_string(&path).unwrap();
            (path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/"), text)
        })
        .collect()
}

/// The room of a file of `src`, and how many `super::` lead from it to the crate.
fn room_of(path: &str) -> Option<(&str, usize)> {
    let inside = path.strip_prefix("src/")?;
    let (room, rest) = inside.split_once('/')?;
    let depth = rest.matches('/').count() + if rest.ends_with("mod.rs") { 1 } else { 2 };
    Some((room, depth))
}

#[test]
fn rooms_name_only_the_rooms_below_them() {
    let mut wrong = Vec::new();
    for (path, text) in files("src") {
        let Some((room, depth)) = room_of(&path) else { continue };
        let Some((_, below)) = ROOMS.iter().find(|(name, _)| *name == room) else {
            wrong.push(format!("{path}: the room `{room}` has no row in this test"));
            continue;
        };
        for (number, line) in code(&text) {
            for named in rooms_named(line, depth) {
                if named != room && !below.contains(&named) {
                    wrong.push(format!("{path}:{number}: `{room}` must not name `{named}`"));
                }
            }
            if line.contains("crate::{") {
                wrong.push(format!("{path}:{number}: one `use crate::room::…` line for each room"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn libraries_are_named_where_they_belong() {
    let mut wrong = Vec::new();
    for (path, text) in files("src").into_iter().chain(files("converters/src")) {
        for (libraries, places, reason) in LIBRARIES {
            if places.iter().any(|place| path.starts_with(place)) {
                continue;
            }
            for (number, line) in code(&text) {
                for library in libraries.iter().filter(|library| names_library(line, library)) {
                    wrong.push(format!("{path}:{number}: names `{library}`: {reason}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn converters_meet_the_tools_in_files_alone() {
    let mut wrong = Vec::new();
    for (path, text) in files("converters/src") {
        for (number, line) in code(&text) {
            // Noise and random numbers are drawn by one code everywhere.
            let drawn = ["noise", "Random"]
                .iter()
                .any(|name| line.contains(&format!("open_structure::simulate::{name}")));
            for room in names_after(line, "open_structure::") {
                if room == "simulate" && drawn {
                    continue;
                }
                if ["simulate", "track", "adjust", "evaluate", "covisibility", "benchmark", "cli"]
                    .contains(&room)
                {
                    wrong.push(format!("{path}:{number}: names open_structure::{room}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_room_and_every_file_says_what_it_is_for() {
    let mut wrong = Vec::new();
    for (room, _) in ROOMS {
        let folder = root().join("src").join(room);
        if folder.is_dir() && !folder.join("mod.rs").is_file() {
            wrong.push(format!("src/{room} has no mod.rs"));
        }
    }
    for (path, text) in ["src", "converters/src", "python/src"].into_iter().flat_map(files) {
        let first = text.lines().next().unwrap_or_default();
        if first.strip_prefix("//! ").is_none_or(|words| words.len() <= 10) && !path.ends_with("/tests.rs") {
            wrong.push(format!("{path} begins with `{first}`, not with what it is for"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn there_is_no_room_for_leftovers() {
    for (path, _) in ["src", "converters/src", "python/src"].into_iter().flat_map(files) {
        let leftovers = ["utils", "util", "helpers", "common", "misc"];
        assert!(path.split(['/', '.']).all(|name| !leftovers.contains(&name)), "{path}: one noun, one file");
    }
}

#[test]
fn the_eyes_of_this_test_see() {
    let named = |line, depth| rooms_named(line, depth).into_iter().collect::<Vec<_>>();
    assert_eq!(named("use crate::format::open;", 2), ["format"]);
    assert_eq!(
        named("let x = crate::track::run(crate::geometry::Pose::identity());", 2),
        ["geometry", "track"]
    );
    assert_eq!(named("use super::super::validate::Report;", 2), ["validate"]);
    assert_eq!(named("use super::format::Error;", 2), [""; 0]);
    assert_eq!(named("use othercrate::format::x;", 2), [""; 0]);
    assert!(names_library("use arrow::array::Array;", "arrow"));
    assert!(names_library("fn f(x: &mcap::Summary) {}", "mcap"));
    assert!(!names_library("use super::arrow_batch::x;", "arrow"));
    assert!(!names_library("let arrow = format::arrow_schema(table);", "arrow"));
    assert!(!names_library("mod mcap;", "mcap"));
    assert_eq!(room_of("src/format/mod.rs"), Some(("format", 1)));
    assert_eq!(room_of("src/format/reader.rs"), Some(("format", 2)));
    assert_eq!(room_of("src/geometry/pose/tests.rs"), Some(("geometry", 3)));
    assert_eq!(room_of("src/lib.rs"), None);
    let lines: Vec<_> = code("// use crate::cli;\n\nlet a = 1; // crate::cli::x\n").collect();
    assert_eq!(lines, [(3, "let a = 1;")]);
}

/// Functions whose last bit depends on the platform; `libm` has each of them, the same everywhere.
const PLATFORM_MATHS: &[&str] = &[
    ".sin()",
    ".cos()",
    ".tan()",
    ".sin_cos()",
    ".asin()",
    ".acos()",
    ".atan()",
    ".atan2(",
    ".sinh()",
    ".cosh()",
    ".exp()",
    ".exp2()",
    ".ln()",
    ".log10()",
    ".log2()",
    ".powf(",
    ".hypot(",
    ".cbrt()",
    "from_axis_angle",
    "from_euler_angles",
    "from_scaled_axis",
    "slerp(",
    ".angle_to(&",
    "rotation_between",
];

#[test]
fn what_is_written_is_computed_the_same_on_every_machine() {
    let mut wrong = Vec::new();
    for folder in
        ["src/geometry", "src/structure", "src/simulate", "src/statistics", "src/track", "src/evaluate"]
    {
        for (path, text) in files(folder) {
            if path.contains("/tests") || path.ends_with("strategies.rs") {
                continue;
            }
            let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
            for (number, line) in code(text) {
                for name in PLATFORM_MATHS {
                    if line.contains(name) && !line.contains("libm::") {
                        wrong.push(format!("{path}:{number}: {name}"));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "libm instead of:\n{}", wrong.join("\n"));
}
