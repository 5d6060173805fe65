//! The bound: how large the errors of poses have to be, by what the measurements say.

use super::error::Error;
use super::estimation::Estimation;
use super::grouping::Grouping;
use super::loss::Loss;
use super::observations::Observations;
use super::options::{Method, Options, Parallelism};
use super::pose_factor::adjoint;
use super::summary::Summary;
use super::uncertainty::Uncertainty;
use crate::structure::FactorGraph;
use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3};

/// What is taken off the errors before they are measured, as evaluations align an estimate with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Alignment {
    /// Nothing; the gauge of the graph counts.
    None,
    /// Turn and shift.
    #[default]
    Se3,
    /// Turn, shift and scale.
    Sim3,
}

/// The least errors that an unbiased estimate from these measurements can have, to first order (Cramér and Rao).
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Bound {
    /// Root mean square error of the camera centres over all poses, metres: what APE of translation compares with.
    pub translation_rms_m: f64,
    /// Root mean square error of the rotations over all poses, radians.
    pub rotation_rms_rad: f64,
    /// Poses, those that are held included.
    pub poses: usize,
    /// Whether the measurements leave the scale open; then it is held, and a bound without scale alignment takes it for known.
    pub is_scale_free: bool,
    /// What was used.
    pub summary: Summary,
}

/// The bound of a method on a graph whose values are the truth.
///
/// `Σ` is the inverse of the information `JᵀJ` at the truth, with the gauge held; errors of the aligned centres are `Q δ` with `Q` the
/// projector orthogonal to the alignment's tangents `G`, so that
///
/// `E|e|²/N = (tr Σ_cc − tr(Uᵀ Σ_cc U))/N`,  `U` an orthonormal basis of `G` (3N × 6, or 7 with the scale).
///
/// Rotations are aligned by the centres too, as evaluations do: `δθᵢ − A δc`, `A` the turn's rows of `(GᵀG)⁻¹ Gᵀ`. Outliers and a robust
/// loss are left out of account: it is the bound for the noise that is declared.
///
/// * `graph` — values are the truth; poses as `world_from_camera`, metres.
///
/// # Errors
/// Those of [`adjust`](super::adjust()), and [`Error::Singular`] where something is left open.
pub fn bound(graph: &FactorGraph, options: &Options, alignment: Alignment) -> Result<Bound, Error> {
    let options = Options { loss: Loss::None, ..options.clone() };
    options.check()?;
    let mut summary = Summary::default();
    let mut observations = Observations::of(graph, &options, &mut summary)?;
    // The alignment below is one of space.
    observations.planar = false;
    let mut grouping = Grouping::none(&observations);
    if options.method == Method::Structural && options.parallelism != Parallelism::Ignored {
        grouping = Grouping::given(graph, &observations, &mut summary);
    }
    let mut estimation = Estimation::new(&observations, &grouping, &options, &mut summary)?;
    let is_scale_free = estimation.hold_scale(&observations)?;
    let uncertainty = Uncertainty::of(&estimation.problem)?;
    let poses = observations.frames.len();
    // δ of world_from_camera on the left, and of the centre: δc = v + ω × c.
    let blocks = uncertainty.blocks(&estimation.problem, &estimation.poses);
    let centres: Vec<Vector3<f64>> =
        observations.frames.iter().map(|frame| frame.camera_from_world.inverse().translation()).collect();
    let moves: Vec<SMatrix<f64, 6, 6>> = observations
        .frames
        .iter()
        .zip(&centres)
        .map(|(frame, centre)| {
            let mut turned = -adjoint(&frame.camera_from_world.inverse());
            let shift =
                turned.fixed_view::<3, 6>(3, 0) - centre.cross_matrix() * turned.fixed_view::<3, 6>(0, 0);
            turned.fixed_view_mut::<3, 6>(3, 0).copy_from(&shift);
            turned
        })
        .collect();
    let (mut turns, mut shifts) = (0.0, 0.0);
    for (block, moved) in blocks.iter().zip(&moves) {
        let block: SMatrix<f64, 6, 6> = block.fixed_view::<6, 6>(0, 0).into_owned();
        let covariance = moved * block * moved.transpose();
        turns += covariance.fixed_view::<3, 3>(0, 0).trace();
        shifts += covariance.fixed_view::<3, 3>(3, 3).trace();
    }
    let freedom = match alignment {
        Alignment::None => 0,
        Alignment::Se3 => 6,
        Alignment::Sim3 => 7,
    };
    if freedom > 0 {
        let mean = centres.iter().sum::<Vector3<f64>>() / poses as f64;
        let mut tangents = DMatrix::zeros(3 * poses, freedom);
        for (at, centre) in centres.iter().enumerate() {
            let arm = centre - mean;
            let mut rows = tangents.rows_mut(3 * at, 3);
            rows.view_mut((0, 0), (3, 3)).copy_from(&-arm.cross_matrix());
            rows.view_mut((0, 3), (3, 3)).copy_from(&Matrix3::identity());
            if freedom == 7 {
                rows.view_mut((0, 6), (3, 1)).copy_from(&arm);
            }
        }
        // (GᵀG)⁻¹ with what a straight path leaves open left out.
        let gram = tangents.transpose() * &tangents;
        let scale = gram.diagonal().amax().max(f64::MIN_POSITIVE);
        let inverse = gram.clone().pseudo_inverse(1e-12 * scale).map_err(|_| Error::Singular)?;
        let mut functional = DMatrix::zeros(uncertainty.unknowns(), freedom);
        for ((at, variable), moved) in estimation.poses.iter().enumerate().zip(&moves) {
            let Some(range) = uncertainty.range(*variable) else { continue };
            let part = moved.fixed_view::<3, 6>(3, 0).transpose() * tangents.rows(3 * at, 3);
            functional.rows_mut(range.start, 6).copy_from(&part);
        }
        let solved = uncertainty.times(&functional);
        // Covariance of the fitted alignment: (GᵀG)⁻¹ Gᵀ Σ G (GᵀG)⁻¹.
        let fitted = &inverse * (functional.transpose() * &solved) * &inverse;
        shifts -= (&fitted * &gram).trace();
        let turn_of_fit = fitted.view((0, 0), (3, 3)).trace();
        let solved = solved * &inverse;
        for (variable, moved) in estimation.poses.iter().zip(&moves) {
            turns += turn_of_fit;
            if let Some(range) = uncertainty.range(*variable) {
                let cross = moved.fixed_view::<3, 6>(0, 0) * solved.view((range.start, 0), (6, 3));
                turns -= 2.0 * (0..3).map(|k| cross[(k, k)]).sum::<f64>();
            }
        }
    }
    let rms = |sum: f64| (sum.max(0.0) / poses as f64).sqrt();
    Ok(Bound { translation_rms_m: rms(shifts), rotation_rms_rad: rms(turns), poses, is_scale_free, summary })
}
