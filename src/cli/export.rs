//! `os export`: a sequence's graph, paths or measurements in the formats of other programs, all of it in that of a viewer.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::ValueEnum;

use super::{Outcome, left_behind, text};
use crate::exchange::{
    self, G2oForm, Remark, TextFile, to_bal, to_colmap, to_csv, to_g2o, to_text_release, trajectory_of,
    valued_graph,
};
use crate::format::{self, Partial};
use crate::storage;
use crate::structure::{FactorGraph, Sequence, TrajectoryFormat, write_trajectory};

/// Export a graph, a path or the measurements of a sequence in the format of another program, or everything for a viewer.
///
/// What the format cannot say is told on stderr; the exit code is 3 where something is lost. Numbers keep all their
/// digits.
#[derive(clap::Args, Debug)]
#[command(after_help = "Formats:
  g2o           a graph: poses with relative poses or points, FILE.g2o
  bal           points of a graph, as Bundle Adjustment in the Large, FILE.txt
  colmap        points of a graph, as COLMAP's text model, a folder
  tum           a path: stamp tx ty tz qx qy qz qw, world_from_camera
  kitti         a path: 3 x 4 matrices, world_from_camera, a line for each frame
  euroc         a path: CSV with stamps in nanoseconds, world_from_camera
  text-release  the text files of the first release, a folder
  csv           measurements as CSV with cameras.json, a folder; no truth unless --with-truth
  rerun         everything on the timeline of the Rerun viewer, FILE.rrd

Examples:
  os export box1 --to g2o -o box1.g2o
  os export box1 --to colmap --estimate point-ba -o box1-colmap
  os export box1 --to tum --estimate map-to-frame -o map-to-frame.txt
  os export box1 --to tum --estimate truth -o truth.txt
  os export box1 --to csv -o box1-csv
  os export box1 --to rerun -o box1.rrd")]
