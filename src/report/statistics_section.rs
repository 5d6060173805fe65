//! Features of each frame, length of tracks, and who shares landmarks with whom.

use maud::{Markup, html};

use super::SequenceReport;
use super::charts::{Entry, Figure, Table};
use super::numbers::{NONE, count, maybe, short, thinned};
use crate::plot::{PageBars, PageCurve, Upward, page_bars, page_chart};
use crate::statistics::{FeatureStatistics, SequenceStatistics};
use crate::structure::FrameStatistics;

/// Most rows of the table of frames.
const MOST_ROWS: usize = 60;

/// A column of the statistics of frames: class, name, number.
type Column = (&'static str, &'static str, fn(&FrameStatistics) -> Option<f64>);

pub(super) fn section(report: &SequenceReport) -> Markup {
    let frames = &report.analysed.frames;
    let found = &report.analysed.sequence;
    if frames.is_empty() {
        return html! { p.nothing { "The sequence has no frame." } };
    }
    let of_cells = found.image_cells.map(|cells| format!(" of {}", count(cells))).unwrap_or_default();
    html! {
        div.charts {
            (chart(frames, "Features in each frame", "Points and line segments that a frame shows.", &[
                ("points", "points", |frame| Some(frame.point_count as f64)),
                ("lines", "lines", |frame| Some(frame.line_count as f64)),
            ]))
            (chart(frames, "Occupied cells in each frame", &format!("Cells of 10 × 10 px{of_cells}."), &[
                ("points", "with a point or an end of a segment", |frame| Some(frame.occupied_cells as f64)),
                ("lines", "with any part of one", |frame| frame.covered_cells.map(|cells| cells as f64)),
            ]))
            (chart(frames, "Shared with the frame before", "Landmarks that a frame and the one before it both show.", &[
                ("points", "points", |frame| frame.points_shared_with_previous.map(|number| number as f64)),
                ("lines", "lines", |frame| frame.lines_shared_with_previous.map(|number| number as f64)),
            ]))
            @if found.motion.is_some() {
                (chart(frames, "Rotation since the frame before", "By the true poses, degrees.", &[
                    ("truth", "rotation", |frame| frame.rotation_since_previous.map(f64::to_degrees)),
                ]))
            } @else {
                (chart(frames, "Structural constraints in each frame", "Sum over groups of (lines in the frame − 1).", &[
                    ("lines", "constraints", |frame| Some(frame.structural_constraints as f64)),
                ]))
            }
        }
        (frame_table(frames).details("Frames as a table"))
    }
}

fn chart(frames: &[FrameStatistics], title: &str, note: &str, columns: &[Column]) -> Markup {
    let numbers: Vec<Vec<[f64; 2]>> = columns
        .iter()
        .map(|(_, _, number)| {
            frames.iter().map(|frame| [frame.frame_id.0 as f64, number(frame).unwrap_or(f64::NAN)]).collect()
        })
        .collect();
    let curves: Vec<PageCurve<'_>> =
        columns.iter().zip(&numbers).map(|((class, _, _), places)| PageCurve { class, places }).collect();
    let legend: Vec<Entry<'_>> = columns.iter().map(|(class, name, _)| Entry { class, name }).collect();
    let svg = page_chart(title, "frame", Upward::FromZero, &curves);
    Figure { title, note, cursor: Some("frame"), svg, legend: &legend, table: None }.markup()
}

fn frame_table(frames: &[FrameStatistics]) -> Table {
    let places = thinned(frames.len(), MOST_ROWS);
    let whole = |number: Option<i64>| number.map_or_else(|| NONE.to_owned(), |number| number.to_string());
    let row = |place: usize| {
        let frame = &frames[place];
        vec![
            frame.frame_id.0.to_string(),
            frame.point_count.to_string(),
            frame.line_count.to_string(),
            frame.occupied_cells.to_string(),
            whole(frame.covered_cells),
            frame.structural_constraints.to_string(),
            whole(frame.points_shared_with_previous),
            whole(frame.lines_shared_with_previous),
            maybe(frame.rotation_since_previous.map(f64::to_degrees)),
            maybe(frame.translation_since_previous),
        ]
    };
    let header = [
        "frame",
        "points",
        "lines",
        "occupied cells",
        "covered cells",
        "constraints",
        "shared points",
        "shared lines",
        "rotation, °",
        "step, m",
    ];
    let left_out = (places.len() < frames.len()).then(|| {
        format!("{} of {} frames; os stats --frames --csv has all.", places.len(), count(frames.len() as u64))
    });
    Table {
        header: header.map(str::to_owned).to_vec(),
        rows: places.into_iter().map(row).collect(),
        note: left_out,
    }
}

/// Length of tracks and covisibility over the whole sequence.
pub(super) fn tracks(report: &SequenceReport) -> Markup {
    let found = &report.analysed.sequence;
    if found.points.rows + found.lines.rows == 0 {
        return html! { p.nothing { "No frame shows a landmark." } };
    }
    html! {
        div.charts {
            (track_lengths(found))
            (shared(found))
        }
        (distributions(found).markup())
    }
}

