//! The pose of a camera from points and lines, by least squares.

use super::landmark_match::whitening;
use super::least_squares::{Normal, minimise};
use super::product::product;
use super::{Error, LineMatch, PinholeCamera, PointMatch, Pose, Residual, RobustLoss};
use nalgebra::linalg::SymmetricEigen;
use nalgebra::{Matrix3, Matrix4, Matrix6, SMatrix, Vector6};

/// What is sought here, in errors.
const WHAT: &str = "pose from points and lines";

/// Rounds in which weights are made anew where landmarks are uncertain.
const ROUNDS: usize = 3;

/// Least eigenvalue of the information, scaled to a unit diagonal, that still counts as knowing all six numbers.
const LEAST_INFORMATION: f64 = 1e-10;

/// A pose and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRefinement {
    /// The pose.
    pub camera_from_world: Pose,
    /// Information over the tangent `[rotation; translation]` of `camera_from_world`, applied on the left; 1/rad², 1/m².
    pub information: Matrix6<f64>,
    /// `½ Σ ρ(|r|²)` over the whitened residuals, squared sigma.
    pub cost: f64,
    /// Matches in it; those behind the camera at the start are left out.
    pub matches: usize,
}

/// The pose with the least weighted errors of points and lines (`PnPL`).
///
/// `min Σ ρ(eᵀ S⁻¹ e)`, `S = Σ_measured + J_X Σ_X J_Xᵀ`
///
/// with `e` of [`PointMatch::residual`] and [`LineMatch::residual`], by Levenberg-Marquardt on SE(3). `S` is held while the pose moves, and
/// made anew from where it arrived.
///
/// * `start` — `camera_from_world` to begin with.
/// * `sigma_px` — standard deviation of measured pixels.
///
/// # Errors
/// [`Error::TooFew`] when less than six numbers were measured, [`Error::Degenerate`] when they leave the pose open, and
/// [`Error::NotFinite`] for a sigma that is not a positive number.
pub fn refine_pose(
    camera: &PinholeCamera,
    sigma_px: f64,
    start: &Pose,
    points: &[PointMatch],
    lines: &[LineMatch],
    loss: RobustLoss,
) -> Result<PoseRefinement, Error> {
    if !(sigma_px > 0.0 && sigma_px.is_finite()) {
        return Err(Error::NotFinite { what: "sigma of pixels", found: sigma_px });
    }
    let mut problem = Problem { camera, sigma_px, loss, points: Vec::new(), lines: Vec::new() };
    let uncertain = points.iter().any(|point| point.covariance != Matrix3::zeros())
        || lines.iter().any(|line| line.covariance != Matrix4::zeros() || line.depths != [None; 2]);
    let mut pose = *start;
    let mut found: Option<PoseRefinement> = None;
    for _ in 0..if uncertain { ROUNDS } else { 1 } {
        let numbers = problem.weigh(&pose, points, lines);
        if numbers < 6 {
            return Err(Error::TooFew { what: WHAT, expected: 6, found: numbers });
        }
        let (next, normal) =
            minimise(pose, |pose| problem.normal(pose), |pose, step| Pose::exp(step) * *pose)
                .ok_or(Error::Degenerate { what: WHAT, reason: "the measurements leave it open" })?;
        let moved = (next * pose.inverse()).log();
        pose = next;
        let matches = problem.points.len() + problem.lines.len();
        found = Some(PoseRefinement {
            camera_from_world: pose,
            information: normal.hessian,
            cost: normal.cost,
            matches,
        });
        // A step far below sigma changes no weight.
        if moved.dot(&(normal.hessian * moved)) < 1e-6 {
            break;
        }
    }
    let found = found.ok_or(Error::Degenerate { what: WHAT, reason: "the measurements leave it open" })?;
    if !knows_all(&found.information) {
        return Err(Error::Degenerate { what: WHAT, reason: "the measurements leave it open" });
    }
    Ok(found)
}

/// Whether information over six numbers has rank six, whatever their units.
fn knows_all(information: &Matrix6<f64>) -> bool {
    let scale = information.diagonal().map(|entry| 1.0 / entry.sqrt());
    if !scale.iter().all(|entry| entry.is_finite() && *entry > 0.0) {
        return false;
    }
    let scaled = Matrix6::from_fn(|row, column| information[(row, column)] * scale[row] * scale[column]);
    SymmetricEigen::try_new(scaled, f64::EPSILON, 200)
        .is_some_and(|eigen| eigen.eigenvalues.min() > LEAST_INFORMATION)
}

/// The matches that are used, each with its whitening.
struct Problem<'a> {
    camera: &'a PinholeCamera,
    sigma_px: f64,
    loss: RobustLoss,
    points: Vec<(&'a PointMatch, Matrix3<f64>)>,
    lines: Vec<(&'a LineMatch, Matrix4<f64>)>,
}

impl<'a> Problem<'a> {
    /// Makes the weights at a pose; gives how many numbers were measured.
    fn weigh(&mut self, pose: &Pose, points: &'a [PointMatch], lines: &'a [LineMatch]) -> usize {
        let mut numbers = 0;
        self.points.clear();
        for point in points {
            let Some(residual) = point.residual(self.camera, pose, self.sigma_px) else { continue };
            let Some(weight) = whitening(&residual.covariance(&point.covariance)) else { continue };
            numbers += residual.count;
            self.points.push((point, weight));
        }
        self.lines.clear();
        for line in lines {
            let Some(residual) = line.residual(self.camera, pose, self.sigma_px) else { continue };
            let Some(weight) = whitening(&residual.covariance(&line.covariance)) else { continue };
            numbers += residual.count;
            self.lines.push((line, weight));
        }
        numbers
    }

    /// Normal equations at a pose; `None` where a match has no image.
    fn normal(&self, pose: &Pose) -> Option<Normal<6>> {
        let mut normal = Normal::new();
        for (point, weight) in &self.points {
            let residual = point.residual(self.camera, pose, self.sigma_px)?;
            self.add(&mut normal, &residual, weight);
        }
        for (line, weight) in &self.lines {
            let residual = line.residual(self.camera, pose, self.sigma_px)?;
            self.add(&mut normal, &residual, weight);
        }
        Some(normal)
    }

    fn add<const M: usize, const L: usize>(
        &self,
        normal: &mut Normal<6>,
        residual: &Residual<M, L>,
        weight: &SMatrix<f64, M, M>,
    ) {
        let error = product(weight, &residual.error);
        let by_pose = product(weight, &residual.by_pose);
        let [rho, slope] = self.loss.at(error.norm_squared());
        normal.cost += 0.5 * rho;
        let gradient: Vector6<f64> = by_pose.tr_mul(&error);
        normal.gradient += gradient * slope;
        normal.hessian += by_pose.tr_mul(&by_pose) * slope;
    }
}

#[cfg(test)]
mod tests;
