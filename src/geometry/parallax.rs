//! The widest angle among many directions.

/// Under this parallax (radians) depth is rounding.
pub(super) const LEAST_PARALLAX: f64 = 1e-6;

/// Whether the cameras are at more than one place; nearer than rounding they count as one.
///
/// * `spread` — largest distance of a camera from the first, metres; `offset` — of the first from the origin.
pub(super) fn is_one_place(spread: f64, offset: f64) -> bool {
    // NaN is no spread either.
    spread.is_nan() || spread <= 1e-12 * (1.0 + offset)
}

/// The widest angle between any two of the views, as far as sweeps find it.
///
/// Goes from a view to the one at the widest angle to it, and on from there while the angle grows: a few passes instead of all pairs. At
/// least half of the true maximum by the triangle inequality; the maximum itself where the directions lie in a plane.
pub(super) fn widest_angle<T: Copy>(
    views: &(impl Iterator<Item = T> + Clone),
    angle: impl Fn(T, T) -> f64,
) -> f64 {
    let mut widest = 0.0;
    let mut from = views.clone().next();
    while let Some(here) = from.take() {
        for there in views.clone() {
            let angle = angle(here, there);
            if angle > widest {
                widest = angle;
                from = Some(there);
            }
        }
    }
    widest
}

#[cfg(test)]
mod tests {
    use super::super::direction::angle;
    use super::super::strategies::vector;
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn sweeps_find_at_least_half_of_the_widest_angle(
            shifts in prop::collection::vec(vector(1.0), 1..20),
        ) {
            let rays: Vec<_> = shifts.into_iter().map(|shift| Vector3::z() * 2.0 + shift).collect();
            let mut all = 0.0_f64;
            for a in &rays {
                for b in &rays {
                    all = all.max(angle(a, b));
                }
            }
            let found = widest_angle(&rays.iter(), angle);
            prop_assert!(found <= all && found >= 0.5 * all);
        }

        #[test]
        fn sweeps_find_the_widest_angle_in_a_plane(turns in prop::collection::vec(0.0..1.5, 2..20)) {
            let rays: Vec<_> = turns.iter().map(|turn: &f64| Vector3::new(turn.cos(), turn.sin(), 0.0)).collect();
            let (low, high) = turns.iter().fold((9.0_f64, 0.0_f64), |(low, high), t| (low.min(*t), high.max(*t)));
            let found = widest_angle(&rays.iter(), angle);
            prop_assert!((found - (high - low)).abs() < 1e-14);
        }
    }

    #[test]
    fn no_direction_has_no_angle() {
        assert!(widest_angle(&std::iter::empty::<()>(), |(), ()| 1.0).abs() < f64::MIN_POSITIVE);
    }
}
