//! A rigid transform with a scale.

use nalgebra::Point3;

use crate::geometry::{Pose, Segment};

/// A similarity transform: `x ↦ s R x + t`, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// The scale `s`, larger than 0.
    pub scale: f64,
    /// The rotation `R` and the translation `t`.
    pub pose: Pose,
}

impl Similarity {
    /// The transform that moves nothing.
    #[must_use]
    pub fn identity() -> Self {
        Self { scale: 1.0, pose: Pose::identity() }
    }

    /// A place: `s R x + t`.
    #[must_use]
    pub fn point(&self, point: Point3<f64>) -> Point3<f64> {
        self.pose * Point3::from(point.coords * self.scale)
    }

    /// A camera's pose: its centre moves as a point, its rotation turns with it.
    #[must_use]
    pub fn pose(&self, world_from_camera: &Pose) -> Pose {
        let scaled = Pose::new(world_from_camera.rotation(), world_from_camera.translation() * self.scale);
        self.pose * scaled
    }

    /// A segment: both ends.
    #[must_use]
    pub fn segment(&self, segment: &Segment) -> Segment {
        Segment { start: self.point(segment.start), end: self.point(segment.end) }
    }
}

impl From<Pose> for Similarity {
    fn from(pose: Pose) -> Self {
        Self { scale: 1.0, pose }
    }
}
