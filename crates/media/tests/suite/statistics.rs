//! Random numbers, quadrature and the chi-squared test.

/// xoshiro256** (Blackman & Vigna 2018), seeded by splitmix64.
pub(crate) struct Rng([u64; 4]);

impl Rng {
    pub(crate) fn new(seed: u64) -> Self {
        let mut state = seed;
        Self(std::array::from_fn(|_| {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        }))
    }

    /// Uniform in (0, 1), neither end included.
    pub(crate) fn uniform(&mut self) -> f64 {
        let s = &mut self.0;
        let out = s[1].wrapping_mul(5).rotate_left(7).wrapping_mul(9);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        ((out >> 12) as f64 + 0.5) / (1u64 << 52) as f64
    }
}

/// Composite five-point Gauss-Legendre rule.
pub(crate) fn integrate(from: f64, to: f64, panels: u32, f: impl Fn(f64) -> f64) -> f64 {
    const RULE: [(f64, f64); 3] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let half = 0.5 * (to - from) / f64::from(panels);
    let mut sum = 0.0;
    for panel in 0..panels {
        let middle = from + half * f64::from(2 * panel + 1);
        sum += RULE[0].1 * f(middle);
        for (node, weight) in &RULE[1..] {
            sum += weight * (f(middle - half * node) + f(middle + half * node));
        }
    }
    half * sum
}

/// Edges in `x` for histograms: fine in the logarithm at both ends of [0, 1].
pub(crate) fn histogram_edges() -> Vec<f64> {
    let mut edges = vec![0.0];
    edges.extend((0..=90).map(|i| 0.5 * 10f64.powf(f64::from(i - 90) / 5.0)));
    edges.extend((1..=40).map(|i| 1.0 - 0.5 * 10f64.powf(-f64::from(i) / 8.0)));
    edges.push(1.0);
    edges
}

/// A chi-squared test of counts against expected counts.
pub(crate) struct ChiSquared {
    pub(crate) statistic: f64,
    pub(crate) degrees: usize,
}

impl ChiSquared {
    /// Neighbouring cells are pooled until at least five events are expected in each.
    pub(crate) fn new(counts: &[f64], expected: &[f64]) -> Self {
        let mut pooled: Vec<(f64, f64)> = vec![(0.0, 0.0)];
        for (count, expectation) in counts.iter().zip(expected) {
            let last = pooled.len() - 1;
            pooled[last].0 += count;
            pooled[last].1 += expectation;
            if pooled[last].1 >= 5.0 {
                pooled.push((0.0, 0.0));
            }
        }
        if let Some(rest) = pooled.pop()
            && let Some(last) = pooled.last_mut()
        {
            last.0 += rest.0;
            last.1 += rest.1;
        }
        let statistic = pooled.iter().map(|(c, e)| (c - e) * (c - e) / e).sum();
        Self {
            statistic,
            degrees: pooled.len() - 1,
        }
    }

    /// How many standard deviations above its mean the statistic lies (Wilson & Hilferty 1931).
    pub(crate) fn z(&self) -> f64 {
        let k = self.degrees as f64;
        let spread = 2.0 / (9.0 * k);
        ((self.statistic / k).cbrt() - (1.0 - spread)) / spread.sqrt()
    }
}

/// The z above which one of `tests` true hypotheses is refused with probability 1 % (Šidák).
pub(crate) fn sidak_limit(tests: usize) -> f64 {
    let each = -(0.99_f64.ln() / tests as f64).exp_m1();
    // Upper tail of the normal distribution by Mills' continued fraction, solved by bisection.
    let tail = |z: f64| {
        let fraction = (1..60).rev().fold(z, |below, k| z + f64::from(k) / below);
        (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt() / fraction
    };
    let (mut low, mut high) = (1.0, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if tail(middle) > each {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[test]
fn the_limit_is_the_normal_quantile() {
    // 1 - 0.99^(1/1) = 0.01 and the 99 % quantile of the normal distribution is 2.3263.
    assert!((sidak_limit(1) - 2.3263).abs() < 1e-3);
    assert!((sidak_limit(100) - 3.7181).abs() < 1e-2);
}

#[test]
fn chi_squared_pools_and_finds_a_wrong_cell() {
    let expected = [2.0, 2.0, 2.0, 100.0, 100.0, 1.0];
    let right = ChiSquared::new(&[3.0, 2.0, 2.0, 96.0, 103.0, 1.0], &expected);
    assert_eq!(right.degrees, 2);
    assert!(right.z() < 2.0);
    let wrong = ChiSquared::new(&[3.0, 2.0, 2.0, 60.0, 140.0, 1.0], &expected);
    assert!(wrong.z() > 4.0);
}
