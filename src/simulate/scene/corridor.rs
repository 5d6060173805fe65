//! A corridor round a square block.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::placement::{check_numbers, placed};
use super::{Edge, Face, Placement, Scene};
use crate::simulate::Error;

/// A corridor that runs round a square block: outer and inner walls, floor and ceiling.
///
/// The defaults are those of the first release's corridor. `position_m` is the centre of the block.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(inline)]
pub struct RingCorridor {
    /// Side of the outer walls, metres.
    #[schemars(extend("x-unit" = "m"))]
    pub outer_m: f64,
    /// Side of the inner walls, metres.
    #[schemars(extend("x-unit" = "m"))]
    pub inner_m: f64,
    /// Height from floor to ceiling, metres.
    #[schemars(extend("x-unit" = "m"))]
    pub height_m: f64,
    /// Centre, `world`, metres.
    #[schemars(extend("x-unit" = "m", "x-space" = "world"))]
    pub position_m: [f64; 3],
    /// Roll, pitch and yaw, degrees: turned about x, then y, then z of the world.
    #[schemars(extend("x-unit" = "deg"))]
    pub roll_pitch_yaw_deg: [f64; 3],
}

impl Default for RingCorridor {
    fn default() -> Self {
        Self {
            outer_m: 22.0,
            inner_m: 13.2,
            height_m: 3.5,
            position_m: [0.0; 3],
            roll_pitch_yaw_deg: [0.0; 3],
        }
    }
}

impl RingCorridor {
    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        check_numbers(&format!("{place}.inner_m"), &[self.inner_m], 1e-2, 1e6, "m")?;
        check_numbers(&format!("{place}.height_m"), &[self.height_m], 1e-2, 1e6, "m")?;
        check_numbers(&format!("{place}.outer_m"), &[self.outer_m], self.inner_m + 1e-2, 1e6, "m")?;
        self.placement().check(place)
    }

    const fn placement(&self) -> Placement {
        Placement { position_m: self.position_m, roll_pitch_yaw_deg: self.roll_pitch_yaw_deg }
    }

    pub(super) fn add_to(&self, scene: &mut Scene, object: u32) {
        let world_from_object = self.placement().world_from_object();
        let (outer, inner, half) = (0.5 * self.outer_m, 0.5 * self.inner_m, 0.5 * self.height_m);
        let corners =
            |side: f64, z: f64| [[-side, -side, z], [side, -side, z], [side, side, z], [-side, side, z]];
        let mut face = |corners: [[f64; 3]; 4]| {
            scene.faces.push(Face::quad(placed(&world_from_object, corners), object));
        };
        for side in 0..4 {
            let next = (side + 1) % 4;
            for wall in [outer, inner] {
                let (low, high) = (corners(wall, -half), corners(wall, half));
                face([low[side], low[next], high[next], high[side]]);
            }
            // Floor and ceiling are mitred at the corners of the ring.
            for z in [-half, half] {
                let (out, within) = (corners(outer, z), corners(inner, z));
                face([out[side], out[next], within[next], within[side]]);
            }
        }
        let mut edge = |ends: [[f64; 3]; 2]| {
            let [start, end] = placed(&world_from_object, ends);
            scene.edges.push(Edge { start, end, object });
        };
        for wall in [outer, inner] {
            let (low, high) = (corners(wall, -half), corners(wall, half));
            for side in 0..4 {
                let next = (side + 1) % 4;
                edge([low[side], low[next]]);
                edge([high[side], high[next]]);
                edge([low[side], high[side]]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corridor_of_the_release_has_its_area_and_edges() {
        let mut scene = Scene::default();
        RingCorridor::default().add_to(&mut scene, 0);
        let walls = 4.0 * (22.0 + 13.2) * 3.5;
        let floor_and_ceiling = 2.0 * (22.0 * 22.0 - 13.2 * 13.2);
        assert!((scene.area() - walls - floor_and_ceiling).abs() < 1e-9);
        assert_eq!((scene.faces.len(), scene.edges.len()), (16, 24));
    }
}
