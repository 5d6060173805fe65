//! Sequences and whatever else has a path, in object stores and behind HTTP, against a server in this folder; never the
//! Internet.

#![expect(clippy::unwrap_used, reason = "tests")]

mod server;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use open_structure::format::{self, WriteOptions};
use open_structure::structure::{FrameId, PointMeasurement, Sequence};
use server::{Kind, Server};
use tempfile::TempDir;

/// A key of Google's that needs nobody's signature.
const GOOGLE_KEY: &str =
    r#"{"private_key": "", "private_key_id": "", "client_email": "", "disable_oauth": true}"#;

/// A store, and by which URLs it is spoken to.
struct Store {
    server: Server,
    scheme: &'static str,
}

impl Store {
    fn all() -> [Self; 3] {
        [("s3", Kind::Buckets), ("gs", Kind::Buckets), ("http", Kind::Pages)]
            .map(|(scheme, kind)| Self { server: Server::new(kind), scheme })
    }

    fn url(&self, key: &str) -> String {
        match self.scheme {
            "http" => format!("http://{}/bucket/{key}", self.server.address),
            scheme => format!("{scheme}://bucket/{key}"),
        }
    }

    fn os(&self, folder: &Path, arguments: &[&str]) -> Output {
        let endpoint = format!("http://{}", self.server.address);
        let mut command = Command::new(env!("CARGO_BIN_EXE_os"));
        command.current_dir(folder).args(arguments);
        for (name, _) in
            std::env::vars().filter(|(name, _)| name.starts_with("AWS_") || name.starts_with("GOOGLE_"))
        {
            command.env_remove(name);
        }
        match self.scheme {
            "s3" => command
                .env("AWS_ENDPOINT_URL", endpoint)
                .env("AWS_ACCESS_KEY_ID", "someone")
                .env("AWS_SECRET_ACCESS_KEY", "something")
                .env("AWS_REGION", "here"),
            "gs" => command.env("GOOGLE_BASE_URL", endpoint).env("GOOGLE_SERVICE_ACCOUNT_KEY", GOOGLE_KEY),
            _ => &mut command,
        };
        command.output().unwrap()
    }

    fn done(&self, folder: &Path, arguments: &[&str]) -> String {
        let output = self.os(folder, arguments);
        let words = String::from_utf8_lossy(&output.stderr);
        // Be it with findings.
        assert!(matches!(output.status.code(), Some(0 | 3)), "{} {arguments:?}: {words}", self.scheme);
        String::from_utf8(output.stdout).unwrap()
    }

    /// What a command says that fails.
    fn failed(&self, folder: &Path, arguments: &[&str]) -> String {
        let output = self.os(folder, arguments);
        assert_eq!(output.status.code(), Some(1), "{} {arguments:?}", self.scheme);
        String::from_utf8(output.stderr).unwrap()
    }
}

/// A folder with the sample as `sample.mcap` and as `sample`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("sequences/box1.toml");
    let made = Command::new(env!("CARGO_BIN_EXE_os"))
        .current_dir(folder.path())
        .args(["simulate", sample.to_str().unwrap(), "-o", "box1"])
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    format::write(
        &folder.path().join("box1.mcap"),
        &read(&folder.path().join("box1")),
        WriteOptions::default(),
    )
    .unwrap();
    folder
}

fn read(path: &Path) -> Sequence {
    format::read(path).unwrap()
}

fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files: Vec<_> = folder
        .read_dir()
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into(), fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    files
}

