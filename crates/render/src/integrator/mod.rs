//! Stage 3: from the prepared scene to the film, on the processor.

pub(crate) mod coarse;
mod error;
pub mod first_hit;
mod plan;
mod rows;
pub mod stepper;
mod threads;

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use cpu_time::ProcessTime;

use crate::{
    film::Film,
    kernels::{GpuError, Selection},
    prepare::Prepared,
    snow::snow,
};
use coarse::CoarseFirst;
pub use error::RenderError;
pub use plan::{Plan, Progress, RenderStats};
use rows::{FirstBatch, RowRender};
pub use threads::ThreadsError;
pub(crate) use threads::thread_pool;

pub use crate::processor::Instructions;
use crate::processor::{Looks, Precision, Shared};

/// Renders `scene` by the kernels in double precision, a lane at a time: as exact as numbers are. `cancel` stops it;
/// `observe` is called from the workers after each row.
///
/// # Errors
/// No worker threads, stopped before every row had a sample, light that is no number, or scenes with more triangles than the
/// kernels can name.
pub fn render(
    scene: &Prepared,
    plan: &Plan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    render_in(Precision::Double, scene, plan, cancel, observe)
}

/// Renders `scene` by the kernels in single precision on the processor's vector units, a group of pixels at a time, with the
/// best instructions of this processor. `cancel` stops it; `observe` is called from the workers after each row.
///
/// # Errors
/// As in [`render`].
pub fn render_lanes(
    scene: &Prepared,
    plan: &Plan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    render_lanes_with(Instructions::best(), scene, plan, cancel, observe)
}

/// The same with `instructions`; in the place of those that this processor lacks are those of every processor.
///
/// # Errors
/// As in [`render`].
pub fn render_lanes_with(
    instructions: Instructions,
    scene: &Prepared,
    plan: &Plan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    let precision = Precision::Single(instructions);
    render_in(precision, scene, plan, cancel, observe)
}

/// What workers share for the light that `plan` asks for.
fn share<'a>(
    scene: &'a Prepared,
    plan: &Plan,
    precision: Precision,
) -> Result<Shared<'a>, GpuError> {
    let selection = Selection::all(scene, plan.dark_lamps, plan.max_bounces);
    Shared::new(scene, &selection, precision, Looks::ThroughPixels)
}

fn render_in(
    precision: Precision,
    scene: &Prepared,
    plan: &Plan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    let start = Instant::now();
    let shared = share(scene, plan, precision)?;
    let pool = thread_pool(plan.threads)?;
    let cpu_start = ProcessTime::now();
    let snow = pool.install(|| snow(scene, plan.dark_lamps, cancel));
    let setup_s = start.elapsed().as_secs_f64();
    let coarse = pool.install(|| CoarseFirst::begin(scene, plan, cancel, start))?;
    let mut job = RowRender::new(scene, plan, &shared, start, cancel, observe);
    let mut film = Film::new(scene.camera.width, scene.camera.height, scene.lamps.len());
    if let Some(coarse) = &coarse {
        job.first_batch = FirstBatch::Backed(coarse);
    }
    let in_time = |coarse: &CoarseFirst<'_>| coarse.leaves_time_for(precision.speed());
    if coarse.as_ref().is_none_or(in_time) {
        pool.install(|| job.run(&mut film));
    }
    let mut work = job.work();
    if let Some(coarse) = coarse {
        work.add(pool.install(|| coarse.complete(&mut film))?);
    }
    let complete = film.rows.iter().filter(|r| r.batches > 0).count();
    if complete < film.rows.len() && film.filled_pixels() == 0 {
        return Err(RenderError::Incomplete {
            rows: complete,
            total: film.rows.len(),
        });
    }
    if work.lost_light > 0 {
        return Err(RenderError::LightLost {
            count: work.lost_light,
        });
    }
    film.show_snow(snow.map(Arc::new));
    film.check_finite(&scene.lamp_names)?;
    let stats = RenderStats {
        adapter: precision.adapter(),
        threads: pool.current_num_threads(),
        setup_s,
        render_s: start.elapsed().as_secs_f64() - setup_s,
        cpu_s: cpu_start.elapsed().as_secs_f64(),
        interrupted: cancel.load(Ordering::Relaxed),
        ..RenderStats::of(precision.backend(), scene, plan, &film, work)
    };
    Ok((film, stats))
}