pub(super) struct Args {
    /// Sequence: an MCAP file or a Parquet folder.
    sequence: PathBuf,
    /// Format.
    #[arg(long, value_enum, value_name = "FORMAT")]
    to: Format,
    /// Graph to export; by default the only one, or `initial`.
    #[arg(long, value_name = "NAME")]
    graph: Option<String>,
    /// Estimate to export, or `truth`; a graph gets its values, and one of the measurements is made where there is none.
    #[arg(long, value_name = "NAME")]
    estimate: Option<String>,
    /// Write the true poses and landmarks as well (csv only).
    #[arg(long)]
    with_truth: bool,
    /// How g2o poses are written.
    #[arg(long, value_enum, default_value_t = Form::AsItIs)]
    form: Form,
    /// Output: a file, or a folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    G2o,
    Bal,
    Colmap,
    Tum,
    Kitti,
    Euroc,
    TextRelease,
    Csv,
    Rerun,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Form {
    /// In the plane where every pose is, otherwise in space.
    AsItIs,
    /// In the plane (SE2).
    Plane,
    /// In space (SE3).
    Space,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    if args.with_truth && args.to != Format::Csv {
        bail!("--with-truth goes with --to csv; other formats hold what --graph and --estimate name");
    }
    if args.form != Form::AsItIs && args.to != Format::G2o {
        bail!("--form goes with --to g2o");
    }
    if args.to == Format::Rerun && args.output.extension().is_none_or(|ending| ending != "rrd") {
        bail!("{}: expected a name that ends in .rrd", args.output.display());
    }
    let given = [("--graph", args.graph.is_some()), ("--estimate", args.estimate.is_some())];
    let takes = match args.to {
        Format::Tum | Format::Kitti | Format::Euroc => &["--estimate"][..],
        Format::Csv | Format::Rerun => &[],
        Format::TextRelease => &["--graph"],
        Format::G2o | Format::Bal | Format::Colmap => &["--graph", "--estimate"],
    };
    if let Some((name, _)) = given.iter().find(|(name, is_given)| *is_given && !takes.contains(name)) {
        bail!("{name} does not go with this format");
    }
    refuse_input(&args.sequence, &args.output)?;
    let partial = Partial::new(&args.output, args.force)?;
    if storage::is_folder(&args.output) {
        refuse_foreign(&args.output)?;
    }
    let reader = format::open(&args.sequence)?;
    let mut outcome = left_behind::warn(&reader)?;
    drop(reader);
    let sequence = format::read(&args.sequence)?;
    let (remarks, what) = write(args, &sequence, &partial)?;
    partial.finish()?;
    for remark in &remarks {
        let word = if remark.loss { "warning" } else { "note" };
        writeln!(io::stderr(), "{word}: {remark}")?;
        if remark.loss {
            outcome = Outcome::Findings;
        }
    }
    let size = text::bytes(storage::size(&args.output, &[]));
    writeln!(stdout, "{}: {what}, {size}", args.output.display())?;
    Ok(outcome)
}

fn write(args: &Args, sequence: &Sequence, partial: &Partial) -> anyhow::Result<(Vec<Remark>, String)> {
    match args.to {
        Format::G2o => {
            let form = match args.form {
                Form::AsItIs => G2oForm::AsItIs,
                Form::Plane => G2oForm::Plane,
                Form::Space => G2oForm::Space,
            };
            let (graph, mut remarks) = graph(args, sequence)?;
            let (model, told) = to_g2o(&graph, form)?;
            remarks.extend(told);
            into_file(partial, |output| Ok(exchange::write_g2o(output, &model)?))?;
            Ok((
                remarks,
                format!("graph `{}`, {} lines", graph.name, text::count(model.elements.len() as u64)),
            ))
        }
        Format::Bal => {
            let (graph, mut remarks) = graph(args, sequence)?;
            let (problem, told) = to_bal(&graph)?;
            remarks.extend(told);
            into_file(partial, |output| Ok(exchange::write_bal(output, &problem)?))?;
            let [cameras, points, seen] =
                [problem.cameras.len(), problem.points.len(), problem.observations.len()]
                    .map(|number| text::count(number as u64));
            Ok((remarks, format!("{cameras} cameras, {points} points, {seen} observations")))
        }
        Format::Colmap => {
            let (graph, mut remarks) = graph(args, sequence)?;
            let (model, told) = to_colmap(&graph)?;
            remarks.extend(told);
            partial.create_folder()?;
            let create = |name: &str| {
                let path = partial.path().join(name);
                File::create(&path).map(BufWriter::new).with_context(|| path.display().to_string())
            };
            let (mut cameras, mut images, mut points) =
                (create("cameras.txt")?, create("images.txt")?, create("points3D.txt")?);
            exchange::write_colmap(&mut cameras, &mut images, &mut points, &model)?;
            for mut output in [cameras, images, points] {
                output.flush()?;
            }
            let [images, points] =
                [model.images.len(), model.points.len()].map(|number| text::count(number as u64));
            Ok((remarks, format!("{} cameras, {images} images, {points} points", model.cameras.len())))
        }
        Format::Tum => path(args, sequence, partial, TrajectoryFormat::Tum),
        Format::Kitti => path(args, sequence, partial, TrajectoryFormat::Kitti),
        Format::Euroc => path(args, sequence, partial, TrajectoryFormat::Euroc),
        Format::TextRelease => {
            let (files, remarks) = to_text_release(sequence, args.graph.as_deref())?;
            let what = format!("{} files", files.len());
            into_folder(partial, &files)?;
            Ok((remarks, what))
        }
        Format::Csv => {
            let files = to_csv(sequence, args.with_truth)?;
            into_folder(partial, &files)?;
            Ok((Vec::new(), format!("{} files", files.len())))
        }
        Format::Rerun => {
            let counts = format::write_rerun(partial.path(), sequence)?;
            let what = format!("{} entities, {} frames", counts.entities, text::count(counts.frames as u64));
            Ok((Vec::new(), what))
        }
    }
}

/// The graph that the arguments name, with the values of the estimate that they name.
fn graph(args: &Args, sequence: &Sequence) -> anyhow::Result<(FactorGraph, Vec<Remark>)> {
    let names = FactorGraph::names(sequence);
    let name = match &args.graph {
        Some(name) if names.contains(name) => name.as_str(),
        Some(name) => bail!("graph `{name}`: expected {}, found none of the name", list(&names)),
        None => match (names.len(), names.first()) {
            (0, _) if args.estimate.is_some() => "measurements",
            (0, _) => {
                bail!(
                    "{}: has no graph; --estimate NAME makes one of its measurements",
                    args.sequence.display()
                )
            }
            (1, Some(name)) => name.as_str(),
            _ if names.contains("initial") => "initial",
            _ => bail!("--graph: expected {}, found nothing", list(&names)),
        },
    };
    match args.estimate.as_deref() {
        None => {
            let graph = FactorGraph::of(sequence, name);
            Ok((graph.with_context(|| format!("graph `{name}` is empty"))?, Vec::new()))
        }
        Some(estimate) => Ok(valued_graph(sequence, name, is_estimate(sequence, estimate))?),
    }
}

/// The name of an estimate, or `None` for the truth; an estimate that is called so comes first.
fn is_estimate<'a>(sequence: &Sequence, name: &'a str) -> Option<&'a str> {
    let known = name != "truth" || sequence.trajectories.iter().any(|row| row.estimate == name);
    known.then_some(name)
}

