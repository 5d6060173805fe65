//! Observations and measurements of points: pixels, depths, residuals against the truth.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

use super::finding::{Detail, Findings};
use super::fit::Fit;
use super::frame_rows::{Books, FrameRows, Pixels};
use super::frames::{CameraFromWorld, View};
use super::ids::Unknown;
use super::noise::{Residual, Sample};
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use super::world::World;
use crate::structure::{PointMeasurement, PointObservation, Record};

/// Nearer than this (metres, along the optical axis) nothing has an image.
pub(crate) const NEAREST_Z: f64 = 1e-9;
/// How far a noise-free observation may be from its landmark's image, pixels.
pub(crate) const REPROJECTION_PX: f64 = 0.5;
/// How far a noise-free depth may be from its landmark's, metres, and as a part of the depth.
const DEPTH_M: f64 = 0.01;

/// A row that shows a point.
pub(crate) trait PointRow: Record {
    /// Whether the row carries noise.
    const MEASURED: bool;
    /// Frame, point, u, v, depth.
    fn parts(&self) -> (i64, i64, f64, f64, Option<f64>);
}

macro_rules! point_row {
    ($name:ident, $measured:literal) => {
        impl PointRow for $name {
            const MEASURED: bool = $measured;
            #[inline]
            fn parts(&self) -> (i64, i64, f64, f64, Option<f64>) {
                (self.frame_id.0, self.point_id.0, self.u, self.v, self.depth)
            }
        }
    };
}
point_row!(PointObservation, false);
point_row!(PointMeasurement, true);

/// Rows of one landmark that do not show it where it is.
#[derive(Clone, Debug)]
pub(crate) struct Astray {
    pub(crate) row: u64,
    pub(crate) count: u64,
    pub(crate) expected: String,
    pub(crate) found: String,
}

/// What was learnt from a table of rows with `N`-dimensional landmarks.
pub(crate) struct Seen<const N: usize> {
    pub(crate) outcome: Outcome,
    pub(crate) books: Books,
    /// Which landmarks are shown.
    pub(crate) shown: Vec<bool>,
    pub(crate) fits: Vec<Fit<N>>,
    pub(crate) sample: Sample,
    /// Noise-free rows that are not where their landmark is, by landmark.
    pub(crate) astray: HashMap<u32, Astray>,
}

/// Adds a row to those of its landmark that are astray.
pub(crate) fn stray(
    astray: &mut HashMap<u32, Astray>,
    landmark: u32,
    row: u64,
    words: impl FnOnce() -> (String, String),
) {
    astray.entry(landmark).and_modify(|astray| astray.count += 1).or_insert_with(|| {
        let (expected, found) = words();
        Astray { row, count: 1, expected, found }
    });
}

/// Checks a table of points.
pub(crate) fn points<R: PointRow>(
    shared: &Shared<'_>,
    world: &World<'_>,
    hashed: bool,
    counted: bool,
    findings: &mut Findings,
) -> Seen<3> {
    let table = R::TABLE.name;
    let count = world.points.map_or(0, |points| points.places.len());
    let mut books = FrameRows::new::<R>(world, hashed, counted);
    let mut unknown = Unknown::default();
    let (mut shown, mut fits) = (vec![false; count], vec![Fit::<3>::default(); count]);
    let (mut sample, mut astray) = (Sample::default(), HashMap::new());
    let margin = if R::MEASURED { world.noise.margin_px() } else { 1.0 };
    let outcome = check::<R>(shared, findings, |batch, first_row, log_time, findings| {
        books.message(batch.iter().map(|row| row.parts().0), first_row, log_time, findings);
        for (row, entry) in (first_row..).zip(batch) {
            let (frame_id, point_id, u, v, depth) = entry.parts();
            if let Some(depth) = depth.filter(|depth| *depth <= 0.0) {
                findings.add(RuleId::DepthPositive, Some(table), || {
                    let found = format!("{depth} m in frame {frame_id}");
                    Detail::new("a depth over 0 m", found).row(row).id(format!("point {point_id}"))
                });
            }
            let frame = books.frame(frame_id, point_id, row);
            let landmark = world.points.and_then(|points| {
                let place = points.index.get(point_id);
                match place {
                    Some(place) => shown[place] = true,
                    None => unknown.add(point_id, row),
                }
                place.map(|place| (place, u32::try_from(place).unwrap_or(u32::MAX), points.places[place]))
            });
            let Some((place, frame)) = frame else { continue };
            books.count(place, point_id, Pixels::Point([u, v]));
            let Some(view) = frame.camera.and_then(|camera| world.views[camera].as_ref()) else { continue };
            if !view.contains(u, v, margin) {
                outside(view, [u, v], margin, table, row, &format!("point {point_id}"), findings);
            }
            let (Some((landmark, name, point)), Some(pose)) = (landmark, &frame.pose) else { continue };
            let Some(projection) = Projection::new(view, pose, point) else {
                fits[landmark].add_behind();
                if !R::MEASURED {
                    stray(&mut astray, name, row, || {
                        let expected = format!("a point in front of the camera of frame {frame_id}");
                        (expected, "the landmark lies behind it".to_owned())
                    });
                }
                continue;
            };
            let residuals = [projection.pixel[0] - u, projection.pixel[1] - v];
            if !(residuals[0].is_finite() && residuals[1].is_finite()) {
                continue;
            }
            if R::MEASURED && world.noise.is_outlier(residuals) {
                fits[landmark].add_wild();
                continue;
            }
            fits[landmark].add(residuals, &projection.derivatives);
            if R::MEASURED {
                let noise = world.noise.depth.zip(depth).filter(|_| sample.takes_next());
                let depth = noise.map_or(f64::NAN, |(noise, depth)| noise.residual(depth, projection.z));
                let pixels = residuals;
                sample.add(Residual { landmark: name, pixels, depths: [depth, f64::NAN] });
            } else if let Some(words) = projection.misses(residuals, depth, [u, v], frame_id) {
                stray(&mut astray, name, row, || words);
            }
        }
    });
    unknown.report(RuleId::LandmarkKnown, table, "point", "point_landmarks", findings);
    let books = books.finish(findings);
    Seen { outcome, books, shown, fits, sample, astray }
}

