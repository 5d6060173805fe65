//! Other people's tools read what we write, and we read what they write.
//!
//! The checks are Python scripts in `tests/python`; they run with `.venv/bin/python`, or with the
//! interpreter that `OPEN_STRUCTURE_PYTHON` names. Without one they are skipped, except in CI.

#![expect(clippy::unwrap_used, clippy::print_stderr, reason = "tests")]

mod collection;
mod sample;
mod viewers;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use open_structure::format::{self, WriteOptions, json_schema};
use open_structure::structure::{Record, Sequence, TABLES, registry};
use tempfile::TempDir;

/// Calls a macro with every table's row type, by table name.
macro_rules! for_each_table {
    ($callback:ident) => {
        $callback! {
            frames, trajectories, point_landmarks, line_landmarks, structural_groups, map_points, map_lines, tracking, iterations,
            point_correspondences, line_correspondences, graph_poses, graph_points, graph_lines,
            graph_factors, frame_statistics, point_observations, line_observations, point_measurements,
            line_measurements
        }
    };
}

/// The Python that has the packages of `tests/python/requirements.txt`.
fn python() -> Option<PathBuf> {
    let path = std::env::var_os("OPEN_STRUCTURE_PYTHON")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python"), PathBuf::from);
    if path.exists() {
        return Some(path);
    }
    let what = format!("no Python at {}; `make setup` makes it", path.display());
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{what}");
    eprintln!("SKIPPED: {what}");
    None
}

