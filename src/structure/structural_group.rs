//! Lines that share a direction.

use nalgebra::Vector3;

use super::id::{GroupId, LineId};
use super::record::record;
use super::registry;

record! {
    /// A group of lines tied by structure, such as parallel lines.
    pub struct StructuralGroup in structural_groups (Whole, Optional, key: [group_id]) {
        /// Name of the group.
        ["1", "-"]
        group_id: GroupId,
        /// Kind of the group; the registry has `parallel`, `manhattan` and `atlanta`.
        ["1", "-"]
        kind: String,
        /// Common direction, of unit length, x; absent where no line of the group has a landmark.
        ["1", "world"]
        direction_x: Option<f64>,
        /// Common direction, y.
        ["1", "world"]
        direction_y: Option<f64>,
        /// Common direction, z.
        ["1", "world"]
        direction_z: Option<f64>,
        /// Lines of the group, ascending.
        ["1", "-"]
        line_ids: Vec<LineId>,
    }
}

impl StructuralGroup {
    /// Whether the group is made of parallel groups, as `manhattan` and `atlanta` are.
    ///
    /// Its parts are the groups of kind `parallel` whose lines it lists.
    #[must_use]
    pub fn is_made_of_groups(&self) -> bool {
        [registry::MANHATTAN, registry::ATLANTA].contains(&self.kind.as_str())
    }

    /// The same group with its direction left out, which an estimator may not be told.
    #[must_use]
    pub fn without_direction(&self) -> Self {
        Self { direction_x: None, direction_y: None, direction_z: None, ..self.clone() }
    }

    /// Common direction in `world`; `None` when it is not known or not whole.
    #[must_use]
    pub fn direction(&self) -> Option<Vector3<f64>> {
        Some(Vector3::new(self.direction_x?, self.direction_y?, self.direction_z?))
    }
}
