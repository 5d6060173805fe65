//! Who sees what: landmarks against every frame, on all cores.

use nalgebra::Point3;
use rayon::prelude::*;

use super::visibility::{
    LineIndex, Occluders, PlaceSet, PointIndex, View, Visibility, VisibilityModel, sampled_part, visible_part,
};
use crate::geometry::Segment;

/// A line that a frame sees, and the part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenLine {
    /// The line, by its place.
    pub line: u32,
    /// The visible part, as an interval of `start + t (end − start)`.
    pub part: [f64; 2],
}

/// Views and what may stand in their way.
#[derive(Clone, Debug)]
pub struct Survey {
    /// One view for each frame.
    pub views: Vec<View>,
    occluders: Occluders,
    visibility: Visibility,
}

impl Survey {
    /// A survey from some views.
    #[must_use]
    pub const fn new(views: Vec<View>, occluders: Occluders, visibility: Visibility) -> Self {
        Self { views, occluders, visibility }
    }

    /// For each frame the points that it sees, by their places, ascending.
    ///
    /// * `seen` — called after each frame, from any thread.
    #[must_use]
    pub fn points(&self, points: &[Point3<f64>], seen: &(dyn Fn() + Sync)) -> Vec<Vec<u32>> {
        self.points_as(points, seen, |places| places)
    }

    /// As [`points`](Self::points), each frame's in a form of its own, which may take less memory.
    pub(super) fn points_as<T: Send>(
        &self,
        points: &[Point3<f64>],
        seen: &(dyn Fn() + Sync),
        form: impl Fn(Vec<u32>) -> T + Sync,
    ) -> Vec<T> {
        let index = PointIndex::new(points);
        let occluders = match self.visibility.model {
            VisibilityModel::Occlusion => Some(&self.occluders),
            VisibilityModel::Frustum => None,
        };
        let set = || PlaceSet::new(points.len());
        self.views
            .par_iter()
            .map_init(set, |set, view| {
                let found = form(index.seen(view, occluders, set));
                seen();
                found
            })
            .collect()
    }

    /// For each frame the lines that it sees, ascending, with their visible parts.
    ///
    /// * `seen` — called after each frame, from any thread.
    #[must_use]
    pub fn lines(&self, lines: &[Segment], seen: &(dyn Fn() + Sync)) -> Vec<Vec<SeenLine>> {
        let min_length_px = self.visibility.min_length_px;
        let part = |view: &View, line: &Segment| match self.visibility.model {
            VisibilityModel::Frustum => sampled_part(view, &line.start, &line.end, min_length_px),
            VisibilityModel::Occlusion => {
                visible_part(view, &self.occluders, &line.start, &line.end, min_length_px)
            }
        };
        let index = LineIndex::new(lines);
        let set = || PlaceSet::new(lines.len());
        self.views
            .par_iter()
            .map_init(set, |set, view| {
                let mut found: Vec<SeenLine> = index
                    .near(view, set)
                    .into_iter()
                    .filter_map(|place| {
                        let line = &lines[place as usize];
                        view.classify(&line.start.inf(&line.end), &line.start.sup(&line.end))?;
                        Some(SeenLine { line: place, part: part(view, line)? })
                    })
                    .collect();
                found.shrink_to_fit();
                seen();
                found
            })
            .collect()
    }
}
