//! A picture of a scene with the camera's path.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::error::Error;
use super::svg::Svg;
use super::view::{Plane, ViewFrom, upward};
use super::{COLOURS, FAINT, INK, PAPER, QUIET};
use crate::structure::{Frame, GroupId, LineId, LineLandmark, Manifest, PointLandmark, StructuralGroup};

const WIDTH: f64 = 1200.0;
const HEIGHT: f64 = 800.0;
/// Free on each side, and above for the title.
const MARGIN: f64 = 40.0;
const HEAD: f64 = 96.0;
/// Most points, lines and places of the path that are drawn: what is drawn keeps its shape, the file stays small.
const MOST_POINTS: usize = 20_000;
const MOST_LINES: usize = 10_000;
const MOST_PLACES: usize = 4000;
/// Cameras that are drawn along the path.
const CAMERAS: usize = 14;
/// Farther outside than this a shape is left out, units of the picture.
const FARTHEST: f64 = 1e4;

/// What is drawn of a sequence.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Name and cameras.
    pub manifest: &'a Manifest,
    /// Frames; those with true poses are drawn.
    pub frames: &'a [Frame],
    /// Points.
    pub points: &'a [PointLandmark],
    /// Lines.
    pub lines: &'a [LineLandmark],
    /// Groups, which give lines their colours.
    pub groups: &'a [StructuralGroup],
    /// Edges of the objects of a simulated scene, `world`, metres; drawn faintly.
    pub edges: &'a [[Point3<f64>; 2]],
}

/// The shapes of a scene in the plane of the picture, metres.
struct Shapes {
    dots: Vec<[f64; 2]>,
    lines: Vec<(LineId, [[f64; 2]; 2])>,
    edges: Vec<[[f64; 2]; 2]>,
    path: Vec<[f64; 2]>,
    axes: [[f64; 2]; 3],
}

/// A picture of a scene: points, lines in the colours of their groups, the path of the camera with some cameras, the axes of the world
/// and a scale, seen with parallel rays.
///
/// Returns SVG text of at most some hundred kilobytes: of more than 20 000 points, evenly many are left out. The picture is
/// fitted to the middle 99 % of the points, and to all lines and the path, so that a stray point does not shrink it.
///
/// # Errors
/// [`Error::Nothing`] without a landmark or a true pose, [`Error::View`] for angles that are none.
pub fn scene_picture(scene: &Scene<'_>, view: ViewFrom) -> Result<String, Error> {
    let manifest = scene.manifest;
    let plane = Plane::new(view, upward(&manifest.cameras, scene.frames))?;
    let shapes = shapes(scene, &plane);
    let fit = Fit::new(&shapes).ok_or_else(|| Error::Nothing { name: manifest.name.clone() })?;
    let mut svg = Svg::new(WIDTH, HEIGHT, PAPER, &format!("Scene and trajectory of {}", manifest.name));
    svg.element(&format!(
        "<clipPath id=\"c\"><rect y=\"{0}\" width=\"{WIDTH}\" height=\"{1}\"/></clipPath><g clip-path=\"url(#c)\">",
        HEAD,
        HEIGHT - HEAD
    ));
    let edges: Vec<[[f64; 2]; 2]> =
        shapes.edges.iter().filter_map(|[start, end]| Some([fit.place(*start)?, fit.place(*end)?])).collect();
    svg.strokes(edges.iter().map(<[_; 2]>::as_slice), 1.0, FAINT, 1.0);
    // Fewer points may be larger.
    let diameter = (9.0 - 1.4 * libm::log10(shapes.dots.len().max(1) as f64)).clamp(2.5, 6.0);
    svg.dots(shapes.dots.iter().filter_map(|dot| fit.place(*dot)), diameter, QUIET, 0.55);
    let colours = lines(&mut svg, scene, &shapes, &fit);
    let path: Vec<[f64; 2]> = shapes.path.iter().filter_map(|place| fit.place(*place)).collect();
    svg.strokes(std::iter::once(path.as_slice()), 2.0, INK, 0.9);
    cameras(&mut svg, scene, &shapes, &plane, &fit);
    ends(&mut svg, &path);
    svg.element("</g>");
    words(&mut svg, scene, &colours);
    axes(&mut svg, &shapes);
    scale(&mut svg, &fit);
    Ok(svg.finish())
}

/// Every n-th of a list, so that at most `most` are left.
fn thinned<T>(list: &[T], most: usize) -> impl Iterator<Item = &T> {
    list.iter().step_by(list.len().div_ceil(most).max(1))
}

