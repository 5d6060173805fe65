//! An endless smooth curve through a box.

use nalgebra::Vector3;

use crate::simulate::Random;

/// A uniform cubic B-spline whose control points are drawn from a box as they are needed.
///
/// It stays in the box, for it stays in the hull of its control points, and its velocity and acceleration are
/// continuous.
pub(super) struct ControlPoints {
    random: Random,
    low: [f64; 3],
    high: [f64; 3],
    points: Vec<Vector3<f64>>,
}

impl ControlPoints {
    /// * `low`, `high` — opposite corners of the box, metres.
    pub(super) fn new(seed: u64, low: [f64; 3], high: [f64; 3]) -> Self {
        Self { random: Random::new(seed, "trajectory", 0), low, high, points: Vec::new() }
    }

    /// Position, metres, and derivative by the parameter, at a parameter of 0 or more.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most half a piece a frame"
    )]
    pub(super) fn at(&mut self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        let piece = t.floor() as usize;
        while self.points.len() < piece + 4 {
            let next = std::array::from_fn(|d| self.random.between(self.low[d], self.high[d]));
            self.points.push(Vector3::from(next));
        }
        let [a, b, c, d] = [0, 1, 2, 3].map(|offset| self.points[piece + offset]);
        let s = t - piece as f64;
        let r = 1.0 - s;
        let position = (a * (r * r * r)
            + b * (3.0 * s * s * s - 6.0 * s * s + 4.0)
            + c * (3.0 * r * r * r - 6.0 * r * r + 4.0)
            + d * (s * s * s))
            / 6.0;
        let velocity = (d - c) * (0.5 * s * s) + (b - a) * (0.5 * r * r) + (c - b) * (0.5 + s * r);
        (position, velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_curve_is_smooth_and_stays_in_its_box(seed: u64, t in 0.0..20.0_f64) {
            let mut curve = ControlPoints::new(seed, [-1.0, 2.0, 0.0], [3.0, 4.0, 0.5]);
            for t in [t, t.ceil()] {
                let (position, velocity) = curve.at(t);
                prop_assert!((-1.0..=3.0).contains(&position.x) && (2.0..=4.0).contains(&position.y));
                prop_assert!((0.0..=0.5).contains(&position.z));
                let small = 1e-4;
                let difference = (curve.at(t + small).0 - curve.at((t - small).max(0.0)).0)
                    / (t + small - (t - small).max(0.0));
                // Accelerations are below 20, and a difference at the start is one-sided.
                prop_assert!((difference - velocity).norm() < 20.0 * small);
            }
        }
    }
}
