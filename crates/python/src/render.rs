//! Renders.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use uw_render::backend::{Backend, Device, needs_double};
use uw_render::denoise::{self, DenoiseError};
use uw_render::film::Film;
use uw_render::image::ExrImage;
use uw_render::integrator::{Plan, RenderError, RenderStats};
use uw_render::layers::{RenderLayer, exr_image};

use crate::arrays;
use crate::errors::{value_error, warn};
use crate::interrupt::interruptible;
use crate::numbers::{self, choice, positive, samples, whole};
use crate::scene::Scene;

/// Time for the picture itself even where set-up has taken the whole limit, or the limit where that is shorter.
const LEAST_TIME: Duration = Duration::from_millis(500);
/// What the picture itself is called among the layers.
const PICTURE: &str = "image";

/// Where to render.
///
/// # Errors
/// A name that is none of the backends'.
pub(crate) fn backend(name: &str) -> PyResult<Backend> {
    let choices = [
        ("auto", Backend::Auto),
        ("cpu", Backend::Cpu),
        ("cpu-simd", Backend::CpuSimd),
        ("gpu", Backend::Gpu),
    ];
    choice("backend", name, choices)
}

/// What is asked for.
struct Job {
    backend: Backend,
    adapter: Option<String>,
    plan: Plan,
    layers: Vec<RenderLayer>,
    denoise: bool,
    begun: Instant,
}

/// What has been made of it.
struct Made {
    image: ExrImage,
    stats: RenderStats,
    /// Why double precision took over.
    taken_over: Option<String>,
}

/// Renders; returns arrays by the names of layers, the picture first, and facts as JSON. See ``uwguide.render``.
#[pyfunction]
#[pyo3(signature = (scene, *, spp, backend, layers, seed, adapter, threads, max_bounces, target_error, time_limit_s, denoise))]
#[expect(clippy::too_many_arguments, reason = "the keywords of uwguide.render")]
pub(crate) fn render<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    spp: Option<&Bound<'py, PyAny>>,
    backend: &str,
    layers: Vec<String>,
    seed: &Bound<'py, PyAny>,
    adapter: Option<String>,
    threads: Option<&Bound<'py, PyAny>>,
    max_bounces: Option<&Bound<'py, PyAny>>,
    target_error: Option<&Bound<'py, PyAny>>,
    time_limit_s: Option<&Bound<'py, PyAny>>,
    denoise: bool,
) -> PyResult<(Bound<'py, PyDict>, String)> {
    let begun = Instant::now();
    let scene = scene.get();
    let lamps: Vec<String> = scene.scene().lamps.iter().map(|l| l.name.clone()).collect();
    let layers = RenderLayer::by_names(&layers, &lamps)
        .map_err(|error| value_error(format_args!("layers: {error}")))?;
    let time_limit_s = positive("time_limit_s", time_limit_s)?;
    let target_error = positive("target_error", target_error)?;
    let ends_otherwise = time_limit_s.is_some() || target_error.is_some();
    let of_scene = (!ends_otherwise).then_some(scene.scene().render.samples_per_pixel);
    let plan = Plan {
        samples_per_pixel: spp.map(|spp| samples("spp", spp)).transpose()?.or(of_scene),
        time_limit: time_limit_s
            .map(|limit| Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX)),
        target_error,
        seed: numbers::seed(seed)?,
        threads: numbers::threads(threads)?,
        max_bounces: match max_bounces {
            Some(most) => whole("max_bounces", most, 0..=u32::MAX)?,
            None => scene.scene().render.max_bounces,
        },
        dark_lamps: layers.iter().any(|layer| layer.is_lamp()),
    };
    let job = Job {
        backend: self::backend(backend)?,
        adapter,
        plan,
        layers,
        denoise,
        begun,
    };
    job.check()?;
    let threads = job.plan.threads;
    let made = interruptible(py, threads, |cancel| job.make(scene, cancel))?;
    let made = made.map_err(value_error)?;
    made.warn(py)?;
    made.arrays(py)
}

