//! The scene as columns: landmarks, paths, edges, about a centre.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};
use serde::Serialize;
use serde_json::Value;

use super::columns::{Column, Columns};
use super::features::Gathered;
use crate::structure::{
    Frame, GraphLine, GraphPoint, LineId, LineLandmark, MapLine, MapPoint, PointLandmark, PoseRow,
    StructuralGroup,
};

/// Colours of groups; more groups than these begin again.
pub(super) const GROUP_COLOURS: usize = 15;
/// What stands for a line in no group.
const NO_GROUP: u16 = u16::MAX;
/// Largest integer that a number of JavaScript holds exactly.
const MOST_EXACT: u64 = 1 << 53;

/// A structural group, as the page shows it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct ViewGroup {
    pub(super) name: String,
    pub(super) lines: usize,
    /// Which of the colours.
    pub(super) colour: usize,
}

/// Landmarks of a sequence, by id; none where nobody says where one is.
#[derive(Clone, Debug, Default)]
pub(super) struct Landmarks {
    points: BTreeMap<i64, Option<[f64; 3]>>,
    lines: BTreeMap<i64, Option<[[f64; 3]; 2]>>,
    /// What stands in for the truth.
    instead: Option<String>,
}

impl Landmarks {
    /// True landmarks.
    pub(super) fn new(points: &[PointLandmark], lines: &[LineLandmark]) -> Self {
        Self {
            points: points.iter().map(|row| (row.point_id.0, finite([row.x, row.y, row.z]))).collect(),
            lines: lines.iter().map(|row| (row.line_id.0, ends(&row.segment()))).collect(),
            instead: None,
        }
    }

    /// The map of the first estimate, for a sequence without true landmarks.
    pub(super) fn of_map(points: &[MapPoint], lines: &[MapLine]) -> Self {
        let mut names = points.iter().map(|row| &row.estimate).chain(lines.iter().map(|row| &row.estimate));
        let Some(name) = names.next() else { return Self::default() };
        let points = points.iter().filter(|row| row.estimate == *name);
        let lines = lines.iter().filter(|row| row.estimate == *name);
        Self {
            points: points.map(|row| (row.point_id.0, finite([row.x, row.y, row.z]))).collect(),
            lines: lines.map(|row| (row.line_id.0, ends(&row.segment()))).collect(),
            instead: Some(format!("the map of the estimate {name}")),
        }
    }

    /// Initial values of the first factor graph, for a sequence with neither true landmarks nor a map.
    pub(super) fn of_graph(points: &[GraphPoint], lines: &[GraphLine]) -> Self {
        let mut names = points.iter().map(|row| &row.graph).chain(lines.iter().map(|row| &row.graph));
        let Some(name) = names.next() else { return Self::default() };
        let points = points.iter().filter(|row| row.graph == *name);
        let lines = lines.iter().filter(|row| row.graph == *name);
        Self {
            points: points.map(|row| (row.point_id.0, finite([row.x, row.y, row.z]))).collect(),
            lines: lines.map(|row| (row.line_id.0, ends(&row.segment()))).collect(),
            instead: Some(format!("initial values of the factor graph {name}")),
        }
    }

    /// Whether there is a point.
    pub(super) fn has_points(&self) -> bool {
        !self.points.is_empty()
    }

    /// Whether there is a line that is not among some.
    pub(super) fn has_lines_beside(&self, lines: &BTreeMap<LineId, usize>) -> bool {
        self.lines.keys().any(|id| !lines.contains_key(&LineId(*id)))
    }

    /// Whether there is none.
    pub(super) fn is_empty(&self) -> bool {
        self.points.is_empty() && self.lines.is_empty()
    }

    /// What stands in for true landmarks, in words.
    pub(super) fn instead(&self) -> Option<&str> {
        self.instead.as_deref()
    }

    /// Adds landmarks that frames show though nobody says where they are.
    pub(super) fn add_shown(&mut self, gathered: &Gathered) {
        for id in gathered.points.ids() {
            self.points.entry(*id).or_default();
        }
        for id in gathered.lines.ids() {
            self.lines.entry(*id).or_default();
        }
    }

    /// Place of each point in the columns.
    pub(super) fn point_index(&self) -> BTreeMap<i64, u32> {
        self.points.keys().copied().zip(0..).collect()
    }

