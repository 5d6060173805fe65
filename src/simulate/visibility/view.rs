//! One camera at one place: what lies in its frustum.

use nalgebra::{Matrix3, Point2, Point3, Vector3};

use crate::geometry::{PinholeCamera, Pose};

/// Limits of what is in view: depths and image positions, ends included but for the smallest depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// What is nearer is not in view, nor is what lies exactly there, metres.
    near_m: f64,
    /// What is farther is not in view, metres.
    far_m: f64,
    /// How far the image reaches beyond its first column and row, pixels.
    before_px: f64,
    /// How far the image reaches from the first column or row, less its size, pixels.
    after_px: f64,
}

impl Bounds {
    /// The image as squares about the centres of pixels: from −0.5 to size − 0.5.
    #[must_use]
    pub const fn whole_pixels([near_m, far_m]: [f64; 2]) -> Self {
        Self { near_m, far_m, before_px: -0.5, after_px: -0.5 }
    }

    /// The bounds of the first release: z over 0.01 m, 0 to size in pixels.
    #[must_use]
    pub const fn first_release() -> Self {
        Self { near_m: 0.01, far_m: f64::INFINITY, before_px: 0.0, after_px: 0.0 }
    }
}

/// A camera at a pose, with the bounds of its frustum.
#[derive(Clone, Debug)]
pub struct View {
    camera: PinholeCamera,
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    center: Point3<f64>,
    bounds: Bounds,
    /// Planes of the frustum in `world`, `n · x + d ≥ 0` inside.
    planes: [(Vector3<f64>, f64); 6],
}

impl View {
    /// The view of a camera from a pose.
    #[must_use]
    pub fn new(camera: PinholeCamera, world_from_camera: &Pose, bounds: Bounds) -> Self {
        let camera_from_world = world_from_camera.inverse();
        let rotation = camera_from_world.rotation_matrix();
        let translation = camera_from_world.translation();
        let mut view = Self {
            camera,
            rotation,
            translation,
            center: world_from_camera.translation().into(),
            bounds,
            planes: [(Vector3::zeros(), 0.0); 6],
        };
        let in_world = |(normal, offset): (Vector3<f64>, f64)| {
            (rotation.tr_mul(&normal), offset + normal.dot(&translation))
        };
        view.planes = view.camera_planes().map(in_world);
        view
    }

    /// Planes of the frustum in `camera`: `n · x + d ≥ 0` inside.
    fn camera_planes(&self) -> [(Vector3<f64>, f64); 6] {
        let PinholeCamera { fx, fy, cx, cy, width, height } = self.camera;
        let Bounds { near_m, far_m, before_px, after_px } = self.bounds;
        let far = if far_m.is_finite() { (-Vector3::z(), far_m) } else { (Vector3::zeros(), 1.0) };
        [
            (Vector3::z(), -near_m),
            far,
            (Vector3::new(fx, 0.0, cx - before_px), 0.0),
            (Vector3::new(-fx, 0.0, f64::from(width) + after_px - cx), 0.0),
            (Vector3::new(0.0, fy, cy - before_px), 0.0),
            (Vector3::new(0.0, -fy, f64::from(height) + after_px - cy), 0.0),
        ]
    }

    /// The camera centre, `world`, metres.
    #[must_use]
    pub const fn center(&self) -> Point3<f64> {
        self.center
    }

