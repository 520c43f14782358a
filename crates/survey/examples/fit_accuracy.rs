//! How well `uw fit` finds hidden waters: calibration pictures of vehicles in waters drawn at random, fitted with the nominal vehicle.
//!
//! `cargo run --release -p uw-survey --example fit_accuracy -- SCENES SEED [spectral]`

#![allow(clippy::print_stdout, reason = "that is what it is for")]

#[path = "../tests/hidden_truth/mod.rs"]
mod hidden_truth;

use std::error::Error;
use std::fmt::Write as _;
use std::time::Instant;

use hidden_truth::Truth;
use uw_media::spectral::WaterBands;
use uw_survey::environment::MEAN;
use uw_survey::fit::{Fit, Fitted, Options, fit};
use uw_survey::vehicle::Vehicle;

/// 90 % of a normal variable lie within so many standard deviations.
const NINETY: f64 = 1.645;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (scenes, seed) = match &arguments[..] {
        [scenes, seed, ..] => (scenes.parse::<u32>()?, seed.parse::<u64>()?),
        _ => return Err("give SCENES SEED [spectral]".into()),
    };
    let bands = match arguments.get(2).map(String::as_str) {
        Some("spectral") => WaterBands::Spectral,
        _ => MEAN,
    };
    let vehicle = Vehicle::default();
    let mut tally = Tally::default();
    for scene in 0..scenes {
        let truth = Truth::draw(seed, scene, bands)?;
        let folder = tempfile::tempdir()?;
        let manifest = truth.take(folder.path(), &vehicle, u64::from(scene))?;
        let started = Instant::now();
        let options = Options {
            down: truth.is_down()?,
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
    }
    tally.tell();
    Ok(())
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
