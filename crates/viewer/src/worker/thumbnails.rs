//! Small pictures of scene files, rendered and denoised one after the other behind everything else.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use egui::ColorImage;
use uw_render::{backend::Device, denoise, integrator::Plan, prepare::Prepared};

use crate::background::step_back;
use crate::model::display::compose;
use crate::model::{Display, OpenScene, Settings};

/// Most pixels along the edges.
pub const SIZE_PX: (u32, u32) = (160, 90);
/// Samples per pixel.
const SAMPLES: u32 = 16;
/// Most time for one.
const MOST_TIME: Duration = Duration::from_secs(6);

/// A small picture, or why there is none.
pub type Thumbnail = Result<ColorImage, String>;

/// Pictures that are asked for and made.
#[derive(Debug)]
pub struct Thumbnails {
    asked: Sender<PathBuf>,
    made: Receiver<(PathBuf, Thumbnail)>,
    known: HashMap<PathBuf, Option<Thumbnail>>,
    stop: Arc<AtomicBool>,
}

impl Thumbnails {
    /// Starts the thread that makes them; it calls `wake` after each.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let (asked, files) = channel::<PathBuf>();
        let (sender, made) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        std::thread::Builder::new()
            .name("thumbnails".to_owned())
            .spawn(move || {
                step_back();
                for file in files {
                    let thumbnail = render(&file, &flag);
                    if flag.load(Ordering::Acquire) || sender.send((file, thumbnail)).is_err() {
                        return;
                    }
                    wake();
                }
            })?;
        Ok(Self {
            asked,
            made,
            known: HashMap::new(),
            stop,
        })
    }

    /// The picture of a file, or `None` while it is waited for; it is asked for when this is called first.
    pub fn of(&mut self, file: &Path) -> Option<&Thumbnail> {
        for (file, thumbnail) in self.made.try_iter() {
            self.known.insert(file, Some(thumbnail));
        }
        if !self.known.contains_key(file) {
            self.known.insert(file.to_path_buf(), None);
            // Without the thread there are no pictures, and names do.
            let _ = self.asked.send(file.to_path_buf());
        }
        self.known.get(file).and_then(Option::as_ref)
    }
}

impl Drop for Thumbnails {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
    }
}

fn render(file: &Path, stop: &AtomicBool) -> Thumbnail {
    let (open, settings) = OpenScene::read(file).map_err(|error| error.to_string())?;
    let settings = Settings {
        camera: small(&settings),
        ..settings
    };
    let scene = settings.scene().map_err(|error| error.to_string())?;
    let prepared = Prepared::build_unsteered(&scene, open.geometry);
    let plan = Plan {
        samples_per_pixel: Some(SAMPLES),
        time_limit: Some(MOST_TIME),
        max_bounces: settings.max_bounces,
        ..Plan::new(1)
    };
    let on = |device: Device| denoise::render(&device, &prepared, &plan, false, stop, &|_| ());
    // What the kernels refuse, double precision takes.
    let rendered = on(Device::CpuSimd).or_else(|_| on(Device::Cpu));
    let (film, _) = rendered.map_err(|error| error.to_string())?;
    let shown = compose(&prepared, &film, &Display::default(), &settings.sensor());
    let image = shown.image().cloned();
    image.ok_or_else(|| "no picture was made".to_owned())
}

/// The camera with as many pixels as fit.
fn small(settings: &Settings) -> crate::model::CameraSettings {
    let camera = &settings.camera;
    let scale = (f64::from(SIZE_PX.0) / f64::from(camera.width))
        .min(f64::from(SIZE_PX.1) / f64::from(camera.height));
    let edge = |pixels: u32| ((f64::from(pixels) * scale).round() as u32).max(1);
    camera.resized(edge(camera.width), edge(camera.height))
}
