//! Objects of a store, and the stores by scheme.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use futures_util::StreamExt;
use object_store::aws::AmazonS3Builder;
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::http::HttpBuilder;
use object_store::path::Path as Key;
use object_store::{ClientOptions, GetOptions, ObjectStore, ObjectStoreExt, RetryConfig, WriteMultipart};
use reqwest::Url;
use tokio::runtime::{self, Runtime};

use super::{Entry, Found, MARK, scheme};

/// Files that make a folder of a URL over HTTP.
const MARKS: [&str; 3] = [MARK, "catalogue.parquet", "summary.parquet"];
/// Bytes of a part of a large object.
const PART: usize = 8 << 20;
/// Parts that are under way at once.
const PARTS_AT_ONCE: usize = 4;
/// Variables that say where a store is.
const ENDPOINTS: [&str; 6] = [
    "AWS_ENDPOINT_URL_S3",
    "AWS_ENDPOINT_URL",
    "AWS_ENDPOINT",
    "AWS_ENDPOINT_URL_STS",
    "AWS_METADATA_ENDPOINT",
    "GOOGLE_BASE_URL",
];
/// Where machines in a cloud ask for the credentials of their role.
const ROLES: [&str; 2] = ["169.254.169.254", "metadata.google.internal"];
/// Letters of a store's answer that are shown.
const SHOWN: usize = 300;

/// A store that is spoken to, by process, scheme and bucket or host.
type Stores = BTreeMap<(u32, String), Arc<dyn ObjectStore>>;

/// What a URL names.
#[derive(Clone, Debug)]
pub(super) struct Object {
    scheme: &'static str,
    /// The bucket, or the host.
    host: String,
    /// What the URL has more than a place, as signed ones have: it is good for one file, and perhaps for GET alone.
    query: Option<String>,
    key: Key,
    /// Whether the store lists what is in it; HTTP does not.
    lists: bool,
}

impl Object {
    /// The object of a URL; `None` for a path of this machine.
    pub(super) fn at(path: &Path) -> io::Result<Option<Self>> {
        let Some((scheme, rest)) = scheme(path) else { return Ok(None) };
        let invalid = |what: String| io::Error::new(io::ErrorKind::InvalidInput, what);
        let is_http = matches!(scheme, "http" | "https");
        let (rest, query) = match rest.split_once('?') {
            Some((rest, query)) if is_http => (rest, Some(query)),
            _ => (rest, None),
        };
        let (host, key) = rest.split_once('/').unwrap_or((rest, ""));
        if host.is_empty() {
            return Err(invalid(format!("expected {scheme}://NAME/…, found no name of a bucket or host")));
        }
        if is_http && key.contains('#') {
            return Err(invalid("expected a URL without `#`".to_owned()));
        }
        // Of HTTP the letters are encoded, of the others they stand as they are.
        let key = if is_http { Key::from_url_path(key) } else { Key::parse(key.trim_end_matches('/')) };
        let key = key.map_err(|error| invalid(error.to_string()))?;
        let object =
            Self { scheme, host: host.to_owned(), query: query.map(str::to_owned), key, lists: !is_http };
        object.store().map(|_| Some(object))
    }

    /// The store it is in. Asked for each time: in a process that was forked, those of its parent answer nobody.
    fn store(&self) -> io::Result<Arc<dyn ObjectStore>> {
        store(self.scheme, &self.host, self.query.as_deref())
    }

    /// The object of a name in this one as a folder.
    pub(super) fn child(&self, name: &str) -> Self {
        Self { key: self.key.clone().join(name), ..self.clone() }
    }

    pub(super) fn find(&self) -> io::Result<Found> {
        let is_root = self.key.as_ref().is_empty();
        if self.lists {
            if !is_root {
                match self.state() {
                    Ok((bytes, _)) => return Ok(Found::File(bytes)),
                    Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                    Err(_) => {}
                }
            }
            let entries = self.list(&[])?;
            return if is_root || !entries.is_empty() { Ok(Found::Folder) } else { Err(nothing()) };
        }
        // Servers answer for folders too, with a page for people; so whatever has no ending may be one.
        let may_be_folder = is_root || !self.key.filename().is_some_and(|name| name.contains('.'));
        if may_be_folder && self.query.is_none() && !self.list(&MARKS)?.is_empty() {
            return Ok(Found::Folder);
        }
        self.state().map(|(bytes, _)| Found::File(bytes))
    }