fn shapes(scene: &Scene<'_>, plane: &Plane) -> Shapes {
    let points = thinned(scene.points, MOST_POINTS);
    let lines = thinned(scene.lines, MOST_LINES);
    let poses = thinned(scene.frames, MOST_PLACES).filter_map(Frame::world_from_camera);
    Shapes {
        dots: points.filter_map(|point| plane.place(Vector3::new(point.x, point.y, point.z))).collect(),
        lines: lines
            .filter_map(|line| {
                let start = plane.place(Vector3::new(line.start_x, line.start_y, line.start_z))?;
                let end = plane.place(Vector3::new(line.end_x, line.end_y, line.end_z))?;
                Some((line.line_id, [start, end]))
            })
            .collect(),
        edges: thinned(scene.edges, MOST_LINES)
            .filter_map(|[start, end]| Some([plane.place(start.coords)?, plane.place(end.coords)?]))
            .collect(),
        path: poses.filter_map(|pose| plane.place(Vector3::from(pose.translation))).collect(),
        axes: [0, 1, 2].map(|axis| [plane.right[axis], plane.up[axis]]),
    }
}

/// The way from the plane to the picture.
struct Fit {
    middle: [f64; 2],
    /// Units of the picture for a metre.
    scale: f64,
}

impl Fit {
    /// `None` when there is nothing to fit.
    fn new(shapes: &Shapes) -> Option<Self> {
        let mut bounds = [[0.0; 2]; 2];
        for axis in 0..2 {
            let mut dots: Vec<f64> = shapes.dots.iter().map(|dot| dot[axis]).collect();
            dots.sort_unstable_by(f64::total_cmp);
            let stray = dots.len() / 200;
            let inner = dots.get(stray..dots.len() - stray).unwrap_or_default();
            let ends =
                shapes.lines.iter().flat_map(|(_, ends)| ends).chain(&shapes.path).map(|place| place[axis]);
            let all = || inner.first().into_iter().chain(inner.last()).copied().chain(ends.clone());
            let (low, high) = (all().min_by(f64::total_cmp)?, all().max_by(f64::total_cmp)?);
            bounds[axis] = [low, high];
        }
        let room = [WIDTH - 2.0 * MARGIN, HEIGHT - HEAD - 2.0 * MARGIN];
        let scale =
            (0..2).map(|axis| room[axis] / (bounds[axis][1] - bounds[axis][0])).fold(f64::MAX, f64::min);
        let scale = if scale.is_finite() && scale > 0.0 { scale.min(1e6) } else { 1.0 };
        Some(Self { middle: bounds.map(|[low, high]| 0.5 * low + 0.5 * high), scale })
    }

    /// Where a place of the plane is in the picture; `None` far outside.
    fn place(&self, [right, up]: [f64; 2]) -> Option<[f64; 2]> {
        let x = 0.5 * WIDTH + (right - self.middle[0]) * self.scale;
        let y = HEAD + 0.5 * (HEIGHT - HEAD) - (up - self.middle[1]) * self.scale;
        (x.abs() < FARTHEST && y.abs() < FARTHEST).then_some([x, y])
    }
}

