//! The specification in code: reading and writing sequences as MCAP files and Parquet folders.
//!
//! ```no_run
//! use open_structure::structure::PointMeasurement;
//!
//! let sequence = open_structure::format::open("box1")?;
//! let rows: Vec<PointMeasurement> = sequence.table()?;
//! # Ok::<(), open_structure::format::Error>(())
//! ```

mod arrow_batch;
mod arrow_message;
mod arrow_schema;
mod batches;
mod collection;
mod columns;
mod copy;
mod counted_file;
mod croissant;
mod encoding;
mod error;
mod foxglove;
mod frames;
mod guard;
mod json_schema;
mod mcap_chunk;
mod mcap_reader;
mod mcap_survey;
mod mcap_writer;
mod member_names;
mod names;
mod parquet_folder;
mod parquet_reader;
mod parquet_writer;
mod partial;
mod reader;
mod record_batches;
mod rerun;
mod results;
mod stored_table;
mod two_pass;
mod writer;

pub use arrow_schema::arrow_schema;
pub use batches::Batches;
pub(crate) use collection::StoredCatalogue;
pub use collection::{
    Collection, Member, catalogue_entry, folder_name, read_catalogue, sequence_name, write_catalogue,
};
pub use columns::{record_batch, record_batch_of};
pub use copy::copy;
pub use encoding::Encoding;
pub use error::Error;
pub use frames::Frames;
pub use json_schema::json_schema;
pub(crate) use mcap_survey::{Faults, McapSurvey, survey_file};
#[cfg(feature = "cli")]
pub(crate) use partial::Partial;
pub use partial::discard_unfinished;
pub use reader::{SequenceReader, open, read, stored_bytes};
pub use record_batches::RecordBatches;
pub use rerun::{RerunCounts, write_rerun};
pub use results::{read_results, results_batch, write_results, write_text};
pub use stored_table::StoredTable;
pub use two_pass::{Chunk, Outline, Realisation, Tally, write_realisations, write_two_pass};
pub use writer::{FrameRows, SequenceWriter, WriteOptions, Written, write};
