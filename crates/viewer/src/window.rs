//! The window's device: made so that the renderer can work on it too, and shared with it where that is wanted.

use std::sync::Arc;

use eframe::egui_wgpu::{RenderState, WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use eframe::wgpu;
use uw_render::backend::{Backend, Device};
use uw_render::gpu::{Gpu, GpuError};

/// The device that a window asks for. With `shareable` it has all that the renderer's kernels need, where the adapter
/// can do that, and `adapter` is a part of the name of the one to prefer.
pub fn configuration(shareable: bool, adapter: Option<&str>) -> WgpuConfiguration {
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    if shareable {
        let usual = Arc::clone(&setup.device_descriptor);
        setup.device_descriptor = Arc::new(move |adapter| {
            let mut descriptor = usual(adapter);
            // Without the limits the window opens all the same, and the renderer takes a device of its own.
            if let Ok(limits) = Gpu::required_limits(adapter) {
                descriptor.required_limits = limits;
            }
            descriptor
        });
        if let Some(name) = adapter.map(str::to_lowercase) {
            setup.native_adapter_selector =
                Some(Arc::new(move |all, surface| preferred(all, surface, &name)));
        }
    }
    WgpuConfiguration {
        wgpu_setup: WgpuSetup::CreateNew(setup),
        ..WgpuConfiguration::default()
    }
}

/// The first adapter of that name that can draw to the surface, or else the first that can, hardware before software.
fn preferred(
    all: &[wgpu::Adapter],
    surface: Option<&wgpu::Surface<'_>>,
    name: &str,
) -> Result<wgpu::Adapter, String> {
    let draws = |adapter: &&wgpu::Adapter| surface.is_none_or(|s| adapter.is_surface_supported(s));
    let rank = |adapter: &&wgpu::Adapter| {
        let info = adapter.get_info();
        let is_other = !info.name.to_lowercase().contains(name);
        (is_other, info.device_type == wgpu::DeviceType::Cpu)
    };
    let best = all.iter().filter(draws).min_by_key(rank);
    best.cloned()
        .ok_or_else(|| "no graphics adapter can draw to this screen".to_owned())
}

/// Where pictures are rendered: on the window's device if it is the one that `backend` and `adapter` want and can run
/// the kernels, else on a device of the renderer's own or on the processor.
///
/// # Errors
/// The adapter that was asked for does not exist or cannot be used.
pub fn renderer(
    window: Option<&RenderState>,
    backend: Backend,
    adapter: Option<&str>,
) -> Result<Device, GpuError> {
    let takes_adapters = matches!(backend, Backend::Auto | Backend::Gpu);
    let shared = window
        .filter(|_| takes_adapters)
        .filter(|window| is_wanted(&window.adapter.get_info(), backend, adapter))
        .and_then(|window| {
            let (device, queue) = (window.device.clone(), window.queue.clone());
            Gpu::from_parts(&window.adapter, device, queue).ok()
        });
    match shared {
        Some(gpu) => Ok(gpu.into()),
        None => backend.open(adapter),
    }
}

/// Whether the window's adapter is the one that is asked for.
fn is_wanted(info: &wgpu::AdapterInfo, backend: Backend, adapter: Option<&str>) -> bool {
    match adapter {
        Some(name) => info.name.to_lowercase().contains(&name.to_lowercase()),
        None => backend == Backend::Gpu || info.device_type != wgpu::DeviceType::Cpu,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_windows_adapter_is_taken_by_name_or_where_it_is_hardware() {
        let info = |name: &str, device_type| {
            let mut info = wgpu::AdapterInfo::new(device_type, wgpu::Backend::Vulkan);
            info.name = name.to_owned();
            info
        };
        let software = info("llvmpipe (LLVM)", wgpu::DeviceType::Cpu);
        let hardware = info("Some GPU", wgpu::DeviceType::DiscreteGpu);
        assert!(is_wanted(&hardware, Backend::Auto, None));
        assert!(!is_wanted(&software, Backend::Auto, None));
        assert!(is_wanted(&software, Backend::Gpu, None));
        assert!(is_wanted(&software, Backend::Auto, Some("LLVMpipe")));
        assert!(!is_wanted(&hardware, Backend::Gpu, Some("llvmpipe")));
    }
}
