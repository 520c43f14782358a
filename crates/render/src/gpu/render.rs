//! A render as batches of dispatches.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant},
};

use cpu_time::ProcessTime;
use rayon::prelude::*;

use super::{
    Gpu, GpuError,
    layout::{Counters, Dispatch},
    pipeline::{Loaded, WORKGROUP},
    shaders::compose,
    upload::{Tables, Tracer},
};
use crate::{
    film::{BatchMean, Film},
    integrator::{
        Plan, Progress, RenderError, RenderStats, coarse::CoarseFirst, cpu::Selection, select,
        thread_pool,
    },
    prepare::Prepared,
};

/// Most samples of a pixel in a dispatch.
pub(super) const MOST_SAMPLES: u32 = 16;
/// Fewest samples of a dispatch: fewer leave most lanes idle, and a slow moment must not lead there.
const LEAST_WORK: f64 = 1024.0;
/// Work of the first dispatch, samples.
const FIRST_WORK: f64 = 2048.0;
/// Rounds of the loop at the end of a lane that tells whether its loops were cut.
const LOOP_PROBE: u32 = 3;

/// Renders `scene` on `gpu`. `cancel` stops it; `observe` is called after each dispatch that finishes rows.
///
/// # Errors
/// [`RenderError::Gpu`] when the device fails or the scene does not fit, [`RenderError::Incomplete`] when it is
/// stopped before every pixel has a sample.
pub fn render(
    gpu: &Gpu,
    scene: &Prepared,
    plan: &Plan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), RenderError> {
    render_edited(gpu, scene, plan, cancel, observe, &|text| text)
}

/// The same with kernels whose text has gone through `edit`; tests break them with it.
///
/// # Errors
/// As in [`render`].
pub(super) fn render_edited(
    gpu: &Gpu,
    scene: &Prepared,
    plan: &Plan,
    cancel: &AtomicBool,
    observe: &(dyn Fn(&Progress) + Sync),
    edit: &dyn Fn(String) -> String,
) -> Result<(Film, RenderStats), RenderError> {
    let setup = Instant::now();
    let cpu_start = ProcessTime::now();
    let mut job = Job::new(gpu, scene, plan, cancel, observe, edit)?;
    job.end = plan.end(setup);
    let setup_s = setup.elapsed().as_secs_f64();
    let pool = thread_pool(plan.threads)?;
    let coarse = pool.install(|| CoarseFirst::begin(scene, plan, cancel, setup));
    let mut film = Film::new(scene.camera.width, scene.camera.height, scene.lamps.len());
    job.run(&mut film, coarse.as_ref())?;
    if let Some(coarse) = coarse {
        let done = pool.install(|| coarse.complete(&mut film));
        job.work.paths += done.paths;
        job.work.vertices += done.vertices;
    }
    if film.samples() == 0 && film.filled_pixels() == 0 {
        return Err(RenderError::Incomplete {
            rows: 0,
            total: film.rows.len(),
        });
    }
    if job.work.lost_light > 0 {
        return Err(RenderError::LightLost {
            count: job.work.lost_light,
        });
    }
    film.check_finite(&scene.lamp_names)?;
    let stats = RenderStats {
        seed: plan.seed,
        backend: "gpu",
        adapter: Some(gpu.info().name.clone()),
        threads: 1,
        samples_per_pixel: film.samples(),
        paths: job.work.paths,
        path_vertices: job.work.vertices,
        cut_paths: u32::try_from(job.work.cut_paths).unwrap_or(u32::MAX),
        setup_s,
        render_s: setup.elapsed().as_secs_f64() - setup_s,
        cpu_s: cpu_start.elapsed().as_secs_f64(),
        relative_error: film.relative_error(),
        filled_pixels: film.filled_pixels(),
        coarse_step_px: film.coarse().map(|(step, _)| step),
        coarse_samples: film.coarse().map(|(_, samples)| samples),
        interrupted: cancel.load(Ordering::Relaxed),
        share_walks: 1,
        needs: scene.needs,
        skipped: scene.needs.skipped(),
    };
    Ok((film, stats))
}

