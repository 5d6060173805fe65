//! A sequence in the text format of the first release: what its readers, `os-convert open-structure` too, take.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::remark::Remarks;
use super::text_file::{TextFile, check_finite};
use super::{Error, Remark};
use crate::structure::{
    FactorGraph, GraphFactor, LineMeasurement, PointMeasurement, PoseRow, Sequence, TrajectoryPose, registry,
};

/// Name of an estimate that stands in the association.
const EMBEDDED: &str = "association-embedded";
/// The clock of the release, which has no time stamps, hertz.
const RATE_HZ: i64 = 30;

/// A sequence as the files of the first text release, in its folders `observation/` and `baseline/`.
///
/// `association.txt` has the observations, or the measurements where there are none. `venom_sequence.txt` has a graph:
/// its vertices, and its factors as measurements; or, where there is no graph, the measurements alone. Numbers have all
/// their digits.
///
/// Landmarks and lines that the manifest's `recovered` names are left out: whoever converts the files recovers them
/// again, to the same bits.
///
/// What text cannot carry is told: stamps other than 30 Hz, cameras (a reader finds the family of the release by
/// reprojection), depth of points, a depth that is absent (written as 0, which readers drop), groups other than
/// `parallel`, descriptors, information, covariances, the record of a tracker or an optimiser, estimates and graphs
/// whose names the release does not know.
///
/// * `graph` — name of the graph that becomes `venom_sequence.txt`.
///
/// # Errors
/// [`Error::Unfit`] for a number that is not finite, or when the graph of that name is not there though it was asked for.
pub fn to_text_release(
    sequence: &Sequence,
    graph: Option<&str>,
) -> Result<(Vec<TextFile>, Vec<Remark>), Error> {
    let name = graph.unwrap_or("initial");
    let found = FactorGraph::of(sequence, name);
    if let (Some(name), None) = (graph, &found) {
        return Err(Error::unfit(format!("graph `{name}`"), "one of the sequence", "none"));
    }
    let mut export = Export { sequence, files: Vec::new(), remarks: Remarks::default() };
    export.truth()?;
    export.association()?;
    export.graph(found.as_ref())?;
    export.estimates()?;
    export.parameters(found.as_ref());
    export.tell(name);
    Ok((export.files, export.remarks.into_vec()))
}

struct Export<'a> {
    sequence: &'a Sequence,
    files: Vec<TextFile>,
    remarks: Remarks,
}

/// Appends ids and numbers to a line, apart by blanks, and ends it.
fn line(text: &mut String, tag: &str, ids: &[i64], numbers: &[f64]) -> Result<(), Error> {
    check_finite(|| format!("{tag} {ids:?}"), numbers)?;
    text.push_str(tag);
    let mut blank = "";
    for id in ids {
        // Writing to a string does not fail.
        let _ = write!(text, "{blank}{id}");
        blank = " ";
    }
    for number in numbers {
        let _ = write!(text, " {number:?}");
    }
    text.push('\n');
    Ok(())
}

fn poses(rows: impl Iterator<Item = (i64, PoseRow)>) -> Result<String, Error> {
    let mut text = String::new();
    for (id, pose) in rows {
        line(&mut text, "", &[id], &pose.numbers())?;
    }
    Ok(text)
}

fn point_row(text: &mut String, row: &PointMeasurement) -> Result<(), Error> {
    line(text, "MappointFrameAsso: ", &[row.point_id.0, row.frame_id.0], &[row.u, row.v])
}

fn line_row(text: &mut String, row: &LineMeasurement) -> Result<(), Error> {
    let [start, end] = [row.start_depth, row.end_depth].map(|depth| depth.unwrap_or(0.0));
    let numbers = [row.start_u, row.start_v, start, row.end_u, row.end_v, end];
    line(text, "MaplineFrameAsso: ", &[row.line_id.0, row.frame_id.0], &numbers)
}

