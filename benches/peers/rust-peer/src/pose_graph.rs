//! A pose graph in g2o's text form, in three dimensions or two, its first vertex held.

use crate::seen_point::{pose, rotation, vector};
use crate::solve::Posed;
use crate::text_file::{Line, text};
use apex_solver::core::problem::Problem;
use apex_solver::{Factor, JacobianMode, ManifoldType, NoiseModel};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Quaternion, UnitQuaternion, Vector2, Vector3};
use std::collections::BTreeMap;

/// `[t; 2 vec q]` of `Z⁻¹ Xₐ⁻¹ X_b`, with the measured pose Z of b in a.
struct RelativePoseFactor {
    q: UnitQuaternion<f64>,
    t: Vector3<f64>,
}

impl Factor for RelativePoseFactor {
    fn linearize(&self, params: &[&[f64]], residual: &mut [f64], jacobian: Option<faer::MatMut<'_, f64>>) {
        let (qa, qb) = (rotation(params[0]), rotation(params[1]));
        let (seen, a_from_b) = (qa.inverse() * (vector(params[1]) - vector(params[0])), qa.inverse() * qb);
        let error: Quaternion<f64> = (self.q.inverse() * a_from_b).into_inner();
        let v = error.imag();
        residual[..3].copy_from_slice((self.q.inverse() * (seen - self.t)).as_slice());
        residual[3..].copy_from_slice((v * 2.0).as_slice());
        if let Some(mut jacobian) = jacobian {
            jacobian.fill(0.0);
            // Steps on the right: q Exp(θ) moves 2 vec q by (w I + [v]ₓ) θ, and one of a comes with −R_abᵀ.
            let inverse = self.q.inverse().to_rotation_matrix().into_inner();
            let a_from_b = a_from_b.to_rotation_matrix().into_inner();
            let turn_b = Matrix3::identity() * error.w + v.cross_matrix();
            let turn_a = -turn_b * a_from_b.transpose();
            let (shift_b, shift_turn) = (inverse * a_from_b, inverse * seen.cross_matrix());
            for row in 0..3 {
                for column in 0..3 {
                    jacobian[(row, column)] = -inverse[(row, column)];
                    jacobian[(row, 3 + column)] = shift_turn[(row, column)];
                    jacobian[(row, 6 + column)] = shift_b[(row, column)];
                    jacobian[(3 + row, 3 + column)] = turn_a[(row, column)];
                    jacobian[(3 + row, 9 + column)] = turn_b[(row, column)];
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

/// `[x y θ]` of `Z⁻¹ Xₐ⁻¹ X_b`, the angle wrapped.
struct PlanarPoseFactor {
    measured: [f64; 3],
}

/// The inverse of the rotation by an angle.
fn inverse_rotation(angle: f64) -> Matrix2<f64> {
    let (sine, cosine) = angle.sin_cos();
    Matrix2::new(cosine, sine, -sine, cosine)
}

impl Factor for PlanarPoseFactor {
    fn linearize(&self, params: &[&[f64]], residual: &mut [f64], jacobian: Option<faer::MatMut<'_, f64>>) {
        let (a, b) = (params[0], params[1]);
        let [x, y, angle] = self.measured;
        let (of_a, of_measured) = (inverse_rotation(a[2]), inverse_rotation(angle));
        let seen = of_a * Vector2::new(b[0] - a[0], b[1] - a[1]);
        let turn = b[2] - a[2] - angle;
        residual[..2].copy_from_slice((of_measured * (seen - Vector2::new(x, y))).as_slice());
        residual[2] = turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round();
        if let Some(mut jacobian) = jacobian {
            jacobian.fill(0.0);
            let both = of_measured * of_a;
            let by_turn = of_measured * Vector2::new(seen.y, -seen.x);
            for row in 0..2 {
                for column in 0..2 {
                    jacobian[(row, column)] = -both[(row, column)];
                    jacobian[(row, 3 + column)] = both[(row, column)];
                }
                jacobian[(row, 2)] = by_turn[row];
            }
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
                let noise =
                    NoiseModel::from_information(information).map_err(|cause| line.complaint(cause))?;
                problem.add_residual_block_with_noise(&[*a, *b], factor, None, noise);
            }
            kind => return Err(line.complaint(format!("no kind of line `{kind}`"))),
        }
    }
    let (first, size) = keys.into_values().next().ok_or_else(|| format!("{path}: no vertices"))?;
    (0..size).for_each(|tangent| problem.fix_variable(first, tangent));
    Ok(Posed { problem, has_points: false })
}