/// Levels of the lamps, as fractions.
pub(crate) fn levels(scene: &Prepared) -> Vec<f64> {
    scene.lamps.iter().map(|lamp| lamp.level).collect()
}

/// A kernel and how fast it is.
struct Kernel {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
    /// Samples that a dispatch of the wanted length makes.
    work: f64,
    /// How long a dispatch should take.
    dispatch: Duration,
}

impl Kernel {
    fn new(
        loaded: &Loaded<'_>,
        name: &'static str,
        edit: &dyn Fn(String) -> String,
    ) -> Result<Self, GpuError> {
        let text = edit(compose(name)?);
        Ok(Self {
            name,
            pipeline: loaded.pipeline_of(name, &text)?,
            work: FIRST_WORK,
            dispatch: loaded.gpu.dispatch_time(),
        })
    }

    /// Learns from a dispatch that made `samples` samples in `elapsed`; by at most a factor of 4, because the first one
    /// holds the driver's compilation.
    fn learn(&mut self, samples: f64, elapsed: Duration) {
        let ideal = samples * self.dispatch.as_secs_f64() / elapsed.as_secs_f64().max(1e-6);
        self.work = ideal
            .clamp(0.5 * self.work, 4.0 * self.work)
            .max(LEAST_WORK);
    }
}

/// What all dispatches counted.
#[derive(Clone, Copy, Debug, Default)]
struct Work {
    paths: u64,
    vertices: u64,
    cut_paths: u64,
    /// Contributions of light that were left out because they were no finite numbers of single precision.
    lost_light: u64,
}

/// Why a batch came to no end.
enum Stop {
    Asked,
    Fault(GpuError),
}

impl From<GpuError> for Stop {
    fn from(error: GpuError) -> Self {
        Self::Fault(error)
    }
}

pub(super) struct Job<'a> {
    loaded: Loaded<'a>,
    scene: &'a Prepared,
    plan: &'a Plan,
    selection: Selection,
    cancel: &'a AtomicBool,
    observe: &'a (dyn Fn(&Progress) + Sync),
    start: Instant,
    /// When a render is to end.
    end: Option<Instant>,
    /// How long it takes to bring a batch from the device to the film.
    fetch: Duration,
    kernels: Vec<Kernel>,
    work: Work,
    /// Rows finished in earlier batches.
    rows_before: u64,
    /// Rows finished in the batch at work.
    rows_in_batch: u32,
}

impl<'a> Job<'a> {
    /// Uploads `scene` and makes the kernels that it needs; their text goes through `edit`.
    ///
    /// # Errors
    /// [`GpuError`] when the device fails or the scene does not fit.
    pub(super) fn new(
        gpu: &'a Gpu,
        scene: &'a Prepared,
        plan: &'a Plan,
        cancel: &'a AtomicBool,
        observe: &'a (dyn Fn(&Progress) + Sync),
        edit: &dyn Fn(String) -> String,
    ) -> Result<Self, GpuError> {
        let selection = select(scene, plan);
        gpu.check()?;
        let tables = Tables::build(scene, &selection.lamps, Tracer::Kernels)?;
        let loaded = Loaded::new(gpu, scene, &tables)?;
        let mut kernels = Vec::new();
        if !selection.lamps.is_empty() {
            kernels.push(Kernel::new(&loaded, "kernels/lamps", edit)?);
        }
        if selection.ambient {
            kernels.push(Kernel::new(&loaded, "kernels/ambient", edit)?);
        }
        Ok(Self {
            loaded,
            scene,
            plan,
            selection,
            cancel,
            observe,
            start: Instant::now(),
            end: None,
            fetch: Duration::ZERO,
            kernels,
            work: Work::default(),
            rows_before: 0,
            rows_in_batch: 0,
        })
    }

    /// Walks started at the camera so far.
    pub(super) fn paths(&self) -> u64 {
        self.work.paths
    }