/// Reports a pixel outside the image.
pub(crate) fn outside(
    view: &View,
    [u, v]: [f64; 2],
    margin: f64,
    table: &'static str,
    row: u64,
    id: &str,
    findings: &mut Findings,
) {
    findings.add(RuleId::PixelInImage, Some(table), || {
        let (width, height) = (view.pinhole.width, view.pinhole.height);
        let expected = format!("a pixel in the image of {width} x {height}, or at most {margin} px outside");
        Detail::new(expected, format!("({u:.3}, {v:.3})")).row(row).id(id)
    });
}

/// The image of a point through a true pose.
struct Projection {
    pixel: [f64; 2],
    z: f64,
    /// Derivatives of u and v by the point in `world`.
    derivatives: [Vector3<f64>; 2],
}

impl Projection {
    /// `None` when the point is not in front of the camera.
    #[inline]
    fn new(view: &View, pose: &CameraFromWorld, point: Point3<f64>) -> Option<Self> {
        let seen = pose.rotation * point.coords + pose.translation;
        if seen.z.is_nan() || seen.z <= NEAREST_Z {
            return None;
        }
        let camera = &view.pinhole;
        let (slope_x, slope_y) = (seen.x / seen.z, seen.y / seen.z);
        let row = |index: usize| {
            let rotation = &pose.rotation;
            Vector3::new(rotation[(index, 0)], rotation[(index, 1)], rotation[(index, 2)])
        };
        let forward = row(2);
        Some(Self {
            pixel: [camera.fx * slope_x + camera.cx, camera.fy * slope_y + camera.cy],
            z: seen.z,
            derivatives: [
                (row(0) - forward * slope_x) * (camera.fx / seen.z),
                (row(1) - forward * slope_y) * (camera.fy / seen.z),
            ],
        })
    }

    /// What is wrong with a noise-free row; `None` when nothing is.
    #[inline]
    fn misses(
        &self,
        residuals: [f64; 2],
        depth: Option<f64>,
        [u, v]: [f64; 2],
        frame_id: i64,
    ) -> Option<(String, String)> {
        let squared = residuals[0] * residuals[0] + residuals[1] * residuals[1];
        if squared > REPROJECTION_PX * REPROJECTION_PX {
            let distance = squared.sqrt();
            let [x, y] = self.pixel;
            let expected = format!("({x:.3}, {y:.3}) within 0.5 px in frame {frame_id}");
            return Some((expected, format!("({u:.3}, {v:.3}), {distance:.3} px away")));
        }
        let allowed = DEPTH_M.max(DEPTH_M * self.z);
        let depth = depth.filter(|depth| (depth - self.z).abs() > allowed)?;
        let expected = format!("a depth of {:.4} m within {allowed:.4} m in frame {frame_id}", self.z);
        Some((expected, format!("{depth:.4} m")))
    }
}
