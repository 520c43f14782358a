//! The water as the integrators read it: coefficients, phase table, and the sampling strategies.

use uw_media::phase::{PhaseFunction, PhaseTable};
use uw_media::{Iops, Spectrum};

use super::{Coefficients, Layers, WavelengthSets};
use crate::scene::Water;

/// Channels whose coefficients differ by more than this factor are sampled by one strategy each.
const GREY_RATIO: f64 = 1.3;

/// The water by coefficients that stand for all of it.
#[derive(Clone, Debug)]
pub struct Medium {
    /// Scattering coefficient, 1/m.
    pub b: Spectrum,
    /// Attenuation coefficient, 1/m.
    pub c: Spectrum,
    /// Smallest attenuation coefficient, 1/m.
    pub c_min: f64,
    /// Largest attenuation coefficient, 1/m.
    pub c_max: f64,
    /// Smallest absorption coefficient, 1/m.
    pub a_min: f64,
    /// Largest single scattering albedo b/c.
    pub albedo: f64,
    /// Natural logarithm of `b`; negative infinity where b is 0.
    pub ln_b: Spectrum,
    /// Phase function for the inner loop.
    pub phase: PhaseTable,
    /// Mean cosine of the phase function.
    pub mean_cosine: f64,
    /// Free flights of paths that are joined to lamps: scattering coefficients.
    pub by_scattering: Strategies,
    /// Natural logarithms of their coefficients.
    pub ln_sigma: Spectrum,
    /// Free flights of paths that look for daylight: attenuation coefficients.
    pub by_attenuation: Strategies,
}

/// Sampling coefficients shared by the channels: one where they are nearly grey, else one per channel, of
/// which each path draws one. Contributions are divided by the mean of the densities (balance heuristic).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Strategies {
    /// Number of strategies in use, 1 to 3; 0 where no channel scatters.
    pub count: usize,
    /// Sampling coefficients, 1/m: > 0 for those in use, all 0 where nothing scatters.
    pub sigma: Spectrum,
}

impl Strategies {
    /// Strategies for channels with sampling coefficients `sigma` (1/m), of which `relevant` ones scatter.
    pub fn new(sigma: Spectrum, relevant: [bool; 3]) -> Self {
        let used: Vec<f64> = (0..3)
            .filter(|&k| relevant[k] && sigma[k] > 0.0)
            .map(|k| sigma[k])
            .collect();
        let largest = used.iter().copied().fold(0.0, f64::max);
        let smallest = used.iter().copied().fold(f64::INFINITY, f64::min);
        let chosen = if used.len() > 1 && largest <= GREY_RATIO * smallest {
            vec![used.iter().sum::<f64>() / used.len() as f64]
        } else {
            used
        };
        let unused = if chosen.is_empty() { 0.0 } else { 1.0 };
        let at = |k: usize| chosen.get(k).copied().unwrap_or(unused);
        let sigma = [at(0), at(1), at(2)];
        Self {
            count: chosen.len(),
            sigma,
        }
    }
}

impl Strategies {
    /// At least `count` strategies: one for each channel where there are fewer.
    pub(super) fn at_least(self, count: usize, sigma: Spectrum, relevant: [bool; 3]) -> Self {
        if self.count >= count {
            return self;
        }
        let used: Vec<f64> = (0..3).filter(|&k| relevant[k]).map(|k| sigma[k]).collect();
        let largest = used.iter().copied().fold(0.0, f64::max);
        let at = |k: usize| match used.get(k) {
            Some(&sigma) if sigma > 0.0 => sigma,
            _ => largest.max(f64::MIN_POSITIVE),
        };
        Self {
            count,
            sigma: [at(0), at(1), at(2)],
        }
    }
}

impl Medium {
    /// As [`Medium::build`] for water by wavelength: coefficients of the light that is left after `way_m`, smallest and
    /// largest ones of all wavelengths.
    pub fn by_wavelength(water: &Water, spectrum: &WavelengthSets, way_m: f64) -> Option<Self> {
        let (a, b) = spectrum.after(way_m);
        let first = spectrum.sets.first()?;
        let of_light_left = Water {
            iops: Iops { a, b },
            ..water.clone()
        };
        let medium = Self::build(&of_light_left)?;
        let all = |value: fn(f64, f64) -> f64| {
            let sets = spectrum.sets.iter();
            sets.flat_map(move |set| [0, 1, 2].map(|k| value(set.b[k], set.c[k])))
        };
        let least = |value| all(value).fold(f64::INFINITY, f64::min);
        let most = |value| all(value).fold(0.0, f64::max);
        let attenuation = medium.by_attenuation;
        Some(Self {
            c_min: least(|_, c| c),
            c_max: most(|_, c| c),
            a_min: least(|b, c| c - b).max(0.0),
            albedo: most(|b, c| if c > 0.0 { b / c } else { 0.0 }),
            by_scattering: first.by_scattering,
            ln_sigma: first.by_scattering.sigma.map(f64::ln),
            by_attenuation: Strategies {
                count: first.by_attenuation.count,
                ..attenuation.at_least(first.by_attenuation.count, medium.c, [true; 3])
            },
            ..medium
        })
    }

