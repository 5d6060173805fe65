//! Distortion of a lens.

use nalgebra::{Matrix2, Vector2};
use open_structure::structure::Distortion;

/// Steps of Newton's method in which a position is found again.
const STEPS: usize = 20;
/// Where that stops, in units of the focal length: 1e-9 px and less.
const CLOSE: f64 = 1e-13;

/// The model of Brown and Conrady with the coefficients that OpenCV uses.
///
/// `x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)`,
/// `y_d = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y`, for positions at z = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrownConrady {
    /// Radial terms k1, k2, k3.
    pub radial: [f64; 3],
    /// Tangential terms p1, p2.
    pub tangential: [f64; 2],
}

impl BrownConrady {
    /// A lens of the coefficients k1, k2, p1, p2, k3, in the order of OpenCV and of the registry.
    #[must_use]
    pub fn new([k1, k2, p1, p2, k3]: [f64; 5]) -> Self {
        Self { radial: [k1, k2, k3], tangential: [p1, p2] }
    }

    /// As the manifest says it.
    #[must_use]
    pub fn declared(&self) -> Distortion {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        Distortion { model: "brown-conrady".to_owned(), coefficients: vec![k1, k2, p1, p2, k3] }
    }

    /// Where a ray meets the plane z = 1 behind the lens.
    ///
    /// * `ideal` — where it meets that plane without a lens.
    #[must_use]
    pub fn distort(&self, ideal: Vector2<f64>) -> Vector2<f64> {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let (x, y) = (ideal.x, ideal.y);
        let r2 = ideal.norm_squared();
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        Vector2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    /// Where the ray of a distorted position would meet the plane z = 1 without the lens.
    ///
    /// Newton's method from the position itself; `None` where it does not arrive, far outside the images that the
    /// coefficients were found from, or where the lens folds the image over itself.
    #[must_use]
    pub fn undistort(&self, distorted: Vector2<f64>) -> Option<Vector2<f64>> {
        let mut ideal = distorted;
        for _ in 0..STEPS {
            let miss = self.distort(ideal) - distorted;
            let jacobian = self.jacobian(ideal);
            // Where the determinant is not positive, the lens has turned the image over.
            if jacobian.determinant() <= 0.0 {
                return None;
            }
            let step = jacobian.try_inverse()? * miss;
            ideal -= step;
            if step.amax() < CLOSE {
                return ideal.iter().all(|c| c.is_finite()).then_some(ideal);
            }
        }
        None
    }

    /// Whether the lens maps the neighbourhood of a position one to one, as it does within its field of view.
    #[must_use]
    pub fn is_regular(&self, ideal: Vector2<f64>) -> bool {
        // The radial factor has to grow all the way from the middle: beyond its turning point, positions come back.
        let [k1, k2, k3] = self.radial;
        let r2 = ideal.norm_squared();
        let slope = |r2: f64| 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3));
        (0..=16_u32).all(|step| slope(r2 * f64::from(step) / 16.0) > 0.0)
    }

    fn jacobian(&self, ideal: Vector2<f64>) -> Matrix2<f64> {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let (x, y) = (ideal.x, ideal.y);
        let r2 = ideal.norm_squared();
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        // Twice the derivative of the radial factor by r².
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let cross = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y;
        Matrix2::new(
            radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x,
            cross,
            cross,
            radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LENSES: [[f64; 5]; 2] =
        [[0.2624, -0.9531, -0.0054, 0.0026, 1.1633], [0.2312, -0.7849, -0.0033, -0.0001, 0.9172]];

    proptest! {
        #[test]
        fn a_position_comes_back_through_the_lens(which in 0..2_usize, x in -0.6..0.6, y in -0.48..0.48) {
            let lens = BrownConrady::new(LENSES[which]);
            let ideal = Vector2::new(x, y);
            prop_assert!(lens.is_regular(ideal));
            let found = lens.undistort(lens.distort(ideal)).unwrap();
            prop_assert!((found - ideal).amax() < 1e-12);
        }

        #[test]
        fn the_jacobian_is_that_of_differences(x in -0.6..0.6, y in -0.48..0.48) {
            let lens = BrownConrady::new(LENSES[0]);
            let (ideal, step) = (Vector2::new(x, y), 1e-6);
            let jacobian = lens.jacobian(ideal);
            for axis in 0..2 {
                let mut offset = Vector2::zeros();
                offset[axis] = step;
                let slope = (lens.distort(ideal + offset) - lens.distort(ideal - offset)) / (2.0 * step);
                prop_assert!((slope - jacobian.column(axis)).amax() < 1e-8);
            }
        }
    }
}
