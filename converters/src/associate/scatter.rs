//! Points summed up for the line through them.

use nalgebra::linalg::SymmetricEigen;
use nalgebra::{Matrix3, Point3, Vector3};

/// Weight, mean and second moments of points: all that the line of least weighted squares needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    weight: f64,
    mean: Point3<f64>,
    /// Weighted sum of squares about the mean.
    moments: Matrix3<f64>,
}

impl Scatter {
    /// One point.
    #[must_use]
    pub fn point(point: Point3<f64>, weight: f64) -> Self {
        Self { weight, mean: point, moments: Matrix3::zeros() }
    }

    /// The points of both; exact about the mean, wherever the origin is.
    #[must_use]
    pub fn joined(&self, other: &Self) -> Self {
        let weight = self.weight + other.weight;
        let part = other.weight / weight;
        let apart = other.mean - self.mean;
        let shift = apart * apart.transpose() * (self.weight * part);
        Self { weight, mean: self.mean + apart * part, moments: self.moments + other.moments + shift }
    }

    /// Points of one weighted sum.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = (Point3<f64>, f64)>) -> Option<Self> {
        points
            .into_iter()
            .map(|(point, weight)| Self::point(point, weight))
            .reduce(|sum, point| sum.joined(&point))
    }

    /// The mean of the points.
    #[must_use]
    pub fn mean(&self) -> Point3<f64> {
        self.mean
    }

    /// The sum of the weights.
    #[must_use]
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Direction of the line of least weighted squares, which passes through the mean, and the weighted root mean square of
    /// the distances from it, metres.
    ///
    /// * `towards` — says which of both signs is meant.
    ///
    /// `None` for points all at one place, or numbers that are not finite.
    #[must_use]
    pub fn line(&self, towards: &Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
        let direction = Self::principal(&self.moments)?;
        let direction = if direction.dot(towards) < 0.0 { -direction } else { direction };
        let along = direction.dot(&(self.moments * direction));
        let rest = (self.moments.trace() - along).max(0.0) / self.weight;
        Some((direction, rest.sqrt()))
    }

    /// The eigenvector of the largest eigenvalue of a sum of squares, of unit length; `None` for zero, or what is not finite.
    pub(super) fn principal(moments: &Matrix3<f64>) -> Option<Vector3<f64>> {
        let largest = moments.amax();
        if !(largest > 0.0 && largest.is_finite() && moments.iter().all(|moment| moment.is_finite())) {
            return None;
        }
        let eigen = SymmetricEigen::try_new(moments / largest, f64::EPSILON, 200)?;
        let direction = eigen.eigenvectors.column(eigen.eigenvalues.imax()).normalize();
        direction.iter().all(|c| c.is_finite()).then_some(direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use open_structure::geometry::fit_line;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn parts_joined_in_any_way_are_the_fit_of_all(
            points in prop::collection::vec(prop::array::uniform3(-3.0..3.0), 4..30), at in any::<prop::sample::Index>(),
            away in prop::array::uniform3(-1e3..1e3),
        ) {
            let points: Vec<_> = points.into_iter().map(|p| Point3::from(p) + Vector3::from(away)).collect();
            let whole = fit_line(&points).unwrap();
            let cut = 1 + at.index(points.len() - 1);
            let of = |part: &[Point3<f64>]| Scatter::of(part.iter().map(|point| (*point, 2.0))).unwrap();
            let sum = of(&points[cut..]).joined(&of(&points[..cut]));
            let (direction, rms_m) = sum.line(&whole.line.direction).unwrap();
            // Metres, for coordinates of a thousand metres: rounding of the mean.
            prop_assert!((rms_m - whole.rms_m).abs() < 1e-9);
            prop_assert!(whole.line.distance_to_point(sum.mean()) < 1e-9);
            // Of two axes of nearly one length either may be found.
            let along = |d: &Vector3<f64>| {
                points.iter().map(|point| (point - sum.mean()).dot(d).powi(2)).sum::<f64>()
            };
            prop_assert!((along(&direction) - along(&whole.line.direction)).abs() < 1e-6);
        }
    }

    #[test]
    fn one_place_has_no_direction() {
        let here = Point3::new(1.0, 2.0, 3.0);
        assert_eq!(Scatter::of([(here, 1.0), (here, 4.0)]).unwrap().line(&Vector3::x()), None);
        assert_eq!(Scatter::of([]), None);
        let infinite = Scatter::of([(here, 1.0), (Point3::new(f64::INFINITY, 0.0, 0.0), 1.0)]).unwrap();
        assert_eq!(infinite.line(&Vector3::x()), None);
    }
}
