//! Adapters and the device.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use serde::Serialize;

use super::compiled::Compiled;
use crate::kernels::GpuError;

/// Storage buffers that the kernels bind.
const STORAGE_BUFFERS: u32 = 8;
/// Time between two looks at work on a shared device.
const PAUSE: Duration = Duration::from_micros(250);

/// The drivers, loaded once: NVIDIA's cannot be loaded and let go of more than some thirty times in a process.
static INSTANCE: LazyLock<wgpu::Instance> = LazyLock::new(|| {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    wgpu::Instance::new(descriptor)
});

/// A graphics adapter.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct AdapterInfo {
    /// Name, as `--adapter` takes it (any part of it, in any case).
    pub name: String,
    /// Kind: "discrete GPU", "integrated GPU", "virtual GPU", "CPU" or "other".
    pub kind: &'static str,
    /// Interface: "vulkan", "metal", "dx12".
    pub backend: String,
    /// Driver and its version.
    pub driver: String,
    /// Largest buffer a kernel can read, bytes.
    pub largest_buffer_bytes: u64,
}

impl AdapterInfo {
    /// Whether it is hardware and not a program that stands in for it.
    pub fn is_hardware(&self) -> bool {
        self.kind != "CPU"
    }
}

/// Which adapter to take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdapterChoice<'a> {
    /// The first whose name holds this text, in any case.
    Named(&'a str),
    /// Hardware before software.
    Best,
}

/// A device with its queue and the faults it has reported.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) limits: wgpu::Limits,
    pub(super) compiled: Compiled,
    /// Whether a window is drawn by the device too.
    pub(super) shared: bool,
    /// Whether small tables are read from a uniform buffer. A software adapter (llvmpipe) loads from storage in a loop over
    /// its lanes, from a uniform buffer for all of them at once.
    pub(super) tables_in_uniform: bool,
    info: AdapterInfo,
    fault: Arc<Mutex<Option<GpuError>>>,
}

/// All adapters, hardware first.
pub fn adapters() -> Vec<AdapterInfo> {
    found().iter().map(|(info, _)| info.clone()).collect()
}

pub(super) fn found() -> Vec<(AdapterInfo, wgpu::Adapter)> {
    let all = pollster::block_on(INSTANCE.enumerate_adapters(wgpu::Backends::PRIMARY));
    let mut all: Vec<_> = all.into_iter().map(|a| (describe(&a), a)).collect();
    all.sort_by_key(|(info, _)| match info.kind {
        "discrete GPU" => 0,
        "integrated GPU" | "virtual GPU" => 1,
        "other" => 2,
        _ => 3,
    });
    all
}

/// What an adapter says of itself.
pub(super) fn describe(adapter: &wgpu::Adapter) -> AdapterInfo {
    let info = adapter.get_info();
    let limits = adapter.limits();
    AdapterInfo {
        name: info.name,
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => "CPU",
            wgpu::DeviceType::Other => "other",
        },
        backend: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info),
        largest_buffer_bytes: limits.max_storage_buffer_binding_size,
    }
}

/// Whether a device with these limits can run the kernels.
///
/// # Errors
/// The limit that is too low.
pub(super) fn check_limits(limits: &wgpu::Limits) -> Result<(), GpuError> {
    let available = limits.max_storage_buffers_per_shader_stage;
    if available >= STORAGE_BUFFERS {
        return Ok(());
    }
    Err(GpuError::Limit {
        what: "buffers of a kernel".to_owned(),
        limit: "max_storage_buffers_per_shader_stage",
        needed: u64::from(STORAGE_BUFFERS),
        available: u64::from(available),
    })
}

impl Gpu {
    /// Opens the adapter of `choice`.
    ///
    /// # Errors
    /// No adapter at all, none of that name, or one that cannot do what the kernels need.
    pub fn open(choice: AdapterChoice<'_>) -> Result<Self, GpuError> {
        let all = found();
        if all.is_empty() {
            return Err(GpuError::no_adapter());
        }
        let matches = |info: &AdapterInfo| match choice {
            AdapterChoice::Best => true,
            AdapterChoice::Named(part) => info.name.to_lowercase().contains(&part.to_lowercase()),
        };
        let Some((info, adapter)) = all.iter().find(|(info, _)| matches(info)) else {
            let names: Vec<_> = all.iter().map(|(info, _)| info.name.clone()).collect();
            let got = match choice {
                AdapterChoice::Named(part) => part.to_owned(),
                AdapterChoice::Best => String::new(),
            };
            return Err(GpuError::UnknownAdapter {
                got,
                known: names.join(", "),
            });
        };
        Self::start(info.clone(), adapter)
    }

