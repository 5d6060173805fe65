//! Radial distortion with two coefficients, and its inverse.

/// Steps after which an inverse has all its digits, bisection alone included.
const MOST_STEPS: usize = 200;

/// `p ↦ r(p) p`, `r(p) = 1 + k1 |p|² + k2 |p|⁴`, of a position at z = 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Radial(pub(super) [f64; 2]);

impl Radial {
    /// Whether it does nothing.
    pub(super) fn is_none(self) -> bool {
        self.0 == [0.0; 2]
    }

    /// Where an ideal position appears.
    pub(super) fn distort(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [k1, k2] = self.0;
        let squared = x * x + y * y;
        let factor = 1.0 + squared * (k1 + squared * k2);
        [factor * x, factor * y]
    }

    /// `∂(r p)/∂p = r I + (2 k1 + 4 k2 |p|²) p pᵀ`: the entries xx, xy, yy.
    pub(super) fn jacobian(self, [x, y]: [f64; 2]) -> [f64; 3] {
        let [k1, k2] = self.0;
        let squared = x * x + y * y;
        let factor = 1.0 + squared * (k1 + squared * k2);
        let slope = 2.0 * k1 + 4.0 * squared * k2;
        [factor + slope * x * x, slope * x * y, factor + slope * y * y]
    }

    /// `JᵀJ` of the derivative `J`: the weight, at an ideal position, of a pixel that was seen with weight 1; xx, xy, yy.
    pub(super) fn weight(self, at: [f64; 2]) -> [f64; 3] {
        let [a, b, c] = self.jacobian(at);
        [a * a + b * b, b * (a + c), b * b + c * c]
    }

    /// The ideal position of one that is seen; `None` where the lens sends none there.
    ///
    /// The radius is sought where the distortion still grows with it: beyond, one pixel has several positions.
    pub(super) fn undistort(self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let seen = (x * x + y * y).sqrt();
        if self.is_none() || seen == 0.0 {
            return Some([x, y]);
        }
        let [k1, k2] = self.0;
        let at = |radius: f64| {
            let squared = radius * radius;
            radius * (1.0 + squared * (k1 + squared * k2))
        };
        let (mut low, mut high) = (0.0, self.turning_radius());
        if high.is_infinite() {
            high = seen.max(f64::MIN_POSITIVE);
            while at(high) < seen {
                high *= 2.0;
                if !at(high).is_finite() {
                    return None;
                }
            }
        }
        if at(high).is_nan() || at(high) < seen {
            return None;
        }
        let mut radius = seen.min(high);
        for _ in 0..MOST_STEPS {
            let error = at(radius) - seen;
            if error == 0.0 {
                break;
            }
            if error < 0.0 {
                low = radius;
            } else {
                high = radius;
            }
            let squared = radius * radius;
            let newton = radius - error / (1.0 + squared * (3.0 * k1 + squared * 5.0 * k2));
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if next == radius {
                break;
            }
            radius = next;
        }
        let scale = radius / seen;
        Some([x * scale, y * scale])
    }

    /// The smallest radius at which the distorted radius no longer grows; infinite where there is none.
    fn turning_radius(self) -> f64 {
        // 1 + 3 k1 x + 5 k2 x² = 0 in x = radius².
        let [b, a] = [3.0 * self.0[0], 5.0 * self.0[1]];
        let roots = if a == 0.0 {
            [-1.0 / b, f64::INFINITY]
        } else {
            let discriminant = b * b - 4.0 * a;
            if discriminant < 0.0 {
                return f64::INFINITY;
            }
            let half = -0.5 * (b + b.signum() * discriminant.sqrt());
            [half / a, 1.0 / half]
        };
        let smallest = roots.into_iter().filter(|root| *root > 0.0).fold(f64::INFINITY, f64::min);
        smallest.sqrt()
    }
}
