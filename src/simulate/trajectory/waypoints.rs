//! A smooth path through given positions.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

use super::arc_length::{ArcLength, Curve};
use super::attitude::Mount;
use super::bounds::{angle, camera_angles, point};
use super::cubic_spline::CubicSpline;
use super::look::{Look, WaypointLook};
use super::path::Path;
use crate::geometry::Pose;
use crate::simulate::Error;
use crate::structure::MotionGrade;

/// The most waypoints of a path.
const MOST: usize = 100_000;

/// The least distance between waypoints, metres.
const NEAREST_M: f64 = 1e-6;

/// Cells in which a piece of the spline is measured; its length is then exact to about 1e-6 of itself.
const CELLS_A_PIECE: usize = 32;

/// A cubic spline through given positions, twice continuously differentiable, over the length of their chords.
///
/// An open path has its first frame in the first waypoint and its last in the last; a closed one returns to the first
/// without a frame twice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Waypoints {
    /// Number of frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<u64>,
    /// Grade of rotation, instead of `frames`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionGrade>,
    /// The waypoints: two or more, three or more for a closed path.
    pub waypoints: Vec<Waypoint>,
    /// Whether the path returns to its first waypoint.
    pub closed: bool,
    /// Whether the speed is constant; otherwise it is about even between the waypoints.
    pub constant_speed: bool,
    /// Where the camera looks: `"forward"`, `{ target_m = [x, y, z] }`, or `"waypoint"` for the waypoints' own angles.
    pub look: WaypointLook,
    /// Turn of the camera to the left, degrees.
    pub yaw_deg: f64,
    /// Turn of the camera upwards, degrees.
    pub pitch_deg: f64,
    /// Turn of the camera about its viewing direction, degrees.
    pub roll_deg: f64,
}

/// A position that the path goes through.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// Where, metres.
    pub position_m: [f64; 3],
    /// Yaw of the camera, degrees: 0 looks along +y, 90 along −x. Between two waypoints it goes the short way round.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw_deg: Option<f64>,
    /// Pitch of the camera, degrees upwards; 0 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch_deg: Option<f64>,
}

impl Default for Waypoints {
    fn default() -> Self {
        Self {
            frames: None,
            motion: None,
            waypoints: Vec::new(),
            closed: false,
            constant_speed: true,
            look: WaypointLook::Forward,
            yaw_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
        }
    }
}

impl Path for Waypoints {
    fn asked(&self) -> (Option<u64>, Option<MotionGrade>) {
        (self.frames, self.motion)
    }

    fn check(&self) -> Result<(), Error> {
        let fewest = if self.closed { 3 } else { 2 };
        let count = self.waypoints.len();
        if !(fewest..=MOST).contains(&count) {
            return Err(Error::value("trajectory.waypoints", format!("{fewest} to {MOST} waypoints"), count));
        }
        for (i, waypoint) in self.waypoints.iter().enumerate() {
            let place = |field: &str| format!("trajectory.waypoints[{i}].{field}");
            point(&place("position_m"), waypoint.position_m)?;
            waypoint.yaw_deg.map_or(Ok(()), |yaw| angle(&place("yaw_deg"), yaw))?;
            waypoint.pitch_deg.map_or(Ok(()), |pitch| angle(&place("pitch_deg"), pitch))?;
            if self.look == WaypointLook::Waypoint && waypoint.yaw_deg.is_none() {
                return Err(Error::value(place("yaw_deg"), "an angle, for `look` is `waypoint`", "none"));
            }
            let next = match self.waypoints.get(i + 1) {
                None if self.closed => &self.waypoints[0],
                None => break,
                Some(next) => next,
            };
            if distance(waypoint, next) < NEAREST_M {
                let found = "the same as the waypoint after it";
                return Err(Error::value(place("position_m"), "a position of its own", found));
            }
        }
        if let WaypointLook::Target(target) = self.look {
            Look::Target(target).check()?;
        }
        camera_angles(self.yaw_deg, self.pitch_deg, self.roll_deg)
    }

