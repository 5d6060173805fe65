//! `os simulate`: a sequence out of a recipe.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::progress::{Progress, Stages};
use super::{Outcome, render, text};
use crate::format::{Encoding, Outline, WriteOptions, Written, stored_bytes, write_two_pass};
use crate::simulate::{self, Expected, Simulation};
use crate::stations;
use crate::storage;

/// Simulate a sequence: a scene, a path through it, what each frame sees, and noise.
///
/// A recipe is a TOML file; `os schema recipe` describes it. The simulated sequences of the paper are known by
/// name. The same recipe and seed give the same bytes on any machine. A recipe in JSON, as a simulated
/// sequence carries it in its manifest, is read as well.
#[derive(clap::Args, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "flags of a command")]
#[command(after_help = "Examples:
  os simulate box1 -o box1.mcap
  os simulate corridor1 -o corridor1-again --seed 7
  os simulate my-scene.toml -o my-scene
  os simulate box1 -o box1.mcap --render tum --render-to box1-raw --render-frames 0..60
  os simulate --list")]
pub(super) struct Args {
    /// Recipe: a file, or the name of one that travels with the program.
    #[arg(required_unless_present = "list")]
    recipe: Option<String>,
    /// Output: NAME.mcap for an MCAP file, any other name for a Parquet folder.
    #[arg(short, long, value_name = "PATH", required_unless_present = "list")]
    output: Option<PathBuf>,
    /// Seed of everything random, instead of the recipe's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
    /// Add channels with Foxglove's schemas, so that viewers show the sequence (MCAP only).
    #[arg(long)]
    foxglove: bool,
    /// Print what came out as the `[expected]` table of the recipe.
    #[arg(long)]
    print_expected: bool,
    /// List the recipes that travel with the program.
    #[arg(long)]
    list: bool,
    #[command(flatten, next_help_heading = "Raw RGB-D data")]
    render: render::RawArgs,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let (Some(name), Some(output)) = (&args.recipe, &args.output) else {
        return list(stdout);
    };
    if args.foxglove && Encoding::of_output(output) != Encoding::Mcap {
        anyhow::bail!(
            "--foxglove adds channels to an MCAP file; {} would be a Parquet folder",
            output.display()
        );
    }
    refuse_existing(output, args.force)?;
    let raw = args.render.target(args.force)?;
    let (mut recipe, folder) = stations::simulation_recipe(name)?;
    // What is expected, is expected of the recipe as it stands.
    let expected = recipe.expected.take().filter(|_| args.seed.is_none_or(|seed| seed == recipe.seed));
    recipe.seed = args.seed.unwrap_or(recipe.seed);

    let progress = Progress::new("looking", "frames");
    let simulation = simulate::simulate(&recipe, &folder, &|_, done, total| progress.update(done, total))
        .with_context(|| format!("recipe {name}"))?;
    drop(progress);
    // First, for what cannot be rendered leaves no sequence either.
    let rendered = raw.map(|raw| args.render.render(&simulation, raw, args.force)).transpose()?;
    let options = WriteOptions { force: args.force, foxglove: args.foxglove, ..WriteOptions::default() };
    let written = write(&simulation, output, options)?;

    let found = Expected::of(&written.tables);
    let rows: u64 = written.tables.iter().map(|table| table.rows).sum();
    writeln!(
        stdout,
        "{}: {} frames, {} points, {} lines in {} groups, {} + {} observations; {} rows, {}",
        output.display(),
        text::count(found.frames),
        text::count(found.points),
        text::count(found.lines),
        text::count(found.groups),
        text::count(found.point_observations),
        text::count(found.line_observations),
        text::count(rows),
        text::bytes(stored_bytes(output))
    )?;
    if let Some((raw, (partial, rendered))) = raw.zip(rendered) {
        partial.finish()?;
        let (width, height) = (rendered.width, rendered.height);
        let (frames, size) = (text::count(rendered.frames as u64), text::bytes(storage::size(raw, &[])));
        writeln!(
            stdout,
            "{}: pictures and depth maps of {frames} frames, {width} x {height} px, {size}",
            raw.display()
        )?;
    }
    if args.print_expected {
        writeln!(stdout, "\n[expected]\n{}", expected_table(&found))?;
    }
    if let Some(expected) = expected.filter(|expected| *expected != found) {
        writeln!(
            io::stderr(),
            "warning: the recipe expects something else:\n{}but what came out is:\n{}",
            expected_table(&expected),
            expected_table(&found)
        )?;
        return Ok(Outcome::Findings);
    }
    Ok(Outcome::Done)
}

/// Writes a simulated sequence.
fn write(simulation: &Simulation, output: &Path, options: WriteOptions) -> anyhow::Result<Written> {
    let stages = Stages::default();
    write_two_pass(
        output,
        Outline {
            manifest: &simulation.manifest(),
            frames: simulation.frames(),
            groups: simulation.structural_groups(),
        },
        options,
        |writer| {
            writer.append(&simulation.point_landmarks())?;
            writer.append(&simulation.line_landmarks()?)?;
            writer.append(simulation.structural_groups())?;
            Ok(())
        },
        || Ok(simulation.bundles().map(Ok)),
        &|stage, done, total| stages.update(stage, done, total),
    )
}

/// Ends before the work where the output is not to be replaced.
fn refuse_existing(output: &Path, force: bool) -> anyhow::Result<()> {
    if !force && storage::is_taken(output)? {
        anyhow::bail!("{} exists; --force replaces it", output.display());
    }
    Ok(())
}

fn list(stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let mut table = text::table(["NAME", "FRAMES", "POINTS", "LINES", "DESCRIPTION"], &[1, 2, 3]);
    for name in simulate::names() {
        let recipe = simulate::named(name)?;
        let expected = recipe.expected.unwrap_or_default();
        table.add_row([
            name.to_owned(),
            text::count(expected.frames),
            text::count(expected.points),
            text::count(expected.lines),
            recipe.description.unwrap_or_default(),
        ]);
    }
    writeln!(stdout, "{}", text::lines(&table))?;
    Ok(Outcome::Done)
}

/// The table as it stands in a recipe.
fn expected_table(expected: &Expected) -> String {
    format!(
        "frames = {}\npoints = {}\nlines = {}\npoint_observations = {}\nline_observations = {}\ngroups = {}\nsha256 = \"{}\"\n",
        expected.frames,
        expected.points,
        expected.lines,
        expected.point_observations,
        expected.line_observations,
        expected.groups,
        expected.sha256
    )
}
