//! Radiance along given rays, from anywhere: what irradiance sensors and estimates of pictures are made of.

use std::sync::{Mutex, OnceLock, PoisonError};

use glam::DVec3;

use crate::{
    backend::Device,
    gpu::RayKernels,
    integrator::{Instructions, RenderError},
    kernels::{GpuError, MOST_RAYS, Work, levels},
    prepare::Prepared,
    processor::{Looks, Precision, RayWorker, Shared},
};

pub use crate::kernels::{RayBatch, Selection};

/// Layers of a ray's light before those of the lamps: daylight, unscattered light, light that met no surface.
const FIXED_LAYERS: usize = 3;

/// A scene that is ready for rays.
pub struct Rays<'a> {
    scene: &'a Prepared,
    selection: Selection,
    levels: Vec<f64>,
    place: Place<'a>,
    /// What takes over where limits of the others cut paths or their numbers do not hold the light.
    exact: OnceLock<Result<Box<Shared<'a>>, GpuError>>,
}

/// Where rays are traced.
enum Place<'a> {
    Processor(Box<Shared<'a>>),
    /// All threads share the one adapter.
    Adapter(Box<Mutex<RayKernels<'a>>>),
}

impl<'a> Rays<'a> {
    /// Makes the tables for the light in `selection`, on `device`.
    ///
    /// # Errors
    /// The scene does not fit the device, or the device fails.
    pub fn new(
        device: &'a Device,
        scene: &'a Prepared,
        selection: &Selection,
    ) -> Result<Self, GpuError> {
        let processor = |precision| {
            Shared::new(scene, selection, precision, Looks::AlongRays)
                .map(|shared| Place::Processor(Box::new(shared)))
        };
        let place = match device {
            Device::Cpu => processor(Precision::Double)?,
            Device::CpuSimd => processor(Precision::Single(Instructions::best()))?,
            Device::Gpu(gpu) => {
                let kernels = RayKernels::new(gpu, scene, selection)?;
                Place::Adapter(Box::new(Mutex::new(kernels)))
            }
        };
        Ok(Self {
            scene,
            selection: selection.clone(),
            levels: levels(scene),
            place,
            exact: OnceLock::new(),
        })
    }

    /// The scene in double precision, made when it is first needed.
    fn exact(&self) -> Result<&Shared<'a>, GpuError> {
        let make = || {
            let looks = Looks::AlongRays;
            Shared::new(self.scene, &self.selection, Precision::Double, looks).map(Box::new)
        };
        let made = self.exact.get_or_init(make);
        made.as_deref().map_err(Clone::clone)
    }

    /// What traces rays on one thread.
    pub fn tracer(&self) -> RayTracer<'_, 'a> {
        RayTracer {
            rays: self,
            worker: match &self.place {
                Place::Processor(shared) => Some(RayWorker::new(shared)),
                Place::Adapter(_) => None,
            },
            exact: None,
            rows: Vec::new(),
            sums: Vec::new(),
        }
    }
}

/// Traces rays on one thread.
pub struct RayTracer<'r, 'a> {
    rays: &'r Rays<'a>,
    worker: Option<RayWorker<'r>>,
    exact: Option<RayWorker<'r>>,
    rows: Vec<f64>,
    sums: Vec<f64>,
}

impl RayTracer<'_, '_> {
    /// One sample of the radiance that arrives at the point `eye`, m, from each of the unit vectors `directions`, in their
    /// order. Of every ray in its batch the first two leading numbers ([`crate::sampling::Draws`] of stream 0) are free for
    /// the choice of its direction.
    ///
    /// # Errors
    /// The device fails, or light is no number.
    pub fn trace(
        &mut self,
        batch: &RayBatch,
        eye: DVec3,
        directions: &[DVec3],
    ) -> Result<Lights<'_>, RenderError> {
        let words = 3 * (FIXED_LAYERS + self.rays.levels.len());
        self.sums.clear();
        self.sums.resize(words * directions.len(), 0.0);
        let most = self.worker.as_ref().map_or(MOST_RAYS, RayWorker::most_rays);
        let eye = eye - self.rays.scene.camera.position_m;
        let sums = self.sums.chunks_mut(most * words);
        for ((sums, directions), first) in sums
            .zip(directions.chunks(most))
            .zip((batch.first..).step_by(most))
        {
            self.rows.clear();
            for v in std::iter::once(&eye).chain(directions) {
                self.rows.extend([v.x, v.y, v.z, 0.0]);
            }
            let work = match (&mut self.worker, &self.rays.place) {
                (Some(worker), _) => worker.run(batch, first, &self.rows, sums),
                (None, Place::Adapter(kernels)) => {
                    let mut kernels = kernels.lock().unwrap_or_else(PoisonError::into_inner);
                    kernels.run(batch, first, &self.rows, sums)?
                }
                (None, Place::Processor(_)) => Work::default(),
            };
            if work.cut_paths + work.lost_light == 0 {
                continue;
            }
            // The same samples once more, with room and numbers for all of their light.
            sums.fill(0.0);
            let mut exact = match self.exact.take() {
                Some(worker) => worker,
                None => RayWorker::new(self.rays.exact()?),
            };
            let work = exact.run(batch, first, &self.rows, sums);
            self.exact = Some(exact);
            if work.lost_light > 0 {
                return Err(RenderError::LightLost {
                    count: work.lost_light,
                });
            }
        }
        Ok(Lights {
            words,
            sums: &self.sums,
            levels: &self.rays.levels,
        })
    }
}

/// The light of rays.
#[derive(Clone, Copy, Debug)]
pub struct Lights<'a> {
    words: usize,
    sums: &'a [f64],
    levels: &'a [f64],
}

impl<'a> Lights<'a> {
    /// Of each ray.
    pub fn iter(self) -> impl Iterator<Item = Light<'a>> {
        self.sums.chunks_exact(self.words).map(move |sums| Light {
            layers: sums.as_chunks().0,
            levels: self.levels,
        })
    }
}

/// The light of a ray, W/(m² sr) per channel.
#[derive(Clone, Copy, Debug)]
pub struct Light<'a> {
    layers: &'a [[f64; 3]],
    levels: &'a [f64],
}

impl<'a> Light<'a> {
    /// Sun, sky and emission.
    pub fn ambient(self) -> [f64; 3] {
        self.layers[0]
    }

    /// Unscattered light of all sources at their levels.
    pub fn direct(self) -> [f64; 3] {
        self.layers[1]
    }

    /// Light of all sources at their levels that met no surface.
    pub fn backscatter(self) -> [f64; 3] {
        self.layers[2]
    }

    /// Each lamp at 100 %.
    pub fn lamps(self) -> &'a [[f64; 3]] {
        &self.layers[FIXED_LAYERS..]
    }

    /// All sources at their levels.
    pub fn total(self) -> [f64; 3] {
        let lit = self.lamps().iter().zip(self.levels);
        lit.fold(self.ambient(), |sum, (lamp, level)| {
            std::array::from_fn(|k| sum[k] + level * lamp[k])
        })
    }
}
