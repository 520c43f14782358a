//! One source's light by wavelength: how much of each wavelength reaches the target, and what a channel therefore sees of
//! the target's texture.
//!
//! Where a scene goes by wavelength, M of `mod.rs` is a mean over the wavelengths of a channel, each weighted with the
//! light g that reaches the target in it:
//!
//! T = ⟨g exp(-c · length)⟩ / ⟨g⟩,  ρ = Σⱼ ρⱼ ⟨g exp(-c · length) pⱼ⟩ / ⟨g exp(-c · length)⟩
//!
//! with pⱼ the reflectances of the red, the green and the blue that the texture is mixed of. All of this is smooth over the
//! image and kept at a few of its points ([`SeenLight`]). Scattered rays have wavelengths of their own ([`super::walks`]).

use glam::DVec3;
use uw_media::kirk_attenuation;
use uw_render::prepare::{AtWavelengths, WavelengthSets};
use uw_render::scene::Scene;

use super::guess::{FAINTEST, Guess, LampGuess, Way, lost_per_m};
use super::target_view::{Sight, TargetView};

/// Every so many-th of the renderer's sets of wavelengths counts: a smooth mean does not need them all.
const SET_STEP: usize = 8;
/// Points along the image's edges at which its light is kept.
const COLUMNS: usize = 17;
const ROWS: usize = 11;
/// Share of walks whose wavelength is drawn evenly rather than by the light that is expected of it.
const EVEN_SHARE: f64 = 0.1;
/// Length of daylight's way to a depth, over that depth: between the sun's, refracted, and the sky's.
const DAYLIGHT_WAY: f64 = 1.1;

/// What each channel sees of a texture's red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colours(Option<[[f32; 3]; 3]>);

impl Colours {
    /// Each channel sees its own: scenes of three bands.
    pub const OWN: Self = Self(None);

    /// Channel by channel the share of red, green and blue.
    pub(super) fn mixed(shares: [[f64; 3]; 3]) -> Self {
        Self(Some(shares.map(|row| row.map(|share| share as f32))))
    }

    /// Reflectance that the channels see of a texture's `rgb`.
    #[inline]
    pub fn seen(&self, rgb: [f32; 3]) -> [f32; 3] {
        match &self.0 {
            None => rgb,
            Some(shares) => shares.map(|[r, g, b]| r * rgb[0] + g * rgb[1] + b * rgb[2]),
        }
    }
}

/// Water, light and texture at three wavelengths, one of each channel.
#[derive(Clone, Debug)]
pub(super) struct Set {
    /// Absorption, 1/m.
    pub(super) absorption: [f64; 3],
    /// Scattering, 1/m.
    pub(super) scattering: [f64; 3],
    /// What the source's light loses on its way, 1/m.
    lost: [f64; 3],
    /// Light of each lamp, or of daylight alone, relative to its channels, times what the set counts.
    lights: Vec<[f64; 3]>,
    /// Reflectance of the texture's red, green and blue.
    primaries: [[f64; 3]; 3],
}

/// From where the light comes.
#[derive(Clone, Debug)]
enum Origin {
    /// Through the surface at this height, m; `None` from everywhere.
    Daylight(Option<f64>),
    /// Lamps.
    Lamps(LampGuess),
}

/// Light of one source on a target by wavelength.
#[derive(Clone, Debug)]
pub struct SourceLight {
    sets: Vec<Set>,
    origin: Origin,
}

impl SourceLight {
    /// Daylight in `scene`, which has `wavelengths`.
    pub fn daylight(scene: &Scene, wavelengths: &WavelengthSets) -> Self {
        let sun = scene.sun.as_ref().map_or([0.0; 3], |sun| {
            sun.irradiance.map(|e| -e * sun.travel_direction.z.min(0.0))
        });
        let sky = scene.sky_radiance.map(|l| std::f64::consts::PI * l);
        let light = |at: &AtWavelengths| {
            vec![std::array::from_fn(|k| match sun[k] + sky[k] > 0.0 {
                true => (sun[k] * at.sun[k] + sky[k] * at.sky[k]) / (sun[k] + sky[k]),
                false => 1.0,
            })]
        };
        let lost = |a: f64, b: f64| DAYLIGHT_WAY * kirk_attenuation(a, b);
        Self {
            sets: sets(wavelengths, lost, light),
            origin: Origin::Daylight(scene.surface.map(|surface| surface.height_m)),
        }
    }

