//! Small dense least squares: normal equations and a damped Gauss-Newton iteration over them.

use nalgebra::{Const, SMatrix, SVector};

/// Steps tried at most; an ordinary problem needs three to six.
const MOST_STEPS: usize = 50;

/// A step that changes the residuals by less than this (their unit is the pixel) is the last one.
const LEAST_STEP_PX: f64 = 1e-10;

/// Damping at the start, relative to the diagonal, and where the iteration gives up.
const DAMPING: f64 = 1e-6;
const MOST_DAMPING: f64 = 1e8;

/// Sums over all residuals `r` with derivatives `J`: `½ rᵀr`, `Jᵀr` and `JᵀJ`, which is all that is kept of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Normal<const N: usize> {
    /// `½ Σ r²`.
    pub(super) cost: f64,
    /// `Σ r ∂r`, the derivative of the cost.
    pub(super) gradient: SVector<f64, N>,
    /// `Σ ∂r ∂rᵀ`.
    pub(super) hessian: SMatrix<f64, N, N>,
}

impl<const N: usize> Normal<N> {
    /// No residual yet.
    pub(super) fn new() -> Self {
        Self { cost: 0.0, gradient: SVector::zeros(), hessian: SMatrix::zeros() }
    }

    /// Adds one residual with its derivative by the parameters.
    pub(super) fn add(&mut self, residual: f64, derivative: &SVector<f64, N>) {
        self.cost += 0.5 * residual * residual;
        // Written out, for BLAS's shape is a call for each column of three entries or six.
        for column in 0..N {
            self.gradient[column] += residual * derivative[column];
            for row in 0..N {
                self.hessian[(row, column)] += derivative[column] * derivative[row];
            }
        }
    }

    /// Solves `(H + damping · diag H) δ = −g`; gives `δ` and `√(δᵀ diag(H) δ)`, the size of the step in units of the residual.
    ///
    /// `None` where a parameter has no effect, the system is singular, or a number is not finite.
    pub(super) fn step(&self, damping: f64) -> Option<(SVector<f64, N>, f64)> {
        // Scaled to a unit diagonal, so that metres and radians may stand side by side.
        let scale = self.hessian.diagonal().map(|entry| 1.0 / entry.sqrt());
        if !scale.iter().all(|entry| entry.is_finite() && *entry > 0.0) {
            return None;
        }
        let mut system = self.hessian;
        for row in 0..N {
            for column in 0..N {
                system[(row, column)] *= scale[row] * scale[column];
            }
            system[(row, row)] += damping;
        }
        let solution = nalgebra::linalg::Cholesky::<f64, Const<N>>::new(system)?
            .solve(&-self.gradient.component_mul(&scale));
        let size = solution.norm();
        size.is_finite().then(|| (solution.component_mul(&scale), size))
    }
}

/// Walks from `start` to the nearest least cost (Levenberg-Marquardt).
///
/// * `normal` — the normal equations at a place; `None` where it is not allowed.
/// * `moved` — the place after a step.
///
/// Gives the best place found, with its normal equations; `None` when the start is not allowed or the problem has no solution there.
pub(super) fn minimise<P: Clone, const N: usize>(
    start: P,
    normal: impl Fn(&P) -> Option<Normal<N>>,
    moved: impl Fn(&P, &SVector<f64, N>) -> P,
) -> Option<(P, Normal<N>)> {
    let (mut damping, mut growth) = (DAMPING, 4.0);
    let (mut place, mut here) = (start.clone(), normal(&start)?);
    if !here.cost.is_finite() {
        return None;
    }
    for _ in 0..MOST_STEPS {
        let Some((step, size)) = here.step(damping) else {
            // Singular up to rounding: damping may still help.
            if !here.hessian.iter().all(|entry| entry.is_finite()) || damping >= MOST_DAMPING {
                return None;
            }
            damping = (damping * 100.0).max(1e-12);
            continue;
        };
        let candidate = moved(&place, &step);
        let promised = 0.5 * (damping * size * size - step.dot(&here.gradient));
        match normal(&candidate) {
            Some(there) if there.cost <= here.cost => {
                let gain = here.cost - there.cost;
                let done = size < LEAST_STEP_PX || gain <= 1e-15 * here.cost;
                (place, here) = (candidate, there);
                if done {
                    break;
                }
                // Nielsen's rule: the nearer the gain to what was promised, the less damping.
                damping *= (1.0 - (2.0 * gain / promised - 1.0).powi(3)).clamp(0.05, 2.0);
                growth = 4.0;
            }
            _ => {
                // Near the end rounding decides whether the cost falls; what the step promised says that it is the end.
                if size < LEAST_STEP_PX || promised <= 1e-13 * here.cost || damping >= MOST_DAMPING {
                    break;
                }
                damping = (damping * growth).max(DAMPING);
                growth *= 2.0;
            }
        }
    }
    Some((place, here))
}

/// Holds the gradient of `normal` at `place` against central differences of its cost, relative to the largest entry.
#[cfg(test)]
pub(super) fn gradient_error<P, const N: usize>(
    place: &P,
    normal: impl Fn(&P) -> Option<Normal<N>>,
    moved: impl Fn(&P, &SVector<f64, N>) -> P,
    step: f64,
) -> f64 {
    let gradient = normal(place).unwrap().gradient;
    let differences = SVector::<f64, N>::from_fn(|row, _| {
        let mut delta = SVector::<f64, N>::zeros();
        delta[row] = step;
        let (after, before) = (normal(&moved(place, &delta)), normal(&moved(place, &-delta)));
        (after.unwrap().cost - before.unwrap().cost) / (2.0 * step)
    });
    (gradient - differences).amax() / gradient.amax()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    /// Rosenbrock's valley as two residuals: least (0) at (1, 1), along a curved floor.
    #[expect(clippy::unnecessary_wraps, reason = "the shape `minimise` asks for")]
    fn valley(place: &Vector2<f64>) -> Option<Normal<2>> {
        let mut normal = Normal::new();
        normal.add(10.0 * (place.y - place.x * place.x), &Vector2::new(-20.0 * place.x, 10.0));
        normal.add(1.0 - place.x, &Vector2::new(-1.0, 0.0));
        Some(normal)
    }

    #[test]
    fn a_curved_valley_is_walked_to_its_end() {
        let (place, end) = minimise(Vector2::new(-1.2, 1.0), valley, |p, step| p + step).unwrap();
        assert!((place - Vector2::new(1.0, 1.0)).norm() < 1e-12, "{place}");
        assert!(end.cost < 1e-24);
    }

    #[test]
    fn the_gradient_of_the_valley_is_its_derivative() {
        assert!(gradient_error(&Vector2::new(0.3, -0.7), valley, |p, step| p + step, 1e-5) < 1e-8);
    }

    #[test]
    fn a_parameter_without_effect_is_no_problem_to_solve() {
        let flat = |place: &Vector2<f64>| {
            let mut normal = Normal::<2>::new();
            normal.add(place.x - 1.0, &Vector2::new(1.0, 0.0));
            Some(normal)
        };
        assert!(minimise(Vector2::zeros(), flat, |p, step| p + step).is_none());
        let nowhere = |_: &Vector2<f64>| None::<Normal<2>>;
        assert!(minimise(Vector2::zeros(), nowhere, |p, step| p + step).is_none());
        let not_finite = |_: &Vector2<f64>| {
            let mut normal = Normal::<2>::new();
            normal.add(f64::NAN, &Vector2::new(1.0, 1.0));
            Some(normal)
        };
        assert!(minimise(Vector2::zeros(), not_finite, |p, step| p + step).is_none());
    }
}
