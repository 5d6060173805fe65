//! What becomes of features along the rims of objects.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What becomes of a feature along the rim of an object, behind which the background begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Rims {
    /// It belongs to the nearer surface.
    Nearer,
    /// It is rejected.
    Reject,
}