    /// Prepares `water`; `None` when nothing is absorbed or scattered.
    pub fn build(water: &Water) -> Option<Self> {
        let b = water.iops.b;
        let c = water.iops.c();
        if c.iter().all(|&c| c == 0.0) {
            return None;
        }
        let scatters = b.map(|b| b > 0.0);
        let by_scattering = Strategies::new(b, scatters);
        Some(Self {
            b,
            c,
            c_min: c.iter().copied().fold(f64::INFINITY, f64::min),
            c_max: c.iter().copied().fold(0.0, f64::max),
            a_min: water.iops.a.iter().copied().fold(f64::INFINITY, f64::min),
            ln_b: b.map(f64::ln),
            phase: PhaseTable::new(&water.phase),
            mean_cosine: water.phase.mean_cosine(),
            albedo: (0..3)
                .filter(|&k| c[k] > 0.0)
                .map(|k| b[k] / c[k])
                .fold(0.0, f64::max),
            by_scattering,
            ln_sigma: by_scattering.sigma.map(f64::ln),
            by_attenuation: Strategies::new(c, scatters),
        })
    }

    /// With the smallest and the largest coefficients of water that varies.
    pub(super) fn with_extremes_of(
        self,
        layers: &Layers,
        spectrum: Option<&WavelengthSets>,
    ) -> Self {
        let nodes = layers.depths_m.len();
        let all: Vec<&[Coefficients]> = match spectrum {
            Some(spectrum) => spectrum.sets.iter().map(|set| &set.layers[..]).collect(),
            None => vec![&layers.coefficients],
        };
        let of_nodes = |value: fn(f64, f64) -> f64| {
            let nodes = all.iter().flat_map(move |set| &set[..nodes]);
            nodes.flat_map(move |own| [0, 1, 2].map(|k| value(own.b[k], own.c[k])))
        };
        let most = |of: &[Coefficients]| of.iter().flat_map(|own| own.c).fold(0.0, f64::max);
        let with_plumes = |set: &&[Coefficients]| {
            let (nodes, plumes) = set.split_at(nodes);
            most(nodes)
                + plumes
                    .iter()
                    .map(|own| most(std::slice::from_ref(own)))
                    .sum::<f64>()
        };
        let albedo = |own: &Coefficients, k: usize| {
            if own.c[k] > 0.0 {
                own.b[k] / own.c[k]
            } else {
                0.0
            }
        };
        let every = all.iter().flat_map(|set| set.iter());
        Self {
            c_min: of_nodes(|_, c| c).fold(f64::INFINITY, f64::min),
            c_max: all.iter().map(with_plumes).fold(0.0, f64::max),
            a_min: of_nodes(|b, c| c - b)
                .fold(f64::INFINITY, f64::min)
                .max(0.0),
            albedo: every
                .flat_map(|own| [0, 1, 2].map(|k| albedo(own, k)))
                .fold(0.0, f64::max),
            ..self
        }
    }

    /// How the light of far lamps decays at least, 1/m, for what decides which walks go on: as in diffusion, where water loses little of what
    /// it scatters; half of the attenuation elsewhere.
    pub fn lamp_decay(&self) -> f64 {
        let diffuse = 3.0 * (1.0 - self.albedo) * (1.0 - self.albedo * self.mean_cosine);
        self.c_min * diffuse.max(0.0).sqrt().min(0.5)
    }

    /// Whether any channel scatters.
    pub fn scatters(&self) -> bool {
        self.by_scattering.count > 0
    }

    /// Least absorption coefficient of the channels, 1/m.
    pub(super) fn a_min(&self) -> f64 {
        (0..3)
            .map(|k| self.c[k] - self.b[k])
            .fold(f64::INFINITY, f64::min)
            .max(0.0)
    }

    /// Mean scattering coefficient of the channels, 1/m.
    pub fn b_mean(&self) -> f64 {
        self.b.iter().sum::<f64>() / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearly_grey_water_shares_one_strategy() {
        let s = Strategies::new([0.9, 1.0, 1.1], [true; 3]);
        assert_eq!((s.count, s.sigma[0]), (1, 1.0));
    }

    #[test]
    fn coloured_water_has_one_strategy_per_channel_that_scatters() {
        let s = Strategies::new([0.05, 1.5, 0.3], [true, true, false]);
        assert_eq!((s.count, s.sigma[0], s.sigma[1]), (2, 0.05, 1.5));
        let none = Strategies::new([1.0; 3], [false; 3]);
        assert_eq!((none.count, none.sigma), (0, [0.0; 3]));
    }
}