impl Export<'_> {
    fn push(&mut self, name: &str, text: String) {
        if !text.is_empty() {
            self.files.push(TextFile::new(name, text));
        }
    }

    /// Ids of the rows of a table that were recovered; `None` where all are, or it is not said which.
    fn recovered(&self, table: &str) -> Option<BTreeSet<i64>> {
        let entries = self.sequence.manifest.recovered.iter();
        let mut ids = BTreeSet::new();
        for entry in entries.filter(|entry| entry.table == table && entry.columns.is_empty()) {
            if entry.ids.is_empty() && entry.rows > 0 {
                return None;
            }
            ids.extend(&entry.ids);
        }
        Some(ids)
    }

    fn truth(&mut self) -> Result<(), Error> {
        let frames = self.sequence.frames.iter();
        let text = poses(frames.filter_map(|row| Some((row.frame_id.0, row.world_from_camera()?))))?;
        self.push("observation/camera_poses.txt", text.clone());
        self.push("baseline/ground_truth.txt", text);
        let mut text = String::new();
        let recovered = self.recovered("point_landmarks");
        let is_published = |id: i64| recovered.as_ref().is_some_and(|ids| !ids.contains(&id));
        for row in self.sequence.point_landmarks.iter().filter(|row| is_published(row.point_id.0)) {
            line(&mut text, "", &[row.point_id.0], &[row.x, row.y, row.z])?;
        }
        self.push("observation/point_landmarks.txt", text);
        let mut text = String::new();
        let recovered = self.recovered("line_landmarks");
        let is_published = |id: i64| recovered.as_ref().is_some_and(|ids| !ids.contains(&id));
        for row in self.sequence.line_landmarks.iter().filter(|row| is_published(row.line_id.0)) {
            let ends = [row.start_x, row.start_y, row.start_z, row.end_x, row.end_y, row.end_z];
            line(&mut text, "", &[row.line_id.0], &ends)?;
        }
        self.push("observation/structline_landmarks.txt", text);
        let described = self.sequence.point_landmarks.iter().filter(|row| row.descriptor.is_some()).count();
        self.remarks.lost(described, "descriptors are left out");
        Ok(())
    }

    fn association(&mut self) -> Result<(), Error> {
        let sequence = self.sequence;
        let mut text = self.embedded()?;
        let mut depths = 0;
        if sequence.point_observations.is_empty() {
            for row in &sequence.point_measurements {
                point_row(&mut text, row)?;
                depths += usize::from(row.depth.is_some());
            }
        } else {
            let is_recovered = |table: &str| {
                let mut entries = sequence.manifest.recovered.iter();
                entries.any(|entry| entry.table == table && entry.columns.iter().any(|name| name == "depth"))
            };
            let recovered = is_recovered("point_observations");
            for row in &sequence.point_observations {
                let (frame_id, point_id) = (row.frame_id, row.point_id);
                point_row(
                    &mut text,
                    &PointMeasurement { frame_id, point_id, u: row.u, v: row.v, depth: None },
                )?;
                depths += usize::from(row.depth.is_some() && !recovered);
            }
        }
        self.remarks.lost(depths, "depths of points are left out: the release has none");
        let mut absent = 0;
        if sequence.line_observations.is_empty() {
            for row in &sequence.line_measurements {
                line_row(&mut text, row)?;
                absent += usize::from(row.start_depth.is_none()) + usize::from(row.end_depth.is_none());
            }
        } else {
            for row in &sequence.line_observations {
                let row = LineMeasurement {
                    frame_id: row.frame_id,
                    line_id: row.line_id,
                    start_u: row.start_u,
                    start_v: row.start_v,
                    start_depth: row.start_depth,
                    end_u: row.end_u,
                    end_v: row.end_v,
                    end_depth: row.end_depth,
                };
                line_row(&mut text, &row)?;
                absent += usize::from(row.start_depth.is_none()) + usize::from(row.end_depth.is_none());
            }
        }
        self.remarks.said(absent, "absent depths of line ends are written as 0");
        text.push_str(&self.groups());
        self.push("observation/association.txt", text);
        Ok(())
    }

    /// The estimate that stands in the association itself, as in one published sequence.
    fn embedded(&self) -> Result<String, Error> {
        let mut text = String::new();
        for row in self.sequence.trajectories.iter().filter(|row| row.estimate == EMBEDDED) {
            line(&mut text, "Vertex: ", &[row.frame_id.0], &row.world_from_camera().numbers())?;
        }
        for row in self.sequence.map_points.iter().filter(|row| row.estimate == EMBEDDED) {
            line(&mut text, "Mappoint: ", &[row.point_id.0], &[row.x, row.y, row.z])?;
        }
        for row in self.sequence.map_lines.iter().filter(|row| row.estimate == EMBEDDED) {
            let ends = [row.start_x, row.start_y, row.start_z, row.end_x, row.end_y, row.end_z];
            line(&mut text, "Mapline: ", &[row.line_id.0], &ends)?;
        }
        Ok(text)
    }

    /// The lines of parallel groups.
    fn groups(&self) -> String {
        let mut text = String::new();
        for group in self.sequence.structural_groups.iter().filter(|group| group.kind == registry::PARALLEL) {
            // Writing to a string does not fail.
            let _ = write!(text, "ParalineMaplineAsso: {} {}", group.group_id.0, group.line_ids.len());
            for id in &group.line_ids {
                let _ = write!(text, " {}", id.0);
            }
            text.push('\n');
        }
        text
    }

    fn graph(&mut self, graph: Option<&FactorGraph>) -> Result<(), Error> {
        let sequence = self.sequence;
        let mut text = String::new();
        if let Some(graph) = graph {
            for row in &graph.poses {
                line(&mut text, "Vertex: ", &[row.frame_id.0], &row.world_from_camera().numbers())?;
            }
            for row in &graph.points {
                line(&mut text, "Mappoint: ", &[row.point_id.0], &[row.x, row.y, row.z])?;
            }
            for row in &graph.lines {
                let ends = [row.start_x, row.start_y, row.start_z, row.end_x, row.end_y, row.end_z];
                line(&mut text, "Mapline: ", &[row.line_id.0], &ends)?;
            }
            let first = graph.poses.first().map(|row| row.frame_id);
            let held = graph.poses.iter().filter(|row| row.fixed != (Some(row.frame_id) == first)).count();
            self.remarks.said(held, "poses are held or free otherwise: readers hold the first alone");
            for factor in &graph.factors {
                self.factor(factor, &mut text)?;
            }
        }
        // Measurements that no factor has: the association has them where there are no observations.
        let factors = graph.map(|graph| graph.factors.as_slice()).unwrap_or_default();
        if !sequence.point_observations.is_empty() {
            let known: BTreeSet<_> =
                factors.iter().filter_map(|row| Some((row.frame_id?, row.point_id?))).collect();
            let rows = sequence.point_measurements.iter();
            let rest: Vec<_> = rows.filter(|row| !known.contains(&(row.frame_id, row.point_id))).collect();
            for row in &rest {
                point_row(&mut text, row)?;
            }
            self.without_factor(graph.is_some(), rest.len());
        }
        if !sequence.line_observations.is_empty() {
            let known: BTreeSet<_> =
                factors.iter().filter_map(|row| Some((row.frame_id?, row.line_id?))).collect();
            let rows = sequence.line_measurements.iter();
            let rest: Vec<_> = rows.filter(|row| !known.contains(&(row.frame_id, row.line_id))).collect();
            for row in &rest {
                line_row(&mut text, row)?;
            }
            self.without_factor(graph.is_some(), rest.len());
        }
        if graph.is_some() && !text.is_empty() {
            text.push_str(&self.groups());
        }
        self.push("baseline/venom_sequence.txt", text);
        Ok(())
    }

    fn without_factor(&mut self, has_graph: bool, count: usize) {
        if has_graph {
            self.remarks.said(count, "measurements without a factor become factors of the graph");
        }
    }

    fn factor(&mut self, factor: &GraphFactor, text: &mut String) -> Result<(), Error> {
        let frame = factor.frame_id.map(|id| id.0);
        match (factor.kind.as_str(), frame, factor.measurement.as_slice()) {
            (registry::POINT_REPROJECTION, Some(frame), [u, v, rest @ ..]) if factor.point_id.is_some() => {
                let point = factor.point_id.map_or(0, |id| id.0);
                line(text, "MappointFrameAsso: ", &[point, frame], &[*u, *v])?;
                self.remarks.lost(rest.len(), "depths of points are left out: the release has none");
            }
            (registry::LINE_REPROJECTION, Some(frame), numbers) if factor.line_id.is_some() => {
                let id = factor.line_id.map_or(0, |id| id.0);
                let numbers = match numbers {
                    [su, sv, eu, ev] => {
                        self.remarks.said(2, "absent depths of line ends are written as 0");
                        [*su, *sv, 0.0, *eu, *ev, 0.0]
                    }
                    [su, sv, sd, eu, ev, ed] => [*su, *sv, *sd, *eu, *ev, *ed],
                    _ => {
                        return Err(Error::unfit(
                            format!("factor {}", factor.factor_id),
                            "4 or 6 numbers",
                            numbers.len(),
                        ));
                    }
                };
                line(text, "MaplineFrameAsso: ", &[id, frame], &numbers)?;
            }
            _ => self.remarks.lost(1, "factors other than points and lines seen in frames are left out"),
        }
        self.remarks.lost(usize::from(factor.information.is_some()), "information matrices are left out");
        Ok(())
    }

    fn estimates(&mut self) -> Result<(), Error> {
        let sequence = self.sequence;
        let mut paths: BTreeMap<&str, Vec<&TrajectoryPose>> = BTreeMap::new();
        for row in sequence.trajectories.iter().filter(|row| row.estimate != EMBEDDED) {
            paths.entry(&row.estimate).or_default().push(row);
        }
        for (name, rows) in paths {
            let file = match name {
                registry::FRAME_TO_FRAME => Some("Frame-to-Frame".to_owned()),
                registry::MAP_TO_FRAME => Some("Map-to-Frame".to_owned()),
                name => adjusted(name).map(|stem| format!("{stem}-BA")),
            };
            let Some(file) = file else {
                self.remarks.lost(
                    rows.len(),
                    format!("poses of `{name}` are left out: the release has no file for it"),
                );
                continue;
            };
            let text = poses(rows.iter().map(|row| (row.frame_id.0, row.world_from_camera())))?;
            self.push(&format!("baseline/{file}.txt"), text);
        }
        let mut maps: BTreeMap<&str, [String; 2]> = BTreeMap::new();
        let mut nameless: BTreeMap<&str, usize> = BTreeMap::new();
        for row in sequence.map_points.iter().filter(|row| row.estimate != EMBEDDED) {
            if adjusted(&row.estimate).is_some() {
                let text = &mut maps.entry(&row.estimate).or_default()[0];
                line(text, "Mappoint:", &[row.point_id.0], &[row.x, row.y, row.z])?;
            } else {
                *nameless.entry(&row.estimate).or_default() += 1;
            }
        }
        let recovered = self.recovered("map_lines");
        for row in sequence.map_lines.iter().filter(|row| row.estimate != EMBEDDED) {
            if row.estimate == registry::UNREFINED && recovered.as_ref().is_none_or(|ids| !ids.is_empty()) {
                continue;
            }
            if adjusted(&row.estimate).is_some() {
                let text = &mut maps.entry(&row.estimate).or_default()[1];
                let ends = [row.start_x, row.start_y, row.start_z, row.end_x, row.end_y, row.end_z];
                line(text, "Mapline:", &[row.line_id.0], &ends)?;
            } else {
                *nameless.entry(&row.estimate).or_default() += 1;
            }
        }
        for (name, [points, lines]) in maps {
            let stem = adjusted(name).unwrap_or_default();
            self.push(&format!("baseline/{stem}_Mappoint.txt"), points);
            self.push(&format!("baseline/{stem}_Mapline.txt"), lines);
        }
        for (name, count) in nameless {
            self.remarks
                .lost(count, format!("landmarks of `{name}` are left out: the release has no file for them"));
        }
        Ok(())
    }

    fn parameters(&mut self, graph: Option<&FactorGraph>) {
        let sequence = self.sequence;
        let [points, lines] = match graph {
            Some(graph) => [graph.points.len(), graph.lines.len()],
            None => [sequence.point_landmarks.len(), sequence.line_landmarks.len()],
        };
        let given = &sequence.manifest.generator.parameters;
        let entry = |name: &str, value: String| {
            let value = given.get(&format!("source.{name}")).cloned().unwrap_or(value);
            format!("{name}:{value}\n")
        };
        let text = [
            entry("frame_num_", sequence.frames.len().to_string()),
            // 9 stands for none of the simulator's paths.
            entry("traject_type_", "9".to_owned()),
            entry("lines_", lines.to_string()),
            entry("points_", points.to_string()),
        ];
        self.push("baseline/system_parameter.txt", text.concat());
    }

    /// Tells what no file has a place for.
    fn tell(&mut self, graph: &str) {
        let sequence = self.sequence;
        let stamp = |id: i64| {
            let (seconds, rest) = (id / RATE_HZ, id % RATE_HZ);
            seconds
                .checked_mul(1_000_000_000)
                .map(|whole| whole + (rest * 1_000_000_000 + RATE_HZ / 2) / RATE_HZ)
        };
        let other =
            sequence.frames.iter().filter(|row| stamp(row.frame_id.0) != Some(row.stamp_nanos)).count();
        self.remarks.lost(other, "stamps are left out: readers make them from the ids, at 30 Hz");
        self.remarks
            .lost(sequence.manifest.cameras.len().saturating_sub(1), "cameras beyond the first are left out");
        let groups =
            sequence.structural_groups.iter().filter(|group| group.kind != registry::PARALLEL).count();
        self.remarks.lost(groups, "groups other than parallel lines are left out");
        let graphs = FactorGraph::names(sequence).iter().filter(|name| *name != graph).count();
        self.remarks.lost(graphs, "graphs of other names are left out");
        self.remarks.lost(
            sequence.tracking.len() + sequence.iterations.len(),
            "rows of trackers and optimisers are left out",
        );
        let covariances = sequence.trajectories.iter().filter(|row| row.covariance.is_some()).count();
        self.remarks.lost(covariances, "covariances are left out");
    }
}

