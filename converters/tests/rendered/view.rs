//! What a frame observes, in the space of the scene.

use nalgebra::{Point2, Point3, Vector3};
use open_structure::geometry::{PinholeCamera, Pose, Segment};
use open_structure::structure::FrameBundle;
use open_structure_converters::generate::Generated;

use super::furnished::Room;
use super::truth::{Surfaces, nearest_on_segment};

/// Rays to either side between a place and the end of the slack: so many that depths of a steep surface are not missed.
const FINE: i32 = 6;

/// A frame with its camera.
pub(crate) struct View {
    /// The camera that took the images.
    camera: PinholeCamera,
    /// The camera of the sequence: the same, unless a test has changed it.
    stored: PinholeCamera,
    scene_from_camera: Pose,
    camera_from_scene: Pose,
    bundle: FrameBundle,
}

/// Every frame of a sequence.
pub(crate) fn views<'a>(room: &Room, sequence: &'a Generated) -> impl Iterator<Item = View> + 'a {
    let camera = room.simulation.manifest().cameras[0].projection();
    let scene_from_world = room.scene_from_world();
    (0..sequence.frames().len()).map(move |index| {
        let bundle = sequence.frame(index).unwrap();
        let scene_from_camera = scene_from_world * bundle.frame.world_from_camera().unwrap().pose().unwrap();
        View {
            camera,
            stored: sequence.manifest().cameras[0].projection(),
            scene_from_camera,
            camera_from_scene: scene_from_camera.inverse(),
            bundle,
        }
    })
}

impl View {
    /// Places of the points that are observed, with the landmarks' places in their table.
    pub(crate) fn points(&self) -> impl Iterator<Item = (usize, Point3<f64>)> + '_ {
        self.bundle.point_observations.iter().map(|seen| {
            (usize::try_from(seen.point_id.0).unwrap(), self.place(seen.u, seen.v, seen.depth.unwrap()))
        })
    }

    /// The parts of lines that are observed.
    pub(crate) fn lines(&self) -> impl Iterator<Item = (usize, Segment)> + '_ {
        self.bundle.line_observations.iter().map(|seen| {
            let part = Segment {
                start: self.place(seen.start_u, seen.start_v, seen.start_depth.unwrap()),
                end: self.place(seen.end_u, seen.end_v, seen.end_depth.unwrap()),
            };
            (usize::try_from(seen.line_id.0).unwrap(), part)
        })
    }

    fn place(&self, u: f64, v: f64, depth_m: f64) -> Point3<f64> {
        self.scene_from_camera * self.stored.back_project(Point2::new(u, v), depth_m)
    }

    /// Where a place appears, pixels.
    pub(crate) fn pixel(&self, place: &Point3<f64>) -> Point2<f64> {
        self.camera.project(self.camera_from_scene * *place).unwrap()
    }

    /// How deep a place is, metres.
    pub(crate) fn depth(&self, place: &Point3<f64>) -> f64 {
        (self.camera_from_scene * *place).z
    }

    /// The edge or painted line that a line is: at up to two degrees, its middle within three quarters of a pixel.
    ///
    /// Nearer than a pixel and a half there are edges of the walls' own patterns as well. `None` where another known line runs
    /// within five pixels: its paint changes what is between.
    pub(crate) fn known<'a>(&self, part: &Segment, known: &'a [Segment]) -> Option<&'a Segment> {
        let (direction, middle) = (part.direction().unwrap(), part.midpoint());
        let pixel_m = self.depth(&middle) / self.camera.fx;
        let parallel =
            |line: &Segment| line.direction().unwrap().dot(&direction).abs() > 2.0_f64.to_radians().cos();
        let apart = |line: &Segment| (nearest_on_segment(line, &middle) - middle).norm() / pixel_m;
        let mut near: Vec<&Segment> =
            known.iter().filter(|line| parallel(line) && apart(line) < 5.0).collect();
        near.sort_by(|a, b| apart(a).total_cmp(&apart(b)));
        let (first, others) = near.split_first()?;
        // A line painted on an edge is the edge.
        let same =
            |other: &&Segment| first.plucker().unwrap().distance_to_point(other.midpoint()) < 0.1 * pixel_m;
        (apart(first) < 0.75 && others.iter().all(same)).then_some(*first)
    }

    /// The image of the endless line of a segment: `a u + b v + c` is the distance from it, pixels.
    pub(crate) fn image(&self, line: &Segment) -> Vector3<f64> {
        let homogeneous = [line.start, line.end].map(|end| {
            let Point3 { coords } = self.camera_from_scene * end;
            let PinholeCamera { fx, fy, cx, cy, .. } = self.camera;
            Vector3::new(fx * coords.x + cx * coords.z, fy * coords.y + cy * coords.z, coords.z)
        });
        let image = homogeneous[0].cross(&homogeneous[1]);
        image / image.xy().norm()
    }

    /// How far a place appears from the image of a line, pixels; the sign tells the side.
    pub(crate) fn off_line_px(&self, place: &Point3<f64>, line: &Segment) -> f64 {
        let pixel = self.pixel(place);
        self.image(line).dot(&Vector3::new(pixel.x, pixel.y, 1.0))
    }

    /// Whether a surface appears where a place does, or at most so many pixels away, that is as deep: to a millimetre and the
    /// width of a pixel.
    pub(crate) fn shows(&self, surfaces: &Surfaces, place: &Point3<f64>, slack_px: f64) -> bool {
        let (pixel, depth_m) = (self.pixel(place), self.depth(place));
        let tolerance_m = 0.001 + depth_m / self.camera.fx;
        let steps = if slack_px > 0.0 { FINE } else { 0 };
        let offset = |step: i32| f64::from(step) * slack_px / f64::from(FINE);
        // The place itself first, which mostly is the answer.
        let around = (-steps..=steps).flat_map(|down| (-steps..=steps).map(move |right| (right, down)));
        std::iter::once((0, 0)).chain(around).any(|(right, down)| {
            let pixel = Point2::new(pixel.x + offset(right), pixel.y + offset(down));
            let found = surfaces.depth(&self.camera, &self.scene_from_camera, pixel);
            found.is_some_and(|found| (found - depth_m).abs() <= tolerance_m)
        })
    }
}
