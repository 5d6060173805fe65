//! The README and the book show what the programs print, and lead nowhere that is not there.
//!
//! In a document, what stands behind a marker is used, from top to bottom, in a folder of the document's own:
//!
//! * `<!-- run -->` before a block of `console`: its commands are run, and what they print stands behind each;
//!   before a block of `python`: it is run, and what it prints is the block of `text` behind it, if there is one.
//! * `<!-- check -->` before a block of `console`: its commands are run, and what they print is nobody's business.
//! * `<!-- before: COMMAND -->`: is run and not seen; it makes what stands for data that readers have.
//! * `<!-- file: NAME -->` before any block: it becomes a file.
//! * `<!-- elsewhere: FILE -->` before a block, or at the top of a page for all of its blocks: not run here but there.
//!
//! A page that speaks of object stores has some: one server on this machine is `s3://…` and `gs://…`, and what stands in the
//! folder `example.org` is at `https://example.org/…`.
//!
//! `UPDATE_README=1 cargo test --workspace --test documents` writes the output anew.

#![expect(clippy::unwrap_used, reason = "tests")]

#[expect(dead_code, reason = "shared with a test that needs more of it")]
#[path = "storage/server.rs"]
mod server;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use server::{Kind, Server};

const RUN: &str = "<!-- run -->";
const CHECK: &str = "<!-- check -->";
const BEFORE: &str = "<!-- before: ";
const FILE: &str = "<!-- file: ";
const ELSEWHERE: &str = "<!-- elsewhere: ";
const END: &str = " -->";
const FENCE: &str = "```";
/// Where readers find what the folder `example.org` has.
const SITE: &str = "https://example.org";
/// A key of Google's that needs nobody's signature.
const GOOGLE_KEY: &str =
    r#"{"private_key": "", "private_key_id": "", "client_email": "", "disable_oauth": true}"#;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn programs() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_os")).parent().unwrap()
}

/// The folder of the Python that has other people's readers.
fn python() -> Option<PathBuf> {
    let path = std::env::var_os("OPEN_STRUCTURE_PYTHON")
        .map_or_else(|| root().join(".venv/bin/python"), PathBuf::from);
    path.exists().then(|| path.parent().unwrap().to_owned())
}

/// Markdown files in a folder and below, in order.
fn markdown(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(markdown(&path));
        } else if path.extension().is_some_and(|ending| ending == "md") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Where a document's commands run.
struct Shell<'a> {
    folder: &'a Path,
    store: Option<Server>,
}

impl<'a> Shell<'a> {
    fn new(folder: &'a Path) -> Self {
        Self { folder, store: None }
    }

    fn for_document(text: &str, folder: &'a Path) -> Self {
        let remote = ["s3://", "gs://", SITE].iter().any(|start| text.contains(start));
        Self { folder, store: remote.then(|| Server::new(Kind::Buckets)) }
    }

    /// What a command prints; it must succeed, be it with findings (3).
    fn printed(&self, program: &str, arguments: &[&str]) -> String {
        let mut path = vec![programs().to_owned()];
        path.extend(python());
        path.extend(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()));
        let mut command = Command::new(program);
        command
            .current_dir(self.folder)
            .env("PATH", std::env::join_paths(path).unwrap())
            .env("COLUMNS", "100");
        let mut site = SITE.to_owned();
        if let Some(store) = &self.store {
            site = format!("http://{}", store.address);
            command
                .envs([
                    ("AWS_ENDPOINT_URL", site.as_str()),
                    ("AWS_REGION", "here"),
                    ("GOOGLE_BASE_URL", &site),
                ])
                .envs([("AWS_ACCESS_KEY_ID", "someone"), ("AWS_SECRET_ACCESS_KEY", "something")])
                .env("GOOGLE_SERVICE_ACCOUNT_KEY", GOOGLE_KEY);
        }
        let output = command.args(arguments.iter().map(|text| text.replace(SITE, &site))).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(
            matches!(output.status.code(), Some(0 | 3)),
            "{arguments:?}: {:?}\n{errors}",
            output.status.code()
        );
        let said = String::from_utf8_lossy(&output.stdout);
        said.lines().fold(String::new(), |mut lines, line| {
            let _ = writeln!(lines, "{}", line.trim_end());
            lines
        })
    }

    /// Runs the commands of a block; gives the block with what they print now.
    fn console(&self, block: &str) -> String {
        block.lines().filter_map(|line| line.strip_prefix("$ ")).fold(String::new(), |mut text, command| {
            let _ = write!(text, "$ {command}\n{}", self.printed("sh", &["-c", command]));
            text
        })
    }

    /// Runs what readers do not see.
    fn prepare(&self, command: &str) {
        self.printed("sh", &["-c", command]);
        let site = self.folder.join("example.org");
        if let (Some(store), true) = (&self.store, site.is_dir()) {
            for entry in site.read_dir().unwrap() {
                let entry = entry.unwrap();
                store.keep(entry.file_name().to_str().unwrap(), fs::read(entry.path()).unwrap());
            }
        }
    }
}