/// Draws the lines; gives the colour of each group, the largest groups first.
fn lines(
    svg: &mut Svg,
    scene: &Scene<'_>,
    shapes: &Shapes,
    fit: &Fit,
) -> Vec<(GroupId, &'static str, usize)> {
    let mut largest: Vec<&StructuralGroup> = scene.groups.iter().collect();
    largest.sort_by_key(|group| (std::cmp::Reverse(group.line_ids.len()), group.group_id));
    let colours: Vec<(GroupId, &'static str, usize)> = largest
        .iter()
        .enumerate()
        .map(|(place, group)| (group.group_id, COLOURS[place % COLOURS.len()], group.line_ids.len()))
        .collect();
    let mut colour_of: BTreeMap<LineId, &str> = BTreeMap::new();
    for (group, (_, colour, _)) in largest.iter().zip(&colours) {
        for line in &group.line_ids {
            colour_of.entry(*line).or_insert(colour);
        }
    }
    let mut strokes: BTreeMap<&str, Vec<[[f64; 2]; 2]>> = BTreeMap::new();
    for (line, [start, end]) in &shapes.lines {
        let Some(stroke) = fit.place(*start).zip(fit.place(*end)) else { continue };
        strokes.entry(colour_of.get(line).copied().unwrap_or(QUIET)).or_default().push(stroke.into());
    }
    for (colour, strokes) in strokes {
        svg.strokes(strokes.iter().map(|stroke| &stroke[..]), 3.0, colour, 0.9);
    }
    colours
}

/// Draws some cameras along the path, as the pyramids of what they see.
fn cameras(svg: &mut Svg, scene: &Scene<'_>, shapes: &Shapes, plane: &Plane, fit: &Fit) {
    let posed: Vec<&Frame> =
        scene.frames.iter().filter(|frame| frame.world_from_camera().is_some()).collect();
    // Smaller where the path is short in the picture, so that its cameras do not hide each other.
    let spread = |axis: usize| {
        let places = || shapes.path.iter().map(|place| place[axis]);
        let (low, high) =
            places().fold((f64::MAX, f64::MIN), |(low, high), place| (low.min(place), high.max(place)));
        (high - low).max(0.0)
    };
    let size = (0.11 * (spread(0) + spread(1)) * fit.scale).clamp(16.0, 46.0);
    let depth = size / fit.scale;
    let mut strokes: Vec<Vec<[f64; 2]>> = Vec::new();
    for frame in thinned(&posed, CAMERAS) {
        let Some(Ok(pose)) = frame.world_from_camera().map(|pose| pose.pose()) else { continue };
        let camera = scene.manifest.camera(frame.camera_id).map(crate::structure::Camera::projection);
        let (half_width, half_height) = camera.map_or((0.6, 0.45), |camera| {
            let half = |size: u32, focal: f64| (0.5 * f64::from(size) / focal.abs()).clamp(0.1, 1.5);
            (half(camera.width, camera.fx), half(camera.height, camera.fy))
        });
        let at = |x: f64, y: f64, z: f64| {
            fit.place(
                plane.place(pose.translation() + pose.transform_vector(&(Vector3::new(x, y, z) * depth)))?,
            )
        };
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| at(x * half_width, y * half_height, 1.0));
        let (Some(apex), [Some(a), Some(b), Some(c), Some(d)]) = (at(0.0, 0.0, 0.0), corners) else {
            continue;
        };
        strokes.push(vec![a, b, c, d, a, apex, b]);
        strokes.push(vec![c, apex, d]);
    }
    svg.strokes(strokes.iter().map(Vec::as_slice), 1.3, INK, 0.75);
}

/// Marks where the path begins (a disc) and where it ends (a ring).
fn ends(svg: &mut Svg, path: &[[f64; 2]]) {
    if let (Some([x, y]), Some([end_x, end_y])) = (path.first(), path.last()) {
        svg.element(&format!("<circle cx=\"{end_x:.1}\" cy=\"{end_y:.1}\" r=\"8\" stroke=\"{INK}\" stroke-width=\"2.5\" fill=\"none\"/>"));
        svg.element(&format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"{INK}\"/>"));
    }
}

fn words(svg: &mut Svg, scene: &Scene<'_>, colours: &[(GroupId, &'static str, usize)]) {
    svg.words([MARGIN, 36.0], 24.0, "start", INK, &scene.manifest.name);
    let posed = scene.frames.iter().filter(|frame| frame.world_from_camera().is_some()).count();
    let counts = format!(
        "{} points · {} lines · {} true poses, from ● to ○",
        scene.points.len(),
        scene.lines.len(),
        posed
    );
    svg.words([MARGIN, 59.0], 16.0, "start", INK, &counts);
    if scene.lines.is_empty() {
        return;
    }
    let shown = colours.iter().take(COLOURS.len());
    let mut entries: Vec<(&str, String)> =
        shown.map(|(group, colour, size)| (*colour, format!("group {}: {size}", group.0))).collect();
    entries.push((QUIET, "in no group".to_owned()));
    if colours.len() > COLOURS.len() {
        entries.push((PAPER, format!("and {} groups more", colours.len() - COLOURS.len())));
    }
    let mut left = MARGIN;
    for (colour, words) in &entries {
        svg.strokes(std::iter::once(&[[left + 2.0, 79.0], [left + 20.0, 79.0]][..]), 4.0, colour, 1.0);
        svg.words([left + 28.0, 84.0], 15.0, "start", INK, words);
        left += 28.0 + 8.0 * words.chars().count() as f64 + 18.0;
    }
}

/// The axes of the world, in the lower left corner.
fn axes(svg: &mut Svg, shapes: &Shapes) {
    const LENGTH: f64 = 44.0;
    let origin = [MARGIN + 40.0, HEIGHT - MARGIN - 24.0];
    let colours = [COLOURS[0], COLOURS[2], COLOURS[1]];
    for ((name, colour), [right, up]) in ["x", "y", "z"].iter().zip(colours).zip(shapes.axes) {
        let tip = [origin[0] + LENGTH * right, origin[1] - LENGTH * up];
        svg.strokes(std::iter::once(&[origin, tip][..]), 2.5, colour, 1.0);
        // An axis that points at the viewer has no length and no name.
        if right * right + up * up > 0.01 {
            let beyond = [origin[0] + (LENGTH + 12.0) * right, origin[1] - (LENGTH + 12.0) * up + 5.0];
            svg.words(beyond, 15.0, "middle", INK, name);
        }
    }
}

