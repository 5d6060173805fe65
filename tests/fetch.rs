//! `os fetch` and the room below it, against a server in this file; never the Internet.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use open_structure::datasets::{self, Recipe};
use open_structure::fetch::{self, Error, Event, Fetched, Mirror, Options, Patience, What};
use open_structure::structure::hex;
use sha2::{Digest, Sha256};
use tempfile::TempDir;

/// How the server treats a path, one after another; the last one stays.
#[derive(Clone, Debug)]
enum Manner {
    /// Keeps to HTTP, ranges too.
    Whole,
    /// Sends so many bytes of what is asked for, and hangs up.
    Cut(usize),
    /// Sends so many bytes, and then nothing for a long time.
    Silent(usize),
    /// Sends so many bytes of the file whatever is asked for, and says nothing that a range could be asked with.
    NoRanges(usize),
    /// Sends the file in chunks, without its length.
    Chunked,
    /// As `Chunked`, but hangs up in the middle.
    ChunkedCut(usize),
    /// Answers with a status and a text.
    Status(u16, &'static str),
    /// Sends elsewhere.
    Redirect(String),
    /// Sends bytes slowly, so many at a time.
    Slow(usize),
}

struct Page {
    bytes: Vec<u8>,
    tag: String,
    manners: Vec<Manner>,
}

/// A server on one thread.
struct Server {
    url: String,
    pages: Arc<Mutex<BTreeMap<String, Page>>>,
    asked: Arc<Mutex<Vec<String>>>,
}

impl Server {
    fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let pages = Arc::new(Mutex::new(BTreeMap::new()));
        let asked = Arc::new(Mutex::new(Vec::new()));
        let server = Self { url, pages: Arc::clone(&pages), asked: Arc::clone(&asked) };
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                // Whoever hangs up is no reason to stop.
                let _ = answer(stream, &pages, &asked);
            }
        });
        server
    }

    fn put(&self, path: &str, bytes: &[u8], manners: &[Manner]) {
        let tag = format!("\"{}\"", &hex(&Sha256::digest(bytes))[..16]);
        let page = Page { bytes: bytes.to_vec(), tag, manners: manners.to_vec() };
        self.pages.lock().unwrap().insert(path.to_owned(), page);
    }

    /// What was asked since the last time, as `path` or `path range`.
    fn asked(&self) -> Vec<String> {
        std::mem::take(&mut *self.asked.lock().unwrap())
    }
}

