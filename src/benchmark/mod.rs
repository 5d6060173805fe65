//! The paper's experiment as a program: every method on every sequence, over seeds, beside the bound and the paper.
//!
//! A *cell* is one method on one sequence with one seed. [`run`] makes the cells of a [`Plan`], keeps each in a [`Store`]
//! as soon as it is done, and passes over those that are there already. [`Results`] sums them up.

mod bound;
mod cell;
mod content;
mod error;
mod gather;
mod html;
mod measured;
mod method;
mod paper;
mod plan;
mod results;
mod run;
mod source;
mod spread;
mod store;
mod tables;

pub use bound::{Bound, bound_of};
pub use cell::{Cell, CellKey, CurvePoint, Outcome};
pub use error::Error;
pub use gather::gather;
pub use html::html;
pub use measured::measured;
pub use method::Method;
pub use paper::{PaperCell, PaperMethod, paper};
pub use plan::Plan;
pub use results::{Results, Row};
pub use run::{Progress, run};
pub use source::load;
pub use spread::Spread;
pub use store::Store;
pub use tables::{cells_table, curves_table, markdown, summary_table};
