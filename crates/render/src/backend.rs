//! Where a picture is rendered: what is asked for, and what there is.

use std::sync::atomic::AtomicBool;

pub use crate::processor::Instructions;

use crate::{
    film::Film,
    gpu::{self, AdapterChoice, Gpu, GpuError, adapters},
    integrator::{self, Plan, Progress, RenderError, RenderStats},
    prepare::Prepared,
};

/// Where to render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// A hardware GPU where there is one, else the processor's vector units.
    #[default]
    Auto,
    /// The kernels in double precision on the processor, a sample at a time.
    Cpu,
    /// The kernels in single precision on the processor's vector units.
    CpuSimd,
    /// A graphics adapter, software ones included.
    Gpu,
}

impl Backend {
    /// The device to render on. `adapter` is a part of an adapter's name; where it is given, `Auto` takes that adapter.
    ///
    /// # Errors
    /// No adapter, none of that name, or one that cannot be used. `Auto` without a name falls back to the processor
    /// instead.
    pub fn open(self, adapter: Option<&str>) -> Result<Device, GpuError> {
        let choice = adapter.map_or(AdapterChoice::Best, AdapterChoice::Named);
        match (self, adapter) {
            (Self::Cpu, _) => Ok(Device::Cpu),
            (Self::CpuSimd, _) => Ok(Device::CpuSimd),
            (Self::Gpu, _) | (Self::Auto, Some(_)) => Gpu::open(choice).map(Device::from),
            (Self::Auto, None) => {
                let hardware = adapters().into_iter().find(|a| a.is_hardware());
                let gpu = hardware.and_then(|a| Gpu::open(AdapterChoice::Named(&a.name)).ok());
                Ok(gpu.map_or(Device::CpuSimd, Device::from))
            }
        }
    }
}

/// What renders.
#[derive(Clone, Debug, Default)]
pub enum Device {
    /// The kernels in double precision on the processor, a sample at a time.
    Cpu,
    /// The kernels in single precision on the processor's vector units; as [`Backend::Auto`] takes where there is no hardware GPU.
    #[default]
    CpuSimd,
    /// A graphics adapter.
    Gpu(Box<Gpu>),
}

impl From<Gpu> for Device {
    fn from(gpu: Gpu) -> Self {
        Self::Gpu(Box::new(gpu))
    }
}

impl Device {
    /// The graphics adapter, where it is one.
    pub fn gpu(&self) -> Option<&Gpu> {
        match self {
            Self::Gpu(gpu) => Some(gpu),
            Self::Cpu | Self::CpuSimd => None,
        }
    }

    /// Renders `scene`. `cancel` stops it; `observe` is called now and then.
    ///
    /// # Errors
    /// As [`integrator::render`], [`integrator::render_lanes`] and [`gpu::render`].
    pub fn render(
        &self,
        scene: &Prepared,
        plan: &Plan,
        cancel: &AtomicBool,
        observe: &(dyn Fn(&Progress) + Sync),
    ) -> Result<(Film, RenderStats), RenderError> {
        match self {
            Self::Cpu => integrator::render(scene, plan, cancel, observe),
            Self::CpuSimd => integrator::render_lanes(scene, plan, cancel, observe),
            Self::Gpu(gpu) => gpu::render(gpu, scene, plan, cancel, observe),
        }
    }
}

/// Why a picture has to be rendered again in double precision where any backend will do: the kernels in single precision refuse
/// the scene or, where the time is not `limited`, lost light or cut paths. `None` where there is no reason.
pub fn needs_double(rendered: Result<&RenderStats, &RenderError>, limited: bool) -> Option<String> {
    match rendered {
        Err(RenderError::Gpu(error)) => Some(error.to_string()),
        Err(error @ RenderError::LightLost { .. }) if !limited => Some(error.to_string()),
        Ok(stats) if stats.cut_paths > 0 && !stats.interrupted && !limited => {
            Some("limits of the kernels cut paths".to_owned())
        }
        _ => None,
    }
}
