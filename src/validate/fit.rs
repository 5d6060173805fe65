//! How well rows agree with their landmark, and with any landmark at all.
//!
//! For each landmark the normal equations of its rows at the claimed place are summed while the rows go by:
//! `Σ r²`, `g = Σ Jᵀr` and `H = Σ JᵀJ`. One Gauss-Newton step from there splits the sum of squares into what
//! moving the landmark would remove, `e = gᵀ H⁻¹ g`, and what is left as noise, `Σ r² − e`. Where the claim
//! is right, `e/σ²` is chi-squared with as many degrees of freedom as the landmark has (3 or 4), whatever the
//! parallax: the score test. So the noise is judged from `Σ r² − e`, to which a wrong landmark adds little, and
//! the landmark from `e`; no row is kept, and memory is bounded by the number of landmarks.

use nalgebra::{DMatrix, SMatrix, SVector, SymmetricEigen};

/// Directions in which the rows say less than this part of what they say in the best one are not judged.
const LEAST_INFORMATION: f64 = 1e-10;
/// Rows (views) that a landmark needs to be judged.
pub(crate) const LEAST_ROWS: u32 = 3;
/// Excess over sigma² above which a landmark is not where its rows say.
pub(crate) const MOST_EXCESS: f64 = 60.0;
/// Sigma under which residuals are not told from rounding, pixels.
pub(crate) const SIGMA_FLOOR_PX: f64 = 0.5;

/// Sums over the rows of one landmark with `N` degrees of freedom.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fit<const N: usize> {
    /// Rows summed.
    pub(crate) rows: u32,
    /// Rows in which the landmark has no image: it lies behind the camera.
    pub(crate) behind: u32,
    /// Rows that are taken for declared outliers, and not summed.
    pub(crate) wild: u32,
    squares: f64,
    gradient: SVector<f64, N>,
    /// Upper triangle alone.
    hessian: SMatrix<f64, N, N>,
}

impl<const N: usize> Default for Fit<N> {
    fn default() -> Self {
        Self {
            rows: 0,
            behind: 0,
            wild: 0,
            squares: 0.0,
            gradient: SVector::zeros(),
            hessian: SMatrix::zeros(),
        }
    }
}

impl<const N: usize> Fit<N> {
    /// Adds one row: two residuals in pixels with their derivatives by the landmark.
    #[inline]
    pub(crate) fn add(&mut self, residuals: [f64; 2], derivatives: &[SVector<f64, N>; 2]) {
        self.rows += 1;
        for (residual, derivative) in residuals.into_iter().zip(derivatives) {
            self.squares += residual * residual;
            for row in 0..N {
                self.gradient[row] += residual * derivative[row];
                for column in row..N {
                    self.hessian[(row, column)] += derivative[row] * derivative[column];
                }
            }
        }
    }

    /// Adds a row in which the landmark has no image.
    #[inline]
    pub(crate) fn add_behind(&mut self) {
        self.behind += 1;
    }

    /// Adds a row that is taken for a declared outlier.
    #[inline]
    pub(crate) fn add_wild(&mut self) {
        self.wild += 1;
    }

    /// What the sums say; `None` when there are too few rows or numbers that are not finite.
    pub(crate) fn evaluate(&self) -> Option<Evaluation<N>> {
        if self.rows < LEAST_ROWS || !self.squares.is_finite() {
            return None;
        }
        // Scaled to a unit diagonal, so that metres and radians may stand side by side.
        let scale = SVector::<f64, N>::from_fn(|row, _| {
            let entry = self.hessian[(row, row)];
            if entry > 0.0 { entry.sqrt().recip() } else { 0.0 }
        });
        let scaled = DMatrix::from_fn(N, N, |row, column| {
            let upper = self.hessian[(row.min(column), row.max(column))];
            upper * scale[row] * scale[column]
        });
        let gradient = self.gradient.component_mul(&scale);
        if !scaled.iter().chain(gradient.iter()).all(|number| number.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 200)?;
        let largest = eigen.eigenvalues.max();
        let (mut excess, mut step, mut rank) = (0.0, SVector::<f64, N>::zeros(), 0_u32);
        for (index, value) in eigen.eigenvalues.iter().enumerate() {
            if *value <= LEAST_INFORMATION * largest {
                continue;
            }
            let along: f64 = (0..N).map(|row| eigen.eigenvectors[(row, index)] * gradient[row]).sum();
            excess += along * along / value;
            rank += 1;
            for row in 0..N {
                step[row] -= eigen.eigenvectors[(row, index)] * along / value;
            }
        }
        // Rounding may find a little more than there is.
        let excess = f64::min(excess, self.squares);
        let freedom = f64::from(2 * self.rows) - f64::from(rank);
        (freedom > 0.0 && excess.is_finite()).then(|| Evaluation {
            rows: self.rows,
            squares: self.squares,
            excess,
            freedom,
            step: step.component_mul(&scale),
        })
    }
}

/// What the rows of one landmark say.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evaluation<const N: usize> {
    /// Rows.
    pub(crate) rows: u32,
    /// Sum of squared residuals at the claimed place, square pixels.
    pub(crate) squares: f64,
    /// What moving the landmark would remove of it, square pixels.
    pub(crate) excess: f64,
    /// Degrees of freedom of what is left.
    pub(crate) freedom: f64,
    /// The step that would remove it.
    pub(crate) step: SVector<f64, N>,
}

