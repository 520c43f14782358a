//! How well `uw fit` finds hidden waters: calibration pictures of vehicles in waters drawn at random, fitted with the nominal vehicle.
//!
//! `cargo run --release -p uw-survey --example fit_accuracy -- SCENES SEED [spectral] [jerlov] [dark] [predict] [known]`; with `jerlov` the water is
//! fitted as one of Jerlov's scale (in three bands hidden waters are off it, by wavelength they are on it); with `predict` each fitted water also
//! predicts the contrast of pictures of a target that was not calibrated with, from each of them for all others; alone, and with those in mind
//! that a vehicle has taken from 1.2 and 3.5 m without its lamps; with `known` besides the true water does, so that what is off is not the fit's.
//! With `dark` there is no daylight, and all pictures are of the lamps.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

#[path = "../tests/hidden_truth/mod.rs"]
mod hidden_truth;

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use hidden_truth::{DISTANCES_M, LIGHT_PCT, Truth};
use uw_calib::ImageStats;
use uw_calib::picture::Counts;
use uw_calib::vehicle::Vehicle;
use uw_guidance::Candidate;
use uw_guidance::physics::{LinearPicture, Predictor, Sight, WaterFile};
use uw_media::spectral::WaterBands;
use uw_scenery::textures::Pattern;
use uw_survey::fit::{Fit, Fitted, Options, fit, water_file};
use uw_twin::environment::MEAN;

/// 90 % of a normal variable lie within so many standard deviations.
const NINETY: f64 = 1.645;
/// Paths of the tables: an eighth of the default, whose error is below that of the fit.
const TABLE_PATHS: u32 = 4096;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (scenes, seed) = match &arguments[..] {
        [scenes, seed, ..] => (scenes.parse::<u32>()?, seed.parse::<u64>()?),
        _ => return Err("give SCENES SEED [spectral] [jerlov] [dark] [predict] [known]".into()),
    };
    let asked = |word: &str| arguments[2..].iter().any(|argument| argument == word);
    let bands = match asked("spectral") {
        true => WaterBands::Spectral,
        false => MEAN,
    };
    let vehicle = Vehicle::default();
    let mut tally = Tally::default();
    let mut predictions = MEMORIES.map(Predictions::new);
    for scene in 0..scenes {
        let truth = Truth {
            dark: asked("dark"),
            ..Truth::draw(seed, scene, bands)?
        };
        let folder = tempfile::tempdir()?;
        let manifest = truth.take(folder.path(), &vehicle, u64::from(scene))?;
        let started = Instant::now();
        let options = Options {
            down: truth.is_down()?,
            jerlov: asked("jerlov"),
            dark: truth.dark,
            ..Options::default()
        };
        let found = fit(&manifest, &vehicle, &options, &|_, _| true)?;
        println!(
            "{scene}: {} B {:.4} gain {:.2} depth {:.1} m {}: misfit {:.2}, {:.1} s; not identified {:?} {:?}",
            truth.body.jerlov,
            truth.body.backscatter_fraction,
            truth.gain,
            truth.depth_m,
            truth.pattern.name(),
            found.misfit,
            started.elapsed().as_secs_f64(),
            found.not_identified,
            found.warnings
        );
        tally.add(&truth, &found);
        if asked("predict") {
            let found = match asked("known") {
                true => known(&truth, found),
                false => found,
            };
            let water = water_file(
                &found,
                &vehicle,
                &options,
                (TABLE_PATHS, "fit_accuracy"),
                |_| true,
            )?;
            let other = Truth {
                pattern: other_target(&truth)?,
                ..truth
            };
            let folder = tempfile::tempdir()?;
            other.take(folder.path(), &vehicle, 500 + u64::from(scene))?;
            for predictions in &mut predictions {
                predictions.add(&water, &other, folder.path())?;
            }
        }
    }
    tally.tell();
    if asked("predict") {
        for predictions in &predictions {
            predictions.tell();
        }
    }
    Ok(())
}

/// A fit that has found the truth.
fn known(truth: &Truth, mut found: Fit) -> Fit {
    let sure = |value: f64| Fitted {
        value,
        relative_error: 0.0,
    };
    found.a_per_m = truth.a.map(sure);
    found.b_per_m = truth.b.map(sure);
    found.backscatter_fraction = sure(truth.body.backscatter_fraction);
    found.lamp_gain = [sure(truth.gain); 3];
    found
}

/// The next texture of which the camera sees the same side.
fn other_target(truth: &Truth) -> Result<Pattern, Box<dyn Error>> {
    let all = Pattern::ALL;
    let own = (all.iter().position(|p| *p == truth.pattern)).ok_or("an unknown texture")?;
    for step in 1..all.len() {
        let other = Truth {
            pattern: all[(own + step) % all.len()],
            ..truth.clone()
        };
        if other.is_down()? == truth.is_down()? {
            return Ok(other.pattern);
        }
    }
    Err("no other texture".into())
}

/// Kinds of predictions, up to so many times nearer than the picture.
const WAYS: [(&str, f64); 5] = [
    ("farther", 1.0 - 1e-9),
    ("same", 1.0 + 1e-9),
    ("up to 1.8 times nearer", 1.8),
    ("up to 3.2 times nearer", 3.2),
    ("nearer still", f64::INFINITY),
];

/// What a vehicle has in mind: the distances of pictures taken before, m.
const MEMORIES: [&[f64]; 2] = [&[], &[1.2, 3.5]];

/// Predictions of all scenes by kind.
struct Predictions {
    /// One of [`MEMORIES`].
    been_at_m: &'static [f64],
    off: [f64; WAYS.len()],
    within: [f64; WAYS.len()],
    n: [f64; WAYS.len()],
    /// Sum of counts found above those seen.
    above: [f64; WAYS.len()],
}

