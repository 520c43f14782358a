//! The spectrum of the light that reaches a pixel, found on a thread of its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use glam::DVec2;
use uw_render::prepare::Geometry;
use uw_render::ray_spectrum::{BandRadiance, ray_spectrum};

use crate::background::step_back;
use crate::model::Settings;

/// Paths of each three bands.
const SAMPLES: u32 = 2048;

/// The light of a pixel by wavelength, once it is found.
pub struct PixelSpectrum {
    /// The settings it belongs to.
    pub settings: Settings,
    /// The pixel in the camera's own picture, column and row.
    pub pixel: DVec2,
    /// What was found, or why nothing.
    pub bands: Option<Result<Vec<BandRadiance>, String>>,
    coming: Receiver<Result<Vec<BandRadiance>, String>>,
    stop: Arc<AtomicBool>,
}

impl PixelSpectrum {
    /// Starts to trace the ray through `at`, in [0, 1] from the upper left corner; `wake` is called when it is done.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(
        settings: &Settings,
        geometry: &Arc<Geometry>,
        at: DVec2,
        wake: impl Fn() + Send + 'static,
    ) -> std::io::Result<Self> {
        let (sender, coming) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let (set, geometry, flag) = (settings.clone(), Arc::clone(geometry), Arc::clone(&stop));
        let camera = &settings.camera;
        let pixel = at * DVec2::new(f64::from(camera.width), f64::from(camera.height));
        std::thread::Builder::new()
            .name("pixel".to_owned())
            .spawn(move || {
                step_back();
                // Without a listener the window was closed.
                let _ = sender.send(find(&set, &geometry, pixel, &flag));
                wake();
            })?;
        Ok(Self {
            settings: settings.clone(),
            pixel: pixel.floor(),
            bands: None,
            coming,
            stop,
        })
    }

    /// Takes what was found.
    pub fn poll(&mut self) {
        if self.bands.is_none() {
            self.bands = match self.coming.try_recv() {
                Ok(bands) => Some(bands),
                Err(TryRecvError::Empty) => None,
                Err(TryRecvError::Disconnected) => Some(Err("the thread has ended".to_owned())),
            };
        }
    }
}

impl Drop for PixelSpectrum {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
    }
}

fn find(
    settings: &Settings,
    geometry: &Arc<Geometry>,
    pixel: DVec2,
    stop: &AtomicBool,
) -> Result<Vec<BandRadiance>, String> {
    let scene = settings.scene().map_err(|error| error.to_string())?;
    if scene.spectral.is_none() {
        return Err(
            "the water is known in three bands: choose \"spectral\" in its panel".to_owned(),
        );
    }
    let ray = scene.camera.ray(pixel.x, pixel.y);
    let ray = (ray.origin_m, ray.direction);
    ray_spectrum(&scene, geometry, ray, (SAMPLES, 1), stop).map_err(|error| error.to_string())
}