#[test]
fn what_goes_into_a_store_comes_out_bit_by_bit() {
    let folder = folder();
    let at = folder.path();
    for store in Store::all() {
        let (parquet, mcap) = (store.url("data/box1"), store.url("data/box1.mcap"));
        let said = store.done(at, &["copy", "box1", "-o", &parquet]);
        assert!(said.contains(&parquet), "{said}");
        store.done(at, &["copy", "box1", "-o", &mcap]);
        let objects = store.server.objects();
        assert!(
            objects["bucket/data/box1.mcap"] == fs::read(at.join("box1.mcap")).unwrap(),
            "{}",
            store.scheme
        );
        for (name, bytes) in files(&at.join("box1")) {
            assert!(objects[&format!("bucket/data/box1/{}", name.display())] == bytes, "{}", name.display());
        }
        assert_eq!(objects.len(), 1 + files(&at.join("box1")).len());

        let local = at.join(store.scheme);
        fs::create_dir(&local).unwrap();
        store.done(&local, &["copy", &parquet, "-o", "a"]);
        store.done(&local, &["copy", &mcap, "-o", "a.mcap"]);
        assert!(files(&local.join("a")) == files(&at.join("box1")));
        assert!(objects["bucket/data/box1.mcap"] == fs::read(local.join("a.mcap")).unwrap());
        for url in [&parquet, &mcap] {
            let ours = store.done(at, &["validate", url]);
            assert!(ours.starts_with(&format!("{url}: conformant; 40 445 rows")), "{ours}");
            assert!(store.done(at, &["info", url]).contains("447"));
            let rows = |path: &str| store.done(at, &["cat", path, "point_measurements", "--frame", "7"]);
            assert_eq!(rows(url), rows("box1"));
        }
        assert!(fs::read_dir(std::env::temp_dir()).unwrap().flatten().all(|entry| {
            // Of other tests' processes there may be some.
            !entry.file_name().to_string_lossy().contains("box1.mcap.partial")
        }));
    }
}

#[test]
fn only_what_is_read_is_fetched() {
    let folder = folder();
    let at = folder.path();
    // Longer than a few blocks of a reader.
    let mut sequence = read(&at.join("box1"));
    let longest = 120;
    let rows = std::mem::take(&mut sequence.point_measurements);
    let frames = std::mem::take(&mut sequence.frames);
    let beyond = frames.last().unwrap().frame_id.0 + 1;
    for time in 0..longest {
        sequence.frames.extend(frames.iter().cloned().map(|mut frame| {
            frame.frame_id = FrameId(frame.frame_id.0 + beyond * time);
            frame.stamp_nanos += 1_000_000_000_000 * time;
            frame
        }));
        sequence.point_measurements.extend(rows.iter().cloned().map(|mut row: PointMeasurement| {
            row.frame_id = FrameId(row.frame_id.0 + beyond * time);
            row
        }));
    }
    format::write(&at.join("long"), &sequence, WriteOptions::default()).unwrap();
    format::write(&at.join("long.mcap"), &sequence, WriteOptions::default()).unwrap();
    for store in Store::all() {
        store.server.keep_folder("bucket/long", &at.join("long"));
        store.server.keep("bucket/long.mcap", fs::read(at.join("long.mcap")).unwrap());
        for name in ["long", "long.mcap"] {
            let whole = open_structure::storage::size(&at.join(name), &[]);
            store.server.sent();
            let frame = (beyond * longest / 2).to_string();
            let rows = |path: &str| store.done(at, &["cat", path, "point_measurements", "--frame", &frame]);
            let found = rows(&store.url(name));
            let sent = store.server.sent();
            assert!(!found.is_empty() && found == rows(name));
            assert!(whole > 8 << 20 && sent < whole / 4, "{} {name}: {sent} bytes of {whole}", store.scheme);
        }
        // Larger than a part of an upload.
        store.done(at, &["copy", "long.mcap", "-o", &store.url("again.mcap")]);
        assert!(store.server.objects()["bucket/again.mcap"] == fs::read(at.join("long.mcap")).unwrap());
        assert_eq!(store.server.left_open(), 0);
    }
}

#[test]
fn nothing_is_replaced_without_force_and_what_makes_a_sequence_comes_last() {
    let folder = folder();
    let at = folder.path();
    for store in Store::all() {
        for name in ["box1", "box1.mcap"] {
            let url = store.url(name);
            store.done(at, &["copy", "box1", "-o", &url]);
            let before = store.server.objects();
            let words = store.failed(at, &["copy", "box1", "-o", &url]);
            assert!(words.contains("exists") && words.contains(&url), "{words}");
            assert!(store.server.objects() == before);
            assert!(store.failed(at, &["copy", &url, "-o", &url, "--force"]).contains("is the input itself"));
        }
        let lists = store.scheme != "http";
        if lists {
            // Left by a sequence with more tables.
            store.server.keep("bucket/box1/graph_poses.parquet", b"old".to_vec());
        }
        store.server.asked();
        store.done(
            at,
            &[
                "measure",
                "box1",
                "-o",
                &store.url("box1"),
                "--noise",
                "first-release",
                "--seed",
                "3",
                "--force",
            ],
        );
        let asked = store.server.asked();
        let puts: Vec<&String> = asked.iter().filter(|line| line.starts_with("PUT")).collect();
        assert_eq!(*puts.last().unwrap(), "PUT bucket/box1/sequence.json");
        if lists {
            let removed =
                asked.iter().position(|line| line.starts_with("POST bucket") || line.starts_with("DELETE"));
            let put = asked.iter().position(|line| line.starts_with("PUT"));
            assert!(removed.unwrap() < put.unwrap(), "{asked:?}");
            assert!(!store.server.objects().contains_key("bucket/box1/graph_poses.parquet"));
            store.server.keep("bucket/box1/thesis.tex", b"mine".to_vec());
            let words = store.failed(at, &["copy", "box1", "-o", &store.url("box1"), "--force"]);
            assert!(words.contains("thesis.tex"), "{words}");
            assert!(store.server.objects().contains_key("bucket/box1/thesis.tex"));
        }
    }
}

