//! Once-scattered sunlight: what the cut moments of the phase function take from it.

use std::f64::consts::PI;

use uw_media::phase::PhaseFunction;

use super::Travel;
use super::angles::{Node, legendre};
use super::water::Slice;

/// The phase function, cut and whole, and the slices that the sun's beam goes through.
pub struct Once<'a> {
    /// Phase function.
    pub phase: &'a dyn PhaseFunction,
    /// Its scaled moments.
    pub moments: &'a [f64],
    /// Share of scattered light that counts as unscattered.
    pub peak: f64,
    /// Cosine of the refracted sun.
    pub mu_sun: f64,
    /// Irradiance perpendicular to the beam just below the surface.
    pub sun: f64,
    /// Slices from the surface down.
    pub slices: &'a [Slice],
    /// Scaled optical depths of their tops and of the end of the last one.
    pub levels: &'a [f64],
    /// Indices in `levels` of the depths that are asked for.
    pub asked: &'a [usize],
    /// Scattering and scaled attenuation, 1/m, of endless water below the slices.
    pub deep: Option<(f64, f64)>,
}

impl Once<'_> {
    /// What upward radiance lacks, averaged over the azimuth, at the depths asked for (outer) and every node (inner).
    /// (Downwards the peak is in the way, and what is cut there changes no irradiance.)
    pub fn upwards(&self, nodes: &[Node]) -> Vec<Vec<f64>> {
        let steps = 4 * self.moments.len();
        let mean = |&(mu, _): &Node| {
            let at = |i: usize| Travel {
                down: -mu,
                azimuth_deg: 360.0 * i as f64 / steps as f64,
            };
            (0..steps).map(|i| self.missing(at(i))).sum::<f64>() / steps as f64
        };
        let missing: Vec<f64> = nodes.iter().map(mean).collect();
        let at = |level: &usize| {
            let pairs = nodes.iter().zip(&missing);
            pairs
                .map(|(node, missing)| missing * self.lit(-node.0, *level))
                .collect()
        };
        self.asked.iter().map(at).collect()
    }

    /// What radiance lacks at the depths asked for (outer) and in all directions (inner).
    pub fn along(&self, directions: &[Travel]) -> Vec<Vec<f64>> {
        let lacks = |level: usize| move |d: &Travel| self.missing(*d) * self.lit(d.down, level);
        let at = |level: &usize| directions.iter().map(lacks(*level)).collect();
        self.asked.iter().map(at).collect()
    }

    /// The phase function less the cut one, which scatters only what does not count as unscattered, 1/sr.
    fn missing(&self, travel: Travel) -> f64 {
        let mu = travel.down;
        let sines = ((1.0 - mu * mu) * (1.0 - self.mu_sun * self.mu_sun)).sqrt();
        let cosine = mu * self.mu_sun + sines * travel.azimuth_deg.to_radians().cos();
        let functions = legendre(0, self.moments.len(), cosine);
        let terms = functions.iter().zip(self.moments).enumerate();
        let cut: f64 = terms
            .map(|(l, (p, chi))| (2 * l + 1) as f64 * chi * p)
            .sum();
        let full = 4.0 * PI * self.phase.value(0.5 * (1.0 - cosine));
        (full - (1.0 - self.peak) * cut) / (4.0 * PI)
    }

    /// ∫ b times the beam's irradiance along the line of sight, weighted by the transmittance to its end at a level.
    fn lit(&self, mu: f64, level: usize) -> f64 {
        let end = self.levels[level];
        let slices = self.slices.iter().zip(self.levels.windows(2));
        let sum: f64 = if mu > 0.0 {
            let rate = 1.0 / mu - 1.0 / self.mu_sun;
            slices
                .take(level)
                .map(|(slice, ends)| {
                    let left = (-ends[1] / self.mu_sun - (end - ends[1]) / mu).exp();
                    left * slice.b * slice.thickness_m * mean(rate * (ends[1] - ends[0]))
                })
                .sum()
        } else {
            let rate = 1.0 / self.mu_sun - 1.0 / mu;
            let left = |top: f64| (-top / self.mu_sun + (top - end) / mu).exp();
            let deep = self.deep.filter(|(b, _)| *b > 0.0).map_or(0.0, |(b, c)| {
                left(self.levels[self.levels.len() - 1]) * b / (c * rate)
            });
            slices
                .skip(level)
                .map(|(slice, ends)| {
                    left(ends[0]) * slice.b * slice.thickness_m * mean(rate * (ends[1] - ends[0]))
                })
                .sum::<f64>()
                + deep
        };
        self.sun * sum / mu.abs()
    }
}

/// Mean of exp(−s) for s from 0 to `x`.
fn mean(x: f64) -> f64 {
    if x.abs() < 1e-8 {
        1.0
    } else {
        -(-x).exp_m1() / x
    }
}