fn path(
    args: &Args,
    sequence: &Sequence,
    partial: &Partial,
    format: TrajectoryFormat,
) -> anyhow::Result<(Vec<Remark>, String)> {
    let names: BTreeSet<String> = sequence.trajectories.iter().map(|row| row.estimate.clone()).collect();
    let name = match (&args.estimate, names.len()) {
        (Some(name), _) => name.as_str(),
        (None, 1) => names.first().map_or("", String::as_str),
        (None, 0) => {
            bail!("{}: has no estimate; --estimate truth exports the true poses", args.sequence.display())
        }
        (None, _) => bail!("--estimate: expected truth, {}; found nothing", list(&names)),
    };
    let rows = trajectory_of(sequence, is_estimate(sequence, name), format)?;
    let count = rows.len();
    into_file(partial, |output| Ok(write_trajectory(output, format, rows)?))?;
    Ok((Vec::new(), format!("{} poses of `{name}`", text::count(count as u64))))
}

fn list(names: &BTreeSet<String>) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn into_file(
    partial: &Partial,
    fill: impl FnOnce(&mut BufWriter<File>) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut output = BufWriter::new(File::create(partial.path())?);
    fill(&mut output)?;
    output.flush()?;
    Ok(())
}

fn into_folder(partial: &Partial, files: &[TextFile]) -> anyhow::Result<()> {
    partial.create_folder()?;
    for file in files {
        let path = partial.path().join(&file.name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        fs::write(&path, &file.text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Refuses an output that is the input, or holds it.
pub(super) fn refuse_input(input: &Path, output: &Path) -> anyhow::Result<()> {
    storage::find(input).with_context(|| input.display().to_string())?;
    if storage::holds(output, input) {
        bail!("{}: is the input itself, or holds it", output.display());
    }
    Ok(())
}

/// Refuses to replace a folder with files that no export wrote.
fn refuse_foreign(folder: &Path) -> anyhow::Result<()> {
    let known = |name: &Path| {
        let folders = ["observation", "baseline"];
        let ends =
            name.extension().is_some_and(|end| ["txt", "csv", "json"].iter().any(|known| end == *known));
        ends || folders.iter().any(|known| name.ends_with(known))
    };
    for entry in storage::list(folder, &[])? {
        let path = folder.join(entry.name);
        if !known(&path) {
            bail!("{}: holds {}, which no export wrote; use another name", folder.display(), path.display());
        }
    }
    Ok(())
}
