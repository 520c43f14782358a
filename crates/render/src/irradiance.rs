//! Irradiance sensors: plane and scalar irradiances, and the radiance straight up, at depths below the surface.
//!
//! Radiance is estimated as in pictures, along directions drawn over the upper and the lower hemisphere. Light from
//! single directions (sun, point lamps) that arrives unscattered is added exactly.

mod beams;
mod directions;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use uw_media::Spectrum;

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    backend::Device,
    gpu::GpuError,
    integrator::{RenderError, ThreadsError, thread_pool},
    prepare::{Boundary, Prepared},
    rays::{RayBatch, RayTracer, Rays, Selection},
    sampling::{Draws, MAX_BATCH},
};
use beams::{Beam, unscattered_beams};
use directions::{Gaze, Lobes};

/// Independent batches that a sensor's standard errors come from, where there are enough samples.
const BATCHES: u32 = 64;

/// What to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct IrradiancePlan {
    /// Depths below the water surface, m, >= 0; 0 is just below it.
    pub depths_m: Vec<f64>,
    /// Directions per depth and hemisphere, and samples of the radiance straight up, >= 2. Rounded up to equal
    /// batches.
    pub samples: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Worker threads; `None` for one per core.
    pub threads: Option<usize>,
    /// Largest number of scatterings and reflections; 0 for no limit.
    pub max_bounces: u32,
}

/// A mean over batches and its standard error, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Mean.
    pub value: Spectrum,
    /// Standard error of the mean; 0 for what is known exactly.
    pub standard_error: Spectrum,
}

/// What the sensors of one depth measure. Irradiances in W/m².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthIrradiance {
    /// Depth below the surface, m.
    pub depth_m: f64,
    /// Downward plane irradiance, the unscattered sun included.
    pub e_d: Estimate,
    /// Upward plane irradiance.
    pub e_u: Estimate,
    /// Downward scalar irradiance, the unscattered sun included.
    pub e_od: Estimate,
    /// Upward scalar irradiance.
    pub e_ou: Estimate,
    /// Radiance that travels straight up, W/(m² sr).
    pub l_u: Estimate,
}

impl DepthIrradiance {
    /// The quantities by the names that tables use.
    pub fn quantities(&self) -> [(&'static str, Estimate); 5] {
        [
            ("E_d", self.e_d),
            ("E_u", self.e_u),
            ("E_od", self.e_od),
            ("E_ou", self.e_ou),
            ("L_u", self.l_u),
        ]
    }
}

/// Why irradiances could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum IrradianceError {
    /// Depths have no meaning.
    #[error(
        "the scene has no water surface that depths could be measured from: it needs [water] and [surface]"
    )]
    NoSurface,
    /// A depth that is no depth.
    #[error("depths must be finite and >= 0 m, got {0}")]
    Depth(f64),
    /// No depth at all, or more than there are random streams for.
    #[error("needs between 1 and {most} depths, got {got}")]
    Depths {
        /// Largest number.
        most: usize,
        /// Number asked for.
        got: usize,
    },
    /// Too few samples for a standard error.
    #[error("needs at least 2 samples, got {0}")]
    Samples(u32),
    /// The worker threads could not be started.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// The device cannot be used.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Rays could not be traced.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Stopped from outside.
    #[error("stopped before all samples were made")]
    Interrupted,
}

/// Largest number of depths.
const MOST_DEPTHS: usize = 1 << 20;

/// Measures on `device` at the camera's horizontal position and the depths of `plan`. `cancel` stops it; `observe` is told
/// the share of the work that is done, from the workers.
///
/// # Errors
/// A scene without a surface, a plan that makes no sense, a device that fails, or stopped.
pub fn measure(
    device: &Device,
    scene: &Prepared,
    plan: &IrradiancePlan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(f64) + Sync),
) -> Result<Vec<DepthIrradiance>, IrradianceError> {
    let boundary = check(scene, plan)?;
    let pool = thread_pool(plan.threads)?;
    let selection = Selection::all(scene, false, plan.max_bounces);
    let job = Measurement {
        scene,
        plan,
        boundary,
        rays: Rays::new(device, scene, &selection)?,
        lobes: Lobes::new(scene),
        batches: BATCHES
            .min(plan.samples)
            .max(plan.samples.div_ceil(MAX_BATCH)),
        cancel,
        observe,
        done: AtomicU64::new(0),
    };
    pool.install(|| job.run())
}

fn check(scene: &Prepared, plan: &IrradiancePlan) -> Result<Boundary, IrradianceError> {
    let boundary = scene.boundary.ok_or(IrradianceError::NoSurface)?;
    if plan.depths_m.is_empty() || plan.depths_m.len() > MOST_DEPTHS {
        return Err(IrradianceError::Depths {
            most: MOST_DEPTHS,
            got: plan.depths_m.len(),
        });
    }
    let is_depth = |z: &f64| z.is_finite() && *z >= 0.0;
    if let Some(&bad) = plan.depths_m.iter().find(|z| !is_depth(z)) {
        return Err(IrradianceError::Depth(bad));
    }
    if plan.samples < 2 {
        return Err(IrradianceError::Samples(plan.samples));
    }
    Ok(boundary)
}

