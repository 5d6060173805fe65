//! Other places for the files of recipes.

use std::path::PathBuf;

use crate::datasets::RemoteFile;

/// A place that has files of recipes, as `SEQUENCE/FILE` or as `FILE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Mirror {
    /// A folder.
    Folder(PathBuf),
    /// A URL, to which the names are added.
    Url(String),
}

impl Mirror {
    /// A mirror as people write it: a URL where it begins as one, else a folder.
    #[must_use]
    pub fn of(text: &str) -> Self {
        if text.starts_with("http://") || text.starts_with("https://") {
            Self::Url(text.trim_end_matches('/').to_owned())
        } else {
            Self::Folder(PathBuf::from(text))
        }
    }
}

/// Where a file may be had.
pub(super) enum Places {
    /// At these URLs, the first one first.
    Urls(Vec<String>),
    /// On this disk, as one or the other.
    Paths([PathBuf; 2]),
}

impl Places {
    /// Where a file of a sequence may be had.
    pub(super) fn of(mirror: Option<&Mirror>, sequence: &str, file: &RemoteFile) -> Self {
        let name = file.file_name();
        match mirror {
            None => Self::Urls(file.urls.clone()),
            Some(Mirror::Url(url)) => {
                Self::Urls(vec![format!("{url}/{sequence}/{name}"), format!("{url}/{name}")])
            }
            Some(Mirror::Folder(folder)) => {
                Self::Paths([folder.join(sequence).join(name), folder.join(name)])
            }
        }
    }
}
