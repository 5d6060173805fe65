//! Cubic splines through values, twice continuously differentiable.

/// A cubic spline through values of `D` numbers at rising knots.
pub(super) struct CubicSpline<const D: usize> {
    knots: Vec<f64>,
    values: Vec<[f64; D]>,
    /// Second derivatives at the knots.
    seconds: Vec<[f64; D]>,
}

impl<const D: usize> CubicSpline<D> {
    /// The natural spline, without curvature at its ends; at least two knots, rising.
    pub(super) fn open(knots: Vec<f64>, values: Vec<[f64; D]>) -> Self {
        let inner = knots.len() - 2;
        let mut system = Tridiagonal::with_capacity(inner);
        for i in 1..=inner {
            let (before, after) = (knots[i] - knots[i - 1], knots[i + 1] - knots[i]);
            system.push(before, after, kink(&values[i - 1], &values[i], &values[i + 1], before, after));
        }
        let mut seconds = vec![[0.0; D]];
        seconds.extend(system.solve());
        seconds.push([0.0; D]);
        Self { knots, values, seconds }
    }

    /// The periodic spline: the last value is the first again, and slope and curvature are the same there. At least four knots.
    pub(super) fn closed(knots: Vec<f64>, values: Vec<[f64; D]>) -> Self {
        let count = knots.len() - 1;
        let step = |i: usize| knots[i + 1] - knots[i];
        let mut system = Tridiagonal::with_capacity(count);
        for i in 0..count {
            let before = (i + count - 1) % count;
            let (back, ahead) = (step(before), step(i));
            system.push(back, ahead, kink(&values[before], &values[i], &values[i + 1], back, ahead));
        }
        let mut seconds = system.solve_cyclic();
        seconds.push(seconds[0]);
        Self { knots, values, seconds }
    }

    /// The last knot.
    pub(super) fn end(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    /// The number of pieces.
    pub(super) fn pieces(&self) -> usize {
        self.knots.len() - 1
    }

    /// The value and its derivative; beyond the knots the outer pieces go on.
    pub(super) fn at(&self, u: f64) -> ([f64; D], [f64; D]) {
        let i = self.knots.partition_point(|knot| *knot <= u).clamp(1, self.pieces()) - 1;
        let step = self.knots[i + 1] - self.knots[i];
        let (a, b) = ((self.knots[i + 1] - u) / step, (u - self.knots[i]) / step);
        let sixth = step * step / 6.0;
        let mut value = [0.0; D];
        let mut slope = [0.0; D];
        for d in 0..D {
            let (low, high) = (self.values[i][d], self.values[i + 1][d]);
            let (bend_low, bend_high) = (self.seconds[i][d], self.seconds[i + 1][d]);
            value[d] =
                a * low + b * high + ((a * a * a - a) * bend_low + (b * b * b - b) * bend_high) * sixth;
            slope[d] = (high - low) / step
                + ((3.0 * b * b - 1.0) * bend_high - (3.0 * a * a - 1.0) * bend_low) * step / 6.0;
        }
        (value, slope)
    }
}

/// Six times the change of slope at a value between two others.
fn kink<const D: usize>(
    before: &[f64; D],
    here: &[f64; D],
    after: &[f64; D],
    back: f64,
    ahead: f64,
) -> [f64; D] {
    std::array::from_fn(|d| 6.0 * ((after[d] - here[d]) / ahead - (here[d] - before[d]) / back))
}

/// Rows `before·x₋₁ + 2 (before + after)·x + after·x₊₁ = right`.
struct Tridiagonal<const D: usize> {
    rows: Vec<(f64, f64, f64, [f64; D])>,
}

impl<const D: usize> Tridiagonal<D> {
    fn with_capacity(rows: usize) -> Self {
        Self { rows: Vec::with_capacity(rows) }
    }

    fn push(&mut self, before: f64, after: f64, right: [f64; D]) {
        self.rows.push((before, 2.0 * (before + after), after, right));
    }

    /// Elimination without pivots: the rows are diagonally dominant.
    fn solve(&self) -> Vec<[f64; D]> {
        let mut solved: Vec<[f64; D]> = Vec::with_capacity(self.rows.len());
        let mut factors: Vec<f64> = Vec::with_capacity(self.rows.len());
        for (i, (before, middle, after, right)) in self.rows.iter().enumerate() {
            let (pivot, from) = match i.checked_sub(1) {
                None => (*middle, [0.0; D]),
                Some(above) => (middle - before * factors[above], solved[above]),
            };
            factors.push(after / pivot);
            solved.push(std::array::from_fn(|d| {
                (right[d] - if i == 0 { 0.0 } else { before * from[d] }) / pivot
            }));
        }
        for i in (1..self.rows.len()).rev() {
            let below = solved[i];
            for d in 0..D {
                solved[i - 1][d] -= factors[i - 1] * below[d];
            }
        }
        solved
    }

