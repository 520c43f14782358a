//! `uw`: render underwater scenes, look at water as numbers, measure pictures, calibrate, predict.

use std::process::ExitCode;

fn main() -> ExitCode {
    uw_survey::cli::main()
}
