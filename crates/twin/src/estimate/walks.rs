//! Walks from the camera to the target: what the water does to rays that scatter before they meet it.

use std::f64::consts::TAU;

use uw_media::phase::PhaseTable;
use uw_render::sampling::{Draws, directions::turn};
use uw_render::scene::Water;

use super::basis::solve;
use super::guess::Guess;
use super::numbers::Numbers;
use super::source_light::{Colours, SeenLight, SetChoice, SourceLight};
use super::target_view::{Sight, TargetView};

/// Walks per channel and group; each group is a batch of draws of its own.
const WALKS_PER_GROUP: u32 = 2048;
/// Weight below which a walk is ended or strengthened at random.
const ROULETTE_BELOW: f64 = 0.05;
/// Scatterings after which a walk is given up; only reached in water that hardly absorbs.
const MOST_SCATTERINGS: u32 = 2000;

/// Light by wavelength, where the scene goes by wavelength: each walk then has a wavelength of its own.
#[derive(Clone, Copy)]
pub(super) struct ByWavelength<'a> {
    /// The light.
    pub(super) light: &'a SourceLight,
    /// The same at points of the image.
    pub(super) seen: &'a SeenLight,
}

/// Walks of one channel.
pub(super) struct Walker<'a> {
    view: &'a TargetView,
    phase: &'a PhaseTable,
    guess: &'a Guess,
    channel: usize,
    absorption: f64,
    scattering: f64,
    wavelengths: Option<(ByWavelength<'a>, SetChoice)>,
}

/// The wavelength of a walk.
#[derive(Clone, Copy)]
struct Wavelength<'a> {
    by: ByWavelength<'a>,
    /// Its set.
    index: usize,
    /// By how much it was chosen more often than evenly.
    favour: f64,
}

/// Absorption and scattering on a walk, 1/m.
#[derive(Clone, Copy)]
struct Coefficients {
    absorption: f64,
    scattering: f64,
}

/// Sums over all walks.
pub(super) struct Sums {
    /// Moments of m = 1/cos - 1: Σ m^0 .. m^4.
    moments: [f64; 5],
    /// Σ weight · m^0 .. m^2.
    weights: [f64; 3],
    /// Σ weight · cosines of the offset, per frequency.
    waves: Vec<f64>,
    /// Σ weight · reflectance of the texture's red, green and blue, where walks have wavelengths.
    colours: Option<[f64; 3]>,
}

impl<'a> Walker<'a> {
    /// Walks of `channel` through `water` from the camera of `view` to the target. Each is weighted by the `guess` of the
    /// irradiance where it ends over that at the point its image point sees; with `wavelengths` by the light of its own one
    /// there over that of all.
    pub(super) fn new(
        water: &Water,
        phase: &'a PhaseTable,
        view: &'a TargetView,
        guess: &'a Guess,
        wavelengths: Option<ByWavelength<'a>>,
        channel: usize,
    ) -> Self {
        let (width, height) = view.size_px();
        let centre = view.sight(width / 2.0, height / 2.0);
        let choice = |by: ByWavelength<'a>| Some((by, by.light.choice(channel, &centre?)));
        Self {
            view,
            phase,
            guess,
            channel,
            absorption: water.iops.a[channel],
            scattering: water.iops.b[channel],
            wavelengths: wavelengths.and_then(choice),
        }
    }

    /// The walks of one group.
    pub(super) fn walks(&self, frequencies: &[f64], seed: u64, group: u32) -> Sums {
        let mut sums = Sums {
            moments: [0.0; 5],
            weights: [0.0; 3],
            waves: vec![0.0; frequencies.len()],
            colours: self.wavelengths.as_ref().map(|_| [0.0; 3]),
        };
        let (width, height) = self.view.size_px();
        let draws = Draws::new(seed, self.channel as u32, group, 0, 0x5eed);
        for walk in 0..WALKS_PER_GROUP {
            let mut numbers = Numbers::of(draws.at(walk));
            let (x, y) = (numbers.next() * width, numbers.next() * height);
            let Some(sight) = self.view.sight(x, y) else {
                continue;
            };
            let m = 1.0 / self.view.incidence(sight.direction) - 1.0;
            let mut power = 1.0;
            for sum in &mut sums.moments {
                *sum += power;
                power *= m;
            }
            let wavelength = self.wavelength(&mut numbers);
            let Some((end, weight)) = self.walk(&sight, wavelength, &mut numbers) else {
                continue;
            };
            let weight = self.lit(weight, wavelength, &sight, end);
            sums.weights[0] += weight;
            sums.weights[1] += weight * m;
            sums.weights[2] += weight * m * m;
            let (dx, dy) = self.view.offset(sight.point, end);
            for (wave, f) in sums.waves.iter_mut().zip(frequencies) {
                *wave += 0.5 * weight * ((TAU * f * dx).cos() + (TAU * f * dy).cos());
            }
            if let (Some(colours), Some(at)) = (&mut sums.colours, wavelength) {
                let primaries = at.by.light.set(at.index).primaries(self.channel);
                (0..3).for_each(|j| colours[j] += weight * primaries[j]);
            }
        }
        sums
    }

