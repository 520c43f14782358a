//! How a command fails, and the exit code of each way.

use std::fmt::Display;
use std::io::Write;
use std::process::ExitCode;

/// Exit code of a failure while running.
pub(crate) const FAILED: u8 = 1;
/// Exit code of unusable arguments or input.
pub(crate) const BAD_INPUT: u8 = 2;
/// Exit code of an interrupted run: 128 + SIGINT.
pub(crate) const INTERRUPTED: u8 = 130;

/// Why a command did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CliError {
    /// Arguments or input cannot be used; the message says where, what was got and what would be right.
    #[error("{0}")]
    Input(String),
    /// The run failed although arguments and input were good.
    #[error("{0}")]
    Failed(String),
    /// The user stopped the run; the message says what has been kept.
    #[error("{0}")]
    Interrupted(String),
}

impl CliError {
    /// Unusable arguments or input.
    pub(crate) fn input(message: impl Display) -> Self {
        Self::Input(message.to_string())
    }

    /// A failure while running.
    pub(crate) fn failed(message: impl Display) -> Self {
        Self::Failed(message.to_string())
    }

    /// Exit code, and the word for it in JSON.
    fn code(&self) -> (u8, &'static str) {
        match self {
            Self::Input(_) => (BAD_INPUT, "bad_input"),
            Self::Failed(_) => (FAILED, "failed"),
            Self::Interrupted(_) => (INTERRUPTED, "interrupted"),
        }
    }

    /// Tells the user on standard error, as text or as one JSON object, and returns the exit code.
    pub(crate) fn report(&self, json: bool) -> ExitCode {
        let (exit, code) = self.code();
        if json {
            let message = self.to_string();
            note(serde_json::json!({"error": {"code": code, "message": message}}));
        } else {
            note(format_args!("uw: {self}"));
        }
        ExitCode::from(exit)
    }
}

/// Writes a line to standard error. When that is closed there is nobody to tell.
pub(crate) fn note(line: impl Display) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}
