//! Buffers, bindings and pipelines of one scene.

use super::{
    Gpu,
    bindings::{Bindings, Bound},
};
use crate::{
    kernels::{
        GpuError, MOST_RAYS, Room, Tables,
        layout::{Counters, Dispatch},
        switches,
    },
    prepare::Prepared,
};

/// Bindings: uniform buffers, then storage that kernels read, then what they write.
const SCENE_BINDINGS: [Bound; 12] = [
    Bound::Uniform,
    Bound::Uniform,
    Bound::Uniform,
    Bound::Uniform,
    Bound::Read,
    Bound::Read,
    Bound::Read,
    Bound::Written,
    Bound::Written,
    Bound::Written,
    Bound::Written,
    Bound::Written,
];
/// Rows of the uniform buffer; twin: `uniform_rows`.
pub(super) const UNIFORM_ROWS: usize = 4096;
/// Most bytes of scratch memory.
const SCRATCH_BYTES: u64 = 96 << 20;
/// Most lanes of a dispatch.
const MOST_LANES: u64 = 1 << 16;
/// Most samples of a pixel in a dispatch.
pub(super) const MOST_SAMPLES: u32 = 16;
/// Lanes of a workgroup.
pub(super) const WORKGROUP: u32 = 64;

/// A scene on the device.
pub(super) struct Loaded<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) film_layers: u32,
    /// Whether lamps are in the water.
    pub(super) has_lamps: bool,
    pub(super) pixels: u32,
    /// Lanes that scratch memory has room for.
    pub(super) lanes: u32,
    pub(super) room: Room,
    /// Sums of the batch's samples.
    pub(super) film: wgpu::Buffer,
    /// Where probes take their inputs from.
    #[cfg(test)]
    pub(super) scratch: wgpu::Buffer,
    dispatch: wgpu::Buffer,
    rays: wgpu::Buffer,
    completed: wgpu::Buffer,
    counters: wgpu::Buffer,
    counters_read: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
    layout: wgpu::PipelineLayout,
    constants: Vec<(&'static str, f64)>,
}

impl<'a> Loaded<'a> {
    /// Uploads `tables` of `scene`, for rays that are given or for pixels.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when something does not fit, or a fault of the device.
    pub(super) fn new(
        gpu: &'a Gpu,
        scene: &Prepared,
        tables: &Tables,
        given_rays: bool,
    ) -> Result<Self, GpuError> {
        let record = &tables.scene;
        let pixels = record.width * record.height;
        let room = Room::of(scene, record, MOST_SAMPLES);
        let lane_bytes = 16 * u64::from(room.rows());
        let budget = SCRATCH_BYTES.min(gpu.limits.max_storage_buffer_binding_size);
        let lanes = (budget / lane_bytes).min(MOST_LANES) / 64 * 64;
        let lanes = lanes.min(u64::from(pixels).next_multiple_of(64)) as u32;
        let film_bytes = u64::from(pixels) * u64::from(record.film_layers) * 12;
        let sums_bytes = u64::from(lanes) * u64::from(record.film_layers) * 16;
        let maker = Maker { gpu };
        let film = maker.empty("film", film_bytes)?;
        let scratch = maker.empty("scratch", u64::from(lanes) * lane_bytes)?;
        let sums = maker.empty("sums", sums_bytes)?;
        let completed = maker.empty("completed samples", 4 * u64::from(pixels))?;
        let counters = maker.empty("counters", size_of::<Counters>() as u64)?;
        let dispatch = maker.uniform(&[0; size_of::<Dispatch>()]);
        let rays = maker.uniform(bytemuck::cast_slice(&[[0f32; 4]; MOST_RAYS + 1]));
        let near_rows = tables.near_rows();
        let near_in_uniform = gpu.tables_in_uniform && tables.common_rows <= UNIFORM_ROWS;
        let mut uniform_rows = vec![[0; 4]; UNIFORM_ROWS];
        if near_in_uniform {
            let common = &near_rows[..tables.common_rows];
            uniform_rows[..common.len()].copy_from_slice(common);
        }
        let buffers = [
            maker.uniform(bytemuck::cast_slice(&tables.scene_words())),
            dispatch.clone(),
            maker.uniform(bytemuck::cast_slice(&uniform_rows)),
            rays.clone(),
            maker.filled("small tables", &near_rows)?,
            maker.filled("triangles and field of daylight", &tables.far_rows)?,
            maker.filled("textures", &tables.texels)?,
            scratch.clone(),
            sums,
            film.clone(),
            completed.clone(),
            counters.clone(),
        ];
        let bindings = Bindings::new(&gpu.device, "scene", &SCENE_BINDINGS);
        let bind_group = bindings.group(&gpu.device, &buffers, None);
        let mut constants = switches(scene, record);
        for (name, on) in [
            ("NEAR_IN_UNIFORM", near_in_uniform),
            ("GIVEN_RAYS", given_rays),
        ] {
            constants.push((name, f64::from(u8::from(on))));
        }
        let loaded = Self {
            gpu,
            film_layers: record.film_layers,
            has_lamps: record.lamp_count > 0,
            pixels,
            lanes,
            room,
            counters_read: gpu.readable(size_of::<Counters>() as u64),
            film,
            #[cfg(test)]
            scratch,
            dispatch,
            rays,
            completed,
            counters,
            bind_group,
            layout: bindings.pipelines,
            constants,
        };
        gpu.check()?;
        Ok(loaded)
    }

