//! A store on this machine: what S3 and Google's XML interface and plain HTTP have in common, and what they have not.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread;

use open_structure::structure::hex;
use sha2::{Digest, Sha256};

/// What a store keeps to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Buckets: listing, parts, many removals at once.
    Buckets,
    /// Files as a server of static pages has them, but they can be put; folders show a page for people.
    Pages,
    /// As `Pages`, without parts of files, as Python's own server is.
    WholePages,
}

#[derive(Default)]
struct State {
    objects: BTreeMap<String, Vec<u8>>,
    uploads: BTreeMap<String, BTreeMap<u32, Vec<u8>>>,
    asked: Vec<String>,
    sent: u64,
    forbidden: Vec<String>,
    signed: Vec<String>,
}

/// A store on threads of its own.
#[derive(Clone)]
pub(crate) struct Server {
    pub(crate) address: String,
    state: Arc<Mutex<State>>,
}

struct Request {
    method: String,
    path: String,
    query: BTreeMap<String, String>,
    headers: BTreeMap<String, String>,
    body: Vec<u8>,
}

struct Response {
    status: u16,
    headers: Vec<(&'static str, String)>,
    body: Vec<u8>,
}

impl Server {
    pub(crate) fn new(kind: Kind) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let server = Self { address: listener.local_addr().unwrap().to_string(), state: Arc::default() };
        let state = Arc::clone(&server.state);
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let state = Arc::clone(&state);
                // Whoever hangs up is no reason to stop.
                thread::spawn(move || drop(answer(stream, kind, &state)));
            }
        });
        server
    }

    /// Puts an object without asking the network.
    pub(crate) fn keep(&self, key: &str, bytes: Vec<u8>) {
        self.state.lock().unwrap().objects.insert(key.to_owned(), bytes);
    }

    /// Puts all files of a folder.
    pub(crate) fn keep_folder(&self, key: &str, folder: &Path) {
        for entry in folder.read_dir().unwrap() {
            let entry = entry.unwrap();
            let key = format!("{key}/{}", entry.file_name().to_string_lossy());
            if entry.path().is_dir() {
                self.keep_folder(&key, &entry.path());
            } else {
                self.keep(&key, std::fs::read(entry.path()).unwrap());
            }
        }
    }

    /// Answers what begins so with 403.
    pub(crate) fn forbid(&self, prefix: &str) {
        self.state.lock().unwrap().forbidden.push(prefix.to_owned());
    }

    /// Gives what begins so to GET alone, and only with `signature=right`.
    pub(crate) fn sign(&self, prefix: &str) {
        self.state.lock().unwrap().signed.push(prefix.to_owned());
    }

    /// Keys and objects.
    pub(crate) fn objects(&self) -> BTreeMap<String, Vec<u8>> {
        self.state.lock().unwrap().objects.clone()
    }

    /// What was asked since the last time, as `METHOD key`.
    pub(crate) fn asked(&self) -> Vec<String> {
        std::mem::take(&mut self.state.lock().unwrap().asked)
    }

    /// Bytes of objects that were sent since the last time.
    pub(crate) fn sent(&self) -> u64 {
        std::mem::take(&mut self.state.lock().unwrap().sent)
    }

    /// Uploads in parts that were begun and neither completed nor given up.
    pub(crate) fn left_open(&self) -> usize {
        self.state.lock().unwrap().uploads.len()
    }
}

fn answer(stream: TcpStream, kind: Kind, state: &Mutex<State>) -> std::io::Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    let request = read(&mut reader)?;
    let is_head = request.method == "HEAD";
    let response = respond(&request, kind, &mut state.lock().unwrap());
    let mut head = format!("HTTP/1.1 {} x\r\nconnection: close\r\n", response.status);
    for (name, value) in &response.headers {
        head += &format!("{name}: {value}\r\n");
    }
    if !response.headers.iter().any(|(name, _)| *name == "content-length") {
        head += &format!("content-length: {}\r\n", response.body.len());
    }
    let mut stream = stream;
    stream.write_all(format!("{head}\r\n").as_bytes())?;
    if is_head { Ok(()) } else { stream.write_all(&response.body) }
}

fn read(reader: &mut impl BufRead) -> std::io::Result<Request> {
    let mut first = String::new();
    reader.read_line(&mut first)?;
    let mut words = first.split(' ');
    let (method, target) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let query = query.split('&').filter(|pair| !pair.is_empty()).map(|pair| {
        let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
        (decoded(name), decoded(value))
    });
    let mut headers = BTreeMap::new();
    loop {
        let mut line = String::new();
        reader.read_line(&mut line)?;
        let Some((name, value)) = line.trim_end().split_once(": ") else { break };
        headers.insert(name.to_ascii_lowercase(), value.to_owned());
    }
    let length = headers.get("content-length").map_or(0, |length| length.parse().unwrap());
    let mut body = vec![0; length];
    reader.read_exact(&mut body)?;
    Ok(Request {
        method: method.to_owned(),
        path: decoded(path.trim_start_matches('/')),
        query: query.collect(),
        headers,
        body,
    })
}

fn decoded(text: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        if byte == b'%' {
            bytes.push(u8::from_str_radix(std::str::from_utf8(&after[..2]).unwrap(), 16).unwrap());
            rest = &after[2..];
        } else {
            bytes.push(byte);
            rest = after;
        }
    }
    String::from_utf8(bytes).unwrap()
}

fn tag(bytes: &[u8]) -> String {
    format!("\"{}\"", &hex(&Sha256::digest(bytes))[..16])
}

fn plain(status: u16, words: &str) -> Response {
    Response { status, headers: Vec::new(), body: words.as_bytes().to_vec() }
}

