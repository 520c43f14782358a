//! `uw render`: scene file -> picture, with layers, statistics and a way to stop early. [`files`] writes, [`summary`] tells
//! what came out, [`writing`] reckons how long that takes.

mod files;
mod summary;
mod writing;

use std::fmt;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::{Args, value_parser};
use uw_render::backend::{Device, needs_double};
use uw_render::denoise::{self, DenoiseError};
use uw_render::film::Film;
use uw_render::image::ImageFormat;
use uw_render::integrator::{Plan, Progress, RenderError, RenderStats};
use uw_render::layers::RenderLayer;
use uw_render::prepare::Prepared;
use uw_render::scene::Scene;

use super::device::{BackendChoice, DeviceArguments};
use super::error::{CliError, note};
use super::progress::ProgressDisplay;
use super::scene::SceneArguments;
use super::values::{positive, relative_error, samples};
use super::{interrupt, output};
use files::Rendered;
use summary::RenderSummary;
use writing::Writing;

/// Time for the picture itself even where set-up has taken the whole limit, or the limit where that is shorter.
const LEAST_TIME: Duration = Duration::from_millis(500);

/// Arguments of `uw render`.
#[derive(Debug, Args)]
pub(super) struct RenderArguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Picture: .exr holds linear radiance, .png and .tif go through the sensor of the scene.
    #[arg(short, long)]
    output: PathBuf,
    /// Samples per pixel, 256 or 1e6. Default: the scene's, or no limit where a time limit or target error is given.
    #[arg(long, value_name = "N", value_parser = samples)]
    spp: Option<u32>,
    /// Stop after this time in seconds, set-up and, for large pictures, writing included. Where it does not last for a
    /// sample of every pixel the picture is coarse, and a warning says so.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    time_limit_s: Option<f64>,
    /// Stop when the estimated relative error of the picture is at most this: 0.05 or 5%.
    #[arg(long, value_name = "ERROR", value_parser = relative_error)]
    target_error: Option<f64>,
    /// Seed of all random numbers, those of the sensor included.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    device: DeviceArguments,
    /// Most scatterings and reflections of a path, 0 for no limit. Default: the scene's.
    #[arg(long)]
    max_bounces: Option<u32>,
    /// Without effect: pixels share no walks any more, the vector units are as fast without.
    #[arg(long, hide = true, value_name = "PIXELS", default_value_t = 1, value_parser = value_parser!(u32).range(1..=64))]
    share_walks: u32,
    /// Layers to add to an EXR: ambient, lamp.NAME (at 100 %), lamps, direct, backscatter, depth, position,
    /// normal, reflectance, transmittance, variance, all.
    #[arg(long, value_delimiter = ',')]
    layers: Vec<String>,
    /// Take the noise off: layers are fitted to what is known of the first surfaces. Biased, with an estimate of the error that
    /// is left; the samples per pixel must be even, and under a time limit half of it goes into each half of them.
    #[arg(long, conflicts_with = "target_error")]
    denoise: bool,
    /// Write facts about the render to this JSON file.
    #[arg(long)]
    stats: Option<PathBuf>,
    /// No progress and no summary on standard error.
    #[arg(long)]
    quiet: bool,
}