    /// A point in `camera`, metres.
    #[must_use]
    pub fn in_camera(&self, point_in_world: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.rotation * point_in_world.coords + self.translation)
    }

    /// Image position (pixels) and depth (metres) of a point in the frustum; `None` outside.
    #[must_use]
    pub fn project(&self, point_in_world: &Point3<f64>) -> Option<(Point2<f64>, f64)> {
        let point = self.in_camera(point_in_world);
        if !(point.z > self.bounds.near_m && point.z <= self.bounds.far_m) {
            return None;
        }
        let pixel = self.camera.project(point)?;
        self.in_image(pixel).then_some((pixel, point.z))
    }

    /// Image position (pixels) and depth (metres) of a point in front of the camera, in the frustum or not.
    #[must_use]
    pub fn project_unbounded(&self, point_in_world: &Point3<f64>) -> Option<(Point2<f64>, f64)> {
        let point = self.in_camera(point_in_world);
        Some((self.camera.project(point)?, point.z))
    }

    fn in_image(&self, pixel: Point2<f64>) -> bool {
        let Bounds { before_px, after_px, .. } = self.bounds;
        let inside = |at: f64, size: u32| at >= before_px && at <= f64::from(size) + after_px;
        inside(pixel.x, self.camera.width) && inside(pixel.y, self.camera.height)
    }

    /// Where an axis-aligned box lies: `None` wholly outside the frustum (never said of a box that is not),
    /// otherwise whether it is wholly inside (said only of one that is).
    #[must_use]
    pub fn classify(&self, low: &Point3<f64>, high: &Point3<f64>) -> Option<bool> {
        self.classify_box(&nalgebra::center(low, high), &(0.5 * (high - low)))
    }

    /// As [`classify`](Self::classify), of a box given by its middle and half its size.
    pub(super) fn classify_box(&self, center: &Point3<f64>, half: &Vector3<f64>) -> Option<bool> {
        let mut inside = true;
        for (normal, offset) in &self.planes {
            let distance = normal.dot(&center.coords) + offset;
            let reach = normal.abs().dot(half);
            // Rounding of the numbers above, generously.
            let slack = 1e-9 * (1.0 + distance.abs() + reach);
            if distance + reach < -slack {
                return None;
            }
            inside &= distance - reach > slack;
        }
        Some(inside)
    }

    /// The part of a segment in the frustum, as an interval of `start + t (end − start)`.
    #[must_use]
    pub fn clip(&self, start: &Point3<f64>, end: &Point3<f64>) -> Option<[f64; 2]> {
        let (start, end) = (self.in_camera(start).coords, self.in_camera(end).coords);
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        for (normal, offset) in self.camera_planes() {
            let (at_start, at_end) = (normal.dot(&start) + offset, normal.dot(&end) + offset);
            if at_start < 0.0 && at_end < 0.0 {
                return None;
            }
            // Of two ends on different sides, the crossing lies between 0 and 1.
            if at_start < 0.0 {
                low = low.max(at_start / (at_start - at_end));
            } else if at_end < 0.0 {
                high = high.min(at_start / (at_start - at_end));
            }
        }
        (low < high).then_some([low, high])
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use nalgebra::Vector6;
    use proptest::prelude::*;

    pub(crate) fn camera(upward: bool) -> PinholeCamera {
        let fy = if upward { -480.0 } else { 539.2 };
        PinholeCamera::new(535.4, fy, 320.1, 247.6, 640, 480).unwrap()
    }

    pub(crate) fn view() -> impl Strategy<Value = View> {
        (any::<bool>(), prop::array::uniform6(-2.0_f64..2.0)).prop_map(|(upward, tangent)| {
            let pose = Pose::exp(&Vector6::from(tangent));
            View::new(camera(upward), &pose, Bounds::whole_pixels([0.3, 8.0]))
        })
    }

    pub(crate) fn point(reach: f64) -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-reach..reach).prop_map(Point3::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]

        #[test]
        fn a_box_said_outside_has_no_point_in_view_and_one_said_inside_only_such(
            view in view(), low in point(5.0), size in prop::array::uniform3(0.01_f64..2.0),
            within in prop::collection::vec(prop::array::uniform3(0.0_f64..1.0), 20),
        ) {
            let high = low + Vector3::from(size);
            let found = view.classify(&low, &high);
            for part in within {
                let point = low + Vector3::from(size).component_mul(&Vector3::from(part));
                match found {
                    None => prop_assert!(view.project(&point).is_none()),
                    Some(true) => prop_assert!(view.project(&point).is_some()),
                    Some(false) => {}
                }
            }
        }

        #[test]
        fn the_clipped_part_is_what_is_in_view(view in view(), start in point(6.0), end in point(6.0)) {
            let part = view.clip(&start, &end);
            for step in 0..=200 {
                let t = f64::from(step) / 200.0;
                let inside = part.is_some_and(|[low, high]| (low..=high).contains(&t));
                // Within 1e-9 of a cut, rounding decides.
                let near_cut = part.is_some_and(|cuts| cuts.iter().any(|cut| (cut - t).abs() < 1e-9));
                if !near_cut {
                    prop_assert_eq!(view.project(&(start + (end - start) * t)).is_some(), inside, "{}", t);
                }
            }
        }
    }
}
