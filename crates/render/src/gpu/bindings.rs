//! Bind groups of the kernels.

/// What is bound at a place.
#[derive(Clone, Copy)]
pub(super) enum Bound {
    /// A uniform buffer.
    Uniform,
    /// A storage buffer that is read.
    Read,
    /// A storage buffer that is written.
    Written,
    /// A texture that is written.
    Picture,
}

/// The bindings of a kernel, from 0 on.
#[derive(Debug)]
pub(super) struct Bindings {
    label: &'static str,
    layout: wgpu::BindGroupLayout,
    /// For kernels with these bindings.
    pub(super) pipelines: wgpu::PipelineLayout,
}

impl Bindings {
    pub(super) fn new(device: &wgpu::Device, label: &'static str, bound: &[Bound]) -> Self {
        let entry = |(binding, bound): (u32, &Bound)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: bound.ty(),
            count: None,
        };
        let entries: Vec<_> = (0..).zip(bound).map(entry).collect();
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        });
        let pipelines = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        Self {
            label,
            layout,
            pipelines,
        }
    }

    /// Binds `buffers` in their order and, at the end, `picture`.
    pub(super) fn group<'b>(
        &self,
        device: &wgpu::Device,
        buffers: impl IntoIterator<Item = &'b wgpu::Buffer>,
        picture: Option<&'b wgpu::TextureView>,
    ) -> wgpu::BindGroup {
        let buffers = buffers.into_iter().map(wgpu::Buffer::as_entire_binding);
        let pictures = picture.map(wgpu::BindingResource::TextureView);
        let entries: Vec<_> = (0..)
            .zip(buffers.chain(pictures))
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.label),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

impl Bound {
    fn ty(self) -> wgpu::BindingType {
        let buffer = |ty| wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        match self {
            Self::Uniform => buffer(wgpu::BufferBindingType::Uniform),
            Self::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            Self::Written => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            Self::Picture => wgpu::BindingType::StorageTexture {
                access: wgpu::StorageTextureAccess::WriteOnly,
                format: wgpu::TextureFormat::Rgba8Unorm,
                view_dimension: wgpu::TextureViewDimension::D2,
            },
        }
    }
}
