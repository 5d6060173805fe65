//! The scale of what pixels alone measure: kept where it began.

use super::observations::Observations;
use crate::geometry::{Pose, Segment};
use nalgebra::{Point3, Vector3};

/// Nearer centres are one place, metres: they say nothing about scale.
pub(super) const ONE_PLACE_M: f64 = 1e-9;

/// Where the cameras began, by which the scale is held.
pub(super) struct ScaleGauge {
    initial: Vec<Vector3<f64>>,
}

impl ScaleGauge {
    /// Remembers where the cameras are before they are adjusted.
    pub(super) fn of(observations: &Observations) -> Self {
        Self { initial: centres(observations) }
    }

    /// Scales every part of the graph whose scale is free so that its camera centres lie as near as they can to where they began.
    ///
    /// `min_s Σ |s (xᵢ − c) − (x̂ᵢ − c)|²`, about the centre c of the camera that is held. Pixels do not change by it, so that the cost
    /// stays; without it the scale ends wherever the optimiser's path led.
    ///
    /// * `is_free` — for each part, named by its frames' component, the place of the held frame where pixels alone measure it.
    ///
    /// Gives whether anything moved.
    pub(super) fn restore(&self, observations: &mut Observations, is_free: &[Option<usize>]) -> bool {
        let components = observations.components();
        let now = centres(observations);
        let mut scales: Vec<Option<(f64, Vector3<f64>)>> = vec![None; is_free.len()];
        for (part, held) in is_free.iter().enumerate() {
            let Some(centre) = held.map(|held| now[held]) else { continue };
            let (mut along, mut square) = (0.0, 0.0);
            for frame in (0..now.len()).filter(|frame| components[*frame] == part) {
                let (found, began) = (now[frame] - centre, self.initial[frame] - centre);
                along += found.dot(&began);
                square += found.norm_squared();
            }
            let scale = along / square;
            if square > ONE_PLACE_M * ONE_PLACE_M && scale.is_finite() && scale > 0.0 {
                scales[part] = Some((scale, centre));
            }
        }
        if scales.iter().all(Option::is_none) {
            return false;
        }
        let moved = |part: usize, point: &Point3<f64>| match scales[part] {
            Some((scale, centre)) => Point3::from(centre + (point.coords - centre) * scale),
            None => *point,
        };
        // A landmark belongs to the part of the frames that see it.
        for view in seen_first(
            observations.points.len(),
            observations.point_views.iter().map(|view| (view.point, view.frame)),
        ) {
            let (point, frame) = view;
            observations.points[point].position =
                moved(components[frame], &observations.points[point].position);
        }
        let views = observations.line_views.iter().map(|view| (view.line, view.frame));
        for (line, frame) in seen_first(observations.lines.len(), views) {
            let vertex = &mut observations.lines[line];
            let part = components[frame];
            let segment =
                Segment { start: moved(part, &vertex.segment.start), end: moved(part, &vertex.segment.end) };
            if let Some((scale, centre)) = scales[part] {
                // The moment about the held centre grows, the direction stays.
                let about = vertex.line.moment - centre.cross(&vertex.line.direction);
                vertex.line.moment = about * scale + centre.cross(&vertex.line.direction);
            }
            vertex.segment = segment;
        }
        for (frame, vertex) in observations.frames.iter_mut().enumerate() {
            if scales[components[frame]].is_some() {
                let pose = vertex.camera_from_world.inverse();
                let centre = moved(components[frame], &Point3::from(pose.translation()));
                vertex.camera_from_world = Pose::new(pose.rotation(), centre.coords).inverse();
            }
        }
        true
    }
}

fn centres(observations: &Observations) -> Vec<Vector3<f64>> {
    (0..observations.frames.len()).map(|frame| observations.centre(frame)).collect()
}

/// Each landmark that is seen with the first frame that sees it.
fn seen_first(count: usize, views: impl Iterator<Item = (usize, usize)>) -> Vec<(usize, usize)> {
    let mut first: Vec<Option<usize>> = vec![None; count];
    for (landmark, frame) in views {
        first[landmark].get_or_insert(frame);
    }
    first.into_iter().enumerate().filter_map(|(landmark, frame)| Some((landmark, frame?))).collect()
}
