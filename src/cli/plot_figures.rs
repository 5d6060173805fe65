//! Figures of what is in sequences: scenes, measurements, statistics, convergence.

use std::path::Path;

use anyhow::Context;

use super::plot::{self, Wanted};
use super::plot_options::{Figure, View};
use super::stats;
use crate::format::{self, SequenceReader};
use crate::plot::Scene;
use crate::plot::paper::{
    BarKind, Bars, Chart, Content, Curve, Drawn, MeasurementImage, Panel, PaperFigure, RankedGroups, Role,
    Scale, SceneView,
};
use crate::report::Run;
use crate::statistics::{Analysed, FeatureStatistics, SequenceStatistics};
use crate::structure::{FrameId, FrameStatistics, LineLandmark, PointLandmark, StructuralGroup};

/// Most frames in one figure.
const MOST_FRAMES: usize = 60;
/// Frames that are drawn if none are named.
const FRAMES: usize = 4;
/// Runs of more steps are drawn without a mark at each.
const MARKED_STEPS: usize = 60;

/// The names of sequences in a title.
fn of_inputs(what: &str, wanted: &Wanted<'_>) -> String {
    let names: Vec<String> = wanted.inputs.iter().map(|path| plot::caption(path)).collect();
    format!("{what} of {}", names.join(", "))
}

pub(super) fn scene(wanted: &Wanted<'_>) -> anyhow::Result<PaperFigure> {
    let mut panels = Vec::new();
    for path in wanted.inputs {
        let reader = format::open(path)?;
        let (points, lines) = (reader.table::<PointLandmark>()?, reader.table::<LineLandmark>()?);
        let groups = reader.table::<StructuralGroup>()?;
        let edges = plot::edges(reader.manifest());
        let scene = Scene {
            edges: &edges,
            manifest: reader.manifest(),
            frames: reader.frame_list()?,
            points: &points,
            lines: &lines,
            groups: &groups,
        };
        let view =
            SceneView::new(&scene, wanted.view(View::Oblique)).with_context(|| path.display().to_string())?;
        panels.push(Panel { caption: Some(plot::caption(path)), content: Content::Scene(Box::new(view)) });
    }
    let columns = wanted.columns(panels.len(), 1, 2);
    Ok(PaperFigure { title: of_inputs("Scene and trajectory", wanted), panels, columns })
}

pub(super) fn statistics(wanted: &Wanted<'_>) -> anyhow::Result<PaperFigure> {
    let mut panels = Vec::new();
    for path in wanted.inputs {
        let analysed = stats::analyse(path)?;
        let found = &analysed.sequence;
        if found.points.rows + found.lines.rows == 0 {
            anyhow::bail!("{}: expected frames that show landmarks, found none", path.display());
        }
        let caption = plot::caption(path);
        let content = match wanted.figure {
            Figure::Tracks => track_lengths(found),
            Figure::Covisibility => covisibility(path, found)?,
            Figure::Cells => cells(&analysed),
            Figure::Statistics => {
                panels.push(Panel { caption: Some(caption.clone()), content: features(&analysed) });
                cells(&analysed)
            }
            _ => features(&analysed),
        };
        panels.push(Panel { caption: Some(caption), content });
    }
    let title = match wanted.figure {
        Figure::Tracks => "Length of tracks",
        Figure::Covisibility => "Covisibility",
        Figure::Cells => "Occupied cells in each frame",
        Figure::Statistics => "Features and occupied cells in each frame",
        _ => "Features in each frame",
    };
    if panels.len() == 2 && wanted.inputs.len() == 1 {
        // What their axes say is enough.
        panels.iter_mut().for_each(|panel| panel.caption = None);
    }
    let columns = wanted.columns(panels.len(), 1, 2);
    Ok(PaperFigure { title: of_inputs(title, wanted), panels, columns })
}

/// A curve's name, its role, and its number in a frame.
type Column<'a> = (&'a str, Role, fn(&FrameStatistics) -> Option<f64>);

