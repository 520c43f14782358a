//! Where a command renders.

use clap::{Args, ValueEnum, value_parser};
use uw_render::backend::{self, Device};

use super::error::CliError;

/// Arguments of all commands that render.
#[derive(Debug, Args)]
pub(super) struct DeviceArguments {
    /// Where to render.
    #[arg(long, value_enum, default_value_t = BackendChoice::Auto)]
    pub(super) backend: BackendChoice,
    /// Graphics adapter: any part of its name, in any case (see `uw adapters`).
    #[arg(long, value_name = "NAME")]
    pub(super) adapter: Option<String>,
    /// Worker threads. Default: one per core.
    #[arg(long, value_parser = value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum BackendChoice {
    /// A GPU where there is one, else cpu-simd.
    Auto,
    /// All cores of the processor, in double precision.
    Cpu,
    /// The same on its vector units: faster, in single precision.
    CpuSimd,
    /// A graphics adapter, also one that is only a program.
    Gpu,
}

impl DeviceArguments {
    /// Worker threads; `None` for one per core.
    pub(super) fn threads(&self) -> Option<usize> {
        self.threads.map(usize::from)
    }

    /// The device that is asked for.
    pub(super) fn open(&self) -> Result<Device, CliError> {
        let backend = match self.backend {
            BackendChoice::Auto => backend::Backend::Auto,
            BackendChoice::Cpu => backend::Backend::Cpu,
            BackendChoice::CpuSimd => backend::Backend::CpuSimd,
            BackendChoice::Gpu => backend::Backend::Gpu,
        };
        backend
            .open(self.adapter.as_deref())
            .map_err(CliError::input)
    }
}
