//! Errors of one kind, in order.

use super::{Relation, Statistics};

/// Errors of one kind: one for each pose or pair of poses, at least one.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    relation: Relation,
    values: Vec<f64>,
    statistics: Statistics,
}

impl Errors {
    /// `None` without any value.
    pub(super) fn new(relation: Relation, values: Vec<f64>) -> Option<Self> {
        let statistics = Statistics::of(&values)?;
        Some(Self { relation, values, statistics })
    }

    /// What is compared.
    #[must_use]
    pub fn relation(&self) -> Relation {
        self.relation
    }

    /// The errors in the order of the poses, in the relation's unit, 0 or larger.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// What they amount to.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// The root of the mean square, in the relation's unit.
    #[must_use]
    pub fn rmse(&self) -> f64 {
        self.statistics.rmse
    }

    /// The one in the middle, in the relation's unit.
    #[must_use]
    pub fn median(&self) -> f64 {
        self.statistics.median
    }
}

/// Frobenius norm of `R − I` for a rotation by an angle (radians): `2√2 sin(θ/2)`.
fn chord(angle: f64) -> f64 {
    2.0 * std::f64::consts::SQRT_2 * libm::sin(0.5 * angle)
}

/// Errors of a relation that follows from distance (metres) and angle (radians) of each error; `None` for the others.
pub(super) fn of_distance_and_angle(
    relation: Relation,
    translation: &Errors,
    rotation: &Errors,
) -> Option<Errors> {
    let (distances, angles) = (&translation.values, &rotation.values);
    let values = match relation {
        Relation::Translation => return Some(translation.clone()),
        Relation::AngleRad => return Some(rotation.clone()),
        Relation::AngleDeg => angles.iter().map(|angle| angle.to_degrees()).collect(),
        Relation::RotationPart => angles.iter().map(|angle| chord(*angle)).collect(),
        Relation::Full => distances
            .iter()
            .zip(angles)
            .map(|(distance, angle)| libm::hypot(chord(*angle), *distance))
            .collect(),
        Relation::PointDistance | Relation::PointDistanceRatio => return None,
    };
    Errors::new(relation, values)
}

#[cfg(test)]
mod tests {
    use super::super::strategies::pose;
    use super::*;
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn parts_are_the_frobenius_norms_of_the_matrix(error in pose()) {
            let translation = Errors::new(Relation::Translation, vec![error.translation().norm()]).unwrap();
            let rotation = Errors::new(Relation::AngleRad, vec![error.rotation_angle()]).unwrap();
            let found = |relation| of_distance_and_angle(relation, &translation, &rotation).unwrap().values()[0];
            let part = (error.rotation_matrix() - Matrix3::identity()).norm();
            // Rounding of a matrix of a quaternion.
            prop_assert!((found(Relation::RotationPart) - part).abs() < 1e-14);
            let full = (part.powi(2) + error.translation().norm_squared()).sqrt();
            prop_assert!((found(Relation::Full) - full).abs() < 1e-13);
        }
    }
}
