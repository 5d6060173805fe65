//! Where the surfaces of the room are, and how they appear.

use nalgebra::{Point2, Point3, Vector3};
use open_structure::geometry::{PinholeCamera, Pose, Segment};
use open_structure::simulate::scene::Scene;
use open_structure::simulate::visibility::Occluders;

/// The surfaces of a scene.
pub(crate) struct Surfaces {
    triangles: Vec<[Point3<f64>; 3]>,
    occluders: Occluders,
}

impl Surfaces {
    pub(crate) fn new(scene: &Scene) -> Self {
        let of = |face: &open_structure::simulate::scene::Face| {
            let (first, second) = face.triangles();
            std::iter::once(first).chain(second)
        };
        Self { triangles: scene.faces.iter().flat_map(of).collect(), occluders: Occluders::new(scene) }
    }

    /// The nearest point of all surfaces.
    pub(crate) fn nearest(&self, point: &Point3<f64>) -> Point3<f64> {
        let candidates = self.triangles.iter().map(|triangle| nearest_on(triangle, point));
        candidates.min_by(|a, b| (a - point).norm().total_cmp(&(b - point).norm())).unwrap()
    }

    /// Depth of the surface that a camera shows at an image position, metres.
    pub(crate) fn depth(
        &self,
        camera: &PinholeCamera,
        scene_from_camera: &Pose,
        pixel: Point2<f64>,
    ) -> Option<f64> {
        let direction = scene_from_camera.transform_vector(&camera.back_project(pixel, 1.0).coords);
        let eye = Point3::from(scene_from_camera.translation());
        self.occluders.first_hit(&eye, &direction, 1e3).map(|hit| hit.along)
    }
}

/// The nearest point of a triangle: in its plane if that is inside, else on a side.
fn nearest_on(triangle: &[Point3<f64>; 3], point: &Point3<f64>) -> Point3<f64> {
    let [a, b, c] = *triangle;
    let normal = (b - a).cross(&(c - a)).normalize();
    let flat = point - normal * normal.dot(&(point - a));
    let sides = [[a, b], [b, c], [c, a]];
    if sides.iter().all(|[from, to]| (to - from).cross(&(flat - from)).dot(&normal) >= 0.0) {
        return flat;
    }
    let on_sides = sides.map(|[start, end]| nearest_on_segment(&Segment { start, end }, point));
    on_sides.into_iter().min_by(|a, b| (a - point).norm().total_cmp(&(b - point).norm())).unwrap()
}

/// The nearest point of a segment.
pub(crate) fn nearest_on_segment(segment: &Segment, point: &Point3<f64>) -> Point3<f64> {
    let along: Vector3<f64> = segment.end - segment.start;
    let part = (point - segment.start).dot(&along) / along.norm_squared();
    segment.start + along * part.clamp(0.0, 1.0)
}
