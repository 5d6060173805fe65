//! Files that belong together: the raw images of a sequence, or what the first release has of it.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::remote_file::check_folder;
use super::{Error, RemoteFile};

/// Files that together make a folder to convert.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct Part {
    /// The folder to convert, below the one that is made; `.` for that itself.
    #[serde(default = "here")]
    pub folder: PathBuf,
    /// Frames, where they are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<u64>,
    /// What is to be known of the files, such as what is inferred and not said by anybody.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// The files.
    #[schemars(length(min = 1))]
    pub files: Vec<RemoteFile>,
}

fn here() -> PathBuf {
    PathBuf::from(".")
}

impl Part {
    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        check_folder(&self.folder, &format!("{place}.folder"))?;
        if self.frames.is_some_and(|frames| !(1..=100_000_000).contains(&frames)) {
            return Err(Error::value(
                format!("{place}.frames"),
                "1 to 100000000",
                self.frames.unwrap_or_default(),
            ));
        }
        if self.files.is_empty() || self.files.len() > 100 {
            return Err(Error::value(format!("{place}.files"), "1 to 100 files", self.files.len()));
        }
        for (index, file) in self.files.iter().enumerate() {
            file.check(&format!("{place}.files[{index}]"))?;
            let twin = self.files[..index].iter().any(|other| other.file_name() == file.file_name());
            if twin {
                return Err(Error::value(
                    format!("{place}.files[{index}].name"),
                    "a name that no other file has",
                    format!("{:?} again", file.file_name()),
                ));
            }
        }
        Ok(())
    }
}
