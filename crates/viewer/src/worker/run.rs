//! The thread of the worker.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use uw_render::{
    film::Film,
    gpu::{Gpu, GpuError},
    image::{ImageError, write_frame},
    integrator::Plan,
    layers::{self, RenderLayer},
    prepare::Prepared,
    scene::{Camera, Scene},
};

use super::{
    Activity, Export, Frame, Goal, Job, Mouth, News, Place, Shared, View,
    daylight::{Known, Steering},
    engine::Engine,
    stages,
};
use crate::model::display;

/// How long a sleeping thread goes without looking up; every change wakes it at once.
const NAP: Duration = Duration::from_secs(1);
/// Fewest samples per pixel before an estimated error ends a render.
const TRUSTED_SAMPLES: u64 = 4;

/// Renders what is asked for until the worker is dropped.
pub(super) fn work(shared: &Shared, news: &Sender<News>, place: Place) {
    let mouth = Mouth { shared, news };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(place.threads.unwrap_or(0))
        .thread_name(|i| format!("render {i}"))
        .build();
    let pool = match pool {
        Ok(pool) => pool,
        Err(error) => {
            mouth.say(News::Failed {
                generation: 0,
                message: format!("cannot start the render threads: {error}"),
            });
            return;
        }
    };
    let mut thread = Thread {
        shared,
        mouth,
        pool,
        gpu: place.gpu,
        rate: stages::FIRST_RATE,
        grace: stages::GRACE,
        known_daylight: None,
    };
    let mut done = None;
    while let Some((job, asked)) = thread.next_job(done) {
        done = Some(job.generation);
        thread.render(&job, asked);
    }
}

struct Thread<'a> {
    shared: &'a Shared,
    mouth: Mouth<'a>,
    pool: rayon::ThreadPool,
    gpu: Option<Gpu>,
    /// Samples per second of the last stage.
    rate: f64,
    /// How long a first picture may go on although newer settings have come.
    grace: Duration,
    /// The newest field of daylight.
    known_daylight: Option<Known>,
}

/// Why a stage ended.
enum End {
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
struct Stage<'a> {
    job: &'a Job,
    asked: Instant,
    scene: &'a Prepared,
    coarseness: u32,
    start: Instant,
    /// Time spent paused or done.
    idle: Duration,
    backend: Arc<str>,
}

