//! The page of `os report` in a browser, and its code made again from its sources.
//!
//! The browser is driven by `tests/report_page/browse.mjs`, which needs Node.js, the packages of `src/report/page` (`make setup`)
//! and a Chromium: that which `OPEN_STRUCTURE_CHROMIUM` names, or one on the path. Without them the tests are skipped, except in CI.

#![expect(clippy::unwrap_used, clippy::print_stderr, reason = "tests")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Says loudly that a test is skipped; in CI nothing is.
fn skipped(what: &str) {
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{what}");
    eprintln!("SKIPPED: {what}");
}

/// Whether Node.js and the packages are here.
fn has_packages() -> bool {
    let node = Command::new("node").arg("--version").output().is_ok_and(|found| found.status.success());
    let here = node && root().join("src/report/page/node_modules/playwright-core").is_dir();
    if !here {
        skipped("no node with the packages of src/report/page; `make setup` installs them");
    }
    here
}

fn chromium() -> Option<PathBuf> {
    let named = std::env::var_os("OPEN_STRUCTURE_CHROMIUM").map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    let on_path = || std::env::split_paths(&path).flat_map(|folder| names.map(|name| folder.join(name)));
    let found = named.or_else(|| on_path().find(|browser| browser.is_file()));
    if found.is_none() {
        skipped("no Chromium; OPEN_STRUCTURE_CHROMIUM names one");
    }
    found
}

/// Runs the browser over a page; gives what it said.
fn browse(chromium: &Path, mode: &str, page: &Path) -> String {
    let output = Command::new("node")
        .arg(root().join("tests/report_page/browse.mjs"))
        .args([Path::new(mode), page])
        .env("OPEN_STRUCTURE_CHROMIUM", chromium)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    eprint!("{said}");
    said
}

/// Runs a command; frames that a tracker predicts are findings, and do not matter here.
fn os(folder: &Path, arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_os")).current_dir(folder).args(arguments).output().unwrap();
    assert!(matches!(output.status.code(), Some(0 | 3)), "os {}: {output:?}", arguments.join(" "));
}

/// Recipe of box1 with other numbers.
fn recipe(folder: &Path, name: &str, frames: usize, points: usize) {
    let text = fs::read_to_string(root().join("sequences/box1.toml")).unwrap();
    let text = text.split("[expected]").next().unwrap();
    let text = text
        .replace("frames = 447", &format!("frames = {frames}"))
        .replace("count = 130", &format!("count = {points}"))
        .replace("name = \"box1\"", &format!("name = \"{name}\""));
    fs::write(folder.join(format!("{name}.toml")), text).unwrap();
    os(folder, &["simulate", &format!("{name}.toml"), "-o", name]);
}

#[test]
fn the_bundle_is_what_its_sources_make() {
    if !has_packages() {
        return;
    }
    let build =
        Command::new("node").arg(root().join("src/report/page/build.mjs")).arg("--check").output().unwrap();
    assert!(build.status.success(), "{}", String::from_utf8_lossy(&build.stderr));
}

#[test]
fn the_list_of_packages_names_no_registry() {
    let text = fs::read_to_string(root().join("src/report/page/package-lock.json")).unwrap();
    let lock: Value = serde_json::from_str(&text).unwrap();
    let packages = lock["packages"].as_object().unwrap();
    assert!(packages.len() > 4);
    for (name, package) in packages {
        assert!(package.get("resolved").is_none(), "{name}");
        assert!(name.is_empty() || package.get("integrity").is_some(), "{name}");
    }
}

#[test]
fn a_page_works_in_a_browser() {
    let Some(chromium) = has_packages().then(chromium).flatten() else { return };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    recipe(at, "short", 60, 130);
    os(at, &["track", "short", "-o", "ftf", "--method", "frame-to-frame"]);
    os(at, &["track", "ftf", "-o", "mtf"]);
    os(at, &["graph", "mtf", "-o", "graph", "--estimate", "map-to-frame"]);
    os(at, &["adjust", "graph", "-o", "adjusted", "--method", "structural"]);
    let results = "[{\"sequence\":\"short\",\"method\":\"point-ba\",\"ape_rmse_cm\":1.5,\"over_bound\":1.2}]";
    fs::write(at.join("results.json"), results).unwrap();
    os(at, &["report", "adjusted", "short", "results.json", "-o", "report.html"]);
    let said = browse(&chromium, "check", &at.join("report.html"));
    assert!(
        said.contains("fits a phone") && said.contains("prints") && said.contains("accessible, dark"),
        "{said}"
    );
}

#[test]
fn three_hundred_thousand_measurements_stay_fluid() {
    let Some(chromium) = has_packages().then(chromium).flatten() else { return };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    recipe(at, "long", 1500, 1000);
    os(at, &["report", "long", "-o", "report.html"]);
    let said = browse(&chromium, "speed", &at.join("report.html"));
    let found: Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    let number = |name: &str| found[name].as_f64().unwrap();
    let rows = open_structure::format::open(at.join("long")).unwrap();
    let measured = rows.manifest().table("point_measurements").unwrap().rows;
    assert!(measured >= 300_000, "{measured} measurements");
    assert!(number("megabytes") < 10.0, "{found}");
    // Graphics in software beside other tests: bounds are many times what a machine at rest needs.
    assert!(number("seconds_until_ready") < 30.0, "{found}");
    assert!(number("picture_median_ms") < 250.0, "{found}");
    assert!(number("frame_step_ms") < 500.0, "{found}");
}
