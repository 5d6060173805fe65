//! `os import`: a graph or a model of another program as a sequence.

use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::ValueEnum;
use sha2::{Digest, Sha256};

use super::export::refuse_input;
use super::foreign::{self, Foreign};
use super::{Outcome, text};
use crate::exchange::{
    ImportNames, Imported, from_bal, from_colmap, from_g2o, read_bal, read_colmap, read_g2o,
};
use crate::format::{self, WriteOptions};
use crate::storage::{self, File};
use crate::structure::{SourceFile, hex};

/// The files of a COLMAP model.
const COLMAP_FILES: [&str; 3] = ["cameras.txt", "images.txt", "points3D.txt"];

/// Import a graph or a model of another program as a sequence: its frames, cameras, measurements and a graph.
///
/// Ids and digits stay; what the sequence cannot say is told on stderr, and the exit code is 3 where something is
/// lost. There is no truth in what is imported: its values are the initial values of the graph.
#[derive(clap::Args, Debug)]
#[command(after_help = "Formats:
  g2o     pose graphs (SE2, SE3:QUAT) and bundle adjustment, FILE.g2o
  bal     Bundle Adjustment in the Large, FILE.txt, uncompressed
  colmap  COLMAP's text model: a folder with cameras.txt, images.txt, points3D.txt

Examples:
  os import sphere2500.g2o -o sphere2500
  os import problem-49-7776-pre.txt --from bal -o ladybug.mcap
  os import sparse/0 --from colmap -o south-building")]
pub(super) struct Args {
    /// File or folder.
    input: PathBuf,
    /// Format; found out by the name and the first line where it is not given.
    #[arg(long, value_enum, value_name = "FORMAT")]
    from: Option<Format>,
    /// Output: NAME.mcap for an MCAP file, any other name for a Parquet folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Name of the sequence; by default that of the input.
    #[arg(long)]
    name: Option<String>,
    /// Name of the graph.
    #[arg(long, value_name = "NAME", default_value = "initial")]
    graph: String,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    G2o,
    Bal,
    Colmap,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    refuse_input(&args.input, &args.output)?;
    if !args.force && storage::is_taken(&args.output)? {
        return Err(format::Error::Exists { path: args.output.clone() }.into());
    }
    let from = match args.from {
        Some(from) => from,
        None => guess(&args.input)?,
    };
    if args.graph.is_empty() {
        bail!("--graph: expected a name, found none");
    }
    let names = ImportNames { sequence: name(args.name.as_deref(), &args.input)?, graph: args.graph.clone() };
    let Imported { mut sequence, remarks } =
        read(&args.input, from, &names).with_context(|| args.input.display().to_string())?;
    sequence.manifest.source.files = source_files(paths(&args.input, from))?;
    let options = WriteOptions { force: args.force, ..WriteOptions::default() };
    format::write(&args.output, &sequence, options)?;
    let mut outcome = Outcome::Done;
    for remark in &remarks {
        let word = if remark.loss { "warning" } else { "note" };
        writeln!(io::stderr(), "{word}: {remark}")?;
        if remark.loss {
            outcome = Outcome::Findings;
        }
    }
    let count = |number: usize| text::count(number as u64);
    writeln!(
        stdout,
        "{}: {} frames, {} points, {} factors in graph `{}`; {}",
        args.output.display(),
        count(sequence.frames.len()),
        count(sequence.graph_points.len()),
        count(sequence.graph_factors.len()),
        args.graph,
        text::bytes(format::stored_bytes(&args.output))
    )?;
    Ok(outcome)
}

fn read(input: &Path, from: Format, names: &ImportNames) -> anyhow::Result<Imported> {
    let open = |path: &Path| File::open(path).map(BufReader::new).with_context(|| path.display().to_string());
    Ok(match from {
        Format::G2o => from_g2o(&read_g2o(open(input)?)?, names)?,
        Format::Bal => from_bal(&read_bal(open(input)?)?, names)?,
        Format::Colmap => {
            let file = |name: &str| open(&input.join(name));
            let model = read_colmap(file("cameras.txt")?, file("images.txt")?, file("points3D.txt")?)?;
            from_colmap(&model, names)?
        }
    })
}

/// The files that are read.
fn paths(input: &Path, from: Format) -> Vec<PathBuf> {
    match from {
        Format::Colmap => COLMAP_FILES.iter().map(|name| input.join(name)).collect(),
        Format::G2o | Format::Bal => vec![input.to_owned()],
    }
}

/// Names, sizes and hashes of files that were read.
pub(super) fn source_files(paths: Vec<PathBuf>) -> anyhow::Result<Vec<SourceFile>> {
    let file = |path: PathBuf| {
        let mut hasher = Sha256::new();
        let mut file = BufReader::new(File::open(&path)?);
        let mut bytes = 0;
        loop {
            let read = file.fill_buf()?;
            if read.is_empty() {
                break;
            }
            hasher.update(read);
            let length = read.len();
            bytes += length as u64;
            file.consume(length);
        }
        let name =
            storage::without_query(&path).file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(SourceFile { name, bytes, sha256: hex(&hasher.finalize()) })
    };
    paths.into_iter().map(file).collect()
}

/// The name of the sequence: as given, or that of the input without what follows the last dot.
pub(super) fn name(given: Option<&str>, input: &Path) -> anyhow::Result<String> {
    let name = if let Some(name) = given {
        name.to_owned()
    } else {
        let path = if storage::is_url(input) {
            storage::without_query(input).to_owned()
        } else {
            input.canonicalize()?
        };
        let name = if storage::is_folder(input) { path.file_name() } else { path.file_stem() };
        name.unwrap_or_default().to_string_lossy().into_owned()
    };
    if name.is_empty() || name.chars().any(|letter| "/\\".contains(letter) || letter.is_control()) {
        bail!("--name: expected a name without `/`, `\\` and control characters, found {name:?}");
    }
    Ok(name)
}

/// The format of an input, by its name and its first words.
fn guess(input: &Path) -> anyhow::Result<Format> {
    if storage::is_folder(input) {
        let files = COLMAP_FILES;
        if files.iter().all(|name| storage::is_file(&input.join(name))) {
            return Ok(Format::Colmap);
        }
        let hint = if storage::is_file(&input.join("cameras.bin")) {
            "; `colmap model_converter --output_type TXT` makes them of a binary model"
        } else {
            ""
        };
        bail!("{}: expected a folder with {}{hint}", input.display(), files.join(", "));
    }
    match foreign::of(input)? {
        Some(Foreign::G2o) => return Ok(Format::G2o),
        Some(Foreign::Bal) => return Ok(Format::Bal),
        None => {}
    }
    bail!(
        "{}: expected a graph of g2o, a problem of BAL or a model of COLMAP; say which with --from",
        input.display()
    )
}
