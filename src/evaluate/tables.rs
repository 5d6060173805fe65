//! Errors as tables of results: a row for each estimate, or for each frame.

use std::collections::BTreeMap;

use super::{Absolute, Errors, Evaluation, Relation, Relative, Statistics};
use crate::structure::{FrameId, ResultTable};

/// An evaluation with the names that tell it apart from others.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluated {
    /// Name of the sequence's file or folder, or of the reference's file.
    pub sequence: String,
    /// Name of the reference.
    pub reference: String,
    /// What was found.
    pub evaluation: Evaluation,
    /// The alignment in words.
    pub alignment: String,
    /// The distance between the poses of a pair in words.
    pub step: String,
}

/// A key for the names of columns, and its unit as a suffix.
const fn key(relation: Relation) -> (&'static str, &'static str) {
    match relation {
        Relation::Translation => ("translation", "m"),
        Relation::RotationPart => ("rotation_part", ""),
        Relation::Full => ("full", ""),
        Relation::AngleRad => ("rotation", "rad"),
        Relation::AngleDeg => ("rotation", "deg"),
        Relation::PointDistance => ("point_distance", "m"),
        Relation::PointDistanceRatio => ("point_distance_ratio", "percent"),
    }
}

/// `name`, and `_unit` where there is one.
fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}_{unit}") }
}

fn whole(number: usize) -> Option<i64> {
    i64::try_from(number).ok()
}

/// A row for each estimate: how many poses matched, the seven statistics of absolute and relative errors of each relation, the
/// errors of the map.
///
/// Columns are named `ape_translation_rmse_m`, `rpe_rotation_median_rad` and so on. What could not be found out is absent, with
/// the reason in `why_not`.
#[must_use]
pub fn summary_table(rows: &[Evaluated], relations: &[Relation]) -> ResultTable {
    let count = |count: fn(&Evaluation) -> usize| rows.iter().map(move |row| whole(count(&row.evaluation)));
    let mut table = ResultTable::new("evaluation")
        .text(
            "sequence",
            "name of the sequence's file or folder, or of the reference's file",
            rows.iter().map(|row| Some(&row.sequence)),
        )
        .text("estimate", "name of the estimate", rows.iter().map(|row| Some(&row.evaluation.name)))
        .text("reference", "what it is compared with", rows.iter().map(|row| Some(&row.reference)))
        .text("alignment", "what was moved before", rows.iter().map(|row| Some(&row.alignment)))
        .text("rpe_delta", "how far the poses of a pair are apart", rows.iter().map(|row| Some(&row.step)))
        .integer("poses_matched", "1", "poses that are in both", count(|found| found.matched))
        .integer("poses_missing", "1", "poses that only the reference has", count(|found| found.missing))
        .integer("poses_extra", "1", "poses that only the estimate has", count(|found| found.extra))
        .number(
            "alignment_scale",
            "1",
            "factor by which the alignment stretched the estimate",
            rows.iter().map(|row| {
                row.evaluation.absolute.as_ref().ok().map(|found| found.reference_from_estimate.scale)
            }),
        );
    for relation in relations {
        let of = |row: &Evaluated| statistics(row.evaluation.absolute.as_ref().ok()?.errors(*relation));
        table = seven(table, "ape", "absolute", *relation, rows.iter().map(of).collect());
    }
    table = table.integer(
        "rpe_pairs",
        "1",
        "pairs of poses",
        rows.iter().map(|row| whole(row.evaluation.relative.as_ref().ok()?.pairs.len())),
    );
    for relation in relations {
        let of = |row: &Evaluated| statistics(row.evaluation.relative.as_ref().ok()?.errors(*relation));
        table = seven(table, "rpe", "relative", *relation, rows.iter().map(of).collect());
    }
    map(table, rows).text(
        "why_not",
        "why there are no absolute or relative errors",
        rows.iter().map(|row| {
            let absolute = row.evaluation.absolute.as_ref().err();
            absolute.or(row.evaluation.relative.as_ref().err()).map(ToString::to_string)
        }),
    )
}

fn statistics<E>(errors: Result<Errors, E>) -> Option<Statistics> {
    errors.ok().map(|errors| errors.statistics())
}

