//! Stage 3: from the prepared scene to the film.

pub(crate) mod coarse;
pub mod cpu;
pub mod first_hit;
mod lanes;
mod method;
pub mod sampling;
pub mod stepper;

use std::{
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
    time::{Duration, Instant},
};

use cpu_time::ProcessTime;
use rayon::prelude::*;
use serde::Serialize;
pub use uw_lanes::Instructions;

use crate::{
    film::{Film, NotFinite, Row},
    gpu::GpuError,
    prepare::{Needs, Prepared},
};
use coarse::CoarseFirst;
use cpu::{RowBatch, Selection, Work};
use lanes::Precision;
use method::{Method, RowWorker};

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
    /// Most neighbouring pixels of a row that share their daylight walks; 1 for none, so that the noise of every pixel
    /// is independent. Only on the CPU, and only where the water holds nothing but lamps.
    pub share_walks: u32,
}

impl Plan {
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
    /// Paths that were ended by a limit of the kernels, where there is no such limit in the algorithm; 0 by the native path tracer.
    pub cut_paths: u32,
    /// Preparation, s.
    pub setup_s: f64,
    /// Rendering, s of wall time.
    pub render_s: f64,
    /// Rendering, s of processor time.
    pub cpu_s: f64,
    /// Estimated relative error; none below two batches.
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
    /// Most neighbouring pixels that shared walks; 1 where the noise of every pixel is independent.
    pub share_walks: u32,
    /// What the scene makes use of.
    pub needs: Needs,
    /// What was skipped.
    pub skipped: Vec<&'static str>,
}

/// Why a render could not be made.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The worker threads could not be started.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// Stopped before every row had a sample.
    #[error("stopped after {rows} of {total} rows, before the picture was complete")]
    Incomplete {
        /// Rows finished.
        rows: usize,
        /// Rows in all.
        total: usize,
    },
    /// The GPU cannot be used.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The film holds values that are no numbers.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
    /// Kernels met light that is no number, or too much of it for single precision.
    #[error(
        "{count} contributions of light are no finite numbers of single precision; nothing of such a render can be used"
    )]
    LightLost {
        /// Number of contributions that were left out.
        count: u64,
    },
}

/// The worker threads could not be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start {threads} threads: {reason}")]
pub struct ThreadsError {
    /// Number asked for; 0 for one per core.
    pub threads: usize,
    /// What the system says.
    pub reason: String,
}

/// Worker threads; `None` for one per core.
pub(crate) fn thread_pool(threads: Option<usize>) -> Result<rayon::ThreadPool, ThreadsError> {
    let threads = threads.unwrap_or(0);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| ThreadsError {
            threads,
            reason: e.to_string(),
        })
}

/// Renders `scene` on the CPU. `cancel` stops it; `observe` is called from the workers after each row.
///
/// # Errors
/// No worker threads, or stopped before every row had a sample.
pub fn render(
    scene: &Prepared,
    plan: &Plan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    let start = Instant::now();
    let method = Method::native(scene, plan);
    render_rows(scene, plan, &method, start, cancel, observe)
}

/// Renders `scene` on the CPU's vector units: the kernels of the GPU backend, in single precision, a group of pixels at a
/// time, with the best instructions of this processor. Shares no walks. `cancel` stops it; `observe` is called from the
/// workers after each row.
///
/// # Errors
/// As in [`render`], and scenes with more triangles than the kernels can name.
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
/// As in [`render_lanes`].
pub fn render_lanes_with(
    instructions: Instructions,
    scene: &Prepared,
    plan: &Plan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    render_kernels(
        scene,
        plan,
        Precision::Single(instructions),
        cancel,
        observe,
    )
}

/// Renders `scene` by the kernels in double precision, a lane at a time: the same light transport as [`render_lanes`], as
/// exact as numbers are. Shares no walks. `cancel` stops it; `observe` is called from the workers after each row.
///
/// # Errors
/// As in [`render`].
pub fn render_exact(
    scene: &Prepared,
    plan: &Plan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    render_kernels(scene, plan, Precision::Double, cancel, observe)
}

