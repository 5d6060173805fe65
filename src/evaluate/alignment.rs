//! How an estimate is laid on the reference before they are compared.

use std::fmt;

/// How an estimate is laid on the reference before they are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Alignment {
    /// What may move.
    pub kind: AlignmentKind,
    /// Only the first so many matched poses are laid upon each other (and all are moved); all when `None`.
    pub first: Option<usize>,
}

/// What an alignment may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AlignmentKind {
    /// Nothing.
    None,
    /// The first matched poses are laid upon each other, with their rotations.
    Origin,
    /// Rotation and translation, so that the sum of squares of the distances between positions is least.
    Se3,
    /// Rotation, translation and scale, so that this sum is least.
    Sim3,
    /// The scale of [`AlignmentKind::Sim3`] alone, about the origin; evo's `-s` without `-a`.
    Scale,
}

impl Alignment {
    /// Nothing moves.
    pub const NONE: Self = Self::all(AlignmentKind::None);
    /// The first poses are laid upon each other.
    pub const ORIGIN: Self = Self::all(AlignmentKind::Origin);
    /// Rotation and translation, over all poses.
    pub const SE3: Self = Self::all(AlignmentKind::Se3);
    /// Rotation, translation and scale, over all poses.
    pub const SIM3: Self = Self::all(AlignmentKind::Sim3);
    /// Scale alone, over all poses.
    pub const SCALE: Self = Self::all(AlignmentKind::Scale);

    const fn all(kind: AlignmentKind) -> Self {
        Self { kind, first: None }
    }

    /// The same over the first matched poses alone.
    #[must_use]
    pub const fn over_first(self, poses: usize) -> Self {
        Self { first: Some(poses), ..self }
    }

    /// Whether it may change lengths; only then it changes relative errors.
    #[must_use]
    pub const fn scales(self) -> bool {
        matches!(self.kind, AlignmentKind::Sim3 | AlignmentKind::Scale)
    }
}

impl fmt::Display for Alignment {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = match self.kind {
            AlignmentKind::None => "none",
            AlignmentKind::Origin => "origin",
            AlignmentKind::Se3 => "SE(3)",
            AlignmentKind::Sim3 => "Sim(3)",
            AlignmentKind::Scale => "scale",
        };
        formatter.write_str(words)?;
        match self.first {
            Some(poses) => write!(formatter, " over the first {poses}"),
            None => Ok(()),
        }
    }
}