    /// The same where the first row reaches back to the last and the last on to the first (Sherman and Morrison).
    fn solve_cyclic(mut self) -> Vec<[f64; D]> {
        let last = self.rows.len() - 1;
        let (back, on) = (self.rows[0].0, self.rows[last].2);
        let gamma = -self.rows[0].1;
        self.rows[0].1 -= gamma;
        self.rows[last].1 -= on * back / gamma;
        let mut solved = self.solve();
        for row in &mut self.rows {
            row.3 = [0.0; D];
        }
        self.rows[0].3 = [gamma; D];
        self.rows[last].3 = [on; D];
        let correction = self.solve();
        let ratio = back / gamma;
        let below = 1.0 + correction[0][0] + ratio * correction[last][0];
        let factor: [f64; D] = std::array::from_fn(|d| (solved[0][d] + ratio * solved[last][d]) / below);
        for (solved, correction) in solved.iter_mut().zip(&correction) {
            for d in 0..D {
                solved[d] -= factor[d] * correction[d];
            }
        }
        solved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn knots_and_values(fewest: usize) -> impl Strategy<Value = (Vec<f64>, Vec<[f64; 2]>)> {
        prop::collection::vec((0.2..3.0_f64, prop::array::uniform2(-5.0..5.0_f64)), fewest..12).prop_map(
            |rows| {
                let knots = rows.iter().scan(0.0, |knot, (step, _)| {
                    *knot += step;
                    Some(*knot)
                });
                let knots = knots.collect();
                (knots, rows.into_iter().map(|(_, value)| value).collect())
            },
        )
    }

    /// Value, slope and second derivative (by differences of the slope) just beside a knot.
    fn beside(spline: &CubicSpline<2>, u: f64, side: f64) -> [[f64; 2]; 3] {
        let small = 1e-6 * side;
        let (value, slope) = spline.at(u + small);
        let (_, further) = spline.at(u + 2.0 * small);
        [value, slope, [0, 1].map(|d| (further[d] - slope[d]) / small)]
    }

    proptest! {
        #[test]
        fn a_spline_goes_through_its_values_without_a_kink((knots, values) in knots_and_values(2)) {
            let spline = CubicSpline::open(knots.clone(), values.clone());
            for (knot, value) in knots.iter().zip(&values) {
                let found = spline.at(*knot).0;
                prop_assert!((0..2).all(|d| (found[d] - value[d]).abs() < 1e-11));
                let (left, right) = (beside(&spline, *knot, -1.0), beside(&spline, *knot, 1.0));
                // Derivatives reach 1e3 with knots this near; beside a knot they are 4e-6 apart.
                prop_assert!((0..2).all(|d| (left[1][d] - right[1][d]).abs() < 0.01));
                prop_assert!((0..2).all(|d| (left[2][d] - right[2][d]).abs() < 0.1), "{left:?} {right:?}");
            }
        }

        #[test]
        fn a_closed_spline_has_no_kink_at_its_seam((knots, mut values) in knots_and_values(4)) {
            let last = values.len() - 1;
            values[last] = values[0];
            let spline = CubicSpline::closed(knots.clone(), values.clone());
            for (knot, value) in knots.iter().zip(&values) {
                let found = spline.at(*knot).0;
                prop_assert!((0..2).all(|d| (found[d] - value[d]).abs() < 1e-11));
            }
            let (left, right) = (beside(&spline, spline.end(), -1.0), beside(&spline, knots[0], 1.0));
            prop_assert!((0..2).all(|d| (left[1][d] - right[1][d]).abs() < 0.01));
            prop_assert!((0..2).all(|d| (left[2][d] - right[2][d]).abs() < 0.1), "{left:?} {right:?}");
        }
    }

    #[test]
    fn two_values_make_a_straight_line() {
        let spline = CubicSpline::open(vec![0.0, 2.0], vec![[1.0], [5.0]]);
        assert_eq!(spline.at(0.5), ([2.0], [2.0]));
    }
}