#[test]
fn everything_that_has_a_path_may_have_a_url() {
    let folder = folder();
    let at = folder.path();
    for store in Store::all() {
        let url = |key: &str| store.url(key);
        // Recipes.
        let box1 =
            fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("sequences/box1.toml")).unwrap();
        store.server.keep("bucket/box1.toml", box1.into_bytes());
        store.done(at, &["simulate", &url("box1.toml"), "-o", &url("made.mcap"), "--force"]);
        store.done(at, &["simulate", "box1", "-o", "made.mcap", "--force"]);
        assert!(store.server.objects()["bucket/made.mcap"] == fs::read(at.join("made.mcap")).unwrap());
        // From measurements to figures.
        store.done(
            at,
            &[
                "measure",
                &url("made.mcap"),
                "-o",
                &url("measured.mcap"),
                "--noise",
                "first-release",
                "--seed",
                "1",
            ],
        );
        store.done(at, &["track", &url("measured.mcap"), "-o", &url("tracked")]);
        store.done(at, &["graph", &url("tracked"), "-o", &url("graph.mcap"), "--estimate", "map-to-frame"]);
        store.done(at, &["adjust", &url("graph.mcap"), "-o", &url("adjusted.mcap")]);
        assert!(store.done(at, &["evaluate", &url("adjusted.mcap")]).contains("-ba"));
        assert!(store.done(at, &["stats", &url("adjusted.mcap")]).contains("447"));
        // Files of others, in and out.
        store.done(
            at,
            &[
                "export",
                &url("adjusted.mcap"),
                "--to",
                "tum",
                "--estimate",
                "map-to-frame",
                "-o",
                &url("path.txt"),
            ],
        );
        let import = [
            "import-trajectory",
            &url("made.mcap"),
            &url("path.txt"),
            "--name",
            "theirs",
            "-o",
            &url("theirs.mcap"),
        ];
        store.done(at, &import);
        store.done(at, &["export", &url("adjusted.mcap"), "--to", "csv", "-o", &url("csv")]);
        assert!(store.server.objects().contains_key("bucket/csv/point_measurements.csv"));
        store.done(
            at,
            &[
                "export",
                &url("adjusted.mcap"),
                "--to",
                "bal",
                "--estimate",
                "map-to-frame",
                "-o",
                &url("problem.txt"),
            ],
        );
        store.done(at, &["import", &url("problem.txt"), "-o", &url("imported")]);
        assert!(store.done(at, &["info", &url("imported")]).contains("problem"));
        // What people look at.
        store.done(at, &["plot", &url("adjusted.mcap"), "-o", &url("scene.svg")]);
        store.done(at, &["report", &url("adjusted.mcap"), "-o", &url("report.html")]);
        let objects = store.server.objects();
        assert!(
            objects["bucket/scene.svg"].starts_with(b"<svg")
                && objects["bucket/report.html"].starts_with(b"<!")
        );
    }
}

