//! The program `os-convert`: raw datasets to sequences.

use clap::{CommandFactory as _, Parser};
use open_structure::datasets::Dataset;
use open_structure_converters::command::{Outcome, completions, man, rgbd, text_release};
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
    /// Make a sequence of a sequence of TUM RGB-D: images of a Kinect
    ///
    /// Reads rgb.txt, depth.txt, groundtruth.txt and the images they name; pairs images by stamps, interpolates the true
    /// pose at the colour image's, and removes the lens distortion of freiburg1 and freiburg2.
    Tum(rgbd::Args),
    /// Make a sequence of a sequence of ICL-NUIM: rendered rooms
    ///
    /// Reads the PNG version with its *.gt.freiburg, and the original one of the ray tracer (scene_*.png, .depth, .txt).
    Icl(rgbd::Args),
    /// Make a sequence of a sequence of TartanAir: rendered scenes, V1 and V2
    ///
    /// Reads the left camera of V1 and the front one of V2: images, depth maps, and poses, which are north-east-down.
    #[command(name = "tartanair")]
    TartanAir(rgbd::Args),
    Completions(completions::Args),
    Man(man::Args),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    // Without a handler an interrupted program merely leaves a temporary file behind.
    let _ = ctrlc::set_handler(|| {
        open_structure::format::discard_unfinished();
        // At once: the destructors of OpenCV's libraries would take away what other threads work with.
        signal_hook::low_level::exit(130);
    });
    let mut stdout = io::stdout().lock();
    let mut stderr = io::stderr();
    let result = match &cli.command {
        Command::OpenStructure(args) => text_release::run(args, &mut stdout, &mut stderr),
        Command::Tum(args) => rgbd::run(Dataset::Tum, args, &mut stdout, &mut stderr),
        Command::Icl(args) => rgbd::run(Dataset::Icl, args, &mut stdout, &mut stderr),
        Command::TartanAir(args) => rgbd::run(Dataset::Tartanair, args, &mut stdout, &mut stderr),
        Command::Completions(args) => completions::run(args, Cli::command(), &mut stdout),
        Command::Man(args) => man::run(args, Cli::command(), &mut stdout),
    };
    let result = result.and_then(|outcome| Ok(stdout.flush().map(|()| outcome)?));
    let outcome = result.unwrap_or_else(|error| {
        // Whoever reads our output has seen enough, as `head` does.
        if is_broken_pipe(&error) {
            return Outcome::Done;
        }
        // Where even stderr is closed there is nobody to tell.
        let _ = writeln!(stderr, "error: {error:#}");
        Outcome::Failed
    });
    ExitCode::from(outcome.code())
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let io =
        |cause: &(dyn std::error::Error + 'static)| cause.downcast_ref::<io::Error>().map(io::Error::kind);
    error.chain().any(|cause| io(cause) == Some(io::ErrorKind::BrokenPipe))
}
