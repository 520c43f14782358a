//! The thread of the worker: from one job to the next, from one stage to the next.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use uw_render::{
    backend::Device,
    prepare::Prepared,
    scene::{Camera, Scene},
};

use crate::background::step_back;

use super::{
    Job, Mouth, News, RenderDevice, Shared,
    daylight::{Known, Steering},
    refine::{End, Stage},
    stages::{self, Grace},
    textures::Textures,
};

/// How long a sleeping thread goes without looking up; every change wakes it at once.
pub(super) const NAP: Duration = Duration::from_secs(1);

/// Renders what is asked for until the worker is dropped.
pub(super) fn work(shared: &Shared, news: &Sender<News>, render_device: RenderDevice) {
    step_back();
    let mouth = Mouth { shared, news };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(render_device.threads.unwrap_or(0))
        .thread_name(|i| format!("render {i}"))
        .build();
    let pool = match pool {
        Ok(pool) => Arc::new(pool),
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
        device: render_device.device,
        rate: stages::FIRST_RATE,
        grace: Grace::default(),
        known_daylight: None,
        textures: Textures::default(),
    };
    let mut done = None;
    while let Some((job, asked)) = thread.next_job(done) {
        done = Some(job.generation);
        thread.render(&job, asked);
    }
}

/// What the thread knows from one job to the next.
pub(super) struct Thread<'a> {
    pub(super) shared: &'a Shared,
    pub(super) mouth: Mouth<'a>,
    pub(super) pool: Arc<rayon::ThreadPool>,
    pub(super) device: Device,
    /// Samples per second of the last stage.
    pub(super) rate: f64,
    /// How long a first picture may go on although newer settings have come.
    pub(super) grace: Grace,
    /// The newest field of daylight.
    known_daylight: Option<Known>,
    pub(super) textures: Textures,
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

    pub(super) fn is_left(&self, generation: u64) -> bool {
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
            prepared.camera = Camera {
                port: prepared.camera.port,
                ..small.build()
            };
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
                self.coarse(&stage, coarseness == first)
            } else {
                self.full(&mut stage)
            };
            match end {
                Ok(End::Complete) if coarseness > 1 => {
                    // Each stage costs a graphics adapter the tables of the scene, and it is fast.
                    coarseness = if self.device.gpu().is_some() {
                        1
                    } else {
                        coarseness / 2
                    };
                }
                Ok(_) => return,
                Err(error) => {
                    let message = error.to_string();
                    // The same stage again, on the processor, in the end in double precision.
                    self.device = match self.device {
                        Device::Gpu(_) => Device::CpuSimd,
                        Device::CpuSimd => Device::Cpu,
                        Device::Cpu => {
                            let generation = job.generation;
                            return self.mouth.say(News::Failed {
                                generation,
                                message,
                            });
                        }
                    };
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
        let threads = self.pool.current_num_threads();
        match &self.device {
            Device::Gpu(gpu) => gpu.info().name.as_str().into(),
            Device::CpuSimd => format!("CPU, vector units, {threads} threads").into(),
            Device::Cpu => format!("CPU, {threads} threads").into(),
        }
    }
}
