//! Where a variable lives and how a step moves it.

use crate::geometry::{OrthonormalLine, Pose};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3, Vector6};

/// Most degrees of freedom of one variable.
pub const MOST_FREEDOM: usize = 9;

/// A space in which variables of one kind live: numbers, degrees of freedom, and what a step does.
///
/// The library's own are [`PoseSpace`], [`PlanarPoseSpace`](super::PlanarPoseSpace), [`VectorSpace`], [`LineSpace`], [`DirectionSpace`] and [`RotationSpace`]; a user's own is used in
/// the same way:
///
/// ```
/// use open_structure::adjust::Parametrisation;
///
/// /// An angle, kept in one turn.
/// struct Angle;
///
/// impl Parametrisation for Angle {
///     fn numbers(&self) -> usize { 1 }
///     fn freedom(&self) -> usize { 1 }
///     fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
///         moved[0] = (numbers[0] + step[0]).rem_euclid(std::f64::consts::TAU);
///     }
/// }
/// ```
pub trait Parametrisation: Send + Sync {
    /// Numbers by which a variable is kept.
    fn numbers(&self) -> usize;

    /// Degrees of freedom, at most [`MOST_FREEDOM`].
    fn freedom(&self) -> usize;

    /// Where a step leads.
    ///
    /// * `numbers` — the variable; `step` — as many numbers as there are degrees of freedom; `moved` — the variable after the step.
    ///
    /// A step of zero must leave the variable as it is, and a Jacobian is the derivative by the step at zero.
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]);

    /// Whether its variables are poses, of which a problem may have many or few: see [`Eliminate`](super::Eliminate).
    fn is_pose(&self) -> bool {
        false
    }
}

/// Numbers without constraint: points, inverse depths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VectorSpace(pub usize);

impl Parametrisation for VectorSpace {
    fn numbers(&self) -> usize {
        self.0
    }
    fn freedom(&self) -> usize {
        self.0
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        for (moved, (number, step)) in moved.iter_mut().zip(numbers.iter().zip(step)) {
            *moved = number + step;
        }
    }
}

/// `camera_from_world`: translation (3), quaternion x y z w (4), and the same rotation as a matrix, row by row (9).
///
/// Steps are tangents `[rotation; translation]`, applied on the left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseSpace;

impl PoseSpace {
    /// The numbers of a pose.
    #[must_use]
    pub fn numbers_of(pose: &Pose) -> [f64; 16] {
        let (t, q) = pose.components();
        let r = pose.rotation_matrix();
        let mut numbers = [0.0; 16];
        numbers[..3].copy_from_slice(&t);
        numbers[3..7].copy_from_slice(&q);
        for row in 0..3 {
            for column in 0..3 {
                numbers[7 + 3 * row + column] = r[(row, column)];
            }
        }
        numbers
    }

    /// The pose of the numbers.
    #[must_use]
    pub fn pose_of(numbers: &[f64]) -> Pose {
        Pose::new(UnitQuaternion::new_normalize(quaternion(numbers)), translation(numbers))
    }
}

/// The quaternion of a pose's numbers.
pub(super) fn quaternion(numbers: &[f64]) -> Quaternion<f64> {
    Quaternion::new(numbers[6], numbers[3], numbers[4], numbers[5])
}

/// The translation of a pose's numbers.
pub(super) fn translation(numbers: &[f64]) -> Vector3<f64> {
    Vector3::new(numbers[0], numbers[1], numbers[2])
}

/// The rotation matrix of a pose's numbers.
pub(super) fn rotation(numbers: &[f64]) -> Matrix3<f64> {
    Matrix3::from_row_slice(&numbers[7..16])
}

impl Parametrisation for PoseSpace {
    fn is_pose(&self) -> bool {
        true
    }
    fn numbers(&self) -> usize {
        16
    }
    fn freedom(&self) -> usize {
        6
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        let pose = Pose::exp(&Vector6::from_column_slice(step)) * Self::pose_of(numbers);
        let again =
            Pose::new(UnitQuaternion::new_normalize(pose.rotation().into_inner()), pose.translation());
        moved.copy_from_slice(&Self::numbers_of(&again));
    }
}