/// A bar of a round length, in the lower right corner.
fn scale(svg: &mut Svg, fit: &Fit) {
    let metres = 150.0 / fit.scale;
    let power = libm::pow(10.0, libm::floor(libm::log10(metres)));
    let round = [5.0, 2.0, 1.0].into_iter().find(|part| part * power <= metres).unwrap_or(1.0) * power;
    if !round.is_finite() {
        return;
    }
    let (right, y) = (WIDTH - MARGIN, HEIGHT - MARGIN);
    let left = right - round * fit.scale;
    svg.strokes(
        std::iter::once(&[[left, y - 6.0], [left, y], [right, y], [right, y - 6.0]][..]),
        2.0,
        INK,
        1.0,
    );
    let words = if (1e-3..1e5).contains(&round) { format!("{round} m") } else { format!("{round:e} m") };
    svg.words([0.5 * (left + right), y - 10.0], 15.0, "middle", INK, &words);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{FrameId, PointId, PoseRow};
    use proptest::prelude::*;

    fn point(id: i64, place: [f64; 3]) -> PointLandmark {
        PointLandmark::new(PointId(id), place.into())
    }

    fn frame(id: i64, translation: [f64; 3]) -> Frame {
        let pose = PoseRow { translation, rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
        Frame::new(FrameId(id), 0, crate::structure::CameraId(0), Some(pose))
    }

    fn picture(points: &[PointLandmark], frames: &[Frame]) -> Result<String, Error> {
        let manifest = Manifest { name: "<name>".to_owned(), ..Manifest::default() };
        let scene = Scene { manifest: &manifest, frames, points, lines: &[], groups: &[], edges: &[] };
        scene_picture(&scene, ViewFrom::OBLIQUE)
    }

    #[test]
    fn of_nothing_there_is_no_picture() {
        assert_eq!(picture(&[], &[]), Err(Error::Nothing { name: "<name>".to_owned() }));
        assert!(picture(&[point(0, [f64::NAN, 0.0, 0.0])], &[]).is_err());
        assert!(picture(&[point(0, [1.0, 2.0, 3.0])], &[]).is_ok());
        assert!(picture(&[], &[frame(0, [1.0, 2.0, 3.0])]).is_ok());
    }

    #[test]
    fn many_points_and_frames_make_a_picture_of_bounded_size() {
        let points: Vec<_> =
            (0..100_000_i32).map(|id| point(i64::from(id), [f64::from(id), 0.0, 1.0])).collect();
        let frames: Vec<_> =
            (0..50_000_i32).map(|id| frame(i64::from(id), [0.0, f64::from(id), 1.0])).collect();
        let size = picture(&points, &frames).unwrap().len();
        assert!(size < 500_000, "{size} bytes");
    }

    #[test]
    fn a_stray_point_does_not_shrink_the_scene() {
        let mut points: Vec<_> = (0..1000_i32)
            .map(|id| point(i64::from(id), [f64::from(id % 10), f64::from(id / 100), 0.0]))
            .collect();
        let plane = Plane::new(ViewFrom::TOP, Vector3::z()).unwrap();
        let manifest = Manifest::default();
        let fit = |points: &[PointLandmark]| {
            let scene =
                Scene { manifest: &manifest, frames: &[], points, lines: &[], groups: &[], edges: &[] };
            Fit::new(&shapes(&scene, &plane)).unwrap()
        };
        let before = fit(&points).scale;
        points.push(point(5000, [1e6, 1e6, 0.0]));
        let after = fit(&points);
        assert_eq!(after.scale, before);
        assert_eq!(after.place([1e6, 1e6]), None);
    }

    proptest! {
        #[test]
        fn numbers_of_any_size_make_a_picture_or_an_error(
            places in prop::collection::vec(prop::array::uniform3(any::<f64>()), 1..6),
        ) {
            let points: Vec<_> = places.iter().map(|place| point(0, *place)).collect();
            let frames: Vec<_> = places.iter().map(|place| frame(0, *place)).collect();
            if let Ok(picture) = picture(&points, &frames) {
                prop_assert!(!picture.contains("NaN") && !picture.contains("inf"));
                prop_assert!(picture.contains("&lt;name&gt;") && !picture.contains("<name>"));
            }
        }
    }
}