/// Seven columns, one for each statistic.
fn seven(
    mut table: ResultTable,
    prefix: &str,
    words: &str,
    relation: Relation,
    found: Vec<Option<Statistics>>,
) -> ResultTable {
    let names = ["max", "mean", "median", "min", "rmse", "sse", "std"];
    for (place, name) in names.into_iter().enumerate() {
        let (key, suffix) = key(relation);
        let squared = name == "sse" && !suffix.is_empty();
        let (suffix, unit) = if squared {
            (format!("{suffix}2"), format!("{}²", relation.unit()))
        } else {
            (suffix.to_owned(), relation.unit().to_owned())
        };
        let values = found.iter().map(|found| found.map(|found| found.named()[place].1));
        let column = with_unit(&format!("{prefix}_{key}_{name}"), &suffix);
        let meaning = format!("{name} of the {words} errors, {}", relation.name());
        table = table.number(&column, &unit, &meaning, values);
    }
    table
}

/// The columns of the map; none where no row has one.
fn map(mut table: ResultTable, rows: &[Evaluated]) -> ResultTable {
    let points = || rows.iter().map(|row| row.evaluation.points.as_ref());
    let lines = || rows.iter().map(|row| row.evaluation.lines.as_ref());
    let pick = |found: Option<Statistics>, pick: fn(Statistics) -> f64| found.map(pick);
    let of = |values: &[f64]| Statistics::of(values);
    if points().flatten().next().is_some() {
        let distance = |which| points().map(move |found| pick(of(&found?.distance_m), which));
        table = table
            .integer(
                "points_matched",
                "1",
                "points that are in both maps",
                points().map(|p| whole(p?.ids.len())),
            )
            .integer(
                "points_missing",
                "1",
                "points that only the reference has",
                points().map(|p| whole(p?.missing)),
            )
            .integer(
                "points_extra",
                "1",
                "points that only the estimate has",
                points().map(|p| whole(p?.extra)),
            )
            .number(
                "point_distance_rmse_m",
                "m",
                "rmse of how far points are off",
                distance(|found| found.rmse),
            )
            .number(
                "point_distance_mean_m",
                "m",
                "mean of how far points are off",
                distance(|found| found.mean),
            )
            .number(
                "point_distance_median_m",
                "m",
                "median of how far points are off",
                distance(|found| found.median),
            )
            .number("point_distance_max_m", "m", "most that a point is off", distance(|found| found.max));
    }
    if lines().flatten().next().is_some() {
        let angle = |which| lines().map(move |found| pick(of(&found?.angle_rad), which));
        let distance = |which| lines().map(move |found| pick(of(&found?.distance_m), which));
        table = table
            .integer(
                "lines_matched",
                "1",
                "lines that are in both maps",
                lines().map(|l| whole(l?.ids.len())),
            )
            .integer(
                "lines_missing",
                "1",
                "lines that only the reference has",
                lines().map(|l| whole(l?.missing)),
            )
            .integer("lines_extra", "1", "lines that only the estimate has", lines().map(|l| whole(l?.extra)))
            .integer(
                "lines_without_direction",
                "1",
                "lines in both maps whose ends are one point in one",
                lines().map(|l| whole(l?.without_direction)),
            )
            .number(
                "line_angle_rmse_rad",
                "rad",
                "rmse of the angles between directions",
                angle(|found| found.rmse),
            )
            .number("line_angle_median_rad", "rad", "median of these angles", angle(|found| found.median))
            .number("line_angle_max_rad", "rad", "largest of these angles", angle(|found| found.max))
            .number(
                "line_distance_rmse_m",
                "m",
                "rmse of how far the estimated line passes from the middle of the reference's segment",
                distance(|found| found.rmse),
            )
            .number(
                "line_distance_median_m",
                "m",
                "median of these distances",
                distance(|found| found.median),
            )
            .number("line_distance_max_m", "m", "largest of these distances", distance(|found| found.max))
            .number(
                "line_coverage_mean",
                "1",
                "mean part of the reference's segment that the estimate's covers",
                lines().map(|found| pick(of(&found?.coverage), |found| found.mean)),
            )
            .number(
                "line_overlap_mean",
                "1",
                "mean of what both segments have in common over what they take together",
                lines().map(|found| pick(of(&found?.overlap), |found| found.mean)),
            );
    }
    table
}

