//! What paths that are given once carry in any water.

use super::super::fields::GROUPS;

/// A homogeneous water.
#[derive(Clone, Copy, Debug)]
pub(super) struct WaterAt {
    attenuation: f64,
    scattering: f64,
    log_scattering: f64,
}

/// Scattering below which derivatives would be divided by nothing, 1/m.
const LEAST_SCATTERING: f64 = 1e-12;

impl WaterAt {
    /// Of absorption `a` and scattering `b`, 1/m.
    pub(super) fn new(a: f64, b: f64) -> Self {
        let b = b.max(LEAST_SCATTERING);
        Self {
            attenuation: a + b,
            scattering: b,
            log_scattering: b.ln(),
        }
    }
}

/// Paths: how often each scatters, its length and the logarithm of its weight.
#[derive(Clone, Debug, Default)]
pub(super) struct Paths {
    scatterings: Vec<f32>,
    lengths_m: Vec<f32>,
    log_weights: Vec<f32>,
}

/// A sum over paths and its derivatives.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    pub(super) value: f64,
    pub(super) by_a: f64,
    pub(super) by_b: f64,
}

impl AsRef<Self> for Paths {
    fn as_ref(&self) -> &Self {
        self
    }
}

impl Sum {
    fn add(&mut self, other: Self, factor: f64) {
        self.value += factor * other.value;
        self.by_a += factor * other.by_a;
        self.by_b += factor * other.by_b;
    }
}

impl Paths {
    /// Adds a path that carries `weight` b^scatterings e^(-(a+b) length); nothing where that is nothing.
    pub(super) fn push(&mut self, scatterings: usize, length_m: f64, log_weight: f64) {
        self.scatterings.push(scatterings as f32);
        self.lengths_m.push(length_m as f32);
        self.log_weights.push(log_weight as f32);
    }

    /// What each path carries in `water`, with how often it scatters and how long it is.
    pub(super) fn carried(&self, water: WaterAt) -> impl Iterator<Item = (f64, f64, f64)> {
        let (scatterings, lengths_m) = (&self.scatterings, &self.lengths_m);
        let paths = scatterings.iter().zip(lengths_m).zip(&self.log_weights);
        paths.map(move |((&k, &s), &log_weight)| {
            let (k, s) = (f64::from(k), f64::from(s));
            let exponent = f64::from(log_weight) + k * water.log_scattering - water.attenuation * s;
            (exponent.exp(), k, s)
        })
    }

    /// What all carry in `water`.
    pub(super) fn sum(&self, water: WaterAt) -> Sum {
        let mut sum = Sum::default();
        let (mut by_order, mut by_length) = (0.0, 0.0);
        for (carried, k, s) in self.carried(water) {
            sum.value += carried;
            by_order += k * carried;
            by_length += s * carried;
        }
        sum.by_a = -by_length;
        sum.by_b = by_order / water.scattering - by_length;
        sum
    }
}

/// A quantity in one water, with its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// The quantity.
    pub value: f64,
    /// Its derivative with respect to absorption, per 1/m.
    pub by_a: f64,
    /// Its derivative with respect to scattering, per 1/m.
    pub by_b: f64,
    /// Standard error of the quantity, from groups of independent paths.
    pub error: f64,
}

/// Paths of a quantity: groups of as many each, and paths that are known exactly.
#[derive(Clone, Debug)]
pub(super) struct Grouped<P> {
    /// The paths of each group that carry something.
    pub(super) groups: Vec<P>,
    /// Paths drawn in a group, those that carry nothing among them.
    pub(super) drawn: u32,
    /// Paths that the quantity has besides.
    pub(super) exact: Paths,
}

/// The quantity that several sets of paths make together, each with a factor.
pub(super) fn value<'a, P: AsRef<Paths> + 'a>(
    sets: impl Iterator<Item = (&'a Grouped<P>, f64)>,
    water: WaterAt,
) -> Value {
    let mut exact = Sum::default();
    let mut groups = [Sum::default(); GROUPS];
    for (set, factor) in sets {
        exact.add(set.exact.sum(water), factor);
        for (group, paths) in groups.iter_mut().zip(&set.groups) {
            group.add(
                paths.as_ref().sum(water),
                factor / f64::from(set.drawn.max(1)),
            );
        }
    }
    let n = GROUPS as f64;
    let mut all = Sum::default();
    groups.iter().for_each(|group| all.add(*group, 1.0 / n));
    let spread: f64 = groups.iter().map(|g| (g.value - all.value).powi(2)).sum();
    all.add(exact, 1.0);
    Value {
        value: all.value,
        by_a: all.by_a,
        by_b: all.by_b,
        error: (spread / (n * (n - 1.0))).sqrt(),
    }
}
