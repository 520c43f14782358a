//! A first guess of how a target's irradiance varies over it; the fit finds the rest.

use glam::DVec3;
use uw_render::prepare::PreparedLamp;
use uw_render::scene::Scene;

/// Share of the scattering coefficient that counts as a loss in the guess: most scattered light goes on almost
/// straight and still arrives. The fit corrects what this leaves.
const LOST_SHARE: f64 = 0.2;

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

impl Guess {
    /// The guess for the lamps of `scene` at a target of unit `normal`.
    pub fn lamps(scene: &Scene, normal: DVec3) -> Self {
        let attenuation = scene.water.as_ref().map_or([0.0; 3], |w| {
            std::array::from_fn(|k| w.iops.a[k] + LOST_SHARE * w.iops.b[k])
        });
        Self::Lamps(LampGuess {
            lamps: scene.lamps.iter().map(PreparedLamp::build).collect(),
            normal,
            attenuation,
        })
    }

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
    fn at(&self, point: DVec3) -> [f64; 3] {
        // A floor under the light outside all cones, where only scattered light arrives.
        let mut sum = [0.0; 3];
        for lamp in &self.lamps {
            let way = point - lamp.position;
            let range = way.length().max(1e-6);
            let direction = way / range;
            let cosine = -self.normal.dot(direction).min(0.0);
            let lit = lamp.relative_intensity(direction).max(0.02) * cosine / (range * range);
            for k in 0..3 {
                sum[k] += lamp.intensity[k] * lit * (-self.attenuation[k] * range).exp();
            }
        }
        sum.map(|x| x.max(1e-30))
    }
}
