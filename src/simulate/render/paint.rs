//! Colours of surfaces, the same from every view.

use nalgebra::{Point3, Vector3};

use super::lattice::{Lattice, floor};
use super::marks::{Mark, Marks};
use super::shot::REACH_M;
use super::{Eye, pattern};
use crate::geometry::Segment;
use crate::simulate::scene::{Face, Scene};
use crate::simulate::visibility::{Hit, Occluders};
use crate::simulate::{Error, Simulation};

/// A colour: red, green, blue from 0 to 1.
pub(super) type Color = [f64; 3];

/// Radius of a point's disc at the usual distance, pixels.
const DISC_PX: f64 = 2.5;
/// Reach of a line's stripe to either side at the usual distance, pixels.
const STRIPE_PX: f64 = 6.0;
/// At this usual distance a scene is taken to be a room in metres.
const ROOM_DISTANCE_M: f64 = 3.0;
/// The usual distance is found from so many frames, spread evenly, and 8 × 6 rays of each.
const FRAMES_LOOKED_AT: usize = 32;

/// Paint on the faces of a scene: floors, walls, ceilings and furniture with corners and edges on them, and the
/// landmarks.
///
/// Everything is a function of the place on the face and of the recipe's seed.
#[derive(Clone, Debug)]
pub struct Paint<'a> {
    scene: &'a Scene,
    lattice: Lattice,
    marks: Marks,
    /// Size of a room of the scene, in rooms of some metres; a power of two.
    unit_m: f64,
}

/// A place on a face, with what painting asks about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Coordinates on the face, in units of the paint, the first along a side and the second across it.
    pub(super) at: [f64; 2],
    /// Size of the face along these, for a face of four corners.
    pub(super) size: Option<[f64; 2]>,
    /// Name of the face, or of the object whose faces are too small for names of their own.
    pub(super) key: i64,
    /// Name of the object that has the face.
    pub(super) object: i64,
    /// Upward part of the normal on the side that is seen.
    pub(super) up: f64,
    /// Size of a pixel here, in units of the paint.
    pub(super) pixel: f64,
}

impl<'a> Paint<'a> {
    /// The paint of a simulated sequence.
    ///
    /// * `eyes` — of all frames: patterns, discs and stripes are as large as their usual distance asks for.
    /// * `landmarks` — whether they are painted.
    ///
    /// # Errors
    /// [`Error::Geometry`] for a line without length.
    pub fn new(
        simulation: &'a Simulation,
        occluders: &Occluders,
        eyes: &[Eye],
        landmarks: bool,
    ) -> Result<Self, Error> {
        let distance_m = usual_distance(eyes, occluders);
        let pixel_m = eyes.first().map_or(0.002, Eye::pixel_m) * distance_m;
        let mut unit_m = 1.0;
        while unit_m * ROOM_DISTANCE_M * 2.0 < distance_m {
            unit_m *= 2.0;
        }
        while unit_m * ROOM_DISTANCE_M > distance_m * 2.0 {
            unit_m *= 0.5;
        }
        let (mut points, mut lines) = (Vec::new(), Vec::new());
        if landmarks {
            points =
                simulation.point_landmarks().iter().map(|row| Point3::new(row.x, row.y, row.z)).collect();
            let ends = |row: &crate::structure::LineLandmark| Segment {
                start: Point3::new(row.start_x, row.start_y, row.start_z),
                end: Point3::new(row.end_x, row.end_y, row.end_z),
            };
            lines = simulation.line_landmarks()?.iter().map(ends).collect();
        }
        let seed = simulation.manifest().generator.seed.unwrap_or(0);
        Ok(Self {
            scene: simulation.scene(),
            lattice: Lattice::new(seed),
            marks: Marks::new(points, lines, DISC_PX * pixel_m, STRIPE_PX * pixel_m),
            unit_m,
        })
    }

    /// The colour that an eye sees in a direction, given as a place in the image.
    pub(super) fn seen(&self, eye: &Eye, occluders: &Occluders, column: f64, row: f64) -> Color {
        let direction = eye.direction(column, row);
        match occluders.first_hit(&eye.center(), &direction, REACH_M) {
            Some(hit) => self.color(eye, &direction, &hit),
            None => sky(&direction),
        }
    }

