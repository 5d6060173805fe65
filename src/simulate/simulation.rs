//! From a recipe to a sequence.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::Point3;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::landmarks::{DrawnLine, LineSource, PointSource, cells_about};
use super::scene::Scene;
use super::survey::{SeenLine, Survey};
use super::visibility::{Occluders, Places, View};
use super::{Density, Error, Recipe};
use crate::geometry::Segment;
use crate::storage::{self, File, Found};
use crate::structure::{
    Camera, Clock, Frame, FrameBundle, FrameId, Generator, GroupId, LineId, LineLandmark, LineObservation,
    Manifest, PointId, PointLandmark, PointObservation, PoseRow, Source, SourceFile, StructuralGroup, hex,
    registry,
};

/// Landmarks that are drawn to learn how many a frame sees.
const PILOT: usize = 512;
/// So many are drawn for each that is wanted, before it is said that frames do not see enough.
const MOST_DRAWS: u64 = 50;
/// Frames that are made at once.
const CHUNK: usize = 128;
/// Lines of one direction that overlap and are nearer than this are one line, metres.
const SAME_LINE_M: f64 = 0.01;

/// A simulated sequence: landmarks, truth, and what each frame sees of them.
///
/// The rows of a frame are made when they are asked for, so that a sequence longer than memory can be
/// written.
#[derive(Clone, Debug)]
pub struct Simulation {
    recipe: Recipe,
    camera: Camera,
    files: Vec<SourceFile>,
    scene: Scene,
    frames: Vec<Frame>,
    views: Vec<View>,
    points: Vec<Point3<f64>>,
    lines: Vec<Segment>,
    groups: Vec<StructuralGroup>,
    seen_points: Vec<Places>,
    seen_lines: Vec<Vec<SeenLine>>,
}

/// Makes the sequence of a recipe.
///
/// * `folder` — where names of files in the recipe start.
/// * `progress` — told of what is done and how far it is, from any thread.
///
/// # Errors
/// [`Error::Value`] where the recipe cannot be followed, such as landmarks that no frame would see; those of
/// files that it names.
pub fn simulate(
    recipe: &Recipe,
    folder: &Path,
    progress: &(dyn Fn(&'static str, u64, u64) + Sync),
) -> Result<Simulation, Error> {
    recipe.check()?;
    let seed = recipe.seed;
    let pinhole = recipe.camera.pinhole("camera")?;
    let camera = recipe.camera.camera("camera")?;
    let files = recipe.files().into_iter().map(|name| source_file(name, folder)).collect::<Result<_, _>>()?;
    let scene = Scene::build(&recipe.scene, folder)?;
    let poses = recipe.trajectory.poses(recipe.rate_hz, seed, folder)?;
    let bounds = recipe.visibility.bounds();
    let views: Vec<View> =
        poses.iter().map(|timed| View::new(pinhole, &timed.world_from_camera, bounds)).collect();
    let frames = (0..)
        .zip(&poses)
        .map(|(id, timed)| {
            let (translation, rotation_xyzw) = timed.world_from_camera.components();
            let pose = PoseRow { translation, rotation_xyzw };
            Frame::new(FrameId(id), timed.stamp_nanos, camera.camera_id, Some(pose))
        })
        .collect();

    let survey = Survey::new(views, Occluders::new(&scene), recipe.visibility);
    let filling = |what: &'static str| Filling {
        what,
        min_observations: recipe.min_observations,
        frames: survey.views.len(),
        progress,
    };
    let source = PointSource::new(&scene, seed);
    let (points, seen_points) = filling("points").fill(
        Wanted::of(recipe.points.count, recipe.points.density.map(Density::points_per_frame)),
        |index| Ok(Some(source.point(index))),
        |points, tick| survey.points_as(points, tick, Places::from_iter),
    )?;
    let source = LineSource::new(&scene, &recipe.lines, seed);
    let (drawn, seen_lines) = filling("lines").fill(
        Wanted::of(recipe.lines.count, recipe.lines.density.map(Density::lines_per_frame)),
        {
            let mut apart = Apart::default();
            move |index| Ok(Some(source.line(index)?).filter(|line| apart.admit(line)))
        },
        |lines: &[DrawnLine], tick| {
            let segments: Vec<Segment> = lines.iter().map(|line| line.segment).collect();
            survey.lines(&segments, tick)
        },
    )?;
    Ok(Simulation {
        recipe: recipe.clone(),
        camera,
        files,
        frames,
        points,
        groups: groups(&drawn),
        lines: drawn.into_iter().map(|line| line.segment).collect(),
        seen_points,
        seen_lines,
        views: survey.views,
        scene,
    })
}

/// A file that the recipe names, with its size and digest.
fn source_file(name: &Path, folder: &Path) -> Result<SourceFile, Error> {
    let path = storage::named(folder, name);
    let io = |source| Error::Io { path: path.clone(), source };
    if !matches!(storage::find(&path).map_err(io)?, Found::File(_)) {
        let found = "a folder or a device".to_owned();
        return Err(Error::Content { path, line: None, expected: "a file".to_owned(), found });
    }
    let mut file = File::open(&path).map_err(io)?;
    let mut hasher = Sha256::new();
    let mut bytes = 0;
    let mut buffer = vec![0; 1 << 16];
    loop {
        let read = file.read(&mut buffer).map_err(io)?;
        if read == 0 {
            break;
        }
        hasher.update(&buffer[..read]);
        bytes += read as u64;
    }
    Ok(SourceFile { name: name.display().to_string(), bytes, sha256: hex(&hasher.finalize()) })
}

/// How many landmarks are wanted.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    Count(u64),
    PerFrame(f64),
}

