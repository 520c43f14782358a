//! A first guess of how a target's irradiance varies over it; the fit finds the rest.

use glam::DVec3;
use uw_render::prepare::PreparedLamp;
use uw_render::scene::Scene;

/// Share of the scattering coefficient that counts as a loss in the guess: most scattered light goes on almost
/// straight and still arrives. The fit corrects what this leaves.
const LOST_SHARE: f64 = 0.2;
/// Least light anywhere: the guess is divided by.
pub(super) const FAINTEST: f64 = 1e-30;

/// What lamp light loses per metre of water with absorption `a` and scattering `b`, 1/m.
pub(super) fn lost_per_m(a: f64, b: f64) -> f64 {
    a + LOST_SHARE * b
}

/// Shape of the irradiance over the target; only ratios between its points matter.
#[derive(Clone, Debug)]
pub enum Guess {
    /// The same everywhere: daylight.
    Even,
    /// Lamps at 100 %, attenuated along straight lines.
    Lamps(LampGuess),
}

/// Lamps as the guess sees them.
#[derive(Clone, Debug)]
pub struct LampGuess {
    lamps: Vec<PreparedLamp>,
    normal: DVec3,
    attenuation: [f64; 3],
}

/// Light on its way to a point of the target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// Irradiance that it would bring through nothing, per channel.
    pub(super) strength: [f64; 3],
    /// Length of the way, m.
    pub(super) length_m: f64,
}

impl Guess {
    /// Value at a point of the target, per channel, > 0.
    #[inline]
    pub fn at(&self, point: DVec3) -> [f64; 3] {
        match self {
            Self::Even => [1.0; 3],
            Self::Lamps(guess) => guess.at(point),
        }
    }
}

impl LampGuess {
    /// The guess for the lamps of `scene` at a target of unit `normal`, in water as its three bands have it.
    pub fn new(scene: &Scene, normal: DVec3) -> Self {
        let attenuation = scene.water.as_ref().map_or([0.0; 3], |w| {
            std::array::from_fn(|k| lost_per_m(w.iops.a[k], w.iops.b[k]))
        });
        Self {
            lamps: scene.lamps.iter().map(PreparedLamp::build).collect(),
            normal,
            attenuation,
        }
    }

    /// The same lamps in water in which their light loses `lost_per_m`, 1/m.
    pub(super) fn losing(self, lost_per_m: [f64; 3]) -> Self {
        Self {
            attenuation: lost_per_m,
            ..self
        }
    }

    /// The straight way of each lamp's light to a point of the target.
    #[inline]
    pub(super) fn ways(&self, point: DVec3) -> impl Iterator<Item = Way> {
        self.lamps.iter().map(move |lamp| {
            let way = point - lamp.position;
            let range = way.length().max(1e-6);
            let direction = way / range;
            let cosine = -self.normal.dot(direction).min(0.0);
            // A floor under the light outside all cones, where only scattered light arrives.
            let lit = lamp.relative_intensity(direction).max(0.02) * cosine / (range * range);
            Way {
                strength: lamp.intensity.map(|intensity| intensity * lit),
                length_m: range,
            }
        })
    }

    fn at(&self, point: DVec3) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for way in self.ways(point) {
            for k in 0..3 {
                sum[k] += way.strength[k] * (-self.attenuation[k] * way.length_m).exp();
            }
        }
        sum.map(|x: f64| x.max(FAINTEST))
    }
}
