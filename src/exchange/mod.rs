//! Graphs, models and paths in the formats of other programs, both ways: g2o, BAL, COLMAP, text, CSV.
//!
//! Each format has its nouns in memory, which keep every digit of a file, and two functions between them and ours. What
//! the other side cannot say is told in [`Remark`]s, never dropped in silence.

mod bal;
mod colmap;
mod csv;
mod error;
mod g2o;
mod imported;
mod lines;
mod remark;
mod text_file;
mod text_release;
mod trajectory;
mod valued;

pub use bal::{BalCamera, BalObservation, BalProblem, bal_estimate, from_bal, read_bal, to_bal, write_bal};
pub use colmap::{
    ColmapCamera, ColmapImage, ColmapModel, ColmapPoint, ColmapPoint2, from_colmap, read_colmap, to_colmap,
    write_colmap,
};
pub use csv::to_csv;
pub use error::Error;
pub use g2o::{G2oElement, G2oForm, G2oGraph, G2oKind, from_g2o, read_g2o, to_g2o, with_estimate, write_g2o};
pub use imported::{ImportNames, Imported};
pub use lines::{LARGEST_FILE_BYTES, MOST_ELEMENTS};
pub use remark::Remark;
pub use text_file::TextFile;
pub use text_release::to_text_release;
pub use trajectory::{MatchBy, MatchOptions, Matched, match_trajectory, trajectory_of};
pub use valued::valued_graph;
