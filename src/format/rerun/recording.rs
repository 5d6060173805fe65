//! What of a sequence is shown, entity by entity.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use arrow::error::ArrowError;

use super::chunk::{Chunk, Component};
use super::rrd_stream::RrdStream;
use super::shown::{Shown, image_distance, points_of, rgba, segments_of, single};
use crate::format::Error;
use crate::format::foxglove::color::POINT;
use crate::geometry::Segment;
use crate::structure::{CameraId, Frame, FrameBundle, FrameId, LineId, PoseRow, Sequence};

/// Rows of a chunk: viewers load and drop chunks as a whole.
const ROWS: usize = 256;
/// Radii and widths in the viewer's own units: negative ones are points of the screen.
const DOT: f32 = -1.5;
const NOW: f32 = -4.0;

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RerunCounts {
    /// Entities.
    pub entities: usize,
    /// Frames on the timeline.
    pub frames: usize,
}

/// Writes a sequence as a recording of the Rerun viewer.
///
/// The same sequence gives the same bytes.
///
/// # Errors
/// [`Error::Io`] when the file cannot be written.
pub fn write_rerun(path: &Path, sequence: &Sequence) -> Result<RerunCounts, Error> {
    let file = File::create(path).map_err(Error::io(path))?;
    let stream = RrdStream::begin(BufWriter::new(file), &sequence.manifest.name).map_err(Error::io(path))?;
    let mut recording = Recording { path, stream, entities: BTreeSet::new(), shown: Shown::of(sequence) };
    recording.world()?;
    recording.maps()?;
    recording.trajectories()?;
    recording.cameras()?;
    let counts = RerunCounts { entities: recording.entities.len(), frames: sequence.frames.len() };
    recording.stream.finish().map_err(Error::io(path))?;
    Ok(counts)
}

/// A recording that is being written.
struct Recording<'a> {
    path: &'a Path,
    stream: RrdStream<BufWriter<File>>,
    entities: BTreeSet<String>,
    shown: Shown<'a>,
}

