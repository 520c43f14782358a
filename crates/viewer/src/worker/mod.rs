//! The render worker: a thread that refines the picture of the newest settings and never blocks the window.
//!
//! Every change of settings is a new *generation*. The worker drops what it does for an older one, except that a
//! first coarse picture that takes no longer than its [`stages::Grace`] is finished, so that pictures go on coming while
//! a slider is dragged. Pictures carry their generation: the window shows one of an older generation as such.

mod clean;
mod daylight;
mod engine;
mod exports;
mod pixel;
mod refine;
mod run;
mod stages;
mod textures;
pub mod thumbnails;

pub use pixel::PixelSpectrum;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use uw_render::{
    backend::Device,
    denoise::DenoiseFacts,
    layers::RenderLayer,
    prepare::Geometry,
    scene::{Camera, Sensor},
};

use crate::model::{Display, Settings, display::Shown};

/// A render that is wanted.
#[derive(Clone, Debug)]
pub struct Job {
    /// Number of the settings; higher is newer.
    pub generation: u64,
    /// The settings; the camera has the size of the finished picture.
    pub settings: Settings,
    /// The surfaces.
    pub geometry: Arc<Geometry>,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// When a picture is finished.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Most samples per pixel.
    pub samples_per_pixel: u64,
    /// Estimated relative error at which it is good enough.
    pub target_error: Option<f64>,
}

impl Default for Goal {
    fn default() -> Self {
        Self {
            samples_per_pixel: 4096,
            target_error: Some(0.03),
        }
    }
}

/// How the film is looked at; a change needs no new render.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Layer and colours.
    pub display: Display,
    /// The sensor.
    pub sensor: Sensor,
    /// Whether radiances are wanted on the host, for the probe; without a window's adapter they always come.
    pub probing: bool,
    /// Whether the picture is wanted on the host, to be counted, marked or kept; without a window's adapter it always is.
    pub on_host: bool,
    /// Whether the picture is wanted denoised, which is biased; a second half of the samples is rendered for it.
    pub denoised: bool,
}

/// What the worker is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Adding samples.
    Refining,
    /// Stopped by hand.
    Paused,
    /// The goal is reached.
    Done,
}

/// A picture with all that is known about it.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Generation of its settings.
    pub generation: u64,
    /// Revision of the view it was made for.
    pub view_revision: u64,
    /// Number of the frame; every one published is higher.
    pub serial: u64,
    /// Pixels of the finished picture per pixel of this one, along an edge; 1 for full resolution.
    pub coarseness: u32,
    /// The picture.
    pub shown: Shown,
    /// The camera that took it, of this frame's size.
    pub camera: Camera,
    /// The surfaces that it shows.
    pub geometry: Arc<Geometry>,
    /// Samples per pixel.
    pub samples: u64,
    /// Estimated relative error; `None` before the second batch.
    pub relative_error: Option<f64>,
    /// What denoising came to; `None` of a picture that is as it was rendered.
    pub denoised: Option<DenoiseFacts>,
    /// Samples (paths from the camera) per second since the stage began.
    pub samples_per_s: f64,
    /// Time from the request to the start of this frame's stage, s.
    pub begun_after_s: f64,
    /// Time from the request to this frame, s.
    pub since_request_s: f64,
    /// What the worker was about when it was made.
    pub activity: Activity,
    /// Name of the backend.
    pub backend: Arc<str>,
}

/// A file to write from the film.
#[derive(Clone, Debug, PartialEq)]
pub enum Export {
    /// Linear float with these layers; `None` for all.
    Exr {
        /// The file.
        path: PathBuf,
        /// The layers.
        layers: Option<Vec<RenderLayer>>,
    },
    /// What the sensor makes of the picture.
    Photograph {
        /// The file: PNG or TIFF.
        path: PathBuf,
        /// Seed of the sensor noise.
        seed: u64,
    },
}

impl Export {
    /// The file.
    pub fn path(&self) -> &PathBuf {
        match self {
            Self::Exr { path, .. } | Self::Photograph { path, .. } => path,
        }
    }
}

/// News from the worker.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// These settings cannot be rendered, and why.
    Failed {
        /// Their generation.
        generation: u64,
        /// The reason.
        message: String,
    },
    /// The graphics adapter failed; the processor goes on.
    FellBack {
        /// The reason.
        message: String,
    },
    /// A file was written.
    Exported(PathBuf),
    /// A file could not be written, and why.
    NotExported(String),
}

