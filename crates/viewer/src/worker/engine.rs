//! One stage of a render on either backend, with its film.

use std::borrow::Cow;
use std::sync::Arc;

use uw_render::{
    backend::Device,
    film::{Film, NotFinite},
    gpu::{self, Gpu, GpuError, Statistics},
    integrator::{Plan, stepper::Stepper},
    prepare::Prepared,
    snow::SnowLayers,
};

use super::{View, textures::Textures};
use crate::model::display::{self, Shown};

/// Adds samples to a film and shows it.
pub enum Engine<'a> {
    /// On the processor.
    Cpu {
        /// The threads.
        pool: &'a rayon::ThreadPool,
        /// The render.
        stepper: Box<Stepper<'a>>,
        /// What it has made.
        film: Film,
    },
    /// On a graphics adapter, where the film lies too.
    Gpu {
        /// The adapter.
        gpu: &'a Gpu,
        /// The render.
        stepper: Box<gpu::AdapterStepper<'a>>,
        /// Of the film as it is.
        statistics: Statistics,
        /// Marine snow that is shown with it.
        snow: Option<Arc<SnowLayers>>,
    },
}

impl<'a> Engine<'a> {
    /// A render of `scene` that has not begun.
    ///
    /// # Errors
    /// The kernels or the graphics adapter refuse the scene.
    pub fn new(
        scene: &'a Prepared,
        plan: &'a Plan,
        pool: &'a rayon::ThreadPool,
        device: &'a Device,
    ) -> Result<Self, GpuError> {
        let on_processor = |stepper: Stepper<'a>| Self::Cpu {
            pool,
            film: stepper.film(),
            stepper: Box::new(stepper),
        };
        Ok(match device {
            Device::Cpu => on_processor(Stepper::new(scene, plan)?),
            Device::CpuSimd => on_processor(Stepper::on_lanes(scene, plan)?),
            Device::Gpu(gpu) => Self::Gpu {
                gpu,
                stepper: Box::new(gpu::AdapterStepper::new(gpu, scene, plan)?),
                statistics: Statistics::default(),
                snow: None,
            },
        })
    }

    /// Adds a batch of `samples` samples per pixel, or what is missing of the last one. Returns whether it is complete.
    /// `leave` ends it for good, `pause` where it can go on later without loss: on the processor.
    ///
    /// # Errors
    /// The graphics adapter fails.
    pub fn step(
        &mut self,
        samples: u32,
        leave: &(dyn Fn() -> bool + Sync),
        pause: &(dyn Fn() -> bool + Sync),
    ) -> Result<bool, GpuError> {
        match self {
            Self::Cpu {
                pool,
                stepper,
                film,
            } => {
                let stop = || leave() || pause();
                Ok(pool.install(|| stepper.step(film, samples, &stop)))
            }
            Self::Gpu {
                stepper,
                statistics,
                ..
            } => {
                let made = stepper.step(samples, leave)?;
                if made {
                    *statistics = stepper.statistics()?;
                }
                Ok(made)
            }
        }
    }

    /// Walks started at the camera so far.
    pub fn paths(&self) -> u64 {
        match self {
            Self::Cpu { stepper, .. } => stepper.paths(),
            Self::Gpu { stepper, .. } => stepper.paths(),
        }
    }

    /// Whether every pixel has a sample.
    pub fn is_complete(&self) -> bool {
        match self {
            Self::Cpu { film, .. } => film.rows.iter().all(|row| row.batches > 0),
            Self::Gpu { stepper, .. } => stepper.samples() > 0,
        }
    }

    /// Fewest samples per pixel.
    pub fn samples(&self) -> u64 {
        match self {
            Self::Cpu { film, .. } => film.samples(),
            Self::Gpu { stepper, .. } => stepper.samples(),
        }
    }

    /// Whether every pixel has as many samples.
    pub fn is_even(&self) -> bool {
        match self {
            Self::Cpu { film, .. } => {
                let samples = film.samples();
                film.rows.iter().all(|row| row.samples == samples)
            }
            Self::Gpu { .. } => true,
        }
    }

    /// Tells the film from what it was before.
    pub fn mark(&self) -> u64 {
        match self {
            Self::Cpu { film, .. } => film.rows.iter().map(|row| row.samples).sum(),
            Self::Gpu { stepper, .. } => stepper.samples(),
        }
    }

    /// Estimated relative error, once it is known.
    pub fn relative_error(&self) -> Option<f64> {
        match self {
            Self::Cpu { film, .. } => film.relative_error(),
            Self::Gpu { statistics, .. } => statistics.relative_error,
        }
    }

    /// Whether every radiance is a finite number. Kernels leave out light that is not.
    ///
    /// # Errors
    /// The first pixel that is not; `lamp_names` are those of the scene.
    pub fn check_finite(&self, lamp_names: &[String]) -> Result<(), NotFinite> {
        match self {
            Self::Cpu { film, .. } => film.check_finite(lamp_names),
            Self::Gpu { .. } => Ok(()),
        }
    }

    /// Shows marine snow from now on, or none.
    pub fn show_snow(&mut self, layers: Option<Arc<SnowLayers>>) {
        match self {
            Self::Cpu { film, .. } => film.show_snow(layers),
            Self::Gpu { snow, .. } => *snow = layers,
        }
    }

    /// The film with all its layers, on the host.
    ///
    /// # Errors
    /// The graphics adapter fails.
    pub fn film(&self) -> Result<Cow<'_, Film>, GpuError> {
        Ok(match self {
            Self::Cpu { film, .. } => Cow::Borrowed(film),
            Self::Gpu { stepper, snow, .. } => {
                let mut film = stepper.film()?;
                film.show_snow(snow.clone());
                Cow::Owned(film)
            }
        })
    }

    /// The picture as `view` wants it. On the adapter of the window it stays there, where that can make it.
    ///
    /// # Errors
    /// The graphics adapter fails.
    pub fn show(
        &self,
        scene: &Prepared,
        view: &View,
        pool: &rayon::ThreadPool,
        textures: &mut Textures,
    ) -> Result<Shown, GpuError> {
        match self {
            Self::Gpu {
                gpu,
                stepper,
                statistics,
                snow: None,
            } if gpu.is_shared()
                && !view.on_host
                && display::is_photograph(&view.display, &view.sensor, scene.lamps.len()) =>
            {
                let size_px = [scene.camera.width, scene.camera.height];
                let sensor = view.sensor.set_for(statistics.mean);
                let texture = textures.take(gpu, size_px)?;
                stepper.show(&display::look(&sensor), &texture)?;
                let radiance = if view.probing {
                    stepper.radiance()?
                } else {
                    Vec::new()
                };
                Ok(Shown::on_adapter(texture, radiance, sensor))
            }
            _ => {
                let film = self.film()?;
                Ok(pool.install(|| display::compose(scene, &film, &view.display, &view.sensor)))
            }
        }
    }
}
