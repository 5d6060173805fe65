//! What of a factor graph can be used: vertices, observations, and the reasons for what is left out.

use super::error::Error;
use super::options::{Method, Options};
use super::planar_pose::is_planar;
use super::relative_poses::{RelativeView, relative_view};
use super::summary::{Reason, Summary, Tally};
use super::whitening::root as information_root;
use crate::geometry::{PinholeCamera, PluckerLine, Pose, Segment, line_residual};
use crate::structure::{
    DepthNoise, FactorGraph, FrameId, GraphFactor, LineId, MeasurementNoise, PointId, registry,
};
use nalgebra::{DMatrix, Point2, Point3, Vector2, Vector3};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// A pose of the graph.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameVertex {
    pub(super) frame_id: FrameId,
    pub(super) camera_from_world: Pose,
    pub(super) fixed: bool,
}

/// A point of the graph.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointVertex {
    pub(super) point_id: PointId,
    pub(super) position: Point3<f64>,
}

/// A line of the graph.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineVertex {
    pub(super) line_id: LineId,
    pub(super) segment: Segment,
    pub(super) line: PluckerLine,
}

/// A point in a frame; vertices by their place in the lists.
#[derive(Clone, Debug)]
pub(super) struct PointView {
    pub(super) frame: usize,
    pub(super) point: usize,
    pub(super) camera: PinholeCamera,
    pub(super) pixel: [f64; 2],
    pub(super) depth: Option<f64>,
    /// In a box, for most have none and there may be millions of views.
    pub(super) information: Option<Box<DMatrix<f64>>>,
}

/// A line in a frame.
#[derive(Clone, Debug)]
pub(super) struct LineView {
    pub(super) frame: usize,
    pub(super) line: usize,
    pub(super) camera: PinholeCamera,
    pub(super) ends: [Vector2<f64>; 2],
    pub(super) depths: [Option<f64>; 2],
    /// Over the four coordinates, and the depths where there are any.
    pub(super) information: Option<DMatrix<f64>>,
}

/// What can be used of a graph.
#[derive(Clone, Debug, Default)]
pub(super) struct Observations {
    pub(super) frames: Vec<FrameVertex>,
    pub(super) points: Vec<PointVertex>,
    pub(super) lines: Vec<LineVertex>,
    pub(super) point_views: Vec<PointView>,
    pub(super) line_views: Vec<LineView>,
    pub(super) relatives: Vec<RelativeView>,
    /// Whether poses and relative poses keep the plane z = 0 and nothing is said of what leaves it; they are then adjusted in it.
    pub(super) planar: bool,
    pub(super) noise: MeasurementNoise,
}

impl Observations {
    /// Looks through a graph.
    pub(super) fn of(graph: &FactorGraph, options: &Options, summary: &mut Summary) -> Result<Self, Error> {
        let mut noise = graph.noise;
        if let Some(sigma_px) = options.sigma_px {
            noise.sigma_px = sigma_px;
        }
        if options.method != Method::Structural {
            noise = MeasurementNoise { depth: DepthNoise::Unknown, ..noise };
        }
        let mut found = Self { noise, ..Self::default() };
        let cameras = cameras(graph);
        let (frames, points, lines) = found.vertices(graph, options, summary);
        let (with_points, with_lines) = match options.method {
            Method::Point => (true, false),
            Method::PointLine | Method::Structural => (true, true),
            Method::PoseGraph => (false, false),
        };
        for factor in &graph.factors {
            match factor.kind.as_str() {
                registry::POINT_REPROJECTION if with_points => {
                    let seen = found.point_view(factor, &cameras, &frames, &points, summary);
                    keep(seen, &mut found.point_views, &mut summary.point_factors);
                }
                registry::LINE_REPROJECTION if with_lines => {
                    let seen = found.line_view(factor, &cameras, &frames, &lines, summary);
                    keep(seen, &mut found.line_views, &mut summary.line_factors);
                }
                registry::RELATIVE_POSE if options.method == Method::PoseGraph => {
                    let seen = relative_view(factor, &frames);
                    keep(seen, &mut found.relatives, &mut summary.relative_factors);
                }
                registry::POINT_REPROJECTION
                | registry::LINE_REPROJECTION
                | registry::RELATIVE_POSE
                | registry::PARALLELISM => {}
                _ => summary.relative_factors.exclude(Reason::UnknownKind),
            }
        }
        found.drop_rare(options.min_views, summary);
        found.count(summary);
        found.planar = options.method == Method::PoseGraph
            && options.priors.is_empty()
            && found.frames.iter().all(|frame| is_planar(&frame.camera_from_world))
            && found.relatives.iter().all(RelativeView::is_planar);
        let nothing = |expected| Error::Nothing { graph: graph.name.clone(), expected };
        if found.frames.is_empty() {
            return Err(nothing("poses"));
        }
        let is_empty =
            found.point_views.is_empty() && found.line_views.is_empty() && found.relatives.is_empty();
        if is_empty {
            return Err(nothing(match options.method {
                Method::Point => "measurements of points",
                Method::PointLine | Method::Structural => "measurements of points or lines",
                Method::PoseGraph => "relative poses",
            }));
        }
        Ok(found)
    }

