//! A parametrisation of one's own: a point as direction and logarithm of distance.

use nalgebra::{Matrix3x2, Vector3};
use open_structure::adjust::Parametrisation;

/// A point seen from the place that saw it first: unit direction (3 numbers) and `ln` of its distance in metres.
///
/// Three degrees of freedom: two across the direction, along the columns of [`across`], and one of the logarithm. A distance cannot become
/// negative, and a far point moves by the same part of its distance as a near one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BearingSpace;

impl Parametrisation for BearingSpace {
    fn numbers(&self) -> usize {
        4
    }

    fn freedom(&self) -> usize {
        3
    }

    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        let direction = Vector3::new(numbers[0], numbers[1], numbers[2]);
        let columns = across(&direction);
        let turned = (direction + columns.column(0) * step[0] + columns.column(1) * step[1]).normalize();
        moved.copy_from_slice(&[turned.x, turned.y, turned.z, numbers[3] + step[2]]);
    }
}

/// Two unit vectors perpendicular to a unit vector and to each other.
#[must_use]
pub fn across(direction: &Vector3<f64>) -> Matrix3x2<f64> {
    // Away from the direction's largest component.
    let mut aside = Vector3::zeros();
    aside[direction.iamin()] = 1.0;
    let first = direction.cross(&aside).normalize();
    Matrix3x2::from_columns(&[first, direction.cross(&first)])
}
