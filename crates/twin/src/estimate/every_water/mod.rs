//! One set of paths for every water.
//!
//! In homogeneous water what a path of lamp light contributes depends on absorption a and scattering b only by its number
//! of scatterings k and its length s: w b^k e^(-(a + b) s). Paths drawn once, with orders and flights for a mixture of
//! waters, therefore give the parts of [`crate::estimate`]'s image (V, E, S and the spread) in any water, with exact
//! derivatives: they are smooth functions of a and b, as a fit needs them. A set belongs to a view and a phase function;
//! [`EveryPhase`] goes between several sets, made with the same random numbers.
//!
//! * E (`irradiance`): unscattered light in closed form, the rest by bridges from the target to the lamps;
//! * V (`veil`): walks from the camera, each vertex joined to a lamp by a bridge;
//! * S and spread (`sight`): walks from the camera to the target;
//! * light that the target sends back to itself by way of the water (`returned`).
//!
//! Lamps only, at 100 %, without a water surface. Unlike the estimate's, the irradiance is without the light that comes
//! back to the target from itself; [`Values::gain`] gives what that adds to it.

mod bridge;
mod evaluate;
mod flights;
mod irradiance;
mod light;
mod orders;
mod phases;
mod returned;
mod sight;
#[cfg(test)]
mod test_scene;
mod veil;

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use uw_media::Spectrum;
use uw_media::phase::PhaseTable;
use uw_render::prepare::PreparedLamp;
use uw_render::sampling::directions::frame;

use super::basis::Basis;
use super::guess::lost_per_m;
use super::numbers::Numbers;
use super::target_view::{Sight, TargetView};
use evaluate::{Coefficients, Exponent, Path, Paths};
pub use evaluate::{Derived, Field};
pub use irradiance::Unscattered;
pub use phases::{EveryPhase, Phases};

/// Independent groups of paths: their differences tell the standard error.
pub const GROUPS: usize = 8;
/// Degree of the polynomials of veil and scattered light over the image.
const DEGREE: usize = 4;
/// Relative difference of the lamps' colours that is rounding.
const SAME_COLOUR: f64 = 1e-9;

/// No set of paths can be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EveryWaterError {
    /// There is no lamp, or none shines.
    #[error(
        "one set of paths for every water needs a lamp that shines; the scene's lamps have no intensity"
    )]
    Dark,
    /// A channel's paths would not be those of another.
    #[error("lamp {lamp} differs in colour from lamp 0; all lamps must have one colour")]
    Colours {
        /// Which one, from 0.
        lamp: usize,
    },
    /// Too few paths for the groups.
    #[error("{paths} paths are too few: at least {least} are needed")]
    Few {
        /// How many were asked for.
        paths: usize,
        /// The least number.
        least: usize,
    },
    /// A phase function cannot be had.
    #[error(
        "backscatter fractions {0} to {1}: at least two are needed, in rising order, between 0 and 0.5"
    )]
    Backscatter(f64, f64),
}

/// What all paths of a view have in common.
struct Setting<'a> {
    view: &'a TargetView,
    lamps: &'a [PreparedLamp],
    basis: Basis,
    seed: u64,
}

impl<'a> Setting<'a> {
    fn new(view: &'a TargetView, lamps: &'a [PreparedLamp], seed: u64) -> Self {
        let down = view.camera.down;
        let level = |v: DVec3| v.dot(down).abs() < 1e-9;
        let even_q = level(view.normal)
            && lamps
                .iter()
                .all(|l| level(l.forward) && level(l.position - view.camera.position_m));
        Self {
            view,
            lamps,
            basis: Basis::new(DEGREE, even_q),
            seed,
        }
    }

    /// What a random point of the image sees, and the functions' values there.
    fn sight(&self, numbers: &mut Numbers, phi: &mut [f64]) -> Option<Sight> {
        let (width, height) = self.view.size_px();
        let sight = self
            .view
            .sight(numbers.next() * width, numbers.next() * height)?;
        self.basis.values(sight.image.0, sight.image.1, phi);
        Some(sight)
    }

    /// The lamp that `u` chooses evenly, and a point on its disk.
    fn lamp_point(&self, u: f64, numbers: &mut Numbers) -> (&'a PreparedLamp, DVec3) {
        let chosen = ((u * self.lamps.len() as f64) as usize).min(self.lamps.len() - 1);
        let lamp = &self.lamps[chosen];
        let (radius, azimuth) = (lamp.radius * numbers.random().sqrt(), numbers.random());
        let (sin, cos) = (std::f64::consts::TAU * azimuth).sin_cos();
        let (t, s) = frame(lamp.forward);
        (lamp, lamp.position + radius * (cos * t + sin * s))
    }

    /// A lamp's intensity on its axis, W/sr, mean of the channels.
    fn intensity(&self, lamp: &PreparedLamp) -> f64 {
        mean(&lamp.intensity)
    }