fn two<'a>() -> [Entry<'a>; 2] {
    [Entry { class: "points", name: "points" }, Entry { class: "lines", name: "lines" }]
}

fn track_lengths(found: &SequenceStatistics) -> Markup {
    let kinds = [&found.points, &found.lines];
    let bins = kinds.iter().map(|kind| kind.tracks.len()).max().unwrap_or(0);
    let bounds = |place: usize| kinds.iter().find_map(|kind| kind.tracks.get(place));
    let categories: Vec<String> = (0..bins)
        .filter_map(bounds)
        .map(|bin| match (bin.at_least, bin.at_most) {
            (1, 1) => "1".to_owned(),
            (least, most) => format!("{least}–{most}"),
        })
        .collect();
    let landmarks =
        |kind: &FeatureStatistics, place: usize| kind.tracks.get(place).map_or(0, |bin| bin.landmarks);
    let heights =
        kinds.map(|kind| (0..bins).map(|place| landmarks(kind, place) as f64).collect::<Vec<f64>>());
    let bars = [
        PageBars { class: "points", heights: &heights[0] },
        PageBars { class: "lines", heights: &heights[1] },
    ];
    let rows = categories.iter().enumerate().map(|(place, category)| {
        vec![category.clone(), landmarks(kinds[0], place).to_string(), landmarks(kinds[1], place).to_string()]
    });
    let table = Table {
        header: ["frames that show it", "points", "lines"].map(str::to_owned).to_vec(),
        rows: rows.collect(),
        note: None,
    };
    Figure {
        title: "Length of tracks",
        note: "Landmarks by the number of frames that show them.",
        cursor: None,
        svg: page_bars("Length of tracks", "frames that show it", &categories, &bars),
        legend: &two(),
        table: Some(table),
    }
    .markup()
}

fn shared(found: &SequenceStatistics) -> Markup {
    let kinds = [&found.points, &found.lines];
    let longest = if kinds[0].shared.len() >= kinds[1].shared.len() { kinds[0] } else { kinds[1] };
    let categories: Vec<String> = longest.shared.iter().map(|apart| apart.frames_apart.to_string()).collect();
    let heights = kinds.map(|kind| {
        let medians = longest.shared.iter().map(|apart| {
            let same = kind.shared.iter().find(|shared| shared.frames_apart == apart.frames_apart);
            same.map_or(f64::NAN, |shared| shared.shared.median)
        });
        medians.collect::<Vec<f64>>()
    });
    let bars = [
        PageBars { class: "points", heights: &heights[0] },
        PageBars { class: "lines", heights: &heights[1] },
    ];
    let rows = categories
        .iter()
        .enumerate()
        .map(|(place, category)| vec![category.clone(), short(heights[0][place]), short(heights[1][place])]);
    let table = Table {
        header: ["frames apart", "points, median", "lines, median"].map(str::to_owned).to_vec(),
        rows: rows.collect(),
        note: None,
    };
    Figure {
        title: "Covisibility",
        note: "Landmarks that two frames share, by how far the frames are apart; medians.",
        cursor: None,
        svg: page_bars("Covisibility", "frames apart", &categories, &bars),
        legend: &two(),
        table: Some(table),
    }
    .markup()
}

/// The distributions that `os stats` prints.
fn distributions(found: &SequenceStatistics) -> Table {
    let degrees = 1.0_f64.to_degrees();
    let motion = found.motion.as_ref();
    let all = [
        ("points in a frame", 1.0, found.points.per_frame),
        ("lines in a frame", 1.0, found.lines.per_frame),
        ("occupied cells", 1.0, found.occupied_cells),
        ("structural constraints", 1.0, found.structural_constraints),
        ("frames that show a point", 1.0, found.points.track_length_frames),
        ("frames that show a line", 1.0, found.lines.track_length_frames),
        ("frames that share 15 points or more with a frame", 1.0, found.covisible_frames),
        ("parallax of a point, °", degrees, found.point_parallax_rad),
        ("rotation of a step, °", degrees, motion.map(|motion| motion.rotation_rad)),
        ("translation of a step, m", 1.0, motion.map(|motion| motion.translation_m)),
    ];
    let rows = all.into_iter().filter_map(|(name, scale, distribution)| {
        let found = distribution?;
        let numbers =
            [found.min, found.lower_quartile, found.median, found.mean, found.upper_quartile, found.max];
        let cells = numbers.map(|number| short(number * scale));
        Some(std::iter::once(name.to_owned()).chain(cells).collect())
    });
    let header = ["quantity", "min", "lower quartile", "median", "mean", "upper quartile", "max"];
    Table { header: header.map(str::to_owned).to_vec(), rows: rows.collect(), note: None }
}