    /// Place of each line in the columns.
    pub(super) fn line_index(&self) -> BTreeMap<i64, u32> {
        self.lines.keys().copied().zip(0..).collect()
    }
}

fn finite(place: [f64; 3]) -> Option<[f64; 3]> {
    place.iter().all(|coordinate| coordinate.is_finite()).then_some(place)
}

fn ends(segment: &crate::geometry::Segment) -> Option<[[f64; 3]; 2]> {
    Some([finite(segment.start.coords.into())?, finite(segment.end.coords.into())?])
}

/// Poses of a path, one for each frame; none where a frame has none.
pub(super) type Path = Vec<Option<PoseRow>>;

/// The path of the true poses.
pub(super) fn true_path(frames: &[Frame]) -> Path {
    frames.iter().map(|frame| frame.world_from_camera().filter(|pose| pose.pose().is_ok())).collect()
}

/// Where the columns of a scene stand.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SceneColumns {
    /// What all places are relative to, `world`, metres.
    centre: [f64; 3],
    /// How far what matters reaches from there, metres.
    radius: f64,
    /// Unit vector that points up.
    up: [f64; 3],
    point_ids: Value,
    points: Column,
    line_ids: Value,
    lines: Column,
    /// Place of each line's group in the list of groups; 65535 of one in no group.
    line_groups: Column,
    edges: Column,
    /// Seven numbers for each frame: place, quaternion x y z w; NaN where a frame has no pose.
    paths: Vec<Column>,
}

/// Lists ids; as text where a number of JavaScript would not hold one.
pub(super) fn ids(ids: impl Iterator<Item = i64> + Clone) -> Value {
    if ids.clone().all(|id| id.unsigned_abs() < MOST_EXACT) {
        ids.collect::<Vec<_>>().into()
    } else {
        ids.map(|id| id.to_string()).collect::<Vec<_>>().into()
    }
}

/// Groups with their colours, the largest first, and the place of each line's group; groups that are made of groups are left out.
pub(super) fn groups(groups: &[StructuralGroup]) -> (Vec<ViewGroup>, BTreeMap<LineId, usize>) {
    let mut largest: Vec<&StructuralGroup> =
        groups.iter().filter(|group| !group.is_made_of_groups()).collect();
    largest.sort_by_key(|group| (std::cmp::Reverse(group.line_ids.len()), group.group_id));
    let mut places = BTreeMap::new();
    let mut shown = Vec::new();
    for (place, group) in largest.into_iter().enumerate() {
        for line in &group.line_ids {
            places.entry(*line).or_insert(place);
        }
        let lines = group.line_ids.iter().collect::<BTreeSet<_>>().len();
        shown.push(ViewGroup {
            name: format!("{} ({})", group.group_id, group.kind),
            lines,
            colour: place % GROUP_COLOURS,
        });
    }
    (shown, places)
}

impl SceneColumns {
    /// * `paths` — the true one first.
    pub(super) fn new(
        landmarks: &Landmarks,
        groups: &BTreeMap<LineId, usize>,
        edges: &[[Point3<f64>; 2]],
        paths: &[Path],
        up: Vector3<f64>,
        columns: &mut Columns,
    ) -> Self {
        let (centre, radius) = bounds(landmarks, paths);
        let about = |place: &[f64; 3]| [0, 1, 2].map(|axis| place[axis] - centre[axis]);
        let points: Vec<f64> =
            landmarks.points.values().flat_map(|place| place.as_ref().map_or([f64::NAN; 3], about)).collect();
        let lines: Vec<f64> = landmarks
            .lines
            .values()
            .flat_map(|ends| ends.map_or([[f64::NAN; 3]; 2], |ends| [about(&ends[0]), about(&ends[1])]))
            .flatten()
            .collect();
        let group = |id: &i64| groups.get(&LineId(*id)).and_then(|place| u16::try_from(*place).ok());
        let line_groups: Vec<u16> = landmarks.lines.keys().map(|id| group(id).unwrap_or(NO_GROUP)).collect();
        let edges: Vec<f64> = edges.iter().flatten().flat_map(|end| about(&end.coords.into())).collect();
        let numbers = |path: &Path| -> Vec<f64> {
            let pose = |pose: &PoseRow| {
                let [x, y, z] = about(&pose.translation);
                let [qx, qy, qz, qw] = pose.rotation_xyzw;
                [x, y, z, qx, qy, qz, qw]
            };
            path.iter().flat_map(|row| row.as_ref().map_or([f64::NAN; 7], pose)).collect()
        };
        Self {
            centre,
            radius,
            up: up.into(),
            point_ids: ids(landmarks.points.keys().copied()),
            points: columns.f32(&points),
            line_ids: ids(landmarks.lines.keys().copied()),
            lines: columns.f32(&lines),
            line_groups: columns.u16(&line_groups),
            edges: columns.f32(&edges),
            paths: paths.iter().map(|path| columns.f32(&numbers(path))).collect(),
        }
    }
}