/// A chart over the frames of a sequence.
fn over_frames(frames: &[FrameStatistics], y_name: &str, columns: [Column<'_>; 2]) -> Content {
    let curve = |(name, role, number): Column<'_>| Curve {
        name: name.to_owned(),
        role,
        places: frames
            .iter()
            .map(|frame| [frame.frame_id.0 as f64, number(frame).unwrap_or(f64::NAN)])
            .collect(),
        drawn: Drawn::Line,
    };
    // A column of which no frame has a number has no name either.
    let there = |curve: &Curve| curve.places.iter().any(|place| place[1].is_finite());
    Content::Chart(Chart {
        x_name: Some("Frame".to_owned()),
        y_name: y_name.to_owned(),
        x: Scale::Whole,
        y: Scale::FromZero,
        same_scale: false,
        aspect: 0.42,
        colour_bar: None,
        curves: columns.into_iter().map(curve).filter(there).collect(),
    })
}

fn features(analysed: &Analysed) -> Content {
    over_frames(
        &analysed.frames,
        "Features in the frame",
        [
            ("points", Role::Points, |frame| Some(frame.point_count as f64)),
            ("lines", Role::Lines, |frame| Some(frame.line_count as f64)),
        ],
    )
}

fn cells(analysed: &Analysed) -> Content {
    over_frames(
        &analysed.frames,
        "Occupied cells (10 × 10 px)",
        [
            ("point or line end", Role::Series(0), |frame| Some(frame.occupied_cells as f64)),
            ("any part of a feature", Role::Series(1), |frame| frame.covered_cells.map(|cells| cells as f64)),
        ],
    )
}

/// Bars of points and lines.
fn two_kinds(x_name: &str, y_name: &str, categories: Vec<String>, heights: [Vec<f64>; 2]) -> Content {
    let kinds = [("points", Role::Points), ("lines", Role::Lines)].into_iter().zip(heights);
    let kinds = kinds.filter(|(_, heights)| heights.iter().any(|height| *height > 0.0));
    Content::Bars(Bars {
        x_name: x_name.to_owned(),
        y_name: y_name.to_owned(),
        categories,
        kinds: kinds
            .map(|((name, role), heights)| BarKind { name: name.to_owned(), role, heights })
            .collect(),
    })
}

fn track_lengths(found: &SequenceStatistics) -> Content {
    let kinds = [&found.points, &found.lines];
    let bins = kinds.iter().map(|kind| kind.tracks.len()).max().unwrap_or(0);
    let landmarks =
        |kind: &FeatureStatistics, bin: usize| kind.tracks.get(bin).map_or(0, |bin| bin.landmarks);
    // From the first bin that a landmark is in.
    let first = (0..bins).find(|bin| kinds.iter().any(|kind| landmarks(kind, *bin) > 0)).unwrap_or(0);
    let category = |bin: usize| {
        kinds.iter().find_map(|kind| kind.tracks.get(bin)).map_or_else(String::new, |bin| {
            if bin.at_least == bin.at_most {
                bin.at_least.to_string()
            } else {
                format!("{}–{}", bin.at_least, bin.at_most)
            }
        })
    };
    let heights = kinds.map(|kind| (first..bins).map(|bin| landmarks(kind, bin) as f64).collect());
    two_kinds("Frames that show the landmark", "Landmarks", (first..bins).map(category).collect(), heights)
}

fn covisibility(path: &Path, found: &SequenceStatistics) -> anyhow::Result<Content> {
    let kinds = [&found.points, &found.lines];
    let mut apart: Vec<u64> =
        kinds.iter().flat_map(|kind| kind.shared.iter().map(|shared| shared.frames_apart)).collect();
    apart.sort_unstable();
    apart.dedup();
    let shared = |kind: &FeatureStatistics, apart: u64| {
        kind.shared
            .iter()
            .find(|shared| shared.frames_apart == apart)
            .map_or(f64::NAN, |shared| shared.shared.median)
    };
    let heights = kinds.map(|kind| apart.iter().map(|apart| shared(kind, *apart)).collect::<Vec<f64>>());
    if !heights.iter().flatten().any(|height| *height > 0.0) {
        anyhow::bail!("{}: expected frames that share landmarks, found none", path.display());
    }
    Ok(two_kinds(
        "Frames apart",
        "Shared landmarks (median)",
        apart.iter().map(u64::to_string).collect(),
        heights,
    ))
}