fn answer(
    stream: TcpStream,
    pages: &Mutex<BTreeMap<String, Page>>,
    asked: &Mutex<Vec<String>>,
) -> std::io::Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    let mut first = String::new();
    reader.read_line(&mut first)?;
    let path = first.split(' ').nth(1).unwrap_or_default().to_owned();
    let mut headers = BTreeMap::new();
    loop {
        let mut line = String::new();
        reader.read_line(&mut line)?;
        let Some((name, value)) = line.trim_end().split_once(": ") else { break };
        headers.insert(name.to_ascii_lowercase(), value.to_owned());
    }
    let range = headers.get("range").cloned();
    asked
        .lock()
        .unwrap()
        .push(range.as_ref().map_or_else(|| path.clone(), |range| format!("{path} {range}")));
    let mut stream = stream;
    let (bytes, tag, manner) = {
        let mut pages = pages.lock().unwrap();
        let Some(page) = pages.get_mut(&path) else {
            return write!(
                stream,
                "HTTP/1.1 404 Not Found\r\ncontent-length: 0\r\nconnection: close\r\n\r\n"
            );
        };
        let manner = if page.manners.len() > 1 { page.manners.remove(0) } else { page.manners[0].clone() };
        (page.bytes.clone(), page.tag.clone(), manner)
    };
    let close = "connection: close\r\n\r\n";
    match &manner {
        Manner::Status(status, words) => {
            let length = words.len();
            return write!(
                stream,
                "HTTP/1.1 {status} x\r\ncontent-type: text/html\r\nretry-after: 0\r\ncontent-length: {length}\r\n{close}{words}"
            );
        }
        Manner::Redirect(to) => {
            return write!(stream, "HTTP/1.1 302 Found\r\nlocation: {to}\r\ncontent-length: 0\r\n{close}");
        }
        Manner::NoRanges(end) => {
            write!(stream, "HTTP/1.1 200 OK\r\ncontent-length: {}\r\n{close}", bytes.len())?;
            return stream.write_all(&bytes[..bytes.len().min(*end)]);
        }
        Manner::Chunked | Manner::ChunkedCut(_) => {
            write!(stream, "HTTP/1.1 200 OK\r\netag: {tag}\r\ntransfer-encoding: chunked\r\n{close}")?;
            let end = if let Manner::ChunkedCut(end) = manner { end } else { bytes.len() };
            for chunk in bytes[..end].chunks(1000) {
                write!(stream, "{:x}\r\n", chunk.len())?;
                stream.write_all(chunk)?;
                write!(stream, "\r\n")?;
            }
            return if end == bytes.len() { write!(stream, "0\r\n\r\n") } else { Ok(()) };
        }
        _ => {}
    }
    let whole = bytes.len();
    let same = headers.get("if-range").is_none_or(|version| *version == tag);
    let start = range
        .as_deref()
        .filter(|_| same)
        .and_then(|range| range.strip_prefix("bytes=")?.strip_suffix('-')?.parse::<usize>().ok());
    let body = match start {
        Some(start) if start >= whole => {
            return write!(
                stream,
                "HTTP/1.1 416 Range Not Satisfiable\r\ncontent-range: bytes */{whole}\r\ncontent-length: 0\r\n{close}"
            );
        }
        Some(start) => {
            write!(
                stream,
                "HTTP/1.1 206 Partial Content\r\ncontent-range: bytes {start}-{}/{whole}\r\n",
                whole - 1
            )?;
            &bytes[start..]
        }
        None => {
            write!(stream, "HTTP/1.1 200 OK\r\n")?;
            &bytes[..]
        }
    };
    write!(stream, "etag: {tag}\r\ncontent-length: {}\r\n{close}", body.len())?;
    match manner {
        Manner::Cut(end) => stream.write_all(&body[..end.min(body.len())]),
        Manner::Silent(end) => {
            stream.write_all(&body[..end.min(body.len())])?;
            stream.flush()?;
            // Until the other side has lost its patience.
            stream.set_read_timeout(Some(Duration::from_secs(10)))?;
            let _ = stream.read(&mut [0]);
            Ok(())
        }
        Manner::Slow(step) => {
            for chunk in body.chunks(step) {
                stream.write_all(chunk)?;
                stream.flush()?;
                thread::sleep(Duration::from_millis(2));
            }
            Ok(())
        }
        _ => stream.write_all(body),
    }
}

/// Bytes without a pattern, so that a lost or doubled piece shows.
fn noise(length: usize) -> Vec<u8> {
    (0..).flat_map(|block: u64| Sha256::digest(block.to_le_bytes()).to_vec()).take(length).collect()
}

