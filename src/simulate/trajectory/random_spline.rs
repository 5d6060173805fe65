//! A smooth random path that keeps to a speed and a turn rate.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attitude::Mount;
use super::bounds::{angle, point, within};
use super::control_points::ControlPoints;
use super::look::Look;
use super::path::frame_count;
use super::stamp_nanos;
use crate::geometry::Pose;
use crate::simulate::Error;
use crate::structure::MotionGrade;

/// What rounding may add to a step, as a part of it.
const MARGIN: f64 = 1e-6;

/// A part of the speed bound below which the camera does not slow down to turn; it then turns after the path instead.
const SLOWEST: f64 = 0.1;

/// The radius of a bend of the path, as a part of the box's longest side, that most of its bends are narrower than.
const BEND: f64 = 0.3;

/// A uniform cubic B-spline through random control points in a box, walked within bounds.
///
/// From frame to frame the camera goes as far as both bounds allow: it moves at `max_speed_m_s` where the path is
/// nearly straight, and slows down in curves so that it turns by `max_turn_rate_deg_s`. Where that would take less
/// than a tenth of the speed, as at a cusp, it moves at that tenth and its view follows as fast as it may. The
/// bounds hold for every two consecutive frames: for the distance, and for the angle of the whole rotation. No frame
/// takes more than half a piece of the spline, so that short pieces are not jumped over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RandomSpline {
    /// Number of frames; must be given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<u64>,
    /// Grade of rotation: bounds the turn rate by the grade's rotation a frame (slow 0.5, medium 2, sharp 10 degrees),
    /// instead of `max_turn_rate_deg_s`, and unless `max_speed_m_s` is given makes the path fast enough to reach it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionGrade>,
    /// Lowest corner of the box, metres.
    pub low_m: [f64; 3],
    /// Highest corner of the box, metres.
    pub high_m: [f64; 3],
    /// Bound on the speed, metres a second. Without it 1 m/s; with `motion` the turn rate (radians a second) times 0.3 of
    /// the box's longest side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_speed_m_s: Option<f64>,
    /// Bound on the turn rate, degrees a second; 60 without it and `motion`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_turn_rate_deg_s: Option<f64>,
    /// Bound on how steeply a camera that looks forward looks up or down, degrees.
    pub max_pitch_deg: f64,
    /// Where the camera looks: `"forward"`, or `{ target_m = [x, y, z] }`.
    pub look: Look,
    /// Turn of the camera to the left, degrees.
    pub yaw_deg: f64,
    /// Turn of the camera upwards, degrees.
    pub pitch_deg: f64,
    /// Turn of the camera about its viewing direction, degrees.
    pub roll_deg: f64,
}

impl Default for RandomSpline {
    fn default() -> Self {
        Self {
            frames: None,
            motion: None,
            low_m: [-3.0, -3.0, -0.5],
            high_m: [3.0, 3.0, 0.5],
            max_speed_m_s: None,
            max_turn_rate_deg_s: None,
            max_pitch_deg: 30.0,
            look: Look::Forward,
            yaw_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
        }
    }
}

impl RandomSpline {
    /// The poses of a seed.
    pub(super) fn poses(&self, rate_hz: f64, seed: u64) -> Result<Vec<Pose>, Error> {
        let (frames, speed, turn_rate) = self.check(rate_hz)?;
        let mut walker = Walker {
            curve: ControlPoints::new(seed, self.low_m, self.high_m),
            mount: Mount::from_degrees(self.yaw_deg, self.pitch_deg, self.roll_deg),
            look: self.look,
            max_pitch: self.max_pitch_deg.to_radians(),
            at: 0.0,
            step: 0.01,
            angles: (0.0, 0.0),
        };
        let (mut pose, angles) = walker.pose(0.0)?;
        walker.angles = angles;
        let mut poses = Vec::with_capacity(frames);
        poses.push(pose);
        for n in 1..frames {
            let seconds =
                (stamp_nanos(n, rate_hz) - stamp_nanos(n - 1, rate_hz)) as f64 * 1e-9 * (1.0 - MARGIN);
            let bounds = Bounds { distance: speed * seconds, angle: turn_rate * seconds };
            pose = walker.next(&pose, &bounds)?;
            poses.push(pose);
        }
        Ok(poses)
    }

