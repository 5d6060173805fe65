//! A line of the map.

use nalgebra::{Matrix3x2, Matrix4, Matrix6, Point2, Point3, Vector3};

use super::fusion::{back_projected, congruent, fuse, inverse};
use super::point_landmark::{View, most_doubt};
use super::sighting::LineSighting;
use crate::geometry::{LineMatch, LineView, Pose, Segment, triangulate_line};

/// Planes of a line without depth must differ by this much before it is triangulated, radians.
const LEAST_PARALLAX: f64 = 0.04;

/// Views of a line without depth that are kept at most.
const MOST_VIEWS: usize = 32;

/// Whitened residuals of a triangulation may have this root mean square.
const MOST_RMS: f64 = 3.0;

/// A line whose place is known, as the part of it that has been seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineLandmark {
    pub(super) segment: Segment,
    /// Covariance of both ends across the line, over [`LineMatch::across`].
    pub(super) covariance: Matrix4<f64>,
    /// Frames in a row that contradicted it.
    pub(super) contradictions: u32,
}

/// A matrix of the two columns of `across` for both ends.
fn both(across: &Matrix3x2<f64>) -> nalgebra::SMatrix<f64, 6, 4> {
    let mut both = nalgebra::SMatrix::<f64, 6, 4>::zeros();
    both.fixed_view_mut::<3, 2>(0, 0).copy_from(across);
    both.fixed_view_mut::<3, 2>(3, 2).copy_from(across);
    both
}

impl LineLandmark {
    /// A line from one measurement whose ends both have depth.
    pub(super) fn from_depth(view: &View, sighting: &LineSighting) -> Option<Self> {
        let [Some(start), Some(end)] = sighting.depths else { return None };
        let world_from_camera = view.camera_from_world.inverse();
        let in_camera = [
            view.camera.back_project(sighting.ends_px[0], start.depth_m()),
            view.camera.back_project(sighting.ends_px[1], end.depth_m()),
        ];
        let [first, second] = in_camera.map(|end| world_from_camera * end);
        let segment = Segment { start: first, end: second };
        let across = LineMatch::across(&segment)?;
        let mut covariance = Matrix4::zeros();
        for (k, (point, depth)) in in_camera.iter().zip([start, end]).enumerate() {
            let sigmas = (view.sigma_px, depth.sigma_m());
            // What the pose adds is common to both ends; it is added below.
            let of_end =
                back_projected(&view.camera, &view.camera_from_world, point, sigmas, &Matrix6::zeros());
            covariance
                .fixed_view_mut::<2, 2>(2 * k, 2 * k)
                .copy_from(&(across.transpose() * of_end * across));
        }
        covariance += by_pose(&view.camera_from_world, &in_camera, &across, &view.covariance);
        // Noise longer than the segment turns it about: its direction is worth nothing.
        let doubt = (covariance.trace() / 4.0).sqrt();
        let finite = covariance.iter().all(|number| number.is_finite());
        (finite && segment.length() > 2.0 * doubt).then_some(Self { segment, covariance, contradictions: 0 })
    }

    /// Moves with the world.
    pub(super) fn shift(&mut self, shift: &Pose) {
        let moved = Segment { start: *shift * self.segment.start, end: *shift * self.segment.end };
        let (Some(before), Some(after)) = (LineMatch::across(&self.segment), LineMatch::across(&moved))
        else {
            return;
        };
        let into = both(&after).transpose() * both(&(shift.rotation_matrix() * before));
        self.segment = moved;
        self.covariance = into * self.covariance * into.transpose();
    }

    /// The line with a measurement of it.
    pub(super) fn matched(&self, sighting: &LineSighting) -> LineMatch {
        LineMatch {
            segment: self.segment,
            covariance: self.covariance,
            ends_px: sighting.ends_px,
            depths: sighting.depths,
        }
    }

    /// Takes a measurement that agrees.
    pub(super) fn fuse(&mut self, view: &View, sighting: &LineSighting) {
        self.contradictions = 0;
        let Some(residual) =
            self.matched(sighting).residual(&view.camera, &view.camera_from_world, view.sigma_px)
        else {
            return;
        };
        let Some(fused) = fuse(&residual, &self.covariance, &view.covariance) else { return };
        let Some(across) = LineMatch::across(&self.segment) else { return };
        let moved = Segment {
            start: self.segment.start + across * fused.shift.fixed_rows::<2>(0),
            end: self.segment.end + across * fused.shift.fixed_rows::<2>(2),
        };
        let Some(turned) = LineMatch::across(&moved) else { return };
        let into = both(&turned).transpose() * both(&across);
        self.segment = moved;
        self.covariance = into * fused.covariance * into.transpose();
        self.extend(view, sighting);
    }

