//! Residuals of lines that are kept by a minimal form in the world.

use super::factor::Factor;
use super::line_form::LineForm;
use super::line_sight::LineSight;
use super::parametrisation::{rotation, translation};
use super::problem::{Values, Variable};
use nalgebra::{Matrix3, SMatrix, Vector3};
use std::marker::PhantomData;

/// A line seen from a pose.
///
/// `ᶜd = R d`, `ᶜn = R n + t × R d`; by the pose's tangent `∂ᶜn = ω × ᶜn + v × ᶜd`, `∂ᶜd = ω × ᶜd`.
pub(super) struct LineFactor<L, S, const R: usize> {
    /// Pose and line.
    pub(super) variables: [Variable; 2],
    pub(super) sight: S,
    pub(super) form: PhantomData<L>,
}

impl<L: LineForm, S: LineSight<R>, const R: usize> Factor for LineFactor<L, S, R> {
    const RESIDUALS: usize = R;
    type Variables = [Variable; 2];

    fn variables(&self) -> [Variable; 2] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let (pose, line) = (values.of(self.variables[0]), values.of(self.variables[1]));
        let (moment, direction) = L::plucker(line);
        let seen = SeenLine::new(pose, &moment, &direction);
        let Some((found, by_line)) = self.sight.look(&seen.moment, &seen.direction) else { return false };
        residual.copy_from_slice(found.as_slice());
        if let Some(jacobian) = jacobian {
            let by_form = seen.by_world(&by_line) * L::derivative(line);
            for row in 0..R {
                let columns = &mut jacobian[row * 10..(row + 1) * 10];
                seen.write_pose_columns(&by_line, row, columns);
                for k in 0..4 {
                    columns[6 + k] = by_form[(row, k)];
                }
            }
        }
        true
    }
}

/// A line in a camera, and how it came there.
pub(super) struct SeenLine {
    pub(super) moment: Vector3<f64>,
    pub(super) direction: Vector3<f64>,
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
}

impl SeenLine {
    /// The line seen from a pose's numbers.
    #[inline]
    pub(super) fn new(pose: &[f64], moment: &Vector3<f64>, direction: &Vector3<f64>) -> Self {
        let (rotation, translation) = (rotation(pose), translation(pose));
        let direction = rotation * direction;
        Self { moment: rotation * moment + translation.cross(&direction), direction, rotation, translation }
    }

    /// The derivative by the line in the world from that by the line in the camera.
    #[inline]
    pub(super) fn by_world<const R: usize>(&self, by_line: &SMatrix<f64, R, 6>) -> SMatrix<f64, R, 6> {
        let by_moment = by_line.fixed_view::<R, 3>(0, 0) * self.rotation;
        let by_direction = by_line.fixed_view::<R, 3>(0, 3) * self.rotation
            + by_line.fixed_view::<R, 3>(0, 0) * self.translation.cross_matrix() * self.rotation;
        let mut all = SMatrix::<f64, R, 6>::zeros();
        all.fixed_view_mut::<R, 3>(0, 0).copy_from(&by_moment);
        all.fixed_view_mut::<R, 3>(0, 3).copy_from(&by_direction);
        all
    }

    /// Writes one row of the derivative by the pose's tangent.
    #[inline]
    pub(super) fn write_pose_columns<const R: usize>(
        &self,
        by_line: &SMatrix<f64, R, 6>,
        row: usize,
        columns: &mut [f64],
    ) {
        let a = Vector3::new(by_line[(row, 0)], by_line[(row, 1)], by_line[(row, 2)]);
        let b = Vector3::new(by_line[(row, 3)], by_line[(row, 4)], by_line[(row, 5)]);
        // a · (ω × n + v × d) + b · (ω × d) = ω · (n × a + d × b) + v · (d × a)
        let turn = self.moment.cross(&a) + self.direction.cross(&b);
        let shift = self.direction.cross(&a);
        columns[..3].copy_from_slice(turn.as_slice());
        columns[3..6].copy_from_slice(shift.as_slice());
    }
}
