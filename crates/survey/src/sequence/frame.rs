//! One picture of a sequence: rendered, and written with its depth.

use std::fs;
use std::path::{Path, PathBuf};

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use uw_render::backend::{Device, needs_double};
use uw_render::denoise::{self, DenoiseError};
use uw_render::film::Film;
use uw_render::image::{ExrImage, ImageError, LayerData, write_atomically, write_frame};
use uw_render::integrator::{Plan, Progress, RenderError, RenderStats};
use uw_render::layers::{RenderLayer, exr_image, picture};
use uw_render::prepare::Prepared;

use super::{Observer, RunOptions, SequenceError, Stage};

/// Depths of a PNG are in mm; 0 is none, or one beyond the largest.
const PER_M: f32 = 1000.0;

/// A camera of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Eye {
    /// The only one, or the left one: that of the poses.
    Left,
    /// Another one, so many metres to its right.
    Right(f64),
}

impl Eye {
    pub(super) fn of(stereo_baseline_m: Option<f64>) -> Vec<Self> {
        let right = stereo_baseline_m.map(Self::Right);
        std::iter::once(Self::Left).chain(right).collect()
    }

    pub(super) fn offset_m(self) -> f64 {
        match self {
            Self::Left => 0.0,
            Self::Right(baseline_m) => baseline_m,
        }
    }

    /// The picture, which is written last: where it is there, the rest is.
    pub(super) fn picture(self, folder: &Path, k: usize) -> PathBuf {
        self.file(folder, "rgb", k, "png")
    }

    pub(super) fn depth(self, folder: &Path, k: usize) -> PathBuf {
        self.file(folder, "depth", k, "png")
    }

    fn exr(self, folder: &Path, k: usize) -> PathBuf {
        self.file(folder, "exr", k, "exr")
    }

    fn file(self, folder: &Path, kind: &str, k: usize, extension: &str) -> PathBuf {
        self.folder(folder, kind)
            .join(format!("{k:06}.{extension}"))
    }

    fn folder(self, folder: &Path, kind: &str) -> PathBuf {
        match self {
            Self::Left => folder.join(kind),
            Self::Right(_) => folder.join(format!("{kind}_right")),
        }
    }

    /// Seed of a picture, so that the noise of each is its own, also among sequences whose seeds are neighbours.
    fn seed(self, seed: u64, k: usize) -> u64 {
        let eye = u64::from(self != Self::Left);
        seed.rotate_left(32).wrapping_add(2 * k as u64 + eye)
    }
}

pub(super) fn make_folders(folder: &Path, eyes: &[Eye]) -> Result<(), SequenceError> {
    for eye in eyes {
        for kind in ["rgb", "depth", "exr"] {
            let path = eye.folder(folder, kind);
            fs::create_dir_all(&path).map_err(|e| SequenceError::system(&path, e))?;
        }
    }
    Ok(())
}

