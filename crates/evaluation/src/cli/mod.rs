//! The command line `uweval`.

mod contrast;
mod interrupt;
mod operation;
mod phase;
mod progress;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::error::EvalError;

/// Does the guidance pay? Remakes the published inspection experiment with real renders.
///
/// Exit 0 when done, 2 for unusable arguments or input, 1 for a failure while running, 130 on interruption.
#[derive(Parser)]
#[command(name = "uweval", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Fly guidance, baselines and oracle along a lawnmower track and compare them
    Operation(operation::OperationArguments),
    /// Compare the contrast of whole images and of patches over distance
    Contrast(contrast::ContrastArguments),
    /// Compare phase functions over angle and in renders
    Phase(phase::PhaseArguments),
}

/// Runs the command line.
pub fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Operation(arguments) => operation::run(&arguments),
        Command::Contrast(arguments) => contrast::run(&arguments),
        Command::Phase(arguments) => phase::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            progress::note(format_args!("uweval: {error}"));
            ExitCode::from(match error {
                EvalError::Interrupted => 130,
                error if error.is_bad_input() => 2,
                _ => 1,
            })
        }
    }
}