    fn start(info: AdapterInfo, adapter: &wgpu::Adapter) -> Result<Self, GpuError> {
        let limits = adapter.limits();
        check_limits(&limits)?;
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("renderer"),
            required_limits: limits.clone(),
            ..Default::default()
        });
        let (device, queue) = pollster::block_on(request).map_err(|e| GpuError::Device {
            adapter: info.name.clone(),
            reason: e.to_string(),
        })?;
        Ok(Self::watch(info, device, queue, limits, false))
    }

    /// Keeps the faults of a device.
    pub(super) fn watch(
        info: AdapterInfo,
        device: wgpu::Device,
        queue: wgpu::Queue,
        limits: wgpu::Limits,
        shared: bool,
    ) -> Self {
        let fault = Arc::new(Mutex::new(None));
        let keep = |fault: &Arc<Mutex<Option<GpuError>>>, error: GpuError| {
            // The first fault is the cause, later ones follow from it.
            fault
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .get_or_insert(error);
        };
        let for_errors = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            keep(&for_errors, of_device(&error));
        }));
        let for_loss = Arc::clone(&fault);
        device.set_device_lost_callback(move |_, message| {
            keep(&for_loss, GpuError::Lost { reason: message });
        });
        Self {
            device,
            queue,
            limits,
            compiled: Compiled::default(),
            shared,
            tables_in_uniform: !info.is_hardware(),
            info,
            fault,
        }
    }

    /// What the adapter says of itself.
    pub fn info(&self) -> &AdapterInfo {
        &self.info
    }

    /// The first fault that the device has reported.
    ///
    /// # Errors
    /// That fault.
    pub(super) fn check(&self) -> Result<(), GpuError> {
        let fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        fault.clone().map_or(Ok(()), Err)
    }

    /// Waits until `done`, which work that has been submitted sets.
    ///
    /// A wait holds a lock that a window on the same device needs when it lets go of a texture, so that on a shared device
    /// this looks up in between. It must not do so by waits with a time limit: wgpu-core panics when another thread meets
    /// the end of the queue meanwhile.
    ///
    /// # Errors
    /// A fault of the device.
    fn wait_for(&self, done: &AtomicBool) -> Result<(), GpuError> {
        let kind = if self.shared {
            wgpu::PollType::Poll
        } else {
            wgpu::PollType::wait_indefinitely()
        };
        loop {
            let polled = self.device.poll(kind.clone());
            self.check()?;
            polled.map_err(|e| GpuError::Lost {
                reason: e.to_string(),
            })?;
            if done.load(Ordering::Acquire) {
                return Ok(());
            }
            thread::sleep(PAUSE);
        }
    }

    /// The first `bytes` of `buffer`.
    ///
    /// # Errors
    /// A fault of the device.
    pub(super) fn read_buffer<T: bytemuck::Pod>(
        &self,
        buffer: &wgpu::Buffer,
        bytes: u64,
    ) -> Result<Vec<T>, GpuError> {
        let staging = self.readable(bytes);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes);
        self.queue.submit([encoder.finish()]);
        self.read(&staging)
    }

    /// A buffer that can be mapped.
    pub(super) fn readable(&self, bytes: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("to read"),
            size: bytes.max(16),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// The contents of `staging`, a buffer that can be mapped, after everything submitted has run.
    ///
    /// # Errors
    /// A fault of the device.
    pub(super) fn read<T: bytemuck::Pod>(
        &self,
        staging: &wgpu::Buffer,
    ) -> Result<Vec<T>, GpuError> {
        let lost = |reason: String| GpuError::Lost { reason };
        let mapped = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&mapped);
        // What went wrong is told by the range.
        staging.map_async(wgpu::MapMode::Read, .., move |_| {
            told.store(true, Ordering::Release);
        });
        self.wait_for(&mapped)?;
        let values = {
            let view = staging
                .get_mapped_range(..)
                .map_err(|e| lost(e.to_string()))?;
            bytemuck::pod_collect_to_vec(&view)
        };
        staging.unmap();
        Ok(values)
    }
}

fn of_device(error: &wgpu::Error) -> GpuError {
    match error {
        wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory,
        wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
            GpuError::Refused {
                reason: description.clone(),
            }
        }
    }
}
