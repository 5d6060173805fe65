//! The program `os-convert`: raw datasets to sequences.

use clap::Parser;
use open_structure_converters::command::{Outcome, text_release};
use std::io::{self, Write as _};
use std::process::ExitCode;

/// Convert datasets to Open-Structure sequences
#[derive(Debug, Parser)]
#[command(name = "os-convert", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    OpenStructure(text_release::Args),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    // Without a handler an interrupted program merely leaves a temporary file behind.
    let _ = ctrlc::set_handler(|| {
        open_structure::format::discard_unfinished();
        std::process::exit(130);
    });
    let mut stdout = io::stdout().lock();
    let mut stderr = io::stderr();
    let result = match &cli.command {
        Command::OpenStructure(args) => text_release::run(args, &mut stdout, &mut stderr),
    };
    let outcome = result.unwrap_or_else(|error| {
        // Where even stderr is closed there is nobody to tell.
        let _ = writeln!(stderr, "error: {error:#}");
        Outcome::Failed
    });
    ExitCode::from(outcome.code())
}