    /// How many bytes it has, and what tells its state from another.
    pub(super) fn state(&self) -> io::Result<(u64, Option<String>)> {
        if self.query.is_some() {
            // What was signed for GET is not for HEAD.
            let options = GetOptions { range: Some((0..1).into()), ..GetOptions::default() };
            if let Ok(answer) = wait(self.store()?.get_opts(&self.key, options)) {
                return Ok((answer.meta.size, answer.meta.e_tag));
            }
        }
        let about = wait(self.store()?.head(&self.key))?;
        Ok((about.size, about.e_tag))
    }

    pub(super) fn list(&self, known: &[&str]) -> io::Result<Vec<Entry>> {
        if !self.lists {
            let mut entries = Vec::new();
            for name in known {
                match self.child(name).state() {
                    Ok((bytes, _)) => entries.push(Entry { name: name.into(), found: Found::File(bytes) }),
                    Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                    Err(error) => return Err(error),
                }
            }
            return Ok(entries);
        }
        let listed =
            wait(self.store()?.list_with_delimiter(Some(&self.key).filter(|key| !key.as_ref().is_empty())))?;
        let named = |key: &Key, found| key.filename().map(|name| Entry { name: name.into(), found });
        let files = listed.objects.iter().filter_map(|about| named(&about.location, Found::File(about.size)));
        let folders = listed.common_prefixes.iter().filter_map(|key| named(key, Found::Folder));
        Ok(files.chain(folders).collect())
    }

    /// Some bytes of it, of the state that a tag tells.
    pub(super) fn range(&self, range: Range<u64>, tag: Option<&str>) -> io::Result<Bytes> {
        // A weak tag promises too little to be asked for.
        let tag = tag.filter(|tag| !tag.starts_with("W/")).map(str::to_owned);
        let options = GetOptions { range: Some(range.into()), if_match: tag, ..GetOptions::default() };
        let store = self.store()?;
        wait(async { store.get_opts(&self.key, options).await?.bytes().await })
    }

    /// All of it, part by part.
    pub(super) fn fetch(&self, take: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
        let runtime = runtime()?;
        let mut parts = runtime.block_on(self.store()?.get(&self.key)).map_err(failed)?.into_stream();
        while let Some(part) = runtime.block_on(parts.next()) {
            take(&part.map_err(failed)?)?;
        }
        Ok(())
    }

    pub(super) fn read(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.fetch(&mut |part| {
            bytes.extend_from_slice(part);
            Ok(())
        })?;
        Ok(bytes)
    }

    /// Makes it what a file of this machine is, all at once.
    pub(super) fn put(&self, from: &Path) -> io::Result<()> {
        let mut file = fs::File::open(from)?;
        if file.metadata()?.len() <= PART as u64 || !self.lists {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes)?;
            return wait(self.store()?.put(&self.key, bytes.into())).map(drop);
        }
        let upload = wait(self.store()?.put_multipart(&self.key))?;
        let runtime = runtime()?;
        let _inside = runtime.enter();
        let mut upload = WriteMultipart::new_with_chunk_size(upload, PART);
        match send_parts(&mut file, &mut upload) {
            Ok(()) => runtime.block_on(upload.finish()).map(drop).map_err(failed),
            Err(error) => {
                // What is there already may be paid for; the first error is the one to tell.
                let _ = runtime.block_on(upload.abort());
                Err(error)
            }
        }
    }

    /// Removes it and whatever it is a folder of.
    pub(super) fn remove_all(&self) -> io::Result<()> {
        if self.lists {
            for entry in self.list(&[])? {
                self.child(&entry.name.to_string_lossy()).remove_all()?;
            }
        }
        self.remove()
    }

    /// Removes it, if it is there.
    pub(super) fn remove(&self) -> io::Result<()> {
        match wait(self.store()?.delete(&self.key)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            // Over HTTP many servers let nothing be removed; there it is replaced.
            Err(_) if !self.lists => Ok(()),
            done => done,
        }
    }
}

/// Sends a file part by part.
fn send_parts(file: &mut fs::File, upload: &mut WriteMultipart) -> io::Result<()> {
    loop {
        let mut part = Vec::with_capacity(PART);
        if file.by_ref().take(PART as u64).read_to_end(&mut part)? == 0 {
            return Ok(());
        }
        wait(upload.wait_for_capacity(PARTS_AT_ONCE))?;
        upload.put(part.into());
    }
}

