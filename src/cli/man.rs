//! `os man`: man pages.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;

use super::{Outcome, program};
use crate::storage::Outgoing;

/// Write man pages: one for the program and one for each command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os man | man -l -
  os man -o /usr/local/share/man/man1")]
pub(super) struct Args {
    /// Folder for os.1, os-info.1 and so on; without it, the page of the program goes to standard output.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    // What `os help` says stands in the pages themselves.
    let mut command = program().disable_help_subcommand(true);
    command.build();
    let Some(folder) = &args.output else {
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page)?;
        stdout.write_all(&page)?;
        return Ok(Outcome::Done);
    };
    let pages = Outgoing::folder(folder).with_context(|| format!("{}", folder.display()))?;
    clap_mangen::generate_to(command, pages.path()).with_context(|| format!("{}", folder.display()))?;
    pages.finish().with_context(|| format!("{}", folder.display()))?;
    Ok(Outcome::Done)
}
