//! What of a pose is compared.

use serde::Serialize;

/// What of a pose is compared; the names and the definitions are those of evo.
///
/// `E = [R t; 0 1]` is the transform between what is and what should be, θ the angle of R.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Relation {
    /// `|t|`, metres.
    Translation,
    /// Frobenius norm `|R − I| = 2√2 sin(θ/2)`, without unit.
    RotationPart,
    /// Frobenius norm `|E − I| = √(|R − I|² + |t|²)`, without unit (metres and radians mixed).
    Full,
    /// θ, radians.
    AngleRad,
    /// θ, degrees.
    AngleDeg,
    /// Absolute: `|t|`. Relative: difference between the distances that both moved, metres, whatever their directions.
    PointDistance,
    /// [`Relation::PointDistance`] over the distance that the reference moved, percent; relative errors alone.
    PointDistanceRatio,
}

impl Relation {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Translation,
        Self::RotationPart,
        Self::Full,
        Self::AngleRad,
        Self::AngleDeg,
        Self::PointDistance,
        Self::PointDistanceRatio,
    ];

    /// The name as evo has it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation part",
            Self::RotationPart => "rotation part",
            Self::Full => "full transformation",
            Self::AngleRad => "rotation angle in radians",
            Self::AngleDeg => "rotation angle in degrees",
            Self::PointDistance => "point distance",
            Self::PointDistanceRatio => "point distance error ratio",
        }
    }

    /// The unit; `1` where there is none.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Translation | Self::PointDistance => "m",
            Self::RotationPart | Self::Full => "1",
            Self::AngleRad => "rad",
            Self::AngleDeg => "deg",
            Self::PointDistanceRatio => "%",
        }
    }
}