    /// Whether a point is on the camera's side of the target.
    fn is_before_target(&self, point: DVec3) -> bool {
        self.view.range_m(point, -self.view.normal).is_some()
    }
}

fn mean(channels: &Spectrum) -> f64 {
    channels.iter().sum::<f64>() / channels.len() as f64
}

/// Paths of one view in water of one phase function.
#[derive(Clone, Debug)]
pub struct EveryWater {
    basis: Basis,
    colour: Spectrum,
    unscattered: Unscattered,
    irradiance: Paths,
    veil: Paths,
    sight: Paths,
    even_sight: Paths,
    returned: Paths,
}

/// The parts of an image in one water, for lamps at 100 % of their intensity's mean over the channels; radiances and
/// irradiances of a channel are [`EveryWater::colour`] times these.
#[derive(Clone, Debug)]
pub struct Values {
    /// Radiance that never met the target, W/(m² sr).
    pub veil: Field,
    /// Irradiance over π of the target, W/(m² sr), by light that did not scatter.
    pub unscattered: Unscattered,
    /// The same by light that did, other than on its way from the target to itself.
    pub scattered: Field,
    /// Scattered rays that reach the target, weighted with the lamps' light there.
    pub sight: ScatteredSight,
    /// The same where the target is lit evenly, as by daylight.
    pub even_sight: ScatteredSight,
    /// Light that the water sends back to a white target, of its irradiance; mean over the image.
    pub returned: Derived,
    attenuation: Derived,
}

/// Camera rays that scatter and still reach the target.
#[derive(Clone, Debug, PartialEq)]
pub struct ScatteredSight {
    /// Their share: polynomial in 1/cos - 1 of the view's angle.
    pub share: [Derived; 3],
    /// Contrast that they leave at each of the set's frequencies, relative to frequency 0.
    pub transfer: Vec<Derived>,
}

impl ScatteredSight {
    /// Their share at the cosine of the view's angle.
    pub fn share_at(&self, cosine: f64) -> Derived {
        let m = 1.0 / cosine - 1.0;
        self.share[0] + self.share[1] * m + self.share[2] * (m * m)
    }
}

impl Values {
    /// Irradiance over π at image coordinates (p, q) in [-1, 1], W/(m² sr).
    pub fn irradiance(&self, p: f64, q: f64) -> Derived {
        self.unscattered.at(p, q) + self.scattered.at(p, q)
    }

    /// Its mean over the image, W/(m² sr).
    pub fn mean_irradiance(&self) -> Derived {
        self.unscattered.mean() + self.scattered.mean()
    }

    /// By how much light that the water sends back to a target of mean `reflectance` raises its irradiance.
    pub fn gain(&self, reflectance: f64) -> Derived {
        (Derived::constant(1.0) + self.returned * -reflectance).inverse()
    }

    /// Transmittance of an unscattered ray of length `range_m`.
    pub fn transmittance(&self, range_m: f64) -> Derived {
        let value = (-self.attenuation.value * range_m).exp();
        self.attenuation.chain(value, -range_m * value)
    }
}

impl EveryWater {
    /// Draws `paths` irradiance paths and veil walks, and half as many of the others, for `view`, lit by `lamps`, in water that
    /// scatters by `phase`. `seed` keys all random numbers.
    ///
    /// # Errors
    /// There is no light, lamps differ in colour, or there are too few paths.
    pub fn new(
        view: &TargetView,
        lamps: &[PreparedLamp],
        phase: &PhaseTable,
        paths: usize,
        seed: u64,
    ) -> Result<Self, EveryWaterError> {
        Self::with_frequencies(view, lamps, phase, &[], paths, seed)
    }

    /// The same with the spread at `frequencies`, cycles per metre.
    ///
    /// # Errors
    /// As [`EveryWater::new`].
    pub fn with_frequencies(
        view: &TargetView,
        lamps: &[PreparedLamp],
        phase: &PhaseTable,
        frequencies: &[f64],
        paths: usize,
        seed: u64,
    ) -> Result<Self, EveryWaterError> {
        let setting = Setting::new(view, lamps, seed);
        let colour = one_colour(lamps)?;
        let n = setting.basis.len();
        let least = 4 * n * GROUPS;
        let of_group = u32::try_from(paths / GROUPS).unwrap_or(u32::MAX);
        if paths < least {
            return Err(EveryWaterError::Few { paths, least });
        }
        let groups = |make: &(dyn Fn(u32) -> evaluate::Group + Sync)| {
            (0..GROUPS as u32)
                .into_par_iter()
                .map(make)
                .collect::<Vec<_>>()
        };
        let irradiance = groups(&|g| irradiance::scattered(&setting, phase, g, of_group));
        let veil = groups(&|g| veil::veil(&setting, phase, g, of_group));
        let (sight, even_sight) = (0..GROUPS as u32)
            .into_par_iter()
            .map(|g| sight::walks(&setting, phase, frequencies, g, of_group / 2).into())
            .unzip::<evaluate::Group, evaluate::Group, Vec<_>, Vec<_>>();
        let sights = |groups| Paths::new(groups, sight::SHARE_TERMS + frequencies.len());
        let returned = groups(&|g| returned::walks(&setting, phase, g, of_group / 2));
        Ok(Self {
            unscattered: Unscattered::new(&setting),
            irradiance: Paths::new(irradiance, n),
            veil: Paths::new(veil, n),
            sight: sights(sight),
            even_sight: sights(even_sight),
            basis: setting.basis,
            colour,
            returned: Paths::new(returned, 1),
        })
    }