impl SceneColumns {
    /// Whether there are edges of objects.
    pub(super) fn has_edges(&self) -> bool {
        !self.edges.is_empty()
    }
}

/// The middle of what matters and how far it reaches: of points all but the outermost 1 %, lines and true poses.
fn bounds(landmarks: &Landmarks, paths: &[Path]) -> ([f64; 3], f64) {
    let mut low_high = [[0.0; 2]; 3];
    for (axis, bounds) in low_high.iter_mut().enumerate() {
        let mut points: Vec<f64> = landmarks.points.values().flatten().map(|place| place[axis]).collect();
        points.sort_unstable_by(f64::total_cmp);
        let stray = points.len() / 200;
        let inner = points.get(stray..points.len() - stray).unwrap_or_default();
        let lines = landmarks.lines.values().flatten().flatten().map(|end| end[axis]);
        // Estimates may be far off; they count where there is no truth.
        let path = paths.iter().find(|path| path.iter().any(Option::is_some));
        let poses = path.into_iter().flatten().flatten().map(|pose| pose.translation[axis]);
        let all = || {
            inner.first().into_iter().chain(inner.last()).copied().chain(lines.clone()).chain(poses.clone())
        };
        *bounds = [all().min_by(f64::total_cmp).unwrap_or(-1.0), all().max_by(f64::total_cmp).unwrap_or(1.0)];
    }
    let centre = low_high.map(|[low, high]| 0.5 * low + 0.5 * high);
    let half = low_high.map(|[low, high]| 0.5 * high - 0.5 * low);
    let radius = half.iter().fold(0.0_f64, |sum, half| libm::hypot(sum, *half));
    (centre, if radius.is_finite() && radius > 1e-9 { radius } else { 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{GroupId, PointId};

    fn group(id: i64, kind: &str, lines: &[i64]) -> StructuralGroup {
        StructuralGroup {
            group_id: GroupId(id),
            kind: kind.to_owned(),
            line_ids: lines.iter().copied().map(LineId).collect(),
            ..StructuralGroup::default()
        }
    }

    #[test]
    fn the_largest_group_has_the_first_colour_and_groups_of_groups_have_none() {
        let (shown, places) = groups(&[
            group(4, "parallel", &[1]),
            group(9, "manhattan", &[1, 2, 3]),
            group(7, "parallel", &[2, 3]),
        ]);
        let names: Vec<&str> = shown.iter().map(|group| group.name.as_str()).collect();
        assert_eq!(names, ["group 7 (parallel)", "group 4 (parallel)"]);
        assert_eq!((places[&LineId(3)], places[&LineId(1)]), (0, 1));
        assert_eq!((shown[0].colour, shown[1].colour), (0, 1));
    }

    #[test]
    fn ids_that_no_number_holds_are_text() {
        assert_eq!(ids([1, -2].into_iter()), serde_json::json!([1, -2]));
        assert_eq!(ids([i64::MAX].into_iter()), serde_json::json!(["9223372036854775807"]));
    }

    #[test]
    fn what_stands_in_for_landmarks_is_said() {
        let map = [MapPoint::new("e".to_owned(), PointId(3), &Point3::new(1.0, 2.0, 3.0))];
        let found = Landmarks::of_map(&map, &[]);
        assert_eq!((found.instead(), found.points.len()), (Some("the map of the estimate e"), 1));
        let truth = [PointLandmark::new(PointId(5), Point3::new(f64::NAN, 0.0, 0.0))];
        let found = Landmarks::new(&truth, &[]);
        assert_eq!((found.instead, found.points), (None, BTreeMap::from([(5, None)])));
        assert!(Landmarks::of_graph(&[], &[]).is_empty());
    }
}
