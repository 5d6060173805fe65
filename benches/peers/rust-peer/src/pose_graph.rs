//! A pose graph in g2o's text form, in three dimensions or two, its first vertex held.

use crate::seen_point::{pose, rotation, vector};
use crate::solve::Posed;
use crate::text_file::{Line, text};
use apex_solver::core::problem::Problem;
use apex_solver::{Factor, JacobianMode, ManifoldType, NoiseModel};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Quaternion, UnitQuaternion, Vector2, Vector3};
use std::collections::BTreeMap;

/// `[ Rₐᵀ (p_b − pₐ) − t ; 2 vec(q q_b⁻¹ qₐ) ]` with the measured pose (q, t) of b in a.
struct RelativePoseFactor {
    q: UnitQuaternion<f64>,
    t: Vector3<f64>,
}

impl Factor for RelativePoseFactor {
    fn linearize(&self, params: &[&[f64]], residual: &mut [f64], jacobian: Option<faer::MatMut<'_, f64>>) {
        let (qa, qb) = (rotation(params[0]), rotation(params[1]));
        let seen = qa.inverse() * (vector(params[1]) - vector(params[0]));
        let error: Quaternion<f64> = (self.q * qb.inverse() * qa).into_inner();
        let v = error.imag();
        residual[..3].copy_from_slice((seen - self.t).as_slice());
        residual[3..].copy_from_slice((v * 2.0).as_slice());
        if let Some(mut jacobian) = jacobian {
            // Steps on the right: e Exp(θ) moves 2 vec(e) by (w I + [v]ₓ) θ, and one of b comes with −Rₐᵀ R_b.
            let by_a = Matrix3::identity() * error.w + v.cross_matrix();
            let a_from_b = (qa.inverse() * qb).to_rotation_matrix().into_inner();
            let by_b = -by_a * a_from_b;
            let turned = seen.cross_matrix();
            for row in 0..3 {
                for column in 0..3 {
                    jacobian[(row, column)] = if row == column { -1.0 } else { 0.0 };
                    jacobian[(row, 3 + column)] = turned[(row, column)];
                    jacobian[(row, 6 + column)] = a_from_b[(row, column)];
                    jacobian[(row, 9 + column)] = 0.0;
                    jacobian[(3 + row, column)] = 0.0;
                    jacobian[(3 + row, 3 + column)] = by_a[(row, column)];
                    jacobian[(3 + row, 6 + column)] = 0.0;
                    jacobian[(3 + row, 9 + column)] = by_b[(row, column)];
                }
            }
        }
    }

    fn residual_dim(&self) -> usize {
        6
    }

    fn jacobian_shape(&self) -> (usize, usize) {
        (6, 12)
    }
}

/// `[ Rₐᵀ (p_b − pₐ) − t ; θ_b − θₐ − θ ]`, the angle wrapped.
struct PlanarPoseFactor {
    measured: [f64; 3],
}

impl Factor for PlanarPoseFactor {
    fn linearize(&self, params: &[&[f64]], residual: &mut [f64], jacobian: Option<faer::MatMut<'_, f64>>) {
        let (a, b) = (params[0], params[1]);
        let (sine, cosine) = a[2].sin_cos();
        let inverse = Matrix2::new(cosine, sine, -sine, cosine);
        let seen = inverse * Vector2::new(b[0] - a[0], b[1] - a[1]);
        let turn = b[2] - a[2] - self.measured[2];
        residual[0] = seen.x - self.measured[0];
        residual[1] = seen.y - self.measured[1];
        residual[2] = turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round();
        if let Some(mut jacobian) = jacobian {
            jacobian.fill(0.0);
            for row in 0..2 {
                for column in 0..2 {
                    jacobian[(row, column)] = -inverse[(row, column)];
                    jacobian[(row, 3 + column)] = inverse[(row, column)];
                }
            }
            jacobian[(0, 2)] = seen.y;
            jacobian[(1, 2)] = -seen.x;
            jacobian[(2, 2)] = -1.0;
            jacobian[(2, 5)] = 1.0;
        }
    }

    fn residual_dim(&self) -> usize {
        3
    }

    fn jacobian_shape(&self) -> (usize, usize) {
        (3, 6)
    }
}

/// Reads a pose graph.
pub fn read(path: &str) -> Result<Posed, String> {
    let text = text(path)?;
    let mut problem = Problem::new(JacobianMode::Sparse);
    let mut keys = BTreeMap::new();
    for mut line in Line::all(path, &text) {
        let kind = line.word()?;
        match kind {
            "VERTEX_SE3:QUAT" => {
                let id: u64 = line.number()?;
                let [tx, ty, tz, x, y, z, w] = line.numbers()?;
                let numbers = pose(&vector(&[tx, ty, tz]), [x, y, z, w]);
                keys.insert(id, (problem.add_variable(ManifoldType::SE3, numbers), 6));
            }
            "VERTEX_SE2" => {
                let id: u64 = line.number()?;
                let numbers = DVector::from_row_slice(&line.numbers::<3>()?);
                keys.insert(id, (problem.add_variable(ManifoldType::RN, numbers), 3));
            }
            "EDGE_SE3:QUAT" | "EDGE_SE2" => {
                let [a, b]: [u64; 2] = [line.number()?, line.number()?];
                let (Some((a, _)), Some((b, size))) = (keys.get(&a), keys.get(&b)) else {
                    return Err(line.complaint(format!("no vertex {a} or no vertex {b}")));
                };
                let factor: Box<dyn Factor + Send + Sync> = if kind == "EDGE_SE2" {
                    Box::new(PlanarPoseFactor { measured: line.numbers()? })
                } else {
                    let [tx, ty, tz, x, y, z, w] = line.numbers()?;
                    let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                    Box::new(RelativePoseFactor { q, t: Vector3::new(tx, ty, tz) })
                };
                let mut information = DMatrix::zeros(*size, *size);
                for row in 0..*size {
                    for column in row..*size {
                        information[(row, column)] = line.number()?;
                        information[(column, row)] = information[(row, column)];
                    }
                }
                let noise = NoiseModel::from_information(information).map_err(|cause| line.complaint(cause))?;
                problem.add_residual_block_with_noise(&[*a, *b], factor, None, noise);
            }
            kind => return Err(line.complaint(format!("no kind of line `{kind}`"))),
        }
    }
    let (first, size) = keys.into_values().next().ok_or_else(|| format!("{path}: no vertices"))?;
    (0..size).for_each(|tangent| problem.fix_variable(first, tangent));
    Ok(Posed { problem, has_points: false })
}