impl Wanted {
    fn of(count: Option<u32>, per_frame: Option<f64>) -> Self {
        match (count, per_frame) {
            (_, Some(per_frame)) => Self::PerFrame(per_frame),
            (count, None) => Self::Count(count.unwrap_or(0).into()),
        }
    }
}

/// What a frame sees of the landmarks of a kind, ascending by their places.
trait SeenList: Default {
    fn places(&self) -> impl Iterator<Item = u32>;

    /// Adds what is seen of landmarks that have a name, by their names; these ascend with the places, and are
    /// above all that came before.
    fn take(&mut self, new: Self, name_of: &[Option<u32>]);
}

impl SeenList for Places {
    fn places(&self) -> impl Iterator<Item = u32> {
        self.iter()
    }

    fn take(&mut self, new: Self, name_of: &[Option<u32>]) {
        new.iter().filter_map(|place| name_of[place as usize]).for_each(|name| self.push(name));
        self.shrink_to_fit();
    }
}

impl SeenList for Vec<SeenLine> {
    fn places(&self) -> impl Iterator<Item = u32> {
        self.iter().map(|seen| seen.line)
    }

    fn take(&mut self, new: Self, name_of: &[Option<u32>]) {
        self.extend(
            new.into_iter().filter_map(|seen| Some(SeenLine { line: name_of[seen.line as usize]?, ..seen })),
        );
        self.shrink_to_fit();
    }
}

/// Draws landmarks until enough of them are seen.
struct Filling<'a> {
    what: &'static str,
    min_observations: u32,
    frames: usize,
    progress: &'a (dyn Fn(&'static str, u64, u64) + Sync),
}

