//! The weight of a path in three channels that share one walk.
//!
//! Every channel would draw its free flights with its own coefficient. One path draws them with one of the
//! strategies' coefficients, chosen at random, and divides by the mean density of all strategies: the balance
//! heuristic over the whole path (spectral multiple importance sampling, Wilkie et al. 2014). Each weight is
//! then at most the number of strategies times what the channel's own strategy would give.

use crate::prepare::{Medium, Strategies};

/// Integrand per channel and density per strategy of a path so far, both divided by the same factor.
#[derive(Clone, Copy, Debug)]
pub struct Spectral {
    /// Integrand, per channel.
    pub value: [f64; 3],
    /// Density under each strategy; those beyond the count are 0.
    pub density: [f64; 3],
    /// Number of strategies, at least 1.
    pub count: usize,
    /// The strategy that draws this path's free flights.
    pub chosen: usize,
}

impl Spectral {
    /// A path before its first event; `u` in (0, 1) chooses the strategy.
    #[inline]
    pub fn start(strategies: &Strategies, u: f64) -> Self {
        let count = strategies.count.max(1);
        let chosen = ((u * count as f64) as usize).min(count - 1);
        let density = std::array::from_fn(|j| if j < count { 1.0 } else { 0.0 });
        Self {
            value: [1.0; 3],
            density,
            count,
            chosen,
        }
    }

    /// What is left of the number that [`Spectral::start`] chose a strategy by: in [0, 1) and as good as new.
    pub fn rest_of_start(&self, u: f64) -> f64 {
        (u * self.count as f64).fract()
    }

    /// Mean density over the strategies.
    #[inline]
    pub fn mean_density(&self) -> f64 {
        (self.density[0] + self.density[1] + self.density[2]) / self.count as f64
    }

    /// Weight per channel, value over mean density.
    #[inline]
    pub fn weight(&self) -> [f64; 3] {
        let inverse = 1.0 / self.mean_density();
        let [r, g, b] = self.value;
        [r * inverse, g * inverse, b * inverse]
    }

    /// Largest weight of the three channels.
    #[inline]
    pub fn largest_weight(&self) -> f64 {
        self.value[0].max(self.value[1]).max(self.value[2]) / self.mean_density()
    }

    /// Multiplies the integrand of each channel.
    #[inline]
    pub fn scale(&mut self, factor: [f64; 3]) {
        for k in 0..3 {
            self.value[k] *= factor[k];
        }
    }

    /// Multiplies the integrand of all channels.
    #[inline]
    pub fn scale_all(&mut self, factor: f64) {
        for value in &mut self.value {
            *value *= factor;
        }
    }

    /// The path scattered after the flight `t`, drawn with density σ e^(−σt).
    #[inline]
    pub fn scatter(&mut self, medium: &Medium, strategies: &Strategies, t: f64) {
        for j in 0..self.count {
            self.density[j] *= strategies.sigma[j];
        }
        for k in 0..3 {
            self.value[k] *= medium.b[k];
        }
        self.pass(medium, strategies, t);
    }

    /// The path went on unscattered for `t`, with probability e^(−σt).
    #[inline]
    pub fn pass(&mut self, medium: &Medium, strategies: &Strategies, t: f64) {
        let sigma = &strategies.sigma;
        // Relative to the smallest coefficient, so that no length makes all densities 0.
        let mut least = sigma[0];
        for j in 1..self.count {
            least = least.min(sigma[j]);
        }
        let mut passed = [0.0; 3];
        for k in 0..3 {
            passed[k] = ((least - medium.c[k]) * t).exp();
            self.value[k] *= passed[k];
        }
        if self.count > 1 {
            for j in 0..self.count {
                self.density[j] *= if sigma[j] == medium.c[j] {
                    passed[j]
                } else {
                    ((least - sigma[j]) * t).exp()
                };
            }
        }
        self.normalise();
    }

    /// A fresh path after `scatterings` with free flights of `length` in all, the last of them perhaps unfinished.
    pub fn after(mut self, medium: &Medium, scatterings: usize, length: f64) -> Self {
        let n = scatterings as f64;
        let ln_density = |j: usize| n * medium.ln_sigma[j] - medium.by_scattering.sigma[j] * length;
        let mut largest = ln_density(0);
        for j in 1..self.count {
            largest = largest.max(ln_density(j));
        }
        for k in 0..3 {
            let ln_scattered = if scatterings > 0 {
                n * medium.ln_b[k]
            } else {
                0.0
            };
            self.value[k] = (ln_scattered - medium.c[k] * length - largest).exp();
        }
        for j in 0..self.count {
            self.density[j] = (ln_density(j) - largest).exp();
        }
        self
    }

    /// Makes the largest density 1.
    #[inline]
    fn normalise(&mut self) {
        let [a, b, c] = self.density;
        let factor = 1.0 / a.max(b).max(c).max(1e-300);
        for k in 0..3 {
            self.density[k] *= factor;
            self.value[k] *= factor;
        }
    }

    /// The path is taken unscattered over `t` for certain.
    #[inline]
    pub fn pass_surely(&mut self, medium: &Medium, t: f64) {
        self.scale(medium.transmittance(t));
    }
}