    fn fewest(&self) -> usize {
        1
    }

    fn walk(&self, frames: usize) -> Result<Vec<Pose>, Error> {
        let mount = Mount::from_degrees(self.yaw_deg, self.pitch_deg, self.roll_deg);
        let spline = self.spline();
        let lengths = ArcLength::new(&spline, spline.positions.pieces() * CELLS_A_PIECE);
        let steps = if self.closed { frames } else { (frames - 1).max(1) };
        let mut angles = (0.0, 0.0);
        (0..frames)
            .map(|n| {
                let done = n as f64 / steps as f64;
                let t = if self.constant_speed { lengths.parameter(done) } else { done };
                let (position, velocity) = spline.at(t);
                angles = match self.look {
                    WaypointLook::Forward => Look::Forward.angles(&position, &velocity, angles)?,
                    WaypointLook::Target(target) => {
                        Look::Target(target).angles(&position, &velocity, angles)?
                    }
                    WaypointLook::Waypoint => spline.angles(t),
                };
                Ok(Pose::new(mount.rotation(angles.0, angles.1), position))
            })
            .collect()
    }
}

impl Waypoints {
    fn spline(&self) -> PosedSpline {
        let mut route: Vec<&Waypoint> = self.waypoints.iter().collect();
        if self.closed {
            route.push(&self.waypoints[0]);
        }
        let mut knots = vec![0.0];
        let mut angles = vec![asked_angles(route[0])];
        for pair in route.windows(2) {
            knots.push(knots[knots.len() - 1] + distance(pair[0], pair[1]));
            let [yaw, pitch] = asked_angles(pair[1]);
            let [before, _] = angles[angles.len() - 1];
            angles.push([before + short_way(yaw - before), pitch]);
        }
        let positions = route.iter().map(|waypoint| waypoint.position_m).collect();
        let end = knots[knots.len() - 1];
        let mut drift = 0.0;
        let (positions, angles) = if self.closed {
            // Whole turns of the yaw on the way round are taken out, and put back where it is asked for.
            let turns = angles[angles.len() - 1][0] - angles[0][0];
            drift = turns / end;
            for (angles, knot) in angles.iter_mut().zip(&knots) {
                angles[0] -= drift * knot;
            }
            (CubicSpline::closed(knots.clone(), positions), CubicSpline::closed(knots, angles))
        } else {
            (CubicSpline::open(knots.clone(), positions), CubicSpline::open(knots, angles))
        };
        PosedSpline { positions, angles, drift }
    }
}

/// Positions, and yaw and pitch, along the waypoints.
struct PosedSpline {
    positions: CubicSpline<3>,
    angles: CubicSpline<2>,
    /// Yaw that is not in `angles`, radians for each metre of chord.
    drift: f64,
}

impl PosedSpline {
    fn angles(&self, t: f64) -> (f64, f64) {
        let u = t * self.positions.end();
        let [yaw, pitch] = self.angles.at(u).0;
        (yaw + self.drift * u, pitch)
    }
}

impl Curve for PosedSpline {
    fn at(&self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        let end = self.positions.end();
        let (position, slope) = self.positions.at(t * end);
        (position.into(), Vector3::from(slope) * end)
    }
}

fn distance(a: &Waypoint, b: &Waypoint) -> f64 {
    (Vector3::from(a.position_m) - Vector3::from(b.position_m)).norm()
}

fn asked_angles(waypoint: &Waypoint) -> [f64; 2] {
    [waypoint.yaw_deg, waypoint.pitch_deg].map(|angle| angle.unwrap_or_default().to_radians())
}

/// The same turn as an angle from −π to π.
fn short_way(turn: f64) -> f64 {
    turn - TAU * ((turn + PI) / TAU).floor()
}