/// A document as it should be.
fn executed(found: &str, shell: &Shell<'_>) -> String {
    let mut expected = String::new();
    let mut lines = found.split_inclusive('\n').peekable();
    let block = |lines: &mut std::iter::Peekable<std::str::SplitInclusive<'_, char>>| {
        lines.by_ref().take_while(|line| line.trim_end() != FENCE).collect::<String>()
    };
    while let Some(line) = lines.next() {
        expected.push_str(line);
        let marker = line.trim_end();
        if let Some(command) = marker.strip_prefix(BEFORE) {
            shell.prepare(command.trim_end_matches(END));
        }
        if ![RUN, CHECK].contains(&marker) && !marker.starts_with(FILE) {
            continue;
        }
        let fence = lines.next().unwrap();
        let language =
            fence.trim_end().strip_prefix(FENCE).unwrap_or_else(|| panic!("{marker} before {fence}"));
        let content = block(&mut lines);
        let shown = match (marker.strip_prefix(FILE), language) {
            (Some(name), _) => {
                fs::write(shell.folder.join(name.trim_end_matches(END)), &content).unwrap();
                content
            }
            (None, "console") if marker == CHECK => {
                shell.console(&content);
                content
            }
            (None, "console") => shell.console(&content),
            (None, "python") if marker == RUN => content,
            (None, other) => panic!("{marker} before a block of {other:?}"),
        };
        let _ = writeln!(expected, "{fence}{shown}{FENCE}");
        if marker == RUN && language == "python" {
            let said = shell.printed("python", &["-c", &shown]);
            if lines.peek().is_some_and(|line| line.trim().is_empty()) {
                expected.push_str(lines.next().unwrap());
            }
            if let Some(fence) = lines.next_if(|line| line.trim_end() == "```text") {
                block(&mut lines);
                let _ = writeln!(expected, "{fence}{said}{FENCE}");
            }
        }
    }
    expected
}

/// Commands of a page that nobody runs: blocks of `console` and `python` without a marker.
fn never_run(text: &str) -> Vec<String> {
    let marks =
        |line: &str| [RUN, CHECK].contains(&line) || line.starts_with(FILE) || line.starts_with(ELSEWHERE);
    let mut found = Vec::new();
    let mut before = "";
    let mut in_code = false;
    let whole_page = text.lines().next().is_some_and(|line| line.starts_with(ELSEWHERE));
    for (number, line) in text.lines().enumerate() {
        if let Some(language) = line.strip_prefix(FENCE) {
            in_code = !in_code;
            if in_code && !whole_page && matches!(language, "console" | "python") && !marks(before) {
                found.push(format!("line {}: a block of {language}", number + 1));
            }
        }
        before = line;
    }
    found
}

/// Help of a program and its commands, as the book has it.
fn help(program: &str, folder: &Path) -> String {
    let shell = Shell::new(folder);
    let own = shell.printed(program, &["--help"]);
    let mut text = format!("## {program}\n\n{FENCE}text\n{own}{FENCE}\n");
    let commands =
        own.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // A line of a command is indented by two, one that goes on by more.
    let commands =
        commands.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    for command in commands.filter(|command| *command != "help") {
        let said = match (program, command) {
            // Hands over to the other program.
            ("os", "convert") => shell.printed(program, &["help", command]),
            _ => shell.printed(program, &[command, "--help"]),
        };
        let _ = write!(text, "\n### {program} {command}\n\n{FENCE}text\n{said}{FENCE}\n");
    }
    text
}

/// Holds a document against what it should be, or writes it.
fn hold(path: &Path, expected: &str) -> Result<(), String> {
    let found = fs::read_to_string(path).unwrap_or_default();
    if found == expected {
        return Ok(());
    }
    if std::env::var_os("UPDATE_README").is_some() {
        fs::write(path, expected).unwrap();
        return Ok(());
    }
    let differ = found.lines().zip(expected.lines()).position(|(found, expected)| found != expected);
    let line = differ.unwrap_or_else(|| found.lines().count().min(expected.lines().count()));
    Err(format!(
        "{} line {}: expected {:?}, found {:?}",
        path.display(),
        line + 1,
        expected.lines().nth(line),
        found.lines().nth(line)
    ))
}

