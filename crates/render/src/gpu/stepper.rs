//! A render in batches, for callers that look at the film while it fills and may leave at any moment.

use std::sync::atomic::AtomicBool;

use super::{Gpu, GpuError, render::Job};
use crate::{
    film::Film,
    integrator::{Plan, Progress},
    prepare::Prepared,
};

static NEVER: AtomicBool = AtomicBool::new(false);
static UNOBSERVED: fn(&Progress) = |_| {};

/// Adds batches of samples to a film, one at a time. The scene stays on the device between them.
pub struct Stepper<'a> {
    job: Job<'a>,
    batch: u32,
}

impl<'a> Stepper<'a> {
    /// A render of `scene` that has not begun. Of `plan` count the seed, the bounces and the dark lamps.
    ///
    /// # Errors
    /// The device fails or the scene does not fit.
    pub fn new(gpu: &'a Gpu, scene: &'a Prepared, plan: &'a Plan) -> Result<Self, GpuError> {
        Ok(Self {
            job: Job::new(gpu, scene, plan, &NEVER, &UNOBSERVED, &|text| text)?,
            batch: 0,
        })
    }

    /// Walks started at the camera so far.
    pub fn paths(&self) -> u64 {
        self.job.paths()
    }

    /// Adds a batch of `samples` samples per pixel to `film`; `stop` is asked before every dispatch. Returns whether
    /// it was added: one that was stopped leaves the film as it was and is made anew by the next step.
    ///
    /// # Errors
    /// The device fails.
    pub fn step(
        &mut self,
        film: &mut Film,
        samples: u32,
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, GpuError> {
        let added = self.job.add_batch(film, self.batch, samples.max(1), stop)?;
        if added {
            self.batch += 1;
        }
        Ok(added)
    }
}