    /// Fills the lists of vertices; gives their places by id.
    fn vertices(
        &mut self,
        graph: &FactorGraph,
        options: &Options,
        summary: &mut Summary,
    ) -> (BTreeMap<FrameId, usize>, BTreeMap<PointId, usize>, BTreeMap<LineId, usize>) {
        let (mut frames, mut points, mut lines) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        let mut poses: Vec<_> = graph.poses.iter().collect();
        poses.sort_by_key(|row| row.frame_id);
        for row in poses {
            let Ok(pose) = row.world_from_camera().pose() else {
                summary.poses.exclude(Reason::NotFinite);
                continue;
            };
            if frames.contains_key(&row.frame_id) {
                summary.poses.exclude(Reason::Duplicate);
                continue;
            }
            frames.insert(row.frame_id, self.frames.len());
            let fixed = row.fixed || options.fix.contains(&row.frame_id);
            let camera_from_world = pose.inverse();
            self.frames.push(FrameVertex { frame_id: row.frame_id, camera_from_world, fixed });
        }
        let mut rows: Vec<_> = graph.points.iter().collect();
        rows.sort_by_key(|row| row.point_id);
        for row in rows {
            let position = Point3::new(row.x, row.y, row.z);
            if !position.iter().all(|number| number.is_finite()) {
                summary.points.exclude(Reason::NotFinite);
            } else if let Entry::Vacant(entry) = points.entry(row.point_id) {
                entry.insert(self.points.len());
                self.points.push(PointVertex { point_id: row.point_id, position });
            } else {
                summary.points.exclude(Reason::Duplicate);
            }
        }
        let mut rows: Vec<_> = graph.lines.iter().collect();
        rows.sort_by_key(|row| row.line_id);
        for row in rows {
            let segment = row.segment();
            let Ok(line) = segment.plucker() else {
                let finite = segment.start.iter().chain(segment.end.iter()).all(|number| number.is_finite());
                summary.lines.exclude(if finite { Reason::NoLength } else { Reason::NotFinite });
                continue;
            };
            if let Entry::Vacant(entry) = lines.entry(row.line_id) {
                entry.insert(self.lines.len());
                self.lines.push(LineVertex { line_id: row.line_id, segment, line });
            } else {
                summary.lines.exclude(Reason::Duplicate);
            }
        }
        (frames, points, lines)
    }

    fn point_view(
        &self,
        factor: &GraphFactor,
        cameras: &BTreeMap<FrameId, PinholeCamera>,
        frames: &BTreeMap<FrameId, usize>,
        points: &BTreeMap<PointId, usize>,
        summary: &mut Summary,
    ) -> Result<PointView, Reason> {
        let numbers = &factor.measurement;
        if !(2..=3).contains(&numbers.len()) || !numbers[..2].iter().all(|number| number.is_finite()) {
            return Err(Reason::NotFinite);
        }
        let frame_id = factor.frame_id.ok_or(Reason::UnknownVertex)?;
        let frame = *frames.get(&frame_id).ok_or(Reason::UnknownVertex)?;
        let point_id = factor.point_id.ok_or(Reason::UnknownVertex)?;
        let point = *points.get(&point_id).ok_or(Reason::UnknownVertex)?;
        let camera = *cameras.get(&frame_id).ok_or(Reason::UnknownCamera)?;
        let z = (self.frames[frame].camera_from_world * self.points[point].position).z;
        if z.is_nan() || z <= 1e-6 {
            return Err(Reason::BehindCamera);
        }
        let measured = numbers.get(2).copied();
        let depth = measured.filter(|depth| self.noise.depth_residual(*depth, z).is_some());
        if measured.is_some() && depth.is_none() && self.noise.depth != DepthNoise::Unknown {
            summary.point_factors.exclude(Reason::NoDepth);
        }
        let information =
            information(factor, numbers.len(), if depth.is_some() { 3 } else { 2 })?.map(Box::new);
        Ok(PointView { frame, point, camera, pixel: [numbers[0], numbers[1]], depth, information })
    }

