//! Minimal forms of a line, each with its derivative.

use super::parametrisation::{LineSpace, Parametrisation};
use crate::geometry::{PluckerLine, Segment};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// A space of lines with four degrees of freedom.
pub(super) trait LineForm: Parametrisation + Copy + 'static {
    /// The numbers of a segment's line.
    fn numbers_of(segment: &Segment, line: &PluckerLine) -> Vec<f64>;

    /// Moment and direction, of some common scale.
    fn plucker(numbers: &[f64]) -> (Vector3<f64>, Vector3<f64>);

    /// The derivative of moment and direction by a step.
    fn derivative(numbers: &[f64]) -> SMatrix<f64, 6, 4>;
}

fn six_by_four(columns: [[Vector3<f64>; 2]; 4]) -> SMatrix<f64, 6, 4> {
    let mut matrix = SMatrix::<f64, 6, 4>::zeros();
    for (k, [moment, direction]) in columns.iter().enumerate() {
        matrix.fixed_view_mut::<3, 1>(0, k).copy_from(moment);
        matrix.fixed_view_mut::<3, 1>(3, k).copy_from(direction);
    }
    matrix
}

impl LineForm for LineSpace {
    fn numbers_of(_: &Segment, line: &PluckerLine) -> Vec<f64> {
        Self::numbers_of(&line.orthonormal()).to_vec()
    }

    #[inline]
    fn plucker(numbers: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        Self::plucker_of(numbers)
    }

    #[inline]
    fn derivative(numbers: &[f64]) -> SMatrix<f64, 6, 4> {
        let u = Matrix3::from_row_slice(&numbers[..9]);
        let [u1, u2, u3] = [0, 1, 2].map(|k| u.column(k).into_owned());
        let (c, s) = (numbers[9], numbers[10]);
        // δu₁ = ω₃ u₂ − ω₂ u₃, δu₂ = ω₁ u₃ − ω₃ u₁
        six_by_four([
            [Vector3::zeros(), u3 * s],
            [u3 * -c, Vector3::zeros()],
            [u2 * c, u1 * -s],
            [u1 * -s, u2 * c],
        ])
    }
}

/// A line by two of its points (6 numbers), each of which moves across the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct EndpointsSpace;

impl EndpointsSpace {
    /// Two unit vectors across the line.
    fn across(numbers: &[f64]) -> [Vector3<f64>; 2] {
        let along = Self::point(numbers, 3) - Self::point(numbers, 0);
        let along = along.normalize();
        let axis = Vector3::ith_axis(along.iamin()).into_inner();
        let first = (axis - along * along.dot(&axis)).normalize();
        [first, along.cross(&first)]
    }

    fn point(numbers: &[f64], at: usize) -> Vector3<f64> {
        Vector3::new(numbers[at], numbers[at + 1], numbers[at + 2])
    }
}

impl Parametrisation for EndpointsSpace {
    fn numbers(&self) -> usize {
        6
    }
    fn freedom(&self) -> usize {
        4
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        let [first, second] = Self::across(numbers);
        for end in 0..2 {
            let point = Self::point(numbers, 3 * end) + first * step[2 * end] + second * step[2 * end + 1];
            moved[3 * end..3 * end + 3].copy_from_slice(point.as_slice());
        }
    }
}

impl LineForm for EndpointsSpace {
    fn numbers_of(segment: &Segment, _: &PluckerLine) -> Vec<f64> {
        segment.start.coords.iter().chain(segment.end.coords.iter()).copied().collect()
    }

    #[inline]
    fn plucker(numbers: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        let (start, end) = (Self::point(numbers, 0), Self::point(numbers, 3));
        (start.cross(&end), end - start)
    }

    #[inline]
    fn derivative(numbers: &[f64]) -> SMatrix<f64, 6, 4> {
        let (start, end) = (Self::point(numbers, 0), Self::point(numbers, 3));
        let [first, second] = Self::across(numbers);
        six_by_four([
            [first.cross(&end), -first],
            [second.cross(&end), -second],
            [start.cross(&first), first],
            [start.cross(&second), second],
        ])
    }
}

/// A line by its frame `Q = [n/|n|, d, n/|n| × d]` (9 numbers, row by row) and its distance `w` from the origin.
///
/// Steps are `Q ← Q · Cay(δ/2)` with Cayley's map `Cay(s) = (I + [s]ₓ)(I − [s]ₓ)⁻¹`, and `w ← w + δ₄`.
///
/// # Source
/// Zhang and Koch 2014, *Structure and motion from line correspondences*: Cayley representation, here about the line's present frame,
/// so that half a turn is no special place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CayleySpace;

impl Parametrisation for CayleySpace {
    fn numbers(&self) -> usize {
        10
    }
    fn freedom(&self) -> usize {
        4
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        let frame = Matrix3::from_row_slice(&numbers[..9]);
        let s = Vector3::new(step[0], step[1], step[2]) * 0.5;
        let cross = s.cross_matrix();
        // (I + [s]ₓ)(I − [s]ₓ)⁻¹ = I + 2([s]ₓ + [s]ₓ²)/(1 + s·s)
        let turn = Matrix3::identity() + (cross + cross * cross) * (2.0 / (1.0 + s.norm_squared()));
        let frame = frame * turn;
        let first = frame.column(0).normalize();
        let second = (frame.column(1) - first * first.dot(&frame.column(1))).normalize();
        let frame = Matrix3::from_columns(&[first, second, first.cross(&second)]);
        for row in 0..3 {
            for column in 0..3 {
                moved[3 * row + column] = frame[(row, column)];
            }
        }
        moved[9] = numbers[9] + step[3];
    }
}

impl LineForm for CayleySpace {
    fn numbers_of(_: &Segment, line: &PluckerLine) -> Vec<f64> {
        let mut numbers = LineSpace::numbers_of(&line.orthonormal())[..9].to_vec();
        numbers.push(line.moment.norm());
        numbers
    }

    #[inline]
    fn plucker(numbers: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        let q = Matrix3::from_row_slice(&numbers[..9]);
        (q.column(0) * numbers[9], q.column(1).into_owned())
    }

    #[inline]
    fn derivative(numbers: &[f64]) -> SMatrix<f64, 6, 4> {
        let q = Matrix3::from_row_slice(&numbers[..9]);
        let [q1, q2, q3] = [0, 1, 2].map(|k| q.column(k).into_owned());
        let w = numbers[9];
        six_by_four([
            [Vector3::zeros(), q3],
            [q3 * -w, Vector3::zeros()],
            [q2 * w, -q1],
            [q1, Vector3::zeros()],
        ])
    }
}