impl Filling<'_> {
    /// Landmarks that are seen often enough, in the order in which they were drawn, and who sees them.
    ///
    /// * `draw` — the landmark of an index, `None` for one that is not to be used.
    /// * `see` — for each frame what it sees of some landmarks, ascending by their places.
    fn fill<T, S: SeenList>(
        &self,
        wanted: Wanted,
        mut draw: impl FnMut(u64) -> Result<Option<T>, Error>,
        see: impl Fn(&[T], &(dyn Fn() + Sync)) -> Vec<S>,
    ) -> Result<(Vec<T>, Vec<S>), Error> {
        let mut kept: Vec<T> = Vec::new();
        let mut seen: Vec<S> = Vec::new();
        seen.resize_with(self.frames, S::default);
        let (mut target, mut batch) = match wanted {
            Wanted::Count(count) => (count, count),
            Wanted::PerFrame(_) => (0, PILOT as u64),
        };
        let mut pilot = if let Wanted::PerFrame(per_frame) = wanted { Some(per_frame) } else { None };
        let mut drawn = 0_u64;
        while batch > 0 {
            let mut landmarks = Vec::new();
            for index in drawn..drawn + batch {
                landmarks.extend(draw(index)?);
            }
            drawn += batch;
            let done = AtomicU64::new(0);
            let total = self.frames as u64;
            let tick = || (self.progress)(self.what, done.fetch_add(1, Ordering::Relaxed) + 1, total);
            let found = see(&landmarks, &tick);
            let mut counts = vec![0_u32; landmarks.len()];
            found.iter().for_each(|list| list.places().for_each(|place| counts[place as usize] += 1));
            if let Some(per_frame) = pilot.take() {
                target = self.target(per_frame, &found, &counts)?;
            }
            // Names of those that stay; the others, and those over the count, have none.
            let room = usize::try_from(target).unwrap_or(usize::MAX);
            let mut name_of = vec![None; landmarks.len()];
            for (place, landmark) in landmarks.into_iter().enumerate() {
                if counts[place] >= self.min_observations && kept.len() < room {
                    name_of[place] = u32::try_from(kept.len()).ok();
                    kept.push(landmark);
                }
            }
            for (all, new) in seen.iter_mut().zip(found) {
                all.take(new, &name_of);
            }
            let missing = target - (kept.len() as u64).min(target);
            if missing > 0 && drawn > MOST_DRAWS * target + 1000 {
                let expected = format!(
                    "a number of {} of which each is seen in {} frames",
                    self.what, self.min_observations
                );
                let found = format!("{target}, but of {drawn} drawn only {} are", kept.len());
                return Err(Error::value(self.what, expected, found));
            }
            // As many as should do, by what was seen so far, and some more.
            let rate = (kept.len() as f64 / drawn as f64).max(0.02);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "counts of landmarks"
            )]
            let next = (missing as f64 / rate * 1.1) as u64 + 16;
            batch = if missing == 0 { 0 } else { next };
        }
        Ok((kept, seen))
    }

    /// Landmarks that make the median frame see so many, by what frames saw of the pilot.
    fn target<S: SeenList>(&self, per_frame: f64, found: &[S], counts: &[u32]) -> Result<u64, Error> {
        let mut per_view: Vec<usize> = found.iter().map(|list| list.places().count()).collect();
        per_view.sort_unstable();
        let median = per_view.get(per_view.len() / 2).copied().unwrap_or(0).max(1);
        let usable = counts.iter().filter(|count| **count >= self.min_observations).count();
        if usable == 0 {
            return Err(Error::value(
                self.what,
                "landmarks that frames see",
                format!("none of {} drawn", counts.len()),
            ));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counts of landmarks")]
        let target = (per_frame * usable as f64 / median as f64).ceil() as u64;
        Ok(target.clamp(1, 10_000_000))
    }
}

/// Keeps lines of one direction apart.
#[derive(Default)]
struct Apart {
    lines: HashMap<(u32, [i64; 3]), Vec<Segment>>,
}

impl Apart {
    /// Whether a line overlaps none before it; it is remembered then.
    fn admit(&mut self, line: &DrawnLine) -> bool {
        let Some(family) = line.family else { return true };
        let segment = line.segment;
        let Some(direction) = (segment.end - segment.start).try_normalize(0.0) else { return false };
        // The foot of the perpendicular from the origin is the same for every piece of one line.
        let foot = segment.start.coords - direction * direction.dot(&segment.start.coords);
        #[expect(clippy::cast_possible_truncation, reason = "coordinates of a scene")]
        let cell: [i64; 3] = std::array::from_fn(|axis| (foot[axis] / (2.0 * SAME_LINE_M)).floor() as i64);
        let along = |other: &Segment| {
            let ends = [other.start, other.end].map(|end| direction.dot(&(end - segment.start)));
            [ends[0].min(ends[1]), ends[0].max(ends[1])]
        };
        let length = (segment.end - segment.start).norm();
        for near in cells_about(cell) {
            for other in self.lines.get(&(family, near)).into_iter().flatten() {
                let [low, high] = along(other);
                let aside = (other.start - segment.start).cross(&direction).norm();
                if aside < SAME_LINE_M && low < length && high > 0.0 {
                    return false;
                }
            }
        }
        self.lines.entry((family, cell)).or_default().push(segment);
        true
    }
}

/// Groups of the lines that share a direction; a line alone with its own is in none.
fn groups(lines: &[DrawnLine]) -> Vec<StructuralGroup> {
    let mut members: std::collections::BTreeMap<u32, Vec<LineId>> = std::collections::BTreeMap::new();
    for (id, line) in (0..).zip(lines) {
        if let Some(family) = line.family {
            members.entry(family).or_default().push(LineId(id));
        }
    }
    let parallel = members.into_values().filter(|lines| lines.len() > 1);
    (0..)
        .zip(parallel)
        .map(|(group, line_ids)| {
            let first = line_ids.first().and_then(|id| lines.get(usize::try_from(id.0).ok()?));
            let direction = first.and_then(|line| (line.segment.end - line.segment.start).try_normalize(0.0));
            StructuralGroup {
                group_id: GroupId(group),
                kind: registry::PARALLEL.to_owned(),
                direction_x: direction.map(|direction| direction.x),
                direction_y: direction.map(|direction| direction.y),
                direction_z: direction.map(|direction| direction.z),
                line_ids,
            }
        })
        .collect()
}

