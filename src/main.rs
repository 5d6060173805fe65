//! The program `os`: see `os --help`.

use std::process::ExitCode;

fn main() -> ExitCode {
    open_structure::cli::main()
}
