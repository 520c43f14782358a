//! Renders a picture as two halves with independent random numbers and denoises it.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::{Half, denoise};
use crate::backend::Device;
use crate::film::Film;
use crate::integrator::{Plan, Progress, RenderError, RenderStats, ThreadsError, thread_pool};
use crate::prepare::Prepared;

/// What the second half's seed differs in.
const OTHER_HALF: u64 = 0x9e37_79b9_7f4a_7c15;
/// Share of a time limit that is left for the denoising.
const RESERVE: f64 = 0.2;

/// Why there is no denoised picture.
#[derive(Debug, thiserror::Error)]
pub enum DenoiseError {
    /// The samples cannot be halved.
    #[error(
        "denoising compares two halves of the samples: their number per pixel must be even and at least 2, got {samples}"
    )]
    Samples {
        /// Samples per pixel asked for.
        samples: u32,
    },
    /// Nothing but an error would end the render, which denoising changes.
    #[error(
        "denoising needs a number of samples or a time limit; a target error is one of the picture before it"
    )]
    Endless,
    /// The time did not last.
    #[error(
        "the time did not last for two samples of every pixel, which denoising needs; give more time or a smaller picture"
    )]
    TooShort,
    /// A half could not be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
}

impl From<ThreadsError> for DenoiseError {
    fn from(error: ThreadsError) -> Self {
        Self::Render(error.into())
    }
}

/// Renders `plan` on `device` as two halves and shows their denoised layers in the film of both; with `sources` those of
/// daylight and of each lamp too.
///
/// # Errors
/// A plan that cannot be halved, a time limit that is too short, and those of [`Device::render`].
pub fn render(
    device: &Device,
    scene: &Prepared,
    plan: &Plan,
    sources: bool,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), DenoiseError> {
    let start = Instant::now();
    let first = first_half(plan)?;
    let twice = |progress: &Progress, done: u64| Progress {
        rows_done: progress.rows_done + done,
        rows_total: progress.rows_total.map(|total| 2 * total),
        elapsed: start.elapsed(),
    };
    let (film, mut stats) = device.render(scene, &first, cancel, &|progress| {
        observe(&twice(progress, 0))
    })?;
    if film.filled_pixels() > 0 {
        return Err(DenoiseError::TooShort);
    }
    let done = film.rows.iter().map(|row| u64::from(row.batches)).sum();
    let second = Plan {
        samples_per_pixel: u32::try_from(film.samples()).ok(),
        time_limit: None,
        ..other_half(&first)
    };
    let (other, more) = device.render(scene, &second, cancel, &|progress| {
        observe(&twice(progress, done))
    })?;
    let pool = thread_pool(plan.threads)?;
    let batches = [batches(&first, &film), batches(&second, &other)];
    let halves = [
        Half {
            film: &film,
            seed: first.seed,
            batches: &batches[0],
        },
        Half {
            film: &other,
            seed: second.seed,
            batches: &batches[1],
        },
    ];
    // What was rendered until an interruption is denoised too.
    let never = AtomicBool::new(false);
    let film = pool
        .install(|| denoise(scene, halves, sources, &never))
        .ok_or(DenoiseError::TooShort)?;
    add(&mut stats, &more, &film);
    stats.denoised = film.denoised().map(|denoised| denoised.facts);
    stats.relative_error = stats.denoised.map(|facts| facts.relative_error);
    film.check_finite(&scene.lamp_names)
        .map_err(RenderError::from)?;
    stats.render_s = start.elapsed().as_secs_f64() - stats.setup_s;
    Ok((film, stats))
}

/// The plan of the second half of the samples, where `first` is that of the first.
pub fn other_half(first: &Plan) -> Plan {
    Plan {
        seed: first.seed ^ OTHER_HALF,
        ..first.clone()
    }
}

/// Samples per pixel of the batches that `plan` has made of `film`.
fn batches(plan: &Plan, film: &Film) -> Vec<u32> {
    let count = film.rows.iter().map(|row| row.batches).max();
    let mut done = 0;
    let of = |batch| {
        let samples = plan.next_batch(batch, done)?;
        done += samples;
        Some(samples)
    };
    (0..count.unwrap_or(0)).map_while(of).collect()
}

fn first_half(plan: &Plan) -> Result<Plan, DenoiseError> {
    let samples_per_pixel = match plan.samples_per_pixel {
        Some(samples) if samples < 2 || samples % 2 == 1 => {
            return Err(DenoiseError::Samples { samples });
        }
        None if plan.time_limit.is_none() => return Err(DenoiseError::Endless),
        samples => samples.map(|samples| samples / 2),
    };
    Ok(Plan {
        samples_per_pixel,
        time_limit: plan
            .time_limit
            .map(|limit| limit.mul_f64(0.5 * (1.0 - RESERVE))),
        target_error: None,
        ..plan.clone()
    })
}

fn add(stats: &mut RenderStats, more: &RenderStats, film: &Film) {
    stats.samples_per_pixel = film.samples();
    stats.paths += more.paths;
    stats.path_vertices += more.path_vertices;
    stats.cut_paths = stats.cut_paths.saturating_add(more.cut_paths);
    stats.setup_s += more.setup_s;
    stats.cpu_s += more.cpu_s;
    stats.interrupted |= more.interrupted;
}
