//! Points that fill the unit cube more evenly than random ones: a Sobol sequence (direction numbers of Joe and Kuo
//! 2008) under nested uniform scrambling (Owen 1995), which keeps its evenness and makes every point uniform.

/// Number of dimensions.
pub const DIMENSIONS: usize = 10;

/// Primitive polynomials and first direction numbers after the first dimension: degree, coefficients, numbers.
const POLYNOMIALS: [(usize, u32, [u32; 5]); DIMENSIONS - 1] = [
    (1, 0, [1, 0, 0, 0, 0]),
    (2, 1, [1, 3, 0, 0, 0]),
    (3, 1, [1, 3, 1, 0, 0]),
    (3, 2, [1, 1, 1, 0, 0]),
    (4, 1, [1, 1, 3, 3, 0]),
    (4, 4, [1, 3, 5, 13, 0]),
    (5, 2, [1, 1, 5, 5, 17]),
    (5, 4, [1, 1, 5, 5, 5]),
    (5, 7, [1, 1, 7, 11, 19]),
];

/// Direction numbers, by bits of the index from the lowest.
pub(crate) const DIRECTIONS: [[u32; 32]; DIMENSIONS] = directions();

const fn directions() -> [[u32; 32]; DIMENSIONS] {
    let mut v = [[0u32; 32]; DIMENSIONS];
    let mut bit = 0;
    while bit < 32 {
        v[0][bit] = 1 << (31 - bit);
        bit += 1;
    }
    let mut d = 1;
    while d < DIMENSIONS {
        let (degree, coefficients, first) = POLYNOMIALS[d - 1];
        let mut i = 0;
        while i < 32 {
            if i < degree {
                v[d][i] = first[i] << (31 - i);
            } else {
                let mut next = v[d][i - degree] ^ (v[d][i - degree] >> degree);
                let mut j = 1;
                while j < degree {
                    if (coefficients >> (degree - 1 - j)) & 1 == 1 {
                        next ^= v[d][i - j];
                    }
                    j += 1;
                }
                v[d][i] = next;
            }
            i += 1;
        }
        d += 1;
    }
    v
}

/// The same with their bits in the opposite order, from which scrambling starts.
const REVERSED: [[u32; 32]; DIMENSIONS] = reversed();

const fn reversed() -> [[u32; 32]; DIMENSIONS] {
    let mut v = DIRECTIONS;
    let mut i = 0;
    while i < 32 * DIMENSIONS {
        v[i / 32][i % 32] = v[i / 32][i % 32].reverse_bits();
        i += 1;
    }
    v
}

/// Coordinate `dimension` of point `index`, scrambled by `seed`, in (0, 1).
#[inline]
pub fn scrambled(index: u32, dimension: usize, seed: u32) -> f64 {
    let mut bits = 0;
    let mut rest = index;
    while rest != 0 {
        bits ^= REVERSED[dimension][rest.trailing_zeros() as usize];
        rest &= rest - 1;
    }
    let own = seed.wrapping_add((dimension as u32).wrapping_mul(0x9e37_79b9));
    (f64::from(owen(bits, mix(own))) + 0.5) * (1.0 / 4_294_967_296.0)
}

/// A hash of 32 bits (Wellons 2018, "lowbias32"): what the dimensions' scramblings share must not be seen in them.
#[inline]
fn mix(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Nested uniform scrambling: every bit is flipped or not by a hash of the bits above it (Laine and Karras 2011, with
/// the constants of Vegdahl 2021). The bits come in the opposite order.
#[inline]
fn owen(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed;
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether each cell of a partition holds exactly one of the points.
    fn one_each(cells: impl Iterator<Item = usize>, count: usize) -> bool {
        let mut seen = vec![0; count];
        cells.for_each(|c| seen[c] += 1);
        seen.iter().all(|&n| n == 1)
    }

    #[test]
    fn every_dimension_has_one_point_in_each_interval() {
        for seed in [0, 1, 0xdead_beef, 77] {
            for d in 0..DIMENSIONS {
                for n in [2u32, 16, 256] {
                    let cell = |i| (scrambled(i, d, seed) * f64::from(n)) as usize;
                    assert!(one_each((0..n).map(cell), n as usize), "{d} {n}");
                }
            }
        }
    }

    #[test]
    fn the_first_two_dimensions_are_a_net() {
        for seed in 0..20 {
            for ln_columns in 0..=6 {
                let (columns, rows) = (1u32 << ln_columns, 64u32 >> ln_columns);
                let cell = |i: u32| {
                    let x = (scrambled(i, 0, seed) * f64::from(columns)) as usize;
                    let y = (scrambled(i, 1, seed) * f64::from(rows)) as usize;
                    y * columns as usize + x
                };
                assert!(one_each((0..64).map(cell), 64), "{seed} {columns}");
            }
        }
    }

    /// Chi-squared of pairs of coordinates of single points over 8 × 8 cells: scramblings must be independent between
    /// dimensions.
    #[test]
    fn single_points_are_independent_between_dimensions() {
        let n = 64_000u32;
        for index in [0, 1, 6] {
            for (a, b) in (0..DIMENSIONS).flat_map(|a| (0..a).map(move |b| (a, b))) {
                let mut counts = [0u32; 64];
                for seed in 0..n {
                    let seed = mix(seed ^ 0x1234_5678);
                    let cell = |d| (scrambled(index, d, seed) * 8.0) as usize;
                    counts[8 * cell(a) + cell(b)] += 1;
                }
                let expected = f64::from(n) / 64.0;
                let chi2: f64 = counts
                    .iter()
                    .map(|&c| (f64::from(c) - expected).powi(2) / expected)
                    .sum();
                // 63 degrees of freedom: mean 63, standard deviation 11.2; 45 pairs and points.
                assert!((25.0..125.0).contains(&chi2), "{index} {a} {b}: {chi2}");
            }
        }
    }

    #[test]
    fn single_points_are_uniform_over_seeds() {
        for d in 0..DIMENSIONS {
            let n = 40_000u32;
            let at = |seed: u32| scrambled(5, d, seed.wrapping_mul(0x9e37_79b9) ^ 0x55);
            let mean = (0..n).map(at).sum::<f64>() / f64::from(n);
            assert!(
                (mean - 0.5).abs() < 4.0 * 0.2887 / f64::from(n).sqrt(),
                "{d}: {mean}"
            );
        }
    }
}