/// Mean over a batch of directions: weighted by the cosine against the vertical, and unweighted.
#[derive(Clone, Copy, Debug, Default)]
struct DirectionMean {
    plane: Spectrum,
    scalar: Spectrum,
}

struct Measurement<'a> {
    scene: &'a Prepared,
    plan: &'a IrradiancePlan,
    boundary: Boundary,
    rays: Rays<'a>,
    lobes: Lobes<'a>,
    batches: u32,
    cancel: &'a AtomicBool,
    observe: &'a (dyn Fn(f64) + Sync),
    done: AtomicU64,
}

impl Measurement<'_> {
    fn run(&self) -> Result<Vec<DepthIrradiance>, IrradianceError> {
        let tasks = self.plan.depths_m.len() * Gaze::ALL.len() * self.batches as usize;
        let means: Result<Vec<DirectionMean>, IrradianceError> = (0..tasks)
            .into_par_iter()
            .map_init(
                || self.rays.tracer(),
                |tracer, task| {
                    let mean = self.batch(tracer, task)?;
                    let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
                    (self.observe)(done as f64 / tasks as f64);
                    Ok(mean)
                },
            )
            .collect();
        let means = means?;
        let per_gaze: Vec<&[DirectionMean]> = means.chunks(self.batches as usize).collect();
        let depths = self
            .plan
            .depths_m
            .iter()
            .zip(per_gaze.chunks(Gaze::ALL.len()));
        Ok(depths
            .map(|(&depth_m, gazes)| self.finish(depth_m, gazes))
            .collect())
    }

    fn point(&self, depth_m: f64) -> DVec3 {
        let mut point = self.scene.camera.position_m;
        point.z = self.boundary.height - depth_m;
        point
    }

    /// One batch of one gaze at one depth, in this order from the fastest.
    fn batch(
        &self,
        tracer: &mut RayTracer<'_, '_>,
        task: usize,
    ) -> Result<DirectionMean, IrradianceError> {
        if self.cancel.load(Ordering::Relaxed) {
            return Err(IrradianceError::Interrupted);
        }
        let batch = (task % self.batches as usize) as u32;
        let stream = task / self.batches as usize;
        let gaze = Gaze::ALL[stream % Gaze::ALL.len()];
        let point = self.point(self.plan.depths_m[stream / Gaze::ALL.len()]);
        let key = stream as u32;
        let size = self.plan.samples.div_ceil(self.batches);
        // A direction that leaves the hemisphere counts for nothing, and looks straight up.
        let drawn = (0..size).map(|index| {
            let choice = Draws::new(self.plan.seed, key, batch, index, 0);
            let (u, v) = (choice.leading(0), choice.leading(1));
            match self.lobes.draw(gaze, u, v) {
                Some((direction, density)) => (direction, 1.0 / (density * f64::from(size))),
                None => (DVec3::Z, 0.0),
            }
        });
        let (directions, weights): (Vec<DVec3>, Vec<f64>) = drawn.unzip();
        let batch = RayBatch {
            seed: self.plan.seed,
            key,
            batch,
            first: 0,
        };
        let lights = tracer.trace(&batch, point, &directions)?;
        let mut mean = DirectionMean::default();
        for (light, (direction, weight)) in lights.iter().zip(directions.iter().zip(&weights)) {
            let radiance = light.total();
            for k in 0..3 {
                mean.plane[k] += weight * direction.z.abs() * radiance[k];
                mean.scalar[k] += weight * radiance[k];
            }
        }
        Ok(mean)
    }

    fn finish(&self, depth_m: f64, gazes: &[&[DirectionMean]]) -> DepthIrradiance {
        let mut result = DepthIrradiance {
            depth_m,
            e_d: estimate(gazes[0], |m| m.plane),
            e_u: estimate(gazes[1], |m| m.plane),
            e_od: estimate(gazes[0], |m| m.scalar),
            e_ou: estimate(gazes[1], |m| m.scalar),
            l_u: estimate(gazes[2], |m| m.scalar),
        };
        for Beam {
            towards,
            irradiance,
        } in unscattered_beams(self.scene, self.point(depth_m))
        {
            let (plane, scalar) = if towards.z >= 0.0 {
                (&mut result.e_d, &mut result.e_od)
            } else {
                (&mut result.e_u, &mut result.e_ou)
            };
            for k in 0..3 {
                plane.value[k] += towards.z.abs() * irradiance[k];
                scalar.value[k] += irradiance[k];
            }
        }
        result
    }
}

/// Mean and standard error of at least two batches of equal size.
fn estimate(batches: &[DirectionMean], of: impl Fn(&DirectionMean) -> Spectrum) -> Estimate {
    let n = batches.len() as f64;
    let value = std::array::from_fn(|k| batches.iter().map(|b| of(b)[k]).sum::<f64>() / n);
    let standard_error = std::array::from_fn(|k| {
        let square: f64 = batches.iter().map(|b| (of(b)[k] - value[k]).powi(2)).sum();
        (square / (n * (n - 1.0))).sqrt()
    });
    Estimate {
        value,
        standard_error,
    }
}