impl Thread<'_> {
    /// Waits for a job that is not `done`; `None` when the worker ends.
    fn next_job(&self, done: Option<u64>) -> Option<(Job, Instant)> {
        let mut inbox = self.shared.inbox();
        loop {
            if self.shared.quit.load(Ordering::Acquire) {
                return None;
            }
            if let Some(job) = &inbox.job
                && Some(job.generation) != done
            {
                return Some((job.clone(), inbox.asked));
            }
            let waited = self.shared.arrived.wait_timeout(inbox, NAP);
            inbox = waited.map_or_else(|e| e.into_inner().0, |(inbox, _)| inbox);
        }
    }

    fn is_left(&self, generation: u64) -> bool {
        self.shared.wanted.load(Ordering::Acquire) != generation
            || self.shared.quit.load(Ordering::Acquire)
    }

    /// All stages of a job, until its end or a newer one.
    fn render(&mut self, job: &Job, asked: Instant) {
        let scene = match job.settings.scene() {
            Ok(scene) => scene,
            Err(error) => {
                return self.mouth.say(News::Failed {
                    generation: job.generation,
                    message: error.to_string(),
                });
            }
        };
        let mut prepared = Prepared::build_unsteered(&scene, Arc::clone(&job.geometry));
        let mut steering = Steering::begin(self.known_daylight.as_ref(), job, &mut prepared);
        let (width, height) = (job.settings.camera.width, job.settings.camera.height);
        let mut coarseness = stages::first_coarseness(width, height, self.rate);
        let first = coarseness;
        loop {
            if coarseness == 1 && !self.wait_for_daylight(&mut steering, job, &scene, &mut prepared)
            {
                return;
            }
            let small = job
                .settings
                .camera
                .resized((width / coarseness).max(1), (height / coarseness).max(1));
            prepared.camera = small.build();
            let mut stage = Stage {
                job,
                asked,
                scene: &prepared,
                coarseness,
                start: Instant::now(),
                idle: Duration::ZERO,
                backend: self.backend(),
            };
            let end = if coarseness > 1 {
                self.coarse(&mut stage, coarseness == first)
            } else {
                self.full(&mut stage)
            };
            match end {
                Ok(End::Complete) if coarseness > 1 => {
                    // Each stage costs a graphics adapter new kernels, and it is fast.
                    coarseness = if self.gpu.is_some() {
                        1
                    } else {
                        coarseness / 2
                    };
                }
                Ok(_) => return,
                Err(error) => {
                    // The same stage again, on the processor.
                    self.gpu = None;
                    let message = error.to_string();
                    self.mouth.say(News::FellBack { message });
                }
            }
            steering.take_up(&mut self.known_daylight, job, &scene, &mut prepared, asked);
        }
    }

    /// Sees to it that the field of daylight is there; `false` when the job was left meanwhile.
    fn wait_for_daylight(
        &mut self,
        steering: &mut Steering,
        job: &Job,
        scene: &Scene,
        prepared: &mut Prepared,
    ) -> bool {
        while !steering.is_there() {
            if self.is_left(job.generation) {
                return false;
            }
            steering.wait(&mut self.known_daylight, job, scene, prepared);
        }
        true
    }

    fn backend(&self) -> Arc<str> {
        match &self.gpu {
            Some(gpu) => gpu.info().name.as_str().into(),
            None => format!("CPU, {} threads", self.pool.current_num_threads()).into(),
        }
    }

    /// One sample per pixel of a small picture. The very first is finished within its grace even when it is out of
    /// date by then.
    fn coarse(&mut self, stage: &mut Stage, is_first: bool) -> Result<End, GpuError> {
        let plan = plan(stage.job);
        let mut engine = Engine::new(stage.scene, &plan, &self.pool, self.gpu.as_ref())?;
        let mut film = engine.film(stage.scene);
        let start = stage.start;
        let generation = stage.job.generation;
        let grace = self.grace;
        let leave = || self.is_left(generation) && !(is_first && start.elapsed() < grace);
        if !engine.step(&mut film, 1, &leave, &|| false)? {
            if is_first {
                self.grace = (2 * grace).min(stages::MOST_GRACE);
            }
            return Ok(End::Left);
        }
        self.grace = stages::GRACE;
        let elapsed = stage.start.elapsed().as_secs_f64();
        self.rate = engine.paths() as f64 / elapsed.max(1e-6);
        let (view, revision, _, _) = self.wishes();
        let figures = Figures {
            samples_per_s: self.rate,
            relative_error: None,
            activity: Activity::Refining,
        };
        self.publish(stage, &film, &view, revision, figures);
        Ok(End::Complete)
    }

    /// The full picture, until its goal is reached and then until there is a newer job; looks and exports are served
    /// all the while.
    fn full(&mut self, stage: &mut Stage) -> Result<End, GpuError> {
        let plan = plan(stage.job);
        let mut engine = Engine::new(stage.scene, &plan, &self.pool, self.gpu.as_ref())?;
        let mut film = engine.film(stage.scene);
        let generation = stage.job.generation;
        let (mut batch, mut published) = (0, None);
        while !self.is_left(generation) {
            let (view, revision, goal, paused) = self.wishes();
            let complete = film.rows.iter().all(|row| row.batches > 0);
            let error = if complete {
                film.relative_error()
            } else {
                None
            };
            let activity = if complete && is_reached(&goal, film.samples(), error) {
                Activity::Done
            } else if paused {
                Activity::Paused
            } else {
                Activity::Refining
            };
            let mark = (revision, activity, film_mark(&film));
            if complete && published != Some(mark) {
                let active = (stage.start.elapsed() - stage.idle).as_secs_f64();
                let rate = engine.paths() as f64 / active.max(1e-6);
                let figures = Figures {
                    samples_per_s: rate,
                    relative_error: error,
                    activity,
                };
                self.publish(stage, &film, &view, revision, figures);
                published = Some(mark);
            }
            self.serve_exports(stage, &film, complete);
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
            if engine.step(&mut film, stages::batch_samples(batch), &leave, &pause)? {
                batch += 1;
            }
        }
        Ok(End::Left)
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
        &self,
        stage: &Stage,
        film: &Film,
        view: &View,
        view_revision: u64,
        figures: Figures,
    ) {
        let shown = self
            .pool
            .install(|| display::compose(stage.scene, film, &view.display, &view.sensor));
        self.mouth.publish(Frame {
            generation: stage.job.generation,
            view_revision,
            serial: self.shared.serial.fetch_add(1, Ordering::Relaxed) + 1,
            coarseness: stage.coarseness,
            shown,
            camera: stage.scene.camera.clone(),
            geometry: Arc::clone(&stage.job.geometry),
            samples: film.samples(),
            relative_error: figures.relative_error,
            samples_per_s: figures.samples_per_s,
            begun_after_s: (stage.start - stage.asked).as_secs_f64(),
            since_request_s: stage.asked.elapsed().as_secs_f64(),
            activity: figures.activity,
            backend: Arc::clone(&stage.backend),
        });
    }

    /// Writes the files that were asked for, once there is a picture.
    fn serve_exports(&self, stage: &Stage, film: &Film, complete: bool) {
        if !complete {
            return;
        }
        let (exports, sensor) = {
            let mut inbox = self.shared.inbox();
            (std::mem::take(&mut inbox.exports), inbox.view.sensor)
        };
        for export in exports {
            let written = match &export {
                Export::Exr { path, layers } => write_exr(stage, film, path, layers.as_deref()),
                Export::Photograph { path, seed } => {
                    let frame = sensor.build().expose(&layers::picture(film), *seed);
                    write_frame(path, &frame)
                }
            };
            self.mouth.say(match written {
                Ok(()) => News::Exported(export.path().clone()),
                Err(error) => News::NotExported(error.to_string()),
            });
        }
    }
}

