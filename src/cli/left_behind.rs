//! What this version does not know of a sequence, and so leaves behind.

use std::io::{self, Write};

use super::Outcome;
use crate::format::SequenceReader;

/// Says on stderr which tables and columns are not known, and so not copied.
pub(super) fn warn(reader: &SequenceReader) -> io::Result<Outcome> {
    let mut stderr = io::stderr();
    let mut outcome = Outcome::Done;
    for name in reader.passed_over() {
        writeln!(stderr, "warning: {name} is not known to this version and is not copied")?;
        outcome = Outcome::Findings;
    }
    for stored in reader.tables() {
        for column in &stored.unknown_columns {
            writeln!(
                stderr,
                "warning: column {column} of {} is not known to this version and is not copied",
                stored.table.name
            )?;
            outcome = Outcome::Findings;
        }
    }
    Ok(outcome)
}
