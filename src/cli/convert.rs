//! `os convert`: hands over to the program `os-convert`.

use std::env;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

use anyhow::Context;

use super::Outcome;

/// Convert a raw dataset into a sequence; runs `os-convert` with the same arguments.
///
/// `os-convert` is looked for beside this program, then on PATH.
#[derive(clap::Args, Debug)]
#[command(
    disable_help_flag = true,
    after_help = "Examples:
  os convert open-structure box1/ -o box1
  os convert --help"
)]
pub(super) struct Args {
    /// Arguments of `os-convert`.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENT")]
    arguments: Vec<OsString>,
}

pub(super) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let name = format!("os-convert{}", env::consts::EXE_SUFFIX);
    let beside = env::current_exe()
        .ok()
        .and_then(|path| Some(path.parent()?.join(&name)))
        .filter(|path| path.is_file());
    let program = beside.unwrap_or_else(|| PathBuf::from(&name));
    let status = Command::new(&program).args(&args.arguments).status().with_context(|| {
        format!("cannot run {name}: it is neither beside this program nor on PATH; `cargo build --workspace` makes it")
    })?;
    Ok(Outcome::Code(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1)))
}
