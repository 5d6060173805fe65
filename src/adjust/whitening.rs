//! Roots of information: what turns a residual into units of sigma.

use super::line_sight::{EndsDepthSight, EndsSight, depth_in_plane};
use super::observations::{LineView, PointView};
use super::point_sight::{DepthSight, DepthWeight, PixelSight};
use crate::geometry::{PinholeCamera, PluckerLine, Pose};
use crate::structure::MeasurementNoise;
use nalgebra::linalg::SymmetricEigen;
use nalgebra::{DMatrix, Matrix2, Matrix2x4, Matrix3, Matrix4, Vector2};

/// Eigenvalues below this part of the largest are zero by rounding.
const ROUNDING: f64 = 1e-12;

/// `W` with `WᵀW` an information matrix: from Cholesky, or from eigenvectors where something is left open (semi-definite).
///
/// `None` for a matrix with a negative eigenvalue, or one that is not finite.
pub(super) fn root(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if let Some(factor) = information.clone().cholesky() {
        return Some(factor.l().transpose());
    }
    if !information.iter().all(|number| number.is_finite()) {
        return None;
    }
    // What is left open altogether has a row of zeros; the others may be positive without it.
    let size = information.nrows();
    let known: Vec<usize> =
        (0..size).filter(|row| information.row(*row).iter().any(|number| *number != 0.0)).collect();
    if known.len() < size {
        let part = DMatrix::from_fn(known.len(), known.len(), |row, column| {
            information[(known[row], known[column])]
        });
        if let Some(factor) = part.cholesky() {
            let upper = factor.l().transpose();
            let mut root = DMatrix::zeros(size, size);
            for (row, at) in known.iter().enumerate() {
                for (column, other) in known.iter().enumerate() {
                    root[(*at, *other)] = upper[(row, column)];
                }
            }
            return Some(root);
        }
    }
    let eigen = SymmetricEigen::new(information.clone());
    let largest = eigen.eigenvalues.amax();
    if eigen.eigenvalues.iter().any(|value| *value < -ROUNDING.sqrt() * largest) {
        return None;
    }
    let scale = |value: f64| if value > ROUNDING * largest { value.sqrt() } else { 0.0 };
    let scales = eigen.eigenvalues.map(scale);
    Some(DMatrix::from_diagonal(&scales) * eigen.eigenvectors.transpose())
}

/// What a frame measured of a point, without its depth.
pub(super) fn pixel_sight(view: &PointView, noise: &MeasurementNoise) -> PixelSight {
    let root = match &view.information {
        Some(information) => {
            let part = information.view((0, 0), (2, 2)).into_owned();
            root(&part).map_or_else(Matrix2::zeros, |root| root.fixed_view::<2, 2>(0, 0).into_owned())
        }
        None => Matrix2::from_diagonal_element(1.0 / noise.sigma_px),
    };
    PixelSight { camera: view.camera, pixel: view.pixel, root }
}

/// What a frame measured of a point, with its depth.
pub(super) fn depth_sight(view: &PointView, depth_m: f64, noise: &MeasurementNoise) -> DepthSight {
    let weight = match &view.information {
        Some(information) => {
            let root = root(information);
            let root = root.map_or_else(Matrix3::zeros, |root| root.fixed_view::<3, 3>(0, 0).into_owned());
            DepthWeight::Root(root)
        }
        None => DepthWeight::Noise(*noise),
    };
    DepthSight { camera: view.camera, pixel: view.pixel, depth_m, weight }
}

/// Covariance of the four coordinates of a segment's ends, px².
fn coordinates(view: &LineView, noise: &MeasurementNoise) -> Matrix4<f64> {
    let declared = Matrix4::from_diagonal_element(noise.sigma_px * noise.sigma_px);
    let Some(information) = &view.information else { return declared };
    let Some(covariance) = information.clone().cholesky().map(|factor| factor.inverse()) else {
        return declared;
    };
    // Of six numbers the coordinates are all but the depths.
    let places = if covariance.nrows() == 6 { [0, 1, 3, 4] } else { [0, 1, 2, 3] };
    Matrix4::from_fn(|row, column| covariance[(places[row], places[column])])
}

