//! A straight flight of stairs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::placement::{check_numbers, placed};
use super::{Edge, Face, Placement, Scene};
use crate::simulate::Error;

/// A straight flight of stairs that climbs along its own x.
///
/// `position_m` is the middle of the foot of the first riser.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(inline)]
pub struct Staircase {
    /// Steps.
    pub steps: u32,
    /// Depth of a step, metres.
    #[serde(default = "tread")]
    #[schemars(extend("x-unit" = "m"))]
    pub tread_m: f64,
    /// Height of a step, metres.
    #[serde(default = "riser")]
    #[schemars(extend("x-unit" = "m"))]
    pub riser_m: f64,
    /// Width of the flight, metres.
    #[serde(default = "width")]
    #[schemars(extend("x-unit" = "m"))]
    pub width_m: f64,
    /// Middle of the foot of the first riser, `world`, metres.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m", "x-space" = "world"))]
    pub position_m: [f64; 3],
    /// Roll, pitch and yaw, degrees: turned about x, then y, then z of the world.
    #[serde(default)]
    #[schemars(extend("x-unit" = "deg"))]
    pub roll_pitch_yaw_deg: [f64; 3],
}

const fn tread() -> f64 {
    0.29
}
const fn riser() -> f64 {
    0.17
}
const fn width() -> f64 {
    1.2
}

impl Staircase {
    pub(super) fn check(&self, place: &str) -> Result<(), Error> {
        if !(1..=100_000).contains(&self.steps) {
            return Err(Error::value(format!("{place}.steps"), "1 to 100000 steps", self.steps));
        }
        for (name, number) in
            [("tread_m", self.tread_m), ("riser_m", self.riser_m), ("width_m", self.width_m)]
        {
            check_numbers(&format!("{place}.{name}"), &[number], 1e-3, 1e3, "m")?;
        }
        self.placement().check(place)
    }

    const fn placement(&self) -> Placement {
        Placement { position_m: self.position_m, roll_pitch_yaw_deg: self.roll_pitch_yaw_deg }
    }

    pub(super) fn add_to(&self, scene: &mut Scene, object: u32) {
        let world_from_object = self.placement().world_from_object();
        let side = 0.5 * self.width_m;
        let mut face = |corners: [[f64; 3]; 4]| {
            scene.faces.push(Face::quad(placed(&world_from_object, corners), object));
        };
        let x = |step: u32| f64::from(step) * self.tread_m;
        let z = |step: u32| f64::from(step) * self.riser_m;
        for step in 0..self.steps {
            let (near, far, low, high) = (x(step), x(step + 1), z(step), z(step + 1));
            face([[near, -side, low], [near, -side, high], [near, side, high], [near, side, low]]);
            face([[near, -side, high], [far, -side, high], [far, side, high], [near, side, high]]);
            for y in [-side, side] {
                face([[near, y, 0.0], [far, y, 0.0], [far, y, high], [near, y, high]]);
            }
        }
        let (end, top) = (x(self.steps), z(self.steps));
        face([[end, -side, 0.0], [end, side, 0.0], [end, side, top], [end, -side, top]]);
        let mut edge = |ends: [[f64; 3]; 2]| {
            let [start, end] = placed(&world_from_object, ends);
            scene.edges.push(Edge { start, end, object });
        };
        for step in 0..self.steps {
            let (near, far, low, high) = (x(step), x(step + 1), z(step), z(step + 1));
            edge([[near, -side, high], [near, side, high]]);
            edge([[near, -side, low], [near, side, low]]);
            for y in [-side, side] {
                edge([[near, y, low], [near, y, high]]);
                edge([[near, y, high], [far, y, high]]);
            }
        }
        edge([[end, -side, top], [end, side, top]]);
        edge([[end, -side, 0.0], [end, side, 0.0]]);
        for y in [-side, side] {
            edge([[end, y, 0.0], [end, y, top]]);
            edge([[0.0, y, 0.0], [end, y, 0.0]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flight_has_the_area_of_its_steps_sides_and_back() {
        let staircase = Staircase {
            steps: 4,
            tread_m: 0.5,
            riser_m: 0.25,
            width_m: 2.0,
            position_m: [1.0, 2.0, 3.0],
            roll_pitch_yaw_deg: [0.0, 0.0, 30.0],
        };
        let mut scene = Scene::default();
        staircase.add_to(&mut scene, 0);
        let steps = 4.0 * 2.0 * (0.5 + 0.25);
        let sides = 2.0 * 0.5 * 0.25 * (1.0 + 2.0 + 3.0 + 4.0);
        let back = 2.0 * 1.0;
        assert!((scene.area() - steps - sides - back).abs() < 1e-9);
        // Every step has its nosing, and all nosings are parallel.
        let nosings = scene.edges.iter().filter(|edge| (edge.length() - 2.0).abs() < 1e-9).count();
        assert_eq!(nosings, 4 + 4 + 2 + 2);
    }
}