fn render_kernels(
    scene: &Prepared,
    plan: &Plan,
    precision: Precision,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    let setup = Instant::now();
    let method = Method::kernels(scene, plan, precision)?;
    let setup_s = setup.elapsed().as_secs_f64();
    let (film, mut stats) = render_rows(scene, plan, &method, setup, cancel, observe)?;
    stats.setup_s = setup_s;
    stats.render_s -= setup_s;
    Ok((film, stats))
}

/// Renders row by row; the time counts from `start`.
fn render_rows(
    scene: &Prepared,
    plan: &Plan,
    method: &Method<'_>,
    start: Instant,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    let pool = thread_pool(plan.threads)?;
    let cpu_start = ProcessTime::now();
    let coarse = pool.install(|| CoarseFirst::begin(scene, plan, cancel, start));
    let mut job = Job::new(scene, plan, method, start, cancel, observe);
    let mut film = Film::new(scene.camera.width, scene.camera.height, scene.lamps.len());
    if let Some(coarse) = &coarse {
        job.first_batch = FirstBatch::Backed(coarse);
    }
    if coarse
        .as_ref()
        .is_none_or(|coarse| coarse.leaves_time_for(method.speed()))
    {
        pool.install(|| job.run(&mut film));
    }
    let (mut work, cut_paths, lost_light) = job.into_work();
    if let Some(coarse) = coarse {
        let done = pool.install(|| coarse.complete(&mut film));
        work.paths += done.paths;
        work.vertices += done.vertices;
    }
    let complete = film.rows.iter().filter(|r| r.batches > 0).count();
    if complete < film.rows.len() && film.filled_pixels() == 0 {
        return Err(RenderError::Incomplete {
            rows: complete,
            total: film.rows.len(),
        });
    }
    if lost_light > 0 {
        return Err(RenderError::LightLost { count: lost_light });
    }
    film.check_finite(&scene.lamp_names)?;
    let stats = RenderStats {
        seed: plan.seed,
        backend: method.backend(),
        adapter: method.adapter(),
        threads: pool.current_num_threads(),
        samples_per_pixel: film.samples(),
        paths: work.paths,
        path_vertices: work.vertices,
        cut_paths: u32::try_from(cut_paths).unwrap_or(u32::MAX),
        setup_s: 0.0,
        render_s: start.elapsed().as_secs_f64(),
        cpu_s: cpu_start.elapsed().as_secs_f64(),
        relative_error: film.relative_error(),
        filled_pixels: film.filled_pixels(),
        coarse_step_px: film.coarse().map(|(step, _)| step),
        coarse_samples: film.coarse().map(|(_, samples)| samples),
        interrupted: cancel.load(Ordering::Relaxed),
        share_walks: method.share_walks(),
        needs: scene.needs,
        skipped: scene.needs.skipped(),
    };
    Ok((film, stats))
}

/// The lamps and paths a plan needs.
pub(crate) fn select(scene: &Prepared, plan: &Plan) -> Selection {
    let shines = |i: &usize| {
        let lamp = &scene.lamps[*i];
        (plan.dark_lamps || lamp.level > 0.0) && lamp.intensity.iter().any(|&x| x > 0.0)
    };
    Selection {
        lamps: (0..scene.lamps.len()).filter(shines).collect(),
        ambient: scene.needs.ambient(),
        max_events: if plan.max_bounces == 0 {
            usize::MAX
        } else {
            plan.max_bounces as usize
        },
        share_walks: plan.share_walks,
    }
}

/// What becomes of the first batch where the time does not last for it.
enum FirstBatch<'a> {
    /// It is finished whatever the time, so that there is a picture.
    Whole,
    /// It ends with the time.
    InTime,
    /// It ends with the time, or where too little of it would be done by then: a coarse picture stands in for the rest.
    Backed(&'a CoarseFirst<'a>),
}