/// A line by its orthonormal form, kept as `U` (9, row by row) and `cos φ`, `sin φ` (2).
///
/// Steps are those of [`OrthonormalLine::update`]: `U ← U · Exp(δ₁, δ₂, δ₃)`, `φ ← φ + δ₄`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineSpace;

impl LineSpace {
    /// The numbers of a line.
    #[must_use]
    pub fn numbers_of(line: &OrthonormalLine) -> [f64; 11] {
        let plucker = line.plucker();
        let u = Pose::exp(&Vector6::new(line.phi.x, line.phi.y, line.phi.z, 0.0, 0.0, 0.0)).rotation_matrix();
        let mut numbers = [0.0; 11];
        for row in 0..3 {
            for column in 0..3 {
                numbers[3 * row + column] = u[(row, column)];
            }
        }
        let distance = plucker.moment.norm();
        let scale = libm::hypot(distance, 1.0);
        numbers[9] = distance / scale;
        numbers[10] = 1.0 / scale;
        numbers
    }

    /// Moment and direction of the numbers, scaled so that `|n|² + |d|² = 1`: `n = cos φ · u₁`, `d = sin φ · u₂`.
    #[must_use]
    pub fn plucker_of(numbers: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        let u = Matrix3::from_row_slice(&numbers[..9]);
        (u.column(0) * numbers[9], u.column(1) * numbers[10])
    }
}

impl Parametrisation for LineSpace {
    fn numbers(&self) -> usize {
        11
    }
    fn freedom(&self) -> usize {
        4
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        let u = Matrix3::from_row_slice(&numbers[..9]);
        let turn = Pose::exp(&Vector6::new(step[0], step[1], step[2], 0.0, 0.0, 0.0)).rotation_matrix();
        let u = orthonormalised(u * turn);
        let (sine, cosine) = (libm::sin(step[3]), libm::cos(step[3]));
        for row in 0..3 {
            for column in 0..3 {
                moved[3 * row + column] = u[(row, column)];
            }
        }
        // φ may leave (0, π/2]: a negative distance is a moment the other way round, and the same formulas hold.
        let (c, s) = (numbers[9], numbers[10]);
        let (c, s) = (c * cosine - s * sine, s * cosine + c * sine);
        let scale = libm::hypot(c, s);
        moved[9] = c / scale;
        moved[10] = s / scale;
    }
}

/// The rotation nearest to a matrix that is one up to rounding (one step of Gram and Schmidt).
fn orthonormalised(matrix: Matrix3<f64>) -> Matrix3<f64> {
    let first = matrix.column(0).normalize();
    let second = (matrix.column(1) - first * first.dot(&matrix.column(1))).normalize();
    Matrix3::from_columns(&[first, second, first.cross(&second)])
}

/// A direction: a rotation matrix (9, row by row) whose first column is the direction.
///
/// Steps turn it about its second and third column: two degrees of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectionSpace;

impl DirectionSpace {
    /// The numbers of a direction of length one.
    #[must_use]
    pub fn numbers_of(direction: &Vector3<f64>) -> [f64; 9] {
        let axis = Vector3::ith_axis(direction.iamin()).into_inner();
        let second = (axis - direction * direction.dot(&axis)).normalize();
        let third = direction.cross(&second);
        row_by_row(&Matrix3::from_columns(&[*direction, second, third]))
    }

    /// The direction.
    #[must_use]
    pub fn direction_of(numbers: &[f64]) -> Vector3<f64> {
        Vector3::new(numbers[0], numbers[3], numbers[6])
    }
}

/// The nine numbers of a matrix, row by row.
fn row_by_row(matrix: &Matrix3<f64>) -> [f64; 9] {
    let mut numbers = [0.0; 9];
    for row in 0..3 {
        for column in 0..3 {
            numbers[3 * row + column] = matrix[(row, column)];
        }
    }
    numbers
}

