//! Collections: folders of sequences that query engines read as one, and their catalogue.

mod catalogue;
mod entry;
mod folder_name;
mod layout;

pub(crate) use catalogue::StoredCatalogue;
pub use catalogue::{read_catalogue, write_catalogue};
pub use entry::catalogue_entry;
pub use folder_name::{folder_name, sequence_name};
pub use layout::{Collection, Member};
