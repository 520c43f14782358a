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
        Self { ratio, ln_tail }
    }

    /// Ratio of the geometric part.
    pub(crate) fn ratio(&self) -> f64 {
        self.ratio
    }

    /// ln of ε (1 − γ) γ^k k!. q(k | D)·k! is this tail and the Poisson part (1 − ε) e^(−σD) (σD)^k.
    #[inline]
    pub fn ln_tail(&self, k: usize) -> f64 {
        self.ln_tail[k]
    }
}
