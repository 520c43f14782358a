//! Work that takes seconds: the calibration routine and looks from the vehicle, on a thread of their own.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

use uw_calib::Profile;
use uw_media::WaterType;
use uw_render::scene::{Exposure, Scene, Sensor};
use uw_survey::{
    environment::{Target, View, WaterBody, scene, sensor},
    measure::{Quality, RenderedView},
    routine,
    scenery::textures::Pattern,
    vehicle::Vehicle,
};

use super::Look;
use crate::model::Settings;

/// Depths of the images that look up, m.
pub const DEPTHS_M: [f64; 7] = [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
/// Distances of the images of the target, m.
pub const DISTANCES_M: [f64; 6] = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0];
/// Depth of the contrast images, m.
const CONTRAST_DEPTH_M: f64 = 3.0;
/// Lamp level of the lights-on profile, percent.
const CONTRAST_LIGHT_PCT: f64 = 100.0;
/// Size of the images that look up, pixels: only their mean counts.
const UP_SIZE: (u32, u32) = (64, 36);
/// Samples of the small images that look up, per sample of the others.
const UP_FACTOR: u32 = 4;

/// Where the vehicle is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
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
        here: Place,
    },
    /// A look.
    Look {
        /// From where.
        here: Place,
    },
    /// A look at what a suggestion would give.
    Check {
        /// From where.
        there: Place,
        /// At which lamp level, percent.
        light_pct: f64,
    },
}

/// A task with all it needs.
#[derive(Clone, Debug)]
pub struct Job {
    /// What is to be done.
    pub work: Work,
    /// Water, sun and sky.
    pub settings: Settings,
    /// The target.
    pub pattern: Pattern,
    /// Samples per pixel of each half of a view.
    pub samples_per_half: u32,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Folder of the textures.
    pub assets: PathBuf,
}

/// What a task brings.
#[derive(Debug)]
pub enum Done {
    /// A profile.
    Calibrated(Arc<Profile>),
    /// A look.
    Looked(Look),
    /// A look at what a suggestion gives.
    Checked {
        /// The picture.
        view: RenderedView,
        /// From where.
        there: Place,
        /// Lamp level of the suggestion, percent.
        light_pct: f64,
    },
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
    pub fn start(job: Job, wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let (sender, messages) = channel();
        let cancel = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&cancel);
        std::thread::Builder::new()
            .name("guidance".to_owned())
            .spawn(move || {
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
    job: Job,
    cancel: Arc<AtomicBool>,
    sender: Sender<Message>,
    wake: Box<dyn Fn() + Send>,
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
        let target = Target::read(self.job.pattern, &self.job.assets).map_err(|e| e.to_string())?;
        let here = match self.job.work {
            Work::Calibrate { here } => {
                let profile = self.calibrate(&target)?;
                self.send(Message::Done(Done::Calibrated(Arc::new(profile))));
                here
            }
            Work::Look { here } => here,
            Work::Check { there, light_pct } => {
                self.progress(0, 1, "rendering the suggestion".to_owned());
                let view = self.look(&target, there, 301)?;
                self.send(Message::Done(Done::Checked {
                    view,
                    there,
                    light_pct,
                }));
                return Ok(());
            }
        };
        self.progress(0, 1, format!("looking from {} m", here.distance_m));
        let view = Arc::new(self.look(&target, here, 300)?);
        self.send(Message::Done(Done::Looked(Look { place: here, view })));
        Ok(())
    }

    /// The scene of a view in the water that is set.
    fn scene(&self, vehicle: &Vehicle, target: &Target, view: View) -> Result<Scene, String> {
        // The environment makes camera, lamps and target; its water gives way to the one that is set.
        let stand_in = WaterBody {
            jerlov: WaterType::ALL[0].into(),
            backscatter_fraction: 0.0183,
        };
        let mut made = scene(vehicle, &stand_in, target, view).map_err(|e| e.to_string())?;
        let set = self.job.settings.scene().map_err(|e| e.to_string())?;
        made.water = set.water;
        made.sun = set.sun;
        made.sky_radiance = set.sky_radiance;
        Ok(made)
    }

    fn quality(&self, samples_per_half: u32, seed: u64) -> Quality {
        Quality {
            samples_per_half: samples_per_half.max(2),
            seed,
            threads: None,
        }
    }

    fn render(&self, scene: &Scene, quality: Quality) -> Result<RenderedView, String> {
        RenderedView::render(scene, quality, &self.cancel).map_err(|e| e.to_string())
    }

    fn look(&self, target: &Target, place: Place, seed: u64) -> Result<RenderedView, String> {
        let view = View::Target {
            depth_m: place.depth_m,
            distance_m: place.distance_m,
        };
        let scene = self.scene(&self.job.vehicle, target, view)?;
        self.render(&scene, self.quality(self.job.samples_per_half, seed))
    }

    /// The routine of [`uw_survey::routine`] in the water that is set.
    fn calibrate(&self, target: &Target) -> Result<Profile, String> {
        let of = DEPTHS_M.len() + DISTANCES_M.len();
        let (up_sensor, ups) = self.look_up(target, of)?;
        let mut views = Vec::new();
        for (i, distance_m) in DISTANCES_M.into_iter().enumerate() {
            let done = DEPTHS_M.len() + i;
            self.progress(done, of, format!("contrast at {distance_m} m"));
            let place = Place {
                depth_m: CONTRAST_DEPTH_M,
                distance_m,
            };
            views.push((distance_m, self.look(target, place, 100 + i as u64)?));
        }
        let vehicle = &self.job.vehicle;
        let target_sensor = sensor(vehicle, vehicle.exposure);
        let views: Vec<_> = views.iter().map(|(d, v)| (*d, v)).collect();
        routine::profile(
            &routine::measure_depths(&up_sensor, &ups),
            &routine::measure_contrasts(&target_sensor, &views, CONTRAST_LIGHT_PCT),
            concat!("viewer ", env!("CARGO_PKG_VERSION")),
        )
        .map_err(|e| e.to_string())
    }

    fn look_up(
        &self,
        target: &Target,
        of: usize,
    ) -> Result<(Sensor, Vec<(f64, RenderedView)>), String> {
        let vehicle = &self.job.vehicle;
        let upwards = Vehicle {
            width: UP_SIZE.0,
            height: UP_SIZE.1,
            ..vehicle.clone()
        };
        let mut up_sensor = sensor(vehicle, 1.0);
        let mut ups: Vec<(f64, RenderedView)> = Vec::new();
        for (i, depth_m) in DEPTHS_M.into_iter().enumerate() {
            self.progress(i, of, format!("looking up at {depth_m} m"));
            let scene = self.scene(&upwards, target, View::Up { depth_m })?;
            let quality = self.quality(UP_FACTOR * self.job.samples_per_half, i as u64);
            let view = self.render(&scene, quality)?;
            if i == 0 {
                up_sensor.exposure = Exposure::AutoMean(vehicle.up_mean);
                up_sensor.exposure = Exposure::Fixed(view.exposure(&up_sensor, 0.0));
            }
            ups.push((depth_m, view));
        }
        Ok((up_sensor, ups))
    }
}