pub(super) fn convergence(wanted: &Wanted<'_>) -> anyhow::Result<PaperFigure> {
    let mut panels = Vec::new();
    for path in wanted.inputs {
        let runs: Vec<(String, Vec<Run>)> = Run::read(path)?;
        let several = runs.len() > 1;
        let before = panels.len();
        for (name, runs) in runs {
            let chosen = |run: &&Run| wanted.estimates.is_empty() || wanted.estimates.contains(&run.name);
            let curves: Vec<Curve> = runs
                .iter()
                .filter(chosen)
                .enumerate()
                .filter_map(|(place, run)| run_curve(place, run))
                .collect();
            if curves.is_empty() {
                continue;
            }
            let caption = if several { name } else { plot::caption(path) };
            let content = Content::Chart(Chart {
                x_name: Some("Iteration".to_owned()),
                y_name: "Cost".to_owned(),
                x: Scale::Whole,
                y: Scale::Logarithmic,
                same_scale: false,
                aspect: 0.5,
                colour_bar: None,
                curves,
            });
            panels.push(Panel { caption: Some(caption), content });
        }
        if panels.len() == before {
            anyhow::bail!(
                "{}: expected costs over the steps of an optimiser, found none{}",
                path.display(),
                hint(wanted)
            );
        }
    }
    let columns = wanted.columns(panels.len(), 1, 2);
    Ok(PaperFigure { title: of_inputs("Convergence", wanted), panels, columns })
}

fn hint(wanted: &Wanted<'_>) -> String {
    if wanted.estimates.is_empty() {
        "; os adjust leaves them".to_owned()
    } else {
        format!(" of {}", wanted.estimates.join(", "))
    }
}

/// Costs of the steps that were taken; `None` without one over 0.
fn run_curve(place: usize, run: &Run) -> Option<Curve> {
    let places: Vec<[f64; 2]> =
        (0..).map(f64::from).zip(run.accepted()).map(|(step, cost)| [step, cost]).collect();
    let drawn = if places.len() > MARKED_STEPS { Drawn::Line } else { Drawn::Marked };
    let there = places.iter().any(|place| place[1] > 0.0 && place[1].is_finite());
    there.then(|| Curve { name: run.name.clone(), role: Role::Series(place), places, drawn })
}

pub(super) fn measurements(wanted: &Wanted<'_>) -> anyhow::Result<PaperFigure> {
    let mut panels = Vec::new();
    for path in wanted.inputs {
        let reader = format::open(path)?;
        let groups = RankedGroups::of(&reader.table::<StructuralGroup>()?);
        for frame_id in chosen_frames(wanted, path, &reader)? {
            let frame = reader.frame(frame_id)?;
            let frame =
                frame.with_context(|| format!("{}: expected {frame_id}, found none", path.display()))?;
            let camera = reader.manifest().camera(frame.frame.camera_id);
            let camera = camera.with_context(|| {
                format!("{}, {frame_id}: {} is not in the manifest", path.display(), frame.frame.camera_id)
            })?;
            let of_input =
                if wanted.inputs.len() > 1 { format!("{}, ", plot::caption(path)) } else { String::new() };
            let content = Content::Image(MeasurementImage::of(camera, &frame, &groups));
            panels.push(Panel { caption: Some(format!("{of_input}{frame_id}")), content });
        }
    }
    let columns = wanted.columns(panels.len(), 2, 4);
    Ok(PaperFigure { title: of_inputs("Measurements", wanted), panels, columns })
}

/// The frames that were asked for, or some over the sequence.
fn chosen_frames(wanted: &Wanted<'_>, path: &Path, reader: &SequenceReader) -> anyhow::Result<Vec<FrameId>> {
    let shown = path.display();
    let frames: Vec<FrameId> = reader.frame_list()?.iter().map(|frame| frame.frame_id).collect();
    let (Some(first), Some(last)) = (frames.iter().min(), frames.iter().max()) else {
        anyhow::bail!("{shown}: expected a frame, found none");
    };
    let Some(ids) = wanted.frames else {
        let count = FRAMES.min(frames.len());
        return Ok((0..count).map(|place| frames[(2 * place + 1) * frames.len() / (2 * count)]).collect());
    };
    let mut chosen: Vec<FrameId> = Vec::new();
    for range in &ids.0 {
        let before = chosen.len();
        chosen.extend(frames.iter().filter(|id| range.contains(&id.0)));
        if chosen.len() == before {
            let words = if range.end - range.start == 1 {
                range.start.to_string()
            } else {
                format!("{}..{}", range.start, range.end)
            };
            anyhow::bail!("{shown}: expected frame {words}, found frames from {} to {}", first.0, last.0);
        }
    }
    if chosen.len() > MOST_FRAMES {
        anyhow::bail!("{shown}: expected at most {MOST_FRAMES} frames in a figure, found {}", chosen.len());
    }
    Ok(chosen)
}
