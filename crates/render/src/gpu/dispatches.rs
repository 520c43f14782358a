//! The kernels that a scene needs, and their dispatches: short enough for display drivers, and none of their samples lost
//! unseen.

use std::time::{Duration, Instant};

use super::pipeline::{Loaded, MOST_SAMPLES, WORKGROUP};
use crate::kernels::{GpuError, Selection, Work, layout::Dispatch, shaders::compose};

/// Fewest samples of a dispatch: fewer leave most lanes idle, and a slow moment must not lead there.
const LEAST_WORK: f64 = 1024.0;
/// Work of the first dispatch, samples.
const FIRST_WORK: f64 = 2048.0;
/// Rounds of the loop at the end of a lane that tells whether its loops were cut.
const LOOP_PROBE: u32 = 3;

/// A change of a kernel's text, for tests that break it.
pub(super) type Edit<'e> = &'e dyn Fn(String) -> String;

/// A kernel and how fast it is.
struct Kernel {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
    /// Samples that a dispatch of the wanted length makes.
    work: f64,
    /// How long a dispatch should take.
    dispatch: Duration,
}

impl Kernel {
    fn new(loaded: &Loaded<'_>, name: &'static str, edit: Edit<'_>) -> Result<Self, GpuError> {
        let text = edit(compose(name)?);
        Ok(Self {
            name,
            pipeline: loaded.pipeline_of(name, &text)?,
            work: FIRST_WORK,
            dispatch: loaded.gpu.dispatch_time(),
        })
    }

    /// Learns from a dispatch that made `samples` samples in `elapsed`; by at most a factor of 4, because the first one
    /// holds the driver's compilation.
    fn learn(&mut self, samples: f64, elapsed: Duration) {
        let ideal = samples * self.dispatch.as_secs_f64() / elapsed.as_secs_f64().max(1e-6);
        self.work = ideal
            .clamp(0.5 * self.work, 4.0 * self.work)
            .max(LEAST_WORK);
    }
}

/// Why a batch came to no end.
pub(super) enum Stop {
    Asked,
    Fault(GpuError),
}

impl From<GpuError> for Stop {
    fn from(error: GpuError) -> Self {
        Self::Fault(error)
    }
}

/// Samples of a block of pixels, or of given rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) seed: u64,
    pub(super) batch: u32,
    /// Samples of each in the batch.
    pub(super) samples: u32,
    pub(super) first_pixel: u32,
    pub(super) pixels: u32,
    /// Of rays what keys their numbers, and the number of the first.
    pub(super) rays: (u32, u32),
}

/// The kernels of a scene on the device.
pub(super) struct Dispatches<'a> {
    pub(super) loaded: Loaded<'a>,
    kernels: Vec<Kernel>,
    max_events: u32,
    pub(super) work: Work,
}

impl<'a> Dispatches<'a> {
    /// The kernels that `selection` needs; their text goes through `edit`.
    ///
    /// # Errors
    /// A fault of the device or of the shaders.
    pub(super) fn new(
        loaded: Loaded<'a>,
        selection: &Selection,
        edit: Edit<'_>,
    ) -> Result<Self, GpuError> {
        let mut kernels = Vec::new();
        if loaded.has_lamps {
            kernels.push(Kernel::new(&loaded, "kernels/lamps", edit)?);
        }
        if selection.ambient {
            kernels.push(Kernel::new(&loaded, "kernels/ambient", edit)?);
        }
        Ok(Self {
            loaded,
            kernels,
            max_events: selection.max_events,
            work: Work::default(),
        })
    }

    /// The number of kernels.
    pub(super) fn kernels(&self) -> usize {
        self.kernels.len()
    }

    /// Whether `kernel` has made all samples of the first pixels: what a driver does to its lanes need not show otherwise.
    pub(super) fn check_completed(
        &self,
        kernel: usize,
        pixels: u32,
        samples: u32,
    ) -> Result<(), GpuError> {
        let completed = self.loaded.read_completed()?;
        let completed = &completed[..pixels as usize];
        if completed.iter().all(|&made| made == samples) {
            return Ok(());
        }
        let made = completed.iter().map(|&made| u64::from(made)).sum();
        Err(self.lost_samples(kernel, made, u64::from(pixels) * u64::from(samples)))
    }

    fn lost_samples(&self, kernel: usize, made: u64, wanted: u64) -> GpuError {
        GpuError::LostSamples {
            kernel: self.kernels[kernel].name,
            made,
            wanted,
        }
    }

    /// Number of pixels of the next dispatches, of `rest`: at least one sample each within the wanted time.
    pub(super) fn block(&self, kernel: usize, rest: u32) -> u32 {
        let wanted = (self.kernels[kernel].work as u32).next_multiple_of(WORKGROUP);
        wanted.min(self.loaded.lanes).min(rest)
    }

    /// All samples of a block of pixels; `stop` is asked before every dispatch.
    pub(super) fn run_block(
        &mut self,
        kernel: usize,
        block: &Block,
        stop: &dyn Fn() -> bool,
    ) -> Result<(), Stop> {
        let mut most = MOST_SAMPLES;
        let mut forced = false;
        // One sample a dispatch, and the halvings before: a kernel that needs more makes none.
        for _ in 0..2 * block.samples + MOST_SAMPLES {
            if stop() {
                return Err(Stop::Asked);
            }
            let dispatch = self.dispatch(kernel, block, most, forced);
            let start = Instant::now();
            let counters = self.loaded.run(&self.kernels[kernel].pipeline, &dispatch)?;
            let made = f64::from(block.pixels) * f64::from(dispatch.samples.min(block.samples));
            self.kernels[kernel].learn(made, start.elapsed());
            self.work.add_counters(bytemuck::cast(counters));
            if counters.unfinished == 0 {
                return Ok(());
            }
            if counters.exhausted > 0 {
                // A lane was cut off by a limit on loops: fewer samples at once, and in the end whatever one gives.
                forced = dispatch.samples == 1;
                most = (dispatch.samples / 2).max(1);
            }
        }
        let completed = self.loaded.read_completed()?;
        let made = completed.iter().map(|&made| u64::from(made)).sum();
        let wanted = u64::from(self.loaded.pixels) * u64::from(block.samples);
        Err(self.lost_samples(kernel, made, wanted).into())
    }

    /// The next samples of a block, at most `most` of each pixel.
    fn dispatch(&self, kernel: usize, block: &Block, most: u32, forced: bool) -> Dispatch {
        let samples = self.kernels[kernel].work / f64::from(block.pixels);
        let (ray_key, first_ray) = block.rays;
        let batch = (block.batch, block.samples);
        Dispatch {
            first_pixel: block.first_pixel,
            pixel_count: block.pixels,
            samples: samples.clamp(1.0, f64::from(most)) as u32,
            forced: u32::from(forced),
            max_events: self.max_events,
            loop_probe: LOOP_PROBE,
            ray_key,
            first_ray,
            ..Dispatch::new(block.seed, batch, self.loaded.lanes, self.loaded.room)
        }
    }
}
