//! Renders of one view: daylight and lamps apart, each made clean by [`super::reconstruct`].

use std::sync::atomic::AtomicBool;

use cpu_time::ProcessTime;
use uw_render::film::{Film, FilmLayer};
use uw_render::image::Picture;
use uw_render::integrator::first_hit::first_hits;
use uw_render::integrator::{self, Plan, RenderError};
use uw_render::prepare::Prepared;
use uw_render::scene::{Scene, Sensor};

use super::reconstruct::{Channel, reconstruct};
use super::view::View;
use crate::error::EvalError;

/// Places per edge of a pixel at which the target's reflectance is looked up.
const SAMPLES_PER_SIDE: u32 = 3;

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Sun and sky.
    Daylight,
    /// All lamps at 100 %.
    Lamps,
}

/// How a view is rendered.
#[derive(Clone, Copy, Debug)]
pub struct Job<'a> {
    /// Samples per pixel: of the daylight, of the lamps.
    pub samples: [u32; 2],
    /// Seed.
    pub seed: u64,
    /// Threads; `None` for all cores.
    pub threads: Option<usize>,
    /// Stops the render.
    pub cancel: &'a AtomicBool,
}

impl Source {
    /// The scene with this light alone.
    fn alone(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        match self {
            Self::Daylight => scene.lamps.clear(),
            Self::Lamps => {
                scene.sun = None;
                scene.sky_radiance = [0.0; 3];
            }
        }
        scene
    }
}

impl Job<'_> {
    fn film(&self, scene: &Scene, source: Source) -> Result<Film, RenderError> {
        let plan = Plan {
            samples_per_pixel: Some(self.samples[source as usize]),
            threads: self.threads,
            dark_lamps: true,
            ..Plan::new(self.seed.wrapping_add(source as u64))
        };
        let prepared = Prepared::build(&source.alone(scene));
        let (film, stats) = integrator::render(&prepared, &plan, self.cancel, &|_| {})?;
        if stats.interrupted {
            let total = film.rows.len();
            return Err(RenderError::Incomplete { rows: 0, total });
        }
        Ok(film)
    }

    /// Standard deviation of the render of one source against that of the sensor's noise in the same picture: root of
    /// the ratio of the mean variances over pixels and channels. Infinite for a sensor without noise.
    pub fn noise_share(
        &self,
        scene: &Scene,
        source: Source,
        sensor: &Sensor,
    ) -> Result<f64, EvalError> {
        let film = self.film(scene, source)?;
        let (Some(noise), uw_render::scene::Exposure::Fixed(exposure)) =
            (sensor.noise, sensor.exposure)
        else {
            return Ok(f64::INFINITY);
        };
        let (total, variance) = (
            film.layer(FilmLayer::Total),
            film.layer(FilmLayer::Variance),
        );
        let of_render: f64 = variance
            .iter()
            .flatten()
            .map(|v| exposure * exposure * v)
            .sum();
        let of_sensor: f64 = total
            .iter()
            .flatten()
            .map(|radiance| noise.standard_deviation(exposure * radiance).powi(2))
            .sum();
        Ok((of_render / of_sensor).sqrt())
    }

    fn clean(
        &self,
        scene: &Scene,
        source: Source,
        reflectance: &[Channel; 3],
    ) -> Result<Picture, EvalError> {
        let film = self.film(scene, source)?;
        let (total, direct) = (film.layer(FilmLayer::Total), film.layer(FilmLayer::Direct));
        let channel = |values: &[[f64; 3]], k: usize| Channel {
            width: film.width as usize,
            values: values.iter().map(|v| v[k]).collect(),
        };
        let clean: [Channel; 3] = std::array::from_fn(|k| {
            reconstruct(&channel(&total, k), &channel(&direct, k), &reflectance[k])
        });
        Ok(Picture {
            width: film.width,
            height: film.height,
            data: (0..total.len())
                .map(|i| std::array::from_fn(|k| clean[k].values[i] as f32))
                .collect(),
        })
    }
}

/// Renders a view; the lamps of `scene` are at 100 %.
pub fn render_view(scene: &Scene, sensor: &Sensor, job: &Job) -> Result<View, EvalError> {
    let start = ProcessTime::now();
    let reflectance = reflectance(scene);
    let ambient = job.clean(scene, Source::Daylight, &reflectance)?;
    let lamps = job.clean(scene, Source::Lamps, &reflectance)?;
    let cost = (job.samples, start.elapsed().as_secs_f64());
    Ok(View::new(ambient, lamps, cost, sensor, job.seed))
}

/// Reflectance of what each pixel sees, averaged over the pixel; 0 where it sees no surface.
fn reflectance(scene: &Scene) -> [Channel; 3] {
    let mut fine = scene.clone();
    fine.water = None;
    fine.surface = None;
    fine.sun = None;
    fine.lamps.clear();
    let camera = &mut fine.camera;
    camera.width *= SAMPLES_PER_SIDE;
    camera.height *= SAMPLES_PER_SIDE;
    camera.focal_px *= f64::from(SAMPLES_PER_SIDE);
    camera.centre_px *= f64::from(SAMPLES_PER_SIDE);
    let hits = first_hits(&Prepared::build(&fine));
    let (width, height) = (scene.camera.width as usize, scene.camera.height as usize);
    let per_side = SAMPLES_PER_SIDE as usize;
    let share = 1.0 / (per_side * per_side) as f64;
    std::array::from_fn(|k| {
        let mut values = vec![0.0; width * height];
        for (i, hit) in hits.iter().enumerate() {
            let (x, y) = (i % (width * per_side), i / (width * per_side));
            values[y / per_side * width + x / per_side] += share * hit.reflectance[k];
        }
        Channel { width, values }
    })
}
