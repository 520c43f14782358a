//! Labels against plain renders at full resolution.
//!
//! Of random entries the image after the change is rendered without any of the shortcuts: the whole scene with
//! its surface, lamps at their level, single pixels of the full image, thousands of samples each, in double precision. A few random
//! pixels per patch are enough, because only the difference from the label's own model of the image is estimated:
//!
//! variance of patch = variance of the model's patch + covariance of two renders of the pixels - variance of the
//! model at the same pixels
//!
//! Both terms are unbiased; where the model is right their difference has little noise but that of the renders.
//!
//! An entry takes minutes. It is kept in a file of its own under `check/` as soon as it is done, and the same check goes
//! on from there.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use uw_calib::stats::{PATCH_COLUMNS, PATCH_ROWS};
use uw_render::backend::Device;
use uw_render::integrator::RenderError;
use uw_render::prepare::Prepared;
use uw_render::rays::{RayBatch, RayTracer, Rays, Selection};
use uw_render::sampling::{Draws, MAX_BATCH, Rng};
use uw_render::scene::Camera;

use super::check_files::{self, entry_path, image_name, keep, kept};
use super::group::{self, DepthView, GroupLight, group_scene};
use super::plan::{Group, groups};
use super::verdict::{ALLOWED_COUNTS, ALLOWED_SHARE};
use super::{DatasetConfig, DatasetError, Observer, Progress, Workshop, exposure, pool, rows};
use uw_twin::estimate::radiance::{Estimates, Lattice, RadianceImage, Reflection};
use uw_twin::estimate::statistics::Shot;

/// What to check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CheckPlan {
    /// Number of random entries.
    pub entries: usize,
    /// Samples of each pixel.
    pub samples_per_pixel: u32,
    /// Random pixels of each patch, at least 2.
    pub pixels_per_patch: usize,
}

/// One entry checked: contrast of its label and of the render, 8-bit counts.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckedEntry {
    /// Environment and view.
    pub image: String,
    /// Depth, m.
    pub depth_m: f64,
    /// Distance, m.
    pub distance_m: f64,
    /// Lamp level, percent.
    pub light_pct: f64,
    /// Contrast of the label: that of the table of images, or of its model where there is no table yet.
    pub label: [f64; 3],
    /// Standard error that the label states; 0 of its model.
    pub label_error: [f64; 3],
    /// Contrast of the render.
    pub render: [f64; 3],
    /// Standard error of the render's contrast.
    pub error: [f64; 3],
}

/// Result of a check.
#[derive(Clone, Debug, Serialize)]
pub struct CheckReport {
    /// Samples of each pixel.
    pub samples_per_pixel: u32,
    /// Pixels rendered per image.
    pub pixels: usize,
    /// Mean absolute difference of label and render, counts; noise of the render is in it.
    pub mean_absolute: f64,
    /// The same less what is allowed, 0.1 counts + 1 % of the contrast; fine where negative.
    pub mean_excess: f64,
    /// Mean difference, label minus render, counts.
    pub mean: f64,
    /// Standard error of the mean difference from its spread over the entries, counts.
    pub mean_error: f64,
    /// The entries.
    pub entries: Vec<CheckedEntry>,
}

impl CheckReport {
    /// Entries of which a label is further from its render than [`CheckedEntry::allowed`], a line each.
    pub fn wrong(&self) -> Vec<String> {
        let of = |e: &CheckedEntry| {
            let allowed = e.allowed(self.entries.len());
            let channel = |k: usize| {
                format!(
                    "{} {:.3} in the dataset, {:.3} in the render (allowed: {:.3})",
                    ["red", "green", "blue"][k],
                    e.label[k],
                    e.render[k],
                    allowed[k]
                )
            };
            let channels: Vec<_> = e
                .wrong_channels(self.entries.len())
                .into_iter()
                .map(channel)
                .collect();
            (!channels.is_empty()).then(|| {
                format!(
                    "{} at {} m depth, {} %: {}",
                    e.image,
                    e.depth_m,
                    e.light_pct,
                    channels.join(", ")
                )
            })
        };
        self.entries.iter().filter_map(of).collect()
    }
}

/// Renders of one patch of each entry: what progress counts.
const STEPS_PER_ENTRY: usize = 2 * PATCH_COLUMNS * PATCH_ROWS;