impl Recording<'_> {
    fn failed(&self) -> impl Fn(ArrowError) -> Error + use<> {
        let path = self.path.to_owned();
        move |problem| Error::Container {
            path: path.clone(),
            container: "Arrow",
            detail: problem.to_string(),
        }
    }

    /// Adds components of an entity.
    fn add(
        &mut self,
        entity: &str,
        times: Option<Vec<[i64; 2]>>,
        components: impl IntoIterator<Item = Result<Component, ArrowError>>,
    ) -> Result<(), Error> {
        let components = components.into_iter().collect::<Result<Vec<_>, _>>().map_err(self.failed())?;
        let chunk = Chunk { entity: entity.to_owned(), times, components };
        let id = self.stream.tuid();
        let rows = chunk.times.as_ref().map_or(1, Vec::len);
        let row_ids: Vec<_> = (0..rows).map(|_| self.stream.tuid()).collect();
        let bytes = chunk.encode(id, &row_ids).map_err(self.failed())?;
        self.stream.chunk(id, &bytes, chunk.times.is_none()).map_err(Error::io(self.path))?;
        self.entities.insert(entity.to_owned());
        Ok(())
    }

    fn world(&mut self) -> Result<(), Error> {
        let upward = self.shown.upward();
        self.add("/world", None, [Component::axes(["ViewCoordinates", "xyz", "ViewCoordinates"], upward)])
    }

    /// Landmarks, and the maps of estimates.
    fn maps(&mut self) -> Result<(), Error> {
        let sequence = self.shown.sequence;
        let mut points: BTreeMap<String, Vec<[f32; 3]>> = BTreeMap::new();
        let mut lines: BTreeMap<String, Vec<(LineId, Segment)>> = BTreeMap::new();
        let map = |estimate: &str| format!("/world/maps/{}", escaped(estimate));
        for row in &sequence.point_landmarks {
            points.entry("/world/landmarks".to_owned()).or_default().push(self.shown.point(row.position()));
        }
        for row in &sequence.map_points {
            points
                .entry(map(&row.estimate))
                .or_default()
                .push(self.shown.point([row.x, row.y, row.z].into()));
        }
        for row in &sequence.line_landmarks {
            lines.entry("/world/landmarks".to_owned()).or_default().push((row.line_id, row.segment()));
        }
        for row in &sequence.map_lines {
            lines.entry(map(&row.estimate)).or_default().push((row.line_id, row.segment()));
        }
        for (entity, places) in points {
            let components = [
                Component::vectors(["Points3D", "positions", "Position3D"], &[places]),
                Component::colours("Points3D", &[vec![rgba(&POINT)]]),
                Component::number(["Points3D", "radii", "Radius"], DOT),
            ];
            self.add(&format!("{entity}/points"), None, components)?;
        }
        for (entity, segments) in lines {
            let (strips, colours) = self.strips(segments.into_iter().map(|(line, segment)| {
                (line, [segment.start, segment.end].map(|end| self.shown.point(end)).to_vec())
            }));
            let components = [
                Component::strips(["LineStrips3D", "strips", "LineStrip3D"], &[strips]),
                Component::colours("LineStrips3D", &[colours]),
            ];
            self.add(&format!("{entity}/lines"), None, components)?;
        }
        Ok(())
    }

    /// Strips of lines with the colours of their groups.
    fn strips<const N: usize>(
        &self,
        lines: impl Iterator<Item = (LineId, Vec<[f32; N]>)>,
    ) -> (Vec<Vec<[f32; N]>>, Vec<u32>) {
        let (mut strips, mut colours) = (Vec::new(), Vec::new());
        for (colour, of_colour) in self.shown.colors.by_color(lines) {
            colours.resize(colours.len() + of_colour.len(), rgba(&colour));
            strips.extend(of_colour);
        }
        (strips, colours)
    }

    /// Whole paths, and where each is at a time.
    fn trajectories(&mut self) -> Result<(), Error> {
        for (place, ((estimate, camera), rows)) in self.shown.paths().into_iter().enumerate() {
            let (name, colour) = match &estimate {
                None => ("true_trajectory".to_owned(), TRUE_PATH),
                Some(name) => {
                    (format!("estimated_trajectories/{}", escaped(name)), PATHS[place % PATHS.len()])
                }
            };
            let entity = format!("/world/{name}/camera_{}", camera.0);
            let placed: Vec<([i64; 2], [f32; 3])> = rows
                .iter()
                .filter_map(|(frame, pose)| {
                    let (position, _) = self.shown.space.position_and_rotation(pose)?;
                    Some((*self.shown.times.get(frame)?, position.map(single)))
                })
                .collect();
            if placed.len() > 1 {
                let strip: Vec<[f32; 3]> = placed.iter().map(|(_, place)| *place).collect();
                let components = [
                    Component::strips(["LineStrips3D", "strips", "LineStrip3D"], &[vec![strip]]),
                    Component::colours("LineStrips3D", &[vec![colour]]),
                ];
                self.add(&entity, None, components)?;
            }
            let now = format!("{entity}/now");
            for rows in placed.chunks(ROWS) {
                let places: Vec<Vec<[f32; 3]>> = rows.iter().map(|(_, place)| vec![*place]).collect();
                let components = [Component::vectors(["Points3D", "positions", "Position3D"], &places)];
                self.add(&now, Some(rows.iter().map(|(time, _)| *time).collect()), components)?;
            }
            if !placed.is_empty() {
                let components = [
                    Component::colours("Points3D", &[vec![colour]]),
                    Component::number(["Points3D", "radii", "Radius"], NOW),
                ];
                self.add(&now, None, components)?;
            }
        }
        Ok(())
    }

    /// Cameras that move, and what they measured.
    fn cameras(&mut self) -> Result<(), Error> {
        let sequence = self.shown.sequence;
        let poses = self.shown.poses();
        let distance = image_distance(&poses);
        for camera in &sequence.manifest.cameras {
            let entity = format!("/world/camera_{}", camera.camera_id.0);
            let [fx, fy, cx, cy] = self.shown.space.intrinsics(camera).map(single);
            let size = [single(f64::from(camera.width)), single(f64::from(camera.height))];
            let components = [
                Component::vectors(
                    ["Pinhole", "image_from_camera", "PinholeProjection"],
                    &[vec![[fx, 0.0, 0.0, 0.0, fy, 0.0, cx, cy, 1.0]]],
                ),
                Component::vectors(["Pinhole", "resolution", "Resolution"], &[vec![size]]),
                Component::axes(["Pinhole", "camera_xyz", "ViewCoordinates"], [3, 2, 5]),
                Component::number(["Pinhole", "image_plane_distance", "ImagePlaneDistance"], distance),
            ];
            self.add(&entity, None, components)?;
        }
        let mut bundles: BTreeMap<CameraId, Vec<FrameBundle>> = BTreeMap::new();
        for bundle in sequence.bundles() {
            let waiting = bundles.entry(bundle.frame.camera_id).or_default();
            waiting.push(bundle);
            if waiting.len() == ROWS {
                let full = std::mem::take(waiting);
                self.frames(&full, &poses)?;
            }
        }
        bundles.into_values().filter(|rest| !rest.is_empty()).try_for_each(|rest| self.frames(&rest, &poses))
    }

    /// Frames of one camera.
    fn frames(&mut self, bundles: &[FrameBundle], poses: &BTreeMap<FrameId, PoseRow>) -> Result<(), Error> {
        let Some(camera) = bundles.first().map(|bundle| bundle.frame.camera_id) else { return Ok(()) };
        let entity = format!("/world/camera_{}", camera.0);
        let time = |frame: &Frame| self.shown.times.get(&frame.frame_id).copied();
        let moved: Vec<([i64; 2], [f32; 3], [f32; 4])> = bundles
            .iter()
            .filter_map(|bundle| {
                let (position, rotation) =
                    self.shown.space.position_and_rotation(poses.get(&bundle.frame.frame_id)?)?;
                Some((time(&bundle.frame)?, position.map(single), rotation.map(single)))
            })
            .collect();
        let times: Vec<[i64; 2]> = bundles.iter().filter_map(|bundle| time(&bundle.frame)).collect();
        if !moved.is_empty() {
            let positions: Vec<Vec<[f32; 3]>> =
                moved.iter().map(|(_, position, _)| vec![*position]).collect();
            let rotations: Vec<Vec<[f32; 4]>> =
                moved.iter().map(|(_, _, rotation)| vec![*rotation]).collect();
            let components = [
                Component::vectors(["Transform3D", "translation", "Translation3D"], &positions),
                Component::vectors(["Transform3D", "quaternion", "RotationQuat"], &rotations),
            ];
            self.add(&entity, Some(moved.iter().map(|(time, ..)| *time).collect()), components)?;
        }
        // A frame of an unknown camera has pixels, but nobody knows on which image.
        let Some(camera) = self.shown.sequence.manifest.camera(camera) else { return Ok(()) };
        let points: Vec<Vec<[f32; 2]>> = bundles.iter().map(|bundle| points_of(camera, bundle)).collect();
        let (strips, colours): (Vec<_>, Vec<_>) =
            bundles.iter().map(|bundle| self.strips(segments_of(camera, bundle).into_iter())).unzip();
        let coloured: Vec<Vec<u32>> =
            points.iter().map(|points| vec![rgba(&POINT); usize::from(!points.is_empty())]).collect();
        let components = [
            Component::vectors(["Points2D", "positions", "Position2D"], &points),
            Component::colours("Points2D", &coloured),
        ];
        self.add(&format!("{entity}/points"), Some(times.clone()), components)?;
        let components = [
            Component::strips(["LineStrips2D", "strips", "LineStrip2D"], &strips),
            Component::colours("LineStrips2D", &colours),
        ];
        self.add(&format!("{entity}/lines"), Some(times), components)
    }
}

/// Colour of the true path, and colours of estimates: Okabe and Ito (2008).
const TRUE_PATH: u32 = 0xb0b0_b0ff;
const PATHS: [u32; 6] = [0xe69f_00ff, 0x56b4_e9ff, 0xcc79_a7ff, 0xd55e_00ff, 0x0072_b2ff, 0xf0e4_42ff];

/// A name as a part of an entity's path.
fn escaped(name: &str) -> String {
    let mut safe = String::with_capacity(name.len());
    for letter in name.chars() {
        match letter {
            letter if letter.is_alphanumeric() || matches!(letter, '_' | '-' | '.') => safe.push(letter),
            letter if letter == ' ' || letter.is_ascii_punctuation() => safe.extend(['\\', letter]),
            letter => safe.push_str(&format!("\\u{{{:04X}}}", u32::from(letter))),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_parts_of_paths() {
        assert_eq!(escaped("map-to-frame.2"), "map-to-frame.2");
        assert_eq!(escaped("a/b c"), "a\\/b\\ c");
        assert_eq!(escaped("a\nb"), "a\\u{000A}b");
    }
}