    /// The lamps of `guess`, as a scene with `wavelengths` has them.
    pub fn lamps(guess: &LampGuess, wavelengths: &WavelengthSets) -> Self {
        Self {
            sets: sets(wavelengths, lost_per_m, |at| at.lamps.clone()),
            origin: Origin::Lamps(guess.clone()),
        }
    }

    /// Mean attenuation of the light that reaches a point of the target, 1/m, per channel.
    pub(super) fn lost_per_m(&self, point: DVec3) -> [f64; 3] {
        let ways = self.ways(point);
        std::array::from_fn(|k| {
            let lights: Vec<f64> = self.sets.iter().map(|s| s.light(k, &ways)).collect();
            let lost = self.sets.iter().zip(&lights).map(|(s, g)| g * s.lost[k]);
            lost.sum::<f64>() / lights.iter().sum::<f64>()
        })
    }

    /// What the channels see around the point of `sight`.
    fn point(&self, sight: &Sight, guess: &Guess) -> PointLight {
        let ways = self.ways(sight.point);
        let guessed = guess.at(sight.point);
        let mut found = PointLight::default();
        for k in 0..3 {
            let (mut light, mut left, mut seen) = (0.0, 0.0, [0.0; 3]);
            for set in &self.sets {
                let reaching = set.light(k, &ways);
                let attenuation = set.absorption[k] + set.scattering[k];
                let direct = reaching * (-attenuation * sight.range_m).exp();
                light += reaching;
                left += direct;
                (0..3).for_each(|j| seen[j] += direct * set.primaries[j][k]);
            }
            let left = left.max(f64::MIN_POSITIVE);
            found.irradiance[k] = light / self.sets.len() as f64 / guessed[k];
            found.attenuation_per_m[k] = (light / left).ln() / sight.range_m.max(1e-9);
            found.colours[k] = seen.map(|sum| sum / left);
        }
        found
    }

    fn ways(&self, point: DVec3) -> Vec<Way> {
        match &self.origin {
            Origin::Daylight(surface_m) => vec![Way {
                strength: [1.0; 3],
                length_m: surface_m.map_or(0.0, |height| (height - point.z).max(0.0)),
            }],
            Origin::Lamps(lamps) => lamps.ways(point).collect(),
        }
    }

    /// Light that reaches a point in the wavelength of channel `k` of set `index`.
    pub(super) fn at(&self, point: DVec3, index: usize, k: usize) -> f64 {
        self.sets[index].light(k, &self.ways(point))
    }

    /// Set `index`.
    pub(super) fn set(&self, index: usize) -> &Set {
        &self.sets[index]
    }

    /// Which sets walks of channel `k` take: by the light that comes back from the point of `sight`.
    pub(super) fn choice(&self, k: usize, sight: &Sight) -> SetChoice {
        let ways = self.ways(sight.point);
        let returning = |set: &Set| {
            let lost = lost_per_m(set.absorption[k], set.scattering[k]);
            set.light(k, &ways) * (-lost * sight.range_m).exp()
        };
        let expected: Vec<f64> = self.sets.iter().map(returning).collect();
        let total: f64 = expected.iter().sum();
        let n = expected.len() as f64;
        let share = |light: f64| match total > 0.0 {
            true => EVEN_SHARE / n + (1.0 - EVEN_SHARE) * light / total,
            false => 1.0 / n,
        };
        let mut up_to = 0.0;
        let ends = expected.into_iter().map(|light| {
            up_to += share(light);
            up_to
        });
        SetChoice {
            ends: ends.collect(),
        }
    }
}

/// Every [`SET_STEP`]-th of `wavelengths`, with what light `lost` per metre of water with a and b, and the `lights`.
fn sets(
    wavelengths: &WavelengthSets,
    lost: impl Fn(f64, f64) -> f64,
    lights: impl Fn(&AtWavelengths) -> Vec<[f64; 3]>,
) -> Vec<Set> {
    let some = wavelengths.sets.iter().skip(SET_STEP / 2);
    let set = |at: &AtWavelengths| {
        let scattering = at.b;
        let absorption = std::array::from_fn(|k| (at.c[k] - at.b[k]).max(0.0));
        Set {
            absorption,
            scattering,
            lost: std::array::from_fn(|k| lost(absorption[k], scattering[k])),
            lights: lights(at)
                .into_iter()
                .map(|light| counted(at, light))
                .collect(),
            primaries: at.primaries,
        }
    };
    some.step_by(SET_STEP).map(set).collect()
}