impl Predictions {
    fn new(been_at_m: &'static [f64]) -> Self {
        let none = [0.0; WAYS.len()];
        Self {
            been_at_m,
            off: none,
            within: none,
            n: none,
            above: none,
        }
    }

    /// Those from each picture of a target in `folder` for all others.
    fn add(
        &mut self,
        water: &WaterFile,
        truth: &Truth,
        folder: &Path,
    ) -> Result<(), Box<dyn Error>> {
        let response = water.sensor.response();
        let before = (self.off, self.n);
        let levels: &[f64] = match truth.dark {
            true => &[LIGHT_PCT],
            false => &[0.0, LIGHT_PCT],
        };
        let mut shots = Vec::new();
        for distance_m in DISTANCES_M {
            for &light_pct in levels {
                let picture =
                    Counts::read(&folder.join(format!("d{distance_m}_{light_pct}.png")), None)?;
                let stats =
                    ImageStats::from_counts(picture.width, picture.height, &picture.pixels)?;
                let at = Candidate {
                    distance_m,
                    light_pct,
                };
                let linear = LinearPicture::of_counts(&picture, water.sensor.encoding);
                shots.push((at, linear, stats.contrast));
            }
        }
        let place = water.place(&response, truth.depth_m);
        let earlier = shots.iter().filter(|(at, ..)| {
            self.been_at_m.contains(&at.distance_m) && at.light_pct == levels[0]
        });
        let earlier: Vec<Sight> = earlier
            .map(|(at, picture, _)| Sight::new(&place, picture, at))
            .collect();
        let sights = [&earlier[..], &water.sights];
        for (here, picture, contrast) in &shots {
            let now = (here, *contrast);
            let predictor = Predictor::on_the_way(place.clone(), picture, now, sights);
            let unknown = predictor.unknown();
            for (there, _, seen) in &shots {
                let found = predictor.contrast(there);
                let times = here.distance_m / there.distance_m;
                let way = WAYS.partition_point(|(_, most)| *most < times);
                for k in (0..3).filter(|&k| unknown[k].is_none()) {
                    let off = (found.counts[k] - seen[k]).abs();
                    let within = off <= NINETY * found.error_counts[k];
                    self.off[way] += off / 15.0;
                    self.within[way] += f64::from(u8::from(within));
                    self.above[way] += found.counts[k] - seen[k];
                    self.n[way] += 1.0;
                }
            }
        }
        let told: Vec<String> = (0..WAYS.len())
            .map(|way| {
                let error = (self.off[way] - before.0[way]) / (self.n[way] - before.1[way]);
                format!("{} {error:.4}", WAYS[way].0)
            })
            .collect();
        let (name, been_at_m) = (truth.pattern.name(), self.been_at_m);
        println!(
            "    {name}, been at {been_at_m:?} m: MAE/15 {}",
            told.join(", ")
        );
        Ok(())
    }

    fn tell(&self) {
        let [off, n] = [&self.off, &self.n].map(|of| of.iter().sum::<f64>());
        println!(
            "contrast of all, been at {:?} m: MAE/15 {:.4} of {n}",
            self.been_at_m,
            off / n
        );
        for (way, (name, _)) in WAYS.iter().enumerate() {
            println!(
                "contrast {name}, been at {:?} m: MAE/15 {:.4}, {:+.2} counts on average, {:.2} of {} within 90 % intervals",
                self.been_at_m,
                self.off[way] / self.n[way],
                self.above[way] / self.n[way],
                self.within[way] / self.n[way],
                self.n[way]
            );
        }
    }
}

/// Errors of all scenes.
#[derive(Default)]
struct Tally {
    identified: [f64; 2],
    within_tenth: [f64; 2],
    covered: [f64; 2],
    covered_of_all: [f64; 2],
    of_all: f64,
}

impl Tally {
    fn add(&mut self, truth: &Truth, found: &Fit) {
        let names = Fit::names();
        let mut line = String::new();
        for (i, (fitted, truths)) in [(&found.a_per_m, &truth.a), (&found.b_per_m, &truth.b)]
            .into_iter()
            .enumerate()
        {
            for k in 0..3 {
                let Fitted {
                    value,
                    relative_error,
                } = fitted[k];
                let error = value / truths[k] - 1.0;
                let z = (value / truths[k]).ln() / relative_error;
                let name = &names[3 * i + k];
                let told = !found.not_identified.contains(name);
                let mark = if told { "" } else { "*" };
                let _ = write!(
                    line,
                    " {name}{mark} {:.3} {:+.1} % (z {z:+.1})",
                    truths[k],
                    100.0 * error
                );
                let covered = f64::from(u8::from(z.abs() <= NINETY));
                self.of_all += 1.0;
                self.covered_of_all[i] += covered;
                if told {
                    self.identified[i] += 1.0;
                    self.within_tenth[i] += f64::from(u8::from(error.abs() <= 0.1));
                    self.covered[i] += covered;
                }
            }
        }
        let b = found.backscatter_fraction;
        let gain = found.lamp_gain[1];
        println!(
            "   {line} B {:.4} ± {:.0} % gain {:.2} ± {:.0} %",
            b.value,
            100.0 * b.relative_error,
            gain.value,
            100.0 * gain.relative_error
        );
    }

    fn tell(&self) {
        for (i, name) in ["a", "b"].iter().enumerate() {
            let all = 0.5 * self.of_all;
            println!(
                "{name}: {} of {all} identified; of these {} within 10 %, 90 % intervals hold {}, of all {}",
                self.identified[i], self.within_tenth[i], self.covered[i], self.covered_of_all[i]
            );
        }
    }
}
