//! What is known of waters, lamps and targets before the pictures, as residuals.

use uw_media::WaterType;

use super::layout::{LN_BACKSCATTER, Layout, OF_PICTURE, PLACE};
use super::least_squares::Residual;
use super::mixture::{self, OFF_SCALE};
use super::pictures::Light;
use super::problem::Problem;
use super::views::Coefficients;
use uw_twin::environment::JerlovWater;
use uw_twin::estimate::every_water::Derived;

/// Spread of the deviations of the lamps' gains in the channels from each other, logarithms.
const COLOUR_ERROR: f64 = 0.1;
/// Water bodies of Jerlov's types spread in their coefficients; other waters spread more.
const WIDER: f64 = 2.0;
/// How well Kirk's formula is met, of the logarithm.
const KIRK_ERROR: f64 = 0.15;
/// What is known of daylight's signal before: next to nothing; mean and spread of its logarithm.
const DAYLIGHT: [f64; 2] = [-2.0, 4.0];
/// Error of a picture's detail that all its blocks share, as a share: focus, pixels, and what the model leaves.
const DETAIL_ERROR: f64 = 0.015;

/// What is known before the pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prior {
    pub(super) backscatter: f64,
    /// Of the logarithm.
    pub(super) backscatter_error: f64,
    /// Of the logarithm of the lamps' gain.
    pub(super) gain_error: f64,
    /// The water is on Jerlov's scale.
    pub(super) jerlov: bool,
    /// Cosine of the sun's zenith angle in the water, where the vehicle looks down.
    pub(super) down: Option<f64>,
}

impl Problem<'_> {
    /// K_d by Kirk's formula, 1/m.
    pub(super) fn kirk(&self, water: &Coefficients) -> Derived {
        let cosine = self.prior.down.unwrap_or(1.0);
        let (a, b, share) = (water.a, water.b, 0.425 * cosine - 0.19);
        let root = (a * a + share * a * b).sqrt();
        Derived {
            value: root / cosine,
            by_a: (2.0 * a + share * b) / (2.0 * root * cosine),
            by_b: share * a / (2.0 * root * cosine),
            by_ln_backscatter: 0.0,
        }
    }

    /// Adds the residuals of all that is known before.
    pub(super) fn priors(&self, at: &[f64], all: &mut Vec<Residual>) {
        let mut known = |index: usize, mean: f64, error: f64| {
            all.push(Residual {
                value: (at[index] - mean) / error,
                slopes: vec![(index, 1.0 / error)],
            });
        };
        let backscatter = (self.prior.backscatter.ln(), self.prior.backscatter_error);
        known(LN_BACKSCATTER, backscatter.0, backscatter.1);
        known(PLACE, mixture::PLACE[0], mixture::PLACE[1]);
        for k in 0..3 {
            if !self.prior.jerlov {
                let [a, b] = self.waters[k];
                known(self.layout.ln_a(k), a[0], a[1]);
                known(self.layout.ln_b(k), b[0], b[1]);
            }
            self.priors_of_pictures(k, &mut known);
        }
        if self.prior.jerlov {
            (0..3).for_each(|k| all.extend(self.on_scale(k, at)));
        }
        self.prior_of_gains(at, all);
        (0..3).for_each(|k| all.push(self.prior_of_k_d(k, at)));
    }

    /// How far a channel's water is off that of its place on Jerlov's scale.
    fn on_scale(&self, k: usize, at: &[f64]) -> [Residual; 2] {
        let own = [self.layout.ln_a(k), self.layout.ln_b(k)];
        let scale = self.scale.at(k, at[PLACE]);
        std::array::from_fn(|i| Residual {
            value: (at[own[i]] - scale[i].ln) / OFF_SCALE,
            slopes: vec![
                (own[i], 1.0 / OFF_SCALE),
                (PLACE, -scale[i].by_place / OFF_SCALE),
            ],
        })
    }

    fn priors_of_pictures(&self, k: usize, known: &mut impl FnMut(usize, f64, f64)) {
        for (index, shown) in self.pictures.shown.iter().enumerate() {
            let open = self.layout.picture(k, index);
            // Of its open numbers a lamp picture uses the first one.
            let first = match shown.light {
                Light::Lamps(_) => self.picture_errors[k][index],
                Light::Daylight => 1.0,
            };
            known(open, 0.0, first);
            (1..OF_PICTURE - 1).for_each(|i| known(open + i, 0.0, 1.0));
            known(self.layout.detail(k, index), 0.0, DETAIL_ERROR);
        }
        for depth in 0..self.layout.depths {
            known(self.layout.ln_daylight(k, depth), DAYLIGHT[0], DAYLIGHT[1]);
        }
    }

    fn prior_of_k_d(&self, k: usize, at: &[f64]) -> Residual {
        let water = self.water(k, at);
        let expected = self.kirk(&water);
        let weight = 1.0 / KIRK_ERROR;
        let relative = |slope: f64| -weight * slope / expected.value;
        Residual {
            value: weight * (at[self.layout.ln_k_d(k)] - expected.value.ln()),
            slopes: vec![
                (self.layout.ln_k_d(k), weight),
                (self.layout.ln_a(k), relative(water.a * expected.by_a)),
                (self.layout.ln_b(k), relative(water.b * expected.by_b)),
            ],
        }
    }

    /// Gains differ between the channels less than they are off together.
    fn prior_of_gains(&self, at: &[f64], all: &mut Vec<Residual>) {
        let gains: Vec<usize> = (0..3).map(Layout::ln_gain).collect();
        let mean = gains.iter().map(|g| at[*g]).sum::<f64>() / 3.0;
        let weight = 1.0 / (3.0 * self.prior.gain_error);
        all.push(Residual {
            value: mean / self.prior.gain_error,
            slopes: gains.iter().map(|g| (*g, weight)).collect(),
        });
        for g in &gains {
            let slope = |other: &usize| {
                let own = f64::from(u8::from(other == g));
                (*other, (own - 1.0 / 3.0) / COLOUR_ERROR)
            };
            all.push(Residual {
                value: (at[*g] - mean) / COLOUR_ERROR,
                slopes: gains.iter().map(slope).collect(),
            });
        }
    }
}

/// Mean and spread of the logarithms of absorption and scattering of a channel, from Jerlov's ten types.
pub(super) fn water_prior(k: usize) -> [[f64; 2]; 2] {
    let types: Vec<[f64; 2]> = WaterType::ALL
        .iter()
        .filter_map(|t| JerlovWater::from(*t).iops().ok())
        .map(|iops| [iops.a[k].ln(), iops.b[k].ln()])
        .collect();
    [0, 1].map(|i| {
        let n = types.len() as f64;
        let mean = types.iter().map(|t| t[i]).sum::<f64>() / n;
        let spread = types.iter().map(|t| (t[i] - mean).powi(2)).sum::<f64>() / n;
        [mean, WIDER * spread.sqrt().max(0.2)]
    })
}