fn counted(at: &AtWavelengths, light: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| at.weight[k] * light[k])
}

impl Set {
    /// Light that comes along `ways` in the wavelength of channel `k`, > 0.
    fn light(&self, k: usize, ways: &[Way]) -> f64 {
        let along = |(way, light): (&Way, &[f64; 3])| {
            way.strength[k] * light[k] * (-self.lost[k] * way.length_m).exp()
        };
        let sum: f64 = ways.iter().zip(&self.lights).map(along).sum();
        sum.max(FAINTEST)
    }

    /// Reflectance of the texture's red, green and blue in the wavelength of channel `k`.
    pub(super) fn primaries(&self, k: usize) -> [f64; 3] {
        self.primaries.map(|reflectance| reflectance[k])
    }
}

/// Which set of wavelengths a walk takes.
#[derive(Clone, Debug)]
pub(super) struct SetChoice {
    /// Where the share of each set ends, the last at 1.
    ends: Vec<f64>,
}

impl SetChoice {
    /// The set that a number in (0, 1) stands for, and by how much it was chosen more often than evenly.
    pub(super) fn of(&self, number: f64) -> (usize, f64) {
        let index = self.ends.partition_point(|&end| end <= number);
        let index = index.min(self.ends.len() - 1);
        let before = index.checked_sub(1).map_or(0.0, |i| self.ends[i]);
        (index, (self.ends[index] - before) * self.ends.len() as f64)
    }
}

/// The light that unscattered rays bring from the target, kept at points of the image.
#[derive(Clone, Debug)]
pub struct SeenLight {
    points: Vec<PointLight>,
}

/// What the channels see around a point of the image.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PointLight {
    /// Light on the target over its guess.
    pub(super) irradiance: [f64; 3],
    /// Attenuation of the unscattered ray, 1/m, as its transmittance has it.
    attenuation_per_m: [f64; 3],
    /// Per channel the share of the texture's red, green and blue.
    colours: [[f64; 3]; 3],
}

impl SeenLight {
    /// Of `light` in `view`; `guess` is the shape of its irradiance. The view must show the target alone.
    pub fn new(light: &SourceLight, guess: &Guess, view: &TargetView) -> Self {
        let (width, height) = view.size_px();
        let centre = view.sight(width / 2.0, height / 2.0);
        let at = |i: usize| {
            let (column, row) = (i % COLUMNS, i / COLUMNS);
            let x = width * column as f64 / (COLUMNS - 1) as f64;
            let y = height * row as f64 / (ROWS - 1) as f64;
            let sight = view.sight(x, y).or(centre);
            sight.map_or_else(PointLight::default, |s| light.point(&s, guess))
        };
        Self {
            points: (0..COLUMNS * ROWS).map(at).collect(),
        }
    }

    /// Between the points, at image coordinates in [-1, 1].
    pub(super) fn at(&self, (p, q): (f64, f64)) -> PointLight {
        let cell = |coordinate: f64, points: usize| {
            let cells = 0.5 * (coordinate + 1.0) * (points - 1) as f64;
            let before = (cells.max(0.0) as usize).min(points - 2);
            (before, (cells - before as f64).clamp(0.0, 1.0))
        };
        let ((column, s), (row, t)) = (cell(p, COLUMNS), cell(q, ROWS));
        let point = |row: usize, column: usize| &self.points[row * COLUMNS + column];
        let upper = point(row, column).towards(point(row, column + 1), s);
        let lower = point(row + 1, column).towards(point(row + 1, column + 1), s);
        upper.towards(&lower, t)
    }
}

impl PointLight {
    fn towards(&self, other: &Self, share: f64) -> Self {
        let mix = |x: [f64; 3], y: [f64; 3]| std::array::from_fn(|i| x[i] + share * (y[i] - x[i]));
        Self {
            irradiance: mix(self.irradiance, other.irradiance),
            attenuation_per_m: mix(self.attenuation_per_m, other.attenuation_per_m),
            colours: std::array::from_fn(|k| mix(self.colours[k], other.colours[k])),
        }
    }

    /// Transmittance of a ray of `range_m`.
    pub(super) fn transmittance(&self, range_m: f64) -> [f64; 3] {
        self.attenuation_per_m.map(|c| (-c * range_m).exp())
    }

    /// What the channels see of the texture.
    pub(super) fn colours(&self) -> Colours {
        Colours::mixed(self.colours)
    }
}