impl RenderArguments {
    /// Checks everything that can be checked, renders, writes. With `json` standard error holds nothing but an
    /// error object.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let start = Instant::now();
        let format = self.check()?;
        let warn = |text: fmt::Arguments<'_>| {
            if !json {
                note(format_args!("uw: warning: {text}"));
            }
        };
        let device = self.device.open()?;
        if let Some(error) = self.target_error.filter(|error| *error >= 1.0) {
            warn(format_args!(
                "--target-error {error} is an error of {} %; 5 % is 0.05 or 5%",
                100.0 * error
            ));
        }
        let cancel = interrupt::cancel_flag()?;
        let scene = self.scene.read()?;
        let lamp_names: Vec<String> = scene.lamps.iter().map(|lamp| lamp.name.clone()).collect();
        let layers = RenderLayer::by_names(&self.layers, &lamp_names)
            .map_err(|error| CliError::input(format!("--layers: {error}")))?;
        for warning in &scene.warnings {
            warn(format_args!("{warning}"));
        }
        let prepared = Prepared::build(&scene);
        let reserve = self.reserve(format, &scene, &layers);
        let setup_s = start.elapsed().as_secs_f64();
        let plan = self.plan(&scene, &layers, start.elapsed() + reserve);
        if let Some(error) = self.not_halved(&plan) {
            return Err(CliError::input(format!("--denoise: {error}")));
        }
        let display = ProgressDisplay::start(
            self.quiet || json,
            plan.samples_per_pixel.is_some() || plan.time_limit.is_some(),
        );
        let observe = |progress: &Progress| show(&display, &plan, scene.camera.height, progress);
        let render = |device: &Device, plan: &Plan| match self.denoise {
            false => Ok(device.render(&prepared, plan, &cancel, &observe)?),
            true => {
                let sources = layers.iter().any(|&layer| is_source(layer));
                denoise::render(device, &prepared, plan, sources, &cancel, &observe)
            }
        };
        let mut rendered = render(&device, &plan);
        if let Some(reason) = self.needs_double(&rendered) {
            warn(format_args!("{reason}; rendering with --backend cpu"));
            rendered = render(&Device::Cpu, &self.plan(&scene, &layers, start.elapsed()));
        }
        display.finish();
        let (film, mut stats) = rendered.map_err(no_picture)?;
        stats.setup_s += setup_s;
        self.warn_of(&stats, &warn);
        let result = Rendered {
            scene: &scene,
            prepared: &prepared,
            film: &film,
            stats: &stats,
        };
        self.write(format, &layers, &result)?;
        let summary = RenderSummary {
            file: &self.output,
            size_px: (film.width, film.height),
            stats: &stats,
            seconds: start.elapsed().as_secs_f64(),
        };
        summary.tell(json, self.quiet)
    }

    /// Time that is left for writing under a time limit.
    fn reserve(&self, format: ImageFormat, scene: &Scene, layers: &[RenderLayer]) -> Duration {
        let Some(limit) = self.time_limit_s else {
            return Duration::ZERO;
        };
        let writing = Writing {
            file: &self.output,
            format,
            sensor: scene.sensor.unwrap_or_default(),
            pixels: u64::from(scene.camera.width) * u64::from(scene.camera.height),
            layers: layers.len(),
        };
        writing.reserve(limit_of(limit))
    }

    /// The number of samples that cannot be halved, where denoising needs halves.
    fn not_halved(&self, plan: &Plan) -> Option<DenoiseError> {
        let samples = plan.samples_per_pixel.filter(|_| self.denoise)?;
        (samples % 2 == 1).then_some(DenoiseError::Samples { samples })
    }

    /// What is not as it should be in a finished render.
    fn warn_of(&self, stats: &RenderStats, warn: &dyn Fn(fmt::Arguments<'_>)) {
        if let (Some(step), Some(samples)) = (stats.coarse_step_px, stats.coarse_samples) {
            let limit = self.time_limit_s.unwrap_or_default();
            warn(format_args!(
                "{limit} s did not last for a sample of every pixel: {} pixels show a coarse picture, squares of {step} × \
                 {step} pixels with {samples} samples each, and have an infinite variance",
                stats.filled_pixels
            ));
        }
        if stats.cut_paths > 0 {
            warn(format_args!(
                "{} of {} paths were cut by limits of the kernels, the picture is too dark; --backend cpu has no such limits",
                stats.cut_paths, stats.paths
            ));
        }
        if stats.share_walks < self.share_walks {
            warn(format_args!(
                "--share-walks has no effect any more: the noise of every pixel is independent"
            ));
        }
    }

    /// Why double precision has to render, where no backend is demanded: the kernels refuse the scene, or their
    /// limits made the picture too dark and there is no time limit.
    fn needs_double(&self, rendered: &Result<(Film, RenderStats), DenoiseError>) -> Option<String> {
        if self.device.backend != BackendChoice::Auto {
            return None;
        }
        let rendered = match rendered {
            Ok((_, stats)) => Ok(stats),
            Err(DenoiseError::Render(error)) => Err(error),
            Err(_) => return None,
        };
        needs_double(rendered, self.time_limit_s.is_some())
    }

    /// What needs no scene: the names and places of the output files.
    fn check(&self) -> Result<ImageFormat, CliError> {
        let format = ImageFormat::of(&self.output).map_err(CliError::input)?;
        if format != ImageFormat::Exr && !self.layers.is_empty() {
            let file = self.output.display();
            return Err(CliError::input(format!(
                "--layers needs an .exr output, got {file}"
            )));
        }
        output::check_writable(&self.output)?;
        if let Some(stats) = &self.stats {
            output::check_writable(stats)?;
            if output::same_file(stats, &self.output) {
                return Err(CliError::input(
                    "--stats and --output must be different files",
                ));
            }
        }
        Ok(format)
    }

    /// What to render, where `gone` has gone of the time.
    fn plan(&self, scene: &Scene, layers: &[RenderLayer], gone: Duration) -> Plan {
        let ends_otherwise = self.time_limit_s.is_some() || self.target_error.is_some();
        let of_scene = (!ends_otherwise).then_some(scene.render.samples_per_pixel);
        Plan {
            samples_per_pixel: self.spp.or(of_scene),
            time_limit: self.time_limit_s.map(|limit| {
                let limit = limit_of(limit);
                limit.saturating_sub(gone).max(limit.min(LEAST_TIME))
            }),
            target_error: self.target_error,
            seed: self.seed,
            threads: self.device.threads(),
            max_bounces: self.max_bounces.unwrap_or(scene.render.max_bounces),
            dark_lamps: layers.iter().any(|layer| layer.is_lamp()),
        }
    }
}

/// A time limit; one too long for a duration is none.
fn limit_of(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}

fn show(display: &ProgressDisplay, plan: &Plan, height: u32, progress: &Progress) {
    let of_rows = progress
        .rows_total
        .map(|total| progress.rows_done as f64 / total as f64);
    let of_time = plan
        .time_limit
        .map(|limit| progress.elapsed.as_secs_f64() / limit.as_secs_f64());
    let share = of_rows.into_iter().chain(of_time).reduce(f64::max);
    display.update(share.map(|share| share.min(1.0)), || {
        let batches = progress.rows_done / u64::from(height);
        format!("rendering, {batches} rounds over the picture done")
    });
}

/// Whether the layer is that of some of the sources.
fn is_source(layer: RenderLayer) -> bool {
    layer.is_lamp() || layer == RenderLayer::Ambient
}

fn no_picture(error: DenoiseError) -> CliError {
    let error = match error {
        DenoiseError::Render(error) => error,
        other => return CliError::failed(format!("--denoise: {other}")),
    };
    match error {
        RenderError::Incomplete { .. } => {
            CliError::Interrupted(format!("interrupted: {error}; nothing has been written"))
        }
        RenderError::LightLost { .. } => CliError::failed(format!(
            "{error}; --backend cpu reckons in double precision"
        )),
        RenderError::Threads { .. } | RenderError::Gpu(_) | RenderError::NotFinite(_) => {
            CliError::failed(error)
        }
    }
}
