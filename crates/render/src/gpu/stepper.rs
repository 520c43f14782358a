//! A render in batches, for callers that look at the film while it fills and may leave at any moment. The film stays on
//! the adapter until it is asked for.

use std::sync::atomic::AtomicBool;

use super::{Gpu, Look, Statistics, held::Held, render::Batches};
use crate::{
    film::Film,
    integrator::{Plan, Progress},
    kernels::{GpuError, levels},
    prepare::Prepared,
};

static NEVER: AtomicBool = AtomicBool::new(false);
static UNOBSERVED: fn(&Progress) = |_| {};

/// Adds batches of samples to a film on the adapter, one at a time. The scene stays there too.
pub struct AdapterStepper<'a> {
    job: Batches<'a>,
    held: Held<'a>,
}

impl<'a> AdapterStepper<'a> {
    /// A render of `scene` that has not begun. Of `plan` count the seed, the bounces and the dark lamps.
    ///
    /// # Errors
    /// The device fails or the scene does not fit.
    pub fn new(gpu: &'a Gpu, scene: &'a Prepared, plan: &'a Plan) -> Result<Self, GpuError> {
        let job = Batches::new(gpu, scene, plan, &NEVER, &UNOBSERVED, &|text| text)?;
        let size_px = [scene.camera.width, scene.camera.height];
        let held = Held::new(gpu, size_px, job.batch_film(), &levels(scene))?;
        Ok(Self { job, held })
    }

    /// Walks started at the camera so far.
    pub fn paths(&self) -> u64 {
        self.job.paths()
    }

    /// Samples per pixel so far.
    pub fn samples(&self) -> u64 {
        self.held.counts().0
    }

    /// Adds a batch of `samples` samples per pixel; `stop` is asked before every dispatch. Returns whether it was
    /// added: one that was stopped leaves the film as it was and is made anew by the next step.
    ///
    /// # Errors
    /// The device fails.
    pub fn step(&mut self, samples: u32, stop: &dyn Fn() -> bool) -> Result<bool, GpuError> {
        let samples = samples.max(1);
        let (_, batch) = self.held.counts();
        let made = self.job.make_batch(batch, samples, stop)?;
        if made {
            self.held.add(samples);
        }
        Ok(made)
    }

    /// Mean and error of the film; little is read back for them.
    ///
    /// # Errors
    /// The device fails.
    pub fn statistics(&self) -> Result<Statistics, GpuError> {
        self.held.statistics()
    }

    /// Writes the picture to a texture of [`Gpu::texture`] that has the size of the film. Nothing is read back; what is
    /// submitted to the device's queue later sees it.
    ///
    /// # Errors
    /// The device fails.
    pub fn show(&self, look: &Look, texture: &wgpu::Texture) -> Result<(), GpuError> {
        self.held.show(look, texture)
    }

    /// The film, read back with all its layers.
    ///
    /// # Errors
    /// The device fails.
    pub fn film(&self) -> Result<Film, GpuError> {
        self.held.read()
    }

    /// The radiance of each pixel, W/(m² sr), read back without the layers.
    ///
    /// # Errors
    /// The device fails.
    pub fn radiance(&self) -> Result<Vec<[f32; 3]>, GpuError> {
        self.held.read_radiance()
    }
}
