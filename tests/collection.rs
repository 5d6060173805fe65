//! Collections as a user meets them: `os index`, commands over all sequences, results put together, and what is refused.

#![expect(clippy::unwrap_used, reason = "tests")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use open_structure::format::{self, Collection, folder_name, read_catalogue, read_results};
use open_structure::structure::ResultTable;

fn os(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).current_dir(folder).args(arguments).output().unwrap()
}

/// What a command prints and says, when it ended with a code.
#[track_caller]
fn ended(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = os(folder, arguments);
    let words =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "os {}: {words}", arguments.join(" "));
    words
}

/// What a command prints.
#[track_caller]
fn printed(folder: &Path, arguments: &[&str]) -> String {
    let output = os(folder, arguments);
    assert!(
        output.status.success(),
        "os {}: {}",
        arguments.join(" "),
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).unwrap()
}

/// Names of the sequences of the collection below; one has to be encoded.
const NAMES: [&str; 3] = ["a", "b 2", "größe"];

/// A folder with the collection `all`, of short cuts of box1, without its catalogue.
fn collection() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let recipe = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("sequences/box1.toml");
    let text = fs::read_to_string(recipe).unwrap();
    let text = text.split("[expected]").next().unwrap();
    for (frames, name) in [30, 40, 50].into_iter().zip(NAMES) {
        let text = text
            .replace("frames = 447", &format!("frames = {frames}"))
            .replace("name = \"box1\"", &format!("name = \"{name}\""));
        fs::write(folder.path().join("recipe.toml"), text).unwrap();
        let output = format!("all/{}", folder_name(name));
        ended(folder.path(), &["simulate", "recipe.toml", "-o", &output], 0);
    }
    folder
}

#[test]
fn a_collection_is_indexed_validated_and_looked_at() {
    let folder = collection();
    let at = folder.path();
    let words = ended(at, &["validate", "all"], 3);
    assert!(words.contains("catalogue-present") && words.contains("os index"), "{words}");

    let words = ended(at, &["index", "all"], 0);
    assert!(words.contains("all/catalogue.parquet: 3 sequences, 120 frames"), "{words}");
    let catalogue = read_catalogue(&at.join("all")).unwrap();
    assert_eq!(catalogue.iter().map(|row| row.sequence.as_str()).collect::<Vec<_>>(), NAMES);
    for row in &catalogue {
        let sequence = format::read(at.join("all").join(folder_name(&row.sequence))).unwrap();
        assert_eq!(row.frames, i64::try_from(sequence.frames.len()).unwrap());
        assert_eq!(row.point_measurements, i64::try_from(sequence.point_measurements.len()).unwrap());
        let rows: u64 = sequence.manifest.tables.iter().map(|table| table.rows).sum();
        assert_eq!(row.total_rows, i64::try_from(rows).unwrap());
        assert!(row.path_length.unwrap() > 1.0 && row.min_x < row.max_x);
    }

    // The catalogue, then each sequence.
    let words = ended(at, &["validate", "--deny", "warnings", "all"], 0);
    assert_eq!(words.matches(": conformant; ").count(), 4, "{words}");
    let table = printed(at, &["stats", "all"]);
    let first: Vec<&str> =
        table.lines().skip(1).take(3).map(|line| line.split("  ").next().unwrap()).collect();
    assert_eq!(first, NAMES);
    assert_eq!(printed(at, &["info", "all", "--json"]).lines().count(), 3);
    assert_eq!(printed(at, &["cat", "all", "catalogue", "--limit", "2"]).lines().count(), 2);
    assert_eq!(printed(at, &["cat", "all", "catalogue", "--format", "csv"]).lines().count(), 4);
    let words = ended(at, &["cat", "all", "frames"], 1);
    assert!(words.contains("a collection of sequences"), "{words}");
}