/// Makes a picture with its depth; false where it was stopped and nothing is written.
pub(super) fn make(
    stage: &Stage<'_>,
    k: usize,
    eye: Eye,
    folder: &Path,
    options: &RunOptions<'_>,
    observer: &Observer<'_>,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<bool, SequenceError> {
    let config = stage.sequence.config;
    let (scene, prepared) = stage.placed(k, eye);
    let seed = eye.seed(config.seed, k);
    let plan = Plan {
        samples_per_pixel: Some(config.samples_per_pixel),
        time_limit: None,
        target_error: None,
        seed,
        threads: options.threads,
        max_bounces: config.max_bounces,
        dark_lamps: stage.sequence.layers.iter().any(|layer| layer.is_lamp()),
    };
    let observe = |p: &Progress| {
        if let Some(total) = p.rows_total {
            progress(p.rows_done as f64 / total as f64);
        }
    };
    let with = |device: &Device| render(stage, &prepared, device, &plan, observer, &observe);
    let mut rendered = with(options.device);
    if let Some(reason) = falls_back(options, &rendered) {
        (observer.tell)(&format!(
            "frame {k}: {reason}; rendering with --backend cpu"
        ));
        rendered = with(&Device::Cpu);
    }
    let (film, stats) = match rendered {
        Err(DenoiseError::Render(RenderError::Incomplete { .. })) => return Ok(false),
        other => other.map_err(|source| SequenceError::Render {
            frame: k,
            time_s: stage.sequence.trajectory.poses()[k].time_s,
            source,
        })?,
    };
    if stats.interrupted {
        return Ok(false);
    }
    let shown = picture(&film);
    let sensor = scene.sensor.unwrap_or_default();
    let layers: Vec<RenderLayer> = std::iter::once(RenderLayer::Depth)
        .chain(
            stage
                .sequence
                .layers
                .iter()
                .copied()
                .filter(|layer| *layer != RenderLayer::Depth),
        )
        .collect();
    let mut image = exr_image(&prepared, &film, &layers);
    image.attributes = attributes(&stats, sensor.exposure_factor(&shown));
    image.write(&eye.exr(folder, k))?;
    write_depth(&eye.depth(folder, k), &image)?;
    write_frame(&eye.picture(folder, k), &sensor.expose(&shown, seed))?;
    Ok(true)
}

fn render(
    stage: &Stage<'_>,
    prepared: &Prepared,
    device: &Device,
    plan: &Plan,
    observer: &Observer<'_>,
    observe: &(dyn Fn(&Progress) + Sync),
) -> Result<(Film, RenderStats), DenoiseError> {
    if stage.sequence.config.denoise {
        let sources = stage
            .sequence
            .layers
            .iter()
            .any(|layer| layer.is_lamp() || *layer == RenderLayer::Ambient);
        denoise::render(device, prepared, plan, sources, observer.cancel, observe)
    } else {
        Ok(device.render(prepared, plan, observer.cancel, observe)?)
    }
}

fn falls_back(
    options: &RunOptions<'_>,
    rendered: &Result<(Film, RenderStats), DenoiseError>,
) -> Option<String> {
    let rendered = match rendered {
        _ if !options.falls_back => return None,
        Ok((_, stats)) => Ok(stats),
        Err(DenoiseError::Render(error)) => Err(error),
        Err(_) => return None,
    };
    needs_double(rendered, false)
}

/// What an EXR file says about its making.
fn attributes(stats: &RenderStats, exposure: f64) -> Vec<(String, String)> {
    let own = [
        ("uw.version", env!("CARGO_PKG_VERSION").to_owned()),
        ("uw.seed", stats.seed.to_string()),
        ("uw.samples_per_pixel", stats.samples_per_pixel.to_string()),
        ("uw.backend", stats.backend.to_owned()),
        ("uw.exposure", exposure.to_string()),
    ];
    let own = own
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value));
    let denoised = stats
        .denoised
        .iter()
        .flat_map(denoise::DenoiseFacts::attributes);
    own.chain(denoised).collect()
}

/// Writes the layer `depth` in mm, 16 bits.
fn write_depth(path: &Path, image: &ExrImage) -> Result<(), ImageError> {
    let Some(LayerData::Scalar(depths_m)) = image.layer("depth") else {
        return Ok(());
    };
    let in_mm = |depth_m: &f32| {
        let mm = (PER_M * depth_m).round();
        if mm <= f32::from(u16::MAX) {
            mm as u16
        } else {
            0
        }
    };
    let (width, height) = (image.picture.width, image.picture.height);
    let bytes: Vec<u8> = depths_m
        .iter()
        .flat_map(|d| in_mm(d).to_ne_bytes())
        .collect();
    write_atomically(path, |file| {
        let encoder = PngEncoder::new(file);
        let written = encoder.write_image(&bytes, width, height, ExtendedColorType::L16);
        written.map_err(|e| ImageError::Content {
            path: path.to_path_buf(),
            reason: e.to_string(),
        })
    })
}
