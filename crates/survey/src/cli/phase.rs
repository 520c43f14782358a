//! `uw phase`: a phase function as numbers.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::{ArgGroup, Args};
use uw_media::phase::{Phase, PhaseFunction, X_FLOOR};
use uw_render::sampling::Rng;

use super::error::CliError;
use super::numbers::{read_column, significant};
use super::output;
use super::phase_model::PhaseModel;

/// Significant digits of all numbers printed.
const DIGITS: usize = 12;

/// Arguments of `uw phase`.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("task").required(true)))]
pub(super) struct PhaseArguments {
    #[command(flatten)]
    model: PhaseModel,
    /// Print angle_deg,phase_per_sr,cdf for the scattering angles in the first column of this file, in degrees
    /// from 0 to 180; `-` is standard input.
    #[arg(long, group = "task", value_name = "FILE")]
    angles_deg: Option<PathBuf>,
    /// Print u,angle_deg for the shares u in the first column of this file, from 0 to 1: the angle below which
    /// that share of the light is scattered.
    #[arg(long, group = "task", value_name = "FILE")]
    inverse_cdf: Option<PathBuf>,
    /// Print this number of scattering angles drawn from the phase function.
    #[arg(long, group = "task", value_name = "N")]
    sample: Option<u64>,
    /// Seed of the angles drawn.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// CSV file to write instead of standard output.
    #[arg(short, long)]
    output: Option<PathBuf>,
}

impl PhaseArguments {
    /// Prints what was asked for.
    pub(super) fn run(&self) -> Result<(), CliError> {
        let phase = self.model.phase()?;
        if let Some(path) = &self.output {
            output::check_writable(path)?;
        }
        let path = self.output.as_deref();
        if let Some(file) = &self.angles_deg {
            let angles_deg = read_column(file, "angle_deg", " degrees", &(0.0..=180.0))?;
            output::to_file_or_stdout(path, |out| write_values(out, &phase, &angles_deg))
        } else if let Some(file) = &self.inverse_cdf {
            let shares = read_column(file, "u", "", &(0.0..=1.0))?;
            output::to_file_or_stdout(path, |out| write_inverse(out, &phase, &shares))
        } else {
            let count = self.sample.unwrap_or(0);
            output::to_file_or_stdout(path, |out| write_samples(out, &phase, count, self.seed))
        }
    }
}

fn write_values(out: &mut dyn Write, phase: &Phase, angles_deg: &[f64]) -> io::Result<()> {
    writeln!(out, "angle_deg,phase_per_sr,cdf")?;
    for &angle_deg in angles_deg {
        let x = sin2_half(angle_deg);
        let row =
            [angle_deg, value(phase, x), phase.cdf(x)].map(|value| significant(value, DIGITS));
        writeln!(out, "{}", row.join(","))?;
    }
    Ok(())
}

/// Phase function, 1/sr. Infinite straight on where it still rises at the smallest `x` that the models resolve.
fn value(phase: &Phase, x: f64) -> f64 {
    if x == 0.0 && phase.value(X_FLOOR) > phase.value(10.0 * X_FLOOR) {
        f64::INFINITY
    } else {
        phase.value(x)
    }
}

fn write_inverse(out: &mut dyn Write, phase: &Phase, shares: &[f64]) -> io::Result<()> {
    writeln!(out, "u,angle_deg")?;
    for &u in shares {
        let row = [u, angle_deg(phase.inverse_cdf(u))].map(|value| significant(value, DIGITS));
        writeln!(out, "{}", row.join(","))?;
    }
    Ok(())
}

fn write_samples(out: &mut dyn Write, phase: &Phase, count: u64, seed: u64) -> io::Result<()> {
    writeln!(out, "angle_deg")?;
    let mut rng = Rng::new(seed, 0, 0, 0);
    for _ in 0..count {
        let x = phase.inverse_cdf(fine_uniform(&mut rng));
        writeln!(out, "{}", significant(angle_deg(x), DIGITS))?;
    }
    Ok(())
}

/// A number in (0, 1) as fine as a double allows: the peak of water's phase functions lies at tiny shares.
fn fine_uniform(rng: &mut Rng) -> f64 {
    let bits = (u64::from(rng.bits()) << 32 | u64::from(rng.bits())) >> 12;
    (bits as f64 + 0.5) / (1_u64 << 52) as f64
}

/// x = sin²(θ/2), exact to rounding at the smallest angles.
fn sin2_half(angle_deg: f64) -> f64 {
    (0.5 * angle_deg.to_radians()).sin().powi(2)
}

/// The angle of x = sin²(θ/2), degrees, exact to rounding near 0° and finite to 180°.
fn angle_deg(x: f64) -> f64 {
    2.0 * x.sqrt().atan2((1.0 - x).sqrt()).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_keep_their_digits_down_to_the_smallest() {
        for angle in [1e-60, 1e-6, 0.3, 45.0, 90.0, 179.0, 180.0] {
            let back = angle_deg(sin2_half(angle));
            assert!((back / angle - 1.0).abs() < 1e-12, "{angle} {back}");
        }
        assert_eq!((sin2_half(0.0), angle_deg(0.0)), (0.0, 0.0));
    }
}