struct Job<'a> {
    scene: &'a Prepared,
    plan: &'a Plan,
    method: &'a Method<'a>,
    start: Instant,
    end: Option<Instant>,
    first_batch: FirstBatch<'a>,
    cancel: &'a AtomicBool,
    observe: &'a (dyn Fn(&Progress) + Sync),
    rows_done: AtomicU64,
    paths: AtomicU64,
    vertices: AtomicU64,
    cut_paths: AtomicU64,
    lost_light: AtomicU64,
}

impl<'a> Job<'a> {
    fn new(
        scene: &'a Prepared,
        plan: &'a Plan,
        method: &'a Method<'a>,
        start: Instant,
        cancel: &'a AtomicBool,
        observe: &'a (dyn Fn(&Progress) + Sync),
    ) -> Self {
        Self {
            scene,
            plan,
            method,
            start,
            end: plan.end(start),
            first_batch: FirstBatch::Whole,
            cancel,
            observe,
            rows_done: AtomicU64::new(0),
            paths: AtomicU64::new(0),
            vertices: AtomicU64::new(0),
            cut_paths: AtomicU64::new(0),
            lost_light: AtomicU64::new(0),
        }
    }

    /// Work done, paths that were cut and contributions of light that were no numbers.
    fn into_work(self) -> (Work, u64, u64) {
        let work = Work {
            paths: self.paths.into_inner(),
            vertices: self.vertices.into_inner(),
        };
        (
            work,
            self.cut_paths.into_inner(),
            self.lost_light.into_inner(),
        )
    }

    fn run(&self, film: &mut Film) {
        let mut batch = 0;
        let mut done = 0;
        while let Some(samples) = self.plan.next_batch(batch, done) {
            film.rows.par_iter_mut().enumerate().for_each_init(
                || self.method.worker(),
                |worker, (index, row)| {
                    if !self.leaves(batch) {
                        self.render_row(worker, index as u32, batch, samples, row);
                    }
                },
            );
            batch += 1;
            done += samples;
            if self.cancelled() || self.out_of_time() || self.plan.is_met_by(film) {
                return;
            }
        }
    }

    fn render_row(
        &self,
        worker: &mut RowWorker<'_>,
        index: u32,
        batch: u32,
        samples: u32,
        row: &mut Row,
    ) {
        let before = worker.work();
        let at = RowBatch {
            seed: self.plan.seed,
            row: index,
            batch,
            samples,
        };
        let complete = worker.add_row(at, row, &|| self.leaves(batch));
        let after = worker.work();
        for (sum, (after, before)) in [
            (&self.paths, (after.work.paths, before.work.paths)),
            (&self.vertices, (after.work.vertices, before.work.vertices)),
            (&self.cut_paths, (after.cut_paths, before.cut_paths)),
            (&self.lost_light, (after.lost_light, before.lost_light)),
        ] {
            sum.fetch_add(after - before, Ordering::Relaxed);
        }
        if !complete {
            return;
        }
        let rows_done = self.rows_done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.observe)(&Progress {
            rows_done,
            rows_total: self.plan.rows_total(self.scene.camera.height),
            elapsed: self.start.elapsed(),
        });
    }

    /// Whether to leave this batch as it is.
    fn leaves(&self, batch: u32) -> bool {
        let too_late = || match self.first_batch {
            FirstBatch::Whole if batch == 0 => false,
            FirstBatch::Backed(coarse) if batch == 0 => {
                let rows = self.rows_done.load(Ordering::Relaxed) as f64;
                coarse.is_hopeless(rows / f64::from(self.scene.camera.height))
            }
            _ => self.out_of_time(),
        };
        self.cancelled() || too_late()
    }

    fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    fn out_of_time(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }
}
