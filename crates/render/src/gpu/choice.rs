//! Which backend renders.

use super::{AdapterChoice, Gpu, GpuError, adapters};

/// Where a picture is rendered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// A hardware GPU where there is one, else the processor: software adapters are no faster than the native code in most scenes.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// A graphics adapter, software ones included.
    Gpu,
}

impl Backend {
    /// The device to render on, `None` for the processor. `adapter` is a part of an adapter's name; where it is given,
    /// `Auto` takes that adapter.
    ///
    /// # Errors
    /// No adapter, none of that name, or one that cannot be used. `Auto` without a name falls back to the processor
    /// instead.
    pub fn open(self, adapter: Option<&str>) -> Result<Option<Gpu>, GpuError> {
        let choice = adapter.map_or(AdapterChoice::Best, AdapterChoice::Named);
        match (self, adapter) {
            (Self::Cpu, _) => Ok(None),
            (Self::Gpu, _) | (Self::Auto, Some(_)) => Gpu::open(choice).map(Some),
            (Self::Auto, None) => {
                let hardware = adapters().into_iter().find(|a| a.is_hardware());
                Ok(hardware.and_then(|a| Gpu::open(AdapterChoice::Named(&a.name)).ok()))
            }
        }
    }
}
