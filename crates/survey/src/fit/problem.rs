//! The pictures' blocks as a problem of least squares: what a water, lamps and daylight would show, against what is seen.
//!
//! In light of the lamps the signal of block j from distance i is
//!
//! y = L G (1 + ε_i) [V_j + E_j (T_j ρ_j + S_j (s ∗ ρ)_j)]
//!
//! with exposure and lamps of the vehicle's file and their gain G; V, E, T, S, s of the water ([`super::views`]); and ε_i, by which a
//! picture's light is off for reasons of its own (so may its detail be). The target's blocks ρ are those of the nearest pictures, cleared of all this
//! ([`super::channel`]). In daylight veil and light are not predicted but left open: y = v(p, q) + e (T_j ρ_j + S_j (s ∗ ρ)_j), v a polynomial of second degree,
//! e one for each depth of the vehicle. A vehicle that looks down has the target deeper the farther it is: there e falls as
//! exp(-K_d d), and K_d is about what Kirk (1984) found for it: (a² + (0.425 μ - 0.19) a b)^½ / μ, with the cosine μ of the sun's zenith
//! angle in the water.

use rayon::prelude::*;

use super::FittedPicture;
use super::channel::{Channel, Plan, Prediction, Shift};
use super::layout::{LN_BACKSCATTER, Layout};
use super::least_squares::Residual;
use super::mixture::Scale;
use super::mosaic::Cosines;
use super::pictures::{Light, Pictures, SAME_M, Shown};
use super::priors::{Prior, water_prior};
use super::views::{Coefficients, Views};
use uw_twin::estimate::every_water::GROUPS;

/// Error of a block's light that is not the sensor's, as a share: of the model and of where the block is.
const BLOCK_ERROR: f64 = 0.005;
/// Number of blocks that share such an error: it is smooth over the picture.
const SHARED_BY: f64 = 4.0;
/// Error of a picture's light that all its blocks share, as a share, besides that of the paths.
const PICTURE_ERROR: f64 = 0.01;
/// By how much errors of few paths are larger than the spread of their groups tells: now and then a rare path counts for much.
pub(super) const RARE_PATHS: f64 = 2.0;
/// What is known of a target before: mean reflectance and its spread.
const REFLECTANCE: [f64; 2] = [0.25, 0.2];
/// Relative change by which derivatives are taken.
const CHANGE: f64 = 1e-3;

/// The problem.
pub(super) struct Problem<'a> {
    pub(super) pictures: &'a Pictures,
    pub(super) layout: Layout,
    pub(super) prior: Prior,
    views: &'a Views,
    /// Signal per radiance.
    exposure: f64,
    /// Per picture its distance among those of the views.
    view_of: Vec<usize>,
    /// Per picture its depth among all depths.
    depth_of: Vec<usize>,
    plans: [Plan; 3],
    cosines: Cosines,
    /// Per channel and picture the relative error of its light that all blocks share.
    pub(super) picture_errors: [Vec<f64>; 3],
    pub(super) scale: Scale,
    /// Mean and spread of ln a and ln b per channel.
    pub(super) waters: [[[f64; 2]; 2]; 3],
}

