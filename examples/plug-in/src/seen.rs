//! A factor of one's own: where a camera saw a point that is kept as direction and distance.

use nalgebra::{Matrix2x3, Matrix3, Point2, Point3, Vector3};
use open_structure::adjust::{Factor, Values, Variable};
use open_structure::geometry::{PinholeCamera, Pose};

use crate::bearing::across;

/// `r = (π(camera_from_anchor · e^λ b) − u) / σ` for a point at the direction b and the distance `e^λ` from its anchor.
///
/// Poses are held; a system that moves them adds their variables.
#[derive(Debug)]
pub struct Seen {
    /// The point, in [`BearingSpace`](crate::bearing::BearingSpace).
    pub point: Variable,
    /// From the place that saw the point first to the camera.
    pub camera_from_anchor: Pose,
    /// The camera.
    pub camera: PinholeCamera,
    /// Where the point was measured, pixels.
    pub pixel: Point2<f64>,
    /// Standard deviation of u and v, pixels.
    pub sigma_px: f64,
}

impl Factor for Seen {
    const RESIDUALS: usize = 2;
    type Variables = [Variable; 1];

    fn variables(&self) -> [Variable; 1] {
        [self.point]
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let numbers = values.of(self.point);
        let direction = Vector3::new(numbers[0], numbers[1], numbers[2]);
        let distance = numbers[3].exp();
        let seen = self.camera_from_anchor * Point3::from(direction * distance);
        let Some(image) = self.camera.project(seen) else { return false };
        let error = (image - self.pixel) / self.sigma_px;
        residual.copy_from_slice(error.as_slice());
        if let Some(jacobian) = jacobian {
            let (x, y, z) = (seen.x, seen.y, seen.z);
            let (fx, fy) = (self.camera.fx / z / self.sigma_px, self.camera.fy / z / self.sigma_px);
            let by_seen = Matrix2x3::new(fx, 0.0, -fx * x / z, 0.0, fy, -fy * y / z);
            let columns = across(&direction) * distance;
            let by_step = Matrix3::from_columns(&[
                columns.column(0).into(),
                columns.column(1).into(),
                direction * distance,
            ]);
            let by_step = by_seen * self.camera_from_anchor.rotation_matrix() * by_step;
            // Row by row.
            jacobian.copy_from_slice(by_step.transpose().as_slice());
        }
        true
    }
}
