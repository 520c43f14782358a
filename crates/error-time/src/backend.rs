//! Where renders of the benchmark run.

use std::fmt;
use std::sync::{LazyLock, atomic::AtomicBool};

use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use uw_render::backend::{self, Device};
use uw_render::film::Film;
use uw_render::gpu::GpuError;
use uw_render::integrator::{self, Instructions, Plan, Progress, RenderError, RenderStats};
use uw_render::prepare::Prepared;

/// The adapter of all renders: what it takes to open it and to compile its kernels is no part of a rung.
static ADAPTER: LazyLock<Result<Device, GpuError>> =
    LazyLock::new(|| backend::Backend::Gpu.open(None));

/// Where a render runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// The kernels in double precision on the processor, a sample at a time.
    Cpu,
    /// The kernels in single precision on the vector units of the processor.
    CpuSimd,
    /// The same with no other instructions than those that every processor of the architecture has (SSE2, NEON).
    CpuSimdBaseline,
    /// The same with SSE4.2.
    CpuSimdSse4,
    /// The graphics adapter, hardware before software.
    Gpu,
}

impl Backend {
    /// Those of `uw render` on the processor: double precision and the vector units.
    pub fn of_processor() -> Vec<Self> {
        vec![Self::Cpu, Self::CpuSimd]
    }

    /// Renders `scene`. `cancel` stops it; `observe` is called now and then.
    ///
    /// # Errors
    /// There is no graphics adapter, or it cannot be used; and those of [`backend::Device::render`].
    pub fn render(
        self,
        scene: &Prepared,
        plan: &Plan,
        cancel: &AtomicBool,
        observe: &(dyn Fn(&Progress) + Sync),
    ) -> Result<(Film, RenderStats), RenderError> {
        let with = |instructions| {
            integrator::render_lanes_with(instructions, scene, plan, cancel, observe)
        };
        let device = match self {
            Self::Cpu => &Device::Cpu,
            Self::CpuSimd => &Device::CpuSimd,
            Self::CpuSimdBaseline => return with(Instructions::Baseline),
            Self::CpuSimdSse4 => return with(Instructions::Sse4),
            Self::Gpu => ADAPTER.as_ref().map_err(GpuError::clone)?,
        };
        device.render(scene, plan, cancel, observe)
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cpu => f.pad("cpu"),
            Self::CpuSimd => f.pad("cpu-simd"),
            Self::CpuSimdBaseline => f.pad("cpu-simd-baseline"),
            Self::CpuSimdSse4 => f.pad("cpu-simd-sse4"),
            Self::Gpu => f.pad("gpu"),
        }
    }
}