impl<'a> Problem<'a> {
    pub(super) fn new(
        pictures: &'a Pictures,
        views: &'a Views,
        exposure: f64,
        prior: Prior,
    ) -> Self {
        let nearest = |list: &[f64], value: f64| {
            let far = |i: &usize| (list[*i] - value).abs();
            let nearest = (0..list.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
            nearest.unwrap_or(0)
        };
        let depth = |shown: &Shown| shown.depth_m.unwrap_or(0.0);
        let mut depths: Vec<f64> = pictures.shown.iter().map(depth).collect();
        depths.sort_by(f64::total_cmp);
        depths.dedup_by(|a, b| (*a - *b).abs() < SAME_M);
        let all = &pictures.shown;
        Self {
            layout: Layout {
                pictures: all.len(),
                depths: depths.len(),
            },
            view_of: (all.iter())
                .map(|shown| nearest(&views.distances_m, shown.distance_m))
                .collect(),
            depth_of: (all.iter())
                .map(|shown| nearest(&depths, depth(shown)))
                .collect(),
            plans: std::array::from_fn(|k| Plan::new(pictures, k)),
            cosines: Cosines::new(pictures.grid.size),
            picture_errors: std::array::from_fn(|_| vec![PICTURE_ERROR; all.len()]),
            scale: Scale::new(),
            waters: std::array::from_fn(water_prior),
            exposure,
            prior,
            pictures,
            views,
        }
    }

    /// Parameters to begin with, in a water with the coefficients `a` and `b` per channel.
    pub(super) fn start(&self, a: [f64; 3], b: [f64; 3]) -> Vec<f64> {
        let mut at = vec![0.0; self.layout.len()];
        at[LN_BACKSCATTER] = self.prior.backscatter.ln();
        for k in 0..3 {
            at[self.layout.ln_a(k)] = a[k].ln();
            at[self.layout.ln_b(k)] = b[k].ln();
            at[self.layout.ln_k_d(k)] = self.kirk(&self.water(k, &at)).value.ln();
            // The target is as bright as targets are.
            let channel = self.channel(k, &at, None);
            let prediction = channel.predict(&Shift::default(), &self.scales(k, &at));
            let bright = (prediction.reflectance / REFLECTANCE[0]).max(0.02);
            at[Layout::ln_gain(k)] = bright.ln();
            self.start_daylight(k, &mut at);
        }
        at
    }

    /// Veil and light of daylight, each half of what is seen.
    fn start_daylight(&self, k: usize, at: &mut [f64]) {
        for (index, shown) in self.pictures.shown.iter().enumerate() {
            let signals = shown.blocks.iter().map(|block| block.signal[k]);
            let mean = (signals.sum::<f64>() / shown.blocks.len() as f64).max(1e-9);
            if shown.light == Light::Daylight {
                let e = self.layout.ln_daylight(k, self.depth_of[index]);
                at[e] = (0.5 * mean / REFLECTANCE[0]).ln();
                at[self.layout.picture(k, index)] = 0.5 * mean;
            }
        }
    }

    pub(super) fn water(&self, k: usize, at: &[f64]) -> Coefficients {
        Coefficients {
            a: at[self.layout.ln_a(k)].exp(),
            b: at[self.layout.ln_b(k)].exp(),
            backscatter: at[LN_BACKSCATTER].exp(),
        }
    }

    /// What the water of `at` does to channel `k` of all pictures, as all paths or one group of them have it.
    fn channel(&self, k: usize, at: &[f64], group: Option<usize>) -> Channel<'_> {
        let water = self.water(k, at);
        let values: Vec<_> = (0..self.views.distances_m.len())
            .into_par_iter()
            .map(|view| self.views.values(view, &water, group))
            .collect();
        let pictures = self.pictures.shown.iter().zip(&self.view_of);
        let seen = pictures.map(|(shown, &view)| match shown.light {
            Light::Lamps(_) => self.views.lamps(view, k, &values[view]),
            Light::Daylight => self.views.daylight(view, &values[view]),
        });
        Channel {
            pictures: self.pictures,
            plan: &self.plans[k],
            cosines: &self.cosines,
            k,
            seen: seen.collect(),
        }
    }

    /// Signal per radiance of every picture.
    fn scales(&self, k: usize, at: &[f64]) -> Vec<f64> {
        (0..self.pictures.shown.len())
            .map(|index| self.scale(k, index, at))
            .collect()
    }

    fn scale(&self, k: usize, index: usize, at: &[f64]) -> f64 {
        match self.pictures.shown[index].light {
            Light::Lamps(level) => {
                let off = 1.0 + at[self.layout.picture(k, index)];
                self.exposure * level * at[Layout::ln_gain(k)].exp() * off
            }
            Light::Daylight => self.daylight(k, index, at).0,
        }
    }

    /// Daylight's signal of a white target in picture `index`, and its derivative by ln K_d.
    fn daylight(&self, k: usize, index: usize, at: &[f64]) -> (f64, f64) {
        let e = at[self.layout.ln_daylight(k, self.depth_of[index])].exp();
        match self.prior.down {
            None => (e, 0.0),
            Some(_) => {
                let k_d = at[self.layout.ln_k_d(k)].exp();
                let below = self.pictures.shown[index].distance_m - self.pictures.nearest_m;
                let left = e * (-k_d * below).exp();
                (left, -k_d * below * left)
            }
        }
    }

    /// All residuals at `at`: blocks of pictures, and what is known before.
    pub(super) fn residuals(&self, at: &[f64]) -> Vec<Residual> {
        let of_channels = (0..3).into_par_iter().map(|k| self.of_channel(k, at));
        let mut all: Vec<Residual> = of_channels.collect::<Vec<_>>().concat();
        self.priors(at, &mut all);
        all
    }

    /// Takes the pictures' errors to be what the paths leave in the water of `at`.
    pub(super) fn weigh_pictures(&mut self, at: &[f64]) {
        let errors = [0, 1, 2].map(|k| {
            let means = (0..GROUPS).into_par_iter().map(|group| {
                let channel = self.channel(k, at, Some(group));
                let made = channel.predict(&Shift::default(), &self.scales(k, at));
                made.radiance
                    .iter()
                    .map(|blocks| mean(blocks))
                    .collect::<Vec<f64>>()
            });
            let means: Vec<Vec<f64>> = means.collect();
            let error = |picture: usize| {
                let values = means.iter().map(|of_group| of_group[picture]);
                PICTURE_ERROR.hypot(RARE_PATHS * relative_error(values))
            };
            (0..self.pictures.shown.len()).map(error).collect()
        });
        self.picture_errors = errors;
    }