impl Parametrisation for DirectionSpace {
    fn numbers(&self) -> usize {
        9
    }
    fn freedom(&self) -> usize {
        2
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        RotationSpace.plus(numbers, &[0.0, step[0], step[1]], moved);
    }
}

/// A rotation matrix (9, row by row): three directions at right angles, its columns.
///
/// Steps multiply on the right: `R ← R · Exp(δ)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RotationSpace;

impl RotationSpace {
    /// The numbers of a rotation.
    #[must_use]
    pub fn numbers_of(rotation: &Rotation3<f64>) -> [f64; 9] {
        row_by_row(rotation.matrix())
    }
}

impl Parametrisation for RotationSpace {
    fn numbers(&self) -> usize {
        9
    }
    fn freedom(&self) -> usize {
        3
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        let rotation = Matrix3::from_row_slice(numbers);
        let turn = Pose::exp(&Vector6::new(step[0], step[1], step[2], 0.0, 0.0, 0.0)).rotation_matrix();
        moved.copy_from_slice(&row_by_row(&orthonormalised(rotation * turn)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{PluckerLine, Segment};
    use nalgebra::{Point3, Vector4};
    use proptest::prelude::*;

    fn segment() -> impl Strategy<Value = Segment> {
        (prop::array::uniform3(-5.0..5.0), prop::array::uniform3(-5.0..5.0))
            .prop_map(|(a, b)| Segment { start: Point3::from(a), end: Point3::from(b) })
            .prop_filter("a direction", |segment| segment.length() > 0.1)
    }

    proptest! {
        #[test]
        fn a_line_moves_as_its_orthonormal_form_does(segment in segment(), step in prop::array::uniform4(-0.3..0.3)) {
            let line = segment.plucker().unwrap().orthonormal();
            let mut moved = [0.0; 11];
            LineSpace.plus(&LineSpace::numbers_of(&line), &step, &mut moved);
            let (moment, direction) = LineSpace::plucker_of(&moved);
            let found = PluckerLine::new(moment, direction).unwrap();
            let expected = line.update(&Vector4::from(step)).plucker();
            // Metres over the distance; a step of φ towards 0 takes the line far away.
            let scale = expected.moment.norm().max(1.0);
            let sign = found.direction.dot(&expected.direction).signum();
            prop_assert!((found.direction * sign - expected.direction).norm() < 1e-12);
            prop_assert!((found.moment * sign - expected.moment).norm() / scale < 1e-11);
        }

        #[test]
        fn no_step_moves_nothing(segment in segment()) {
            let direction = segment.direction().unwrap();
            let before = DirectionSpace::numbers_of(&direction);
            let mut after = [0.0; 9];
            DirectionSpace.plus(&before, &[0.0; 2], &mut after);
            prop_assert!(before.iter().zip(after).all(|(b, a)| (b - a).abs() < 1e-15));
            prop_assert!((DirectionSpace::direction_of(&after) - direction).norm() < 1e-15);
            let before = LineSpace::numbers_of(&segment.plucker().unwrap().orthonormal());
            let mut after = [0.0; 11];
            LineSpace.plus(&before, &[0.0; 4], &mut after);
            prop_assert!(before.iter().zip(after).all(|(b, a)| (b - a).abs() < 1e-14));
        }

        #[test]
        fn a_pose_moves_by_its_tangent_on_the_left(step in prop::array::uniform6(-0.5..0.5), t in prop::array::uniform3(-5.0..5.0)) {
            let pose = Pose::from_components(t, [0.1, -0.2, 0.3, 0.9]).unwrap();
            let mut moved = [0.0; 16];
            PoseSpace.plus(&PoseSpace::numbers_of(&pose), &step, &mut moved);
            let expected = Pose::exp(&Vector6::from(step)) * pose;
            let found = PoseSpace::pose_of(&moved);
            prop_assert!((found * expected.inverse()).log().norm() < 1e-13);
            prop_assert!((rotation(&moved) - expected.rotation_matrix()).norm() < 1e-14);
        }
    }
}
