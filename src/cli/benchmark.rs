//! `os benchmark`: every method on every sequence over seeds, as a table.

use std::io::{self, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::builder::PossibleValuesParser;

use super::progress::Progress;
use super::{Outcome, inputs, parsed, text};
use crate::benchmark::{
    self, Method, Plan, Results, Store, cells_table, curves_table, html, markdown, summary_table,
};
use crate::format;
use crate::plot::{NamedNumbers, convergence_figure};
use crate::simulate::noise::{NoiseModel, NoiseRecipe};
use crate::structure::ResultTable;

/// Most seeds of one benchmark.
const MOST_SEEDS: u64 = 1000;

/// Run methods on sequences over seeds: the paper's table, with the bound and the paper's figures beside it.
///
/// Where a sequence has noise-free observations, measurements are drawn from them with each seed; noisy measurements stay as
/// published, and depths that they lack are drawn about the true ones. `--as-measured` takes measurements as they are. Trackers are given measurements and the first true pose.
/// Optimisers begin with the robust map-to-frame estimate.
///
/// A run that is cut off goes on where it ended: the same command again. Every cell is a file of its own in the folder; tables
/// (Parquet, Markdown) and a page (HTML) are made of them at the end.
#[derive(clap::Args, Debug)]
#[command(after_help = "Methods:
  frame-to-frame-classic, map-to-frame-classic   the paper's trackers
  point-ba, point-line-ba                        the paper's bundle adjustments, monocular
  frame-to-frame, map-to-frame                   robust trackers with lines, depth and covariances
  structural-ba                                  depth, declared noise, parallel groups

Examples:
  os benchmark box1 corridor1 -o results
  os benchmark all -o results            every sequence of a collection
  os benchmark converted/* -o results --seeds 10 --label \"2026-11-22, commit 3120c7e\"
  os benchmark box1.mcap -o results --methods map-to-frame,structural-ba --estimates my-slam --as-measured
  os benchmark --gather runs/* -o results   what runs on several machines found, as one table")]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of its own")]
pub(super) struct Args {
    /// Sequences: MCAP files, Parquet folders, collections, recipes (`.toml`), or names of built-in recipes such as `box1`.
    #[arg(required = true)]
    sequences: Vec<String>,
    /// Folder of results; begun, or gone on with.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Run nothing: the arguments are folders of results, whose sequences and seeds are put together as if one run had made them.
    #[arg(long, conflicts_with_all = ["methods", "estimates", "seeds", "noise", "set", "as_measured", "no_bound", "threads"])]
    gather: bool,
    /// Methods, in the order of the columns; all by default.
    #[arg(long, value_name = "METHOD", value_delimiter = ',', value_parser = PossibleValuesParser::new(Method::ALL.map(Method::name)))]
    methods: Vec<String>,
    /// Estimates in the sequences that are evaluated beside the methods, such as those of `os import-trajectory`.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    estimates: Vec<String>,
    /// Number of seeds, from 0; or first and last, such as 5..9.
    #[arg(long, value_name = "N|A..B", default_value = "10", value_parser = seeds)]
    seeds: RangeInclusive<u64>,
    /// Noise model of what is drawn.
    #[arg(long, value_name = "MODEL", default_value = "first-release", value_parser = PossibleValuesParser::new(NoiseModel::ALL.map(NoiseModel::name)))]
    noise: String,
    /// A parameter of the noise model or an option, by the registry's name; may be given several times.
    #[arg(long, value_name = "NAME=VALUE", value_parser = super::measure::assignment)]
    set: Vec<(String, f64)>,
    /// Give the methods the measurements as they stand in the sequences, as `--estimates` had them, and draw none; a seed is then
    /// that of the methods alone.
    #[arg(long, conflicts_with_all = ["noise", "set"])]
    as_measured: bool,
    /// Leave out the bound, which takes about as long as one adjustment.
    #[arg(long)]
    no_bound: bool,
    /// Said above the tables, such as date and commit.
    #[arg(long, value_name = "TEXT", default_value = "")]
    label: String,
    /// Threads; all cores by default. Figures do not depend on it.
    #[arg(long, value_name = "N", value_parser = parsed::threads)]
    threads: Option<usize>,
    /// Begin anew: remove the cells that are there, whatever made them.
    #[arg(long)]
    force: bool,
    /// Print the summary as JSON in place of the table.
    #[arg(long)]
    json: bool,
}

fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let wrong = || "expected a number of seeds such as 10, or first and last such as 5..9".to_owned();
    let range = match text.split_once("..") {
        None => {
            let count: u64 = text.parse().map_err(|_| wrong())?;
            if count == 0 {
                return Err("expected at least one seed".to_owned());
            }
            0..=count - 1
        }
        Some((first, last)) => {
            let last = last.strip_prefix('=').unwrap_or(last);
            first.parse().map_err(|_| wrong())?..=last.parse().map_err(|_| wrong())?
        }
    };
    if range.is_empty() {
        return Err("the last seed comes before the first".to_owned());
    }
    if range.end() - range.start() >= MOST_SEEDS {
        return Err(format!("at most {MOST_SEEDS} seeds"));
    }
    Ok(range)
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    if args.gather {
        let runs: Vec<PathBuf> = args.sequences.iter().map(PathBuf::from).collect();
        let (store, plan, sequences) = benchmark::gather(&runs, &args.output, args.force)?;
        return show(args, &Results::of(&sequences, &plan, &store)?, false, stdout);
    }
    let model = NoiseModel::of_name(&args.noise).context("no such noise model")?;
    let mut noise = NoiseRecipe::new(model);
    for (name, value) in &args.set {
        noise.set(name, *value)?;
    }
    noise.check()?;
    let mut methods: Vec<Method> = args.methods.iter().filter_map(|name| Method::of_name(name)).collect();
    if methods.is_empty() {
        methods.extend(Method::ALL);
    }
    let seeds = args.seeds.clone().collect();
    let plan = Plan {
        methods,
        estimates: args.estimates.clone(),
        seeds,
        noise,
        as_measured: args.as_measured,
        bound: !args.no_bound,
    };
    let store = Store::open(&args.output, &plan, args.force)?;
    let names = inputs::named(&args.sequences)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads.unwrap_or(0)).build()?;
    let left_out = std::sync::atomic::AtomicBool::new(false);
    let progress = Progress::new("benchmarking", "units");
    let tell = |told: &benchmark::Progress<'_>| match told {
        benchmark::Progress::Done { done, total } => progress.update(*done, *total),
        benchmark::Progress::NoBound { sequence, method, reason } => {
            let _ = writeln!(io::stderr(), "warning: {sequence}: no bound for {method}: {reason}");
        }
        benchmark::Progress::Changed { sequence } => {
            let _ = writeln!(
                io::stderr(),
                "{sequence}: is another than its cells were made of; they are made anew"
            );
        }
        benchmark::Progress::OtherMeasurements { sequence } => {
            let _ = writeln!(
                io::stderr(),
                "warning: {sequence}: its estimates were made of its own measurements, and the methods are given others; --as-measured gives them the same"
            );
        }
        benchmark::Progress::LeftOut { sequence, reason } => {
            left_out.store(true, std::sync::atomic::Ordering::Relaxed);
            let _ = writeln!(io::stderr(), "warning: {sequence}: left out: {reason}");
        }
    };
    let sequences = pool.install(|| benchmark::run(&names, &plan, &store, &tell))?;
    drop(progress);
    show(args, &Results::of(&sequences, &plan, &store)?, left_out.into_inner(), stdout)
}

/// Writes and prints what was found.
///
/// * `left_out` — whether a sequence was left out.
fn show(args: &Args, results: &Results, left_out: bool, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let written = write(&args.output, results, &args.label)?;
    if args.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&summary_table(results).to_json())?)?;
    } else {
        write!(stdout, "{}", markdown(results, &args.label))?;
        writeln!(stdout, "\n{}: {}", args.output.display(), written.join(", "))?;
    }
    let failed =
        results.rows.iter().filter_map(|row| row.failed.as_ref()).map(|(count, _)| count).sum::<usize>();
    if failed > 0 {
        writeln!(
            io::stderr(),
            "warning: {} cells without an estimate; cells.parquet says why",
            text::count(failed as u64)
        )?;
    }
    let findings = failed > 0 || left_out;
    Ok(if findings { Outcome::Findings } else { Outcome::Done })
}

/// Writes tables and page; gives the names of the files.
fn write(folder: &Path, results: &Results, label: &str) -> anyhow::Result<Vec<String>> {
    let mut names = Vec::new();
    let tables: [ResultTable; 3] = [cells_table(results), summary_table(results), curves_table(results)];
    for table in &tables {
        let name = format!("{}.parquet", table.name);
        format::write_results(&folder.join(&name), table, true)?;
        names.push(name);
    }
    let pictures = curves(results);
    for (name, text) in
        [("table.md", markdown(results, label)), ("report.html", html(results, label, &pictures))]
    {
        format::write_text(&folder.join(name), &text, true)?;
        names.push(name.to_owned());
    }
    Ok(names)
}

/// A picture of the convergence on every sequence with an optimiser, by the first seed.
fn curves(results: &Results) -> Vec<(String, String)> {
    let mut pictures = Vec::new();
    for sequence in results.sequences() {
        let mut runs: Vec<(&str, Vec<f64>)> = Vec::new();
        for cell in
            results.cells.iter().filter(|cell| cell.key.sequence == sequence && !cell.curve.is_empty())
        {
            if runs.iter().all(|(method, _)| *method != cell.key.method) {
                let costs = cell.curve.iter().filter(|point| point.accepted).map(|point| point.cost);
                runs.push((&cell.key.method, costs.collect()));
            }
        }
        if !runs.is_empty() {
            let title = format!("Convergence on {sequence}");
            let named: Vec<_> =
                runs.iter().map(|(name, costs)| NamedNumbers { name, numbers: costs }).collect();
            pictures.push((title.clone(), convergence_figure(&title, &named)));
        }
    }
    pictures
}