    /// All residuals as one independent group of paths has them, without derivatives.
    pub(super) fn residuals_of_group(&self, at: &[f64], group: usize) -> Vec<f64> {
        let of_channels = (0..3).into_par_iter().map(|k| {
            let channel = self.channel(k, at, Some(group));
            let here = channel.predict(&Shift::default(), &self.scales(k, at));
            self.compared(k, at, (&here, &[]))
        });
        let of_channels: Vec<Residual> = of_channels.collect::<Vec<_>>().concat();
        let mut priors = Vec::new();
        self.priors(at, &mut priors);
        of_channels.iter().chain(&priors).map(|r| r.value).collect()
    }

    /// Residuals of a channel's blocks, and of its target's reflectance.
    fn of_channel(&self, k: usize, at: &[f64]) -> Vec<Residual> {
        let channel = self.channel(k, at, None);
        let scales = self.scales(k, at);
        let here = channel.predict(&Shift::default(), &scales);
        let changed = self.changed(k, at, &channel, &scales);
        self.compared(k, at, (&here, &changed))
    }

    fn compared(
        &self,
        k: usize,
        at: &[f64],
        (here, changed): (&Prediction, &[(usize, Prediction)]),
    ) -> Vec<Residual> {
        let mut all = Vec::new();
        for index in 0..self.pictures.shown.len() {
            for place in 0..self.plans[k].compared[index].len() {
                all.push(self.residual(k, (index, place), at, (here, changed)));
            }
        }
        let slope = |(parameter, there): &(usize, Prediction)| {
            let change = (there.reflectance - here.reflectance) / CHANGE;
            (*parameter, change / REFLECTANCE[1])
        };
        all.push(Residual {
            value: (here.reflectance - REFLECTANCE[0]) / REFLECTANCE[1],
            slopes: changed.iter().map(slope).collect(),
        });
        all
    }

    /// Predictions for a small change of each parameter that the target or the water's values hang on.
    fn changed(
        &self,
        k: usize,
        at: &[f64],
        channel: &Channel<'_>,
        scales: &[f64],
    ) -> Vec<(usize, Prediction)> {
        let water = self.water(k, at);
        let none = Shift::default();
        let shifts = [
            (
                self.layout.ln_a(k),
                Shift {
                    a: CHANGE * water.a,
                    ..none
                },
            ),
            (
                self.layout.ln_b(k),
                Shift {
                    b: CHANGE * water.b,
                    ..none
                },
            ),
            (
                LN_BACKSCATTER,
                Shift {
                    ln_backscatter: CHANGE,
                    ..none
                },
            ),
        ];
        let mut changed: Vec<_> = (shifts.iter())
            .map(|(parameter, shift)| (*parameter, channel.predict(shift, scales)))
            .collect();
        let brighter = |of: &dyn Fn(usize) -> bool| -> Vec<f64> {
            let all = scales.iter().enumerate();
            all.map(|(i, scale)| {
                if of(i) {
                    scale * (1.0 + CHANGE)
                } else {
                    *scale
                }
            })
            .collect()
        };
        let lit = |i: usize| self.pictures.shown[i].light != Light::Daylight;
        let all = channel.predict(&none, &brighter(&lit));
        changed.push((Layout::ln_gain(k), all));
        for (teller, _) in &self.plans[k].told_by {
            let one = channel.predict(&none, &brighter(&|i| i == *teller));
            changed.push((self.layout.picture(k, *teller), one));
        }
        changed
    }