impl Simulation {
    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Frames with their true poses.
    #[must_use]
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// True points.
    #[must_use]
    pub fn point_landmarks(&self) -> Vec<PointLandmark> {
        (0..).zip(&self.points).map(|(id, point)| PointLandmark::new(PointId(id), *point)).collect()
    }

    /// True lines in their three forms.
    ///
    /// # Errors
    /// [`Error::Geometry`] for a line without length, which is not drawn.
    pub fn line_landmarks(&self) -> Result<Vec<LineLandmark>, Error> {
        let row = |(id, line): (i64, &Segment)| {
            LineLandmark::from_segment(LineId(id), line)
                .map_err(|source| Error::Geometry { place: format!("line {id}"), source })
        };
        (0..).zip(&self.lines).map(row).collect()
    }

    /// Groups of parallel lines.
    #[must_use]
    pub fn structural_groups(&self) -> &[StructuralGroup] {
        &self.groups
    }

    /// What is said about the sequence as a whole.
    #[must_use]
    pub fn manifest(&self) -> Manifest {
        let recipe = Recipe { expected: None, ..self.recipe.clone() };
        let seed = recipe.seed;
        let text = serde_json::to_string(&recipe).unwrap_or_default();
        Manifest {
            name: recipe.name.clone(),
            description: recipe.description.clone(),
            source: Source {
                dataset: registry::SIMULATION.to_owned(),
                sequence: Some(recipe.name.clone()),
                licence: Some(recipe.licence.clone()),
                citation: recipe.citation.clone(),
                files: self.files.clone(),
                ..Source::default()
            },
            generator: Generator {
                tool: "os simulate".to_owned(),
                version: env!("CARGO_PKG_VERSION").to_owned(),
                seed: Some(seed),
                parameters: [("recipe".to_owned(), text)].into(),
            },
            clock: Clock { kind: registry::SYNTHETIC.to_owned(), rate_hz: Some(recipe.rate_hz) },
            cameras: vec![self.camera.clone()],
            noise: recipe.noise.as_ref().map(|noise| noise.declared(seed)),
            ..Manifest::default()
        }
    }

    /// A frame with its rows; `None` past the last.
    #[must_use]
    pub fn frame(&self, index: usize) -> Option<FrameBundle> {
        let (frame, view) = (self.frames.get(index)?, self.views.get(index)?);
        let frame_id = frame.frame_id;
        let point_observations: Vec<PointObservation> = self.seen_points[index]
            .iter()
            .filter_map(|place| {
                let (pixel, depth) = view.project(&self.points[place as usize])?;
                let point_id = PointId(i64::from(place));
                Some(PointObservation { frame_id, point_id, u: pixel.x, v: pixel.y, depth: Some(depth) })
            })
            .collect();
        let line_observations: Vec<LineObservation> = self.seen_lines[index]
            .iter()
            .filter_map(|seen| {
                let line = &self.lines[seen.line as usize];
                let along = line.end - line.start;
                let [start, end] = seen.part.map(|t| view.project_unbounded(&(line.start + along * t)));
                let ((start, start_depth), (end, end_depth)) = (start?, end?);
                Some(LineObservation {
                    frame_id,
                    line_id: LineId(i64::from(seen.line)),
                    start_u: start.x,
                    start_v: start.y,
                    start_depth: Some(start_depth),
                    end_u: end.x,
                    end_v: end.y,
                    end_depth: Some(end_depth),
                })
            })
            .collect();
        let (point_measurements, line_measurements) = match &self.recipe.noise {
            Some(noise) => noise.measure(
                &self.camera,
                frame_id,
                &point_observations,
                &line_observations,
                self.recipe.seed,
            ),
            None => (Vec::new(), Vec::new()),
        };
        Some(FrameBundle {
            frame: frame.clone(),
            point_observations,
            line_observations,
            point_measurements,
            line_measurements,
        })
    }

    /// Every frame with its rows, in order; made on all cores, a few at a time.
    pub fn bundles(&self) -> impl Iterator<Item = FrameBundle> + '_ {
        (0..self.frames.len()).step_by(CHUNK).flat_map(move |begin| {
            let end = (begin + CHUNK).min(self.frames.len());
            (begin..end).into_par_iter().filter_map(|index| self.frame(index)).collect::<Vec<_>>()
        })
    }
}
