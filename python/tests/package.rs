//! The Python package, laid out as its wheel is, and tried by `pytest` beside the program `os`.
//!
//! The tests are those of `python/tests`; they run with `.venv/bin/python`, or with the interpreter that
//! `OPEN_STRUCTURE_PYTHON` names. Without one they are skipped, except in CI.

#![expect(clippy::unwrap_used, clippy::print_stderr, reason = "tests")]

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The Python that has the packages of `tests/python/requirements.txt`.
fn python() -> Result<PathBuf, String> {
    let path = env::var_os("OPEN_STRUCTURE_PYTHON")
        .map_or_else(|| project().join("../.venv/bin/python"), PathBuf::from);
    if path.exists() {
        Ok(path)
    } else {
        Err(format!("no Python at {}; `make setup` makes it", path.display()))
    }
}

/// Where Cargo puts programs, from where it puts tests.
fn programs() -> PathBuf {
    env::current_exe().unwrap().parent().unwrap().parent().unwrap().to_owned()
}

/// The program `os`, which `cargo test --workspace` builds.
fn os() -> Result<PathBuf, String> {
    let path = programs().join(format!("os{}", env::consts::EXE_SUFFIX));
    if path.exists() {
        Ok(path)
    } else {
        Err("os is not built; `cargo test --workspace` builds it".to_owned())
    }
}

/// The package as a wheel has it: the sources beside the native half, which Cargo built for this test.
fn lay_out(folder: &Path) {
    let package = folder.join("open_structure");
    fs::create_dir(&package).unwrap();
    for entry in fs::read_dir(project().join("open_structure")).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            fs::copy(&path, package.join(path.file_name().unwrap())).unwrap();
        }
    }
    let name = format!("{}open_structure_python{}", env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX);
    fs::copy(programs().join("deps").join(name), package.join("_native.abi3.so")).unwrap();
}

/// Runs `pytest` over some of the tests.
fn pytest(tests: &[&str]) {
    let (python, os) = match (python(), os()) {
        (Ok(python), Ok(os)) => (python, os),
        (Err(what), _) | (_, Err(what)) => {
            assert!(env::var("CI").as_deref() != Ok("true"), "{what}");
            eprintln!("SKIPPED: the Python package: {what}");
            return;
        }
    };
    let folder = tempfile::tempdir().unwrap();
    lay_out(folder.path());
    // A home of its own, for some tools keep settings there.
    let home = tempfile::tempdir().unwrap();
    let output = Command::new(&python)
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir"])
        .arg(project())
        .arg("-c")
        .arg(project().join("pyproject.toml"))
        .args(tests.iter().map(|test| project().join("tests").join(test)))
        // Python looks for modules in the current folder first, and the sources lack the native half.
        .current_dir(home.path())
        .env("PYTHONPATH", folder.path())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("OPEN_STRUCTURE_OS", os)
        .env("HOME", home.path())
        // Notebooks show their figures themselves.
        .env_remove("MPLBACKEND")
        .env("MYPYPATH", folder.path())
        .env("MYPY_CACHE_DIR", home.path().join("mypy"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    eprint!("{said}");
}

#[test]
fn tables_and_sequences_are_what_the_files_say() {
    pytest(&["test_tables.py", "test_sequence.py", "test_estimate.py"]);
}

#[test]
fn functions_give_what_the_commands_give() {
    pytest(&["test_steps.py"]);
}

#[test]
fn stores_of_others_take_and_give_sequences() {
    pytest(&["test_stores.py"]);
}

#[test]
fn types_are_what_the_stubs_say() {
    pytest(&["test_types.py"]);
}

#[test]
fn the_notebooks_and_the_guide_run() {
    pytest(&["test_documents.py"]);
}
