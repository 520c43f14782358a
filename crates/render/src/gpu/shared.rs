//! A device that belongs to a window: the renderer works on it too, so that pictures need not leave it.

use std::time::Duration;

use super::{
    Gpu, GpuError,
    device::{check_limits, describe},
};

/// How long a dispatch should take on a device of the renderer's own: display drivers end those of some seconds.
const ALONE: Duration = Duration::from_millis(50);
/// The same on one that draws a window: it draws between two dispatches, and 60 times per second.
const BESIDE_A_WINDOW: Duration = Duration::from_millis(12);

impl Gpu {
    /// The limits that a device of `adapter` needs for the renderer's kernels: all that the adapter has. A program that
    /// makes a device for both asks for these.
    ///
    /// # Errors
    /// The adapter cannot run the kernels.
    pub fn required_limits(adapter: &wgpu::Adapter) -> Result<wgpu::Limits, GpuError> {
        let info = adapter.get_info();
        if info.backend == wgpu::Backend::Gl {
            return Err(GpuError::Device {
                adapter: info.name,
                reason: "the kernels need Vulkan, Metal or DirectX 12, this is OpenGL; install a driver for one of them"
                    .to_owned(),
            });
        }
        let limits = adapter.limits();
        check_limits(&limits)?;
        Ok(limits)
    }

    /// The renderer on a device that exists already. Its faults are kept from now on for [`Gpu::fault`], instead of
    /// ending the program.
    ///
    /// # Errors
    /// The device was made with limits that are too low for the kernels; [`Gpu::required_limits`] has those it takes.
    pub fn from_parts(
        adapter: &wgpu::Adapter,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Result<Self, GpuError> {
        Self::required_limits(adapter)?;
        let limits = device.limits();
        check_limits(&limits)?;
        let mut info = describe(adapter);
        info.largest_buffer_bytes = limits.max_storage_buffer_binding_size;
        Ok(Self::watch(info, device, queue, limits, true))
    }

    /// Whether the device belongs to a window.
    pub fn is_shared(&self) -> bool {
        self.shared
    }

    /// The first fault that the device has reported.
    pub fn fault(&self) -> Option<GpuError> {
        self.check().err()
    }

    /// A texture of this size, pixels, for [`super::AdapterStepper::show`].
    ///
    /// # Errors
    /// A texture of this size does not fit, or a fault of the device.
    pub fn texture(&self, [width, height]: [u32; 2]) -> Result<wgpu::Texture, GpuError> {
        let available = self.limits.max_texture_dimension_2d;
        let needed = width.max(height);
        if needed > available {
            return Err(GpuError::Limit {
                what: "the picture".to_owned(),
                limit: "max_texture_dimension_2d",
                needed: u64::from(needed),
                available: u64::from(available),
            });
        }
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        self.check()?;
        Ok(texture)
    }

    /// How long a dispatch should take.
    pub(super) fn dispatch_time(&self) -> Duration {
        if self.shared { BESIDE_A_WINDOW } else { ALONE }
    }
}
