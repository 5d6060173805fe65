//! A problem of Bundle Adjustment in the Large: poses, focal lengths, two coefficients of radial distortion and points.

use crate::seen_point::{SeenPoint, pose, vector};
use crate::solve::Posed;
use crate::text_file::text;
use apex_solver::core::problem::Problem;
use apex_solver::{Factor, JacobianMode, ManifoldType};
use nalgebra::{DVector, Matrix2, Matrix2x3, UnitQuaternion, Vector2};

/// `p = −P.xy/P.z`, `r = f (1 + k₁ |p|² + k₂ |p|⁴) p − measured`.
struct BalFactor {
    pixel: Vector2<f64>,
}

impl Factor for BalFactor {
    fn linearize(&self, params: &[&[f64]], residual: &mut [f64], jacobian: Option<faer::MatMut<'_, f64>>) {
        let seen = SeenPoint::new(params[0], params[2]);
        let (f, k1, k2) = (params[1][0], params[1][1], params[1][2]);
        let inverse = -1.0 / seen.p.z;
        let p = seen.p.xy() * inverse;
        let radius = p.norm_squared();
        let distortion = 1.0 + radius * (k1 + k2 * radius);
        residual.copy_from_slice((p * (f * distortion) - self.pixel).as_slice());
        if let Some(mut jacobian) = jacobian {
            let by_p =
                (Matrix2::identity() * distortion + p * p.transpose() * (2.0 * (k1 + 2.0 * k2 * radius))) * f;
            let mut by_seen = Matrix2x3::zeros();
            by_seen.fixed_view_mut::<2, 2>(0, 0).copy_from(&(by_p * inverse));
            by_seen.set_column(2, &(by_p * p * inverse));
            seen.write(&by_seen, 9, &mut jacobian);
            for row in 0..2 {
                jacobian[(row, 6)] = distortion * p[row];
                jacobian[(row, 7)] = f * radius * p[row];
                jacobian[(row, 8)] = f * radius * radius * p[row];
            }
        }
    }

    fn residual_dim(&self) -> usize {
        2
    }

    fn jacobian_shape(&self) -> (usize, usize) {
        (2, 12)
    }
}

/// Reads a problem.
pub fn read(path: &str) -> Result<Posed, String> {
    let text = text(path)?;
    let mut words = text.split_ascii_whitespace();
    let mut number = || -> Result<f64, String> {
        let word = words.next().ok_or_else(|| format!("{path}: ends too early"))?;
        word.parse().map_err(|_| format!("{path}: expected a number; found {word}"))
    };
    let [cameras, points, views] = [number()? as usize, number()? as usize, number()? as usize];
    let mut seen = Vec::with_capacity(views);
    for _ in 0..views {
        seen.push((number()? as usize, number()? as usize, Vector2::new(number()?, number()?)));
    }
    let mut problem = Problem::new(JacobianMode::Sparse);
    let mut camera_keys = Vec::with_capacity(cameras);
    for _ in 0..cameras {
        let mut numbers = [0.0; 9];
        for entry in &mut numbers {
            *entry = number()?;
        }
        let world_from_camera = UnitQuaternion::from_scaled_axis(vector(&numbers)).inverse();
        let centre = -(world_from_camera * vector(&numbers[3..]));
        let [x, y, z, w] = world_from_camera.coords.into();
        let pose = problem.add_variable(ManifoldType::SE3, pose(&centre, [x, y, z, w]));
        let lens = problem.add_variable(ManifoldType::RN, DVector::from_row_slice(&numbers[6..]));
        camera_keys.push((pose, lens));
    }
    let mut point_keys = Vec::with_capacity(points);
    for _ in 0..points {
        let numbers = DVector::from_row_slice(&[number()?, number()?, number()?]);
        let key = problem.add_variable(ManifoldType::RN, numbers);
        problem.mark_for_elimination(key);
        point_keys.push(key);
    }
    for (camera, point, pixel) in seen {
        let (Some((pose, lens)), Some(point)) = (camera_keys.get(camera), point_keys.get(point)) else {
            return Err(format!("{path}: no camera {camera} or no point {point}"));
        };
        problem.add_residual_block(&[*pose, *lens, *point], Box::new(BalFactor { pixel }), None);
    }
    Ok(Posed { problem, has_points: true })
}