    fn line_view(
        &self,
        factor: &GraphFactor,
        cameras: &BTreeMap<FrameId, PinholeCamera>,
        frames: &BTreeMap<FrameId, usize>,
        lines: &BTreeMap<LineId, usize>,
        summary: &mut Summary,
    ) -> Result<LineView, Reason> {
        let numbers = &factor.measurement;
        let (ends, depths) = match numbers[..] {
            [a, b, c, d] => ([Vector2::new(a, b), Vector2::new(c, d)], [None; 2]),
            [a, b, first, c, d, second] => {
                ([Vector2::new(a, b), Vector2::new(c, d)], [Some(first), Some(second)])
            }
            _ => return Err(Reason::NotFinite),
        };
        if !ends.iter().flat_map(|end| end.iter()).all(|number| number.is_finite()) {
            return Err(Reason::NotFinite);
        }
        if (ends[1] - ends[0]).norm() <= 1e-9 {
            return Err(Reason::NoLength);
        }
        let frame_id = factor.frame_id.ok_or(Reason::UnknownVertex)?;
        let frame = *frames.get(&frame_id).ok_or(Reason::UnknownVertex)?;
        let line_id = factor.line_id.ok_or(Reason::UnknownVertex)?;
        let line = *lines.get(&line_id).ok_or(Reason::UnknownVertex)?;
        let camera = *cameras.get(&frame_id).ok_or(Reason::UnknownCamera)?;
        let pose = &self.frames[frame].camera_from_world;
        let pixels = ends.map(Point2::from);
        if line_residual(&camera, pose, &self.lines[line].line, pixels).is_err() {
            return Err(Reason::NoImage);
        }
        let depths = depths.map(|depth| {
            let known = depth.filter(|depth| self.noise.depth(*depth).is_some());
            if depth.is_some() && known.is_none() && self.noise.depth != DepthNoise::Unknown {
                summary.line_factors.exclude(Reason::NoDepth);
            }
            known
        });
        let information = information(factor, numbers.len(), numbers.len())?;
        Ok(LineView { frame, line, camera, ends, depths, information })
    }

    /// Leaves out landmarks in fewer frames than asked for, and those that nobody sees.
    fn drop_rare(&mut self, min_views: usize, summary: &mut Summary) {
        let least = min_views.max(1);
        let rare = |views: Vec<Vec<usize>>| -> Vec<bool> {
            let is_rare = |mut frames: Vec<usize>| {
                frames.sort_unstable();
                frames.dedup();
                frames.len() < least
            };
            views.into_iter().map(is_rare).collect()
        };
        let mut frames_of = vec![Vec::new(); self.points.len()];
        self.point_views.iter().for_each(|view| frames_of[view.point].push(view.frame));
        let rare_points = rare(frames_of);
        let mut frames_of = vec![Vec::new(); self.lines.len()];
        self.line_views.iter().for_each(|view| frames_of[view.line].push(view.frame));
        let rare_lines = rare(frames_of);
        let before = (self.point_views.len(), self.line_views.len());
        self.point_views.retain(|view| !rare_points[view.point]);
        self.line_views.retain(|view| !rare_lines[view.line]);
        for (tally, count) in [
            (&mut summary.point_factors, before.0 - self.point_views.len()),
            (&mut summary.line_factors, before.1 - self.line_views.len()),
        ] {
            if count > 0 {
                *tally.excluded.entry(Reason::TooFewViews).or_default() += count;
            }
        }
        let places = squeeze(&mut self.points, &rare_points, &mut summary.points);
        self.point_views.iter_mut().for_each(|view| view.point = places[view.point]);
        let places = squeeze(&mut self.lines, &rare_lines, &mut summary.lines);
        self.line_views.iter_mut().for_each(|view| view.line = places[view.line]);
    }

    /// Writes down how much is used.
    pub(super) fn count(&self, summary: &mut Summary) {
        summary.poses.used = self.frames.len();
        summary.points.used = self.points.len();
        summary.lines.used = self.lines.len();
        summary.point_factors.used = self.point_views.len();
        summary.line_factors.used = self.line_views.len();
        summary.relative_factors.used = self.relatives.len();
    }