#[test]
fn a_catalogue_out_of_date_is_found_and_written_anew() {
    let folder = collection();
    let at = folder.path();
    ended(at, &["index", "all"], 0);
    let before = fs::read(at.join("all/catalogue.parquet")).unwrap();
    ended(at, &["copy", "all/sequence=a", "-o", "a.mcap"], 0);
    fs::remove_dir_all(at.join("all/sequence=a")).unwrap();
    let words = ended(at, &["validate", "all"], 3);
    assert!(words.contains("catalogue-sequences-there"), "{words}");
    let words = ended(at, &["index", "all"], 1);
    assert!(words.contains("exists already"), "{words}");
    ended(at, &["index", "all", "--force"], 0);
    assert_eq!(read_catalogue(&at.join("all")).unwrap().len(), 2);
    ended(at, &["validate", "all"], 0);
    // Back again: a copy of a copy, and so the same bytes of the same catalogue.
    ended(at, &["copy", "a.mcap", "-o", "all/sequence=a"], 0);
    let words = ended(at, &["validate", "all"], 3);
    assert!(words.contains("catalogue-complete"), "{words}");
    ended(at, &["index", "all", "--force"], 0);
    assert!(
        fs::read(at.join("all/catalogue.parquet")).unwrap() == before,
        "the same sequences, the same bytes"
    );
}

#[test]
fn a_sequence_that_cannot_be_read_is_named_and_the_catalogue_stays() {
    let folder = collection();
    let at = folder.path();
    ended(at, &["index", "all"], 0);
    let before = fs::read(at.join("all/catalogue.parquet")).unwrap();
    let frames = at.join("all").join(folder_name("b 2")).join("frames.parquet");
    fs::write(&frames, b"PAR1 and no more").unwrap();
    let words = ended(at, &["index", "all", "--force"], 1);
    assert!(words.contains("sequence b 2") && words.contains("frames.parquet"), "{words}");
    assert!(fs::read(at.join("all/catalogue.parquet")).unwrap() == before);
    fs::remove_file(&frames).unwrap();
    let words = ended(at, &["index", "all", "--force"], 1);
    assert!(words.contains("sequence b 2") && words.contains("frames.parquet"), "{words}");
    let hidden = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with('.');
    let left = fs::read_dir(at.join("all")).unwrap().filter(|entry| hidden(entry.as_ref().unwrap()));
    assert_eq!(left.count(), 0, "something was left behind");
}

#[test]
fn what_lies_outside_is_never_left_out_in_silence() {
    let folder = collection();
    let at = folder.path();
    fs::rename(at.join("all/sequence=a"), at.join("all/any-name")).unwrap();
    for arguments in [&["index", "all"][..], &["stats", "all"]] {
        let words = ended(at, arguments, 1);
        assert!(words.contains("any-name") && words.contains("sequence=a"), "{words}");
    }
    let words = ended(at, &["validate", "all"], 3);
    assert!(words.contains("collection-folders-named"), "{words}");
    let words = ended(at, &["index", "all", "--adopt"], 0);
    assert!(words.contains("all/any-name: now sequence=a"), "{words}");
    assert_eq!(Collection::open(&at.join("all")).unwrap().members.len(), 3);

    // Two of one name, and a file: nothing is renamed then.
    ended(at, &["copy", "all/sequence=a", "-o", "all/again"], 0);
    let words = ended(at, &["index", "all", "--adopt", "--force"], 1);
    assert!(words.contains("sequence=a: exists already"), "{words}");
    fs::rename(at.join("all/sequence=a"), at.join("all/another")).unwrap();
    let words = ended(at, &["index", "all", "--adopt", "--force"], 1);
    assert!(words.contains("again and ") && words.contains("both hold a sequence called `a`"), "{words}");
    fs::rename(at.join("all/another"), at.join("all/sequence=a")).unwrap();
    fs::remove_dir_all(at.join("all/again")).unwrap();
    ended(at, &["copy", "all/sequence=a", "-o", "all/a.mcap"], 0);
    let words = ended(at, &["index", "all", "--adopt", "--force"], 1);
    assert!(words.contains("os copy all/a.mcap -o all/sequence=a"), "{words}");
    let words = ended(at, &["index", "all/sequence=a"], 1);
    assert!(words.contains("a sequence; expected a folder of sequences"), "{words}");
    fs::create_dir(at.join("empty")).unwrap();
    assert!(ended(at, &["index", "empty"], 1).contains("no sequences"));
    ended(at, &["index", "nowhere"], 1);
}

#[test]
fn sequences_of_a_collection_that_have_no_estimate_are_left_out_and_told() {
    let folder = collection();
    let at = folder.path();
    let words = ended(at, &["evaluate", "all"], 1);
    assert!(words.contains("expected an estimate to compare, found none"), "{words}");
    ended(at, &["export", "all/sequence=a", "--to", "tum", "--estimate", "truth", "-o", "truth.txt"], 0);
    ended(at, &["import-trajectory", "all/sequence=a", "truth.txt", "--name", "mine", "-o", "with"], 0);
    fs::remove_dir_all(at.join("all/sequence=a")).unwrap();
    fs::rename(at.join("with"), at.join("all/sequence=a")).unwrap();
    let words = ended(at, &["evaluate", "all"], 3);
    assert!(
        words.contains("mine") && words.contains("expected an estimate to compare, found none; left out")
    );
    ended(at, &["evaluate", "all/sequence=a"], 0);
}

