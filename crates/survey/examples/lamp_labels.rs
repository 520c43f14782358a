//! Labels of lamp light for a training data set in two ways: from paths made for each water, as `uw dataset` does it, and from one
//! set of paths for every water of a phase function (`estimate::every_water`). Processor time and errors on waters drawn from the
//! grid of `uw dataset`.
//!
//! `cargo run --release -p uw-survey --example lamp_labels -- WATERS SET_PATHS...` (`RAYON_NUM_THREADS=1` for one thread)

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::error::Error;

use cpu_time::ProcessTime;
use uw_assets::assets_dir;
use uw_calib::ImageStats;
use uw_media::Iops;
use uw_render::prepare::{Prepared, PreparedLamp};
use uw_render::sampling::Draws;
use uw_scenery::textures::Pattern;
use uw_survey::dataset::DatasetConfig;
use uw_twin::environment::{Target, View, WaterBody, scene, sensor};
use uw_twin::estimate::basis::solve;
use uw_twin::estimate::every_water::{EveryWater, Values};
use uw_twin::estimate::fields::{FieldSampler, Fields, GROUPS};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::radiance::{Estimates, RadianceImage, Reflection, Source};
use uw_twin::estimate::response::CountResponse;
use uw_twin::estimate::statistics::{Shot, standard_errors};
use uw_twin::estimate::target_model::{Effort, TargetModel, lamps_alone};

const DISTANCES_M: [f64; 3] = [0.5, 1.5, 3.0];
/// Paths per group of the truth: eight times the most of a data set.
const TRUE_PATHS: u32 = 65_536;
/// Points along each edge of the image through which fields are fitted to a set.
const POINTS: usize = 24;

/// Contrasts and means of one image, counts, with the errors stated.
struct Label {
    stats: ImageStats,
    contrast_errors: [f64; 3],
    mean_errors: [f64; 3],
}

/// Squares of errors of many labels.
#[derive(Default)]
struct Tally {
    labels: f64,
    contrast: f64,
    mean: f64,
    stated: f64,
    beyond_stated: f64,
    not_known: f64,
    seconds: f64,
}

impl Tally {
    fn add(&mut self, label: &Label, truth: &Label, config: &DatasetConfig, seconds: f64) {
        self.seconds += seconds;
        let accuracy = &config.accuracy;
        for k in 0..3 {
            let allowed = |value: f64| accuracy.error_counts.max(accuracy.error_share * value);
            let contrast = label.stats.contrast[k] - truth.stats.contrast[k];
            let mean = label.stats.mean[k] - truth.stats.mean[k];
            let (contrast_error, mean_error) = (label.contrast_errors[k], label.mean_errors[k]);
            self.labels += 1.0;
            self.contrast += (contrast / allowed(truth.stats.contrast[k])).powi(2);
            self.mean += (mean / allowed(truth.stats.mean[k])).powi(2);
            self.stated += (contrast_error / allowed(truth.stats.contrast[k])).powi(2);
            let both = contrast_error.hypot(truth.contrast_errors[k]).max(1e-12);
            self.beyond_stated += f64::from(contrast.abs() > 3.0 * both);
            let known = contrast_error <= allowed(label.stats.contrast[k])
                && mean_error <= allowed(label.stats.mean[k]);
            self.not_known += f64::from(!known);
        }
    }

    fn tell(&self, what: &str, images: usize, making_s: f64) {
        let rms = |sum: f64| (sum / self.labels).sqrt();
        println!(
            "{what}: {:.0} ms an image (and {:.2} s of sets in all); errors over the allowance (rms): contrast {:.2} (stated {:.2}), \
             mean {:.2}; stated errors beyond the allowance {:.1} %, deviations of over 3 stated errors {:.1} %",
            1e3 * self.seconds / images as f64,
            making_s,
            rms(self.contrast),
            rms(self.stated),
            rms(self.mean),
            100.0 * self.not_known / self.labels,
            100.0 * self.beyond_stated / self.labels,
        );
    }
}

/// One view in one water, made ready.
struct Case<'a> {
    source: Source<'a>,
    model: &'a TargetModel<'a>,
    prepared: &'a Prepared,
    response: &'a CountResponse,
    exposure: f64,
    config: &'a DatasetConfig,
}

