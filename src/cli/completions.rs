//! `os completions`: completions for a shell.

use std::io::Write;

use clap_complete::Shell;

use super::{Outcome, program};

/// Print completions for a shell.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os completions bash > ~/.local/share/bash-completion/completions/os
  os completions zsh > ~/.zfunc/_os
  os completions fish > ~/.config/fish/completions/os.fish")]
pub(super) struct Args {
    /// Shell.
    shell: Shell,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program(), "os", &mut script);
    stdout.write_all(&script)?;
    Ok(Outcome::Done)
}