fn plan(job: &Job) -> Plan {
    Plan {
        samples_per_pixel: None,
        time_limit: None,
        target_error: None,
        seed: job.seed,
        threads: None,
        max_bounces: job.settings.max_bounces,
        // Lamps that are off have layers too, for the menu of layers.
        dark_lamps: true,
    }
}

fn is_reached(goal: &Goal, samples: u64, error: Option<f64>) -> bool {
    let enough = goal
        .target_error
        .is_some_and(|target| samples >= TRUSTED_SAMPLES && error.is_some_and(|e| e <= target));
    enough || samples >= goal.samples_per_pixel
}

/// Tells a film from what it was before.
fn film_mark(film: &Film) -> u64 {
    film.rows.iter().map(|row| row.samples).sum()
}

fn write_exr(
    stage: &Stage,
    film: &Film,
    path: &std::path::Path,
    wanted: Option<&[RenderLayer]>,
) -> Result<(), ImageError> {
    let all = || RenderLayer::by_names(&["all"], &stage.scene.lamp_names).unwrap_or_default();
    let wanted = wanted.map_or_else(all, <[RenderLayer]>::to_vec);
    let mut image = layers::exr_image(stage.scene, film, &wanted);
    let Camera { width, height, .. } = stage.scene.camera;
    image.attributes = vec![
        ("samples_per_pixel".to_owned(), film.samples().to_string()),
        ("seed".to_owned(), stage.job.seed.to_string()),
        ("size".to_owned(), format!("{width} x {height}")),
    ];
    image.write(path)
}
