//! `os-convert man`: man pages.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context as _;

use super::Outcome;
use open_structure::storage::Outgoing;

/// Write man pages: one for the program and one for each dataset
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os-convert man | man -l -
  os-convert man -o /usr/local/share/man/man1")]
pub struct Args {
    /// Folder for os-convert.1, os-convert-tum.1 and so on; without it, the page of the program goes to standard output.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Writes man pages of `program`.
pub fn run(args: &Args, mut program: clap::Command, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    program.build();
    let Some(folder) = &args.output else {
        let mut page = Vec::new();
        clap_mangen::Man::new(program).render(&mut page)?;
        stdout.write_all(&page)?;
        return Ok(Outcome::Done);
    };
    let pages = Outgoing::folder(folder).with_context(|| format!("{}", folder.display()))?;
    clap_mangen::generate_to(program, pages.path()).with_context(|| format!("{}", folder.display()))?;
    pages.finish().with_context(|| format!("{}", folder.display()))?;
    Ok(Outcome::Done)
}