    /// Where a camera is, metres.
    pub(super) fn centre(&self, frame: usize) -> Vector3<f64> {
        self.frames[frame].camera_from_world.inverse().translation()
    }

    /// The part of the graph to which each frame belongs, by its first frame.
    pub(super) fn components(&self) -> Vec<usize> {
        let (frames, points) = (self.frames.len(), self.points.len());
        let mut parent: Vec<usize> = (0..frames + points + self.lines.len()).collect();
        let mut join = |a: usize, b: usize| {
            let (a, b) = (root(&mut parent, a), root(&mut parent, b));
            parent[a.max(b)] = a.min(b);
        };
        self.point_views.iter().for_each(|view| join(view.frame, frames + view.point));
        self.line_views.iter().for_each(|view| join(view.frame, frames + points + view.line));
        self.relatives.iter().for_each(|view| join(view.frame, view.other));
        (0..frames).map(|frame| root(&mut parent, frame)).collect()
    }
}

/// The first member of a set of joined places; shortens the way there.
pub(super) fn root(parent: &mut [usize], mut at: usize) -> usize {
    while parent[at] != at {
        parent[at] = parent[parent[at]];
        at = parent[at];
    }
    at
}

/// The camera of every frame that has a usable one.
fn cameras(graph: &FactorGraph) -> BTreeMap<FrameId, PinholeCamera> {
    let usable = |frame: (&FrameId, &crate::structure::CameraId)| {
        let camera = graph.cameras.iter().find(|camera| camera.camera_id == *frame.1)?.projection();
        let PinholeCamera { fx, fy, cx, cy, width, height } = camera;
        // The size of the image is not used here.
        let camera = PinholeCamera::new(fx, fy, cx, cy, width.max(1), height.max(1)).ok()?;
        Some((*frame.0, camera))
    };
    graph.camera_of_frame.iter().filter_map(usable).collect()
}

fn keep<T>(found: Result<T, Reason>, list: &mut Vec<T>, tally: &mut Tally) {
    match found {
        Ok(found) => list.push(found),
        Err(reason) => tally.exclude(reason),
    }
}

/// Takes the marked vertices out of a list; gives the new place of each of the others.
fn squeeze<T>(list: &mut Vec<T>, marked: &[bool], tally: &mut Tally) -> Vec<usize> {
    let mut places = vec![usize::MAX; list.len()];
    let mut next = 0;
    for (at, marked) in marked.iter().enumerate() {
        if *marked {
            tally.exclude(Reason::TooFewViews);
        } else {
            places[at] = next;
            next += 1;
        }
    }
    let mut at = 0;
    list.retain(|_| {
        at += 1;
        !marked[at - 1]
    });
    places
}

/// The information matrix of a factor over its first `used` numbers; the others are left open, not held.
pub(super) fn information(
    factor: &GraphFactor,
    size: usize,
    used: usize,
) -> Result<Option<DMatrix<f64>>, Reason> {
    let Some(numbers) = &factor.information else { return Ok(None) };
    if numbers.len() != size * (size + 1) / 2 || !numbers.iter().all(|number| number.is_finite()) {
        return Err(Reason::BadInformation);
    }
    let mut matrix = DMatrix::zeros(size, size);
    let mut next = numbers.iter();
    for row in 0..size {
        for column in row..size {
            let number = next.next().copied().unwrap_or_default();
            matrix[(row, column)] = number;
            matrix[(column, row)] = number;
        }
    }
    // Lines are weighed by their covariance, which has to be there; the others may leave something open.
    let is_line = factor.line_id.is_some();
    let usable = |matrix: &DMatrix<f64>| {
        if is_line { matrix.clone().cholesky().is_some() } else { information_root(matrix).is_some() }
    };
    if used < size {
        // Marginal: what is left when the others are minimised over.
        let rest = matrix.view((used, used), (size - used, size - used)).into_owned();
        let cross = matrix.view((0, used), (used, size - used)).into_owned();
        let inverse = rest.pseudo_inverse(f64::MIN_POSITIVE).map_err(|_| Reason::BadInformation)?;
        matrix = matrix.view((0, 0), (used, used)) - &cross * inverse * cross.transpose();
    }
    if usable(&matrix) { Ok(Some(matrix)) } else { Err(Reason::BadInformation) }
}
