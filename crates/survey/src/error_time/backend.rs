//! Where renders of the benchmark run.

use std::fmt;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Where a render runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// The native path tracer on the cores of the processor.
    Cpu,
    /// The graphics adapter, hardware before software.
    Gpu,
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cpu => f.pad("cpu"),
            Self::Gpu => f.pad("gpu"),
        }
    }
}
