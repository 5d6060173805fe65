//! Datasets over HTTP: downloads that go on where they were cut, are checked, and are unpacked with care.
//!
//! What is being downloaded lies in `NAME.download/` beside the folder that is to appear, as `FILE.part`, with
//! what the server said about it in `FILE.part.json`. The folder itself appears when all is there.

mod checksum;
mod download;
mod error;
mod event;
mod folder;
mod http;
mod mirror;
mod part_file;
mod patience;
mod store;

pub use error::Error;
pub use event::Event;
pub use folder::{Fetched, FetchedFile, Options, What, download_folder, fetch};
pub use mirror::Mirror;
pub use patience::Patience;
