//! `uw sequence`: scene and trajectory -> pictures, depth, poses and camera.

use std::cell::Cell;
use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use uw_render::layers::RenderLayer;
use uw_render::scene::Scene;

use super::device::{BackendChoice, DeviceArguments};
use super::error::{CliError, note};
use super::progress::ProgressDisplay;
use super::scene::SceneArguments;
use super::values::{positive, samples};
use super::{interrupt, output, scene_file};
use crate::dataset::Shard;
use crate::sequence::{
    self, Export, Made, Observer, RunOptions, Sequence, SequenceConfig, SequenceError, Shutter,
    Trajectory,
};

/// Arguments of `uw sequence`.
#[derive(Debug, Args)]
pub(super) struct SequenceArguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Poses: TUM (`time_s tx ty tz qx qy qz qw`) or CSV with a header, see docs/sequence.md.
    trajectory: PathBuf,
    /// Folder for the frames; an interrupted run goes on there.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// A second camera, so many metres to the right of the first.
    #[arg(long, value_name = "BASELINE_M", value_parser = positive)]
    stereo: Option<f64>,
    /// Frames in a second, between the poses of the file. Default: a frame for each pose.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    rate_hz: Option<f64>,
    /// Exposure, s: pictures are blurred by the motion along the poses of the file. A frame begins at its pose.
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    exposure_s: Option<f64>,
    /// Rolling shutter: time from the first row's exposure to the last's, s.
    #[arg(long, value_name = "S", value_parser = positive, allow_hyphen_values = true)]
    rolling_shutter_s: Option<f64>,
    /// What to write when all frames are there: lists as of the TUM data sets are always written.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "tum")]
    format: Vec<FormatChoice>,
    /// Lamps that stay where the scene has them.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    fixed_lamp: Vec<String>,
    /// Make part i of n (1 <= i <= n); the part that finds all others done writes lists and exports.
    #[arg(long, value_name = "i/n", value_parser = Shard::parse)]
    shard: Option<Shard>,
    /// Go on with what the folder holds. This is what happens anyway; the option only refuses a folder that holds nothing.
    #[arg(long)]
    resume: bool,
    /// Samples per pixel. Default: the scene's.
    #[arg(long, value_name = "N", value_parser = samples)]
    spp: Option<u32>,
    /// Take the noise off, as in `uw render`; the samples per pixel must be even.
    #[arg(long)]
    denoise: bool,
    /// Layers of the EXR files besides depth, as in `uw render`.
    #[arg(long, value_delimiter = ',')]
    layers: Vec<String>,
    /// Most scatterings and reflections of a path, 0 for no limit. Default: the scene's.
    #[arg(long)]
    max_bounces: Option<u32>,
    /// Seed of all random numbers; every frame has its own noise.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    device: DeviceArguments,
    /// No progress and no summary.
    #[arg(short, long)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FormatChoice {
    /// groundtruth.txt, rgb.txt, depth.txt, camera.json.
    Tum,
    /// colmap/cameras.txt, images.txt, points3D.txt.
    Colmap,
    /// transforms.json.
    Nerfstudio,
    /// sequence.mcap, messages of ROS 2.
    Mcap,
}

