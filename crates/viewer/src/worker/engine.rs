//! One stage of a render on either backend.

use uw_render::{
    film::Film,
    gpu::{self, Gpu, GpuError},
    integrator::{Plan, stepper::Stepper},
    prepare::Prepared,
};

/// Adds samples to a film.
pub enum Engine<'a> {
    /// On the processor.
    Cpu {
        /// The threads.
        pool: &'a rayon::ThreadPool,
        /// The render.
        stepper: Stepper<'a>,
    },
    /// On a graphics adapter.
    Gpu(Box<gpu::Stepper<'a>>),
}

impl<'a> Engine<'a> {
    /// A render of `scene` that has not begun.
    ///
    /// # Errors
    /// The graphics adapter refuses the scene.
    pub fn new(
        scene: &'a Prepared,
        plan: &'a Plan,
        pool: &'a rayon::ThreadPool,
        gpu: Option<&'a Gpu>,
    ) -> Result<Self, GpuError> {
        Ok(match gpu {
            None => Self::Cpu {
                pool,
                stepper: Stepper::new(scene, plan),
            },
            Some(gpu) => Self::Gpu(Box::new(gpu::Stepper::new(gpu, scene, plan)?)),
        })
    }

    /// An empty film.
    pub fn film(&self, scene: &Prepared) -> Film {
        Film::new(scene.camera.width, scene.camera.height, scene.lamps.len())
    }

    /// Adds a batch of `samples` samples per pixel, or what is missing of the last one. Returns whether it is complete.
    /// `leave` ends it for good, `pause` where it can go on later without loss: on the processor.
    ///
    /// # Errors
    /// The graphics adapter fails.
    pub fn step(
        &mut self,
        film: &mut Film,
        samples: u32,
        leave: &(dyn Fn() -> bool + Sync),
        pause: &(dyn Fn() -> bool + Sync),
    ) -> Result<bool, GpuError> {
        match self {
            Self::Cpu { pool, stepper } => {
                let stop = || leave() || pause();
                Ok(pool.install(|| stepper.step(film, samples, &stop)))
            }
            Self::Gpu(stepper) => stepper.step(film, samples, leave),
        }
    }

    /// Walks started at the camera so far.
    pub fn paths(&self) -> u64 {
        match self {
            Self::Cpu { stepper, .. } => stepper.paths(),
            Self::Gpu(stepper) => stepper.paths(),
        }
    }
}
