//! `uweval`: the evaluation's command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    uw_evaluation::cli::main()
}
