//! Collections: query engines read all sequences as one, and a distributed run gives the table of one machine.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use open_structure::format::{self, Collection, WriteOptions, folder_name, write_catalogue};

use crate::{python, run, sample};

/// A collection of the sample, its measurements cut to different lengths.
fn sequences(folder: &Path) -> BTreeMap<String, usize> {
    let whole = sample::sequence(sample::CAMERAS);
    let mut counts = BTreeMap::new();
    // The last is the one that is damaged, and no engine takes it for the first.
    for (cut, name) in ["1", "b 2=c", "größe", "last"].into_iter().enumerate() {
        let mut sequence = whole.clone();
        sequence.manifest.name = name.to_owned();
        let rows = sequence.point_measurements.len() - cut;
        sequence.point_measurements.truncate(rows);
        if cut == 1 {
            sequence.trajectories.iter_mut().for_each(|row| row.estimate = "only-here".to_owned());
            sequence.trajectories.sort_by_key(|row| row.frame_id);
            sequence.trajectories.dedup_by_key(|row| row.frame_id);
        }
        format::write(&folder.join(folder_name(name)), &sequence, WriteOptions::default()).unwrap();
        counts.insert(name.to_owned(), rows);
    }
    let entries: Vec<_> =
        Collection::open(folder).unwrap().entries(None).into_iter().map(Result::unwrap).collect();
    write_catalogue(folder, &entries, false).unwrap();
    counts
}

#[test]
fn engines_query_a_collection_and_open_only_what_they_need() {
    let folder = tempfile::tempdir().unwrap();
    let counts = sequences(folder.path());
    let wanted = tempfile::NamedTempFile::new().unwrap();
    fs::write(wanted.path(), serde_json::to_string(&counts).unwrap()).unwrap();
    run("collection_queries.py", &[folder.path(), wanted.path()]);
}

const OS: &str = env!("CARGO_BIN_EXE_os");

/// The example, run in a folder with a program in the place of `os`; `None` without Python.
fn distributed(folder: &Path, program: &Path, more: &[&str]) -> Option<Output> {
    let python = python()?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/distributed/benchmark_collection.py");
    let home = tempfile::tempdir().unwrap();
    let output = Command::new(python)
        .current_dir(folder)
        .arg(script)
        .args(["all", "-o", "results", "--jobs", "jobs.txt", "--workers", "2", "--program"])
        .arg(program)
        .args(more)
        .args(["--", "--seeds", "2", "--methods", "map-to-frame,structural-ba"])
        .env("HOME", home.path())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap();
    Some(output)
}

/// A folder with recipes, the jobs that make sequences of them, and one sequence that is there already.
fn jobs() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let recipe = Path::new(env!("CARGO_MANIFEST_DIR")).join("sequences/box1.toml");
    let text = fs::read_to_string(recipe).unwrap();
    let text = text.split("[expected]").next().unwrap();
    let mut jobs = "# name and command\n".to_owned();
    for (frames, name) in [(25, "one"), (30, "two"), (35, "three")] {
        let text = text
            .replace("frames = 447", &format!("frames = {frames}"))
            .replace("name = \"box1\"", &format!("name = \"{name}\""));
        fs::write(folder.path().join(format!("{name}.toml")), text).unwrap();
        if name == "three" {
            let output = folder.path().join("all/sequence=three");
            let made = Command::new(OS)
                .current_dir(&folder)
                .args(["simulate", "three.toml", "-o"])
                .arg(output)
                .output();
            assert!(made.unwrap().status.success());
        } else {
            jobs.push_str(&format!("{name} os simulate {name}.toml -o {{output}}\n"));
        }
    }
    fs::write(folder.path().join("jobs.txt"), jobs).unwrap();
    folder
}

/// A program that does something before it is `os`.
#[cfg(unix)]
fn wrapper(folder: &Path, before: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt as _;
    let path = folder.join("wrapped-os");
    fs::write(&path, format!("#!/bin/sh\n{before}\nexec '{OS}' \"$@\"\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path
}

/// The table of one machine, made of the collection that a distributed run left.
fn one_machine(folder: &Path) -> String {
    let options = ["all", "-o", "one", "--seeds", "2", "--methods", "map-to-frame,structural-ba"];
    let output = Command::new(OS).current_dir(folder).arg("benchmark").args(options).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::read_to_string(folder.join("one/table.md")).unwrap()
}

/// Runs the example although something goes wrong the first time; it has to, and to end as if nothing had.
#[cfg(unix)]
fn survives(before: &str, marks: &[&str]) {
    let folder = jobs();
    let at = folder.path();
    let program = wrapper(at, &before.replace("$MARKS", &at.display().to_string()));
    let Some(output) = distributed(at, &program, &[]) else { return };
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    for mark in marks {
        assert!(at.join(mark).exists(), "{mark}: nothing went wrong, so nothing was shown");
    }
    let table = fs::read_to_string(at.join("results/table.md")).unwrap();
    assert!(table.contains("| one |") && table.contains("| two |") && table.contains("| three |"), "{table}");
    assert_eq!(table, one_machine(at));
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(shown.contains("3 sequences, 90 frames") && shown.contains(&table), "{shown}");
    let found = Command::new(OS).current_dir(at).args(["validate", "all"]).output().unwrap();
    assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stdout));
}

#[cfg(unix)]
#[test]
fn tasks_that_fail_once_are_tried_again_and_the_table_is_that_of_one_machine() {
    let fail = |mark: &str| {
        format!("[ -e $MARKS/{mark} ] || {{ touch $MARKS/{mark}; echo out of luck >&2; exit 1; }}")
    };
    let before = format!(
        "case \"$1 $2 $3\" in\n'simulate two'*) {};;\n'benchmark '*one*) {};;\nesac",
        fail("failed-two"),
        fail("failed-one")
    );
    survives(&before, &["failed-two", "failed-one"]);
}

#[cfg(unix)]
#[test]
fn a_worker_that_is_killed_leaves_nothing_half_made() {
    // The worker dies first, then the program in the midst of its output.
    let kill = "[ -e $MARKS/killed ] || { touch $MARKS/killed; mkdir -p $MARKS/all/.sequence=two.1.partial; kill -9 $PPID; kill -9 $$; }";
    survives(&format!("case \"$1 $2\" in\n'simulate two'*) {kill};;\nesac"), &["killed"]);
}

#[cfg(unix)]
#[test]
fn a_task_that_always_fails_is_told_by_name_and_there_is_no_table() {
    let folder = jobs();
    let at = folder.path();
    let program = wrapper(at, "case \"$1 $2\" in 'simulate two'*) echo never >&2; exit 1;; esac");
    let Some(output) = distributed(at, &program, &["--retries", "1"]) else { return };
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("two: ") && said.contains("never") && !said.contains("\none: "), "{said}");
    assert!(!at.join("results").exists() && !at.join("all/catalogue.parquet").exists());
}
