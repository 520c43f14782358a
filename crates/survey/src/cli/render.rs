//! `uw render`: scene file -> picture, with layers, statistics and a way to stop early.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum, value_parser};
use uw_render::backend::{self, Device};
use uw_render::film::Film;
use uw_render::image::{ImageFormat, write_frame};
use uw_render::integrator::{self, Plan, Progress, RenderError, RenderStats};
use uw_render::layers::{RenderLayer, exr_image, picture};
use uw_render::prepare::Prepared;
use uw_render::scene::Scene;

use super::error::{CliError, note};
use super::progress::ProgressDisplay;
use super::{interrupt, output};

/// Arguments of `uw render`.
#[derive(Debug, Args)]
pub(super) struct RenderArguments {
    /// Scene file (uw-scene/1).
    scene: PathBuf,
    /// Picture: .exr holds linear radiance, .png and .tif go through the sensor of the scene.
    #[arg(short, long)]
    output: PathBuf,
    /// Samples per pixel. Default: the scene's, or no limit where a time limit or target error is given.
    #[arg(long, value_parser = value_parser!(u32).range(1..=1 << 30))]
    spp: Option<u32>,
    /// Stop after this time in seconds.
    #[arg(long, value_parser = positive)]
    time_limit_s: Option<f64>,
    /// Stop when the estimated relative error of the picture is at most this.
    #[arg(long, value_parser = positive)]
    target_error: Option<f64>,
    /// Seed of all random numbers, those of the sensor included.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Where to render.
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    backend: Backend,
    /// Graphics adapter: any part of its name, in any case (see `uw adapters`).
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Worker threads. Default: one per core.
    #[arg(long, value_parser = value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Most scatterings and reflections of a path, 0 for no limit. Default: the scene's.
    #[arg(long)]
    max_bounces: Option<u32>,
    /// Most neighbouring pixels of a row that share their daylight walks, on the processor and in water that holds nothing
    /// but lamps: about half the time for the same error, but the noise of these pixels is no longer independent.
    #[arg(long, value_name = "PIXELS", default_value_t = 1, value_parser = value_parser!(u32).range(1..=64))]
    share_walks: u32,
    /// Layers to add to an EXR: ambient, lamp.NAME (at 100 %), lamps, direct, backscatter, depth, normal,
    /// reflectance, transmittance, variance, all.
    #[arg(long, value_delimiter = ',')]
    layers: Vec<String>,
    /// Write facts about the render to this JSON file.
    #[arg(long)]
    stats: Option<PathBuf>,
    /// No progress on standard error.
    #[arg(long)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Backend {
    /// A GPU where there is one, else the processor: cpu-simd where it has AVX2 or AVX-512.
    Auto,
    /// All cores of the processor, in double precision.
    Cpu,
    /// The same with the GPU's kernels on its vector units: faster, in single precision.
    CpuSimd,
    /// A graphics adapter, also one that is only a program.
    Gpu,
}