    /// Lengthens the segment to what the measurement shows of the line.
    fn extend(&mut self, view: &View, sighting: &LineSighting) {
        let (Some(direction), length) = (self.segment.direction(), self.segment.length()) else { return };
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        for pixel in sighting.ends_px {
            let Some(place) = seen_at(view, &self.segment, pixel) else { continue };
            let share = direction.dot(&(place - self.segment.start)) / length;
            // One measurement at most doubles what is known: nearly end-on, noise leads far away.
            low = low.min(share.max(-0.5));
            high = high.max(share.min(1.5));
        }
        if low >= 0.0 && high <= 1.0 {
            return;
        }
        let along = self.segment.end - self.segment.start;
        let segment =
            Segment { start: self.segment.start + along * low, end: self.segment.start + along * high };
        // What a place at a share s moves by: (1 − s) of the start's shift and s of the end's.
        let mut into = Matrix4::<f64>::zeros();
        for (row, share) in [(0, low), (2, high)] {
            for axis in 0..2 {
                into[(row + axis, axis)] = 1.0 - share;
                into[(row + axis, 2 + axis)] = share;
            }
        }
        self.segment = segment;
        self.covariance = into * self.covariance * into.transpose();
    }

    /// The covariance of both ends, m²; zero along the line.
    pub(super) fn covariance_of_ends(&self) -> Option<Matrix6<f64>> {
        let both = both(&LineMatch::across(&self.segment)?);
        Some(both * self.covariance * both.transpose())
    }
}

/// Where on a line the ray of a pixel passes.
fn seen_at(view: &View, segment: &Segment, pixel: Point2<f64>) -> Option<Point3<f64>> {
    let world_from_camera = view.camera_from_world.inverse();
    let centre = Point3::from(world_from_camera.translation());
    let towards = centre + world_from_camera.rotation() * view.camera.ray(pixel);
    let ray = Segment { start: centre, end: towards }.plucker().ok()?;
    segment.plucker().ok()?.closest_point_to_line(&ray)
}

/// What the pose's doubt adds to both ends across the line.
fn by_pose(
    camera_from_world: &Pose,
    in_camera: &[Point3<f64>; 2],
    across: &Matrix3x2<f64>,
    pose: &Matrix6<f64>,
) -> Matrix4<f64> {
    let rotation = camera_from_world.rotation_matrix();
    let mut moved = nalgebra::SMatrix::<f64, 4, 6>::zeros();
    let into = across.transpose() * rotation.transpose();
    for (k, point) in in_camera.iter().enumerate() {
        moved.fixed_view_mut::<2, 3>(2 * k, 0).copy_from(&(into * point.coords.cross_matrix()));
        moved.fixed_view_mut::<2, 3>(2 * k, 3).copy_from(&-into);
    }
    moved * pose * moved.transpose()
}

/// Where a line without depth was seen, until its place is known.
#[derive(Clone, Debug, Default)]
pub(super) struct PendingLine {
    views: Vec<(View, LineSighting)>,
}

impl PendingLine {
    /// Takes a measurement; gives the line where it is known well enough by now.
    ///
    /// * `numbers` — that were measured of landmarks that are known.
    pub(super) fn push(
        &mut self,
        view: &View,
        sighting: &LineSighting,
        numbers: usize,
    ) -> Option<LineLandmark> {
        if self.views.len() >= MOST_VIEWS {
            let mut keep = false;
            self.views.retain(|_| {
                keep = !keep;
                keep
            });
        }
        self.views.push((*view, *sighting));
        let plane = |(view, sighting): &(View, LineSighting)| -> Vector3<f64> {
            let [start, end] = sighting.ends_px.map(|pixel| view.camera.ray(pixel));
            view.camera_from_world.rotation().inverse() * start.cross(&end).normalize()
        };
        let last = plane(self.views.last()?);
        let widest = self.views.iter().map(|view| plane(view).dot(&last).abs()).fold(1.0, f64::min);
        if widest > 1.0 - 0.5 * LEAST_PARALLAX * LEAST_PARALLAX {
            return None;
        }
        self.triangulated(most_doubt(numbers))
    }

    fn triangulated(&self, most_doubt: f64) -> Option<LineLandmark> {
        let observations: Vec<LineView> = self
            .views
            .iter()
            .map(|(view, sighting)| (view.camera, view.camera_from_world, sighting.ends_px))
            .collect();
        let found = triangulate_line(&observations)?;
        if found.parallax < LEAST_PARALLAX {
            return None;
        }
        let (last, sighting) = self.views.last()?;
        let anchor = Segment {
            start: found.line.closest_point_to_origin(),
            end: found.line.closest_point_to_origin() + found.line.direction,
        };
        let [start, end] = sighting.ends_px.map(|pixel| seen_at(last, &anchor, pixel));
        let segment = Segment { start: start?, end: end? };
        let mut information = Matrix4::<f64>::zeros();
        let (mut cost, mut numbers) = (0.0, 0);
        for (view, sighting) in &self.views {
            let at = LineMatch {
                segment,
                covariance: Matrix4::zeros(),
                ends_px: sighting.ends_px,
                depths: sighting.depths,
            };
            let residual = at.residual(&view.camera, &view.camera_from_world, view.sigma_px)?;
            let noise = residual.noise + congruent(&residual.by_pose, &view.covariance);
            let weight = inverse(&noise)?;
            information += residual.by_landmark.transpose() * weight * residual.by_landmark;
            cost += residual.error.dot(&(weight * residual.error));
            numbers += residual.count;
        }
        if (cost / numbers as f64).sqrt() > MOST_RMS {
            return None;
        }
        let covariance = inverse(&information)?;
        let distance = (last.camera_from_world * segment.midpoint()).coords.norm();
        (covariance.trace().sqrt() < most_doubt * distance).then_some(LineLandmark {
            segment,
            covariance,
            contradictions: 0,
        })
    }
}