/// A row for each pose that is in both: its stamp, its place along the reference's path, its errors of every relation.
///
/// A relative error stands with the pose at which the pair ends; where several pairs end, it is their mean, and `rpe_pairs`
/// says how many.
///
/// * `stamps` — of each frame of each sequence, nanoseconds; a frame without one has none in the table.
#[must_use]
pub fn per_frame_table(rows: &[(&Evaluated, &BTreeMap<FrameId, i64>)]) -> ResultTable {
    let frames: Vec<OfFrame<'_>> = rows.iter().flat_map(|(row, stamps)| of_frames(row, stamps)).collect();
    let mut table = ResultTable::new("frame_errors")
        .text(
            "sequence",
            "name of the sequence's file or folder, or of the reference's file",
            frames.iter().map(|f| Some(&f.row.sequence)),
        )
        .text("estimate", "name of the estimate", frames.iter().map(|f| Some(&f.row.evaluation.name)))
        .integer(
            "frame_id",
            "1",
            "frame of the sequence, or place in the reference's file",
            frames.iter().map(|f| Some(f.id.0)),
        )
        .integer("stamp_nanos", "ns", "stamp of the reference", frames.iter().map(|f| f.stamp))
        .number("path_m", "m", "distance along the reference's path", frames.iter().map(|f| Some(f.path_m)));
    let number = |table: ResultTable, prefix: &str, words: &str, relation: Relation, place: usize| {
        let (key, suffix) = key(relation);
        let column = with_unit(&format!("{prefix}_{key}"), suffix);
        let meaning = format!("{words} error, {}", relation.name());
        let values =
            frames.iter().map(|f| if prefix == "ape" { f.absolute[place] } else { f.relative[place] });
        table.number(&column, relation.unit(), &meaning, values)
    };
    for (place, relation) in ABSOLUTE.into_iter().enumerate() {
        table = number(table, "ape", "absolute", relation, place);
    }
    table = table.integer(
        "rpe_pairs",
        "1",
        "pairs of poses that end here",
        frames.iter().map(|f| whole(f.pairs)),
    );
    for (place, relation) in RELATIVE.into_iter().enumerate() {
        table = number(table, "rpe", "relative", relation, place);
    }
    table
}

/// Relations of the columns of each frame.
const ABSOLUTE: [Relation; 4] =
    [Relation::Translation, Relation::AngleRad, Relation::RotationPart, Relation::Full];
const RELATIVE: [Relation; 5] = [
    Relation::Translation,
    Relation::AngleRad,
    Relation::RotationPart,
    Relation::Full,
    Relation::PointDistance,
];

/// A row of the table of frames.
struct OfFrame<'a> {
    row: &'a Evaluated,
    id: FrameId,
    stamp: Option<i64>,
    path_m: f64,
    absolute: [Option<f64>; ABSOLUTE.len()],
    pairs: usize,
    relative: [Option<f64>; RELATIVE.len()],
}

fn of_frames<'a>(row: &'a Evaluated, stamps: &BTreeMap<FrameId, i64>) -> Vec<OfFrame<'a>> {
    let Ok(absolute) = &row.evaluation.absolute else { return Vec::new() };
    let errors = ABSOLUTE.map(|relation| absolute.errors(relation).ok());
    let (pairs, means) = relative_of_frames(absolute, row.evaluation.relative.as_ref().ok());
    let frame = |place: usize| OfFrame {
        row,
        id: absolute.ids[place],
        stamp: stamps.get(&absolute.ids[place]).copied(),
        path_m: absolute.path_m[place],
        absolute: std::array::from_fn(|relation| Some(errors[relation].as_ref()?.values()[place])),
        pairs: pairs[place],
        relative: std::array::from_fn(|relation| means[relation][place]),
    };
    (0..absolute.ids.len()).map(frame).collect()
}

