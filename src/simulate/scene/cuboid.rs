//! Boxes, seen from outside, and rooms, seen from inside.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::placement::{check_numbers, placed};
use super::{Edge, Face, Placement, Scene};
use crate::simulate::Error;

/// A box in any pose; `position_m` is its centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct Cuboid {
    /// Lengths along its own x, y and z, metres.
    #[schemars(extend("x-unit" = "m"))]
    pub size_m: [f64; 3],
    /// Centre, `world`, metres.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m", "x-space" = "world"))]
    pub position_m: [f64; 3],
    /// Roll, pitch and yaw, degrees: turned about x, then y, then z of the world.
    #[serde(default)]
    #[schemars(extend("x-unit" = "deg"))]
    pub roll_pitch_yaw_deg: [f64; 3],
}

/// A room: floor, ceiling and four walls; `position_m` is its centre.
///
/// The same faces as a box. Furniture is made of boxes put into it.
pub type Room = Cuboid;

/// Corners of a face of the unit box, each a choice of low or high per axis.
const FACES: [[[usize; 3]; 4]; 6] = [
    [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]],
    [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]],
    [[0, 1, 0], [0, 1, 1], [1, 1, 1], [1, 1, 0]],
    [[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 0]],
    [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]],
];

impl Cuboid {
    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        check_numbers(&format!("{place}.size_m"), &self.size_m, 1e-3, 1e6, "m")?;
        self.placement().check(place)
    }

    const fn placement(&self) -> Placement {
        Placement { position_m: self.position_m, roll_pitch_yaw_deg: self.roll_pitch_yaw_deg }
    }

    pub(super) fn add_to(&self, scene: &mut Scene, object: u32) {
        let world_from_object = self.placement().world_from_object();
        let half = self.size_m.map(|size| 0.5 * size);
        let corner = |choice: [usize; 3]| -> [f64; 3] {
            std::array::from_fn(|axis| if choice[axis] == 0 { -half[axis] } else { half[axis] })
        };
        for face in FACES {
            scene.faces.push(Face::quad(placed(&world_from_object, face.map(corner)), object));
        }
        for axis in 0..3 {
            for others in [[0, 0], [0, 1], [1, 0], [1, 1]] {
                let end = |at: usize| {
                    let mut choice = [0; 3];
                    choice[axis] = at;
                    choice[(axis + 1) % 3] = others[0];
                    choice[(axis + 2) % 3] = others[1];
                    corner(choice)
                };
                let [start, end] = placed(&world_from_object, [end(0), end(1)]);
                scene.edges.push(Edge { start, end, object });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_box_in_any_pose_keeps_its_area_and_its_faces_look_outward(
            size_m in prop::array::uniform3(0.1_f64..5.0),
            position_m in prop::array::uniform3(-5.0_f64..5.0),
            roll_pitch_yaw_deg in prop::array::uniform3(-180.0_f64..180.0),
        ) {
            let cuboid = Cuboid { size_m, position_m, roll_pitch_yaw_deg };
            let mut scene = Scene::default();
            cuboid.add_to(&mut scene, 0);
            let [x, y, z] = size_m;
            // Square metres; coordinates reach 10 m.
            prop_assert!((scene.area() - 2.0 * (x * y + y * z + z * x)).abs() < 1e-12);
            let total: f64 = scene.edges.iter().map(Edge::length).sum();
            prop_assert!((total - 4.0 * (x + y + z)).abs() < 1e-12 && scene.edges.len() == 12);
            let center = Point3::from(position_m);
            for face in &scene.faces {
                prop_assert!(face.normal().unwrap().dot(&(face.corners()[0] - center)) > 0.0);
            }
        }
    }
}