/// What a file of an adjusted estimate begins with: `point-line-ba` is `PointLine`; `None` for a name that is not read back.
fn adjusted(estimate: &str) -> Option<String> {
    match estimate {
        registry::POINT_BA => return Some("Point".to_owned()),
        registry::POINT_LINE_BA => return Some("PointLine".to_owned()),
        _ => {}
    }
    let stem = estimate.strip_suffix("-ba")?;
    let plain = stem.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit());
    // Names that readers take for another kind of file, or for another name.
    let other =
        ["ba", "point", "line"].iter().any(|end| stem.ends_with(end)) || stem.contains("linelandmark");
    (plain && !stem.is_empty() && !other).then(|| stem.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{
        CameraId, Frame, FrameId, GraphPose, GroupId, LineId, MapPoint, PointId, StructuralGroup,
    };

    #[test]
    fn names_of_estimates_are_those_that_readers_make_of_the_files() {
        assert_eq!(adjusted("point-ba").as_deref(), Some("Point"));
        assert_eq!(adjusted("point-line-ba").as_deref(), Some("PointLine"));
        assert_eq!(adjusted("structural-ba").as_deref(), Some("structural"));
        for name in ["frame-to-frame", "my-own-ba", "ba", "-ba", "midpoint-ba", "Mine-ba", "ba-ba"] {
            assert_eq!(adjusted(name), None, "{name}");
        }
    }

    #[test]
    fn lines_are_those_of_the_release() {
        let pose = PoseRow { translation: [9.0, 0.0, 1.5], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
        let sequence = Sequence {
            frames: vec![Frame::new(FrameId(0), 0, CameraId(0), Some(pose))],
            graph_poses: vec![GraphPose::new("initial".to_owned(), FrameId(0), true, pose)],
            map_points: vec![MapPoint {
                estimate: "point-ba".to_owned(),
                point_id: PointId(3),
                x: 1.0,
                y: 2.0,
                z: -0.5,
                covariance: None,
            }],
            point_measurements: vec![PointMeasurement {
                frame_id: FrameId(0),
                point_id: PointId(3),
                u: 10.25,
                v: 20.5,
                depth: Some(2.0),
            }],
            structural_groups: vec![StructuralGroup {
                group_id: GroupId(5),
                kind: registry::PARALLEL.to_owned(),
                line_ids: vec![LineId(1), LineId(4)],
                ..StructuralGroup::default()
            }],
            ..Sequence::default()
        };
        let (files, remarks) = to_text_release(&sequence, None).unwrap();
        let told = |name: &str| files.iter().find(|file| file.name == name).unwrap().text.clone();
        let vertex = "0 9.0 0.0 1.5 0.0 0.0 0.0 1.0\n";
        assert_eq!(told("observation/camera_poses.txt"), vertex);
        assert!(told("baseline/venom_sequence.txt").starts_with(&format!("Vertex: {vertex}")));
        assert_eq!(told("baseline/Point_Mappoint.txt"), "Mappoint:3 1.0 2.0 -0.5\n");
        assert_eq!(
            told("observation/association.txt"),
            "MappointFrameAsso: 3 0 10.25 20.5\nParalineMaplineAsso: 5 2 1 4\n"
        );
        assert_eq!(remarks.len(), 1, "{remarks:?}");
        assert!(remarks[0].loss && remarks[0].text.starts_with("depths of points"));
        let message = to_text_release(&sequence, Some("other")).unwrap_err().to_string();
        assert_eq!(message, "graph `other`: expected one of the sequence, found none");
    }
}
