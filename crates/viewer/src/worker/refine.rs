//! The stages of a picture: coarse ones, and the full one that is refined until its goal is reached.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use uw_render::{
    backend::Device,
    denoise::other_half,
    film::Film,
    gpu::GpuError,
    integrator::Plan,
    prepare::Prepared,
    snow::{self, SnowLayers},
};

use super::{
    Activity, Frame, Goal, Job, News, View,
    clean::Clean,
    engine::Engine,
    exports,
    run::{NAP, Thread},
    stages,
};
use crate::model::display;

/// Fewest samples per pixel before an estimated error ends a render.
const TRUSTED_SAMPLES: u64 = 4;

/// Why a stage ended.
pub(super) enum End {
    /// Its work is done.
    Complete,
    /// There is a newer job, or the worker ends.
    Left,
}

/// What is said about a picture.
struct Figures {
    samples_per_s: f64,
    relative_error: Option<f64>,
    activity: Activity,
}

/// A picture in the making.
pub(super) struct Stage<'a> {
    pub(super) job: &'a Job,
    pub(super) asked: Instant,
    pub(super) scene: &'a Prepared,
    pub(super) coarseness: u32,
    pub(super) start: Instant,
    /// Time spent paused or done.
    pub(super) idle: Duration,
    pub(super) backend: Arc<str>,
}

impl Stage<'_> {
    /// Samples per second of the render since the stage began, without pauses.
    fn rate(&self, engine: &Engine) -> f64 {
        let active = (self.start.elapsed() - self.idle).as_secs_f64();
        engine.paths() as f64 / active.max(1e-6)
    }
}