fn respond(request: &Request, kind: Kind, state: &mut State) -> Response {
    let key = request.path.trim_end_matches('/').to_owned();
    state.asked.push(format!("{} {key}", request.method));
    if state.forbidden.iter().any(|prefix| key.starts_with(prefix.as_str())) {
        return plain(403, "<Error><Code>AccessDenied</Code><Message>not yours</Message></Error>");
    }
    let is_right =
        request.method == "GET" && request.query.get("signature").is_some_and(|found| found == "right");
    if !is_right && state.signed.iter().any(|prefix| key.starts_with(prefix.as_str())) {
        return plain(403, "not signed");
    }
    let asks = |name: &str| request.query.contains_key(name);
    let is_bucket = kind == Kind::Buckets && !key.contains('/');
    match request.method.as_str() {
        "GET" if is_bucket && asks("list-type") => listing(&key, request, state),
        "POST" if is_bucket && asks("delete") => {
            let body = String::from_utf8(request.body.clone()).unwrap();
            let mut deleted = String::new();
            for part in body.split("<Key>").skip(1) {
                let name = part.split("</Key>").next().unwrap();
                state.objects.remove(&format!("{key}/{name}"));
                deleted += &format!("<Deleted><Key>{name}</Key></Deleted>");
            }
            plain(200, &format!("<DeleteResult>{deleted}</DeleteResult>"))
        }
        "GET" | "HEAD" => object(&key, request, kind, state),
        "POST" if kind == Kind::Buckets && asks("uploads") => {
            let id = format!("upload-{}", state.asked.len());
            state.uploads.insert(id.clone(), BTreeMap::new());
            let words = format!(
                "<InitiateMultipartUploadResult><UploadId>{id}</UploadId></InitiateMultipartUploadResult>"
            );
            plain(200, &words)
        }
        "PUT" if kind == Kind::Buckets && asks("partNumber") => {
            let number = request.query["partNumber"].parse().unwrap();
            let upload = state.uploads.get_mut(&request.query["uploadId"]).unwrap();
            upload.insert(number, request.body.clone());
            Response { status: 200, headers: vec![("etag", tag(&request.body))], body: Vec::new() }
        }
        "POST" if kind == Kind::Buckets && asks("uploadId") => {
            let parts = state.uploads.remove(&request.query["uploadId"]).unwrap();
            let bytes: Vec<u8> = parts.into_values().flatten().collect();
            let words = format!(
                "<CompleteMultipartUploadResult><ETag>{}</ETag></CompleteMultipartUploadResult>",
                tag(&bytes)
            );
            state.objects.insert(key, bytes);
            plain(200, &words)
        }
        "PUT" => {
            state.objects.insert(key, request.body.clone());
            Response { status: 200, headers: vec![("etag", tag(&request.body))], body: Vec::new() }
        }
        "DELETE" if kind == Kind::Buckets && asks("uploadId") => {
            state.uploads.remove(&request.query["uploadId"]);
            plain(204, "")
        }
        "DELETE" if kind == Kind::Buckets => {
            state.objects.remove(&key);
            plain(204, "")
        }
        _ => plain(405, "no"),
    }
}

fn listing(bucket: &str, request: &Request, state: &State) -> Response {
    let prefix = request.query.get("prefix").cloned().unwrap_or_default();
    let whole = format!("{bucket}/{prefix}");
    let (mut contents, mut folders) = (String::new(), Vec::new());
    for (key, bytes) in state.objects.iter().filter(|(key, _)| key.starts_with(&whole)) {
        let name = &key[bucket.len() + 1..];
        if let Some((folder, _)) =
            name[prefix.len()..].split_once('/').filter(|_| request.query.contains_key("delimiter"))
        {
            folders.push(format!("{prefix}{folder}/"));
            continue;
        }
        contents += &format!(
            "<Contents><Key>{name}</Key><Size>{}</Size><LastModified>2026-11-22T00:00:00.000Z</LastModified><ETag>{}</ETag></Contents>",
            bytes.len(),
            tag(bytes)
        );
    }
    folders.dedup();
    for folder in folders {
        contents += &format!("<CommonPrefixes><Prefix>{folder}</Prefix></CommonPrefixes>");
    }
    plain(200, &format!("<ListBucketResult>{contents}</ListBucketResult>"))
}

fn object(key: &str, request: &Request, kind: Kind, state: &mut State) -> Response {
    let is_folder = state.objects.keys().any(|other| other.starts_with(&format!("{key}/")));
    let Some(bytes) = state.objects.get(key) else {
        return match kind {
            Kind::Pages | Kind::WholePages if is_folder => plain(200, "<html>a list for people</html>"),
            _ => plain(404, "<Error><Code>NoSuchKey</Code></Error>"),
        };
    };
    let tag = tag(bytes);
    if request.headers.get("if-match").is_some_and(|wanted| *wanted != tag) {
        return plain(412, "");
    }
    let range = request.headers.get("range").filter(|_| kind != Kind::WholePages);
    let range = range.and_then(|range| {
        let (first, last) = range.strip_prefix("bytes=")?.split_once('-')?;
        Some((first.parse::<usize>().ok()?, last.parse::<usize>().ok()?.min(bytes.len() - 1)))
    });
    let whole = bytes.len();
    let mut headers = vec![("etag", tag), ("last-modified", "Sun, 22 Nov 2026 00:00:00 GMT".to_owned())];
    let (status, body) = match range {
        Some((first, last)) => {
            headers.push(("content-range", format!("bytes {first}-{last}/{whole}")));
            (206, bytes[first..=last].to_vec())
        }
        None => (200, bytes.clone()),
    };
    headers.push(("content-length", body.len().to_string()));
    if request.method == "GET" {
        state.sent += body.len() as u64;
    }
    Response { status, headers, body }
}