/// Where pictures are rendered.
#[derive(Clone, Debug, Default)]
pub struct RenderDevice {
    /// What renders. Pictures stay on a graphics adapter that is shared with the window.
    pub device: Device,
    /// Threads on the processor; `None` for one per core.
    pub threads: Option<usize>,
}

/// What window and worker share.
struct Shared {
    inbox: Mutex<Inbox>,
    arrived: Condvar,
    /// Newest generation.
    wanted: AtomicU64,
    /// Something besides a new job is in the inbox.
    attention: AtomicBool,
    quit: AtomicBool,
    latest: Mutex<Option<Arc<Frame>>>,
    serial: AtomicU64,
    wake: Box<dyn Fn() + Send + Sync>,
}

struct Inbox {
    job: Option<Job>,
    /// When the job was asked for.
    asked: std::time::Instant,
    view: View,
    view_revision: u64,
    goal: Goal,
    paused: bool,
    exports: Vec<Export>,
}

impl Shared {
    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The worker, as the window sees it. Dropping it ends the thread.
pub struct Worker {
    shared: Arc<Shared>,
    news: Receiver<News>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread. `wake` is called from it whenever there is something new.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(
        render_device: RenderDevice,
        view: View,
        goal: Goal,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            inbox: Mutex::new(Inbox {
                job: None,
                asked: std::time::Instant::now(),
                view,
                view_revision: 0,
                goal,
                paused: false,
                exports: Vec::new(),
            }),
            arrived: Condvar::new(),
            wanted: AtomicU64::new(0),
            attention: AtomicBool::new(false),
            quit: AtomicBool::new(false),
            latest: Mutex::new(None),
            serial: AtomicU64::new(0),
            wake: Box::new(wake),
        });
        let (sender, news) = channel();
        let for_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("render".to_owned())
            .spawn(move || run::work(&for_thread, &sender, render_device))?;
        Ok(Self {
            shared,
            news,
            thread: Some(thread),
        })
    }

    /// Asks for a picture of new settings; work on older ones ends.
    pub fn submit(&self, job: Job) {
        self.shared.wanted.store(job.generation, Ordering::Release);
        self.tell(|inbox| {
            inbox.asked = std::time::Instant::now();
            inbox.job = Some(job);
        });
    }

    /// Changes the way the film is looked at; returns the revision that frames of it carry.
    pub fn set_view(&self, view: View) -> u64 {
        self.tell(|inbox| {
            if inbox.view != view {
                inbox.view = view;
                inbox.view_revision += 1;
            }
            inbox.view_revision
        })
    }

    /// Changes when a picture is finished.
    pub fn set_goal(&self, goal: Goal) {
        self.tell(|inbox| inbox.goal = goal);
    }

    /// Stops adding samples, or goes on.
    pub fn set_paused(&self, paused: bool) {
        self.tell(|inbox| inbox.paused = paused);
    }

    /// Asks for a file of the picture as it is then.
    pub fn export(&self, export: Export) {
        self.tell(|inbox| inbox.exports.push(export));
    }

    /// The newest picture.
    pub fn latest(&self) -> Option<Arc<Frame>> {
        let latest = self.shared.latest.lock();
        latest.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The next news.
    pub fn news(&self) -> Option<News> {
        self.news.try_recv().ok()
    }

    /// Whether the thread runs.
    pub fn is_alive(&self) -> bool {
        self.thread.as_ref().is_some_and(|t| !t.is_finished())
    }

    fn tell<T>(&self, change: impl FnOnce(&mut Inbox) -> T) -> T {
        let result = change(&mut self.shared.inbox());
        self.shared.attention.store(true, Ordering::Release);
        self.shared.arrived.notify_all();
        result
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::Release);
        self.shared.arrived.notify_all();
        if let Some(thread) = self.thread.take() {
            // A panic in the thread has been printed by then.
            let _ = thread.join();
        }
    }
}

/// What the thread sends.
struct Mouth<'a> {
    shared: &'a Shared,
    news: &'a Sender<News>,
}

impl Mouth<'_> {
    fn say(&self, news: News) {
        // Without a listener the window has closed.
        let _ = self.news.send(news);
        (self.shared.wake)();
    }

    fn publish(&self, frame: Frame) {
        let mut latest = self
            .shared
            .latest
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        *latest = Some(Arc::new(frame));
        drop(latest);
        (self.shared.wake)();
    }
}