impl From<Backend> for backend::Backend {
    fn from(backend: Backend) -> Self {
        match backend {
            Backend::Auto => Self::Auto,
            Backend::Cpu => Self::Cpu,
            Backend::CpuSimd => Self::CpuSimd,
            Backend::Gpu => Self::Gpu,
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a finite number > 0".to_owned()),
    }
}

impl RenderArguments {
    /// Checks everything that can be checked, renders, writes. With `json` standard error holds nothing but an
    /// error object.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let format = self.check()?;
        let warn = |text: fmt::Arguments<'_>| {
            if !json {
                note(format_args!("uw: warning: {text}"));
            }
        };
        let device = backend::Backend::from(self.place())
            .open(self.adapter.as_deref())
            .map_err(CliError::input)?;
        if self.backend == Backend::CpuSimd && !integrator::has_fast_lanes() {
            warn(format_args!(
                "this processor has no AVX2, so that --backend cpu-simd is slower than --backend cpu"
            ));
        }
        let cancel = interrupt::cancel_flag()?;
        let start = Instant::now();
        let scene = Scene::read(&self.scene).map_err(CliError::input)?;
        let lamp_names: Vec<String> = scene.lamps.iter().map(|lamp| lamp.name.clone()).collect();
        let layers = RenderLayer::by_names(&self.layers, &lamp_names)
            .map_err(|error| CliError::input(format!("--layers: {error}")))?;
        for warning in &scene.warnings {
            warn(format_args!("{warning}"));
        }
        let prepared = Prepared::build(&scene);
        let setup_s = start.elapsed().as_secs_f64();
        let plan = self.plan(&scene, &layers);
        let display = ProgressDisplay::start(
            self.quiet || json,
            plan.samples_per_pixel.is_some() || plan.time_limit.is_some(),
        );
        let observe = |progress: &Progress| show(&display, &plan, scene.camera.height, progress);
        let render = |device: &Device| device.render(&prepared, &plan, &cancel, &observe);
        let mut rendered = render(&device);
        if let Some(reason) = self.needs_native(&rendered) {
            warn(format_args!("{reason}; rendering with --backend cpu"));
            rendered = render(&Device::Cpu);
        }
        display.finish();
        let (film, mut stats) = rendered.map_err(no_picture)?;
        stats.setup_s += setup_s;
        if stats.cut_paths > 0 {
            warn(format_args!(
                "{} of {} paths were cut by limits of the kernels, the picture is too dark; --backend cpu has no such limits",
                stats.cut_paths, stats.paths
            ));
        }
        if stats.share_walks < self.share_walks {
            warn(format_args!(
                "--share-walks had no effect: it needs daylight, water that holds nothing but lamps, and a camera in it"
            ));
        }
        let result = Rendered {
            scene: &scene,
            prepared: &prepared,
            film: &film,
            stats: &stats,
        };
        self.write(format, &layers, &result)
    }

    /// Why the native path tracer has to render, where no backend is demanded: the kernels refuse the scene, or their
    /// limits made the picture too dark and there is no time limit.
    fn needs_native(&self, rendered: &Result<(Film, RenderStats), RenderError>) -> Option<String> {
        if self.backend != Backend::Auto {
            return None;
        }
        match rendered {
            Err(RenderError::Gpu(error)) => Some(error.to_string()),
            Ok((_, stats)) if stats.cut_paths > 0 => {
                let goes_on = !stats.interrupted && self.time_limit_s.is_none();
                goes_on.then(|| "limits of the kernels cut paths".to_owned())
            }
            _ => None,
        }
    }

    /// Where to render: sharing walks is a thing of the native path tracer.
    fn place(&self) -> Backend {
        match self.backend {
            Backend::Auto if self.share_walks > 1 => Backend::Cpu,
            backend => backend,
        }
    }

    /// What needs no scene: the names and places of the output files.
    fn check(&self) -> Result<ImageFormat, CliError> {
        if self.share_walks > 1 && matches!(self.backend, Backend::Gpu | Backend::CpuSimd) {
            return Err(CliError::input(
                "--share-walks works with --backend cpu only",
            ));
        }
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

    fn plan(&self, scene: &Scene, layers: &[RenderLayer]) -> Plan {
        let ends_otherwise = self.time_limit_s.is_some() || self.target_error.is_some();
        let of_scene = (!ends_otherwise).then_some(scene.render.samples_per_pixel);
        // A limit too long for a duration is no limit.
        let duration = |seconds| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
        Plan {
            samples_per_pixel: self.spp.or(of_scene),
            time_limit: self.time_limit_s.map(duration),
            target_error: self.target_error,
            seed: self.seed,
            threads: self.threads.map(usize::from),
            max_bounces: self.max_bounces.unwrap_or(scene.render.max_bounces),
            dark_lamps: layers.iter().any(|layer| layer.is_lamp()),
            share_walks: self.share_walks,
        }
    }

    fn write(
        &self,
        format: ImageFormat,
        layers: &[RenderLayer],
        result: &Rendered<'_>,
    ) -> Result<(), CliError> {
        let written = match format {
            ImageFormat::Exr => {
                let mut image = exr_image(result.prepared, result.film, layers);
                image.attributes = self.attributes(result.stats);
                image.write(&self.output)
            }
            ImageFormat::Png | ImageFormat::Tiff => {
                let sensor = result.scene.sensor.unwrap_or_default();
                let frame = sensor.expose(&picture(result.film), self.seed);
                write_frame(&self.output, &frame)
            }
        };
        written.map_err(CliError::failed)?;
        if let Some(path) = &self.stats {
            output::to_file(path, |file| {
                serde_json::to_writer_pretty(&mut *file, result.stats)?;
                writeln!(file)
            })?;
        }
        if result.stats.interrupted {
            return Err(kept(&self.output, result.stats));
        }
        Ok(())
    }

    /// What an EXR file says about its making.
    fn attributes(&self, stats: &RenderStats) -> Vec<(String, String)> {
        let scene = self.scene.file_name().unwrap_or_default();
        [
            ("uw.version", env!("CARGO_PKG_VERSION").to_owned()),
            ("uw.scene", scene.to_string_lossy().into_owned()),
            ("uw.seed", stats.seed.to_string()),
            ("uw.samples_per_pixel", stats.samples_per_pixel.to_string()),
            ("uw.backend", stats.backend.to_owned()),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .to_vec()
    }
}

/// A finished render and what it was made from.
struct Rendered<'a> {
    scene: &'a Scene,
    prepared: &'a Prepared,
    film: &'a Film,
    stats: &'a RenderStats,
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

fn no_picture(error: RenderError) -> CliError {
    match error {
        RenderError::Incomplete { .. } => {
            CliError::Interrupted(format!("interrupted: {error}; nothing has been written"))
        }
        RenderError::Threads { .. } | RenderError::Gpu(_) => CliError::failed(error),
    }
}

fn kept(output: &Path, stats: &RenderStats) -> CliError {
    let samples = stats.samples_per_pixel;
    CliError::Interrupted(format!(
        "interrupted: {} holds what was finished, {samples} samples per pixel",
        output.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_finite_and_positive() {
        assert_eq!(positive("1e-3"), Ok(1e-3));
        for text in ["0", "-1", "nan", "inf", "", "1s"] {
            assert!(positive(text).is_err(), "{text}");
        }
    }
}
