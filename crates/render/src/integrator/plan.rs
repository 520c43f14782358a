//! What to render, how far it is, and what it was.

use std::time::{Duration, Instant};

use serde::Serialize;

use crate::{
    denoise::DenoiseFacts,
    film::Film,
    kernels::Work,
    prepare::{Features, Prepared},
};

/// Most samples of a pixel between two updates of the film.
const LARGEST_BATCH: u32 = 16;
/// Fewest batches of a render with a known number of samples: the variance is estimated from them.
const FEWEST_BATCHES: u32 = 2;
/// Fewest batches before an estimated error ends a render.
const TRUSTED_BATCHES: u32 = 4;

/// What to render and when to stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Samples per pixel; `None` to go on until another criterion stops the render.
    pub samples_per_pixel: Option<u32>,
    /// Stop after this time, counted from the call. Where it does not last for a sample of every pixel, a coarse picture
    /// stands in for the rows without one, see [`RenderStats::filled_pixels`].
    pub time_limit: Option<Duration>,
    /// Stop when the estimated relative error is at most this.
    pub target_error: Option<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Worker threads; `None` for one per core.
    pub threads: Option<usize>,
    /// Largest number of scatterings and reflections; 0 for no limit.
    pub max_bounces: u32,
    /// Whether lamps at level 0 are rendered too, for their layers.
    pub dark_lamps: bool,
}

impl Plan {
    /// A render with `seed` that nothing ends, on all cores, of the lamps that shine, without a limit on bounces.
    pub fn new(seed: u64) -> Self {
        Self {
            samples_per_pixel: None,
            time_limit: None,
            target_error: None,
            seed,
            threads: None,
            max_bounces: 0,
            dark_lamps: false,
        }
    }

    /// Number of samples per pixel of the next batch; `None` when all are done.
    pub(crate) fn next_batch(&self, batch: u32, done: u32) -> Option<u32> {
        match self.samples_per_pixel {
            Some(all) => {
                let size = (all / FEWEST_BATCHES).clamp(1, LARGEST_BATCH);
                (done < all).then(|| size.min(all - done))
            }
            // Small batches first, for an early picture and an early estimate of its error.
            None => Some(if batch < TRUSTED_BATCHES {
                4
            } else {
                LARGEST_BATCH
            }),
        }
    }

    /// Rows of pixels over all batches, where the number of samples is known.
    pub(crate) fn rows_total(&self, height: u32) -> Option<u64> {
        let all = self.samples_per_pixel?;
        let size = (all / FEWEST_BATCHES).clamp(1, LARGEST_BATCH);
        Some(u64::from(all.div_ceil(size)) * u64::from(height))
    }

    /// When the time is over, for a render that began at `start`; none for a limit too long for a clock.
    pub(crate) fn end(&self, start: Instant) -> Option<Instant> {
        start.checked_add(self.time_limit?)
    }

    /// Whether `film` is as accurate as asked for.
    pub(crate) fn is_met_by(&self, film: &Film) -> bool {
        let enough = |target: f64| {
            film.rows.iter().all(|r| r.batches >= TRUSTED_BATCHES)
                && film.relative_error().is_some_and(|e| e <= target)
        };
        self.target_error.is_some_and(enough)
    }
}

/// How far a render is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Rows of pixels finished, over all batches.
    pub rows_done: u64,
    /// Rows of pixels in all, where the number of samples is known.
    pub rows_total: Option<u64>,
    /// Time since the start.
    pub elapsed: Duration,
}

/// Facts about a finished render.
#[derive(Clone, Debug, Serialize)]
pub struct RenderStats {
    /// Seed.
    pub seed: u64,
    /// "cpu", "cpu-simd" or "gpu".
    pub backend: &'static str,
    /// Name of the graphics adapter, or the instructions of the vector units; none for "cpu".
    pub adapter: Option<String>,
    /// Worker threads.
    pub threads: usize,
    /// Samples per pixel (the fewest over the rows; 0 where the time did not last for all of them).
    pub samples_per_pixel: u64,
    /// Walks started at the camera.
    pub paths: u64,
    /// Vertices of walks and bridges.
    pub path_vertices: u64,
    /// Paths that were ended by a limit of the kernels, where there is no such limit in the algorithm.
    pub cut_paths: u32,
    /// Preparation, s.
    pub setup_s: f64,
    /// Rendering, s of wall time.
    pub render_s: f64,
    /// Rendering, s of processor time.
    pub cpu_s: f64,
    /// Estimated relative error; none below two batches or four samples.
    pub relative_error: Option<f64>,
    /// Pixels without a sample of their own, because the time did not last: they show a coarse picture of the same view,
    /// and their `variance` is infinite. 0 in a picture that is what it should be.
    pub filled_pixels: u64,
    /// Width and height of the pixels of that coarse picture, pixels; none where no pixel shows it.
    pub coarse_step_px: Option<u32>,
    /// Samples per such pixel.
    pub coarse_samples: Option<u64>,
    /// Whether the render was stopped from outside.
    pub interrupted: bool,
    /// Neighbouring pixels that share walks: 1, the noise of every pixel is independent.
    pub share_walks: u32,
    /// What denoising came to; none where the picture is as it was rendered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub denoised: Option<DenoiseFacts>,
    /// What the scene makes use of.
    #[serde(rename = "needs")]
    pub features: Features,
    /// What was skipped.
    pub skipped: Vec<&'static str>,
}

impl RenderStats {
    /// Of a film by `backend`, on one thread, without the times.
    pub(crate) fn of(
        backend: &'static str,
        scene: &Prepared,
        plan: &Plan,
        film: &Film,
        work: Work,
    ) -> Self {
        Self {
            seed: plan.seed,
            backend,
            adapter: None,
            threads: 1,
            samples_per_pixel: film.samples(),
            paths: work.paths,
            path_vertices: work.vertices,
            cut_paths: u32::try_from(work.cut_paths).unwrap_or(u32::MAX),
            setup_s: 0.0,
            render_s: 0.0,
            cpu_s: 0.0,
            relative_error: film.relative_error(),
            filled_pixels: film.filled_pixels(),
            coarse_step_px: film.coarse().map(|(step, _)| step),
            coarse_samples: film.coarse().map(|(_, samples)| samples),
            interrupted: false,
            share_walks: 1,
            denoised: None,
            features: scene.features,
            skipped: scene.features.skipped(),
        }
    }
}