/// What a frame measured of a line, without depths.
pub(super) fn ends_sight(view: &LineView, noise: &MeasurementNoise) -> EndsSight {
    let root = if view.information.is_none() {
        Matrix2::from_diagonal_element(1.0 / noise.sigma_px)
    } else {
        let along = (view.ends[1] - view.ends[0]).normalize();
        let (x, y) = (-along.y, along.x);
        let across = Matrix2x4::new(x, y, 0.0, 0.0, 0.0, 0.0, x, y);
        let covariance = across * coordinates(view, noise) * across.transpose();
        let information = covariance.try_inverse().and_then(nalgebra::linalg::Cholesky::new);
        information.map_or_else(Matrix2::zeros, |factor| factor.l().transpose())
    };
    EndsSight { camera: view.camera, ends: view.ends, root }
}

/// What a frame measured of a line, with depths; weighed for where the line is now.
///
/// The weights hold while the line stays about where it is: they depend on its slope in the image, and are not derived.
pub(super) fn ends_depth_sight(
    view: &LineView,
    noise: &MeasurementNoise,
    camera_from_world: &Pose,
    line: &PluckerLine,
) -> EndsDepthSight {
    let ends = ends_sight(view, noise);
    let along = (view.ends[1] - view.ends[0]).normalize();
    let planes = view.ends.map(|end| EndsDepthSight::plane(&view.camera, end, along));
    let (mut depths_m, mut weights) = ([0.0; 2], [0.0; 2]);
    let coordinates = coordinates(view, noise);
    let seen = line.transformed(camera_from_world);
    for end in 0..2 {
        let Some((depth, declared)) = view.depths[end].and_then(|depth| noise.depth(depth)) else { continue };
        let sigma = view.information.as_ref().map_or(declared, |information| depth_sigma(information, end));
        let slope = slope(&view.camera, view.ends[end], along, &seen);
        let spread: Matrix2<f64> = coordinates.fixed_view::<2, 2>(2 * end, 2 * end).into_owned();
        let shift = along.dot(&(spread * along));
        let variance = sigma * sigma + slope * slope * shift;
        let z = depth_in_plane(&planes[end], &seen.moment, &seen.direction);
        // A line along the ray has no depth there, and one behind the camera was not seen.
        if variance.is_finite() && variance > 0.0 && z > 0.0 && z.is_finite() {
            depths_m[end] = depth;
            weights[end] = 1.0 / variance.sqrt();
        }
    }
    EndsDepthSight { ends, planes, depths_m, weights }
}

/// How fast a line's depth changes along its image, metres per pixel.
fn slope(camera: &PinholeCamera, end: Vector2<f64>, along: Vector2<f64>, seen: &PluckerLine) -> f64 {
    let at = |shift: f64| {
        let plane = EndsDepthSight::plane(camera, end + along * shift, along);
        depth_in_plane(&plane, &seen.moment, &seen.direction)
    };
    at(0.5) - at(-0.5)
}

/// Standard deviation of an end's depth by an information matrix over six numbers, metres.
fn depth_sigma(information: &DMatrix<f64>, end: usize) -> f64 {
    let place = if end == 0 { 2 } else { 5 };
    let covariance = information.clone().cholesky().map(|factor| factor.inverse());
    covariance
        .filter(|covariance| covariance.nrows() == 6)
        .map_or(f64::INFINITY, |covariance| covariance[(place, place)].max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_times_itself_is_the_information_also_where_something_is_open() {
        let rows = [[4.0, 1.0, 0.0], [1.0, 9.0, -2.0], [0.0, -2.0, 1.0]];
        let whole = DMatrix::from_fn(3, 3, |row, column| rows[row][column]);
        let flat = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![0.0, 4.0, 0.0]));
        let across = nalgebra::DVector::from_vec(vec![1.0, -2.0, 0.5]);
        let open = DMatrix::from_row_slice(3, 3, &[4.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 9.0]);
        for information in [whole, flat, open, &across * across.transpose(), DMatrix::zeros(3, 3)] {
            let root = root(&information).unwrap();
            assert!((root.transpose() * &root - &information).amax() < 1e-14, "{information}");
        }
        let negative = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
        assert_eq!(root(&negative), None);
        assert_eq!(root(&(negative * f64::NAN)), None);
    }
}
