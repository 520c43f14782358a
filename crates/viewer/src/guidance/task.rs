//! Work that takes seconds: the calibration routine and looks from the vehicle, on a thread of their own.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

use uw_calib::Profile;
use uw_calib::vehicle::Vehicle;
use uw_guidance::physics::{Water, WaterFile};
use uw_scenery::textures::Pattern;

use super::look::Film;
use super::{Check, Look, camera::VehicleCamera, water};
use crate::{background::step_back, model::Settings};

/// Where the vehicle is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehiclePosition {
    /// Depth, m.
    pub depth_m: f64,
    /// Distance to the target along the axis, m.
    pub distance_m: f64,
}

/// What is to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Work {
    /// The whole routine, then a look.
    Calibrate {
        /// Where to look from in the end.
        here: VehiclePosition,
    },
    /// A look.
    Look {
        /// From where.
        here: VehiclePosition,
    },
    /// A look at what a suggestion would give.
    Check {
        /// From where.
        there: VehiclePosition,
        /// At which lamp level, percent.
        light_pct: f64,
    },
}

/// A task with all it needs.
#[derive(Clone, Debug)]
pub struct GuidanceJob {
    /// What is to be done.
    pub work: Work,
    /// Water, sun and sky.
    pub settings: Settings,
    /// The target.
    pub pattern: Pattern,
    /// Paths per group of a view of the target.
    pub paths: u32,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Folder of the textures.
    pub assets: PathBuf,
    /// What is known of the water for predictions by physics.
    pub tables: Tables,
}

/// What a task does about the tables of the water that physics predicts with.
#[derive(Clone, Debug)]
pub enum Tables {
    /// Nothing: it is not physics that is asked.
    Unasked,
    /// They are there.
    Known(Arc<Water>),
    /// Makes them.
    Make,
}

/// A profile of the routine.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// The profile.
    pub profile: Arc<Profile>,
    /// How well its contrasts are known.
    pub errors: Arc<ContrastErrors>,
    /// Its images of the target and their distances, m, where physics is to have them in mind.
    pub films: Vec<(f64, Film)>,
}

/// Standard errors of contrasts that the paths of their renders leave: distance, m, and 8-bit counts per channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContrastErrors {
    /// With the lamps on.
    pub on: Vec<(f64, [f64; 3])>,
    /// With the lamps off.
    pub off: Vec<(f64, [f64; 3])>,
}

/// What a task brings.
#[derive(Debug)]
pub enum Done {
    /// A profile.
    Calibrated(Calibrated),
    /// Tables of the water.
    Tabulated(Arc<Water>),
    /// A look.
    Looked(Arc<Look>),
    /// What a suggestion gives.
    Checked(Check),
    /// It did not work, and why.
    Failed(String),
    /// Nothing more will come.
    All,
}

enum Message {
    Progress {
        done: usize,
        of: usize,
        what: String,
    },
    Done(Done),
}

/// A task that runs; dropping it ends it.
pub struct Task {
    messages: Receiver<Message>,
    cancel: Arc<AtomicBool>,
    progress: (String, f32),
    over: bool,
}

impl Drop for Task {
    fn drop(&mut self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

impl Task {
    /// Starts a task; `wake` is called when it has brought something.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(
        job: GuidanceJob,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let (sender, messages) = channel();
        let cancel = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&cancel);
        std::thread::Builder::new()
            .name("guidance".to_owned())
            .spawn(move || {
                step_back();
                let run = Run {
                    job,
                    cancel: flag,
                    sender,
                    wake: Box::new(wake),
                };
                run.run();
            })?;
        Ok(Self {
            messages,
            cancel,
            progress: ("starting".to_owned(), 0.0),
            over: false,
        })
    }

    /// What is being done, and how much of it is done.
    pub fn progress(&self) -> (String, f32) {
        self.progress.clone()
    }

    /// The next thing that it brought.
    pub fn done(&mut self) -> Option<Done> {
        loop {
            match self.messages.try_recv() {
                Ok(Message::Progress { done, of, what }) => {
                    self.progress = (what, done as f32 / of.max(1) as f32);
                }
                Ok(Message::Done(done)) => return Some(done),
                Err(TryRecvError::Empty) => return None,
                Err(TryRecvError::Disconnected) => {
                    return (!std::mem::replace(&mut self.over, true)).then_some(Done::All);
                }
            }
        }
    }
}

struct Run {
    job: GuidanceJob,
    cancel: Arc<AtomicBool>,
    sender: Sender<Message>,
    wake: Box<dyn Fn() + Send + Sync>,
}

impl Run {
    fn send(&self, message: Message) {
        // Without a listener the task was ended.
        let _ = self.sender.send(message);
        (self.wake)();
    }

    fn progress(&self, done: usize, of: usize, what: String) {
        self.send(Message::Progress { done, of, what });
    }

    fn run(self) {
        let result = self.work();
        if let Err(message) = result
            && !self.cancel.load(Ordering::Relaxed)
        {
            self.send(Message::Done(Done::Failed(message)));
        }
        let wake = self.wake;
        drop(self.sender);
        wake();
    }

    fn work(&self) -> Result<(), String> {
        let camera = VehicleCamera::new(&self.job, &self.cancel)?;
        let (here, films) = match self.job.work {
            Work::Calibrate { here } => {
                let tell = |done, of, what| self.progress(done, of, what);
                let mut calibrated = camera.calibrate(&tell)?;
                let films = std::mem::take(&mut calibrated.films);
                self.send(Message::Done(Done::Calibrated(calibrated)));
                (here, films)
            }
            Work::Look { here } => (here, Vec::new()),
            Work::Check { there, light_pct } => {
                self.progress(0, 1, "rendering the suggestion".to_owned());
                let seen = camera.statistics(&camera.image(there, 301)?, light_pct);
                let check = Check {
                    at: [there.distance_m, light_pct],
                    rendered: seen.stats.contrast,
                    error: seen.errors.contrast,
                };
                self.send(Message::Done(Done::Checked(check)));
                return Ok(());
            }
        };
        let water = match self.water(&camera, &films) {
            Err(message) if !self.cancel.load(Ordering::Relaxed) => {
                // A network can be asked all the same.
                self.send(Message::Done(Done::Failed(message)));
                None
            }
            found => found?,
        };
        self.progress(0, 1, format!("looking from {:.2} m", here.distance_m));
        let look = camera.look(here, water)?;
        self.send(Message::Done(Done::Looked(Arc::new(look))));
        Ok(())
    }

    /// The water with its tables, where they are asked for, and what a calibration saw of the target.
    fn water(
        &self,
        camera: &VehicleCamera,
        films: &[(f64, Film)],
    ) -> Result<Option<Arc<Water>>, String> {
        let file = match &self.job.tables {
            Tables::Unasked => return Ok(None),
            Tables::Known(water) if films.is_empty() => return Ok(Some(Arc::clone(water))),
            Tables::Known(water) => water.file().clone(),
            Tables::Make => {
                let tell = |share: f64| {
                    let what = "tables of the water, for physics".to_owned();
                    self.progress((1e3 * share) as usize, 1000, what);
                };
                camera.water(&tell).map_err(|error| error.to_string())?
            }
        };
        let sights = match films.is_empty() {
            true => file.sights.clone(),
            false => water::sights(&file, films),
        };
        let water = Arc::new(Water::new(WaterFile { sights, ..file }));
        self.send(Message::Done(Done::Tabulated(Arc::clone(&water))));
        Ok(Some(water))
    }
}
