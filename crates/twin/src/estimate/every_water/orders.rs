//! Laws of the number of scatterings, good for many waters at once.

use std::sync::LazyLock;

/// Scattering coefficients that the mixtures are made for, 1/m, evenly spaced in their logarithm over what natural waters have.
pub(super) const RATES_PER_M: [f64; 6] = [0.03, 0.0835, 0.2325, 0.647, 1.801, 5.013];
/// Share of each of their Poisson laws: more where water is turbid, as orders vary more there.
const SHARES: [f64; RATES_PER_M.len()] = [0.05, 0.07, 0.1, 0.16, 0.23, 0.24];
/// Share of the geometric tail: high orders, of which a Poisson law alone would make too few.
const TAIL_SHARE: f64 = 0.15;
/// Ratio of neighbouring orders in the tail.
const TAIL_RATIO: f64 = 0.9;
/// Largest order; beyond it the tail holds a millionth.
pub(super) const MOST: usize = 128;
/// Largest mean of a Poisson law, far enough below `MOST`.
const MOST_MEAN: f64 = 60.0;

/// ln k! for k up to `MOST`.
static LN_FACTORIAL: LazyLock<[f64; MOST + 1]> = LazyLock::new(|| {
    let mut table = [0.0; MOST + 1];
    for k in 1..=MOST {
        table[k] = table[k - 1] + (k as f64).ln();
    }
    table
});

/// ln `k`! of an order.
pub(super) fn ln_factorial(k: usize) -> f64 {
    LN_FACTORIAL[k]
}

/// Orders of bridges over a straight distance: Poisson laws of the means rate · distance, and a geometric tail.
#[derive(Clone, Debug)]
pub(super) struct Orders {
    /// The smallest order: 0, or 1 where light that does not scatter is known.
    least: usize,
    means: [f64; RATES_PER_M.len()],
    /// Weight of each law times its probability of no scattering, over that of `least` or more.
    scales: [f64; RATES_PER_M.len()],
}

impl Orders {
    /// Orders from `least` (0 or 1) over `distance_m`.
    pub(super) fn new(least: usize, distance_m: f64) -> Self {
        let means = RATES_PER_M.map(|rate| (rate * distance_m).min(MOST_MEAN));
        let scales = std::array::from_fn(|law| {
            let mean = means[law];
            let rest = if least == 0 { 1.0 } else { -(-mean).exp_m1() };
            SHARES[law] * (-mean).exp() / rest
        });
        Self {
            least,
            means,
            scales,
        }
    }

    /// An order from two numbers in (0, 1); `None` beyond `MOST`.
    pub(super) fn draw(&self, kind: f64, within: f64) -> Option<usize> {
        if kind < TAIL_SHARE {
            let k = self.least + (within.ln() / TAIL_RATIO.ln()) as usize;
            return (k <= MOST).then_some(k);
        }
        let mut rest = kind - TAIL_SHARE;
        let chosen = SHARES.iter().position(|share| {
            rest -= share;
            rest < 0.0
        });
        let law = chosen.unwrap_or(SHARES.len() - 1);
        let mean = self.means[law];
        let mut term = self.scales[law] / SHARES[law];
        if self.least == 1 {
            term *= mean;
        }
        let (mut k, mut left) = (self.least, within - term);
        while left > 0.0 && k < MOST {
            k += 1;
            term *= mean / k as f64;
            left -= term;
        }
        Some(k)
    }

    /// Probability of order `k` times k!/`length_m`^k.
    pub(super) fn density(&self, k: usize, length_m: f64) -> f64 {
        let power = |x: f64| x.powi(k as i32);
        let laws = self.means.iter().zip(&self.scales);
        let sum: f64 = laws.map(|(m, scale)| scale * power(m / length_m)).sum();
        let tail =
            ln_factorial(k) + (k - self.least) as f64 * TAIL_RATIO.ln() - k as f64 * length_m.ln();
        sum + TAIL_SHARE * (1.0 - TAIL_RATIO) * tail.exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The probabilities add up to one, and orders are drawn as often as they say.
    #[test]
    fn orders_are_drawn_with_their_probabilities() {
        for (least, distance_m) in [(0, 0.7), (1, 0.7), (1, 4.0)] {
            let orders = Orders::new(least, distance_m);
            let probability = |k: usize| orders.density(k, 1.0) / ln_factorial(k).exp();
            let sum: f64 = (least..=MOST).map(probability).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{least} {distance_m}: {sum}");
            // A grid of 400 x 1000 numbers: each law's inverse is followed to a thousandth.
            let mut counts = [0.0; MOST + 1];
            let middle = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
            for (i, j) in (0..400).flat_map(|i| (0..1000).map(move |j| (i, j))) {
                if let Some(k) = orders.draw(middle(i, 400), middle(j, 1000)) {
                    counts[k] += 1.0 / 400_000.0;
                }
            }
            for k in least..30 {
                assert!((counts[k] - probability(k)).abs() < 2e-3, "{least} {k}");
            }
        }
    }
}
