//! A scene by wavelength: sets of three wavelengths, one for each channel, of which every sample has one. Each set stands for
//! an equal share of the light expected in every channel; with the weights of the sets their mean is the channel's value.
//! Twin: `shaders/common/spectrum.wgsl`.

use uw_media::Spectrum;
use uw_media::spectral::{Curve, Drawn, primaries};

use super::Geometry;
use super::expected_light::expected_light;
use super::layers::{Coefficients, Way, at_wavelengths};
use super::medium::Strategies;
use crate::scene::{Scene, Spectral};

/// Sets of wavelengths: enough that their mean is the channel's within 3e-4 for a coloured surface in the tail of a response
/// (tests/system/spectral.rs; with 256 it was 1.2e-3 off), and where a channel's ends differ by a factor of e²⁰.
const SETS: usize = 1024;
/// Share of wavelengths that are drawn by the response alone: no weight is above the inverse of it.
const EVEN_SHARE: f64 = 0.4;
/// Of which every so many-th goes into layers without noise.
const LAYER_STEP: usize = 8;

/// What a scene is at one set of wavelengths; three channels each.
#[derive(Clone, Debug, PartialEq)]
pub struct AtWavelengths {
    /// What the set counts for a channel; 1 in the mean over sets.
    pub weight: Spectrum,
    /// Scattering coefficient, 1/m.
    pub b: Spectrum,
    /// Attenuation coefficient, 1/m.
    pub c: Spectrum,
    /// Coefficients of the nodes and clouds of water that varies; `b` and `c` then stand for all of it.
    pub layers: Vec<Coefficients>,
    /// Free flights of paths that are joined to lamps.
    pub by_scattering: Strategies,
    /// Free flights of paths that look for daylight.
    pub by_attenuation: Strategies,
    /// Sunlight relative to its channels.
    pub sun: Spectrum,
    /// Light of the sky relative to its channels.
    pub sky: Spectrum,
    /// Reflectances of the red, the green and the blue that surfaces are mixed of.
    pub primaries: [Spectrum; 3],
    /// Light of each lamp relative to its channels.
    pub lamps: Vec<Spectrum>,
    /// Reflectances of the surfaces that have spectra of their own.
    pub reflectances: Vec<Spectrum>,
}

/// Sets of wavelengths that are chosen equally often.
#[derive(Clone, Debug, PartialEq)]
pub struct WavelengthSets {
    /// The sets.
    pub sets: Vec<AtWavelengths>,
    /// For each material its place among the reflectances of a set, where it has a spectrum of its own.
    pub own_reflectance: Vec<Option<usize>>,
    /// Means of the reflectances that surfaces are mixed of.
    mean_primaries: [Spectrum; 3],
}

impl WavelengthSets {
    /// The sets of `scene`, whose surfaces are those of `geometry`; `None` where the three channels are all there is.
    pub fn build(scene: &Scene, geometry: &Geometry) -> Option<Self> {
        let spectral = scene.spectral.as_ref()?;
        let materials = &geometry.materials;
        let expected = expected_light(scene, spectral, geometry);
        let favour = [0, 1, 2].map(|k| {
            let expected = expected.as_ref().map(|light| &light[k]);
            move |nm: f64| {
                let light = expected.map_or(1.0, |light| light.at(nm));
                EVEN_SHARE + (1.0 - EVEN_SHARE) * light
            }
        });
        let drawn = spectral
            .response
            .wavelength_sets(SETS, spectral.range_nm(), &favour)?;
        let mixed = primaries();
        let sun = spectral.relative_light(spectral.sun.as_ref());
        let sky = spectral.relative_light(spectral.sky.as_ref());
        let lamps: Vec<_> = scene
            .lamps
            .iter()
            .map(|lamp| spectral.relative_light(lamp.spectrum.as_ref()))
            .collect();
        let own: Vec<&Curve> = materials
            .iter()
            .filter_map(|m| m.spectrum.as_ref())
            .collect();
        let at = |drawn: [Drawn; 3]| {
            let nm = drawn.map(|drawn| drawn.wavelength_nm);
            let (b, c) = coefficients(scene, spectral, nm);
            let variation = scene.water.as_ref().map(|water| &water.variation);
            AtWavelengths {
                layers: variation.map_or_else(Vec::new, |own| at_wavelengths(own, nm)),
                weight: drawn.map(|drawn| drawn.weight),
                b,
                c,
                by_scattering: Strategies::default(),
                by_attenuation: Strategies::default(),
                sun: sun(nm),
                sky: sky(nm),
                primaries: [0, 1, 2].map(|k| nm.map(|nm| mixed[k].at(nm))),
                lamps: lamps.iter().map(|light| light(nm)).collect(),
                reflectances: own.iter().map(|curve| nm.map(|nm| curve.at(nm))).collect(),
            }
        };
        let mut sets: Vec<AtWavelengths> = drawn.into_iter().map(at).collect();
        choose_strategies(&mut sets);
        let mut given = 0..;
        let own_reflectance = materials
            .iter()
            .map(|material| material.spectrum.as_ref().and_then(|_| given.next()));
        let mut built = Self {
            own_reflectance: own_reflectance.collect(),
            sets,
            mean_primaries: [[0.0; 3]; 3],
        };
        built.mean_primaries = [0, 1, 2].map(|k| built.mean(|set| set.primaries[k]));
        Some(built)
    }

