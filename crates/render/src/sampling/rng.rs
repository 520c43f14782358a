//! Random numbers keyed by (seed, pixel, sample, stream).

/// xoshiro128++ (Blackman and Vigna 2019), started from a hash of its key, in 32-bit arithmetic throughout
/// so that a GPU can follow it bit by bit.
#[derive(Clone, Debug)]
pub struct Rng {
    state: [u32; 4],
}

impl Rng {
    /// The stream of `(seed, pixel, sample, stream)`.
    pub fn new(seed: u64, pixel: u32, sample: u32, stream: u32) -> Self {
        let mut state = hash4([
            seed as u32 ^ stream.wrapping_mul(0x9e37_79b9),
            (seed >> 32) as u32,
            pixel,
            sample,
        ]);
        if state == [0; 4] {
            state[0] = 1;
        }
        Self { state }
    }

    /// 32 random bits.
    #[inline]
    pub fn bits(&mut self) -> u32 {
        let s = &mut self.state;
        let result = s[0].wrapping_add(s[3]).rotate_left(7).wrapping_add(s[0]);
        let t = s[1] << 9;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(11);
        result
    }

    /// A number in (0, 1), never 0 or 1.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        (f64::from(self.bits()) + 0.5) * (1.0 / 4_294_967_296.0)
    }
}

/// Two rounds of the pcg4d hash (Jarzynski and Olano 2020).
fn hash4(key: [u32; 4]) -> [u32; 4] {
    let mut v = key;
    for _ in 0..2 {
        v = v.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
        mix(&mut v);
        v = v.map(|x| x ^ (x >> 16));
        mix(&mut v);
    }
    v
}

fn mix(v: &mut [u32; 4]) {
    v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[3]));
    v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
    v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
    v[3] = v[3].wrapping_add(v[1].wrapping_mul(v[2]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_within_and_across_streams() {
        const CELLS: usize = 64;
        const N: u32 = 64_000;
        let chi2 = |draw: &mut dyn FnMut(u32) -> f64| {
            let mut counts = [0u32; CELLS];
            (0..N).for_each(|i| counts[(draw(i) * CELLS as f64) as usize] += 1);
            let expected = f64::from(N) / CELLS as f64;
            counts
                .iter()
                .map(|&c| (f64::from(c) - expected).powi(2) / expected)
                .sum::<f64>()
        };
        // 63 degrees of freedom: mean 63, standard deviation 11.2.
        let mut one = Rng::new(7, 1, 2, 3);
        assert!((30.0..110.0).contains(&chi2(&mut |_| one.uniform())));
        for vary in 0..4 {
            let key = |i: u32| match vary {
                0 => Rng::new(u64::from(i), 5, 5, 5),
                1 => Rng::new(5, i, 5, 5),
                2 => Rng::new(5, 5, i, 5),
                _ => Rng::new(5, 5, 5, i),
            };
            let value = chi2(&mut |i| key(i).uniform());
            assert!(
                (30.0..110.0).contains(&value),
                "first draws over key {vary}: {value}"
            );
        }
    }

    #[test]
    fn neighbouring_streams_are_uncorrelated() {
        let n = 20_000;
        let product: f64 = (0..n)
            .map(|i| {
                (Rng::new(1, i, 0, 0).uniform() - 0.5) * (Rng::new(1, i + 1, 0, 0).uniform() - 0.5)
            })
            .sum();
        // Each term has a standard deviation of 1/12.
        assert!((product / (f64::from(n).sqrt() / 12.0)).abs() < 4.0);
    }
}
