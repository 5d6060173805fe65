//! A factor graph of points, as `peer_export` writes it.

use crate::seen_point::{SeenPoint, pose, vector};
use crate::solve::Posed;
use crate::text_file::{Line, text};
use apex_solver::core::loss_functions::CauchyLoss;
use apex_solver::core::problem::Problem;
use apex_solver::manifold::LieGroup;
use apex_solver::manifold::se3::SE3;
use apex_solver::{Factor, JacobianMode, ManifoldType, NoiseModel, PriorFactor};
use nalgebra::{DVector, Matrix2x3};

/// `u = fx x/z + cx`, `v = fy y/z + cy`; the residual over a standard deviation.
struct PointFactor {
    camera: [f64; 4],
    pixel: [f64; 2],
    weight: f64,
}

impl Factor for PointFactor {
    fn linearize(&self, params: &[&[f64]], residual: &mut [f64], jacobian: Option<faer::MatMut<'_, f64>>) {
        let seen = SeenPoint::new(params[0], params[1]);
        let [fx, fy, cx, cy] = self.camera;
        let (p, inverse) = (seen.p, 1.0 / seen.p.z);
        residual[0] = self.weight * (fx * p.x * inverse + cx - self.pixel[0]);
        residual[1] = self.weight * (fy * p.y * inverse + cy - self.pixel[1]);
        if let Some(mut jacobian) = jacobian {
            let (a, b) = (self.weight * fx * inverse, self.weight * fy * inverse);
            let by_p = Matrix2x3::new(a, 0.0, -a * p.x * inverse, 0.0, b, -b * p.y * inverse);
            seen.write(&by_p, 6, &mut jacobian);
        }
    }

    fn residual_dim(&self) -> usize {
        2
    }

    fn jacobian_shape(&self) -> (usize, usize) {
        (2, 9)
    }
}

/// Reads a graph.
pub fn read(path: &str) -> Result<Posed, String> {
    let text = text(path)?;
    let mut problem = Problem::new(JacobianMode::Sparse);
    let (mut cameras, mut poses, mut points) = (Vec::new(), Vec::new(), Vec::new());
    let (mut camera_of, mut begun) = (Vec::new(), Vec::new());
    let (mut sigma, mut scale) = (1.0, 1.0);
    for mut line in Line::all(path, &text) {
        match line.word()? {
            "loss" => match line.word()? {
                "cauchy" => scale = line.number()?,
                name => return Err(line.complaint(format!("expected the loss cauchy; found {name}"))),
            },
            "sigma" => sigma = line.number()?,
            "cost" => {}
            "camera" => cameras.push(line.numbers::<4>()?),
            "pose" => {
                camera_of.push(line.of(&cameras)?);
                let is_held = line.word()? == "held";
                let [tx, ty, tz, x, y, z, w] = line.numbers()?;
                let numbers = pose(&vector(&[tx, ty, tz]), [x, y, z, w]);
                let key = problem.add_variable(ManifoldType::SE3, numbers.clone());
                if is_held {
                    (0..6).for_each(|tangent| problem.fix_variable(key, tangent));
                }
                poses.push((poses.len(), key));
                begun.push(numbers);
            }
            "prior" => {
                let (place, key) = line.of(&poses)?;
                let [turn, shift] = line.numbers()?;
                // Log(W₀⁻¹ W) is −Log(W⁻¹ W₀), of the same length as ours.
                let prior = PriorFactor::new(SE3::from_param_slice(begun[place].as_slice()));
                let noise = NoiseModel::from_sigmas(&[shift, shift, shift, turn, turn, turn]);
                let noise = noise.map_err(|cause| line.complaint(cause))?;
                problem.add_residual_block_with_noise(&[key], Box::new(prior), None, noise);
            }
            "point" => {
                let numbers = DVector::from_row_slice(&line.numbers::<3>()?);
                let key = problem.add_variable(ManifoldType::RN, numbers);
                problem.mark_for_elimination(key);
                points.push(key);
            }
            "point-view" => {
                let ((place, pose), point) = (line.of(&poses)?, line.of(&points)?);
                let pixel = line.numbers()?;
                let factor = PointFactor { camera: camera_of[place], pixel, weight: 1.0 / sigma };
                let loss = CauchyLoss::new(scale).map_err(|cause| line.complaint(cause))?;
                problem.add_residual_block(&[pose, point], Box::new(factor), Some(Box::new(loss)));
            }
            "line" | "line-view" => return Err("apex-solver has no factor of lines".to_owned()),
            kind => return Err(line.complaint(format!("no kind of line `{kind}`"))),
        }
    }
    Ok(Posed { problem, has_points: true })
}
