//! Lines that share a direction, and what draws or holds directions to each other.

use super::factor::Factor;
use super::line_factor::SeenLine;
use super::line_form::LineForm;
use super::line_sight::LineSight;
use super::parametrisation::DirectionSpace;
use super::problem::{Values, Variable};
use nalgebra::{Matrix3, SMatrix, Vector3};
use std::marker::PhantomData;

/// A line of a group seen from a pose.
///
/// The group has the frame `[d, b₁, b₂]`, whose first axis is its direction; the line has two degrees of freedom of its own and goes
/// through `p = o + a b₁ + c b₂`, with `o` a place near it that never changes.
pub(super) struct SharedLineFactor<S, const R: usize> {
    /// Pose, direction of the group, and `[a, c]`.
    pub(super) variables: [Variable; 3],
    /// `o`, metres in the world.
    pub(super) origin: Vector3<f64>,
    pub(super) sight: S,
}

/// A line of a group, and its derivative by the steps of direction and offset.
pub(super) fn shared_plucker(
    direction: &[f64],
    offset: &[f64],
    origin: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>, SMatrix<f64, 6, 4>) {
    let frame = Matrix3::from_row_slice(direction);
    let [d, b1, b2] = [0, 1, 2].map(|k| frame.column(k).into_owned());
    let p = origin + b1 * offset[0] + b2 * offset[1];
    // δd = s₂ b₁ − s₁ b₂, and the offsets' axes turn along the line, which moves no line.
    let columns = [[-p.cross(&b2), -b2], [p.cross(&b1), b1], [-b2, Vector3::zeros()], [b1, Vector3::zeros()]];
    let mut derivative = SMatrix::<f64, 6, 4>::zeros();
    for (k, [moment, along]) in columns.iter().enumerate() {
        derivative.fixed_view_mut::<3, 1>(0, k).copy_from(moment);
        derivative.fixed_view_mut::<3, 1>(3, k).copy_from(along);
    }
    (p.cross(&d), d, derivative)
}

impl<S: LineSight<R>, const R: usize> Factor for SharedLineFactor<S, R> {
    const RESIDUALS: usize = R;
    type Variables = [Variable; 3];

    fn variables(&self) -> [Variable; 3] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let [pose, direction, offset] = self.variables.map(|variable| values.of(variable));
        let (moment, along, derivative) = shared_plucker(direction, offset, &self.origin);
        let seen = SeenLine::new(pose, &moment, &along);
        let Some((found, by_line)) = self.sight.look(&seen.moment, &seen.direction) else { return false };
        residual.copy_from_slice(found.as_slice());
        if let Some(jacobian) = jacobian {
            let by_form = seen.by_world(&by_line) * derivative;
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

/// A line that is drawn to its group's direction: `[b₁ · d̂, b₂ · d̂]/σ`, the sine of the angle between them in two axes.
pub(super) struct ParallelFactor<L> {
    /// Line and direction.
    pub(super) variables: [Variable; 2],
    pub(super) sigma_rad: f64,
    pub(super) form: PhantomData<L>,
}

impl<L: LineForm> Factor for ParallelFactor<L> {
    const RESIDUALS: usize = 2;
    type Variables = [Variable; 2];

    fn variables(&self) -> [Variable; 2] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let [line, direction] = self.variables.map(|variable| values.of(variable));
        let (_, along) = L::plucker(line);
        let length = along.norm();
        let along = along / length;
        let frame = Matrix3::from_row_slice(direction);
        let axes = [1, 2].map(|k| frame.column(k).into_owned());
        let weight = 1.0 / self.sigma_rad;
        for (residual, axis) in residual.iter_mut().zip(&axes) {
            *residual = weight * axis.dot(&along);
        }
        if let Some(jacobian) = jacobian {
            let derivative = L::derivative(line);
            let cosine = frame.column(0).dot(&along);
            // δb₁ = −s₂ d, δb₂ = s₁ d
            let turns = [[0.0, -cosine], [cosine, 0.0]];
            for row in 0..2 {
                let across = (axes[row] - along * along.dot(&axes[row])) / length;
                for k in 0..4 {
                    let column = derivative.fixed_view::<3, 1>(3, k);
                    jacobian[row * 6 + k] = weight * across.dot(&column);
                }
                jacobian[row * 6 + 4] = weight * turns[row][0];
                jacobian[row * 6 + 5] = weight * turns[row][1];
            }
        }
        length > 0.0
    }
}

/// Two directions at a right angle: `a · b / σ`.
pub(super) struct RightAngleFactor {
    pub(super) variables: [Variable; 2],
    pub(super) sigma_rad: f64,
}

impl Factor for RightAngleFactor {
    const RESIDUALS: usize = 1;
    type Variables = [Variable; 2];

    fn variables(&self) -> [Variable; 2] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let frames = self.variables.map(|variable| values.of(variable));
        let [a, b] = frames.map(DirectionSpace::direction_of);
        let weight = 1.0 / self.sigma_rad;
        residual[0] = weight * a.dot(&b);
        if let Some(jacobian) = jacobian {
            for (k, (frame, other)) in [(frames[0], b), (frames[1], a)].into_iter().enumerate() {
                let frame = Matrix3::from_row_slice(frame);
                jacobian[2 * k] = -weight * frame.column(2).dot(&other);
                jacobian[2 * k + 1] = weight * frame.column(1).dot(&other);
            }
        }
        true
    }
}