/// Checks the dataset in the `folder` of a finished run: its files against their checksums and parts, and then labels
/// against plain renders. Progress counts patches, [`STEPS_PER_ENTRY`] an entry.
///
/// # Errors
/// [`DatasetError::Faulty`] names files that are damaged or differ from their parts; then nothing is rendered. Labels that
/// differ from the renders are no error here: see [`CheckReport::wrong`].
pub fn check(
    config: &DatasetConfig,
    folder: &Path,
    assets: &Path,
    plan: &CheckPlan,
    threads: Option<usize>,
    observer: &Observer,
) -> Result<CheckReport, DatasetError> {
    super::claim(config, folder)?;
    let pool = pool(threads)?;
    let mut workshop = super::workshop(config, folder, assets, observer)?;
    let mut faults: Vec<String> = check_files::exposure_fault(folder)?.into_iter().collect();
    if faults.is_empty() {
        workshop.exposure = exposure::choose(&workshop, &pool)?;
        faults = check_files::faults(&workshop)?;
    }
    if !faults.is_empty() {
        return Err(DatasetError::Faulty(faults));
    }
    let all: Vec<Group> = groups(config).collect();
    let mut rng = Rng::new(config.seed, 0, 0, 0xc4ec);
    let mut pick = |n: usize| ((rng.uniform() * n as f64) as usize).min(n - 1);
    let chosen: Vec<RandomEntry> = (0..plan.entries)
        .map(|i| {
            let group = all[pick(all.len())];
            let depth_m = config.depths_m[pick(config.depths_m.len())];
            let light_pct = config.light_pct[pick(config.light_pct.len())];
            RandomEntry {
                group,
                depth_m,
                light_pct,
                index: i as u32,
            }
        })
        .collect();
    let done = AtomicUsize::new(0);
    let tick = |steps: usize| {
        let images = steps + done.fetch_add(steps, Ordering::Relaxed);
        (observer.progress)(&Progress {
            images,
            images_total: STEPS_PER_ENTRY * plan.entries,
            images_per_s: 0.0,
        });
    };
    let entries: Result<Vec<CheckedEntry>, DatasetError> = pool.install(|| {
        chosen
            .par_iter()
            .with_max_len(1)
            .map(|choice| {
                let RandomEntry {
                    group,
                    depth_m,
                    light_pct,
                    index,
                } = choice;
                let path = entry_path(folder, plan, *index);
                let entry = match kept(&workshop, &path, group, *depth_m, *light_pct)? {
                    Some(entry) => {
                        tick(STEPS_PER_ENTRY);
                        entry
                    }
                    None => {
                        let entry = check_one(&workshop, choice, plan, &tick)?;
                        keep(&workshop, &path, &entry)?;
                        entry
                    }
                };
                labelled(&workshop, group, entry)
            })
            .collect()
    });
    let entries = entries.map_err(|error| match error {
        DatasetError::Stopped => DatasetError::Interrupted {
            done: (0..plan.entries as u32)
                .filter(|&i| entry_path(folder, plan, i).exists())
                .count(),
            total: plan.entries,
        },
        other => other,
    })?;
    workshop.watch.tell_unsealed();
    Ok(report(plan, entries))
}

/// The entry with the label that the table of images holds now.
fn labelled(
    workshop: &Workshop,
    group: &Group,
    mut entry: CheckedEntry,
) -> Result<CheckedEntry, DatasetError> {
    let path = group.images_path(workshop.folder);
    let rows = workshop
        .watch
        .accept(&path, rows::inspect(workshop, group)?);
    let row = rows
        .into_iter()
        .flatten()
        .find(|row| row.depth_m == entry.depth_m && row.light_pct == entry.light_pct);
    if let Some(row) = row {
        entry.label = row.stats.contrast;
        entry.label_error = row.errors.contrast;
    }
    Ok(entry)
}

/// A random entry.
struct RandomEntry {
    group: Group,
    depth_m: f64,
    light_pct: f64,
    index: u32,
}

fn check_one(
    workshop: &Workshop,
    choice: &RandomEntry,
    plan: &CheckPlan,
    tick: &(dyn Fn(usize) + Sync),
) -> Result<CheckedEntry, DatasetError> {
    let RandomEntry {
        group,
        depth_m,
        light_pct,
        index,
    } = choice;
    let (depth_m, light_pct, index) = (*depth_m, *light_pct, *index);
    let views = group::views(workshop, group, &workshop.config.depths_m)?;
    let light = group::light(workshop, group, &views, |r| r, &workshop.effort)?;
    let at = views.iter().position(|p| p.depth_m == depth_m).unwrap_or(0);
    let model = model_counts(workshop, &views[at], &light, at, light_pct);
    let pixels = pixels(
        model.lattice,
        plan.pixels_per_patch,
        workshop.config.seed,
        index,
    );
    let halves = render(workshop, choice, plan, &pixels, tick)?;
    let (render, error) = compare(workshop, &model, &pixels, &halves);
    Ok(CheckedEntry {
        image: image_name(group),
        depth_m,
        distance_m: group.distance_m,
        light_pct,
        label: model.contrast,
        label_error: [0.0; 3],
        render,
        error,
    })
}