fn both_programs() -> bool {
    let both = programs().join("os-convert").is_file();
    if !both {
        eprintln!("SKIPPED: documents: os-convert is not built (cargo test --workspace builds it)");
    }
    both
}

/// Runs a document in a folder of its own.
fn runs(path: &Path) -> Result<(), String> {
    let found = fs::read_to_string(path).unwrap();
    let needs_python = found.contains("<!-- run -->\n```python") || found.contains("\n$ python ");
    if needs_python && python().is_none() {
        let what = format!("{}: no Python with packages; `make setup` makes it", path.display());
        assert!(std::env::var("CI").as_deref() != Ok("true"), "{what}");
        eprintln!("SKIPPED: {what}");
        return Ok(());
    }
    let folder = tempfile::tempdir().unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(root().join("sequences"), folder.path().join("sequences")).unwrap();
    hold(path, &executed(&found, &Shell::for_document(&found, folder.path())))
}

#[test]
fn the_readme_shows_what_the_programs_print() {
    if both_programs() {
        let path = root().join("README.md");
        assert!(fs::read_to_string(&path).unwrap().contains(RUN), "no block of the README is run");
        runs(&path).unwrap();
    }
}

#[test]
fn the_book_shows_what_the_programs_print() {
    if both_programs() {
        let wrong: Vec<String> =
            markdown(&root().join("docs/src")).iter().filter_map(|path| runs(path).err()).collect();
        assert!(
            wrong.is_empty(),
            "UPDATE_README=1 cargo test --workspace --test documents\n{}",
            wrong.join("\n")
        );
    }
}

#[test]
fn no_command_stands_in_the_book_that_is_never_run() {
    let mut elsewhere = 0;
    for page in markdown(&root().join("docs/src")) {
        let text = fs::read_to_string(&page).unwrap();
        assert_eq!(never_run(&text), [""; 0], "{}", page.display());
        for place in text.lines().filter_map(|line| line.strip_prefix(ELSEWHERE)) {
            let place = place.trim_end_matches(END);
            assert!(root().join(place).is_file(), "{}: no {place}", page.display());
            elsewhere += 1;
        }
    }
    assert!(elsewhere < 10, "{elsewhere} blocks are not run here");
}

#[test]
fn the_books_reference_of_the_command_line_is_the_programs_own_help() {
    if both_programs() {
        let folder = tempfile::tempdir().unwrap();
        let text = format!(
            "# Command line\n\n`os` works on sequences, `os-convert` makes them of raw data. This page is their own help.\n\n{}\n{}",
            help("os", folder.path()),
            help("os-convert", folder.path())
        );
        assert!(text.contains("\n### os adjust\n") && text.contains("\n### os-convert tum\n"));
        hold(&root().join("docs/src/reference/cli.md"), &text).unwrap();
    }
}

/// Where the links of a document lead, without what stands in code.
fn links(text: &str) -> Vec<&str> {
    let mut in_code = false;
    let mut found = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with(FENCE) {
            in_code = !in_code;
        }
        if !in_code {
            found.extend(line.split("](").skip(1).filter_map(|rest| rest.split([')', ' ']).next()));
        }
        found.extend(line.strip_prefix("{{#include ").map(|rest| rest.trim_end_matches("}}")));
    }
    found
}

#[test]
fn links_between_files_lead_somewhere() {
    let mut documents = markdown(&root().join("docs"));
    documents.extend(
        ["README.md", "CONTRIBUTING.md", "benches/README.md", "converters/README.md"]
            .map(|name| root().join(name)),
    );
    documents.extend(
        ["sequences/README.md", "examples/plug-in/README.md", "examples/distributed/README.md"]
            .map(|name| root().join(name)),
    );
    let mut checked = 0;
    for document in documents {
        let text = fs::read_to_string(&document).unwrap();
        for link in links(&text).into_iter().filter(|link| !link.contains("://") && !link.starts_with('#')) {
            let file = link.split('#').next().unwrap();
            assert!(document.parent().unwrap().join(file).exists(), "{}: no {link}", document.display());
            checked += 1;
        }
    }
    assert!(checked > 40, "{checked} links");
}

#[test]
fn every_page_of_the_book_stands_in_its_summary() {
    let source = root().join("docs/src");
    let summary = fs::read_to_string(source.join("SUMMARY.md")).unwrap();
    let listed = links(&summary);
    for page in markdown(&source) {
        let name = page.strip_prefix(&source).unwrap().to_str().unwrap().to_owned();
        assert!(name == "SUMMARY.md" || listed.contains(&name.as_str()), "SUMMARY.md lacks {name}");
    }
}