impl Job {
    /// What can be said before the render.
    fn check(&self) -> PyResult<()> {
        let refused = |error: DenoiseError| Err(value_error(format_args!("denoise: {error}")));
        match self.plan.samples_per_pixel {
            _ if !self.denoise => Ok(()),
            _ if self.plan.target_error.is_some() => refused(DenoiseError::Endless),
            Some(samples) if samples % 2 == 1 => refused(DenoiseError::Samples { samples }),
            _ => Ok(()),
        }
    }

    /// Renders on the device that is asked for, or in double precision where any will do and single precision does not.
    fn make(&self, scene: &Scene, cancel: &AtomicBool) -> Result<Made, String> {
        let device = self.backend.open(self.adapter.as_deref());
        let device = device.map_err(|error| error.to_string())?;
        scene.prepared();
        let setup_s = self.begun.elapsed().as_secs_f64();
        let mut rendered = self.render(&device, scene, cancel);
        let taken_over = self.needs_double(&rendered);
        if taken_over.is_some() {
            rendered = self.render(&Device::Cpu, scene, cancel);
        }
        let (film, mut stats) = rendered.map_err(|error| error.to_string())?;
        stats.setup_s += setup_s;
        Ok(Made {
            image: exr_image(scene.prepared(), &film, &self.layers),
            stats,
            taken_over,
        })
    }

    fn render(
        &self,
        device: &Device,
        scene: &Scene,
        cancel: &AtomicBool,
    ) -> Result<(Film, RenderStats), DenoiseError> {
        let gone = self.begun.elapsed();
        let plan = Plan {
            time_limit: (self.plan.time_limit)
                .map(|limit| limit.saturating_sub(gone).max(limit.min(LEAST_TIME))),
            ..self.plan.clone()
        };
        let prepared = scene.prepared();
        if self.denoise {
            let is_source = |layer: &RenderLayer| layer.is_lamp() || *layer == RenderLayer::Ambient;
            let sources = self.layers.iter().any(is_source);
            denoise::render(device, prepared, &plan, sources, cancel, &|_| ())
        } else {
            Ok(device.render(prepared, &plan, cancel, &|_| ())?)
        }
    }

    /// Why double precision has to take over, where any backend will do.
    fn needs_double(&self, rendered: &Result<(Film, RenderStats), DenoiseError>) -> Option<String> {
        let rendered: Result<&RenderStats, &RenderError> = match rendered {
            _ if self.backend != Backend::Auto => return None,
            Ok((_, stats)) => Ok(stats),
            Err(DenoiseError::Render(error)) => Err(error),
            Err(_) => return None,
        };
        needs_double(rendered, self.plan.time_limit.is_some())
    }
}

impl Made {
    /// Tells what is not as it should be.
    fn warn(&self, py: Python<'_>) -> PyResult<()> {
        let stats = &self.stats;
        let taken_over = (self.taken_over.as_ref())
            .map(|reason| format!("{reason}; rendered with backend=\"cpu\""));
        let coarse = (stats.filled_pixels > 0).then(|| {
            format!(
                "time_limit_s did not last for a sample of every pixel: {} pixels show a coarse picture and have an infinite variance",
                stats.filled_pixels
            )
        });
        let cut = (stats.cut_paths > 0).then(|| {
            format!(
                "{} of {} paths were cut by limits of the kernels, the picture is too dark; backend=\"cpu\" has no such limits",
                stats.cut_paths, stats.paths
            )
        });
        warn(py, 2, [taken_over, coarse, cut].into_iter().flatten())
    }

    /// The arrays by name, the picture first.
    fn arrays(self, py: Python<'_>) -> PyResult<(Bound<'_, PyDict>, String)> {
        let stats = serde_json::to_string(&self.stats).map_err(value_error)?;
        let ExrImage {
            picture, layers, ..
        } = self.image;
        let size = [picture.height as usize, picture.width as usize];
        let arrays = PyDict::new(py);
        arrays.set_item(PICTURE, arrays::of_picture(py, picture)?)?;
        for layer in layers {
            arrays.set_item(layer.name, arrays::of_layer(py, layer.data, size)?)?;
        }
        Ok((arrays, stats))
    }
}
