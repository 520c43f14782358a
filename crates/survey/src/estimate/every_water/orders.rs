//! How often paths scatter: orders drawn for a mixture of waters.

/// Waters that the mixture is made of.
pub(super) const WATERS: usize = 8;
/// Least and greatest scattering coefficient of them, 1/m: below and above all Jerlov types but the most turbid bands.
const SCATTERING: (f64, f64) = (0.03, 5.0);
/// Share of each water's orders that come from a geometric distribution: light that wanders on ways much longer than the
/// straight one scatters far more often than that one's length lets expect.
const TAIL_SHARE: f64 = 0.15;
/// Mean of the geometric distribution where the Poisson distribution's is 0.
const LEAST_TAIL: f64 = 4.0;
/// Most scatterings of one part of a path; a light that scatters more often is of no account.
pub(super) const MOST: usize = 400;
/// Greatest mean of the Poisson distributions.
const GREATEST_MEAN: f64 = 300.0;

/// Scattering coefficients, 1/m, of the waters of the mixture, evenly spaced in the logarithm; all are as probable.
pub(super) fn waters() -> [f64; WATERS] {
    let ratio = SCATTERING.1 / SCATTERING.0;
    std::array::from_fn(|i| SCATTERING.0 * ratio.powf(i as f64 / (WATERS - 1) as f64))
}

/// The water of the mixture that a number in (0, 1) stands for.
pub(super) fn choose_water(u: f64) -> usize {
    ((u * WATERS as f64) as usize).min(WATERS - 1)
}

/// Distributions of the number of scatterings on a way.
pub(super) struct Orders {
    scattering: [f64; WATERS],
    /// ln k! for k = 0 to [`MOST`].
    log_factorials: Vec<f64>,
}

impl Orders {
    pub(super) fn new() -> Self {
        let mut log_factorials = vec![0.0; MOST + 1];
        for k in 1..=MOST {
            log_factorials[k] = log_factorials[k - 1] + (k as f64).ln();
        }
        Self {
            scattering: waters(),
            log_factorials,
        }
    }

    /// ln `order`!, for an order of at most [`MOST`].
    pub(super) fn log_factorial(&self, order: usize) -> f64 {
        self.log_factorials[order]
    }

    fn mean(&self, water: usize, length_m: f64) -> f64 {
        (self.scattering[water] * length_m).min(GREATEST_MEAN)
    }

    /// The order that a number in (0, 1) stands for on a way of `length_m`; `None` where it is above [`MOST`].
    pub(super) fn draw(&self, water: usize, length_m: f64, u: f64) -> Option<usize> {
        let mean = self.mean(water, length_m);
        let order = if u < TAIL_SHARE {
            ((u / TAIL_SHARE).ln() / ratio(mean).ln()) as usize
        } else {
            poisson(mean, (u - TAIL_SHARE) / (1.0 - TAIL_SHARE))
        };
        (order <= MOST).then_some(order)
    }

    /// Probability of `order`, at most [`MOST`], in `water` on a way of `length_m`.
    pub(super) fn probability(&self, water: usize, length_m: f64, order: usize) -> f64 {
        let mean = self.mean(water, length_m);
        let k = order as f64;
        let poisson = (k * mean.ln() - mean - self.log_factorials[order]).exp();
        let ratio = ratio(mean);
        (1.0 - TAIL_SHARE) * poisson + TAIL_SHARE * (1.0 - ratio) * ratio.powi(order as i32)
    }
}

/// Ratio of the geometric distribution beside a Poisson distribution of `mean`.
fn ratio(mean: f64) -> f64 {
    let tail = LEAST_TAIL + 2.0 * mean;
    tail / (1.0 + tail)
}

/// The value of a Poisson distribution at the quantile `u`.
fn poisson(mean: f64, u: f64) -> usize {
    let mut term = (-mean).exp();
    let mut below = term;
    let mut order = 0;
    while u > below && order <= MOST {
        order += 1;
        term *= mean / order as f64;
        below += term;
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_drawn_as_often_as_their_probability_says() {
        let orders = Orders::new();
        for (water, length_m) in [(0, 1.0), (4, 2.0), (7, 3.0)] {
            let n = 200_000;
            let mut drawn = [0.0; 40];
            for i in 0..n {
                let order = orders.draw(water, length_m, (f64::from(i) + 0.5) / f64::from(n));
                if let Some(count) = order.and_then(|k| drawn.get_mut(k)) {
                    *count += 1.0 / f64::from(n);
                }
            }
            for (k, share) in drawn.iter().enumerate() {
                let expected = orders.probability(water, length_m, k);
                // Evenly spaced numbers: each order is met but for the two ends of two intervals.
                assert!(
                    (share - expected).abs() < 4.5 / f64::from(n),
                    "{water} {k}: {share} {expected}"
                );
            }
        }
    }
}
