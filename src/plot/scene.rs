//! A picture of a scene with the camera's path.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::chart::Area;
use super::error::Error;
use super::scene_shapes::{Fit, Shapes, metres_in_words, ranked, round_length};
use super::svg::Svg;
use super::view::{Plane, ViewFrom, upward};
use super::{COLOURS, FAINT, INK, PAPER, QUIET};
use crate::structure::{Frame, GroupId, LineLandmark, Manifest, PointLandmark, StructuralGroup};

const WIDTH: f64 = 1200.0;
const HEIGHT: f64 = 800.0;
/// Free on each side, and above for the title.
const MARGIN: f64 = 40.0;
const HEAD: f64 = 96.0;
/// Where the scene stands.
const ROOM: Area = Area {
    left: MARGIN,
    top: HEAD + MARGIN,
    width: WIDTH - 2.0 * MARGIN,
    height: HEIGHT - HEAD - 2.0 * MARGIN,
};
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
    let shapes = Shapes::of(scene, &plane);
    let fit = Fit::new(&shapes, ROOM).ok_or_else(|| Error::Nothing { name: manifest.name.clone() })?;
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
    let cameras = shapes.camera_strokes(&fit, [16.0, 46.0]);
    svg.strokes(cameras.iter().map(Vec::as_slice), 1.3, INK, 0.75);
    ends(&mut svg, &path);
    svg.element("</g>");
    words(&mut svg, scene, &colours);
    axes(&mut svg, &shapes);
    scale(&mut svg, &fit);
    Ok(svg.finish())
}

/// Draws the lines; gives the colour of each group, the largest groups first.
fn lines(
    svg: &mut Svg,
    scene: &Scene<'_>,
    shapes: &Shapes,
    fit: &Fit,
) -> Vec<(GroupId, &'static str, usize)> {
    let (largest, rank_of) = ranked(scene.groups);
    let colour = |rank: usize| COLOURS[rank % COLOURS.len()];
    let colours: Vec<(GroupId, &'static str, usize)> = largest
        .iter()
        .enumerate()
        .map(|(rank, group)| (group.group_id, colour(rank), group.line_ids.len()))
        .collect();
    let mut strokes: BTreeMap<&str, Vec<[[f64; 2]; 2]>> = BTreeMap::new();
    for (line, [start, end]) in &shapes.lines {
        let Some(stroke) = fit.place(*start).zip(fit.place(*end)) else { continue };
        strokes.entry(rank_of.get(line).map_or(QUIET, |rank| colour(*rank))).or_default().push(stroke.into());
    }
    for (colour, strokes) in strokes {
        svg.strokes(strokes.iter().map(|stroke| &stroke[..]), 3.0, colour, 0.9);
    }
    colours
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
    let Some(round) = round_length(150.0 / fit.scale) else { return };
    let (right, y) = (WIDTH - MARGIN, HEIGHT - MARGIN);
    let left = right - round * fit.scale;
    svg.strokes(
        std::iter::once(&[[left, y - 6.0], [left, y], [right, y], [right, y - 6.0]][..]),
        2.0,
        INK,
        1.0,
    );
    svg.words([0.5 * (left + right), y - 10.0], 15.0, "middle", INK, &metres_in_words(round));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{FrameId, PointId, PoseRow};
    use nalgebra::Vector3;
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
            Fit::new(&Shapes::of(&scene, &plane), ROOM).unwrap()
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
