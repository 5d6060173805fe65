//! What a recipe is known to make.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::structure::{TableSummary, hex};

/// Row counts and the digest of a sequence that a recipe made.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct Expected {
    /// Rows of `frames`.
    pub frames: u64,
    /// Rows of `point_landmarks`.
    pub points: u64,
    /// Rows of `line_landmarks`.
    pub lines: u64,
    /// Rows of `point_observations`.
    pub point_observations: u64,
    /// Rows of `line_observations`.
    pub line_observations: u64,
    /// Rows of `structural_groups`.
    pub groups: u64,
    /// SHA-256 over `table rows sha256` of every table, one line each in the order of the specification.
    pub sha256: String,
}

impl Expected {
    /// What a sequence of some tables should have been expected to be.
    #[must_use]
    pub fn of(tables: &[TableSummary]) -> Self {
        let rows = |name: &str| tables.iter().find(|table| table.table == name).map_or(0, |table| table.rows);
        let mut hasher = Sha256::new();
        for table in tables {
            hasher.update(format!("{} {} {}\n", table.table, table.rows, table.sha256));
        }
        Self {
            frames: rows("frames"),
            points: rows("point_landmarks"),
            lines: rows("line_landmarks"),
            point_observations: rows("point_observations"),
            line_observations: rows("line_observations"),
            groups: rows("structural_groups"),
            sha256: hex(&hasher.finalize()),
        }
    }
}
