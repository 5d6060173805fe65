//! The methods that a benchmark compares.

use serde::{Deserialize, Serialize};

/// A method: a tracker, or an optimiser that begins with the robust map-to-frame tracker's estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The paper's plain frame-to-frame tracker.
    FrameToFrameClassic,
    /// The paper's plain map-to-frame tracker.
    MapToFrameClassic,
    /// The robust frame-to-frame tracker.
    FrameToFrame,
    /// The robust map-to-frame tracker.
    MapToFrame,
    /// The paper's Point-BA, monocular.
    PointBa,
    /// The paper's PointLine-BA, monocular.
    PointLineBa,
    /// Depth, the declared noise and parallel groups.
    StructuralBa,
}

impl Method {
    /// Every method, in the order of the table.
    pub const ALL: [Self; 7] = [
        Self::FrameToFrameClassic,
        Self::MapToFrameClassic,
        Self::PointBa,
        Self::PointLineBa,
        Self::FrameToFrame,
        Self::MapToFrame,
        Self::StructuralBa,
    ];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FrameToFrameClassic => "frame-to-frame-classic",
            Self::MapToFrameClassic => "map-to-frame-classic",
            Self::FrameToFrame => "frame-to-frame",
            Self::MapToFrame => "map-to-frame",
            Self::PointBa => "point-ba",
            Self::PointLineBa => "point-line-ba",
            Self::StructuralBa => "structural-ba",
        }
    }

    /// The method of a name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }

    /// The column of the paper's table that it stands beside.
    #[must_use]
    pub const fn in_paper(self) -> &'static str {
        match self {
            Self::FrameToFrameClassic | Self::FrameToFrame => "frame-to-frame",
            Self::MapToFrameClassic | Self::MapToFrame => "map-to-frame",
            Self::PointBa => "point-ba",
            Self::PointLineBa | Self::StructuralBa => "point-line-ba",
        }
    }

    /// Whether it gives a cost over iterations.
    #[must_use]
    pub const fn is_adjustment(self) -> bool {
        matches!(self, Self::PointBa | Self::PointLineBa | Self::StructuralBa)
    }
}