    /// Intensity of the lamps in each channel, over its mean over the channels.
    pub fn colour(&self) -> Spectrum {
        self.colour
    }

    /// Number of paths kept: of irradiance, veil and sight.
    pub fn paths(&self) -> [usize; 3] {
        [&self.irradiance, &self.veil, &self.sight].map(Paths::len)
    }

    /// The image in water with absorption `a` >= 0 and scattering `b` > 0, 1/m.
    pub fn at(&self, a: f64, b: f64) -> Values {
        self.of_groups(0..GROUPS, a, b)
    }

    /// The same from each independent group of paths alone: the spread of these, over the root of their number, is the
    /// standard error of [`EveryWater::at`]. Light in closed form is that of all.
    pub fn by_group(&self, a: f64, b: f64) -> Vec<Values> {
        (0..GROUPS).map(|g| self.of_group(g, a, b)).collect()
    }

    /// The same from one of the [`GROUPS`] alone.
    pub fn of_group(&self, group: usize, a: f64, b: f64) -> Values {
        self.of_groups(group..group + 1, a, b)
    }

    fn of_groups(&self, groups: Range<usize>, a: f64, b: f64) -> Values {
        let water = Coefficients::new(a, b);
        let plain = |path: &Path| water.exponent(f64::from(path.scatterings), path.length_m);
        let field = |paths: &Paths| {
            let means = paths.means(groups.clone(), plain);
            Field {
                basis: self.basis.clone(),
                coefficients: paths.fit(groups.clone(), &means),
            }
        };
        let seen = |paths: &Paths, walks: Vec<Derived>| {
            let share = paths.fit(groups.clone(), &walks);
            let waves = walks[sight::SHARE_TERMS..].iter();
            ScatteredSight {
                share: [share[0], share[1], share[2]],
                transfer: waves.map(|wave| *wave * walks[0].inverse()).collect(),
            }
        };
        let in_lamps = self.sight.means(groups.clone(), lit(&water));
        let in_even = self.even_sight.means(groups.clone(), plain);
        let attenuation = Derived {
            value: water.a + water.b,
            by_a: 1.0,
            by_b: 1.0,
            by_ln_backscatter: 0.0,
        };
        Values {
            veil: field(&self.veil),
            unscattered: self.unscattered.in_water(attenuation),
            scattered: field(&self.irradiance),
            sight: seen(&self.sight, in_lamps),
            even_sight: seen(&self.even_sight, in_even),
            returned: self.returned.means(groups, lit(&water))[0],
            attenuation,
        }
    }
}

/// Exponents of walks weighted with the light where they end.
fn lit(water: &Coefficients) -> impl Fn(&Path) -> Exponent {
    let water = *water;
    let loss = lost_per_m(water.a, water.b);
    let (by_a, by_b) = (lost_per_m(1.0, 0.0), lost_per_m(0.0, 1.0));
    move |path| {
        let e = water.exponent(f64::from(path.scatterings), path.length_m);
        let [first, second] = path.light.map(f64::from);
        let slope = first + 2.0 * second * loss;
        Exponent {
            value: e.value + loss * (first + second * loss),
            by_a: e.by_a + slope * by_a,
            by_b: e.by_b + slope * by_b,
        }
    }
}

/// The lamps' common colour, mean 1.
fn one_colour(lamps: &[PreparedLamp]) -> Result<Spectrum, EveryWaterError> {
    let colour = |lamp: &PreparedLamp| {
        let all = mean(&lamp.intensity);
        (all > 0.0).then(|| lamp.intensity.map(|i| i / all))
    };
    let first = lamps.iter().find_map(colour).ok_or(EveryWaterError::Dark)?;
    for (index, lamp) in lamps.iter().enumerate() {
        let differs = |own: Spectrum| (0..3).any(|k| (own[k] - first[k]).abs() > SAME_COLOUR);
        if colour(lamp).is_some_and(differs) {
            return Err(EveryWaterError::Colours { lamp: index });
        }
    }
    Ok(first)
}
