//! Walking a curve at constant speed.

use nalgebra::Vector3;

/// A curve over `0 ..= 1`.
pub(super) trait Curve {
    /// The position, metres, and its derivative by the parameter, metres.
    fn at(&self, t: f64) -> (Vector3<f64>, Vector3<f64>);
}

/// The length of a curve from its start to each of many places.
pub(super) struct ArcLength<'a, C> {
    curve: &'a C,
    /// At parameter `i/cells`, metres; the last is the whole length.
    lengths: Vec<f64>,
}

impl<'a, C: Curve> ArcLength<'a, C> {
    /// Measures a curve in this many cells, each short enough for its speed to be a polynomial of degree 5.
    pub(super) fn new(curve: &'a C, cells: usize) -> Self {
        let mut lengths = Vec::with_capacity(cells + 1);
        let mut length = 0.0;
        lengths.push(length);
        for cell in 0..cells {
            length += piece(curve, cell as f64 / cells as f64, (cell + 1) as f64 / cells as f64);
            lengths.push(length);
        }
        Self { curve, lengths }
    }

    /// The parameter at which this fraction of the length is behind, for a fraction in `0 ..= 1`.
    pub(super) fn parameter(&self, fraction: f64) -> f64 {
        let cells = self.lengths.len() - 1;
        let wanted = fraction * self.lengths[cells];
        let cell = self.lengths.partition_point(|length| *length <= wanted).clamp(1, cells) - 1;
        let (low, high) = (cell as f64 / cells as f64, (cell + 1) as f64 / cells as f64);
        let (before, after) = (self.lengths[cell], self.lengths[cell + 1]);
        if after <= before {
            return low;
        }
        let rest = wanted - before;
        let mut t = low + (high - low) * (rest / (after - before)).min(1.0);
        // Newton's steps: two or three, and more beside a cusp, where the speed is nearly zero.
        for _ in 0..16 {
            let speed = self.curve.at(t).1.norm();
            if speed <= 0.0 {
                break;
            }
            let better = (t - (piece(self.curve, low, t) - rest) / speed).clamp(low, high);
            let moved = (better - t).abs();
            t = better;
            if moved < 1e-15 {
                break;
            }
        }
        t
    }
}

/// Length between two parameters by Gauss and Legendre's rule with three places.
fn piece(curve: &impl Curve, from: f64, to: f64) -> f64 {
    // √(3/5)
    const PLACE: f64 = 0.774_596_669_241_483_4;
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let speed = |place: f64| curve.at(middle + half * place).1.norm();
    half * (5.0 * (speed(-PLACE) + speed(PLACE)) + 8.0 * speed(0.0)) / 9.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `(t², 0, 0)`: its length is `t²`.
    struct Parabola;

    impl Curve for Parabola {
        fn at(&self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
            (Vector3::x() * (t * t), Vector3::x() * (2.0 * t))
        }
    }

    #[test]
    fn a_fraction_of_the_length_is_found() {
        let lengths = ArcLength::new(&Parabola, 64);
        for fraction in [0.0, 1e-6, 0.1, 0.25, 0.7, 1.0] {
            let found = lengths.parameter(fraction);
            // Of a whole length of 1 m.
            assert!((found * found - fraction).abs() < 1e-12, "{fraction}: {found}");
        }
    }
}