impl SequenceArguments {
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let start = Instant::now();
        if self.resume && !self.output.join("sequence.json").is_file() {
            let folder = self.output.display();
            return Err(CliError::input(format_args!(
                "{folder}: nothing to resume, it holds no sequence.json"
            )));
        }
        let path = Trajectory::read(&self.trajectory).map_err(CliError::input)?;
        let trajectory = self.frames_of(&path)?;
        let scene = self.scene.read()?;
        let lamp_names: Vec<String> = scene.lamps.iter().map(|lamp| lamp.name.clone()).collect();
        let layers = RenderLayer::by_names(&self.layers, &lamp_names)
            .map_err(|error| CliError::input(format!("--layers: {error}")))?;
        let config = self.config(&scene, (&trajectory, &path), &lamp_names)?;
        if !json {
            scene
                .warnings
                .iter()
                .for_each(|warning| note(format_args!("uw: warning: {warning}")));
        }
        let device = self.device.open()?;
        let cancel = interrupt::cancel_flag()?;
        let exports: Vec<Export> = self
            .format
            .iter()
            .filter_map(|format| format.export())
            .collect();
        let display = ProgressDisplay::start(self.quiet || json, true);
        let progress = |frame: usize, frames: usize, share: f64| {
            display.update(Some((frame as f64 + share) / frames.max(1) as f64), || {
                format!("picture {} of {frames}", frame + 1)
            });
        };
        let said = Cell::new(false);
        let observer = Observer {
            progress: &progress,
            tell: &|line| {
                // The same thing is wrong with every frame.
                if !json && !said.replace(true) {
                    display.suspended(|| note(format_args!("uw: warning: {line}")));
                }
            },
            cancel: &cancel,
        };
        let sequence = Sequence {
            scene: &scene,
            trajectory: &trajectory,
            path: &path,
            config: &config,
            layers: &layers,
        };
        let options = RunOptions {
            device: &device,
            falls_back: self.device.backend == BackendChoice::Auto,
            shard: self.shard.unwrap_or(Shard::WHOLE),
            threads: self.device.threads(),
            exports: &exports,
        };
        let made = sequence::make(&sequence, &self.output, &options, &observer);
        display.finish();
        self.tell(&made.map_err(explain)?, start, json)
    }

    fn frames_of(&self, path: &Trajectory) -> Result<Trajectory, CliError> {
        match self.rate_hz {
            None => Ok(path.clone()),
            Some(rate_hz) => path
                .at_rate(rate_hz)
                .map_err(|error| CliError::input(format_args!("--rate-hz: {error}"))),
        }
    }

    fn config(
        &self,
        scene: &Scene,
        (trajectory, path): (&Trajectory, &Trajectory),
        lamps: &[String],
    ) -> Result<SequenceConfig, CliError> {
        if let Some(unknown) = self.fixed_lamp.iter().find(|name| !lamps.contains(name)) {
            return Err(CliError::input(format_args!(
                "--fixed-lamp {unknown}: the scene has no such lamp, its lamps are {}",
                lamps.join(", ")
            )));
        }
        let samples_per_pixel = self.spp.unwrap_or(scene.render.samples_per_pixel);
        if self.denoise && samples_per_pixel % 2 == 1 {
            return Err(CliError::input(format_args!(
                "--denoise needs an even number of samples per pixel, got {samples_per_pixel}"
            )));
        }
        let shutter = Shutter {
            exposure_s: self.exposure_s.unwrap_or_default(),
            rolling_s: self.rolling_shutter_s.unwrap_or_default(),
        };
        let file = scene_file(&self.scene.scene)?;
        let text = uw_assets::ALL
            .read_to_string(&file)
            .map_err(CliError::input)?;
        Ok(SequenceConfig {
            format: SequenceConfig::format(),
            scene: self.scene.scene.display().to_string(),
            scene_crc32: crc32fast::hash(text.as_bytes()),
            frames: trajectory.poses().len(),
            poses_crc32: SequenceConfig::checksum(trajectory),
            shutter,
            path_crc32: (!shutter.is_instant()).then(|| SequenceConfig::checksum(path)),
            changes: self.scene.changes(),
            fixed_lamps: self.fixed_lamp.clone(),
            stereo_baseline_m: self.stereo,
            samples_per_pixel,
            max_bounces: self.max_bounces.unwrap_or(scene.render.max_bounces),
            denoise: self.denoise,
            layers: self.layers.clone(),
            seed: self.seed,
        })
    }

    fn tell(&self, made: &Made, start: Instant, json: bool) -> Result<(), CliError> {
        let seconds = start.elapsed().as_secs_f64();
        let folder = self.output.display();
        if json {
            let object = serde_json::json!({
                "folder": folder.to_string(), "frames": made.frames, "rendered": made.rendered, "missing": made.missing, "seconds": seconds,
            });
            return output::to_stdout(|out| writeln!(out, "{object}"));
        }
        if self.quiet {
            return Ok(());
        }
        let rest = match made.missing {
            0 => String::new(),
            missing => {
                format!("; {missing} pictures of other parts are missing before there are lists")
            }
        };
        note(format_args!(
            "{folder}: {} frames, {} pictures rendered in {seconds:.1} s{rest}",
            made.frames, made.rendered
        ));
        Ok(())
    }
}

impl FormatChoice {
    fn export(self) -> Option<Export> {
        match self {
            Self::Tum => None,
            Self::Colmap => Some(Export::Colmap),
            Self::Nerfstudio => Some(Export::Nerfstudio),
            Self::Mcap => Some(Export::Mcap),
        }
    }
}

fn explain(error: SequenceError) -> CliError {
    match error {
        SequenceError::Interrupted { .. } => CliError::Interrupted(error.to_string()),
        SequenceError::Folder(_) | SequenceError::Unsuitable(_) => CliError::input(error),
        SequenceError::Image(_) | SequenceError::Render { .. } => CliError::failed(error),
    }
}