/// For each pose the pairs that end there, and the means of their errors.
fn relative_of_frames(
    absolute: &Absolute<FrameId>,
    relative: Option<&Relative<FrameId>>,
) -> (Vec<usize>, [Vec<Option<f64>>; RELATIVE.len()]) {
    let mut pairs = vec![0_usize; absolute.ids.len()];
    let ends = relative.map(|relative| relative.ends.as_slice()).unwrap_or_default();
    ends.iter().for_each(|end| pairs[*end] += 1);
    let means = RELATIVE.map(|relation| {
        let mut sums = vec![0.0; absolute.ids.len()];
        if let Some(errors) = relative.and_then(|relative| relative.errors(relation).ok()) {
            ends.iter().zip(errors.values()).for_each(|(end, error)| sums[*end] += error);
        }
        let mean = |(sum, pairs): (f64, &usize)| (*pairs > 0).then(|| sum / *pairs as f64);
        sums.into_iter().zip(&pairs).map(mean).collect()
    });
    (pairs, means)
}

#[cfg(test)]
mod tests {
    use super::super::{Delta, Step};
    use super::super::{EvaluateOptions, Matched, evaluate_matched};
    use super::*;
    use crate::geometry::Pose;
    use crate::structure::ResultValues;

    fn poses(count: i32, error: f64) -> Vec<(FrameId, Pose)> {
        let at = |id: i32| {
            let x = f64::from(id);
            let off = if id == 3 { error } else { 0.0 };
            Pose::from_components([x, (x * 0.7).sin() + off, x * x * 0.1], [0.0, 0.0, 0.1 * x, 1.0]).unwrap()
        };
        (0..count).map(|id| (FrameId(i64::from(id)), at(id))).collect()
    }

    fn evaluated(count: i32, options: EvaluateOptions) -> Evaluated {
        let matched = Matched::by_id(&poses(10, 0.0), &poses(count, 0.3));
        Evaluated {
            sequence: "s".to_owned(),
            reference: "truth".to_owned(),
            evaluation: evaluate_matched("e", matched, &options),
            alignment: options.alignment.to_string(),
            step: options.step.delta.to_string(),
        }
    }

    fn numbers(table: &ResultTable, name: &str) -> Vec<Option<f64>> {
        let column = table.columns.iter().find(|column| column.name == name);
        match &column.unwrap_or_else(|| panic!("{name}")).values {
            ResultValues::Number(values) => values.clone(),
            ResultValues::Integer(values) => {
                values.iter().map(|value| value.map(|value| value as f64)).collect()
            }
            ResultValues::Text(_) => panic!("{name} is words"),
        }
    }

    #[test]
    fn a_row_of_the_summary_has_what_the_errors_say() {
        let rows = [evaluated(8, EvaluateOptions::default()), evaluated(1, EvaluateOptions::default())];
        let table = summary_table(&rows, &Relation::ALL);
        let expected = rows[0].evaluation.absolute.as_ref().unwrap().translation.rmse();
        assert_eq!(numbers(&table, "ape_translation_rmse_m"), [Some(expected), None]);
        assert_eq!(numbers(&table, "poses_missing"), [Some(2.0), Some(9.0)]);
        assert_eq!(numbers(&table, "rpe_pairs"), [Some(7.0), None]);
        let csv = table.to_csv();
        assert!(csv.contains("ape_rotation_sse_rad2") && csv.contains("alignment needs positions"), "{csv}");
        let mut names: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }

    #[test]
    fn errors_of_frames_give_the_statistics_again() {
        let step = Step::new(Delta::Frames(2)).with_all_pairs();
        let row = evaluated(9, EvaluateOptions { step, ..EvaluateOptions::default() });
        let stamps: BTreeMap<FrameId, i64> = (0..5).map(|id| (FrameId(id), id * 100)).collect();
        let table = per_frame_table(&[(&row, &stamps)]);
        let errors: Vec<f64> = numbers(&table, "ape_full").into_iter().flatten().collect();
        let expected = row.evaluation.absolute.as_ref().unwrap().errors(Relation::Full).unwrap();
        assert_eq!(Statistics::of(&errors), Some(expected.statistics()));
        let relative = numbers(&table, "rpe_translation_m");
        assert_eq!(relative.iter().flatten().count(), 7);
        assert!(relative[..2].iter().all(Option::is_none));
        assert_eq!(numbers(&table, "stamp_nanos")[4..6], [Some(400.0), None]);
        assert_eq!(numbers(&table, "path_m")[0], Some(0.0));
    }
}
