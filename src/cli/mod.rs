//! The command line: arguments in, calls to the rooms below, rendering out.

mod adjust;
mod adjust_foreign;
mod adjust_words;
mod benchmark;
mod cat;
mod chart;
mod completions;
mod convert;
mod copy;
mod evaluate;
mod evaluate_files;
mod evaluate_output;
mod evaluate_shown;
mod explain;
mod export;
mod extended;
mod fetch;
mod fetch_progress;
mod foreign;
mod graph;
mod import;
mod import_trajectory;
mod index;
mod info;
mod inputs;
mod left_behind;
mod man;
mod measure;
mod parsed;
mod plot;
mod plot_compared;
mod plot_figures;
mod plot_options;
mod progress;
mod render;
mod report;
mod schema;
mod simulate;
mod stats;
mod text;
mod track;
mod validate;

use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use crate::stations;

/// Measurements instead of images: tools for Open-Structure sequences.
///
/// A sequence is an MCAP file (NAME.mcap) or a Parquet folder (NAME/ with sequence.json). Every
/// command reads both; the name of an output decides which is written. A collection is a folder of
/// Parquet sequences called sequence=NAME; commands that take several sequences take all of its own.
/// Paths may be URLs: s3://, gs://, http:// and https://.
#[derive(Parser, Debug)]
#[command(
    name = "os",
    version,
    propagate_version = true,
    arg_required_else_help = true,
    after_help = "Exit codes: 0 done, 1 failed, 2 misused, 3 done with findings."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    Validate(validate::Args),
    Explain(explain::Args),
    Info(info::Args),
    Index(index::Args),
    Cat(cat::Args),
    Copy(copy::Args),
    Simulate(simulate::Args),
    Measure(measure::Args),
    Graph(graph::Args),
    Benchmark(benchmark::Args),
    Track(track::Args),
    Adjust(adjust::Args),
    Stats(stats::Args),
    Evaluate(evaluate::Args),
    Plot(plot::Args),
    Report(report::Args),
    Schema(schema::Args),
    Export(export::Args),
    Import(import::Args),
    ImportTrajectory(import_trajectory::Args),
    Fetch(fetch::Args),
    Convert(convert::Args),
    Completions(completions::Args),
    Man(man::Args),
}

/// How a command ended, if it did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// Everything was done.
    Done,
    /// Everything was done, and something was found.
    Findings,
    /// Another program ended with this code.
    Code(u8),
}

/// Runs the program with the arguments of the process.
#[must_use]
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    // Without a handler an interrupted program merely leaves a temporary file behind.
    let _ = ctrlc::set_handler(|| {
        crate::format::discard_unfinished();
        std::process::exit(130);
    });
    let mut stdout = io::BufWriter::new(io::stdout().lock());
    let result = match &cli.command {
        Command::Validate(args) => validate::run(args, &mut stdout),
        Command::Explain(args) => explain::run(args, &mut stdout),
        Command::Info(args) => info::run(args, &mut stdout),
        Command::Index(args) => index::run(args, &mut stdout),
        Command::Cat(args) => cat::run(args, &mut stdout),
        Command::Copy(args) => copy::run(args, &mut stdout),
        Command::Simulate(args) => simulate::run(args, &mut stdout),
        Command::Measure(args) => measure::run(args, &mut stdout),
        Command::Evaluate(args) => evaluate::run(args, &mut stdout),
        Command::Graph(args) => graph::run(args, &mut stdout),
        Command::Track(args) => track::run(args, &mut stdout),
        Command::Benchmark(args) => benchmark::run(args, &mut stdout),
        Command::Adjust(args) => adjust::run(args, &mut stdout),
        Command::Plot(args) => plot::run(args, &mut stdout),
        Command::Report(args) => report::run(args, &mut stdout),
        Command::Stats(args) => stats::run(args, &mut stdout),
        Command::Schema(args) => schema::run(args, &mut stdout),
        Command::Export(args) => export::run(args, &mut stdout),
        Command::Import(args) => import::run(args, &mut stdout),
        Command::ImportTrajectory(args) => import_trajectory::run(args, &mut stdout),
        Command::Fetch(args) => fetch::run(args, &mut stdout),
        Command::Convert(args) => convert::run(args),
        Command::Completions(args) => completions::run(args, &mut stdout),
        Command::Man(args) => man::run(args, &mut stdout),
    };
    let result = result.and_then(|outcome| Ok(stdout.flush().map(|()| outcome)?));
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Findings) => ExitCode::from(3),
        Ok(Outcome::Code(code)) => ExitCode::from(code),
        // Whoever reads our output has seen enough, as `head` does.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            let red = if io::stderr().is_terminal() { ("\u{1b}[1;31m", "\u{1b}[0m") } else { ("", "") };
            let _ = writeln!(io::stderr(), "{}error{}: {error:#}{}", red.0, red.1, remedy(&error));
            ExitCode::FAILURE
        }
    }
}

/// Which option helps against an error of a room that knows nothing of options.
fn remedy(error: &anyhow::Error) -> &'static str {
    match error.chain().find_map(|cause| cause.downcast_ref::<stations::Error>()) {
        Some(stations::Error::Taken { .. }) => " (--name NAME, --replace)",
        Some(stations::Error::NoTruth { .. }) => " (--reference NAME)",
        Some(stations::Error::Several { kind: "graph", .. }) => " (--graph NAME)",
        Some(stations::Error::Several { .. }) => " (--estimate NAME)",
        _ => "",
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let kind = match cause.downcast_ref::<serde_json::Error>() {
            Some(cause) => cause.io_error_kind(),
            None => cause.downcast_ref::<io::Error>().map(io::Error::kind),
        };
        kind == Some(io::ErrorKind::BrokenPipe)
    })
}

/// The program as clap describes it, for completions and man pages.
fn program() -> clap::Command {
    Cli::command()
}

/// Ends the program as clap does where a command's arguments do not go together.
fn misused(command: &str, kind: clap::error::ErrorKind, words: &str) -> ! {
    let mut program = program();
    program.build();
    match program.find_subcommand_mut(command) {
        Some(command) => command.error(kind, words).exit(),
        None => program.error(kind, words).exit(),
    }
}