impl Case<'_> {
    /// Contrast, mean and errors of the image under lamps at 100 % alone, as a data set has them.
    fn label(&self, fields: &Fields) -> Label {
        let fine = self.model.lattice(self.config.accuracy.pixel_step);
        let fine = Reflection::new(&self.source, fine);
        let fine = RadianceImage::new(&self.source, fields, &fine, Estimates::Halves);
        let coarse = Reflection::of_groups(&self.source, self.model.error_lattice());
        let coarse = RadianceImage::new(&self.source, fields, &coarse, Estimates::Groups);
        let errors = standard_errors(&self.shot(&coarse, &dark(&coarse)), self.response);
        Label {
            stats: self.shot(&fine, &dark(&fine)).statistics(self.response),
            contrast_errors: errors.contrast,
            mean_errors: errors.mean,
        }
    }

    fn shot<'s>(&self, lamps: &'s RadianceImage, ambient: &'s RadianceImage) -> Shot<'s> {
        Shot {
            ambient,
            lamps,
            light_pct: 100.0,
            exposure: self.exposure,
        }
    }

    /// Paths of this water until a data set's accuracy is met.
    fn own(&self, seed: u64) -> Result<Fields, Box<dyn Error>> {
        let accuracy = &self.config.accuracy;
        let effort = Effort {
            least: accuracy.least_paths / GROUPS as u32,
            most: accuracy.most_paths / GROUPS as u32,
        };
        let reflection = Reflection::new(&self.source, self.model.error_lattice());
        let within = |error: f64, value: f64| {
            error <= accuracy.error_counts.max(accuracy.error_share * value)
        };
        let mut enough = |fields: &Fields| {
            let lamps = RadianceImage::new(&self.source, fields, &reflection, Estimates::Groups);
            let ambient = dark(&lamps);
            let shot = self.shot(&lamps, &ambient);
            let errors = standard_errors(&shot, self.response);
            let stats = shot.statistics(self.response);
            (0..3).all(|k| {
                within(errors.contrast[k], stats.contrast[k])
                    && within(errors.mean[k], stats.mean[k])
            })
        };
        let fields = effort.fields(&self.source, self.prepared, seed, &|| true, &mut enough)?;
        fields.ok_or_else(|| "too few paths for a fit".into())
    }

    fn truth(&self, seed: u64) -> Result<Fields, Box<dyn Error>> {
        let mut sampler = FieldSampler::new(&self.source, self.prepared, seed)?;
        sampler.extend_to(TRUE_PATHS)?;
        sampler.fit().ok_or_else(|| "no light".into())
    }

    /// The fields that a set has in this water.
    fn shared(&self, set: &EveryWater, iops: Iops, reflectance: [f64; 3]) -> Fields {
        let of_channel: Vec<Vec<Values>> =
            (0..3).map(|k| set.by_group(iops.a[k], iops.b[k])).collect();
        let grid = Grid::new(&self.source);
        let colour = set.colour();
        let mut fields = Fields {
            lamps: true,
            samples_per_group: 0,
            veil: Vec::new(),
            irradiance: Vec::new(),
        };
        for group in 0..GROUPS {
            let values = |k: usize| &of_channel[k][group];
            fields.veil.push(std::array::from_fn(|k| {
                grid.fit(|at| colour[k] * values(k).veil.at(at.0, at.1).value)
            }));
            fields.irradiance.push(std::array::from_fn(|k| {
                let gain = colour[k] * values(k).gain(reflectance[k]).value;
                let mut guesses = grid.guesses.iter();
                grid.fit(|at| {
                    let guess = guesses.next().map_or(1.0, |guess| guess[k]);
                    gain * values(k).irradiance(at.0, at.1).value / guess
                })
            }));
        }
        fields
    }
}

/// Image points through which fields are fitted.
struct Grid {
    places: Vec<(f64, f64)>,
    guesses: Vec<[f64; 3]>,
    functions: Vec<Vec<f64>>,
}

impl Grid {
    fn new(source: &Source) -> Self {
        let basis = Fields::basis(true, source.symmetric);
        let (width, height) = source.view.size_px();
        let mut grid = Self {
            places: Vec::new(),
            guesses: Vec::new(),
            functions: Vec::new(),
        };
        let middle = |i: usize| (i as f64 + 0.5) / POINTS as f64;
        for i in 0..POINTS * POINTS {
            let (x, y) = (middle(i % POINTS) * width, middle(i / POINTS) * height);
            let Some(sight) = source.view.sight(x, y) else {
                continue;
            };
            let mut phi = vec![0.0; basis.len()];
            let place = source.view.unit_coordinates(x, y);
            basis.values(place.0, place.1, &mut phi);
            grid.places.push(place);
            grid.guesses.push(source.guess.at(sight.point));
            grid.functions.push(phi);
        }
        grid
    }

    fn fit(&self, mut value: impl FnMut((f64, f64)) -> f64) -> Vec<f64> {
        let n = self.functions[0].len();
        let (mut matrix, mut right) = (vec![0.0; n * n], vec![0.0; n]);
        for (phi, &place) in self.functions.iter().zip(&self.places) {
            let value = value(place);
            for i in 0..n {
                right[i] += phi[i] * value;
                (0..n).for_each(|j| matrix[i * n + j] += phi[i] * phi[j]);
            }
        }
        match solve(&mut matrix, &mut right) {
            Some(()) => right,
            None => vec![0.0; n],
        }
    }
}