    fn color(&self, eye: &Eye, direction: &Vector3<f64>, hit: &Hit) -> Color {
        let Some(face) = self.scene.faces.get(hit.face as usize) else { return [0.0; 3] };
        let place = eye.center() + direction * hit.along;
        // The side that is seen.
        let normal = if hit.normal.dot(direction) > 0.0 { -hit.normal } else { hit.normal };
        let on_face = self.on_face(face, hit.face, &place, &normal, eye.pixel_m() * hit.along);
        let mut color = pattern::color(&self.lattice, &on_face);
        match self.marks.at(&place, &normal) {
            Some(Mark::Point { index, radii }) => {
                let (inside, ring) = if index % 2 == 0 { (0.02, 1.0) } else { (1.0, 0.02) };
                // A disc of one tone in a ring of the other, which fades.
                let (tone, weight) = if radii < 1.0 { (inside, 1.0) } else { (ring, 0.9 * (2.0 - radii)) };
                color = color.map(|part| part + (tone - part) * weight);
            }
            Some(Mark::Line(widths)) => {
                let tone = if widths < 0.0 { 0.03 } else { 0.97 };
                let weight = 0.75 * (1.0 - widths.abs());
                color = color.map(|part| part + (tone - part) * weight);
            }
            None => {}
        }
        let light = light(&normal);
        color.map(|part| part * light)
    }

    fn on_face(
        &self,
        face: &Face,
        index: u32,
        place: &Point3<f64>,
        normal: &Vector3<f64>,
        pixel_m: f64,
    ) -> Place {
        let scale = 1.0 / self.unit_m;
        let (up, pixel, object) = (normal.z, pixel_m * scale, i64::from(face.object));
        if let [a, b, _, d] = face.corners()
            && let Some(along) = (b - a).try_normalize(0.0)
        {
            let across = (d - a) - along * along.dot(&(d - a));
            let width = across.norm();
            let across = if width > 0.0 { across / width } else { across };
            let from_corner = place - a;
            let mut at = [along.dot(&from_corner) * scale, across.dot(&from_corner) * scale];
            let mut size = [(b - a).norm() * scale, width * scale];
            // Upward goes last, so that pictures hang straight.
            if along.z.abs() > across.z.abs() {
                at.swap(0, 1);
                size.swap(0, 1);
            }
            return Place { at, size: Some(size), key: i64::from(index), object, up, pixel };
        }
        // Triangles of a mesh share a pattern that is laid along the two axes that they face least.
        let facing = normal.map(f64::abs).imax();
        let axes = [[1, 2], [0, 2], [0, 1]][facing];
        let key = (1 << 33) + object * 3 + [0, 1, 2][facing];
        Place { at: axes.map(|axis| place[axis] * scale), size: None, key, object, up, pixel }
    }
}

/// Brightness of a surface under an even sky, some light from one side and less from another.
fn light(normal: &Vector3<f64>) -> f64 {
    let (sun, lamp) = (Vector3::new(0.48, 0.36, 0.8), Vector3::new(-0.64, 0.6, 0.48));
    0.62 + 0.08 * normal.z + 0.26 * normal.dot(&sun).max(0.0) + 0.16 * normal.dot(&lamp).max(0.0)
}

/// Where there is no surface: without a corner or an edge.
fn sky(direction: &Vector3<f64>) -> Color {
    let up = 0.5 + 0.5 * direction.z / direction.norm();
    [0.82 - 0.35 * up, 0.87 - 0.25 * up, 0.92 - 0.08 * up]
}

/// The median depth of what the eyes see, metres.
fn usual_distance(eyes: &[Eye], occluders: &Occluders) -> f64 {
    let stride = eyes.len().div_ceil(FRAMES_LOOKED_AT).max(1);
    let mut depths: Vec<f64> = Vec::new();
    for eye in eyes.iter().step_by(stride) {
        let (width, height) = eye.size();
        for cell in 0..48 {
            let (column, row) = (f64::from(cell % 8) + 0.5, f64::from(cell / 8) + 0.5);
            let direction = eye.direction(column / 8.0 * f64::from(width), row / 6.0 * f64::from(height));
            depths.extend(occluders.first_hit(&eye.center(), &direction, REACH_M).map(|hit| hit.along));
        }
    }
    depths.sort_by(f64::total_cmp);
    depths.get(depths.len() / 2).copied().unwrap_or(ROOM_DISTANCE_M)
}

/// A whole number of the square that a place lies in, and where it lies there, from −0.5 to 0.5.
pub(super) fn square(at: [f64; 2], size: f64) -> ([i64; 2], [f64; 2]) {
    let scaled = at.map(|part| part / size);
    (scaled.map(floor), scaled.map(|part| part - part.floor() - 0.5))
}
