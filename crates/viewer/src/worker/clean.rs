//! The denoised picture: a second half of the samples with other random numbers, and what both halves give together. The
//! film of the picture itself stays what it is without.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rayon::ThreadPool;
use uw_render::{
    backend::Device,
    denoise::{Half, denoise},
    film::Film,
    gpu::GpuError,
    integrator::Plan,
    prepare::Prepared,
    snow::SnowLayers,
};

use super::{Goal, engine::Engine, refine::is_reached, stages};

/// By how much the samples grow from one denoised picture to the next.
const GROWTH: u64 = 2;
/// How long it takes to notice that a picture is not wanted any more.
const NAP: Duration = Duration::from_millis(5);

/// The second half and the denoised film.
pub(super) struct Clean<'a> {
    scene: &'a Prepared,
    /// Those of both halves.
    plans: [&'a Plan; 2],
    pool: &'a ThreadPool,
    device: &'a Device,
    engine: Option<Engine<'a>>,
    batch: u32,
    film: Option<Film>,
}

impl<'a> Clean<'a> {
    /// Of a picture that is rendered as the first of `plans` says; nothing is done before it is wanted.
    pub(super) fn new(
        scene: &'a Prepared,
        plans: [&'a Plan; 2],
        pool: &'a ThreadPool,
        device: &'a Device,
    ) -> Self {
        Self {
            scene,
            plans,
            pool,
            device,
            engine: None,
            batch: 0,
            film: None,
        }
    }

    /// The denoised film of both halves, once there is one.
    pub(super) fn film(&self) -> Option<&Film> {
        self.film.as_ref()
    }

    /// Samples per pixel of the second half.
    pub(super) fn samples(&self) -> u64 {
        self.engine.as_ref().map_or(0, Engine::samples)
    }

    /// Adds to the second half, as to the first.
    ///
    /// # Errors
    /// The kernels or the graphics adapter refuse the scene, or fail.
    pub(super) fn step(
        &mut self,
        leave: &(dyn Fn() -> bool + Sync),
        pause: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), GpuError> {
        let engine = match &mut self.engine {
            Some(engine) => engine,
            none => none.insert(Engine::new(
                self.scene,
                self.plans[1],
                self.pool,
                self.device,
            )?),
        };
        if engine.step(stages::batch_samples(self.batch), leave, pause)? {
            self.batch += 1;
        }
        Ok(())
    }

    /// Whether both halves are as large and it is time for a denoised picture: there are twice as many samples as in the last,
    /// or as many as are wanted.
    pub(super) fn is_due(&self, first: &Engine, goal: &Goal) -> bool {
        let Some(second) = &self.engine else {
            return false;
        };
        let each = first.samples();
        let whole = first.is_even() && second.is_even() && second.samples() == each;
        let last = self.film.as_ref().map_or(0, Film::samples);
        let enough = is_reached(goal, 2 * each, None);
        whole && (2 * each >= GROWTH * last.max(1) || (enough && 2 * each > last))
    }

    /// Makes the denoised picture, unless it is left.
    ///
    /// # Errors
    /// The graphics adapter fails.
    pub(super) fn make(
        &mut self,
        first: &Engine,
        leave: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), GpuError> {
        let Some(second) = &self.engine else {
            return Ok(());
        };
        let films = [first.film()?, second.film()?];
        let count = films[0].rows.iter().map(|row| row.batches).max();
        let batches: Vec<u32> = (0..count.unwrap_or(0)).map(stages::batch_samples).collect();
        let half = |index: usize| Half {
            film: &films[index],
            seed: self.plans[index].seed,
            batches: &batches,
        };
        let (cancel, made) = (AtomicBool::new(false), AtomicBool::new(false));
        let film = std::thread::scope(|scope| {
            scope.spawn(|| {
                while !made.load(Ordering::Relaxed) {
                    cancel.store(leave(), Ordering::Relaxed);
                    std::thread::sleep(NAP);
                }
            });
            let work = || denoise(self.scene, [half(0), half(1)], true, &cancel);
            let film = self.pool.install(work);
            made.store(true, Ordering::Relaxed);
            film
        });
        self.film = film.or(self.film.take());
        Ok(())
    }

    /// Shows marine snow from now on, or none.
    pub(super) fn show_snow(&mut self, snow: Option<Arc<SnowLayers>>) {
        if let Some(film) = &mut self.film {
            film.show_snow(snow);
        }
    }
}
