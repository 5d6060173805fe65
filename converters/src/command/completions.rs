//! `os-convert completions`: completions for a shell.

use std::io::Write;

use clap_complete::Shell;

use super::Outcome;

/// Print completions for a shell
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os-convert completions bash > ~/.local/share/bash-completion/completions/os-convert")]
pub struct Args {
    /// Shell.
    shell: Shell,
}

/// Prints completions of `program`.
pub fn run(args: &Args, mut program: clap::Command, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, "os-convert", &mut script);
    stdout.write_all(&script)?;
    Ok(Outcome::Done)
}
