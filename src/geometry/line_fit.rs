//! An endless line through points.

use super::PluckerLine;
use nalgebra::linalg::SymmetricEigen;
use nalgebra::{Matrix3, Point3, Vector3};

/// A line through points and how well they lie on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineFit {
    /// The line, metres, directed from the first point towards the last.
    pub line: PluckerLine,
    /// Root mean square of the points' distances from the line, metres.
    pub rms_m: f64,
    /// Points used: all.
    pub count: usize,
}

/// The line with the least squared distances from points (total least squares).
///
/// Through the mean of the points, along the eigenvector of their scatter with the largest eigenvalue.
///
/// * `points` — metres, in one space.
///
/// `None` for fewer than two points, points all at one place, or numbers that are not finite.
#[must_use]
pub fn fit_line(points: &[Point3<f64>]) -> Option<LineFit> {
    let (first, last) = (points.first()?, points.last()?);
    let count = points.len();
    // Measured from the first point, for far from the origin a mean of coordinates loses digits.
    let mean = points.iter().map(|point| point - first).sum::<Vector3<f64>>() / count as f64;
    let offsets = || points.iter().map(|point| (point - first) - mean);
    let largest = offsets().map(|offset| offset.amax()).fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite() && offsets().all(|offset| offset.iter().all(|c| c.is_finite())))
    {
        return None;
    }
    let mut scatter = Matrix3::<f64>::zeros();
    for offset in offsets() {
        let offset = offset / largest;
        scatter.ger(1.0, &offset, &offset, 1.0);
    }
    let eigen = SymmetricEigen::try_new(scatter, f64::EPSILON, 200)?;
    let mut direction = eigen.eigenvectors.column(eigen.eigenvalues.imax()).normalize();
    if direction.dot(&(last - first)) < 0.0 {
        direction = -direction;
    }
    let line = PluckerLine { moment: (first + mean).coords.cross(&direction), direction };
    let squares = offsets().map(|offset| offset.cross(&direction).norm_squared()).sum::<f64>();
    let rms_m = (squares / count as f64).sqrt();
    (line.moment.iter().all(|c| c.is_finite()) && rms_m.is_finite()).then_some(LineFit { line, rms_m, count })
}

#[cfg(test)]
mod tests {
    use super::super::strategies::{segment, vector};
    use super::*;
    use nalgebra::Vector4;
    use proptest::prelude::*;

    fn rms(points: &[Point3<f64>], line: &PluckerLine) -> f64 {
        let squares: f64 = points.iter().map(|point| line.distance_to_point(*point).powi(2)).sum();
        (squares / points.len() as f64).sqrt()
    }

    proptest! {
        #[test]
        fn points_on_a_line_give_it_back(segment in segment(), places in prop::collection::vec(0.0..1.0, 0..20)) {
            let along = segment.end - segment.start;
            let mut points = vec![segment.start];
            points.extend(places.into_iter().map(|t| segment.start + along * t));
            points.push(segment.end);
            let (found, truth) = (fit_line(&points).unwrap(), segment.plucker().unwrap());
            // Metres, for a segment of at least 0.1 m up to 10 m away.
            prop_assert!((found.line.direction - truth.direction).norm() < 1e-12);
            prop_assert!((found.line.moment - truth.moment).norm() < 1e-12);
            prop_assert!(found.rms_m < 1e-13);
        }

        #[test]
        fn no_nearby_line_fits_better(
            segment in segment(), noise in prop::collection::vec((0.0..1.0, vector(0.05)), 3..20),
            step in prop::array::uniform4(-1e-3..1e-3),
        ) {
            let along = segment.end - segment.start;
            let points: Vec<_> = noise.into_iter().map(|(t, shift)| segment.start + along * t + shift).collect();
            let found = fit_line(&points).unwrap();
            prop_assert!((found.rms_m - rms(&points, &found.line)).abs() < 1e-12);
            let beside = found.line.orthonormal().update(&Vector4::from(step)).plucker();
            prop_assert!(found.rms_m <= rms(&points, &beside) + 1e-12);
        }
    }

    #[test]
    fn points_without_a_direction_give_nothing() {
        let here = Point3::new(1.0, 2.0, 3.0);
        assert_eq!(fit_line(&[]), None);
        assert_eq!(fit_line(&[here]), None);
        assert_eq!(fit_line(&[here, here, here]), None);
        assert_eq!(fit_line(&[here, Point3::new(f64::NAN, 0.0, 0.0)]), None);
        assert_eq!(fit_line(&[here, Point3::new(f64::INFINITY, 0.0, 0.0)]), None);
        let far = Point3::new(f64::MAX, f64::MAX, 0.0);
        assert_eq!(fit_line(&[far, -far]), None);
    }
}
