//! One question to a server, and its answer.

use std::io::Read;
use std::time::Duration;

use ureq::http::{HeaderMap, StatusCode};

use super::Patience;

/// What tells one version of a file from another.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(super) struct Version {
    /// The server's strong entity tag.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) etag: Option<String>,
    /// When the file was changed, in the server's words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) last_modified: Option<String>,
}

impl Version {
    /// What goes into `If-Range`; without it a cut download cannot go on.
    pub(super) fn validator(&self) -> Option<&str> {
        self.etag.as_deref().or(self.last_modified.as_deref())
    }
}

/// An answer, its head read.
pub(super) struct Answer {
    pub(super) status: u16,
    pub(super) reason: Option<&'static str>,
    pub(super) version: Version,
    /// Length of the whole file.
    pub(super) total: Option<u64>,
    /// Where in the file the body begins.
    pub(super) start: u64,
    /// Length of the body.
    pub(super) length: Option<u64>,
    /// What the server asks to wait.
    pub(super) retry_after: Option<Duration>,
    pub(super) body: Box<dyn Read>,
}

/// Asks servers.
pub(super) struct Client {
    agent: ureq::Agent,
}

impl Client {
    pub(super) fn new(patience: &Patience) -> Self {
        let config = ureq::Agent::config_builder()
            .http_status_as_error(false)
            .timeout_connect(Some(patience.connect))
            .timeout_recv_response(Some(patience.answer))
            .timeout_per_read(Some(patience.silence))
            .max_redirects(10)
            .accept_encoding("identity")
            .user_agent(concat!("open-structure/", env!("CARGO_PKG_VERSION")))
            .build();
        Self { agent: config.new_agent() }
    }

    /// Asks for a file from a byte on, provided that it is still the same version.
    pub(super) fn ask(&self, url: &str, from: u64, version: &Version) -> Result<Answer, ureq::Error> {
        let mut request = self.agent.get(url);
        if is_this_machine(url) {
            request = request.config().proxy(None).build();
        }
        if let (1.., Some(validator)) = (from, version.validator()) {
            request = request.header("Range", format!("bytes={from}-")).header("If-Range", validator);
        }
        let response = request.call()?;
        let (head, body) = response.into_parts();
        let headers = &head.headers;
        let length = text(headers, "content-length").and_then(|length| length.trim().parse().ok());
        let range = text(headers, "content-range").and_then(content_range);
        let (start, total) = match (head.status, range) {
            (StatusCode::PARTIAL_CONTENT, Some((start, total))) => (start, total),
            (StatusCode::RANGE_NOT_SATISFIABLE, Some((_, total))) => (0, total),
            _ => (0, length),
        };
        Ok(Answer {
            status: head.status.as_u16(),
            reason: head.status.canonical_reason(),
            version: Version {
                // A weak tag promises a like file, not the same bytes.
                etag: text(headers, "etag").filter(|tag| tag.starts_with('"')).map(str::to_owned),
                last_modified: text(headers, "last-modified").map(str::to_owned),
            },
            total,
            start,
            length,
            retry_after: text(headers, "retry-after")
                .and_then(|seconds| seconds.trim().parse().ok())
                .map(Duration::from_secs),
            body: Box::new(body.into_reader()),
        })
    }
}

/// Whether a server is on this machine, which no proxy can reach for us.
fn is_this_machine(url: &str) -> bool {
    let host = url.split("://").nth(1).unwrap_or_default();
    ["localhost", "127.0.0.1", "[::1]"].into_iter().any(|name| {
        host.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with([':', '/']))
    })
}

fn text<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    headers.get(name).and_then(|value| value.to_str().ok()).filter(|value| value.len() <= 1000)
}

/// Start and total of `bytes 5-9/10`, `bytes 5-9/*` or `bytes */10`.
fn content_range(value: &str) -> Option<(u64, Option<u64>)> {
    let (range, total) = value.trim().strip_prefix("bytes ")?.split_once('/')?;
    let total = if total == "*" { None } else { Some(total.parse().ok()?) };
    let start = if range == "*" { 0 } else { range.split_once('-')?.0.parse().ok()? };
    Some((start, total))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_machine_is_known_by_its_names() {
        for url in ["http://localhost", "http://127.0.0.1:80/a", "https://localhost/a", "http://[::1]:8/a"] {
            assert!(is_this_machine(url), "{url}");
        }
        for url in ["http://localhost.example.org/", "http://127.0.0.12/", "http://example.org/localhost"] {
            assert!(!is_this_machine(url), "{url}");
        }
    }

    #[test]
    fn a_content_range_says_where_and_how_much() {
        assert_eq!(content_range("bytes 5-9/10"), Some((5, Some(10))));
        assert_eq!(content_range("bytes 5-9/*"), Some((5, None)));
        assert_eq!(content_range("bytes */10"), Some((0, Some(10))));
        for wrong in ["", "bytes", "bytes 5/10", "bytes 5-9", "bytes -5-9/10", "items 5-9/10", "bytes 5-9/x"]
        {
            assert_eq!(content_range(wrong), None, "{wrong}");
        }
    }
}