/// A tar archive with `images/1.png` of some bytes, as it stands on the disk.
fn tar(content: &[u8]) -> Vec<u8> {
    let mut header = [0; 512];
    header[..12].copy_from_slice(b"images/1.png");
    header[100..108].copy_from_slice(b"0000644\0");
    header[124..136].copy_from_slice(format!("{:011o}\0", content.len()).as_bytes());
    header[156] = b'0';
    header[148..156].copy_from_slice(b"        ");
    let sum: u32 = header.iter().map(|byte| u32::from(*byte)).sum();
    header[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    let mut bytes = header.to_vec();
    bytes.extend(content);
    bytes.resize(bytes.len().next_multiple_of(512) + 1024, 0);
    bytes
}

fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// A recipe whose images are one archive at some URLs.
fn recipe_text(urls: &[String], pin: Option<&[u8]>) -> String {
    let pin = pin
        .map(|bytes| format!("bytes = {}\nsha256 = \"{}\"", bytes.len(), sha256(bytes)))
        .unwrap_or_default();
    format!(
        r#"
name = "small"
dataset = "tum"
sequence = "rgbd_dataset_small"
url = "https://example.org"
licence = "CC0-1.0"
citation = "Nobody: Nothing. 2024."

[camera]
family = "tum-fr3"
fx = 535.4
fy = 539.2
cx = 320.1
cy = 247.6
width = 640
height = 480
pixel_origin = "pixel-center"

[raw]
folder = "images"

[[raw.files]]
urls = {urls:?}
name = "small.tar"
{pin}
"#
    )
}

const PATIENCE: Patience = Patience {
    connect: Duration::from_secs(5),
    answer: Duration::from_secs(5),
    silence: Duration::from_millis(300),
    attempts: 3,
    first_wait: Duration::from_millis(1),
};

fn options() -> Options {
    Options { patience: PATIENCE, ..Options::default() }
}

/// A server with one archive, and a folder to fetch it to.
struct Case {
    server: Server,
    folder: TempDir,
    archive: Vec<u8>,
    recipe: Recipe,
}

impl Case {
    /// An archive of some 600 kB, so that it takes several reads.
    fn new(manners: &[Manner]) -> Self {
        let server = Server::new();
        let archive = tar(&noise(600_000));
        server.put("/small.tar", &archive, manners);
        let recipe = Recipe::from_toml(&recipe_text(&[format!("{}/small.tar", server.url)], Some(&archive)));
        Self { server, folder: tempfile::tempdir().unwrap(), archive, recipe: recipe.unwrap() }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn fetch_with(&self, options: &Options) -> Result<(Fetched, Vec<String>), Error> {
        let told = std::cell::RefCell::new(Vec::new());
        let fetched = fetch::fetch(&self.recipe, &self.out(), options, &|event| {
            let words = match event {
                Event::Bytes { .. } | Event::Unpacking { .. } | Event::Asked { .. } => return,
                Event::Resumed { at, .. } => format!("resumed at {at}"),
                Event::StartedOver { .. } => "started over".to_owned(),
                Event::Failed { .. } => "failed".to_owned(),
                Event::GoneElsewhere { .. } => "elsewhere".to_owned(),
                Event::There { .. } => "there".to_owned(),
                other => panic!("{other:?}"),
            };
            told.borrow_mut().push(words);
        })?;
        Ok((fetched, told.into_inner()))
    }

    /// Fetches, and holds what came against the archive; gives what was told.
    #[track_caller]
    fn done(&self) -> Vec<String> {
        let (fetched, told) = self.fetch_with(&options()).unwrap();
        assert_eq!(fetched.folder, self.out().join("images"));
        assert!(fs::read(fetched.folder.join("1.png")).unwrap() == noise(600_000));
        assert_eq!(fetched.files[0].sha256, sha256(&self.archive));
        assert_eq!(self.names(), ["out"]);
        told
    }

    #[track_caller]
    fn refused(&self) -> Error {
        self.fetch_with(&options()).unwrap_err()
    }

    /// Everything below the folder, files and folders.
    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn downloads(&self) -> Vec<String> {
        let Ok(entries) = fs::read_dir(fetch::download_folder(&self.out())) else { return Vec::new() };
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

#[test]
fn a_file_comes_whole_and_nothing_is_left_beside_it() {
    for manner in [Manner::Whole, Manner::NoRanges(usize::MAX), Manner::Chunked, Manner::Slow(60_000)] {
        let case = Case::new(&[manner]);
        assert!(case.done().is_empty());
        assert_eq!(case.server.asked(), ["/small.tar"]);
    }
}

#[test]
fn a_cut_download_goes_on_where_it_was() {
    let case = Case::new(&[Manner::Cut(100_000), Manner::Cut(200_000), Manner::Whole]);
    assert_eq!(case.done(), ["failed", "resumed at 100000", "failed", "resumed at 300000"]);
    let asked = ["/small.tar", "/small.tar bytes=100000-", "/small.tar bytes=300000-"];
    assert_eq!(case.server.asked(), asked);
}

#[test]
fn a_silent_server_is_left_after_a_time_and_asked_again() {
    let case = Case::new(&[Manner::Silent(50_000), Manner::Whole]);
    assert_eq!(case.done(), ["failed", "resumed at 50000"]);
}

#[test]
fn another_run_goes_on_where_the_last_one_ended() {
    let case = Case::new(&[Manner::Cut(1000), Manner::Cut(0)]);
    let error = case.refused();
    assert!(matches!(error, Error::Connection { attempts: 3, kept: 1000, .. }), "{error}");
    assert_eq!(case.downloads(), ["small.tar.part", "small.tar.part.json"]);
    assert_eq!(case.names(), ["out.download"]);
    case.server.asked();

    case.server.put("/small.tar", &case.archive, &[Manner::Whole]);
    assert_eq!(case.done(), ["resumed at 1000"]);
    assert_eq!(case.server.asked(), ["/small.tar bytes=1000-"]);
}

#[test]
fn a_server_that_ignores_ranges_starts_over() {
    for manner in [Manner::NoRanges(usize::MAX), Manner::Chunked] {
        let case = Case::new(&[Manner::Cut(1000), manner]);
        assert_eq!(case.done(), ["failed", "started over"]);
    }
    // Without a validator nobody knows whether the rest belongs to what is there.
    let case = Case::new(&[Manner::NoRanges(5000), Manner::NoRanges(7000), Manner::Whole]);
    assert_eq!(case.done(), ["failed", "started over", "failed", "started over"]);
    assert_eq!(case.server.asked(), ["/small.tar"; 3]);
}

#[test]
fn a_file_in_chunks_that_is_cut_goes_on_too() {
    let case = Case::new(&[Manner::ChunkedCut(5000), Manner::Cut(7000), Manner::Whole]);
    assert_eq!(case.done(), ["failed", "resumed at 5000", "failed", "resumed at 12000"]);
}

#[test]
fn a_file_that_has_changed_meanwhile_starts_over() {
    let case = Case::new(&[Manner::Cut(1000), Manner::Cut(0)]);
    let other = tar(&noise(500));
    case.server.put("/small.tar", &other, &[Manner::Cut(1000), Manner::Cut(0)]);
    let mut unpinned = Case { recipe: case.recipe.clone(), ..case };
    (unpinned.recipe.raw.files[0].sha256, unpinned.recipe.raw.files[0].bytes) = (None, None);
    assert!(matches!(unpinned.refused(), Error::Connection { .. }));
    unpinned.server.put("/small.tar", &unpinned.archive, &[Manner::Whole]);
    assert_eq!(unpinned.done(), ["started over"]);
}

#[test]
fn one_file_is_downloaded_by_one_process_at_a_time() {
    let case = Case::new(&[Manner::Whole]);
    let downloads = fetch::download_folder(&case.out());
    fs::create_dir(&downloads).unwrap();
    let other = fs::File::create(downloads.join("small.tar.part")).unwrap();
    other.lock().unwrap();
    assert!(matches!(case.refused(), Error::Busy { .. }));
    drop(other);
    assert!(case.done().is_empty());
}

#[test]
fn what_was_whole_but_not_yet_named_is_not_downloaded_again() {
    let case = Case::new(&[Manner::Whole]);
    let (archive, downloads) = (&case.archive, fetch::download_folder(&case.out()));
    fs::create_dir(&downloads).unwrap();
    fs::write(downloads.join("small.tar.part"), archive).unwrap();
    let url = format!("{}/small.tar", case.server.url);
    let tag = format!("\"{}\"", &sha256(archive)[..16]);
    let known = serde_json::json!({"url": url, "etag": tag, "bytes": archive.len()}).to_string();
    fs::write(downloads.join("small.tar.part.json"), known).unwrap();
    assert!(case.done().is_empty());
    assert_eq!(case.server.asked(), [format!("/small.tar bytes={}-", archive.len())]);
}

#[test]
fn a_server_in_trouble_is_asked_again_and_one_that_refuses_is_not() {
    let trouble = [Manner::Status(503, "wait"), Manner::Status(500, "oh"), Manner::Whole];
    assert_eq!(Case::new(&trouble).done(), ["failed", "failed"]);

    let case = Case::new(&[Manner::Status(429, "no")]);
    let error = case.refused();
    assert!(matches!(error, Error::Connection { attempts: 3, .. }), "{error}");
    assert!(error.to_string().contains("429"), "{error}");

    for status in [404, 403, 410, 401] {
        let case = Case::new(&[Manner::Status(status, "no")]);
        let error = case.refused();
        assert!(matches!(&error, Error::Status { status: found, .. } if *found == status), "{error}");
        assert!(error.to_string().contains("small.tar"), "{error}");
        assert_eq!((case.server.asked().len(), case.names().len()), (1, 0), "{error}");
    }
}

#[test]
fn a_redirect_is_followed_with_its_range() {
    let elsewhere = Server::new();
    let case = Case::new(&[Manner::Redirect(format!("{}/there", elsewhere.url))]);
    elsewhere.put("/there", &case.archive, &[Manner::Cut(4096), Manner::Whole]);
    assert_eq!(case.done(), ["failed", "resumed at 4096"]);
    assert_eq!(elsewhere.asked(), ["/there", "/there bytes=4096-"]);

    let round = Case::new(&[Manner::Redirect("/small.tar".to_owned())]);
    let error = round.refused();
    assert!(matches!(error, Error::Connection { attempts: 1, .. }), "{error}");
    assert!(round.names().is_empty());
}

#[test]
fn a_wrong_file_is_not_kept() {
    let case = Case::new(&[Manner::Whole]);
    let mut wrong = case.archive.clone();
    wrong[5000] ^= 1;
    case.server.put("/small.tar", &wrong, &[Manner::Whole]);
    let error = case.refused();
    assert!(matches!(&error, Error::Checksum { found, .. } if *found == sha256(&wrong)), "{error}");
    assert!(case.names().is_empty(), "{:?}", case.names());

    case.server.put("/small.tar", &wrong[..9000], &[Manner::Whole]);
    let error = case.refused();
    assert!(matches!(error, Error::Length { found: 9000, .. }), "{error}");
    assert!(case.names().is_empty());

    // One that is too long ends as soon as it is.
    let mut long = case.archive.clone();
    long.extend(noise(3_000_000));
    case.server.put("/small.tar", &long, &[Manner::Chunked]);
    let error = case.refused();
    assert!(matches!(error, Error::Length { .. }), "{error}");
    assert!(case.names().is_empty());
}

#[test]
fn a_page_instead_of_an_archive_is_called_so() {
    let mut case = Case::new(&[Manner::Whole]);
    (case.recipe.raw.files[0].sha256, case.recipe.raw.files[0].bytes) = (None, None);
    case.server.put("/small.tar", b"<!DOCTYPE html><html>Please sign in</html>", &[Manner::Whole]);
    let error = case.refused();
    let words = error.to_string();
    assert!(matches!(error, Error::NotAnArchive { .. }) && words.contains("an HTML page"), "{words}");
    assert!(words.contains("/small.tar") && case.names().is_empty(), "{words}");
}

#[test]
fn the_next_place_is_asked_where_one_does_not_have_the_file() {
    let mut case = Case::new(&[Manner::Whole]);
    let url = case.recipe.raw.files[0].urls[0].clone();
    // A port at which nobody listens.
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let gone = format!("{}/gone/small.tar", case.server.url);
    case.recipe.raw.files[0].urls = vec![gone, format!("http://{nobody}/small.tar"), url];
    assert_eq!(case.done(), ["elsewhere", "failed", "failed", "elsewhere"]);
    assert_eq!(case.server.asked(), ["/gone/small.tar", "/small.tar"]);
}

#[test]
fn what_has_begun_elsewhere_survives_a_place_that_has_nothing() {
    let mut case = Case::new(&[Manner::Cut(1000), Manner::Cut(0)]);
    let url = case.recipe.raw.files[0].urls[0].clone();
    case.recipe.raw.files[0].urls = vec![url, format!("{}/gone/small.tar", case.server.url)];
    assert!(matches!(case.refused(), Error::Status { status: 404, .. }));
    case.server.put("/small.tar", &case.archive, &[Manner::Whole]);
    assert_eq!(case.done(), ["resumed at 1000"]);
}

#[test]
fn a_mirror_has_files_by_sequence_or_by_name() {
    let case = Case::new(&[Manner::Status(404, "")]);
    let mirror = |place: &str| Options { mirror: Some(Mirror::of(place)), force: true, ..options() };
    for path in ["/m/small/small.tar", "/m/small.tar"] {
        let case = Case::new(&[Manner::Status(404, "")]);
        case.server.put(path, &case.archive, &[Manner::Whole]);
        let (fetched, _) = case.fetch_with(&mirror(&format!("{}/m/", case.server.url))).unwrap();
        assert_eq!(fetched.files[0].place, format!("{}{path}", case.server.url));
        assert_eq!(case.names(), ["out"]);
    }

    let disk = tempfile::tempdir().unwrap();
    let place = disk.path().to_str().unwrap();
    let error = case.fetch_with(&mirror(place)).unwrap_err();
    assert!(matches!(error, Error::NotOnMirror { .. }), "{error}");
    for path in ["small.tar", "small/small.tar"] {
        let path = disk.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, &case.archive).unwrap();
        let (fetched, told) = case.fetch_with(&mirror(place)).unwrap();
        assert_eq!((PathBuf::from(&fetched.files[0].place), told), (path, vec!["there".to_owned()]));
        assert_eq!(case.names(), ["out"]);
    }
    fs::write(disk.path().join("small/small.tar"), &case.archive[..5000]).unwrap();
    let error = case.fetch_with(&mirror(place)).unwrap_err();
    assert!(matches!(error, Error::Length { found: 5000, .. }), "{error}");
    // A mirror is somebody else's: nothing of it goes.
    assert!(disk.path().join("small/small.tar").exists() && case.out().join("images/1.png").exists());
    assert!(case.server.asked().is_empty());
}

#[test]
fn archives_are_kept_on_request_and_used_by_the_next_run() {
    let case = Case::new(&[Manner::Whole]);
    let keep = Options { keep_archives: true, ..options() };
    case.fetch_with(&keep).unwrap();
    assert_eq!(case.downloads(), ["small.tar"]);
    fs::remove_dir_all(case.out()).unwrap();
    case.server.asked();
    assert_eq!(case.done(), ["there"]);
    assert!(case.server.asked().is_empty());
}

#[test]
fn what_stands_there_is_replaced_on_request_alone() {
    let case = Case::new(&[Manner::Whole]);
    fs::create_dir(case.out()).unwrap();
    fs::write(case.out().join("mine"), "x").unwrap();
    assert!(matches!(case.refused(), Error::Exists { .. }));
    assert!(case.server.asked().is_empty() && case.out().join("mine").exists());
    case.fetch_with(&Options { force: true, ..options() }).unwrap();
    assert!(!case.out().join("mine").exists());
    assert_eq!(case.names(), ["out"]);
}

#[test]
fn an_archive_without_the_folder_leaves_no_folder() {
    let mut case = Case::new(&[Manner::Whole]);
    case.recipe.raw.folder = "elsewhere".into();
    let error = case.refused();
    assert!(matches!(error, Error::NoFolder { .. }), "{error}");
    // The archive is what the recipe says, so it stays for another run.
    assert_eq!(
        (case.names(), case.downloads()),
        (vec!["out.download".to_owned()], vec!["small.tar".to_owned()])
    );
    case.recipe.raw.files[0].only = Some("nowhere".into());
    assert!(matches!(case.refused(), Error::Archive(_)));
    assert_eq!(case.names(), ["out.download"]);
}

fn os(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).args(arguments).current_dir(folder).output().unwrap()
}

#[track_caller]
fn said(output: &Output, code: i32) -> (String, String) {
    let [stdout, stderr] =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert_eq!(output.status.code(), Some(code), "{stdout}\n{stderr}");
    (stdout, stderr)
}

#[test]
fn the_command_ends_with_the_next_one() {
    let case = Case::new(&[Manner::Cut(1000), Manner::Whole]);
    let folder = case.folder.path();
    fs::write(folder.join("my.toml"), recipe_text(&case.recipe.raw.files[0].urls, None)).unwrap();
    let output = os(&["fetch", "my.toml", "-o", "my images"], folder);
    let (stdout, stderr) = said(&output, 0);
    assert!(stderr.contains("goes on after 1.0 kB"), "{stderr}");
    assert!(
        stdout.contains(&sha256(&case.archive)) && stdout.contains("does not know every digest"),
        "{stdout}"
    );
    assert!(stdout.contains("CC0-1.0") && stdout.contains("Please cite: Nobody"), "{stdout}");
    let next = "next: os-convert tum 'my images/images' -o small.mcap --recipe my.toml";
    assert_eq!(stdout.lines().last(), Some(next));

    let (stdout, _) = said(&os(&["fetch", "my.toml", "--json"], folder), 0);
    let json: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(json["fetched"]["files"][0]["sha256"], sha256(&case.archive));
    assert_eq!(json["next"][1], "tum");
    let (_, stderr) = said(&os(&["fetch", "my.toml"], folder), 1);
    assert!(stderr.contains("--force"), "{stderr}");
}

#[test]
fn names_are_listed_and_a_wrong_one_is_helped() {
    let folder = tempfile::tempdir().unwrap();
    let (stdout, _) = said(&os(&["fetch"], folder.path()), 0);
    let (json, _) = said(&os(&["fetch", "--json"], folder.path()), 0);
    let json: Vec<Recipe> = serde_json::from_str(&json).unwrap();
    assert_eq!(json.iter().map(|recipe| recipe.name.as_str()).collect::<Vec<_>>(), datasets::names());
    for name in datasets::names() {
        assert!(stdout.lines().any(|line| line.split_whitespace().next() == Some(name)), "{name}");
    }
    let (_, stderr) = said(&os(&["fetch", "box1"], folder.path()), 1);
    assert!(stderr.contains("os simulate box1 -o box1.mcap"), "{stderr}");
    let (_, stderr) = said(&os(&["fetch", "livingroom9"], folder.path()), 1);
    assert!(stderr.contains("livingroom0"), "{stderr}");
    let (_, stderr) = said(&os(&["simulate", "livingroom0", "-o", "x.mcap"], folder.path()), 1);
    assert!(stderr.contains("os fetch livingroom0"), "{stderr}");
    said(&os(&["fetch", "--force"], folder.path()), 2);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[cfg(unix)]
#[test]
fn an_interrupted_download_leaves_its_part_alone_and_goes_on() {
    let case = Case::new(&[Manner::Silent(10_000), Manner::Whole]);
    let folder = case.folder.path();
    fs::write(folder.join("my.toml"), recipe_text(&case.recipe.raw.files[0].urls, Some(&case.archive)))
        .unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_os"))
        .args(["fetch", "my.toml", "-o", "out"])
        .current_dir(folder)
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let part = folder.join("out.download/small.tar.part");
    // Ten seconds are more than enough for ten kilobytes.
    for _ in 0..1000 {
        if fs::metadata(&part).is_ok_and(|found| found.len() == 10_000) {
            break;
        }
        thread::sleep(Duration::from_millis(10));
    }
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(status.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(case.names(), ["my.toml", "out.download"]);
    assert_eq!(case.downloads(), ["small.tar.part", "small.tar.part.json"]);
    fs::remove_file(folder.join("my.toml")).unwrap();
    assert_eq!(case.done(), ["resumed at 10000"]);
}

/// The schema in the folder of recipes; with `UPDATE_SPEC=1` it is written.
#[test]
fn the_schema_of_recipes_is_that_of_the_code_and_holds_every_recipe() {
    let sequences = Path::new(env!("CARGO_MANIFEST_DIR")).join("sequences");
    let path = sequences.join("dataset.schema.json");
    let text = Recipe::json_schema();
    if std::env::var_os("UPDATE_SPEC").is_some() {
        fs::write(&path, &text).unwrap();
    }
    assert!(fs::read_to_string(&path).unwrap() == text, "{}: `make spec` writes it", path.display());
    let (printed, _) = said(&os(&["schema", "dataset-recipe"], &sequences), 0);
    assert_eq!(printed, text);
    let validator = jsonschema::validator_for(&serde_json::from_str(&text).unwrap()).unwrap();
    for name in datasets::names() {
        let recipe = fs::read_to_string(sequences.join(format!("{name}.toml"))).unwrap();
        let value: serde_json::Value = toml::from_str(&recipe).unwrap();
        assert!(
            validator.is_valid(&value),
            "{name}: {:?}",
            validator.iter_errors(&value).collect::<Vec<_>>()
        );
        let resolved = serde_json::to_value(Recipe::from_toml(&recipe).unwrap()).unwrap();
        assert!(
            validator.is_valid(&resolved),
            "{name}: {:?}",
            validator.iter_errors(&resolved).collect::<Vec<_>>()
        );
        let mut wrong = value.clone();
        wrong["camera"]["focal"] = 5.into();
        assert!(!validator.is_valid(&wrong), "{name}");
    }
}

/// The digests in the recipes are those of the release, where it is at hand.
#[test]
fn the_text_release_comes_from_a_mirror_with_the_digests_of_the_recipes() {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let mirror = data.join("open-structure");
    if !mirror.is_dir() {
        println!("SKIPPED: no text release at {}", mirror.display());
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut found = 0;
    for name in datasets::names().into_iter().filter(|name| mirror.join(name).is_dir()) {
        let recipe = datasets::named(name).unwrap();
        let options =
            Options { what: What::TextRelease, mirror: Some(Mirror::Folder(mirror.clone())), ..options() };
        let fetched = fetch::fetch(&recipe, &folder.path().join(name), &options, &|_| {}).unwrap();
        assert!(fetched.files.iter().all(|file| file.pinned), "{name}");
        assert_eq!(
            fs::read_dir(&fetched.folder).unwrap().count(),
            fs::read_dir(mirror.join(name)).unwrap().count()
        );
        found += 1;
    }
    assert!(found > 0);
}