    /// The residual of a block compared.
    fn residual(
        &self,
        k: usize,
        (index, place): (usize, usize),
        at: &[f64],
        (here, changed): (&Prediction, &[(usize, Prediction)]),
    ) -> Residual {
        let shown = &self.pictures.shown[index];
        let off = at[self.layout.detail(k, index)];
        let with_detail = |[radiance, detail]: [f64; 2]| radiance + off * detail;
        let radiance = with_detail(here.radiance[index][place]);
        let (_, of_shown) = self.plans[k].compared[index][place];
        let open = self.layout.picture(k, index);
        let scale = self.scale(k, index, at);
        let mut slopes: Vec<(usize, f64)> = (changed.iter())
            .map(|(parameter, there)| {
                let there = with_detail(there.radiance[index][place]);
                (*parameter, scale * (there - radiance) / CHANGE)
            })
            .collect();
        slopes.push((
            self.layout.detail(k, index),
            scale * here.radiance[index][place][1],
        ));
        let mut signal = scale * radiance;
        match shown.light {
            Light::Lamps(_) => {
                slopes.push((Layout::ln_gain(k), signal));
                slopes.push((open, signal / (1.0 + at[open])));
            }
            Light::Daylight => {
                let (p, q) = self.views.points(self.view_of[index])[of_shown].image;
                let (_, by_k_d) = self.daylight(k, index, at);
                slopes.push((self.layout.ln_daylight(k, self.depth_of[index]), signal));
                slopes.push((self.layout.ln_k_d(k), by_k_d * radiance));
                for (i, factor) in [1.0, p, q, p * p, p * q, q * q].into_iter().enumerate() {
                    signal += at[open + i] * factor;
                    slopes.push((open + i, factor));
                }
            }
        }
        let weight = 1.0 / self.error(k, index, place);
        for (_, slope) in &mut slopes {
            *slope *= weight;
        }
        Residual {
            value: weight * (signal - shown.blocks[of_shown].signal[k]),
            slopes,
        }
    }

    /// Standard error of a block compared: its own noise, that of the block that tells the target, and the model's.
    fn error(&self, k: usize, index: usize, place: usize) -> f64 {
        let (block, of_shown) = self.plans[k].compared[index][place];
        let own = &self.pictures.shown[index].blocks[of_shown];
        let signal = own.signal[k];
        let told = self.plans[k].told_by.iter().find_map(|(teller, blocks)| {
            let at = blocks.binary_search_by_key(&block, |(b, _)| *b).ok()?;
            let teller = &self.pictures.shown[*teller].blocks[blocks[at].1];
            Some(teller.variance[k] / teller.signal[k].powi(2).max(teller.variance[k]))
        });
        let shares = told.unwrap_or(0.0) + 2.0 * SHARED_BY * BLOCK_ERROR * BLOCK_ERROR;
        (own.variance[k] + shares * signal * signal).sqrt()
    }

    /// Mean reflectance of the target per channel.
    pub(super) fn reflectances(&self, at: &[f64]) -> [f64; 3] {
        [0, 1, 2].map(|k| {
            let channel = self.channel(k, at, None);
            channel
                .predict(&Shift::default(), &self.scales(k, at))
                .reflectance
        })
    }

    /// Mean and deviation of the blocks of every picture, seen and fitted.
    pub(super) fn fitted_pictures(&self, at: &[f64]) -> Vec<FittedPicture> {
        let of_channels = [0, 1, 2].map(|k| self.of_channel(k, at));
        let mut next = [0; 3];
        let of = |(index, shown): (usize, &Shown)| {
            let moments = [0, 1, 2].map(|k| {
                let pairs = self.plans[k].compared[index].iter().enumerate();
                let (first, mut noise) = (next[k], 0.0);
                next[k] += self.plans[k].compared[index].len();
                let pairs = pairs.map(|(place, (_, of_shown))| {
                    let seen = shown.blocks[*of_shown].signal[k];
                    noise += shown.blocks[*of_shown].variance[k];
                    let residual = of_channels[k][first + place].value;
                    [seen, seen + self.error(k, index, place) * residual]
                });
                let pairs: Vec<[f64; 2]> = pairs.collect();
                let [mean, [seen, fitted]] = moments(&pairs);
                let noise = noise / pairs.len().max(1) as f64;
                [mean, [(seen * seen - noise).max(0.0).sqrt(), fitted]]
            });
            FittedPicture {
                distance_m: shown.distance_m,
                level: match shown.light {
                    Light::Lamps(level) => level,
                    Light::Daylight => 0.0,
                },
                mean: moments.map(|[mean, _]| mean),
                deviation: moments.map(|[_, deviation]| deviation),
            }
        };
        self.pictures.shown.iter().enumerate().map(of).collect()
    }
}

/// Mean radiance of the blocks compared.
fn mean(blocks: &[[f64; 2]]) -> f64 {
    blocks.iter().map(|[radiance, _]| radiance).sum::<f64>() / blocks.len().max(1) as f64
}

/// Relative standard error of the mean of independent values; 0 where that is not positive.
fn relative_error(values: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
    let n = values.len() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
    match mean > 0.0 {
        true => (squares / (n * (n - 1.0))).sqrt() / mean,
        false => 0.0,
    }
}

/// Means and deviations of pairs of numbers.
fn moments(pairs: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let n = pairs.len().max(1) as f64;
    let mean = [0, 1].map(|i| pairs.iter().map(|pair| pair[i]).sum::<f64>() / n);
    let square = [0, 1].map(|i| pairs.iter().map(|p| (p[i] - mean[i]).powi(2)).sum::<f64>() / n);
    [mean, square.map(f64::sqrt)]
}