    /// The pipeline of a shader.
    ///
    /// # Errors
    /// A fault of the shader or of the device.
    #[cfg(test)]
    pub(super) fn pipeline(&self, name: &str) -> Result<wgpu::ComputePipeline, GpuError> {
        self.pipeline_of(name, &super::shaders::compose(name)?)
    }

    /// The pipeline of the composed shader `text`, specialised to what the scene needs.
    ///
    /// # Errors
    /// A fault of the shader or of the device.
    pub(super) fn pipeline_of(
        &self,
        name: &str,
        text: &str,
    ) -> Result<wgpu::ComputePipeline, GpuError> {
        self.gpu.pipeline(name, text, &self.layout, &self.constants)
    }

    /// The rays of the next dispatches: their origin, then a direction each.
    pub(super) fn set_rays(&self, rows: &[[f32; 4]]) {
        self.gpu
            .queue
            .write_buffer(&self.rays, 0, bytemuck::cast_slice(rows));
    }

    /// Sets the film, and with `only_completed` nothing but the counts of completed samples, to zero.
    pub(super) fn clear(&self, only_completed: bool) {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.completed, 0, None);
        if !only_completed {
            encoder.clear_buffer(&self.film, 0, None);
        }
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// Runs one dispatch to its end and returns what it counted.
    ///
    /// # Errors
    /// A fault of the device.
    pub(super) fn run(
        &self,
        pipeline: &wgpu::ComputePipeline,
        dispatch: &Dispatch,
    ) -> Result<Counters, GpuError> {
        let queue = &self.gpu.queue;
        queue.write_buffer(&self.dispatch, 0, bytemuck::bytes_of(dispatch));
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.counters, 0, None);
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.bind_group, &[]);
            pass.dispatch_workgroups(dispatch.pixel_count.div_ceil(WORKGROUP), 1, 1);
        }
        let bytes = size_of::<Counters>() as u64;
        encoder.copy_buffer_to_buffer(&self.counters, 0, &self.counters_read, 0, bytes);
        queue.submit([encoder.finish()]);
        let counters: Vec<Counters> = self.gpu.read(&self.counters_read)?;
        counters.first().copied().ok_or_else(|| GpuError::Lost {
            reason: "no counters came back".to_owned(),
        })
    }

    /// The samples of the batch that each pixel has.
    ///
    /// # Errors
    /// A fault of the device.
    pub(super) fn read_completed(&self) -> Result<Vec<u32>, GpuError> {
        self.gpu.read_buffer(&self.completed, self.completed.size())
    }

    /// Sums of the batch: per pixel its layers, three channels each.
    ///
    /// # Errors
    /// A fault of the device.
    pub(super) fn read_film(&self) -> Result<Vec<f32>, GpuError> {
        self.gpu.read_buffer(&self.film, self.film.size())
    }
}

pub(super) struct Maker<'a> {
    pub(super) gpu: &'a Gpu,
}

impl Maker<'_> {
    fn fits(&self, what: &str, bytes: u64) -> Result<(), GpuError> {
        let available = self.gpu.limits.max_storage_buffer_binding_size;
        if bytes > available {
            return Err(GpuError::Limit {
                what: format!("the buffer of the {what}"),
                limit: "max_storage_buffer_binding_size",
                needed: bytes,
                available,
            });
        }
        Ok(())
    }

    pub(super) fn empty(&self, what: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        self.fits(what, bytes)?;
        Ok(self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size: bytes.max(16),
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        }))
    }

    /// A buffer with `values`, or with one zero record where there are none, because bindings cannot be empty.
    pub(super) fn filled<T: bytemuck::Pod>(
        &self,
        what: &str,
        values: &[T],
    ) -> Result<wgpu::Buffer, GpuError> {
        self.fits(what, size_of_val(values) as u64)?;
        let none = [T::zeroed()];
        let values = if values.is_empty() { &none } else { values };
        let contents = bytemuck::cast_slice(values);
        Ok(self.init(what, contents, wgpu::BufferUsages::STORAGE))
    }

    pub(super) fn uniform(&self, contents: &[u8]) -> wgpu::Buffer {
        self.init("uniform", contents, wgpu::BufferUsages::UNIFORM)
    }

    /// A buffer with `contents`; not one mapped for them, because mapping panics where a device is lost or full.
    fn init(&self, what: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size: contents.len() as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.gpu.queue.write_buffer(&buffer, 0, contents);
        buffer
    }
}