    /// The number of frames, and the bounds on speed, metres a second, and turn rate, radians a second.
    fn check(&self, rate_hz: f64) -> Result<(usize, f64, f64), Error> {
        let frames =
            self.frames.ok_or_else(|| Error::value("trajectory.frames", "a number of frames", "none"))?;
        let frames = frame_count(frames, 1)?;
        point("trajectory.low_m", self.low_m)?;
        point("trajectory.high_m", self.high_m)?;
        let sides = Vector3::from(self.high_m) - Vector3::from(self.low_m);
        if sides.min() < 0.0 || sides.max() < 1e-3 {
            let expected = "a corner above `low_m`, at least a millimetre along one axis";
            return Err(Error::value("trajectory.high_m", expected, format!("{:?}", self.high_m)));
        }
        self.max_speed_m_s.map_or(Ok(()), |speed| within("trajectory.max_speed_m_s", speed, 1e-3, 1e6))?;
        within("trajectory.max_pitch_deg", self.max_pitch_deg, 0.0, 89.0)?;
        self.look.check()?;
        angle("trajectory.yaw_deg", self.yaw_deg)?;
        angle("trajectory.pitch_deg", self.pitch_deg)?;
        angle("trajectory.roll_deg", self.roll_deg)?;
        let turn_rate = match (self.motion, self.max_turn_rate_deg_s) {
            (Some(_), Some(_)) => {
                let expected = "one of `motion` and `max_turn_rate_deg_s`";
                return Err(Error::value("trajectory.motion", expected, "both"));
            }
            (Some(grade), None) => grade.rotation_rad() * rate_hz,
            (None, rate) => {
                let rate = rate.unwrap_or(60.0);
                within("trajectory.max_turn_rate_deg_s", rate, 0.01, 1e6)?;
                rate.to_radians()
            }
        };
        let speed = match (self.max_speed_m_s, self.motion) {
            (Some(speed), _) => speed,
            (None, None) => 1.0,
            (None, Some(_)) => BEND * sides.max() * turn_rate,
        };
        Ok((frames, speed, turn_rate))
    }
}

/// How far the camera may go in one frame: metres, radians.
struct Bounds {
    distance: f64,
    angle: f64,
}

impl Bounds {
    /// The larger part of its bound that the way between two poses takes; at most 1 is within both.
    fn used(&self, from: &Pose, to: &Pose) -> f64 {
        let distance = (to.translation() - from.translation()).norm() / self.distance;
        distance.max((from.inverse() * *to).rotation_angle() / self.angle)
    }
}

/// The most a frame may take of the curve: half of a piece.
const LONGEST_STEP: f64 = 0.5;

struct Walker {
    curve: ControlPoints,
    mount: Mount,
    look: Look,
    max_pitch: f64,
    /// Where on the curve the last frame is, and how much of it the last step took.
    at: f64,
    step: f64,
    /// Yaw and pitch of the last frame, radians.
    angles: (f64, f64),
}

impl Walker {
    /// The pose that the curve asks for somewhere, and its yaw and pitch.
    fn pose(&mut self, t: f64) -> Result<(Pose, (f64, f64)), Error> {
        let (position, velocity) = self.curve.at(t);
        let (yaw, pitch) = self.look.angles(&position, &velocity, self.angles)?;
        let pitch =
            if self.look == Look::Forward { pitch.clamp(-self.max_pitch, self.max_pitch) } else { pitch };
        Ok((Pose::new(self.mount.rotation(yaw, pitch), position), (yaw, pitch)))
    }

    /// The next frame: the longest step, within a few parts in a hundred, that keeps the bounds.
    fn next(&mut self, from: &Pose, bounds: &Bounds) -> Result<Pose, Error> {
        let speed = self.curve.at(self.at).1.norm();
        let shortest = (SLOWEST * bounds.distance / speed).min(LONGEST_STEP);
        let mut step = self.step.max(shortest);
        let mut found: Option<(f64, Pose, (f64, f64))> = None;
        for _ in 0..24 {
            let (pose, angles) = self.pose(self.at + step)?;
            let used = bounds.used(from, &pose);
            if used <= 1.0 && found.as_ref().is_none_or(|(longest, ..)| step > *longest) {
                found = Some((step, pose, angles));
            }
            if used <= 1.0 && (used > 0.97 || step >= LONGEST_STEP) || used > 1.0 && step <= shortest {
                break;
            }
            step = (step * (0.985 / used).clamp(0.25, 2.0)).clamp(shortest, LONGEST_STEP);
        }
        let Some((step, pose, angles)) = found else {
            return self.follow(from, shortest, bounds);
        };
        self.at += step;
        self.step = step;
        self.angles = angles;
        Ok(pose)
    }

    /// A frame whose view cannot turn as fast as the curve asks: it turns that way as far as it may.
    fn follow(&mut self, from: &Pose, step: f64, bounds: &Bounds) -> Result<Pose, Error> {
        let mut step = step;
        loop {
            let (asked, angles) = self.pose(self.at + step)?;
            let turn = (from.inverse() * asked).rotation_angle();
            let mut part = if turn > 0.0 { (bounds.angle / turn).min(1.0) } else { 1.0 };
            // Rounding may pass the bound once; standing still, at the latest, keeps both.
            for _ in 0..3 {
                let turned = from.interpolate(&asked, part).rotation();
                let pose = Pose::new(turned, asked.translation());
                if bounds.used(from, &pose) <= 1.0 {
                    self.at += step;
                    self.step = step;
                    self.angles = angles;
                    return Ok(pose);
                }
                part *= 0.999;
            }
            if step == 0.0 {
                return Ok(*from);
            }
            step = if step < 1e-12 { 0.0 } else { 0.5 * step };
        }
    }
}
