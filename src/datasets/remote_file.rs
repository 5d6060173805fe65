//! A file of a dataset, as it is published.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Error;

/// A file to download.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct RemoteFile {
    /// Where it is published; the second and others are tried where the first does not have it.
    #[schemars(length(min = 1))]
    pub urls: Vec<String>,
    /// Its name here and on a mirror, where the end of the first URL is not it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Whether it is an archive to unpack: zip, tar or tar.gz, told by its content.
    #[serde(default = "yes")]
    pub unpack: bool,
    /// The folder of the archive that is wanted, where others are not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub only: Option<PathBuf>,
    /// The folder to unpack to, below the one that is made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub into: Option<PathBuf>,
    /// Its length, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "B"))]
    pub bytes: Option<u64>,
    /// Its SHA-256, 64 lower-case hexadecimal digits, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub sha256: Option<String>,
}

const fn yes() -> bool {
    true
}

impl RemoteFile {
    /// The name that the file has here and on a mirror.
    #[must_use]
    pub fn file_name(&self) -> &str {
        let last = || self.urls.first().and_then(|url| url.rsplit('/').next()).unwrap_or_default();
        self.name.as_deref().unwrap_or_else(last)
    }

    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        if self.urls.is_empty() || self.urls.len() > 10 {
            return Err(Error::value(format!("{place}.urls"), "1 to 10 URLs", self.urls.len()));
        }
        for (index, url) in self.urls.iter().enumerate() {
            check_url(url, &format!("{place}.urls[{index}]"))?;
        }
        let name = self.file_name();
        if !is_plain(name) {
            return Err(Error::value(
                format!("{place}.name"),
                "a file name of letters, digits and . _ - +, which the end of the first URL may be",
                format!("{name:?}"),
            ));
        }
        for (field, folder) in [("only", &self.only), ("into", &self.into)] {
            if let Some(folder) = folder {
                check_folder(folder, &format!("{place}.{field}"))?;
            }
        }
        if self.only.is_some() && !self.unpack {
            return Err(Error::value(format!("{place}.only"), "unpack = true beside it", "unpack = false"));
        }
        if self.bytes == Some(0) {
            return Err(Error::value(format!("{place}.bytes"), "at least 1 B", 0));
        }
        let digits = |sha256: &String| {
            sha256.len() == 64 && sha256.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
        };
        match &self.sha256 {
            Some(sha256) if !digits(sha256) => Err(Error::value(
                format!("{place}.sha256"),
                "64 lower-case hexadecimal digits",
                format!("{sha256:?}"),
            )),
            _ => Ok(()),
        }
    }
}

/// Letters that need no care in a file system, a URL or a shell; no hidden file.
fn is_plain(name: &str) -> bool {
    (1..=200).contains(&name.len())
        && !name.starts_with(['.', '-'])
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"._-+".contains(&byte))
}

pub(super) fn check_url(url: &str, place: &str) -> Result<(), Error> {
    let rest = url.strip_prefix("https://").or_else(|| url.strip_prefix("http://"));
    let printable = url.len() <= 1000 && url.bytes().all(|byte| byte.is_ascii_graphic());
    if rest.is_some_and(|rest| !rest.starts_with('/') && !rest.is_empty()) && printable {
        return Ok(());
    }
    Err(Error::value(place, "a URL that begins with https:// or http://", format!("{url:?}")))
}

/// A folder below another: no way out of that.
pub(super) fn check_folder(folder: &std::path::Path, place: &str) -> Result<(), Error> {
    let text = folder.to_str().unwrap_or("\\");
    let inside = text == "." || text.split('/').all(is_plain);
    if inside && text.len() <= 500 {
        return Ok(());
    }
    Err(Error::value(place, "names of folders with / between them", format!("{text:?}")))
}