    /// All batches. Where the time does not last for the first one, `coarse` stands in for what it lacks; without that it
    /// is finished whatever the time.
    fn run(&mut self, film: &mut Film, coarse: Option<&CoarseFirst<'_>>) -> Result<(), GpuError> {
        let cancel = self.cancel;
        let cancelled = || cancel.load(Ordering::Relaxed);
        let (mut batch, mut done) = (0, 0);
        while let Some(samples) = self.plan.next_batch(batch, done) {
            let (end, fetch) = (self.end, self.fetch);
            let late = || end.is_some_and(|end| Instant::now() + fetch >= end);
            let stop = |share: f64| {
                cancelled()
                    || match coarse {
                        Some(coarse) if batch == 0 => coarse.is_hopeless(share),
                        _ => batch > 0 && late(),
                    }
            };
            let rows = self.make_rows(batch, samples, &stop)?;
            if rows > 0 && !cancelled() {
                let start = Instant::now();
                self.add_to(film, rows, samples)?;
                self.fetch = start.elapsed();
            }
            if rows < film.rows.len() {
                return Ok(());
            }
            batch += 1;
            done += samples;
            if cancelled() || late() || self.plan.is_met_by(film) {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Makes batch number `batch` on the device; `stop` is asked before every dispatch, with the part of the batch that
    /// is done. Returns the number of rows that have it: of the first batch those that were finished, of later ones,
    /// which all rows are to have alike, all or none.
    fn make_rows(
        &mut self,
        batch: u32,
        samples: u32,
        stop: &dyn Fn(f64) -> bool,
    ) -> Result<usize, GpuError> {
        self.rows_in_batch = 0;
        match self.run_batch(batch, samples, stop) {
            Ok(()) => Ok(self.scene.camera.height as usize),
            Err(Stop::Asked) if batch == 0 => Ok(self.rows_in_batch as usize),
            Err(Stop::Asked) => Ok(0),
            Err(Stop::Fault(error)) => Err(error),
        }
    }

    /// Makes batch number `batch` on the device; `stop` is asked before every dispatch. Returns whether it was made:
    /// one that was stopped leaves nothing behind.
    pub(super) fn make_batch(
        &mut self,
        batch: u32,
        samples: u32,
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, GpuError> {
        match self.run_batch(batch, samples, &|_| stop()) {
            Ok(()) => Ok(true),
            Err(Stop::Asked) => Ok(false),
            Err(Stop::Fault(error)) => Err(error),
        }
    }

    /// Where the sums of a batch lie on the device.
    pub(super) fn batch_film(&self) -> &wgpu::Buffer {
        &self.loaded.film
    }

    /// All samples of one batch, of every kernel.
    fn run_batch(
        &mut self,
        batch: u32,
        samples: u32,
        stop: &dyn Fn(f64) -> bool,
    ) -> Result<(), Stop> {
        self.loaded.clear(false);
        let kernels = self.kernels.len();
        for kernel in 0..kernels {
            self.loaded.clear(true);
            let mut first_pixel = 0;
            while first_pixel < self.loaded.pixels {
                let count = self.block(kernel, first_pixel);
                let of_kernel = f64::from(first_pixel) / f64::from(self.loaded.pixels);
                let share = (kernel as f64 + of_kernel) / kernels as f64;
                let stop = || stop(share);
                self.run_block(kernel, (batch, samples), first_pixel, count, &stop)?;
                first_pixel += count;
                if kernel + 1 == kernels {
                    self.rows_in_batch = first_pixel / self.scene.camera.width;
                    self.report(self.rows_in_batch);
                }
            }
            self.check_completed(kernel, samples)?;
        }
        self.rows_before += u64::from(self.scene.camera.height);
        Ok(())
    }

    /// Whether `kernel` has made `samples` of every pixel: what a driver does to its lanes need not show otherwise.
    fn check_completed(&self, kernel: usize, samples: u32) -> Result<(), GpuError> {
        let completed = self.loaded.read_completed()?;
        let pixels = &completed[..self.loaded.pixels as usize];
        if pixels.iter().all(|&made| made == samples) {
            return Ok(());
        }
        Err(self.lost_samples(
            kernel,
            pixels.iter().map(|&made| u64::from(made)).sum(),
            samples,
        ))
    }

    fn lost_samples(&self, kernel: usize, made: u64, samples: u32) -> GpuError {
        GpuError::LostSamples {
            kernel: self.kernels[kernel].name,
            made,
            wanted: u64::from(self.loaded.pixels) * u64::from(samples),
        }
    }

    /// Number of pixels of the next dispatches: at least one sample each within the wanted time.
    fn block(&self, kernel: usize, first_pixel: u32) -> u32 {
        let rest = self.loaded.pixels - first_pixel;
        let wanted = (self.kernels[kernel].work as u32).next_multiple_of(WORKGROUP);
        wanted.min(self.loaded.lanes).min(rest)
    }

    /// All samples of a block of pixels.
    fn run_block(
        &mut self,
        kernel: usize,
        (batch, batch_samples): (u32, u32),
        first_pixel: u32,
        pixel_count: u32,
        stop: &dyn Fn() -> bool,
    ) -> Result<(), Stop> {
        let mut most = MOST_SAMPLES;
        let mut forced = false;
        // One sample a dispatch, and the halvings before: a kernel that needs more makes none.
        for _ in 0..2 * batch_samples + MOST_SAMPLES {
            if stop() {
                return Err(Stop::Asked);
            }
            let samples =
                (self.kernels[kernel].work / f64::from(pixel_count)).clamp(1.0, f64::from(most));
            let dispatch = Dispatch {
                seed_low: self.plan.seed as u32,
                seed_high: (self.plan.seed >> 32) as u32,
                batch,
                batch_samples,
                first_pixel,
                pixel_count,
                samples: samples as u32,
                forced: u32::from(forced),
                max_events: u32::try_from(self.selection.max_events).unwrap_or(u32::MAX),
                slots: self.loaded.room.slots,
                lanes: self.loaded.lanes,
                loop_probe: LOOP_PROBE,
                held: self.loaded.room.held,
                padding_1: 0,
                padding_2: 0,
                padding_3: 0,
            };
            let start = Instant::now();
            let counters = self.loaded.run(&self.kernels[kernel].pipeline, &dispatch)?;
            let made = f64::from(pixel_count) * f64::from(dispatch.samples.min(batch_samples));
            self.kernels[kernel].learn(made, start.elapsed());
            self.count(&counters);
            if counters.unfinished == 0 {
                return Ok(());
            }
            if counters.exhausted > 0 {
                // A lane was cut off by a limit on loops: fewer samples at once, and in the end whatever one gives.
                forced = dispatch.samples == 1;
                most = (dispatch.samples / 2).max(1);
            }
        }
        let completed = self.loaded.read_completed()?;
        let made = completed.iter().map(|&made| u64::from(made)).sum();
        Err(self.lost_samples(kernel, made, batch_samples).into())
    }

    fn count(&mut self, counters: &Counters) {
        self.work.paths += u64::from(counters.paths);
        self.work.vertices += u64::from(counters.vertices);
        self.work.cut_paths += u64::from(counters.cut_paths);
        self.work.lost_light += u64::from(counters.not_finite);
    }

    /// Adds the batch on the device to the first `rows` rows of `film`.
    pub(super) fn add_to(
        &self,
        film: &mut Film,
        rows: usize,
        samples: u32,
    ) -> Result<(), GpuError> {
        let values = self.loaded.read_film()?;
        let layers = self.loaded.film_layers as usize;
        let lamps = self.scene.lamps.len();
        let levels = levels(self.scene);
        let width = film.width as usize;
        let values = values.par_chunks(3 * layers * width);
        let rows = film.rows[..rows].par_iter_mut().zip(values);
        rows.for_each(|(row, values)| {
            for (column, pixel) in values.chunks_exact(3 * layers).enumerate() {
                let mean = BatchMean::of_sums(pixel, samples, &levels);
                row.add(column, lamps, &mean, samples);
            }
            row.finish_batch(samples);
        });
        Ok(())
    }

    fn report(&self, rows: u32) {
        (self.observe)(&Progress {
            rows_done: self.rows_before + u64::from(rows),
            rows_total: self.plan.rows_total(self.scene.camera.height),
            elapsed: self.start.elapsed(),
        });
    }
}
