//! Poses in the plane: where they live, and the residual of one as seen from another.

use super::factor::Factor;
use super::parametrisation::{Parametrisation, PoseSpace, translation};
use super::problem::{Values, Variable};
use crate::geometry::Pose;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// `camera_from_world` of a pose that keeps the plane z = 0, by the numbers of [`PoseSpace`].
///
/// Steps are tangents `[turn about z; x; y]`, applied on the left; nothing leaves the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlanarPoseSpace;

/// Where a step in the plane stands in a tangent `[rotation; translation]` of space.
pub(super) const PLANE: [usize; 3] = [2, 3, 4];

impl Parametrisation for PlanarPoseSpace {
    fn is_pose(&self) -> bool {
        true
    }
    fn numbers(&self) -> usize {
        PoseSpace.numbers()
    }
    fn freedom(&self) -> usize {
        3
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        PoseSpace.plus(numbers, &[0.0, 0.0, step[0], step[1], step[2], 0.0], moved);
    }
}

/// Whether a pose keeps the plane z = 0.
pub(super) fn is_planar(pose: &Pose) -> bool {
    let ([_, _, z], [qx, qy, _, _]) = pose.components();
    [z, qx, qy] == [0.0; 3]
}

/// A frame as seen from another, both in the plane.
///
/// `r = W [θ; t]` of `Z⁻¹ T = (θ, t)`, with the measured `Z` and the predicted `T = frame_from_world · world_from_other`; θ in (−π, π].
///
/// # Source
/// Kümmerle et al. 2011, `g2o`: the error of its `EDGE_SE2`.
pub(super) struct PlanarPoseFactor {
    /// The frame and the other frame.
    variables: [Variable; 2],
    /// `Rᵀ` and `t` of `Z`.
    rotation_back: Matrix2<f64>,
    shift: Vector2<f64>,
    /// `W`: `WᵀW` is the information over `[θ; t]`.
    root: Matrix3<f64>,
}

impl PlanarPoseFactor {
    /// A measured relative pose.
    ///
    /// * `variables` — the frame and the other frame; `frame_from_other` — `Z`, which keeps the plane.
    /// * `root` — `W` with `WᵀW` the information over the tangent `ξ = [turn about z; x; y]` of `Exp(ξ) Z = T`.
    pub(super) fn new(variables: [Variable; 2], frame_from_other: &Pose, root: &Matrix3<f64>) -> Self {
        let r = frame_from_other.rotation_matrix();
        let rotation: Matrix2<f64> = r.fixed_view::<2, 2>(0, 0).into_owned();
        let shift = frame_from_other.translation().xy();
        // ξ = Ad(Z) [θ; t]: a turn about z also carries what it turns about.
        let mut adjoint = Matrix3::identity();
        adjoint.fixed_view_mut::<2, 2>(1, 1).copy_from(&rotation);
        (adjoint[(1, 0)], adjoint[(2, 0)]) = (shift.y, -shift.x);
        Self { variables, rotation_back: rotation.transpose(), shift, root: root * adjoint }
    }
}

impl Factor for PlanarPoseFactor {
    const RESIDUALS: usize = 3;
    type Variables = [Variable; 2];

    fn variables(&self) -> [Variable; 2] {
        self.variables
    }

    #[inline]
    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let (frame, other) = (values.of(self.variables[0]), values.of(self.variables[1]));
        let turn = turn(frame) * turn(other).transpose();
        let shift = translation(frame).xy() - turn * translation(other).xy();
        let back = self.rotation_back * turn;
        let away = self.rotation_back * (shift - self.shift);
        let angle = libm::atan2(back[(1, 0)], back[(0, 0)]);
        residual.copy_from_slice((self.root * Vector3::new(angle, away.x, away.y)).as_slice());
        if let Some(jacobian) = jacobian {
            // Z⁻¹ Exp(δ₁) T moves t by Rᵀ(v + ω × T.t), and Z⁻¹ T Exp(−δ₂) by −R v.
            let arm = self.rotation_back * Vector2::new(-shift.y, shift.x);
            let [p, b] = [&self.rotation_back, &back];
            let by_frame = Matrix3::new(
                1.0,
                0.0,
                0.0, //
                arm.x,
                p[(0, 0)],
                p[(0, 1)], //
                arm.y,
                p[(1, 0)],
                p[(1, 1)],
            );
            let by_other = Matrix3::new(
                -1.0,
                0.0,
                0.0, //
                0.0,
                -b[(0, 0)],
                -b[(0, 1)], //
                0.0,
                -b[(1, 0)],
                -b[(1, 1)],
            );
            let blocks = [self.root * by_frame, self.root * by_other];
            for (row, line) in jacobian.chunks_exact_mut(6).enumerate() {
                for (block, part) in blocks.iter().zip(line.chunks_exact_mut(3)) {
                    for (column, entry) in part.iter_mut().enumerate() {
                        *entry = block[(row, column)];
                    }
                }
            }
        }
        residual.iter().all(|number| number.is_finite())
    }
}

/// The rotation in the plane of a pose's numbers.
fn turn(numbers: &[f64]) -> Matrix2<f64> {
    Matrix2::new(numbers[7], numbers[8], numbers[10], numbers[11])
}
