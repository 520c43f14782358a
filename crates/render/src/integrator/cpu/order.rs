//! How many scatterings a connection to a lamp has: q(k | D), a Poisson law with a geometric tail.
//!
//! A pure Poisson law is not enough: at high orders the light falls geometrically, and a thinner tail in the
//! density would mean unbounded weights.

/// Share of the geometric part.
const TAIL_SHARE: f64 = 0.02;
/// Range of the ratio of the geometric part.
const LEAST_TAIL_RATIO: f64 = 0.4;
const LARGEST_TAIL_RATIO: f64 = 0.985;
/// Highest order drawn.
pub const MAX_ORDER: usize = 512;

/// The law with its table of ln(ε (1 − γ) γ^k k!).
#[derive(Clone, Debug)]
pub struct OrderLaw {
    ratio: f64,
    ln_ratio: f64,
    ln_tail: Vec<f64>,
}

impl OrderLaw {
    /// The law for water whose largest single scattering albedo is `albedo`. Order k carries weights of up to
    /// albedo^k, so their variance is finite when the ratio of the tail is above albedo².
    pub fn new(albedo: f64) -> Self {
        let ratio = albedo.clamp(LEAST_TAIL_RATIO, LARGEST_TAIL_RATIO);
        let mut ln_tail = vec![(TAIL_SHARE * (1.0 - ratio)).ln()];
        for k in 1..=MAX_ORDER {
            ln_tail.push(ln_tail[k - 1] + ratio.ln() + (k as f64).ln());
        }
        Self {
            ratio,
            ln_ratio: ratio.ln(),
            ln_tail,
        }
    }

    /// Ratio of the geometric part.
    pub(crate) fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Draws k for optical depth `depth` = σD from `u` in (0, 1); `None` beyond [`MAX_ORDER`].
    #[inline]
    pub fn sample(&self, depth: f64, u: f64) -> Option<usize> {
        let k = if u < TAIL_SHARE {
            ((u / TAIL_SHARE).ln() / self.ln_ratio) as usize
        } else {
            poisson((u - TAIL_SHARE) / (1.0 - TAIL_SHARE), depth)
        };
        (k <= MAX_ORDER).then_some(k)
    }

    /// Probability of at least one scattering, 1 − q(0 | D).
    #[inline]
    pub fn scattered_share(&self, depth: f64) -> f64 {
        TAIL_SHARE * self.ratio - (1.0 - TAIL_SHARE) * (-depth).exp_m1()
    }

    /// Draws k >= 1, with probability q(k | D) / (1 − q(0 | D)).
    #[inline]
    pub fn sample_scattered(&self, depth: f64, u: f64) -> Option<usize> {
        let x = u * self.scattered_share(depth);
        let tail = TAIL_SHARE * self.ratio;
        let k = if x < tail {
            1 + ((x / tail).ln() / self.ln_ratio) as usize
        } else {
            poisson((-depth).exp() + (x - tail) / (1.0 - TAIL_SHARE), depth).max(1)
        };
        (k <= MAX_ORDER).then_some(k)
    }

    /// ln of ε (1 − γ) γ^k k!. q(k | D)·k! is this tail and the Poisson part (1 − ε) e^(−σD) (σD)^k.
    #[inline]
    pub fn ln_tail(&self, k: usize) -> f64 {
        self.ln_tail[k]
    }
}

/// ln(1 − ε).
pub const LN_POISSON_SHARE: f64 = -0.02020270731751945;

/// Poisson variate by inversion.
fn poisson(u: f64, mean: f64) -> usize {
    // From the mode outwards the terms cannot underflow, however large the mean; below 500 starting at 0
    // is exact and quicker.
    if mean > 500.0 {
        return poisson_large(u, mean);
    }
    let mut term = (-mean).exp();
    let mut sum = term;
    let mut k = 0;
    while u > sum && k <= MAX_ORDER {
        k += 1;
        term *= mean / k as f64;
        sum += term;
    }
    k
}

/// For means so large that almost every order lies beyond [`MAX_ORDER`]: the exact lower tail in logarithms.
fn poisson_large(u: f64, mean: f64) -> usize {
    let mut ln_term = -mean;
    let mut sum = 0.0;
    for k in 0..=MAX_ORDER {
        if k > 0 {
            ln_term += (mean / k as f64).ln();
        }
        sum += ln_term.exp();
        if u <= sum {
            return k;
        }
    }
    MAX_ORDER + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::sampling::Rng;

    #[test]
    fn drawn_orders_follow_the_stated_law() {
        let law = OrderLaw::new(0.8);
        assert!((LN_POISSON_SHARE - (1.0 - TAIL_SHARE).ln()).abs() < 1e-15);
        let mut rng = Rng::new(9, 9, 9, 9);
        for (depth, apart) in [1e-3f64, 0.4, 3.0, 20.0]
            .into_iter()
            .flat_map(|d| [(d, false), (d, true)])
        {
            let n = 200_000;
            let mut counts = vec![0u32; MAX_ORDER + 2];
            for _ in 0..n {
                // Both ways of drawing have the same probabilities above 0.
                let u = rng.uniform();
                let k = if !apart {
                    law.sample(depth, u)
                } else if rng.uniform() < law.scattered_share(depth) {
                    law.sample_scattered(depth, u)
                } else {
                    Some(0)
                };
                counts[k.unwrap_or(MAX_ORDER + 1)] += 1;
            }
            let mut chi2 = 0.0;
            let mut cells = 0;
            for k in 0..=MAX_ORDER {
                let poisson = LN_POISSON_SHARE - depth + k as f64 * depth.ln();
                let (a, b) = (poisson, law.ln_tail(k));
                let ln_factorial: f64 = (1..=k).map(|i| (i as f64).ln()).sum();
                let q = (a.exp() + b.exp()) / ln_factorial.exp();
                let expected = q * f64::from(n);
                if expected >= 10.0 {
                    chi2 += (f64::from(counts[k]) - expected).powi(2) / expected;
                    cells += 1;
                }
            }
            // Chi-squared with about `cells` degrees of freedom; five standard deviations.
            assert!(
                chi2 < cells as f64 + 5.0 * (2.0 * cells as f64).sqrt(),
                "{depth}: {chi2} over {cells}"
            );
        }
    }

    #[test]
    fn huge_depths_give_no_order_rather_than_a_wrong_one() {
        let law = OrderLaw::new(0.8);
        assert_eq!(law.sample(1e6, 0.5), None);
        assert!(law.sample(1e6, 0.01).is_some());
    }
}
