//! The film that stays on the adapter: batches are added, measured and shown there. Twin: `shaders/common/picture.wgsl`.

use super::{
    Gpu,
    bindings::{Bindings, Bound},
    pipeline::{Maker, WORKGROUP},
};
use crate::{
    film::{FEWEST_SAMPLES, Film},
    kernels::{GpuError, layout::PictureTask, shaders::compose},
    scene::{Encoding, Noise},
    sensor::noise_start,
};

/// Planes before those of the layers; twin: `FIRST_LAYER`.
const FIXED: u64 = 2;
/// Bytes of a pixel in a plane.
const PIXEL_BYTES: u64 = 12;
/// Workgroups of the statistics: each leaves one sum that the host adds up.
const STATISTICS_GROUPS: u32 = 64;
/// Most workgroups of the other kernels along an axis.
const MOST_GROUPS: u32 = 65_535;

/// How a held film becomes a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Factor from radiance, W/(m² sr), to the linear signal.
    pub exposure: f64,
    /// What becomes of the signal with noise, as in [`Sensor::colours`](crate::scene::Sensor::colours).
    pub colours: [[f64; 3]; 3],
    /// Encoding of the signal.
    pub encoding: Encoding,
    /// Bits per channel, 8 or 16; of 16 the upper byte is shown.
    pub bits: u32,
    /// Noise of the sensor.
    pub noise: Option<Noise>,
    /// Seed of the noise.
    pub noise_seed: u64,
}

/// What is known about a held film.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Mean radiance of the picture per channel, W/(m² sr).
    pub mean: [f64; 3],
    /// Estimated relative error as in [`Film::relative_error`]; `None` before the second batch and
    /// the fourth sample.
    pub relative_error: Option<f64>,
}

/// A film on the adapter.
pub(super) struct Held<'a> {
    gpu: &'a Gpu,
    size_px: [u32; 2],
    lamps: usize,
    task: wgpu::Buffer,
    pub(super) film: wgpu::Buffer,
    partial_sums: wgpu::Buffer,
    buffers: [wgpu::Buffer; 2],
    bindings: Bindings,
    hold: wgpu::ComputePipeline,
    statistics: wgpu::ComputePipeline,
    show: wgpu::ComputePipeline,
    /// Where a picture goes that is not wanted: bindings cannot be empty.
    nowhere: wgpu::Texture,
    samples: u64,
    batches: u32,
}

impl<'a> Held<'a> {
    /// An empty film of this size whose batches are the contents of `batch`; `levels` are those of the lamps.
    ///
    /// # Errors
    /// The film does not fit, or a fault of the device.
    pub(super) fn new(
        gpu: &'a Gpu,
        [width, height]: [u32; 2],
        batch: &wgpu::Buffer,
        levels: &[f64],
    ) -> Result<Self, GpuError> {
        let maker = Maker { gpu };
        let pixels = u64::from(width) * u64::from(height);
        let layers = 3 + levels.len() as u64;
        let film = maker.empty("held film", PIXEL_BYTES * pixels * (FIXED + layers))?;
        let partial_sums = maker.empty("partial sums", 16 * u64::from(STATISTICS_GROUPS))?;
        let floats: Vec<f32> = levels.iter().map(|&level| level as f32).collect();
        let levels_buffer = maker.filled("levels of the lamps", &floats)?;
        let bindings = Bindings::new(&gpu.device, "held film", &PICTURE_BINDINGS);
        let kernel = |name: &str| gpu.pipeline(name, &compose(name)?, &bindings.pipelines, &[]);
        Ok(Self {
            gpu,
            size_px: [width, height],
            lamps: levels.len(),
            task: maker.uniform(&[0; size_of::<PictureTask>()]),
            film,
            partial_sums,
            buffers: [batch.clone(), levels_buffer],
            hold: kernel("kernels/hold")?,
            statistics: kernel("kernels/statistics")?,
            show: kernel("kernels/show")?,
            bindings,
            nowhere: gpu.texture([1, 1])?,
            samples: 0,
            batches: 0,
        })
    }

    /// Samples per pixel and batches.
    pub(super) fn counts(&self) -> (u64, u32) {
        (self.samples, self.batches)
    }

    /// Adds the batch of `samples` samples that lies in the buffer of batches.
    pub(super) fn add(&mut self, samples: u32) {
        let task = PictureTask {
            batch_samples: samples as f32,
            ..self.task()
        };
        self.run(&self.hold, &task, &self.nowhere, self.groups());
        self.samples += u64::from(samples);
        self.batches += 1;
    }