/// The store of a scheme and a bucket or host, made once in a process; over HTTP also of a query, which stands behind each of its URLs.
fn store(scheme: &'static str, host: &str, query: Option<&str>) -> io::Result<Arc<dyn ObjectStore>> {
    static STORES: Mutex<Stores> = Mutex::new(BTreeMap::new());
    let base = match query {
        Some(query) => format!("{scheme}://{host}/?{query}"),
        None => format!("{scheme}://{host}"),
    };
    let mut stores = STORES.lock().unwrap_or_else(PoisonError::into_inner);
    let by = (process::id(), base.clone());
    if let Some(store) = stores.get(&by) {
        return Ok(Arc::clone(store));
    }
    // Where a program has chosen one already, that one is taken.
    let _ = rustls::crypto::ring::default_provider().install_default();
    for name in ENDPOINTS {
        let Ok(value) = std::env::var(name) else { continue };
        let is_whole =
            Url::parse(&value).is_ok_and(|url| matches!(url.scheme(), "http" | "https") && url.has_host());
        if !is_whole {
            let what = format!("{name}: expected http://HOST or https://HOST, found {value:?}");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
        }
    }
    let plain = |endpoint: &str| endpoint.starts_with("http://");
    let client = |plain: bool| {
        ClientOptions::new().with_allow_http(plain).with_connect_timeout(Duration::from_secs(10))
    };
    let retry =
        RetryConfig { max_retries: 4, retry_timeout: Duration::from_secs(60), ..RetryConfig::default() };
    let store: Arc<dyn ObjectStore> = match scheme {
        "s3" => {
            let endpoint = ["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT"];
            let endpoint = endpoint.into_iter().find_map(|name| std::env::var(name).ok()).unwrap_or_default();
            let builder = AmazonS3Builder::from_env().with_url(&base).with_retry(retry);
            Arc::new(builder.with_client_options(client(plain(&endpoint))).build().map_err(failed)?)
        }
        "gs" => {
            let endpoint = std::env::var("GOOGLE_BASE_URL").unwrap_or_default();
            let builder = GoogleCloudStorageBuilder::from_env().with_url(&base).with_retry(retry);
            Arc::new(builder.with_client_options(client(plain(&endpoint))).build().map_err(failed)?)
        }
        _ => {
            let builder = HttpBuilder::new().with_url(&base).with_retry(retry);
            Arc::new(builder.with_client_options(client(scheme == "http")).build().map_err(failed)?)
        }
    };
    stores.insert(by, Arc::clone(&store));
    Ok(store)
}

/// What waits for answers, made once in a process: the threads of its parent are not those of one that was forked.
fn runtime() -> io::Result<&'static Runtime> {
    static RUNTIME: Mutex<Option<(u32, &'static Runtime)>> = Mutex::new(None);
    let mut made = RUNTIME.lock().unwrap_or_else(PoisonError::into_inner);
    match *made {
        Some((process, runtime)) if process == process::id() => Ok(runtime),
        _ => {
            let runtime = runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
            Ok(made.insert((process::id(), Box::leak(Box::new(runtime)))).1)
        }
    }
}

fn wait<T>(answer: impl Future<Output = object_store::Result<T>>) -> io::Result<T> {
    runtime()?.block_on(answer).map_err(failed)
}

fn nothing() -> io::Error {
    io::Error::new(io::ErrorKind::NotFound, "nothing is there")
}

/// An error of a store as one of the file system, in a line.
fn failed(error: object_store::Error) -> io::Error {
    use object_store::Error as E;
    let kind = match &error {
        E::NotFound { .. } => return nothing(),
        E::NotSupported { .. } | E::NotImplemented { .. } => io::ErrorKind::Unsupported,
        E::PermissionDenied { .. } | E::Unauthenticated { .. } => io::ErrorKind::PermissionDenied,
        E::AlreadyExists { .. } => io::ErrorKind::AlreadyExists,
        E::Precondition { .. } => return io::Error::other("the object changed while it was read"),
        E::InvalidPath { .. } => io::ErrorKind::InvalidInput,
        _ => io::ErrorKind::Other,
    };
    let line = |text: String| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let whole = line(error.to_string());
    let mut words: String = whole.chars().take(SHOWN).collect();
    if words.len() < whole.len() {
        words += "…";
    }
    // What the system said stands last in the chain of causes.
    let mut cause: &dyn std::error::Error = &error;
    while let Some(deeper) = cause.source() {
        cause = deeper;
    }
    let last = line(cause.to_string());
    if !whole.contains(&last) {
        words += &format!(": {last}");
    }
    if ROLES.iter().any(|place| whole.contains(place)) {
        let none = "no credentials in the environment (AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or GOOGLE_SERVICE_ACCOUNT)";
        words = format!("{none}, and none of a role of this machine: {words}");
    }
    io::Error::new(kind, words)
}