fn dark(lamps: &RadianceImage) -> RadianceImage {
    RadianceImage {
        lattice: lamps.lattice,
        estimates: lamps
            .estimates
            .iter()
            .map(|pixels| vec![[0.0; 3]; pixels.len()])
            .collect(),
    }
}

/// `count` different waters of the grid, drawn evenly.
fn drawn(config: &DatasetConfig, count: usize) -> Vec<WaterBody> {
    let mut waters = config.waters();
    let mut draws = Draws::new(config.seed, 0, 0, 0, 0);
    let mut chosen = Vec::new();
    while chosen.len() < count && !waters.is_empty() {
        let index = (draws.uniform() * waters.len() as f64) as usize;
        chosen.push(waters.swap_remove(index.min(waters.len() - 1)));
    }
    chosen
}

fn main() -> Result<(), Box<dyn Error>> {
    let numbers: Vec<usize> = std::env::args()
        .skip(1)
        .map(|text| text.parse())
        .collect::<Result<_, _>>()?;
    let [count, sizes @ ..] = &numbers[..] else {
        return Err("give WATERS SET_PATHS...".into());
    };
    let config = DatasetConfig::default();
    let waters = drawn(&config, *count);
    let pattern = Pattern::from_name(&config.textures[0]).ok_or("no texture")?;
    let target = Target::read(pattern, &assets_dir()?)?;
    let pyramid = TexturePyramid::new(&target.texture, f64::from(pattern.tile_m()));
    let texels = target.texture.texels.iter();
    let sum = texels.fold([0.0; 3], |sum: [f64; 3], t| {
        std::array::from_fn(|k| sum[k] + f64::from(t[k]))
    });
    let reflectance = sum.map(|s| s / target.texture.texels.len() as f64);
    let exposure = config.vehicle.exposure;
    let response = CountResponse::new(&sensor(&config.vehicle, exposure));
    for distance_m in DISTANCES_M {
        println!("{distance_m} m");
        let mut own = Tally::default();
        let mut shared: Vec<Tally> = sizes.iter().map(|_| Tally::default()).collect();
        let mut sets: Vec<(f64, Vec<EveryWater>)> = Vec::new();
        let mut making_s = vec![0.0; sizes.len()];
        for (seed, water) in (1..).zip(&waters) {
            let view = View::Target {
                depth_m: config.calibration_depth_m,
                distance_m,
            };
            let scene = lamps_alone(&scene(&config.vehicle, water, &target, view)?);
            let prepared = Prepared::build(&scene);
            let model = TargetModel::new(&scene, &prepared, &pyramid, true, 1000 + seed)?;
            let case = Case {
                source: model.lamps(),
                model: &model,
                prepared: &prepared,
                response: &response,
                exposure,
                config: &config,
            };
            let truth = case.label(&case.truth(2000 + seed)?);
            let started = ProcessTime::now();
            let fields = case.own(seed)?;
            let took = started.elapsed().as_secs_f64();
            own.add(&case.label(&fields), &truth, &config, took);
            let fraction = water.backscatter_fraction;
            if !sets.iter().any(|(known, _)| *known == fraction) {
                let lamps: Vec<_> = scene.lamps.iter().map(PreparedLamp::build).collect();
                let phase = &prepared.medium.as_ref().ok_or("no water")?.phase;
                let mut made = Vec::new();
                for (size, making_s) in sizes.iter().zip(&mut making_s) {
                    let started = ProcessTime::now();
                    made.push(EveryWater::new(model.view(), &lamps, phase, *size, seed)?);
                    *making_s += started.elapsed().as_secs_f64();
                }
                sets.push((fraction, made));
            }
            let made = sets.iter().find(|(known, _)| *known == fraction);
            let iops = scene.water.as_ref().ok_or("no water")?.iops;
            for (set, tally) in made.iter().flat_map(|(_, made)| made).zip(&mut shared) {
                let started = ProcessTime::now();
                let fields = case.shared(set, iops, reflectance);
                let took = started.elapsed().as_secs_f64();
                tally.add(&case.label(&fields), &truth, &config, took);
            }
        }
        own.tell("own paths", waters.len(), 0.0);
        for ((size, tally), making_s) in sizes.iter().zip(&shared).zip(&making_s) {
            let what = format!("{} sets of {size} paths", sets.len());
            tally.tell(&what, waters.len(), *making_s);
        }
    }
    Ok(())
}
