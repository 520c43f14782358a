//! The mean of the image that looks up through the surface, from few paths.
//!
//! Such an image has no detail, but a peak where the sun stands. Its points are gathered in cells around the
//! sun's direction, narrow where the peak is steep, and the sensor sees each cell's mean radiance. The mean count
//! is freed of the bias that noise has behind the sensor's curve by the jackknife over independent groups.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use uw_render::integrator::RenderError;
use uw_render::prepare::Prepared;
use uw_render::rays::{Rays, Selection};
use uw_render::sampling::directions::frame;
use uw_render::scene::Scene;

use super::fields::GROUPS;
use super::paths::{self, DEVICE};
use super::response::CountResponse;

/// Rings around the sun's direction.
const RINGS: usize = 18;
/// Angle of the innermost ring, and the ratio from one ring to the next.
const FIRST_RING_RAD: f64 = 0.005;
const RING_RATIO: f64 = 1.4;
/// Sectors of a ring.
const SECTORS: usize = 6;
const CELLS: usize = RINGS * SECTORS;

/// Paths of an upward image, summed per group and cell.
#[derive(Clone, Debug, PartialEq)]
pub struct UpwardImage {
    /// Paths per group.
    pub samples_per_group: u32,
    /// Per group and cell: number of paths, sum of radiance in R, G, B.
    pub sums: Vec<[f64; 4]>,
}

/// Takes paths of an upward image.
pub struct UpwardSampler<'a> {
    prepared: &'a Prepared,
    rays: Rays<'a>,
    axes: [DVec3; 3],
    seed: u64,
    image: UpwardImage,
}

impl<'a> UpwardSampler<'a> {
    /// A sampler of `scene`, prepared.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] where the scene has more triangles than the kernels can name.
    pub fn new(scene: &Scene, prepared: &'a Prepared, seed: u64) -> Result<Self, RenderError> {
        let sun = towards_sun(scene);
        let (s, t) = frame(sun);
        let daylight = Selection {
            lamps: Vec::new(),
            ambient: true,
            max_events: u32::MAX,
        };
        Ok(Self {
            prepared,
            rays: Rays::new(&DEVICE, prepared, &daylight)?,
            axes: [sun, s, t],
            seed,
            image: UpwardImage {
                samples_per_group: 0,
                sums: vec![[0.0; 4]; GROUPS * CELLS],
            },
        })
    }

    /// Goes on to `samples_per_group` paths in every group.
    ///
    /// # Errors
    /// Light that is no number.
    pub fn extend_to(&mut self, samples_per_group: u32) -> Result<(), RenderError> {
        let mut tracer = self.rays.tracer();
        let camera = &self.prepared.camera;
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        let samples = self.image.samples_per_group..samples_per_group;
        for group in 0..GROUPS {
            for batch in paths::batches(self.seed, group as u32, samples.clone()) {
                let numbers = batch.numbers();
                let directions: Vec<DVec3> = numbers
                    .map(|(u, v)| camera.direction(u * width, v * height))
                    .collect();
                let lights = tracer.trace(&batch.key(), camera.position_m, &directions)?;
                for (light, &direction) in lights.iter().zip(&directions) {
                    let sum = &mut self.image.sums[group * CELLS + cell(&self.axes, direction)];
                    let radiance = light.ambient();
                    sum[0] += 1.0;
                    (0..3).for_each(|k| sum[k + 1] += radiance[k]);
                }
            }
        }
        self.image.samples_per_group = self.image.samples_per_group.max(samples_per_group);
        Ok(())
    }

    /// The image so far.
    pub fn image(&self) -> &UpwardImage {
        &self.image
    }
}

impl UpwardImage {
    /// Number of values in `sums`.
    pub const SUMS: usize = GROUPS * CELLS;

    /// Mean radiance over image and channels.
    pub fn mean_radiance(&self) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for s in &self.sums {
            sum += s[1] + s[2] + s[3];
            n += 3.0 * s[0];
        }
        sum / n
    }

    /// Mean count per channel at an exposure (linear signal per radiance), and its standard error.
    pub fn mean(&self, response: &CountResponse, exposure: f64) -> ([f64; 3], [f64; 3]) {
        let whole = self.mean_without(None, response, exposure);
        let parts: Vec<[f64; 3]> = (0..GROUPS)
            .map(|g| self.mean_without(Some(g), response, exposure))
            .collect();
        let n = GROUPS as f64;
        let mean_part: [f64; 3] =
            std::array::from_fn(|k| parts.iter().map(|p| p[k]).sum::<f64>() / n);
        let error = std::array::from_fn(|k| {
            let spread: f64 = parts.iter().map(|p| (p[k] - mean_part[k]).powi(2)).sum();
            ((n - 1.0) / n * spread).sqrt()
        });
        (
            std::array::from_fn(|k| n * whole[k] - (n - 1.0) * mean_part[k]),
            error,
        )
    }

    fn mean_without(
        &self,
        left_out: Option<usize>,
        response: &CountResponse,
        exposure: f64,
    ) -> [f64; 3] {
        let (mut sum, mut n) = ([0.0; 3], 0.0);
        for cell in 0..CELLS {
            let mut total = [0.0; 4];
            for group in (0..GROUPS).filter(|g| Some(*g) != left_out) {
                let s = &self.sums[group * CELLS + cell];
                (0..4).for_each(|i| total[i] += s[i]);
            }
            if total[0] > 0.0 {
                n += total[0];
                for k in 0..3 {
                    let signal = exposure * total[k + 1] / total[0];
                    sum[k] += total[0] * f64::from(response.at(signal as f32).0);
                }
            }
        }
        sum.map(|s| s / f64::max(n, 1.0))
    }
}

/// The direction in the water from which sunlight comes; straight up without a sun.
fn towards_sun(scene: &Scene) -> DVec3 {
    let (Some(sun), Some(water)) = (&scene.sun, &scene.water) else {
        return DVec3::Z;
    };
    let refracts = scene.surface.is_some_and(|s| s.refractive);
    let index = if refracts {
        water.refractive_index
    } else {
        1.0
    };
    let (x, y) = (
        -sun.travel_direction.x / index,
        -sun.travel_direction.y / index,
    );
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

fn cell(axes: &[DVec3; 3], direction: DVec3) -> usize {
    let angle = direction.dot(axes[0]).clamp(-1.0, 1.0).acos();
    let ring = (angle / FIRST_RING_RAD).max(1.0).ln() / RING_RATIO.ln();
    let azimuth = direction.dot(axes[2]).atan2(direction.dot(axes[1]));
    let sector = ((azimuth + PI) / TAU * SECTORS as f64) as usize;
    (ring as usize).min(RINGS - 1) * SECTORS + sector.min(SECTORS - 1)
}