    /// A wavelength for the next walk, where there are wavelengths.
    fn wavelength(&self, numbers: &mut Numbers) -> Option<Wavelength<'a>> {
        let (by, choice) = self.wavelengths.as_ref()?;
        let (index, favour) = choice.of(numbers.next());
        Some(Wavelength {
            by: *by,
            index,
            favour,
        })
    }

    /// `weight` times the light where a walk ends over that at the point which its image point sees.
    fn lit(
        &self,
        weight: f64,
        wavelength: Option<Wavelength>,
        sight: &Sight,
        end: glam::DVec3,
    ) -> f64 {
        let k = self.channel;
        let here = self.guess.at(sight.point)[k];
        let Some(Wavelength { by, index, favour }) = wavelength else {
            return weight * self.guess.at(end)[k] / here;
        };
        let all = by.seen.at(sight.image).irradiance[k] * here;
        weight * by.light.at(end, index, k) / (favour * all)
    }

    fn coefficients(&self, wavelength: Option<Wavelength>) -> Coefficients {
        let Some(Wavelength { by, index, .. }) = wavelength else {
            return Coefficients {
                absorption: self.absorption,
                scattering: self.scattering,
            };
        };
        let set = by.light.set(index);
        Coefficients {
            absorption: set.absorption[self.channel],
            scattering: set.scattering[self.channel],
        }
    }

    /// A walk that scatters at least once: where it meets the target, and its weight.
    fn walk(
        &self,
        sight: &Sight,
        wavelength: Option<Wavelength>,
        numbers: &mut Numbers,
    ) -> Option<(glam::DVec3, f64)> {
        let Coefficients {
            absorption,
            scattering,
        } = self.coefficients(wavelength);
        let mut weight = -(-scattering * sight.range_m).exp_m1();
        if !(weight > 0.0) {
            return None;
        }
        let mut direction = sight.direction;
        let first = -(-numbers.next() * weight).ln_1p() / scattering;
        let mut origin = self.view.camera.position_m + first * direction;
        weight *= (-absorption * first).exp();
        for _ in 0..MOST_SCATTERINGS {
            direction = turn(
                direction,
                self.phase.sample_x(numbers.next()),
                numbers.next(),
            );
            let flight = -numbers.next().ln() / scattering;
            let to_target = self
                .view
                .range_m(origin, direction)
                .unwrap_or(f64::INFINITY);
            let way = flight.min(to_target);
            weight *= (-absorption * way).exp();
            origin += way * direction;
            if to_target <= flight {
                return Some((origin, weight));
            }
            if weight < ROULETTE_BELOW {
                if numbers.next() < 0.5 {
                    return None;
                }
                weight *= 2.0;
            }
        }
        None
    }
}

impl Sums {
    pub(super) fn of_all(groups: &[Self]) -> Self {
        let total = |of: fn(&Self) -> &[f64], i: usize| groups.iter().map(|g| of(g)[i]).sum();
        let colours = groups[0].colours.map(|_| {
            let seen = |j: usize| groups.iter().filter_map(|g| g.colours).map(|c| c[j]).sum();
            std::array::from_fn(seen)
        });
        Self {
            moments: std::array::from_fn(|i| total(|g| &g.moments, i)),
            weights: std::array::from_fn(|i| total(|g| &g.weights, i)),
            waves: (0..groups[0].waves.len())
                .map(|i| total(|g| &g.waves, i))
                .collect(),
            colours,
        }
    }

    /// Least-squares polynomial of the weights in m; a constant where the view has no range of angles.
    pub(super) fn share(&self) -> [f64; 3] {
        let s = &self.moments;
        let mut matrix = vec![s[0], s[1], s[2], s[1], s[2], s[3], s[2], s[3], s[4]];
        let mut right = self.weights.to_vec();
        match solve(&mut matrix, &mut right) {
            Some(()) if right.iter().all(|x| x.is_finite()) => [right[0], right[1], right[2]],
            _ => [self.weights[0] / s[0].max(1.0), 0.0, 0.0],
        }
    }

    /// Contrast left at each frequency by the scattered rays, relative to frequency 0.
    pub(super) fn transfer(&self) -> Vec<f64> {
        let total = self.weights[0];
        self.waves
            .iter()
            .map(|w| if total > 0.0 { w / total } else { 0.0 })
            .collect()
    }

    /// What the scattered rays of three channels see of a texture.
    pub(super) fn colours(channels: [&Self; 3]) -> Colours {
        if channels.iter().any(|sums| sums.colours.is_none()) {
            return Colours::OWN;
        }
        Colours::mixed(channels.map(|sums| {
            let total = sums.weights[0].max(f64::MIN_POSITIVE);
            sums.colours.unwrap_or_default().map(|seen| seen / total)
        }))
    }
}
