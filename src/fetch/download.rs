//! One file, from the first place that has it, however often the way there is cut.

use std::io::{self, Read};
use std::path::Path;
use std::thread;
use std::time::Duration;

use super::checksum::CHUNK;
use super::http::{Answer, Client, Version};
use super::part_file::PartFile;
use super::{Error, Event, Patience, store};
use crate::datasets::RemoteFile;

/// Largest file where nobody says how large it is, bytes.
const LARGEST: u64 = 1 << 40;

/// What a download needs.
pub(super) struct Download<'a> {
    pub(super) client: &'a Client,
    pub(super) patience: &'a Patience,
    pub(super) file: &'a RemoteFile,
    /// Where the file is to be, when it is whole.
    pub(super) whole: &'a Path,
    pub(super) events: &'a dyn Fn(Event<'_>),
}

/// How an attempt ended.
enum Attempt {
    /// The file is whole.
    Whole,
    /// It may go on, after a time if the server says so.
    Cut(String, Option<Duration>),
}

impl Download<'_> {
    /// Downloads the file; gives the URL that had it, and its digest.
    pub(super) fn run(&self, urls: &[String]) -> Result<(String, String), Error> {
        // What has begun at a later place goes on there.
        let begun = PartFile::url_of(self.whole);
        let first = urls.iter().position(|url| Some(url) == begun.as_ref()).unwrap_or(0);
        let order = urls.iter().cycle().skip(first).take(urls.len());
        let mut last = None;
        for url in order {
            if let Some(error) = &last {
                self.tell(Event::GoneElsewhere { file: self.name(), reason: &format!("{error}") });
            }
            match self.from(url) {
                Ok(sha256) => return Ok((url.clone(), sha256)),
                Err(error) if error.is_about_the_place() => last = Some(error),
                Err(error) => return Err(error),
            }
        }
        Err(last.unwrap_or_else(|| Error::Io {
            path: self.whole.to_owned(),
            cause: io::Error::other("there is no place to ask"),
        }))
    }

    fn name(&self) -> &str {
        self.file.file_name()
    }

    fn tell(&self, event: Event<'_>) {
        (self.events)(event);
    }

    /// Downloads the file from one URL.
    fn from(&self, url: &str) -> Result<String, Error> {
        let mut part = PartFile::open(self.whole)?;
        let mut failed = 0;
        loop {
            self.tell(Event::Asked { file: self.name(), url });
            let before = part.length();
            let (reason, asked) = match self.attempt(url, &mut part) {
                Ok(Attempt::Whole) => return self.accept(url, part),
                Ok(Attempt::Cut(reason, asked)) => (reason, asked),
                Err(error) => {
                    Self::clear(url, part, &error)?;
                    return Err(error);
                }
            };
            failed = if part.length() > before { 1 } else { failed + 1 };
            if failed >= self.patience.attempts.max(1) {
                let (url, file, kept) = (url.to_owned(), self.name().to_owned(), part.length());
                if kept == 0 {
                    part.discard()?;
                }
                return Err(Error::Connection { url, file, detail: reason, attempts: failed, kept });
            }
            let wait = self.patience.wait(failed, asked);
            self.tell(Event::Failed { file: self.name(), reason: &reason, wait });
            thread::sleep(wait);
        }
    }

    /// Asks once, and takes what comes.
    fn attempt(&self, url: &str, part: &mut PartFile) -> Result<Attempt, Error> {
        let version = part.version_of(url).cloned();
        let offset = if version.is_some() { part.length() } else { 0 };
        let mut answer = match self.client.ask(url, offset, &version.unwrap_or_default()) {
            Ok(answer) => answer,
            Err(error) => return self.refused(url, error),
        };
        match answer.status {
            206 if offset > 0 && answer.start == offset && agrees(answer.total, part.total()) => {
                self.tell(Event::Resumed { file: self.name(), at: offset });
            }
            200 => {
                if part.length() > 0 {
                    let reason = if offset == 0 {
                        "what is there cannot be continued"
                    } else {
                        "the server sends the file from its beginning"
                    };
                    self.tell(Event::StartedOver { file: self.name(), reason });
                }
                self.check_length(url, answer.total)?;
                part.start_over(url, answer.version.clone(), answer.total)?;
            }
            // All was there already; or else it is another file by now.
            416 if offset > 0 && answer.total == Some(offset) => return Ok(Attempt::Whole),
            206 | 416 => {
                let reason = "the server has another version of the file";
                self.tell(Event::StartedOver { file: self.name(), reason });
                part.start_over(url, Version::default(), None)?;
                return Ok(Attempt::Cut(reason.to_owned(), Some(Duration::ZERO)));
            }
            408 | 425 | 429 | 500 | 502 | 503 | 504 => {
                let words = answer.reason.unwrap_or_default();
                let reason = format!("the server answered {} {words}", answer.status);
                return Ok(Attempt::Cut(reason, answer.retry_after));
            }
            status => {
                return Err(Error::Status {
                    url: url.to_owned(),
                    file: self.name().to_owned(),
                    status,
                    reason: answer.reason,
                });
            }
        }
        self.receive(url, &mut answer, part)
    }

    /// Writes the body of an answer.
    fn receive(&self, url: &str, answer: &mut Answer, part: &mut PartFile) -> Result<Attempt, Error> {
        let total = part.total().or(self.file.bytes);
        let most = total.unwrap_or(LARGEST);
        let end = answer.length.map(|length| part.length().saturating_add(length));
        let mut buffer = vec![0; CHUNK];
        loop {
            self.tell(Event::Bytes { file: self.name(), done: part.length(), total });
            let length = match answer.body.read(&mut buffer) {
                Ok(0) => break,
                Ok(length) => length,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Ok(Attempt::Cut(error.to_string(), None)),
            };
            if part.length() + length as u64 > most {
                return Err(self.length_error(url, most, part.length() + length as u64));
            }
            part.append(&buffer[..length])?;
        }
        // A connection that is cut may end like one that is closed.
        if end.or(total).is_some_and(|end| part.length() < end) {
            return Ok(Attempt::Cut(format!("the connection ended after {} B", part.length()), None));
        }
        Ok(Attempt::Whole)
    }

    /// Gives a whole file its name, if it is what it should be.
    fn accept(&self, url: &str, part: PartFile) -> Result<String, Error> {
        let sha256 = part.sha256();
        if let Err(error) = store::check(self.file, url, part.path(), part.length(), &sha256) {
            Self::clear(url, part, &error)?;
            return Err(error);
        }
        part.finish(self.whole)?;
        Ok(sha256)
    }

    /// Removes what came, where it is of no use after an error.
    fn clear(url: &str, part: PartFile, error: &Error) -> Result<(), Error> {
        match error {
            // A full disk may have room again.
            Error::Io { .. } => Ok(()),
            // What came from another place may go on there.
            _ if part.length() > 0 && !part.is_from(url) => Ok(()),
            _ => part.discard(),
        }
    }

    /// What an error of the client means: most pass by.
    fn refused(&self, url: &str, error: ureq::Error) -> Result<Attempt, Error> {
        let detail = match error {
            ureq::Error::HostNotFound => "the name of the server is not known".to_owned(),
            ureq::Error::Timeout(what) => format!("the server did not answer in time ({what})"),
            ureq::Error::Io(error) => error.to_string(),
            // These will be the same next time.
            ureq::Error::TooManyRedirects
            | ureq::Error::BadUri(_)
            | ureq::Error::Http(_)
            | ureq::Error::Rustls(_)
            | ureq::Error::Tls(_) => {
                return Err(Error::Connection {
                    url: url.to_owned(),
                    file: self.name().to_owned(),
                    detail: error.to_string(),
                    attempts: 1,
                    kept: 0,
                });
            }
            other => other.to_string(),
        };
        Ok(Attempt::Cut(detail, None))
    }

    /// Whether the announced length is that of the recipe.
    fn check_length(&self, url: &str, announced: Option<u64>) -> Result<(), Error> {
        match (self.file.bytes, announced) {
            (Some(expected), Some(found)) if expected != found => {
                Err(self.length_error(url, expected, found))
            }
            _ => Ok(()),
        }
    }

    fn length_error(&self, url: &str, expected: u64, found: u64) -> Error {
        Error::Length { place: url.to_owned(), file: self.name().to_owned(), expected, found }
    }
}

/// Whether two lengths are one, as far as they are known.
fn agrees(one: Option<u64>, other: Option<u64>) -> bool {
    one.zip(other).is_none_or(|(one, other)| one == other)
}