impl<const N: usize> Evaluation<N> {
    /// Variance of what is left, square pixels.
    pub(crate) fn variance(&self) -> f64 {
        ((self.squares - self.excess) / self.freedom).max(0.0)
    }

    /// Excess over the variance of one residual: `sigma_px`, or what is left where that is more, so that one
    /// wild row does not speak against its landmark.
    pub(crate) fn chi2(&self, sigma_px: f64) -> f64 {
        self.excess / self.variance().max(sigma_px * sigma_px)
    }

    /// Root mean square of the residuals, at the claimed place and after the step, pixels.
    pub(crate) fn rms_px(&self) -> [f64; 2] {
        [self.squares, self.squares - self.excess].map(|squares| (squares / f64::from(2 * self.rows)).sqrt())
    }
}

/// The sigma that most landmarks agree on, pixels: the median of what is left, weighted by degrees of freedom.
///
/// A median, so that landmarks whose rows hold something wild do not count; each variance is first divided by
/// the median of its chi-squared distribution (Wilson and Hilferty).
pub(crate) fn common_sigma<const N: usize>(evaluations: &[Option<Evaluation<N>>]) -> Option<f64> {
    let mut variances: Vec<(f64, f64)> = evaluations
        .iter()
        .flatten()
        .map(|found| {
            let median = (1.0 - 2.0 / (9.0 * found.freedom)).powi(3);
            (found.variance() / median, found.freedom)
        })
        .collect();
    variances.sort_by(|left, right| left.0.total_cmp(&right.0));
    let half = 0.5 * variances.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut sum = 0.0;
    variances
        .iter()
        .find(|(_, weight)| {
            sum += weight;
            sum >= half
        })
        .map(|(variance, _)| variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// Deterministic numbers between −1 and 1.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = super::super::mix::mix(state);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    fn fit(rows: usize, shift: Vector3<f64>, amplitude: f64, seed: u64) -> Fit<3> {
        let mut random = noise(seed);
        let mut fit = Fit::<3>::default();
        for _ in 0..rows {
            let derivatives = [0, 1].map(|_| Vector3::from_fn(|_, _| 100.0 * random()));
            let residuals = derivatives.map(|derivative| derivative.dot(&shift) + amplitude * random());
            fit.add(residuals, &derivatives);
        }
        fit
    }

    #[test]
    fn a_shift_is_told_from_noise_exactly_where_the_problem_is_linear() {
        let shift = Vector3::new(0.3, -0.2, 0.1);
        let found = fit(20, shift, 0.0, 1).evaluate().unwrap();
        assert!((found.step + shift).norm() < 1e-12, "{}", found.step);
        assert!((found.squares - found.excess).abs() < 1e-9 * found.squares);
        // Uniform noise in −a..a has variance a²/3; the shift does not change what is left of it.
        let (still, moved) = (fit(400, Vector3::zeros(), 1.5, 2), fit(400, shift, 1.5, 2));
        let (still, moved) = (still.evaluate().unwrap(), moved.evaluate().unwrap());
        assert!((still.variance() - moved.variance()).abs() < 1e-9);
        assert!((still.variance() - 0.75).abs() < 0.1, "{}", still.variance());
        assert!(still.chi2(0.5) < 16.0 && moved.chi2(0.5) > MOST_EXCESS);
    }

    #[test]
    fn one_wild_row_does_not_speak_against_its_landmark() {
        let mut fit = fit(20, Vector3::zeros(), 0.1, 3);
        fit.add([300.0, -200.0], &[Vector3::new(90.0, 5.0, 3.0), Vector3::new(-7.0, 80.0, 20.0)]);
        let found = fit.evaluate().unwrap();
        assert!(found.excess > MOST_EXCESS * 0.25, "the row does pull: {}", found.excess);
        assert!(found.chi2(0.5) < MOST_EXCESS, "{}", found.chi2(0.5));
    }

    #[test]
    fn directions_without_information_are_not_judged() {
        let mut fit = Fit::<3>::default();
        for _ in 0..5 {
            fit.add([1.0, 0.0], &[Vector3::new(1.0, 1.0, 0.0), Vector3::new(1.0, 1.0, 0.0)]);
        }
        let found = fit.evaluate().unwrap();
        assert!((found.freedom - 9.0).abs() < 1e-12);
        assert!((found.excess - 2.5).abs() < 1e-9, "{}", found.excess);
        assert!(Fit::<3>::default().evaluate().is_none());
    }

    #[test]
    fn the_common_sigma_does_not_see_a_few_wild_landmarks() {
        let amplitude = 3.0_f64.sqrt();
        let mut evaluations: Vec<_> =
            (0..300).map(|seed| fit(8, Vector3::zeros(), amplitude, 100 + seed).evaluate()).collect();
        let before = common_sigma(&evaluations).unwrap();
        assert!((before - 1.0).abs() < 0.05, "{before}");
        evaluations.extend((0..30).map(|seed| fit(8, Vector3::zeros(), 40.0, 900 + seed).evaluate()));
        let after = common_sigma(&evaluations).unwrap();
        assert!((after - before).abs() < 0.05, "{after}");
        assert_eq!(common_sigma::<3>(&[]), None);
    }
}