/// A table of results without its times.
fn without_times(path: &Path) -> ResultTable {
    let mut table = read_results(path).unwrap();
    table.columns.retain(|column| column.name != "seconds");
    table
}

const METHODS: [&str; 2] = ["--methods", "map-to-frame,structural-ba"];

#[test]
fn runs_that_are_gathered_give_the_table_of_one_run() {
    let folder = collection();
    let at = folder.path();
    let benchmark = |more: &[&str]| ended(at, &[&["benchmark"], more, &METHODS[..]].concat(), 0);
    benchmark(&["all", "-o", "one", "--seeds", "2"]);
    // Shared out by sequence, and one sequence by seed; the later seed comes first.
    benchmark(&["all/sequence=a", "-o", "run-1", "--seeds", "1..1"]);
    benchmark(&["all/sequence=a", "-o", "run-2", "--seeds", "0..0"]);
    benchmark(&[
        "all/sequence=b%202",
        &format!("all/{}", folder_name("größe")),
        "-o",
        "run-3",
        "--seeds",
        "2",
    ]);
    let gather = ["benchmark", "--gather", "run-1", "run-2", "run-3", "-o", "gathered"];
    let shown = printed(at, &gather);
    let [one, gathered] =
        ["one", "gathered"].map(|run| fs::read_to_string(at.join(run).join("table.md")).unwrap());
    assert_eq!(one, gathered);
    assert!(shown.starts_with(&one), "{shown}");
    for name in ["cells.parquet", "summary.parquet", "curves.parquet"] {
        let [one, gathered] = ["one", "gathered"].map(|run| without_times(&at.join(run).join(name)));
        assert_eq!(one, gathered, "{name}");
    }
    // What was gathered is a run like any other: it goes on, and is gathered again.
    benchmark(&["all", "-o", "gathered", "--seeds", "2"]);
    printed(at, &["benchmark", "--gather", "gathered", "-o", "again"]);
    assert!(
        fs::read(at.join("again/cells.parquet")).unwrap()
            == fs::read(at.join("gathered/cells.parquet")).unwrap()
    );
}

#[test]
fn runs_that_do_not_fit_are_not_gathered() {
    let folder = collection();
    let at = folder.path();
    let run = |sequence: &str, output: &str, more: &[&str]| {
        let path = format!("all/{}", folder_name(sequence));
        let arguments = [&["benchmark", &path, "-o", output, "--no-bound"][..], more].concat();
        ended(at, &arguments, 0);
    };
    let classic = ["--methods", "map-to-frame-classic"];
    run("a", "first", &[&classic[..], &["--seeds", "2"]].concat());
    run("b 2", "short", &[&classic[..], &["--seeds", "1"]].concat());
    run("b 2", "other-method", &["--methods", "frame-to-frame-classic", "--seeds", "2"]);
    let noise = ["--noise", "gaussian", "--set", "sigma_px=2", "--set", "sigma_depth_m=0.1", "--seeds", "2"];
    run("b 2", "other-noise", &[&classic[..], &noise].concat());
    let refused = |runs: &[&str], words: &str| {
        let arguments = [&["benchmark", "--gather"], runs, &["-o", "gathered"]].concat();
        let said = ended(at, &arguments, 1);
        assert!(said.contains(words), "{said}");
        assert!(!at.join("gathered").exists(), "{runs:?}: something was written");
    };
    refused(&["first", "short"], "b 2: none of the runs has its map-to-frame-classic with seed 1");
    refused(&["first", "other-method"], "another choice of methods than first");
    refused(&["first", "other-noise"], "another noise than first");
    refused(&["first", "nowhere"], "nowhere");
    fs::remove_file(at.join("first/cells/a/map-to-frame-classic.1.json")).unwrap();
    refused(&["first"], "a: none of the runs has its map-to-frame-classic with seed 1");
    let words = ended(at, &["benchmark", "--gather", "first", "-o", "first"], 1);
    assert!(words.contains("the folder that is to be written"), "{words}");
    ended(at, &["benchmark", "--gather", "first", "-o", "x", "--seeds", "3"], 2);
}