/// The label's model of an image: mean counts of every pixel.
struct ModelImage {
    lattice: Lattice,
    exposure: f64,
    counts: Vec<[f64; 3]>,
    /// Variance of every patch with sensor noise.
    variances: Vec<[f64; 3]>,
    contrast: [f64; 3],
}

fn model_counts(
    workshop: &Workshop,
    view: &DepthView,
    light: &GroupLight,
    at: usize,
    light_pct: f64,
) -> ModelImage {
    let lattice = view.model.lattice(1);
    let image = |source, fields| {
        let reflection = Reflection::new(&source, lattice);
        RadianceImage::new(&source, fields, &reflection, Estimates::Whole)
    };
    let ambient = image(view.model.daylight(), &light.daylight[at]);
    let lamps = image(view.model.lamps(), &light.lamps);
    let shot = |exposure| Shot {
        ambient: &ambient,
        lamps: &lamps,
        light_pct,
        exposure,
    };
    let exposure = workshop.exposure_of(&shot(1.0));
    let shot = shot(exposure);
    let mut counts = Vec::with_capacity(lattice.columns() * lattice.rows());
    let mut noise = Vec::with_capacity(counts.capacity());
    for i in 0..lattice.columns() * lattice.rows() {
        let responses = shot.signal(0, i).map(|y| workshop.response.at(y));
        counts.push(responses.map(|r| f64::from(r.0)));
        noise.push(responses.map(|r| f64::from(r.1)));
    }
    let variances = patches(lattice)
        .map(|patch| {
            let n = patch.len() as f64;
            std::array::from_fn(|k| {
                let mean = patch.iter().map(|&i| counts[i][k]).sum::<f64>() / n;
                let spread = patch
                    .iter()
                    .map(|&i| (counts[i][k] - mean).powi(2))
                    .sum::<f64>();
                (spread + patch.iter().map(|&i| noise[i][k]).sum::<f64>()) / n
            })
        })
        .collect();
    ModelImage {
        lattice,
        exposure,
        counts,
        variances,
        contrast: shot.statistics(&workshop.response).contrast,
    }
}

/// Indices of the pixels of each patch, patches row by row.
fn patches(lattice: Lattice) -> impl Iterator<Item = Vec<usize>> {
    let (w, h) = (
        lattice.columns() / PATCH_COLUMNS,
        lattice.rows() / PATCH_ROWS,
    );
    (0..PATCH_ROWS).flat_map(move |r| {
        (0..PATCH_COLUMNS).map(move |c| {
            let rows = r * h..(r + 1) * h;
            rows.flat_map(|y| (c * w..(c + 1) * w).map(move |x| y * lattice.columns() + x))
                .collect()
        })
    })
}

/// Random pixels of every patch.
fn pixels(lattice: Lattice, per_patch: usize, seed: u64, index: u32) -> Vec<Vec<usize>> {
    let mut rng = Rng::new(seed, index, 1, 0xc4ec);
    patches(lattice)
        .map(|patch| {
            let n = patch.len();
            (0..per_patch)
                .map(|_| patch[((rng.uniform() * n as f64) as usize).min(n - 1)])
                .collect()
        })
        .collect()
}

/// Radiance of the pixels in two independent renders.
fn render(
    workshop: &Workshop,
    choice: &RandomEntry,
    plan: &CheckPlan,
    pixels: &[Vec<usize>],
    tick: &(dyn Fn(usize) + Sync),
) -> Result<[Vec<Vec<[f64; 3]>>; 2], DatasetError> {
    let (light_pct, index) = (choice.light_pct, choice.index);
    let mut scene = group_scene(workshop, &choice.group, choice.depth_m)?;
    scene.lamps.iter_mut().for_each(|l| l.level_pct = light_pct);
    if light_pct == 0.0 {
        scene.lamps.clear();
    }
    let prepared = Prepared::build(&scene);
    let selection = Selection::all(&prepared, true, 0);
    let rays = Rays::new(&Device::Cpu, &prepared, &selection).map_err(RenderError::from)?;
    let mut pixel = PixelSampler {
        camera: &prepared.camera,
        tracer: rays.tracer(),
        samples: plan.samples_per_pixel.div_ceil(2),
    };
    let mut half = |half: u64| -> Result<Vec<Vec<[f64; 3]>>, DatasetError> {
        let seed = workshop.config.seed ^ 0xc4ec_0000 ^ (half << 40) ^ (u64::from(index) << 48);
        let mut all = Vec::with_capacity(pixels.len());
        for patch in pixels {
            if workshop.cancel.load(Ordering::Relaxed) {
                return Err(DatasetError::Stopped);
            }
            let means: Result<Vec<_>, _> = patch.iter().map(|&i| pixel.mean(seed, i)).collect();
            all.push(means?);
            tick(1);
        }
        Ok(all)
    };
    Ok([half(0)?, half(1)?])
}