impl Thread<'_> {
    /// One sample per pixel of a small picture. The very first is finished within its grace even when it is out of
    /// date by then.
    pub(super) fn coarse(&mut self, stage: &Stage, is_first: bool) -> Result<End, GpuError> {
        let plan = plan(stage.job);
        let device = match &self.device {
            // The tables of the kernels take as long as a small picture.
            Device::CpuSimd => Device::Cpu,
            device => device.clone(),
        };
        let pool = Arc::clone(&self.pool);
        let mut engine = Engine::new(stage.scene, &plan, &pool, &device)?;
        let generation = stage.job.generation;
        let grace = self.grace.now();
        let leave = || self.is_left(generation) && !(is_first && stage.start.elapsed() < grace);
        let complete = engine.step(1, &leave, &|| false)?;
        if is_first {
            self.grace.learn(complete);
        }
        if !complete {
            return Ok(End::Left);
        }
        self.rate = stage.rate(&engine);
        let (view, revision, _, _) = self.wishes();
        let figures = Figures {
            samples_per_s: self.rate,
            relative_error: None,
            activity: Activity::Refining,
        };
        self.publish(stage, (&engine, None), &view, revision, figures)?;
        Ok(End::Complete)
    }

    /// The full picture, until its goal is reached and then until there is a newer job; looks and exports are served
    /// all the while.
    pub(super) fn full(&mut self, stage: &mut Stage) -> Result<End, GpuError> {
        let plan = plan(stage.job);
        let device = self.device.clone();
        let pool = Arc::clone(&self.pool);
        let mut engine = Engine::new(stage.scene, &plan, &pool, &device)?;
        let other = other_half(&plan);
        let mut clean = Clean::new(stage.scene, [&plan, &other], &pool, &device);
        let generation = stage.job.generation;
        let (mut batch, mut published, mut snow_is_due) = (0, None, stage.scene.snow.is_some());
        while !self.is_left(generation) {
            let (view, revision, goal, paused) = self.wishes();
            let complete = engine.is_complete();
            if complete && view.denoised && clean.is_due(&engine, &goal) {
                let leave = || self.is_left(generation);
                clean.make(&engine, &leave)?;
                continue;
            }
            let shown = clean.film().filter(|_| view.denoised);
            let error = match shown {
                Some(film) => film
                    .denoised()
                    .map(|denoised| denoised.facts.relative_error),
                None => engine.relative_error().filter(|_| complete),
            };
            let samples = shown.map_or(engine.samples(), Film::samples);
            let is_wanted = shown.is_some() == view.denoised;
            let activity = if complete && is_wanted && is_reached(&goal, samples, error) {
                Activity::Done
            } else if paused {
                Activity::Paused
            } else {
                Activity::Refining
            };
            let mark = (
                revision,
                activity,
                shown.map_or(engine.mark(), Film::samples),
            );
            if complete && published != Some(mark) {
                if let Err(error) = engine.check_finite(&stage.scene.lamp_names) {
                    self.mouth.say(News::Failed {
                        generation,
                        message: error.to_string(),
                    });
                    return Ok(End::Left);
                }
                let figures = Figures {
                    samples_per_s: stage.rate(&engine),
                    relative_error: error,
                    activity,
                };
                self.publish(stage, (&engine, shown), &view, revision, figures)?;
                published = Some(mark);
            }
            if complete && snow_is_due {
                // The first full picture comes without, because flakes take as long as many samples.
                let snow = self.snow(stage).map(Arc::new);
                clean.show_snow(snow.clone());
                engine.show_snow(snow);
                (snow_is_due, published) = (false, None);
                continue;
            }
            if complete {
                exports::serve(self.shared, &self.mouth, stage, &engine, shown)?;
            }
            if activity != Activity::Refining {
                stage.idle += self.sleep(generation);
                continue;
            }
            let begun = Instant::now();
            let show_every = stages::show_every(stage.start.elapsed());
            let leave = || self.is_left(generation);
            let pause = || {
                self.shared.attention.load(Ordering::Acquire)
                    || (complete && begun.elapsed() >= show_every)
            };
            if view.denoised && complete && clean.samples() < engine.samples() {
                clean.step(&leave, &pause)?;
            } else if engine.step(stages::batch_samples(batch), &leave, &pause)? {
                batch += 1;
            }
        }
        Ok(End::Left)
    }

    /// The marine snow of the picture; `None` where there is none, or a newer job.
    fn snow(&self, stage: &Stage) -> Option<SnowLayers> {
        let (cancel, made) = (AtomicBool::new(false), AtomicBool::new(false));
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !made.load(Ordering::Relaxed) {
                    cancel.store(self.is_left(stage.job.generation), Ordering::Relaxed);
                    std::thread::sleep(NAP);
                }
            });
            let layers = self.pool.install(|| snow::snow(stage.scene, true, &cancel));
            made.store(true, Ordering::Relaxed);
            layers
        })
    }

    /// View, its revision, goal, pause; what came until now counts as noticed.
    fn wishes(&self) -> (View, u64, Goal, bool) {
        let inbox = self.shared.inbox();
        self.shared.attention.store(false, Ordering::Release);
        (
            inbox.view.clone(),
            inbox.view_revision,
            inbox.goal,
            inbox.paused,
        )
    }

    /// Waits until something is in the inbox; how long that took.
    fn sleep(&self, generation: u64) -> Duration {
        let start = Instant::now();
        let mut inbox = self.shared.inbox();
        while !self.is_left(generation) && !self.shared.attention.load(Ordering::Acquire) {
            let waited = self.shared.arrived.wait_timeout(inbox, NAP);
            inbox = waited.map_or_else(|e| e.into_inner().0, |(inbox, _)| inbox);
        }
        start.elapsed()
    }

    fn publish(
        &mut self,
        stage: &Stage,
        (engine, clean): (&Engine, Option<&Film>),
        view: &View,
        view_revision: u64,
        figures: Figures,
    ) -> Result<(), GpuError> {
        let shown = match clean {
            Some(film) => self
                .pool
                .install(|| display::compose(stage.scene, film, &view.display, &view.sensor)),
            None => engine.show(stage.scene, view, &self.pool, &mut self.textures)?,
        };
        self.mouth.publish(Frame {
            generation: stage.job.generation,
            view_revision,
            serial: self.shared.serial.fetch_add(1, Ordering::Relaxed) + 1,
            coarseness: stage.coarseness,
            shown,
            camera: stage.scene.camera.clone(),
            geometry: Arc::clone(&stage.job.geometry),
            samples: clean.map_or(engine.samples(), Film::samples),
            relative_error: figures.relative_error,
            denoised: clean
                .and_then(Film::denoised)
                .map(|denoised| denoised.facts),
            samples_per_s: figures.samples_per_s,
            begun_after_s: (stage.start - stage.asked).as_secs_f64(),
            since_request_s: stage.asked.elapsed().as_secs_f64(),
            activity: figures.activity,
            backend: Arc::clone(&stage.backend),
        });
        Ok(())
    }
}

fn plan(job: &Job) -> Plan {
    Plan {
        max_bounces: job.settings.max_bounces,
        // Lamps that are off have layers too, for the menu of layers.
        dark_lamps: true,
        ..Plan::new(job.seed)
    }
}

pub(super) fn is_reached(goal: &Goal, samples: u64, error: Option<f64>) -> bool {
    let enough = goal
        .target_error
        .is_some_and(|target| samples >= TRUSTED_SAMPLES && error.is_some_and(|e| e <= target));
    enough || samples >= goal.samples_per_pixel
}