    /// Mean and error of the film.
    ///
    /// # Errors
    /// A fault of the device.
    pub(super) fn statistics(&self) -> Result<Statistics, GpuError> {
        let pixels = f64::from(self.size_px[0]) * f64::from(self.size_px[1]);
        let mut task = self.task();
        let first = self.sums(&task)?;
        let mean = [first[0], first[1], first[2]].map(|sum| sum / pixels);
        task.mean = mean.map(|x| x as f32);
        let relative_error = if self.batches < 2 || self.samples < FEWEST_SAMPLES {
            None
        } else {
            Some((self.sums(&task)?[3] / (3.0 * pixels)).sqrt())
        };
        Ok(Statistics {
            mean,
            relative_error,
        })
    }

    /// Writes the picture to `texture`, of the film's size.
    ///
    /// # Errors
    /// A fault of the device.
    pub(super) fn show(&self, look: &Look, texture: &wgpu::Texture) -> Result<(), GpuError> {
        let noise = look.noise.unwrap_or(Noise { a: 0.0, b: 0.0 });
        let start = noise_start(look.noise_seed);
        let task = PictureTask {
            exposure: look.exposure as f32,
            srgb: u32::from(look.encoding == Encoding::Srgb),
            bits: look.bits,
            noise_a: noise.a as f32,
            noise_b: noise.b as f32,
            noise_low: start as u32,
            noise_high: (start >> 32) as u32,
            red: look.colours[0].map(|x| x as f32),
            green: look.colours[1].map(|x| x as f32),
            blue: look.colours[2].map(|x| x as f32),
            ..self.task()
        };
        self.run(&self.show, &task, texture, self.groups());
        self.gpu.check()
    }

    /// The film on the host.
    ///
    /// # Errors
    /// A fault of the device.
    pub(super) fn read(&self) -> Result<Film, GpuError> {
        let [width, height] = self.size_px;
        let planes: Vec<[f32; 3]> = self.gpu.read_buffer(&self.film, self.film.size())?;
        Ok(Film::new(width, height, self.lamps).of_planes(self.samples, self.batches, &planes))
    }

    /// The radiance of each pixel, W/(m² sr), on the host.
    ///
    /// # Errors
    /// A fault of the device.
    pub(super) fn read_radiance(&self) -> Result<Vec<[f32; 3]>, GpuError> {
        let pixels = u64::from(self.size_px[0]) * u64::from(self.size_px[1]);
        self.gpu.read_buffer(&self.film, PIXEL_BYTES * pixels)
    }

    fn groups(&self) -> u32 {
        let [width, height] = self.size_px;
        (width * height).div_ceil(WORKGROUP).min(MOST_GROUPS)
    }

    fn sums(&self, task: &PictureTask) -> Result<[f64; 4], GpuError> {
        self.run(&self.statistics, task, &self.nowhere, STATISTICS_GROUPS);
        let sums: Vec<[f32; 4]> = self
            .gpu
            .read_buffer(&self.partial_sums, self.partial_sums.size())?;
        Ok(std::array::from_fn(|k| {
            sums.iter().map(|sum| f64::from(sum[k])).sum()
        }))
    }

    fn task(&self) -> PictureTask {
        PictureTask {
            mean: [0.0; 3],
            pixels: self.size_px[0] * self.size_px[1],
            width: self.size_px[0],
            film_layers: 3 + self.lamps as u32,
            samples_before: self.samples as f32,
            batch_samples: 0.0,
            batches: self.batches as f32,
            exposure: 1.0,
            srgb: 0,
            bits: 8,
            noise_a: 0.0,
            noise_b: 0.0,
            noise_low: 0,
            noise_high: 0,
            red: [1.0, 0.0, 0.0],
            padding_1: 0,
            green: [0.0, 1.0, 0.0],
            padding_2: 0,
            blue: [0.0, 0.0, 1.0],
            padding_3: 0,
        }
    }

    fn run(
        &self,
        kernel: &wgpu::ComputePipeline,
        task: &PictureTask,
        texture: &wgpu::Texture,
        groups: u32,
    ) {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        queue.write_buffer(&self.task, 0, bytemuck::bytes_of(task));
        let [batch, levels] = &self.buffers;
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let buffers = [&self.task, batch, levels, &self.film, &self.partial_sums];
        let group = self.bindings.group(device, buffers, Some(&view));
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(kernel);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        queue.submit([encoder.finish()]);
    }
}

/// The bindings of `shaders/common/picture.wgsl`.
const PICTURE_BINDINGS: [Bound; 6] = [
    Bound::Uniform,
    Bound::Read,
    Bound::Read,
    Bound::Written,
    Bound::Written,
    Bound::Picture,
];
