//! `os evaluate`: how far estimates are from the truth.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::ValueEnum;

use super::{Outcome, evaluate_files, evaluate_output, evaluate_shown, inputs, parsed};
use crate::evaluate::{
    Alignment, AlignmentKind, Delta, EvaluateOptions, Evaluated, Reconstruction, Relation, Step,
    summary_table,
};
use crate::format;
use crate::plot;
use crate::stations::{self, EvaluateRequest};
use crate::storage;
use crate::structure::{FrameId, Sequence};

/// Compare estimates with the truth: absolute and relative errors of trajectories as evo defines them, errors of maps.
///
/// Each estimate of each sequence gets a line: the absolute error of translation (APE) after alignment, the relative error of
/// rotation (RPE), each as rmse/median, frames that matched and frames that are missing, and how far the map is off. With
/// --relation all seven statistics are shown. With --files, trajectories in the formats of TUM, KITTI and EuRoC are compared,
/// without alignment if nothing else is asked for, as evo does.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os evaluate box1
  os evaluate out/* --markdown
  os evaluate box1 --estimate point-ba --relation trans --align sim3
  os evaluate box1 --rpe-delta 1 --rpe-unit m --all-pairs --json
  os evaluate box1 --per-frame errors.parquet --save-plot box1.svg
  os evaluate --files groundtruth.txt estimate.txt -a -r angle-deg
  os evaluate --files groundtruth.txt estimate.txt -as --save-results estimate.zip")]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of its own")]
pub(super) struct Args {
    /// Sequences: MCAP files, Parquet folders or collections.
    #[arg(required_unless_present = "files")]
    sequences: Vec<PathBuf>,
    /// Compare trajectory files with the first of them: TUM, KITTI or EuRoC, told apart by their content.
    #[arg(long, num_args = 2.., value_names = ["REFERENCE", "ESTIMATE"], conflicts_with = "sequences")]
    files: Vec<PathBuf>,
    /// Compare only this estimate; may be given several times.
    #[arg(long, value_name = "NAME", conflicts_with = "files")]
    estimate: Vec<String>,
    /// Compare with the `truth`, or with the estimate of this name.
    #[arg(long, value_name = "NAME", default_value = Reconstruction::TRUTH, conflicts_with = "files")]
    reference: String,
    /// What may be moved to lay an estimate on its reference [default: se3; none with --files].
    #[arg(long, value_enum, value_name = "KIND")]
    align: Option<Align>,
    /// As evo has it: --align se3, or with -s --align sim3.
    #[arg(short = 'a', conflicts_with = "align")]
    umeyama: bool,
    /// As evo has it: correct the scale; without -a the scale alone.
    #[arg(short = 's', conflicts_with = "align")]
    scale: bool,
    /// Align over the first N matched poses alone.
    #[arg(long, value_name = "N", alias = "n_to_align", value_parser = parsed::at_least_one)]
    align_first: Option<usize>,
    /// Show all statistics of this relation; may be given several times.
    #[arg(short, long, value_enum, value_name = "RELATION")]
    relation: Vec<RelationName>,
    /// How far the two poses of a pair of a relative error are apart.
    #[arg(short = 'd', long, value_name = "DELTA", default_value_t = 1.0)]
    rpe_delta: f64,
    /// Unit of it: f(rames), m(etres along the path), d(egrees) or r(adians).
    #[arg(short = 'u', long, value_enum, value_name = "UNIT", default_value_t = Unit::Frames)]
    rpe_unit: Unit,
    /// Take relative errors over all pairs, not over those that follow each other.
    #[arg(long, alias = "all_pairs")]
    all_pairs: bool,
    /// Measure the distance of a pair along the reference, not along the estimate.
    #[arg(long, alias = "pairs_from_reference")]
    pairs_from_reference: bool,
    /// Largest difference of the stamps of poses that belong together, seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.01, requires = "files", alias = "t_max_diff", value_parser = parsed::not_negative)]
    max_difference: f64,
    /// Seconds to add to the estimates' stamps.
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.0,
        requires = "files",
        allow_negative_numbers = true,
        alias = "t_offset"
    )]
    offset: f64,
    /// Print a JSON object for each estimate, on one line.
    #[arg(long, conflicts_with_all = ["csv", "markdown"])]
    json: bool,
    /// Print comma-separated values, a line for each estimate.
    #[arg(long, conflicts_with = "markdown")]
    csv: bool,
    /// Print a Markdown table.
    #[arg(long)]
    markdown: bool,
    #[command(flatten)]
    pub(super) output: evaluate_output::OutputArgs,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Align {
    /// Nothing.
    None,
    /// The first poses are laid upon each other.
    Origin,
    /// Rotation and translation (Umeyama).
    Se3,
    /// Rotation, translation and scale (Umeyama).
    Sim3,
    /// Scale alone.
    Scale,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RelationName {
    /// Translation, m.
    #[value(alias = "trans_part", alias = "translation")]
    Trans,
    /// Frobenius norm of the rotation's difference to the identity.
    #[value(alias = "rot_part", alias = "rotation")]
    Rot,
    /// Frobenius norm of the whole transform's difference to the identity.
    Full,
    /// Angle of the rotation, degrees.
    #[value(alias = "angle_deg")]
    AngleDeg,
    /// Angle of the rotation, radians.
    #[value(alias = "angle_rad")]
    AngleRad,
    /// Distance between points, m.
    #[value(alias = "point_distance")]
    PointDistance,
    /// Relative errors alone: that over the distance that the reference moved, %.
    #[value(alias = "point_distance_error_ratio")]
    PointDistanceRatio,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Unit {
    #[value(name = "f", alias = "frames")]
    Frames,
    #[value(name = "m", alias = "metres", alias = "meters")]
    Metres,
    #[value(name = "d", alias = "degrees")]
    Degrees,
    #[value(name = "r", alias = "radians")]
    Radians,
}

/// What was compared: estimates of one sequence, or of one reference file.
pub(super) struct Compared {
    /// Results in the order of the estimates.
    pub(super) rows: Vec<Evaluated>,
    /// Stamps of the reference, nanoseconds.
    pub(super) stamps: BTreeMap<FrameId, i64>,
    /// What points up in `world`.
    pub(super) upward: nalgebra::Vector3<f64>,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let options = args.options()?;
    args.output.refuse_inputs(&args.sequences)?;
    args.output.refuse_inputs(&args.files)?;
    let (compared, left_out) = if args.files.is_empty() {
        sequences(args, &options)?
    } else {
        (vec![evaluate_files::compare(&args.files, args.stamps()?, &options)?], Outcome::Done)
    };
    let relations = args.relations();
    args.output.write(&compared, relations.first().copied())?;
    let rows: Vec<Evaluated> = compared.into_iter().flat_map(|compared| compared.rows).collect();
    if args.json {
        let default = [Relation::Translation, Relation::AngleRad];
        let table = summary_table(&rows, if relations.is_empty() { &default } else { &relations });
        for row in table.to_json().as_array().into_iter().flatten() {
            writeln!(stdout, "{row}")?;
        }
    } else if args.csv {
        let default = [Relation::Translation, Relation::AngleRad];
        let table = summary_table(&rows, if relations.is_empty() { &default } else { &relations });
        write!(stdout, "{}", table.to_csv())?;
    } else if relations.is_empty() && args.files.is_empty() {
        evaluate_shown::overview(&rows, &options, args.markdown, stdout)?;
    } else {
        let relations = if relations.is_empty() { vec![Relation::Translation] } else { relations };
        evaluate_shown::statistics(&rows, &relations, args.markdown, stdout)?;
    }
    stdout.flush()?;
    let outcome = complaints(&rows)?;
    Ok(if left_out == Outcome::Done { outcome } else { left_out })
}

/// Compares the estimates of each sequence. Those of a collection that lack what is asked for are left out, and told; all of them
/// fail where none has it.
fn sequences(args: &Args, options: &EvaluateOptions) -> anyhow::Result<(Vec<Compared>, Outcome)> {
    let paths = inputs::sequences(&args.sequences)?;
    let may_lack = paths.len() > args.sequences.len();
    let (mut compared, mut lacking) = (Vec::new(), Vec::new());
    for path in &paths {
        match sequence(args, path, options) {
            Ok(found) => compared.push(found),
            Err(error) if may_lack && lacks_estimate(&error) => lacking.push(error),
            Err(error) => return Err(error),
        }
    }
    let mut outcome = Outcome::Done;
    for error in lacking {
        if compared.is_empty() {
            return Err(error);
        }
        writeln!(io::stderr(), "warning: {error:#}; left out")?;
        outcome = Outcome::Findings;
    }
    Ok((compared, outcome))
}

fn lacks_estimate(error: &anyhow::Error) -> bool {
    let causes = error.chain().filter_map(|cause| cause.downcast_ref::<stations::Error>());
    causes.into_iter().any(|cause| matches!(cause, stations::Error::Unknown { .. }))
}

/// Says what could not be compared; fails when that is everything.
fn complaints(rows: &[Evaluated]) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome::Done;
    let mut stderr = io::stderr();
    let mut failed = 0;
    for row in rows {
        let found = &row.evaluation;
        // A map without a path has no errors of a path.
        let map_alone = found.matched + found.extra == 0 && (found.points.is_some() || found.lines.is_some());
        if map_alone {
            continue;
        }
        let Some(error) = found.absolute.as_ref().err().or(found.relative.as_ref().err()) else { continue };
        if found.absolute.is_err() && found.relative.is_err() {
            failed += 1;
        }
        writeln!(stderr, "warning: {}, {}: {error}", row.sequence, found.name)?;
        outcome = Outcome::Findings;
    }
    if failed > 0 && failed == rows.len() {
        anyhow::bail!("none of {failed} estimates could be compared with {}", rows[0].reference);
    }
    Ok(outcome)
}

/// Compares the estimates of a sequence.
fn sequence(args: &Args, path: &Path, options: &EvaluateOptions) -> anyhow::Result<Compared> {
    let reader = format::open(path)?;
    let mut read = Sequence {
        frames: reader.frame_list()?.to_vec(),
        trajectories: reader.table()?,
        map_points: reader.table()?,
        map_lines: reader.table()?,
        ..Sequence::default()
    };
    if args.reference == Reconstruction::TRUTH {
        (read.point_landmarks, read.line_landmarks) = (reader.table()?, reader.table()?);
    }
    let request = EvaluateRequest {
        estimates: args.estimate.clone(),
        reference: args.reference.clone(),
        options: *options,
    };
    let rows =
        stations::evaluate(&name_of(path), &read, &request).with_context(|| path.display().to_string())?;
    let frames = &read.frames;
    let upward = plot::upward(&reader.manifest().cameras, frames);
    Ok(Compared {
        rows,
        stamps: frames.iter().map(|frame| (frame.frame_id, frame.stamp_nanos)).collect(),
        upward,
    })
}

/// The name of a file or folder without its ending, which tells apart what was made of one sequence.
pub(super) fn name_of(path: &Path) -> String {
    if storage::is_folder(path) {
        return inputs::called(path).unwrap_or_else(|| path.display().to_string());
    }
    let name = storage::without_query(path).file_stem();
    name.map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

impl Args {
    fn options(&self) -> anyhow::Result<EvaluateOptions> {
        let kind = match self.align {
            Some(Align::Origin) => AlignmentKind::Origin,
            Some(Align::Se3) => AlignmentKind::Se3,
            Some(Align::Sim3) => AlignmentKind::Sim3,
            Some(Align::Scale) => AlignmentKind::Scale,
            None if self.umeyama && self.scale => AlignmentKind::Sim3,
            None if self.scale => AlignmentKind::Scale,
            None if self.umeyama || self.files.is_empty() => AlignmentKind::Se3,
            Some(Align::None) | None => AlignmentKind::None,
        };
        let delta = match self.rpe_unit {
            Unit::Frames => Delta::Frames(frames(self.rpe_delta)?),
            Unit::Metres => Delta::Metres(self.rpe_delta),
            Unit::Degrees => Delta::Degrees(self.rpe_delta),
            Unit::Radians => Delta::Radians(self.rpe_delta),
        };
        let step =
            Step { all_pairs: self.all_pairs, of_reference: self.pairs_from_reference, ..Step::new(delta) };
        Ok(EvaluateOptions { alignment: Alignment { kind, first: self.align_first }, step })
    }

    fn stamps(&self) -> anyhow::Result<evaluate_files::Stamps> {
        Ok(evaluate_files::Stamps {
            most_apart_nanos: nanoseconds(self.max_difference)?,
            offset_nanos: nanoseconds(self.offset)?,
        })
    }

    fn relations(&self) -> Vec<Relation> {
        let relation = |name: &RelationName| match name {
            RelationName::Trans => Relation::Translation,
            RelationName::Rot => Relation::RotationPart,
            RelationName::Full => Relation::Full,
            RelationName::AngleDeg => Relation::AngleDeg,
            RelationName::AngleRad => Relation::AngleRad,
            RelationName::PointDistance => Relation::PointDistance,
            RelationName::PointDistanceRatio => Relation::PointDistanceRatio,
        };
        let mut relations: Vec<Relation> = Vec::new();
        for relation in self.relation.iter().map(relation) {
            if !relations.contains(&relation) {
                relations.push(relation);
            }
        }
        relations
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded before")]
fn frames(delta: f64) -> anyhow::Result<usize> {
    if (1.0..=1e15).contains(&delta) && delta.fract() == 0.0 {
        Ok(delta as usize)
    } else {
        anyhow::bail!("--rpe-delta: expected a whole number of frames from 1 on, found {delta}")
    }
}

#[expect(clippy::cast_possible_truncation, reason = "bounded before")]
fn nanoseconds(seconds: f64) -> anyhow::Result<i64> {
    // Written so that NaN is refused.
    if seconds.abs() <= 9e9 {
        Ok((seconds * 1e9).round() as i64)
    } else {
        anyhow::bail!("expected a number of seconds up to 9e9, found {seconds}")
    }
}
