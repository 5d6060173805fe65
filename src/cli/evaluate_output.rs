//! The files that `os evaluate` writes: errors of each frame, plots, results for evo.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::evaluate::Compared;
use crate::archive;
use crate::evaluate::{
    Absolute, Evaluated, Member, Relation, ResultNames, absolute_members, per_frame_table, relative_members,
};
use crate::format::{self, Partial};
use crate::plot::{ComparedPath, EvaluatedEstimate, evaluation_figure};
use crate::storage;
use crate::structure::FrameId;

#[derive(clap::Args, Debug)]
pub(super) struct OutputArgs {
    /// Write the errors of each frame to a Parquet file.
    #[arg(long, value_name = "FILE.parquet")]
    per_frame: Option<PathBuf>,
    /// Draw paths, errors over time and a histogram of relative errors; of one sequence.
    #[arg(long, value_name = "FILE.svg")]
    save_plot: Option<PathBuf>,
    /// Write absolute errors of one estimate as an archive that `evo_res` reads.
    #[arg(long, value_name = "FILE.zip", alias = "save_results")]
    save_results: Option<PathBuf>,
    /// Write relative errors of one estimate as an archive that `evo_res` reads.
    #[arg(long, value_name = "FILE.zip")]
    save_relative_results: Option<PathBuf>,
    /// Replace outputs that exist.
    #[arg(long)]
    force: bool,
}

impl OutputArgs {
    /// Refuses outputs that are an input, or lie in one.
    pub(super) fn refuse_inputs(&self, inputs: &[PathBuf]) -> anyhow::Result<()> {
        let outputs = [&self.per_frame, &self.save_plot, &self.save_results, &self.save_relative_results];
        outputs.into_iter().flatten().try_for_each(|output| refuse_input(output, inputs))
    }

    /// Writes what was asked for.
    ///
    /// * `relation` — that of the archives; translation where none was named.
    pub(super) fn write(&self, compared: &[Compared], relation: Option<Relation>) -> anyhow::Result<()> {
        if let Some(path) = &self.per_frame {
            expect_extension(path, "parquet")?;
            let rows: Vec<(&Evaluated, &BTreeMap<FrameId, i64>)> = compared
                .iter()
                .flat_map(|compared| compared.rows.iter().map(|row| (row, &compared.stamps)))
                .collect();
            format::write_results(path, &per_frame_table(&rows), self.force)?;
        }
        if let Some(path) = &self.save_plot {
            expect_extension(path, "svg")?;
            let [compared] = compared else {
                anyhow::bail!("--save-plot: expected one sequence, found {}", compared.len());
            };
            self.save(path, picture(compared)?.as_bytes())?;
        }
        let relation = relation.unwrap_or(Relation::Translation);
        if let Some(path) = &self.save_results {
            let one = one(compared, "--save-results")?;
            let members = absolute_members(one.absolute, relation, &one.names, &one.stamps)?;
            self.save_archive(path, &members)?;
        }
        if let Some(path) = &self.save_relative_results {
            let one = one(compared, "--save-relative-results")?;
            let relative = one.row.evaluation.relative.as_ref().map_err(Clone::clone)?;
            let members = relative_members(relative, one.absolute, relation, &one.names, &one.stamps)?;
            self.save_archive(path, &members)?;
        }
        Ok(())
    }

    fn save_archive(&self, path: &Path, members: &[Member]) -> anyhow::Result<()> {
        expect_extension(path, "zip")?;
        let members = members.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice()));
        self.save(path, &archive::zipped(members)?)
    }

    fn save(&self, path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
        let partial = Partial::file(path, self.force)?;
        fs::write(partial.path(), bytes).with_context(|| path.display().to_string())?;
        Ok(partial.finish()?)
    }
}

/// Refuses an output that is an input, or lies in one.
pub(super) fn refuse_input(output: &Path, inputs: &[PathBuf]) -> anyhow::Result<()> {
    if inputs.iter().any(|input| storage::holds(input, output)) {
        anyhow::bail!("{}: is an input itself, or lies in one", output.display());
    }
    Ok(())
}

fn expect_extension(path: &Path, expected: &str) -> anyhow::Result<()> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(expected)) {
        Ok(())
    } else {
        anyhow::bail!("{}: expected a name that ends in .{expected}", path.display())
    }
}

/// The one estimate of which an archive is made.
struct One<'a> {
    row: &'a Evaluated,
    absolute: &'a Absolute<FrameId>,
    names: ResultNames,
    stamps: Vec<i64>,
}

fn one<'a>(compared: &'a [Compared], option: &str) -> anyhow::Result<One<'a>> {
    let rows: Vec<(&Compared, &Evaluated)> =
        compared.iter().flat_map(|compared| compared.rows.iter().map(move |row| (compared, row))).collect();
    let [(compared, row)] = rows.as_slice() else {
        anyhow::bail!("{option}: expected one estimate, found {}; --estimate NAME chooses", rows.len());
    };
    let absolute = row.evaluation.absolute.as_ref().map_err(Clone::clone)?;
    let stamps = absolute.ids.iter().filter_map(|id| compared.stamps.get(id)).copied().collect();
    let names = ResultNames {
        reference: row.reference.clone(),
        estimate: row.evaluation.name.clone(),
        alignment: row.alignment.clone(),
        step: row.step.clone(),
    };
    Ok(One { row, absolute, names, stamps })
}

/// Numbers of one estimate for a picture.
struct Drawn {
    name: String,
    reference: Vec<[f64; 3]>,
    estimate: Vec<[f64; 3]>,
    error_m: Vec<f64>,
    seconds: Vec<f64>,
    relative_deg: Vec<f64>,
}

fn picture(compared: &Compared) -> anyhow::Result<String> {
    let first = compared.stamps.values().next().copied();
    let drawn: Vec<Drawn> = compared
        .rows
        .iter()
        .filter_map(|row| {
            let absolute = row.evaluation.absolute.as_ref().ok()?;
            let places = |poses: &[crate::geometry::Pose]| -> Vec<[f64; 3]> {
                poses.iter().map(|pose| pose.translation().into()).collect()
            };
            let seconds = |id: &FrameId| match (compared.stamps.get(id), first) {
                (Some(stamp), Some(first)) => (i128::from(*stamp) - i128::from(first)) as f64 * 1e-9,
                // Without stamps, what follows each other does so once a second.
                _ => id.0 as f64,
            };
            let relative = row.evaluation.relative.as_ref().ok();
            let relative = relative.and_then(|relative| relative.errors(Relation::AngleDeg).ok());
            Some(Drawn {
                name: row.evaluation.name.clone(),
                reference: places(&absolute.aligned.reference),
                estimate: places(&absolute.aligned.estimate),
                error_m: absolute.translation.values().to_vec(),
                seconds: absolute.ids.iter().map(seconds).collect(),
                relative_deg: relative.map(|errors| errors.values().to_vec()).unwrap_or_default(),
            })
        })
        .collect();
    let estimates: Vec<EvaluatedEstimate<'_>> = drawn
        .iter()
        .map(|drawn| EvaluatedEstimate {
            path: ComparedPath {
                name: &drawn.name,
                reference: &drawn.reference,
                estimate: &drawn.estimate,
                error_m: &drawn.error_m,
            },
            seconds: &drawn.seconds,
            relative: &drawn.relative_deg,
        })
        .collect();
    let (title, step) = compared.rows.first().map_or(("", ""), |row| (&row.sequence, &row.step));
    Ok(evaluation_figure(title, &estimates, &format!("RPE of rotation over {step}, deg"), compared.upward)?)
}
