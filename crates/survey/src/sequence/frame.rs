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
use uw_render::layers::{RenderLayer, exr_image};
use uw_render::prepare::Prepared;

use super::exposed::{Exposed, in_order, is_light, stacked};
use super::placing::Moment;
use super::shutter::Band;
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

/// A picture that is being made.
struct Making<'m> {
    stage: &'m Stage<'m>,
    k: usize,
    eye: Eye,
    seed: u64,
    /// Layers of the EXR file, those of light and those of the first surface.
    layers: Vec<RenderLayer>,
    light: Vec<RenderLayer>,
    truth: Vec<RenderLayer>,
    options: &'m RunOptions<'m>,
    observer: &'m Observer<'m>,
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
    let others = (stage.sequence.layers.iter()).filter(|layer| **layer != RenderLayer::Depth);
    let layers: Vec<RenderLayer> = std::iter::once(RenderLayer::Depth)
        .chain(others.copied())
        .collect();
    let (light, truth) = layers.iter().partition(|layer| is_light(**layer));
    let seed = eye.seed(config.seed, k);
    let making = Making {
        stage,
        k,
        eye,
        seed,
        layers,
        light,
        truth,
        options,
        observer,
    };
    let bands = config.shutter.bands(stage.shell.camera.height);
    let mut parts = Vec::new();
    let mut stats = None;
    for (b, band) in bands.iter().enumerate() {
        let of_band = |share: f64| progress((b as f64 + share) / bands.len() as f64);
        let Some((image, of_part)) = making.band(b, band, &of_band)? else {
            return Ok(false);
        };
        parts.push(image);
        stats = stats.or(Some(of_part));
    }
    let mut image = stacked(parts);
    let sensor = stage.shell.sensor.unwrap_or_default();
    let exposure = sensor.exposure_factor(&image.picture);
    image.attributes = stats.map_or_else(Vec::new, |(stats, moments)| {
        attributes(&stats, moments, exposure)
    });
    image.write(&eye.exr(folder, k))?;
    write_depth(&eye.depth(folder, k), &image)?;
    write_frame(
        &eye.picture(folder, k),
        &sensor.expose(&image.picture, seed),
    )?;
    Ok(true)
}

/// A picture of some rows, how it was rendered and of how many moments it is the mean; `None` where it was stopped.
type Part = Option<(ExrImage, (RenderStats, u32))>;

impl Making<'_> {
    /// The rows of a band: the mean over the moments of their exposure.
    fn band(
        &self,
        b: usize,
        band: &Band,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Part, SequenceError> {
        let sequence = self.stage.sequence;
        let (shutter, config) = (sequence.config.shutter, sequence.config);
        let (count, samples) = shutter.moments(config.samples_per_pixel, config.denoise);
        let seed = |j: usize| self.seed ^ ((((b << 8) + j) as u64) << 48);
        let opened = self.moment(band, 0.0, count);
        let (_, at_opening) = self.stage.placed(&opened, self.eye);
        let mut exposed: Option<Exposed> = None;
        let mut last = None;
        for (j, time_s) in shutter.times_s(count, seed(0)).into_iter().enumerate() {
            let moved;
            let prepared = match shutter.exposure_s > 0.0 {
                true => {
                    moved = self
                        .stage
                        .placed(&self.moment(band, time_s, count), self.eye);
                    &moved.1
                }
                false => &at_opening,
            };
            let of_moment = |share: f64| progress((j as f64 + share) / f64::from(count));
            let Some((film, stats)) = self.rendered(prepared, seed(j), samples, &of_moment)? else {
                return Ok(None);
            };
            let image = exr_image(prepared, &film, &self.light);
            match &mut exposed {
                Some(exposed) => exposed.add(&image),
                None => exposed = Some(Exposed::new(image)),
            }
            last = Some((film, stats));
        }
        Ok(exposed.zip(last).map(|(exposed, (film, stats))| {
            let mut image = exposed.mean(&self.light);
            let truth = exr_image(&at_opening, &film, &self.truth).layers;
            image.layers = in_order(&self.layers, std::mem::take(&mut image.layers), truth);
            (image, (stats, count))
        }))
    }

    /// The moment `time_s` after a band's rows have opened.
    fn moment(&self, band: &Band, time_s: f64, moments: u32) -> Moment {
        let sequence = self.stage.sequence;
        let shutter = sequence.config.shutter;
        let own = sequence.trajectory.poses()[self.k];
        Moment {
            pose: match shutter.is_instant() {
                true => own,
                false => sequence.path.at(own.time_s + band.opens_s + time_s),
            },
            velocity_m_s: sequence.trajectory.velocity_m_s(self.k),
            exposure_s: (shutter.exposure_s > 0.0).then(|| shutter.exposure_s / f64::from(moments)),
            rows: band.rows.clone(),
        }
    }

    /// Renders what is seen at a moment; `None` where it was stopped.
    fn rendered(
        &self,
        prepared: &Prepared,
        seed: u64,
        samples_per_pixel: u32,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Option<(Film, RenderStats)>, SequenceError> {
        let (stage, options, observer) = (self.stage, self.options, self.observer);
        let plan = Plan {
            samples_per_pixel: Some(samples_per_pixel),
            time_limit: None,
            target_error: None,
            seed,
            threads: options.threads,
            max_bounces: stage.sequence.config.max_bounces,
            dark_lamps: self.layers.iter().any(|layer| layer.is_lamp()),
        };
        let observe = |p: &Progress| {
            if let Some(total) = p.rows_total {
                progress(p.rows_done as f64 / total as f64);
            }
        };
        let with = |device: &Device| render(stage, prepared, device, &plan, observer, &observe);
        let mut rendered = with(options.device);
        if let Some(reason) = falls_back(options, &rendered) {
            let k = self.k;
            (observer.tell)(&format!(
                "frame {k}: {reason}; rendering with --backend cpu"
            ));
            rendered = with(&Device::Cpu);
        }
        match rendered {
            Err(DenoiseError::Render(RenderError::Incomplete { .. })) => Ok(None),
            Ok((_, stats)) if stats.interrupted => Ok(None),
            Ok(done) => Ok(Some(done)),
            Err(source) => Err(SequenceError::Render {
                frame: self.k,
                time_s: stage.sequence.trajectory.poses()[self.k].time_s,
                source,
            }),
        }
    }
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

/// What an EXR file says about its making; what denoising came to is that of one moment.
fn attributes(stats: &RenderStats, moments: u32, exposure: f64) -> Vec<(String, String)> {
    let samples = stats.samples_per_pixel * u64::from(moments);
    let own = [
        ("uw.version", env!("CARGO_PKG_VERSION").to_owned()),
        ("uw.seed", stats.seed.to_string()),
        ("uw.samples_per_pixel", samples.to_string()),
        ("uw.moments", moments.to_string()),
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