/// Renders single pixels: rays through random points of each.
struct PixelSampler<'a> {
    camera: &'a Camera,
    tracer: RayTracer<'a, 'a>,
    samples: u32,
}

impl PixelSampler<'_> {
    /// Mean radiance of pixel `index`, row by row.
    fn mean(&mut self, seed: u64, index: usize) -> Result<[f64; 3], RenderError> {
        let width = self.camera.width as usize;
        let corner = ((index % width) as f64, (index / width) as f64);
        let mut sum = [0.0; 3];
        for batch in 0..self.samples.div_ceil(MAX_BATCH) {
            let samples = MAX_BATCH.min(self.samples - batch * MAX_BATCH);
            let key = RayBatch {
                seed,
                key: index as u32,
                batch,
                first: 0,
            };
            let direction = |sample| {
                let draws = Draws::new(seed, key.key, batch, sample, 0);
                let (x, y) = (corner.0 + draws.leading(0), corner.1 + draws.leading(1));
                self.camera.direction(x, y)
            };
            let directions: Vec<_> = (0..samples).map(direction).collect();
            let eye = self.camera.position_m;
            for light in self.tracer.trace(&key, eye, &directions)?.iter() {
                let total = light.total();
                (0..3).for_each(|k| sum[k] += total[k]);
            }
        }
        Ok(sum.map(|s| s / f64::from(self.samples)))
    }
}

/// Contrast of the rendered image and its standard error.
fn compare(
    workshop: &Workshop,
    model: &ModelImage,
    pixels: &[Vec<usize>],
    halves: &[Vec<Vec<[f64; 3]>>; 2],
) -> ([f64; 3], [f64; 3]) {
    let counts =
        |radiance: f64| f64::from(workshop.response.at((model.exposure * radiance) as f32).0);
    let (mut contrast, mut error) = ([0.0; 3], [0.0; 3]);
    let patches = pixels.len() as f64;
    for k in 0..3 {
        let mut plain = 0.0;
        let mut changes = Vec::with_capacity(pixels.len());
        for (p, patch) in pixels.iter().enumerate() {
            let n = patch.len() as f64;
            let mean = |values: &[f64]| values.iter().sum::<f64>() / n;
            let first: Vec<f64> = halves[0][p].iter().map(|l| counts(l[k])).collect();
            let second: Vec<f64> = halves[1][p].iter().map(|l| counts(l[k])).collect();
            let known: Vec<f64> = patch.iter().map(|&i| model.counts[i][k]).collect();
            let covariance = |x: &[f64], y: &[f64]| {
                let (mx, my) = (mean(x), mean(y));
                let sum: f64 = x.iter().zip(y).map(|(a, b)| (a - mx) * (b - my)).sum();
                sum / (n - 1.0)
            };
            let root = model.variances[p][k].max(0.0).sqrt();
            plain += root / patches;
            let change = covariance(&first, &second) - covariance(&known, &known);
            changes.push(change / (2.0 * root.max(1e-3)));
        }
        let mean = changes.iter().sum::<f64>() / patches;
        let spread: f64 = changes.iter().map(|c| (c - mean).powi(2)).sum();
        contrast[k] = plain + mean;
        error[k] = (spread / (patches * (patches - 1.0))).sqrt();
    }
    (contrast, error)
}

fn report(plan: &CheckPlan, entries: Vec<CheckedEntry>) -> CheckReport {
    let pairs = || {
        entries
            .iter()
            .flat_map(|e| (0..3).map(move |k| (e.label[k], e.render[k])))
    };
    let n = (3 * entries.len()) as f64;
    let mean_of = |of: fn((f64, f64)) -> f64| pairs().map(of).sum::<f64>() / n;
    let mean = mean_of(|(label, render)| label - render);
    // The channels of an entry are not independent: the spread is taken over entries.
    let per_entry: Vec<f64> = entries
        .iter()
        .map(|e| (0..3).map(|k| e.label[k] - e.render[k]).sum::<f64>() / 3.0)
        .collect();
    let m = per_entry.len() as f64;
    let spread: f64 = per_entry.iter().map(|d| (d - mean).powi(2)).sum();
    CheckReport {
        samples_per_pixel: plan.samples_per_pixel,
        pixels: plan.pixels_per_patch * PATCH_COLUMNS * PATCH_ROWS,
        mean_absolute: mean_of(|(label, render)| (label - render).abs()),
        mean_excess: mean_of(|(label, render)| {
            (label - render).abs() - ALLOWED_COUNTS - ALLOWED_SHARE * render
        }),
        mean,
        mean_error: (spread / (m * (m - 1.0)).max(1.0)).sqrt(),
        entries,
    }
}
