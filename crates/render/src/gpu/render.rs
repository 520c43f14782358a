//! A render as batches of dispatches.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use cpu_time::ProcessTime;
use rayon::prelude::*;

use super::{
    Gpu,
    dispatches::{Block, Dispatches, Edit, Stop},
    pipeline::Loaded,
};
use crate::{
    film::{BatchMean, Film},
    integrator::{Plan, Progress, RenderError, RenderStats, coarse::CoarseFirst, thread_pool},
    kernels::{GpuError, Selection, Tables, Tracer, levels},
    prepare::Prepared,
    snow::snow,
};

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
    edit: Edit<'_>,
) -> Result<(Film, RenderStats), RenderError> {
    let setup = Instant::now();
    let cpu_start = ProcessTime::now();
    let mut job = Batches::new(gpu, scene, plan, cancel, observe, edit)?;
    job.end = plan.end(setup);
    let pool = thread_pool(plan.threads)?;
    let snow = pool.install(|| snow(scene, plan.dark_lamps, cancel));
    let setup_s = setup.elapsed().as_secs_f64();
    let coarse = pool.install(|| CoarseFirst::begin(scene, plan, cancel, setup))?;
    let mut film = Film::new(scene.camera.width, scene.camera.height, scene.lamps.len());
    job.run(&mut film, coarse.as_ref())?;
    if let Some(coarse) = coarse {
        let done = pool.install(|| coarse.complete(&mut film))?;
        job.dispatches.work.add(done);
    }
    if film.samples() == 0 && film.filled_pixels() == 0 {
        return Err(RenderError::Incomplete {
            rows: 0,
            total: film.rows.len(),
        });
    }
    if job.dispatches.work.lost_light > 0 {
        return Err(RenderError::LightLost {
            count: job.dispatches.work.lost_light,
        });
    }
    film.show_snow(snow.map(Arc::new));
    film.check_finite(&scene.lamp_names)?;
    let stats = RenderStats {
        adapter: Some(gpu.info().name.clone()),
        setup_s,
        render_s: setup.elapsed().as_secs_f64() - setup_s,
        cpu_s: cpu_start.elapsed().as_secs_f64(),
        interrupted: cancel.load(Ordering::Relaxed),
        ..RenderStats::of("gpu", scene, plan, &film, job.dispatches.work)
    };
    Ok((film, stats))
}

pub(super) struct Batches<'a> {
    dispatches: Dispatches<'a>,
    scene: &'a Prepared,
    plan: &'a Plan,
    cancel: &'a AtomicBool,
    observe: &'a (dyn Fn(&Progress) + Sync),
    start: Instant,
    /// When a render is to end.
    end: Option<Instant>,
    /// How long it takes to bring a batch from the device to the film.
    fetch: Duration,
    /// Rows finished in earlier batches.
    rows_before: u64,
    /// Rows finished in the batch at work.
    rows_in_batch: u32,
}

impl<'a> Batches<'a> {
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
        edit: Edit<'_>,
    ) -> Result<Self, GpuError> {
        let selection = Selection::all(scene, plan.dark_lamps, plan.max_bounces);
        gpu.check()?;
        let tables = Tables::build(scene, &selection.lamps, Tracer::Kernels)?;
        let loaded = Loaded::new(gpu, scene, &tables, false)?;
        Ok(Self {
            dispatches: Dispatches::new(loaded, &selection, edit)?,
            scene,
            plan,
            cancel,
            observe,
            start: Instant::now(),
            end: None,
            fetch: Duration::ZERO,
            rows_before: 0,
            rows_in_batch: 0,
        })
    }

    /// Walks started at the camera so far.
    pub(super) fn paths(&self) -> u64 {
        self.dispatches.work.paths
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
        &self.dispatches.loaded.film
    }

    /// All samples of one batch, of every kernel.
    fn run_batch(
        &mut self,
        batch: u32,
        samples: u32,
        stop: &dyn Fn(f64) -> bool,
    ) -> Result<(), Stop> {
        self.dispatches.loaded.clear(false);
        let (kernels, all) = (self.dispatches.kernels(), self.dispatches.loaded.pixels);
        for kernel in 0..kernels {
            self.dispatches.loaded.clear(true);
            let mut first_pixel = 0;
            while first_pixel < all {
                let block = Block {
                    seed: self.plan.seed,
                    batch,
                    samples,
                    first_pixel,
                    pixels: self.dispatches.block(kernel, all - first_pixel),
                    rays: (0, 0),
                };
                let of_kernel = f64::from(first_pixel) / f64::from(all);
                let share = (kernel as f64 + of_kernel) / kernels as f64;
                self.dispatches.run_block(kernel, &block, &|| stop(share))?;
                first_pixel += block.pixels;
                if kernel + 1 == kernels {
                    self.rows_in_batch = first_pixel / self.scene.camera.width;
                    self.report(self.rows_in_batch);
                }
            }
            self.dispatches.check_completed(kernel, all, samples)?;
        }
        self.rows_before += u64::from(self.scene.camera.height);
        Ok(())
    }

    /// Adds the batch on the device to the first `rows` rows of `film`.
    pub(super) fn add_to(
        &self,
        film: &mut Film,
        rows: usize,
        samples: u32,
    ) -> Result<(), GpuError> {
        let values = self.dispatches.loaded.read_film()?;
        let layers = self.dispatches.loaded.film_layers as usize;
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
