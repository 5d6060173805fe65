//! A pose as it is stored: seven numbers, digits kept, not yet normalised.

use crate::geometry::{self, Pose};

/// `world_from_camera` as a file holds it.
///
/// The quaternion keeps the digits of its source; [`PoseRow::pose`] normalises it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseRow {
    /// Camera centre in `world`, metres.
    pub translation: [f64; 3],
    /// Hamilton quaternion, order x y z w, close to unit length.
    pub rotation_xyzw: [f64; 4],
}

impl PoseRow {
    /// The rigid transform `world_from_camera`.
    ///
    /// # Errors
    /// Those of [`Pose::from_components`]: a number that is not finite, or a quaternion without length.
    pub fn pose(&self) -> Result<Pose, geometry::Error> {
        Pose::from_components(self.translation, self.rotation_xyzw)
    }

    /// The seven numbers in file order: tx ty tz qx qy qz qw.
    #[must_use]
    pub const fn numbers(&self) -> [f64; 7] {
        let [tx, ty, tz] = self.translation;
        let [qx, qy, qz, qw] = self.rotation_xyzw;
        [tx, ty, tz, qx, qy, qz, qw]
    }

    /// A pose from the seven numbers in file order.
    #[must_use]
    pub const fn from_numbers([tx, ty, tz, qx, qy, qz, qw]: [f64; 7]) -> Self {
        Self { translation: [tx, ty, tz], rotation_xyzw: [qx, qy, qz, qw] }
    }
}

impl From<&Pose> for PoseRow {
    fn from(pose: &Pose) -> Self {
        let (translation, rotation_xyzw) = pose.components();
        Self { translation, rotation_xyzw }
    }
}

/// Gives a row whose seven pose columns are always present a constructor and an accessor.
macro_rules! stored_pose {
    ($name:ident { $($field:ident: $type:ty),+ } $(absent: $absent:ident)?) => {
        impl $name {
            /// A row with its pose.
            #[must_use]
            pub const fn new($($field: $type,)+ world_from_camera: PoseRow) -> Self {
                let [tx, ty, tz, qx, qy, qz, qw] = world_from_camera.numbers();
                Self {
                    $($field,)+
                    world_from_camera_tx: tx,
                    world_from_camera_ty: ty,
                    world_from_camera_tz: tz,
                    world_from_camera_qx: qx,
                    world_from_camera_qy: qy,
                    world_from_camera_qz: qz,
                    world_from_camera_qw: qw,
                    $($absent: None,)?
                }
            }

            /// The pose of the row.
            #[must_use]
            pub const fn world_from_camera(&self) -> PoseRow {
                PoseRow::from_numbers([
                    self.world_from_camera_tx,
                    self.world_from_camera_ty,
                    self.world_from_camera_tz,
                    self.world_from_camera_qx,
                    self.world_from_camera_qy,
                    self.world_from_camera_qz,
                    self.world_from_camera_qw,
                ])
            }
        }
    };
}
pub(crate) use stored_pose;
