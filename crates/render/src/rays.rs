//! Radiance along given rays, from anywhere: what irradiance sensors and estimates of pictures are made of.

use std::sync::{Mutex, OnceLock, PoisonError};
use uw_media::Spectrum;

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
    engine: Engine<'a>,
    /// What takes over where limits of the others cut paths or their numbers do not hold the light.
    exact: OnceLock<Result<Box<Shared<'a>>, GpuError>>,
}

/// Where rays are traced.
enum Engine<'a> {
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
        // Where there is no daylight and nothing glows there are no tables for it, and nothing to trace.
        let selection = Selection {
            ambient: selection.ambient && scene.features.ambient(),
            ..selection.clone()
        };
        let processor = |precision| {
            Shared::new(scene, &selection, precision, Looks::AlongRays)
                .map(|shared| Engine::Processor(Box::new(shared)))
        };
        let engine = match device {
            Device::Cpu => processor(Precision::Double)?,
            Device::CpuSimd => processor(Precision::Single(Instructions::best()))?,
            Device::Gpu(gpu) => {
                let kernels = RayKernels::new(gpu, scene, &selection)?;
                Engine::Adapter(Box::new(Mutex::new(kernels)))
            }
        };
        Ok(Self {
            scene,
            selection,
            levels: levels(scene),
            engine,
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
            worker: match &self.engine {
                Engine::Processor(shared) => Worker::Processor(RayWorker::new(shared)),
                Engine::Adapter(kernels) => Worker::Adapter(kernels),
            },
            exact: None,
            rows: Vec::new(),
            sums: Vec::new(),
        }
    }
}

/// What traces the rays of a run.
enum Worker<'r, 'a> {
    Processor(RayWorker<'r>),
    Adapter(&'r Mutex<RayKernels<'a>>),
}

impl Worker<'_, '_> {
    fn most_rays(&self) -> usize {
        match self {
            Self::Processor(worker) => worker.most_rays(),
            Self::Adapter(_) => MOST_RAYS,
        }
    }

    fn run(
        &mut self,
        batch: &RayBatch,
        first: u32,
        rows: &[f64],
        sums: &mut [f64],
    ) -> Result<Work, GpuError> {
        match self {
            Self::Processor(worker) => Ok(worker.run(batch, first, rows, sums)),
            Self::Adapter(kernels) => {
                let mut kernels = kernels.lock().unwrap_or_else(PoisonError::into_inner);
                kernels.run(batch, first, rows, sums)
            }
        }
    }
}

/// The rows of a run's rays in `rows`: of their origin, then of a direction each.
fn rows_of<'v>(rows: &'v mut Vec<f64>, eye: DVec3, directions: &[DVec3]) -> &'v [f64] {
    rows.clear();
    for v in std::iter::once(&eye).chain(directions) {
        rows.extend([v.x, v.y, v.z, 0.0]);
    }
    rows
}

/// Traces rays on one thread.
pub struct RayTracer<'r, 'a> {
    rays: &'r Rays<'a>,
    worker: Worker<'r, 'a>,
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
        let eye = eye - self.rays.scene.camera.position_m;
        let most = self.worker.most_rays();
        let sums = self.sums.chunks_mut(most * words);
        let runs = sums.zip(directions.chunks(most));
        for ((sums, directions), first) in runs.zip((batch.first..).step_by(most)) {
            let rows = rows_of(&mut self.rows, eye, directions);
            let work = self.worker.run(batch, first, rows, sums)?;
            if work.cut_paths + work.lost_light > 0 {
                // The same samples once more, with room and numbers for all of their light.
                let mut exact = match self.exact.take() {
                    Some(worker) => worker,
                    None => RayWorker::new(self.rays.exact()?),
                };
                let most = exact.most_rays();
                let runs = sums.chunks_mut(most * words).zip(directions.chunks(most));
                for ((sums, directions), first) in runs.zip((first..).step_by(most)) {
                    sums.fill(0.0);
                    let rows = rows_of(&mut self.rows, eye, directions);
                    let work = exact.run(batch, first, rows, sums);
                    if work.lost_light > 0 {
                        let count = work.lost_light;
                        return Err(RenderError::LightLost { count });
                    }
                }
                self.exact = Some(exact);
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
    layers: &'a [Spectrum],
    levels: &'a [f64],
}

impl<'a> Light<'a> {
    /// Sun, sky and emission.
    pub fn ambient(self) -> Spectrum {
        self.layers[0]
    }

    /// Unscattered light of all sources at their levels.
    pub fn direct(self) -> Spectrum {
        self.layers[1]
    }

    /// Light of all sources at their levels that met no surface.
    pub fn backscatter(self) -> Spectrum {
        self.layers[2]
    }

    /// Each lamp at 100 %.
    pub fn lamps(self) -> &'a [Spectrum] {
        &self.layers[FIXED_LAYERS..]
    }

    /// All sources at their levels.
    pub fn total(self) -> Spectrum {
        let lit = self.lamps().iter().zip(self.levels);
        lit.fold(self.ambient(), |sum, (lamp, level)| {
            std::array::from_fn(|k| sum[k] + level * lamp[k])
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::Scene;

    const RAYS: usize = 700;
    const SCENE: &str = r#"
        format = "uw-scene/1"
        water = { a = [0.3, 0.1, 0.05], b = [0.2, 0.4, 0.6] }
        camera = { position_m = [0, 0, 0], forward = [1, 0, 0], hfov_deg = 60, width = 12, height = 8 }
        [[lamp]]
        position_m = [0.0, -0.3, 0.0]
        intensity = [1, 1, 1]
        [[object]]
        plane = { center_m = [1.5, 0, 0], normal = [-1, 0, 0], up = [0, 0, 1], size_m = [8, 8] }
        reflectance = [0.5, 0.4, 0.3]
    "#;

    /// Light that single precision counts as lost comes from double precision, for every ray of a run and not only for as
    /// many as one lane makes at once.
    #[test]
    fn light_that_single_precision_cannot_hold_is_that_of_double_precision() {
        let scene = Scene::parse(SCENE, Path::new("."), "test");
        let mut scene = scene.unwrap_or_else(|e| panic!("{e}"));
        scene.lamps[0].intensity = [1e33; 3];
        let prepared = Prepared::build(&scene);
        let selection = Selection::all(&prepared, false, 0);
        let camera = &prepared.camera;
        let directions: Vec<DVec3> = (0..RAYS)
            .map(|i| camera.direction(12.0 * i as f64 / RAYS as f64, 4.0))
            .collect();
        let batch = RayBatch {
            seed: 3,
            key: 1,
            batch: 0,
            first: 5,
        };
        let totals = |device: Device| -> Vec<Spectrum> {
            let rays = Rays::new(&device, &prepared, &selection).expect("few triangles");
            let mut tracer = rays.tracer();
            let lights = tracer.trace(&batch, camera.position_m, &directions);
            lights.expect("light").iter().map(Light::total).collect()
        };
        let [single, double] = [Device::CpuSimd, Device::Cpu].map(totals);
        assert!(double.iter().all(|light| light[0] > 1e30));
        assert_eq!(single, double);
    }
}
