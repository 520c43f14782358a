//! The program `viewer`.

use std::process::ExitCode;

fn main() -> ExitCode {
    uw_viewer::cli::main()
}