#[test]
fn a_signed_url_is_good_for_what_it_names() {
    let folder = folder();
    let at = folder.path();
    let store = &Store::all()[2];
    store.server.keep("bucket/signed/box1.mcap", fs::read(at.join("box1.mcap")).unwrap());
    store.server.keep(
        "bucket/signed/graph.g2o",
        b"VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n".to_vec(),
    );
    store.server.sign("bucket/signed");
    let signed = |name: &str| format!("{}?to=a/b&signature=right", store.url(&format!("signed/{name}")));
    let words = store.failed(at, &["info", &store.url("signed/box1.mcap")]);
    assert!(words.contains("403") || words.contains("not signed"), "{words}");
    store.server.asked();
    assert_eq!(
        store.done(at, &["cat", &signed("box1.mcap"), "point_measurements", "--frame", "7"]),
        store.done(at, &["cat", "box1.mcap", "point_measurements", "--frame", "7"])
    );
    // The first byte tells how long the file is; then only what is wanted.
    let asked = store.server.asked();
    assert!(asked.iter().all(|line| line.starts_with("GET") || !line.contains("signed/")), "{asked:?}");
    // A signature is nobody's to keep.
    store.done(at, &["import", &signed("graph.g2o"), "-o", "imported"]);
    let manifest = fs::read_to_string(at.join("imported/sequence.json")).unwrap();
    assert!(manifest.contains("\"graph\"") && !manifest.contains("signature"), "{manifest}");
    // Servers that know no signatures do not mind.
    store.server.keep("bucket/open.mcap", fs::read(at.join("box1.mcap")).unwrap());
    assert!(store.done(at, &["info", &format!("{}?download=1", store.url("open.mcap"))]).contains("box1"));
}

#[test]
fn folders_of_files_are_sent() {
    let folder = folder();
    let at = folder.path();
    for store in Store::all() {
        store.done(at, &["man", "-o", &store.url("man1")]);
        let objects = store.server.objects();
        assert!(
            objects["bucket/man1/os.1"].starts_with(b".") && objects.contains_key("bucket/man1/os-adjust.1")
        );
        // What somebody else put there stays.
        store.server.keep("bucket/man1/other.1", b"other".to_vec());
        store.done(at, &["man", "-o", &store.url("man1")]);
        assert!(store.server.objects().contains_key("bucket/man1/other.1"));

        // Raw data, downloaded here and sent there.
        store.server.keep("origin/poses.txt", b"0 0 0 0 0 0 0 1\n".to_vec());
        let recipe = include_str!("../../sequences/hospital.toml");
        let (camera, _) = recipe.split_once("[raw]").unwrap();
        let place = format!("http://{}/origin/poses.txt", store.server.address);
        let raw = format!("[raw]\nfolder = \".\"\n[[raw.files]]\nurls = [{place:?}]\nunpack = false\n");
        fs::write(at.join("dataset.toml"), format!("{camera}{raw}")).unwrap();
        let fetch = ["fetch", "dataset.toml", "-o", &store.url("raw/hospital")];
        let said = store.done(at, &fetch);
        assert!(said.contains(&format!("os-convert tartanair {}", store.url("raw/hospital"))), "{said}");
        assert_eq!(store.server.objects()["bucket/raw/hospital/poses.txt"], b"0 0 0 0 0 0 0 1\n");
        assert!(!at.join("hospital.download").exists());
        if store.scheme != "http" {
            // HTTP lists nothing, and this folder has no sequence in it that could be asked for.
            assert!(store.failed(at, &fetch).contains("--force"));
            store.done(at, &[&fetch[..], &["--force"]].concat());
        }
    }
}

#[test]
fn a_benchmark_goes_on_where_it_was_cut_off() {
    let folder = folder();
    let at = folder.path();
    let store = &Store::all()[0];
    store.server.keep("bucket/box1.mcap", fs::read(at.join("box1.mcap")).unwrap());
    let (sequence, results) = (store.url("box1.mcap"), store.url("results"));
    let run = |output: &str| {
        store
            .done(at, &["benchmark", &sequence, "-o", output, "--seeds", "1", "--methods", "frame-to-frame"]);
    };
    run(&results);
    run("local");
    let objects = store.server.objects();
    let cells: Vec<&String> = objects.keys().filter(|key| key.contains("results/cells/")).collect();
    assert_eq!(cells.len(), 1, "{objects:?}");
    let table = |path: &str| {
        let mut table = format::read_results(&at.join(path)).unwrap();
        table.columns.retain(|column| column.name != "seconds");
        table
    };
    fs::write(at.join("fetched.parquet"), &objects["bucket/results/summary.parquet"]).unwrap();
    assert_eq!(table("fetched.parquet"), table("local/summary.parquet"));
    store.server.asked();
    run(&results);
    assert!(!store.server.asked().iter().any(|line| line.starts_with("PUT") && line.contains("/cells/")));
}

