//! Where renders of the benchmark run.

use std::fmt;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use uw_render::backend::{self, Device};
use uw_render::gpu::GpuError;
use uw_render::integrator;

/// Where a render runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// The native path tracer on the cores of the processor.
    Cpu,
    /// The same, neighbouring pixels sharing their daylight walks where the scene lets them (`--share-walks 8`).
    CpuShared,
    /// The GPU's kernels on the vector units of the processor.
    CpuSimd,
    /// The graphics adapter, hardware before software.
    Gpu,
}

/// Pixels that share walks on [`Backend::CpuShared`].
const SHARED_BY: u32 = 8;

impl Backend {
    /// Those of this processor that `uw render` chooses between: the native path tracer and, where they pay, the vector
    /// units.
    pub fn of_processor() -> Vec<Self> {
        let mut all = vec![Self::Cpu];
        if integrator::has_fast_lanes() {
            all.push(Self::CpuSimd);
        }
        all
    }

    /// Most neighbouring pixels that share walks.
    pub fn share_walks(self) -> u32 {
        match self {
            Self::CpuShared => SHARED_BY,
            Self::Cpu | Self::CpuSimd | Self::Gpu => 1,
        }
    }

    /// The device.
    ///
    /// # Errors
    /// There is no graphics adapter, or it cannot be used.
    pub fn open(self) -> Result<Device, GpuError> {
        let wanted = match self {
            Self::Cpu | Self::CpuShared => backend::Backend::Cpu,
            Self::CpuSimd => backend::Backend::CpuSimd,
            Self::Gpu => backend::Backend::Gpu,
        };
        wanted.open(None)
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cpu => f.pad("cpu"),
            Self::CpuShared => f.pad("cpu-shared"),
            Self::CpuSimd => f.pad("cpu-simd"),
            Self::Gpu => f.pad("gpu"),
        }
    }
}
