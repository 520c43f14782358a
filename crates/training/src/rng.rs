//! Random numbers that stay the same whatever the versions of the dependencies.

/// SplitMix64 (Steele, Lea, Flood 2014): 64 bits of state, period 2⁶⁴.
pub(crate) struct Rng {
    state: u64,
}

/// What a stream of random numbers is used for; each use has its own stream of the same seed.
#[derive(Clone, Copy)]
pub(crate) enum Use {
    Split = 1,
    Weights = 2,
    RowOrder = 3,
}

impl Rng {
    /// The stream of `seed` for one use.
    pub(crate) fn new(seed: u64, purpose: Use) -> Self {
        let mut seeder = Self { state: seed };
        let base = seeder.next_u64();
        let mut mixer = Self {
            state: base ^ (purpose as u64),
        };
        Self {
            state: mixer.next_u64(),
        }
    }

    fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [-limit, limit).
    pub(crate) fn symmetric(&mut self, limit: f64) -> f32 {
        let unit = (self.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        ((2.0 * unit - 1.0) * limit) as f32
    }

    /// Uniform in 0..n for n > 0; the bias of the multiplication is below n / 2⁶⁴.
    fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next_u64()) * n as u128) >> 64) as usize
    }

    /// Puts the items into a uniformly random order (Fisher-Yates).
    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.below(last + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference values of SplitMix64 with seed 1234567 (Vigna's splitmix64.c).
    #[test]
    fn gives_the_published_sequence() {
        let mut rng = Rng { state: 1_234_567 };
        let got: Vec<u64> = (0..3).map(|_| rng.next_u64()).collect();
        assert_eq!(
            got,
            [
                6_457_827_717_110_365_317,
                3_203_168_211_198_807_973,
                9_817_491_932_198_370_423
            ]
        );
    }

    /// Each of the 6 orders of three items comes up 1/6 of the time: 1000 of 6000 with a standard
    /// deviation of 29, so 150 is more than 5 of them.
    #[test]
    fn shuffles_evenly() {
        let mut rng = Rng::new(3, Use::RowOrder);
        let mut counts = std::collections::BTreeMap::new();
        for _ in 0..6000 {
            let mut items = [0, 1, 2];
            rng.shuffle(&mut items);
            *counts.entry(items).or_insert(0i32) += 1;
        }
        assert_eq!(counts.len(), 6);
        for (order, count) in counts {
            assert!((count - 1000).abs() < 150, "{order:?} came {count} times");
        }
    }

    #[test]
    fn uses_of_one_seed_are_different_streams() {
        let first = |purpose| Rng::new(5, purpose).next_u64();
        assert_ne!(first(Use::Split), first(Use::Weights));
        assert_ne!(first(Use::Weights), first(Use::RowOrder));
    }
}
