//! Covariances of what is estimated, as an estimate's rows hold them.

use super::error::Error;
use super::estimation::{Estimation, LineHandle};
use super::observations::Observations;
use super::planar_pose::PLANE;
use super::point_handle::PointHandle;
use super::pose_factor::adjoint;
use super::problem::Variable;
use super::shared_line::shared_plucker;
use super::uncertainty::Uncertainty;
use nalgebra::{DMatrix, SMatrix, Vector3};

/// Upper triangles, row by row, in the order of the observations' vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Covariances {
    /// 21 numbers: tangent on the left of `world_from_camera`.
    pub(super) poses: Vec<Vec<f64>>,
    /// 6 numbers: x, y, z.
    pub(super) points: Vec<Vec<f64>>,
    /// 21 numbers: start and end, zero along the line.
    pub(super) lines: Vec<Vec<f64>>,
}

impl Estimation {
    /// Covariances of all vertices: parts of the inverse of `JᵀJ` with the gauge held.
    ///
    /// # Errors
    /// [`Error::Singular`] where measurements and gauge leave something open.
    pub(super) fn covariances(&self, observations: &Observations) -> Result<Covariances, Error> {
        let uncertainty = Uncertainty::of(&self.problem)?;
        let blocks = uncertainty.blocks(&self.problem, &self.poses);
        let poses = observations.frames.iter().zip(&blocks).map(|(frame, block)| {
            let block = in_space(block);
            // (Exp(δ) T)⁻¹ = Exp(−Ad(T⁻¹) δ) T⁻¹
            let turn = adjoint(&frame.camera_from_world.inverse());
            triangle(&(turn * block * turn.transpose()))
        });
        let poses = poses.collect();
        let points = self.point_covariances(&uncertainty);
        let mut lines = Vec::new();
        for (line, handle) in observations.lines.iter().zip(&self.lines) {
            let functional = self.ends_by_step(
                handle,
                &uncertainty,
                [line.segment.start, line.segment.end].map(|end| end.coords),
            );
            let solved = uncertainty.times(&functional);
            let covariance = functional.transpose() * solved;
            lines.push(triangle(&SMatrix::<f64, 6, 6>::from_fn(|row, column| {
                0.5 * (covariance[(row, column)] + covariance[(column, row)])
            })));
        }
        Ok(Covariances { poses, points, lines })
    }

    fn point_covariances(&self, uncertainty: &Uncertainty) -> Vec<Vec<f64>> {
        let mut plain = Vec::new();
        for handle in &self.points {
            if let PointHandle::Place(variable) = handle {
                plain.push(*variable);
            }
        }
        let mut blocks = uncertainty.blocks(&self.problem, &plain).into_iter();
        let values = self.problem.values();
        let covariance = |handle: &PointHandle| {
            if let PointHandle::Place(_) = handle {
                let block = blocks.next().unwrap_or_else(|| DMatrix::zeros(3, 3));
                return triangle(&block.fixed_view::<3, 3>(0, 0).into_owned());
            }
            let mut functional = DMatrix::zeros(uncertainty.unknowns(), 3);
            for (variable, first, by_step) in handle.by_steps(&values) {
                if let Some(range) = uncertainty.range(variable) {
                    let mut rows = functional.rows_mut(range.start + first, 3);
                    rows += by_step.transpose();
                }
            }
            let covariance = functional.transpose() * uncertainty.times(&functional);
            triangle(&SMatrix::<f64, 3, 3>::from_fn(|row, column| {
                0.5 * (covariance[(row, column)] + covariance[(column, row)])
            }))
        };
        self.points.iter().map(covariance).collect()
    }

    /// How both ends of a line move across it by the step of all variables, one column for each coordinate.
    fn ends_by_step(
        &self,
        handle: &LineHandle,
        uncertainty: &Uncertainty,
        ends: [Vector3<f64>; 2],
    ) -> DMatrix<f64> {
        let values = self.problem.values();
        let (direction, derivative, variables): (Vector3<f64>, SMatrix<f64, 6, 4>, Vec<(Variable, usize)>) =
            match handle {
                LineHandle::Free(variable) => {
                    let (_, direction, derivative) = self.free_line(*variable);
                    (direction, derivative, vec![(*variable, 0)])
                }
                LineHandle::Shared { direction, offset, origin } => {
                    let (_, along, derivative) =
                        shared_plucker(values.of(*direction), values.of(*offset), origin);
                    (along, derivative, vec![(*direction, 0), (*offset, 2)])
                }
            };
        let length = direction.norm();
        let unit = direction / length;
        let mut functional = DMatrix::zeros(uncertainty.unknowns(), 6);
        for (variable, first) in variables {
            let Some(range) = uncertainty.range(variable) else { continue };
            for (k, unknown) in range.enumerate() {
                let moment: Vector3<f64> = derivative.fixed_view::<3, 1>(0, first + k).into_owned();
                let along: Vector3<f64> = derivative.fixed_view::<3, 1>(3, first + k).into_owned();
                for (at, end) in ends.iter().enumerate() {
                    // X × d = n, so that δX = d × (δn − X × δd) across the line.
                    let moved = unit.cross(&(moment - end.cross(&along))) / length;
                    for row in 0..3 {
                        functional[(unknown, 3 * at + row)] = moved[row];
                    }
                }
            }
        }
        functional
    }
}

/// The covariance of a pose's tangent; of one in the plane, what leaves it is known.
fn in_space(block: &DMatrix<f64>) -> SMatrix<f64, 6, 6> {
    let mut all = SMatrix::<f64, 6, 6>::zeros();
    if block.nrows() == PLANE.len() {
        for (row, place) in PLANE.into_iter().enumerate() {
            for (column, other) in PLANE.into_iter().enumerate() {
                all[(place, other)] = block[(row, column)];
            }
        }
    } else {
        all.copy_from(&block.fixed_view::<6, 6>(0, 0));
    }
    all
}

/// The upper triangle of a symmetric matrix, row by row.
fn triangle<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Vec<f64> {
    (0..N).flat_map(|row| (row..N).map(move |column| matrix[(row, column)])).collect()
}
