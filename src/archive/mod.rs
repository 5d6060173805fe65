//! Archives of datasets, unpacked with care: zip, tar, and tar in gzip, told apart by their first bytes.
//!
//! An archive comes from the network and is not believed. Nothing is written outside the folder that is asked
//! for, links and devices are left out, and bytes are counted as they come, never as an archive claims.
//!
//! ```no_run
//! use open_structure::archive::{self, Limits};
//! use std::path::Path;
//!
//! let archive = Path::new("rgbd_dataset_freiburg1_desk.tgz");
//! let unpacked = archive::unpack(archive, Path::new("desk"), &Limits::default(), &|_, _| {})?;
//! println!("{} files, {} B", unpacked.files, unpacked.bytes);
//! # Ok::<(), archive::Error>(())
//! ```

mod entry_name;
mod error;
mod kind;
mod limits;
mod metered;
mod sink;
mod tar_archive;
mod temporary;
mod unpack;
mod zip_archive;
mod zipped;

#[cfg(test)]
mod tests;

pub use crate::unfinished::discard as discard_unfinished;
pub use error::Error;
pub use kind::Kind;
pub use limits::Limits;
pub use temporary::Temporary;
pub use unpack::{Selection, Unpacked, extract, unpack};
pub use zipped::zipped;