#[test]
fn what_cannot_be_had_is_said_in_a_line() {
    let folder = folder();
    let at = folder.path();
    for store in Store::all() {
        store.server.keep("bucket/text.mcap", b"no sequence".to_vec());
        store.server.keep("bucket/secret/box1.mcap", fs::read(at.join("box1.mcap")).unwrap());
        store.server.forbid("bucket/secret");
        for (key, expected) in [
            ("none.mcap", "nothing is there"),
            ("none", "nothing is there"),
            ("text.mcap", "MCAP"),
            ("secret/box1.mcap", ""),
        ] {
            let url = store.url(key);
            let words = store.failed(at, &["info", &url]);
            assert!(words.contains(&url) && words.contains(expected), "{words}");
            assert_eq!(words.lines().count(), 1, "{words}");
        }
        let words = store.failed(at, &["copy", "box1", "-o", &store.url("secret/other.mcap")]);
        assert_eq!(words.lines().count(), 1, "{words}");
    }
    let store = &Store::all()[2];
    for (url, expected) in [
        ("http:///a.mcap", "no name of a bucket or host"),
        ("http://127.0.0.1:9/a.mcap", "127.0.0.1:9"),
        ("http://127.0.0.1:9/a.mcap", "refused"),
        ("http://localhost/a.mcap#first", "without `#`"),
        ("s3://", "no name of a bucket or host"),
    ] {
        let words = store.failed(at, &["info", url]);
        assert!(words.contains(expected), "{words}");
    }
}

#[test]
fn a_wrong_endpoint_is_called_by_its_name() {
    for (name, url) in [("AWS_ENDPOINT_URL", "s3://bucket/a.mcap"), ("GOOGLE_BASE_URL", "gs://bucket/a.mcap")]
    {
        for value in ["localhost:9000", "bogus", "http://", ""] {
            let output = Command::new(env!("CARGO_BIN_EXE_os"))
                .args(["info", url])
                .env(name, value)
                .env("AWS_ACCESS_KEY_ID", "someone")
                .env("AWS_SECRET_ACCESS_KEY", "something")
                .output()
                .unwrap();
            let words = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(1), "{words}");
            let expected = format!("{name}: expected http://HOST or https://HOST, found {value:?}");
            assert!(words.contains(&expected), "{words}");
        }
    }
}

#[test]
fn a_server_that_gives_no_parts_gives_the_whole() {
    let folder = folder();
    let at = folder.path();
    let store = Store { server: Server::new(Kind::WholePages), scheme: "http" };
    store.server.keep("bucket/box1.mcap", fs::read(at.join("box1.mcap")).unwrap());
    store.server.keep_folder("bucket/box1", &at.join("box1"));
    for name in ["box1", "box1.mcap"] {
        let said = store.done(at, &["validate", &store.url(name)]);
        assert!(said.contains("conformant; 40 445 rows"), "{said}");
    }
}

#[test]
fn a_collection_is_one_wherever_it_lies() {
    let folder = folder();
    let at = folder.path();
    fs::create_dir(at.join("many")).unwrap();
    fs::rename(at.join("box1"), at.join("many/sequence=box1")).unwrap();
    for store in Store::all() {
        let url = store.url("many");
        store.server.keep_folder("bucket/many", &at.join("many"));
        if store.scheme == "http" {
            // Nothing is listed there, so the catalogue has to be there first.
            assert!(store.failed(at, &["stats", &url]).contains(&url));
            store.done(at, &["index", "many"]);
            let catalogue = fs::read(at.join("many/catalogue.parquet")).unwrap();
            store.server.keep("bucket/many/catalogue.parquet", catalogue);
        } else {
            store.done(at, &["index", &url]);
            assert!(store.server.objects().contains_key("bucket/many/catalogue.parquet"));
            assert!(store.failed(at, &["index", &url]).contains("--force"));
        }
        let said = store.done(at, &["validate", &url]);
        assert!(said.contains("conformant; 40 445 rows"), "{said}");
        let statistics = |path: &str| store.done(at, &["stats", "--csv", path]);
        assert_eq!(statistics(&url), statistics("many"));
    }
}
