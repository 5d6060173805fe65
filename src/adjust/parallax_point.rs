//! Points by a direction from one frame and the parallax to another.

use super::factor::Factor;
use super::parametrisation::{DirectionSpace, Parametrisation, rotation, translation};
use super::point_factor::write_pose_columns;
use super::point_sight::PointSight;
use super::problem::{Values, Variable};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Least parallax with which a point begins, radians: a point farther away begins there.
const LEAST_PARALLAX: f64 = 1e-5;

/// A direction (9 numbers, as [`DirectionSpace`]) and a parallax `ω`, radians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ParallaxSpace;

impl Parametrisation for ParallaxSpace {
    fn numbers(&self) -> usize {
        10
    }
    fn freedom(&self) -> usize {
        3
    }
    fn plus(&self, numbers: &[f64], step: &[f64], moved: &mut [f64]) {
        DirectionSpace.plus(&numbers[..9], &step[..2], &mut moved[..9]);
        moved[9] = numbers[9] + step[2];
    }
}

/// Where a point is, and how that depends on what it is kept by.
pub(super) struct ParallaxPoint {
    pub(super) place: Vector3<f64>,
    /// By the centre of the main anchor.
    pub(super) by_main: Matrix3<f64>,
    /// By the centre of the associate anchor.
    pub(super) by_associate: Matrix3<f64>,
    /// By a step of direction and parallax.
    pub(super) by_form: Matrix3<f64>,
}

impl ParallaxPoint {
    /// The point of a direction and a parallax: `X = c_m + s d`, `s = b · d + |b × d| cot ω`, `b = c_a − c_m`.
    ///
    /// That is Zhao's `s = |b| sin(ω + φ)/sin ω` with `φ` the angle between `b` and `d`.
    pub(super) fn new(main: &Vector3<f64>, associate: &Vector3<f64>, numbers: &[f64]) -> Self {
        let frame = Matrix3::from_row_slice(&numbers[..9]);
        let [d, b1, b2] = [0, 1, 2].map(|k| frame.column(k).into_owned());
        let parallax = numbers[9];
        let (sine, cosine) = (libm::sin(parallax), libm::cos(parallax));
        let cotangent = cosine / sine;
        let b = associate - main;
        let along = b.dot(&d);
        let across = b - d * along;
        let width = across.norm();
        let s = along + width * cotangent;
        let by_baseline = d + across * (cotangent / width);
        let outer = d * by_baseline.transpose();
        // δd = s₂ b₁ − s₁ b₂; ∂s/∂d = b (1 − cot ω (b·d)/|b × d|) for steps across d.
        let slope = b * (1.0 - cotangent * along / width);
        let by_turn = |step: Vector3<f64>| step * s + d * slope.dot(&step);
        let columns = [by_turn(-b2), by_turn(b1), d * (-width / (sine * sine))];
        Self {
            place: main + d * s,
            by_main: Matrix3::identity() - outer,
            by_associate: outer,
            by_form: Matrix3::from_columns(&columns),
        }
    }

    /// The numbers of a point; `None` where it lies in a line with both anchors, or at one.
    pub(super) fn numbers_of(
        main: &Vector3<f64>,
        associate: &Vector3<f64>,
        place: &Vector3<f64>,
    ) -> Option<[f64; 10]> {
        let (from_main, from_associate) = (place - main, place - associate);
        let parallax = libm::atan2(from_main.cross(&from_associate).norm(), from_main.dot(&from_associate));
        let direction = from_main.try_normalize(1e-12)?;
        let off = (associate - main).cross(&direction).norm();
        if off <= 1e-9 || parallax <= 0.0 {
            return None;
        }
        let mut numbers = [0.0; 10];
        numbers[..9].copy_from_slice(&DirectionSpace::numbers_of(&direction));
        numbers[9] = parallax.max(LEAST_PARALLAX);
        Some(numbers)
    }
}

/// The centre of a pose's numbers: `−Rᵀ t`.
pub(super) fn centre(pose: &[f64]) -> Vector3<f64> {
    -(rotation(pose).transpose() * translation(pose))
}

/// A point of two anchors seen from some frame: `V` is 4 where that is neither anchor, and 3 where it is one of them.
///
/// # Source
/// Zhao, Huang, Sun, Yan and Dissanayake 2015, *`ParallaxBA`: bundle adjustment using parallax angle feature parametrization*; here the
/// direction moves by turns of a frame, so that no elevation is a special place.
pub(super) struct ParallaxFactor<S, const R: usize, const V: usize> {
    /// With `V = 4` frame, main, associate and point; with `V = 3` main, associate and point.
    pub(super) variables: [Variable; V],
    /// The frame among the variables: 0 for the frame itself or the main anchor, 1 for the associate anchor of `V = 3`.
    pub(super) frame: usize,
    pub(super) sight: S,
}

impl<S: PointSight<R>, const R: usize, const V: usize> Factor for ParallaxFactor<S, R, V> {
    const RESIDUALS: usize = R;
    type Variables = [Variable; V];

    fn variables(&self) -> [Variable; V] {
        self.variables
    }

    fn evaluate(&self, values: &Values<'_>, residual: &mut [f64], jacobian: Option<&mut [f64]>) -> bool {
        let (main, associate) = (V - 3, V - 2);
        let pose = |at: usize| values.of(self.variables[at]);
        let found = ParallaxPoint::new(
            &centre(pose(main)),
            &centre(pose(associate)),
            values.of(self.variables[V - 1]),
        );
        let (r, t) = (rotation(pose(self.frame)), translation(pose(self.frame)));
        let p = r * found.place + t;
        let Some((seen, by_point)) = self.sight.look(&p) else { return false };
        residual.copy_from_slice(seen.as_slice());
        if let Some(jacobian) = jacobian {
            let by_place = by_point * r;
            // c = −Rᵀ t moves by −Rᵀ v.
            let by_main: SMatrix<f64, R, 3> = by_place * found.by_main * -rotation(pose(main)).transpose();
            let by_associate: SMatrix<f64, R, 3> =
                by_place * found.by_associate * -rotation(pose(associate)).transpose();
            let by_form = by_place * found.by_form;
            let columns = 6 * (V - 1) + 3;
            for row in 0..R {
                let line = &mut jacobian[row * columns..(row + 1) * columns];
                line.fill(0.0);
                write_pose_columns(&by_point, row, &p, &mut line[6 * self.frame..6 * self.frame + 6]);
                for k in 0..3 {
                    line[6 * main + 3 + k] += by_main[(row, k)];
                    line[6 * associate + 3 + k] += by_associate[(row, k)];
                    line[6 * (V - 1) + k] = by_form[(row, k)];
                }
            }
        }
        true
    }
}
