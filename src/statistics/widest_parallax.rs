//! The widest angle between two rays to the same landmark.

use nalgebra::Vector3;

use crate::structure::angle;

/// The widest angle found among the rays to one landmark; three rays are kept, however many come.
#[derive(Clone, Copy, Debug)]
pub(super) struct WidestParallax {
    first: Vector3<f64>,
    pair: [Vector3<f64>; 2],
    widest: f64,
}

impl WidestParallax {
    /// A landmark with one ray.
    pub(super) fn new(ray: Vector3<f64>) -> Self {
        Self { first: ray, pair: [ray, ray], widest: 0.0 }
    }

    /// Adds a ray: holds it against the first one and the two that are farthest apart so far.
    ///
    /// At least half of the widest angle is found, by the triangle inequality with the first ray; all of it where the
    /// rays go one way, as those of a camera that passes by do.
    pub(super) fn add(&mut self, ray: Vector3<f64>) {
        for other in [self.first, self.pair[0], self.pair[1]] {
            let angle = angle(&other, &ray);
            if angle > self.widest {
                self.widest = angle;
                self.pair = [other, ray];
            }
        }
    }

    /// The widest angle, radians.
    pub(super) const fn widest(&self) -> f64 {
        self.widest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn widest(rays: &[Vector3<f64>]) -> f64 {
        let mut found = WidestParallax::new(rays[0]);
        rays.iter().for_each(|ray| found.add(*ray));
        found.widest()
    }

    proptest! {
        #[test]
        fn at_least_half_of_the_widest_angle_is_found(
            shifts in prop::collection::vec(prop::array::uniform2(-2.0..2.0_f64), 1..20),
        ) {
            let rays: Vec<_> = shifts.iter().map(|[x, y]| Vector3::new(*x, *y, 1.0)).collect();
            let pairs = rays.iter().flat_map(|one| rays.iter().map(|other| angle(one, other)));
            let all = pairs.fold(0.0, f64::max);
            let found = widest(&rays);
            prop_assert!(found <= all && found >= 0.5 * all - 1e-12, "{found} of {all}");
        }

        #[test]
        fn a_camera_that_passes_by_shows_the_whole_angle(begin in -3.0..0.0_f64, step in 0.01..0.5_f64) {
            let rays: Vec<_> = (0..20).map(|k| Vector3::new(begin + step * f64::from(k), 0.0, 1.0)).collect();
            prop_assert_eq!(widest(&rays), angle(&rays[0], &rays[19]));
        }
    }
}