/// Runs a script of `tests/python`, which exits with an error when a check fails.
fn run(script: &str, arguments: &[&Path]) {
    let Some(python) = python() else { return };
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python");
    // A home of its own, for some tools keep settings there.
    let home = tempfile::tempdir().unwrap();
    let output = Command::new(&python)
        .arg(scripts.join(script))
        .args(arguments)
        .env("HOME", home.path())
        .env("XDG_CONFIG_HOME", home.path().join("config"))
        .env("XDG_CACHE_HOME", home.path().join("cache"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{script}: {said}{}", String::from_utf8_lossy(&output.stderr));
    eprint!("{script}: {said}");
}

/// A sequence in both encodings, its rows as JSON lines, and the schemas.
struct Files {
    folder: TempDir,
}

impl Files {
    fn write(sequence: &Sequence) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let this = Self { folder };
        let foxglove = WriteOptions { foxglove: true, ..WriteOptions::default() };
        format::write(&this.mcap(), sequence, foxglove).unwrap();
        format::write(&this.parquet(), sequence, WriteOptions::default()).unwrap();
        for folder in [this.rows(), this.schemas()] {
            fs::create_dir(folder).unwrap();
        }
        let mut tables = 0;
        macro_rules! dump {
            ($($table:ident),+) => { $(this.dump(&sequence.$table); tables += 1;)+ };
        }
        for_each_table!(dump);
        assert_eq!(tables, TABLES.len(), "every table is in the sample");
        for name in TABLES.iter().map(|table| table.name).chain(["manifest", "table_summaries"]) {
            let path = this.schemas().join(format!("{name}.schema.json"));
            fs::write(path, json_schema(name).unwrap()).unwrap();
        }
        this
    }

    fn dump<R: Record>(&self, rows: &[R]) {
        assert!(!rows.is_empty(), "{} has rows in the sample", R::TABLE.name);
        let lines: Vec<String> = rows.iter().map(|row| serde_json::to_string(row).unwrap()).collect();
        let path = self.rows().join(format!("{}.jsonl", R::TABLE.name));
        fs::write(path, lines.join("\n") + "\n").unwrap();
    }

    fn mcap(&self) -> PathBuf {
        self.folder.path().join("sample.mcap")
    }
    fn parquet(&self) -> PathBuf {
        self.folder.path().join("sample")
    }
    fn rows(&self) -> PathBuf {
        self.folder.path().join("rows")
    }
    fn schemas(&self) -> PathBuf {
        self.folder.path().join("schemas")
    }
}

#[test]
fn every_mcap_message_is_read_and_satisfies_its_schema() {
    let files = Files::write(&sample::sequence(sample::CAMERAS));
    run("mcap_messages.py", &[&files.mcap(), &files.rows(), &files.schemas()]);
}

#[test]
fn container_tools_find_nothing_wrong() {
    let files = Files::write(&sample::sequence(sample::CAMERAS));
    run("mcap_tools.py", &[&files.mcap()]);
}

#[test]
fn viewers_are_shown_what_the_tables_say() {
    for cameras in [sample::CAMERAS, sample::MIRRORED_CAMERAS] {
        let files = Files::write(&sample::sequence(cameras));
        run("foxglove_channels.py", &[&files.mcap(), &files.rows()]);
    }
}

#[test]
fn rerun_reads_what_the_tables_say() {
    for cameras in [sample::CAMERAS, sample::MIRRORED_CAMERAS] {
        let sequence = sample::sequence(cameras);
        let files = Files::write(&sequence);
        let [recording, again] = ["sample.rrd", "again.rrd"].map(|name| files.folder.path().join(name));
        format::write_rerun(&recording, &sequence).unwrap();
        format::write_rerun(&again, &sequence).unwrap();
        assert!(fs::read(&recording).unwrap() == fs::read(again).unwrap(), "same rows, same bytes");
        let manifest = files.folder.path().join("manifest.json");
        fs::write(&manifest, serde_json::to_string(&sequence.manifest).unwrap()).unwrap();
        run("rerun_recording.py", &[&recording, &files.rows(), &manifest]);
    }
}

#[test]
fn every_parquet_table_is_read_in_one_line() {
    let files = Files::write(&sample::sequence(sample::CAMERAS));
    run("parquet_tables.py", &[&files.parquet(), &files.rows(), &files.schemas()]);
}

#[test]
fn landmarks_reproject_with_what_the_files_say() {
    for cameras in [sample::CAMERAS, sample::MIRRORED_CAMERAS] {
        let files = Files::write(&sample::sequence(cameras));
        run("reproject.py", &[&files.parquet()]);
    }
}

#[test]
fn croissant_describes_the_folder() {
    let files = Files::write(&sample::sequence(sample::CAMERAS));
    run("croissant_dataset.py", &[&files.parquet(), &files.rows()]);
}

#[test]
fn tables_written_by_others_are_read() {
    let sequence = sample::sequence(sample::CAMERAS);
    let files = Files::write(&sequence);
    for tool in ["pandas", "polars", "duckdb", "pyarrow"] {
        let theirs = files.folder.path().join(tool);
        run("third_party.py", &[Path::new(tool), &files.parquet(), &theirs]);
        if python().is_none() {
            return;
        }
        let reader = format::open(&theirs).unwrap();
        for stored in reader.tables() {
            assert_eq!(stored.unknown_columns, ["remark"], "{tool} {}", stored.table.name);
            assert!(stored.missing_columns.is_empty() && stored.mistyped_columns.is_empty(), "{stored:?}");
        }
        let mut expected = sequence.clone();
        // The script leaves these nullable columns out.
        expected.point_landmarks.iter_mut().for_each(|row| row.descriptor = None);
        expected.point_observations.iter_mut().for_each(|row| row.depth = None);
        expected.graph_factors.iter_mut().for_each(|row| row.information = None);
        let mut found = reader.read_all().unwrap();
        assert_eq!(found.manifest.tables.len(), TABLES.len());
        found.manifest.tables.clear();
        assert_eq!(found, expected, "{tool}");
        let frames: Vec<_> = reader.frames().unwrap().collect::<Result<_, _>>().unwrap();
        for frame in frames {
            assert_eq!(reader.frame(frame.frame.frame_id).unwrap().as_ref(), Some(&frame), "{tool}");
        }
    }
}

#[test]
fn channels_for_viewers_change_neither_the_tables_nor_from_run_to_run() {
    let sequence = sample::sequence(sample::CAMERAS);
    let (files, again) = (Files::write(&sequence), Files::write(&sequence));
    assert!(fs::read(files.mcap()).unwrap() == fs::read(again.mcap()).unwrap(), "same rows, same bytes");
    let reader = format::open(files.mcap()).unwrap();
    assert_eq!(reader.passed_over(), [] as [&str; 0]);
    let mut found = reader.read_all().unwrap();
    found.manifest.tables.clear();
    assert_eq!(found, sequence);
    assert_eq!(sequence.manifest.spec_version, registry::SPEC_VERSION);
}