    /// Mean over the channels' responses of what `value` makes of a set, per channel.
    pub fn mean(&self, value: impl Fn(&AtWavelengths) -> Spectrum) -> Spectrum {
        let mut sum = [0.0; 3];
        for set in &self.sets {
            let own = value(set);
            for k in 0..3 {
                sum[k] += set.weight[k] * own[k];
            }
        }
        sum.map(|sum| sum / self.sets.len().max(1) as f64)
    }

    /// Mean transmittance of the channels over a way, from every eighth set.
    pub fn transmittance(&self, way: &Way) -> Spectrum {
        let some = self.sets.iter().skip(LAYER_STEP / 2).step_by(LAYER_STEP);
        let mut sums = ([0.0; 3], [0.0; 3]);
        for set in some {
            let own = set.transmittance_of(way);
            for k in 0..3 {
                sums.0[k] += set.weight[k] * own[k];
                sums.1[k] += set.weight[k];
            }
        }
        std::array::from_fn(|k| sums.0[k] / sums.1[k])
    }

    /// Mean reflectance of the channels of a surface that is mixed of `rgb`, or of `material`'s own spectrum.
    pub fn reflectance(&self, rgb: Spectrum, material: usize) -> Spectrum {
        match self.own_reflectance.get(material).copied().flatten() {
            Some(own) => self.mean(|set| set.reflectances[own]),
            None => {
                let [red, green, blue] = self.mean_primaries;
                std::array::from_fn(|k| rgb[0] * red[k] + rgb[1] * green[k] + rgb[2] * blue[k])
            }
        }
    }

    /// Coefficients a and b of each channel as the light meets them that is left after `way_m`.
    pub fn after(&self, way_m: f64) -> (Spectrum, Spectrum) {
        let left = |set: &AtWavelengths, k: usize| {
            let lost = set.c[k] - set.b[k] + LOST_OF_SCATTERED * set.b[k];
            attenuated(lost, way_m)
        };
        let weights = self.mean(|set| [0, 1, 2].map(|k| left(set, k)));
        let of = |value: fn(&AtWavelengths, usize) -> f64| {
            let sums = self.mean(|set| [0, 1, 2].map(|k| left(set, k) * value(set, k)));
            std::array::from_fn(|k| match weights[k] > 0.0 {
                true => sums[k] / weights[k],
                false => value(&self.sets[0], k),
            })
        };
        (of(|set, k| set.c[k] - set.b[k]), of(|set, k| set.b[k]))
    }
}

/// Share of scattered light that counts as lost on a long way.
const LOST_OF_SCATTERED: f64 = 0.1;

fn attenuated(c: f64, range_m: f64) -> f64 {
    // Where nothing is lost the range may be infinite.
    match c > 0.0 {
        true => (-c * range_m).exp(),
        false => 1.0,
    }
}

/// Scattering and attenuation at three wavelengths, of water that varies those that stand for all of it.
fn coefficients(
    scene: &Scene,
    spectral: &Spectral,
    wavelengths_nm: [f64; 3],
) -> (Spectrum, Spectrum) {
    let (Some(spectrum), Some(water)) = (&spectral.water, &scene.water) else {
        return ([0.0; 3], [0.0; 3]);
    };
    let (iops, plumes) = (
        spectrum.at(wavelengths_nm),
        water.variation.share_of_plumes(),
    );
    let (c, c_plumes) = (iops.c(), plumes.c());
    (
        std::array::from_fn(|k| iops.b[k] + plumes.b[k]),
        std::array::from_fn(|k| c[k] + c_plumes[k]),
    )
}

/// As many strategies in every set: those of the set that needs most.
fn choose_strategies(sets: &mut [AtWavelengths]) {
    let scatters: [bool; 3] = std::array::from_fn(|k| sets.iter().any(|set| set.b[k] > 0.0));
    let all: Vec<(Strategies, Strategies)> = sets
        .iter()
        .map(|set| {
            (
                Strategies::new(set.b, scatters),
                Strategies::new(set.c, scatters),
            )
        })
        .collect();
    let most = |of: fn(&(Strategies, Strategies)) -> usize| all.iter().map(of).max().unwrap_or(0);
    let counts = (most(|s| s.0.count), most(|s| s.1.count));
    for (set, (by_scattering, by_attenuation)) in sets.iter_mut().zip(all) {
        set.by_scattering = by_scattering.at_least(counts.0, set.b, scatters);
        set.by_attenuation = by_attenuation.at_least(counts.1, set.c, scatters);
    }
}
