//! Deterministic lattice noise that repeats with the unit square.
//!
//! Only integer hashing and the five operations that IEEE 754 rounds exactly (+ − × ÷ √) are used,
//! so the same seed gives the same bits on every machine.

/// A square lattice over the unit square whose values repeat with period 1 in both directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoiseLattice {
    /// Number of lattice cells along (u, v), each >= 1.
    pub cells: [u32; 2],
    /// Seed; lattices of different seeds are unrelated.
    pub seed: u32,
}

/// The nearest feature points of cellular (Worley) noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cellular {
    /// Distance to the nearest feature point, lattice cells.
    pub nearest: f32,
    /// Distance to the second nearest feature point, lattice cells; never below `nearest`.
    pub second: f32,
    /// Random bits of the nearest feature point.
    pub bits: u32,
}

/// How far feature points of cellular noise stray from the cell centre, in cells. Below 0.5 so
/// that the nearest two are nearly always found among the 3 × 3 cells around a point.
const CELL_JITTER: f32 = 0.42;

/// Scales 2-D gradient noise with unit gradients, whose extremes are ±√½, to [-1, 1].
const GRADIENT_SCALE: f32 = std::f32::consts::SQRT_2;

/// 32 well mixed bits of three integers.
pub fn hash(x: u32, y: u32, seed: u32) -> u32 {
    let row = mix_bits(seed ^ y.wrapping_mul(0x9e37_79b1));
    mix_bits(row.wrapping_add(x.wrapping_mul(0x85eb_ca77)))
}

/// A bijective finaliser with low bias (constants: C. Wellons, "Hash function prospector", 2018, public domain).
fn mix_bits(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// The `index`-th number in [0, 1) that belongs to some random bits.
pub fn unit(bits: u32, index: u32) -> f32 {
    // 24 bits fill the mantissa exactly, so the result stays below 1.
    (mix_bits(bits ^ index.wrapping_mul(0x9e37_79b1)) >> 8) as f32 / 16_777_216.0
}

/// A random unit vector that belongs to some random bits.
pub fn direction(bits: u32) -> [f32; 2] {
    let x = unit(bits, 0x51) * 2.0 - 1.0;
    let y = unit(bits, 0x52) * 2.0 - 1.0;
    let length = (x * x + y * y).sqrt();
    if length < 1e-3 {
        [1.0, 0.0]
    } else {
        [x / length, y / length]
    }
}

impl NoiseLattice {
    /// A lattice of square cells.
    pub fn square(cells: u32, seed: u32) -> Self {
        Self {
            cells: [cells.max(1); 2],
            seed,
        }
    }

    /// The lattice of the next octave: twice as fine and unrelated.
    pub fn finer(self) -> Self {
        Self {
            cells: self.cells.map(|n| n.saturating_mul(2)),
            seed: mix_bits(self.seed ^ 0x68e3_1da4),
        }
    }

    /// Random bits of a lattice point; the coordinates wrap around.
    pub fn bits(self, column: i32, row: i32) -> u32 {
        hash(
            wrap(column, self.cells[0]),
            wrap(row, self.cells[1]),
            self.seed,
        )
    }

    /// Position in cells: the cell's column and row, and the place inside it in [0, 1).
    pub fn locate(self, [u, v]: [f32; 2]) -> ([i32; 2], [f32; 2]) {
        let x = u * self.cells[0] as f32;
        let y = v * self.cells[1] as f32;
        let (column, row) = (x.floor(), y.floor());
        ([column as i32, row as i32], [x - column, y - row])
    }

    /// Gradient noise in [-1, 1] with zero mean and continuous second derivatives.
    pub fn gradient(self, at: [f32; 2]) -> f32 {
        let ([column, row], [x, y]) = self.locate(at);
        let corner = |i: i32, j: i32| {
            let [gx, gy] = DIRECTIONS[(self.bits(column + i, row + j) >> 28) as usize];
            gx * (x - i as f32) + gy * (y - j as f32)
        };
        let (sx, sy) = (fade(x), fade(y));
        let top = lerp(corner(0, 0), corner(1, 0), sx);
        let bottom = lerp(corner(0, 1), corner(1, 1), sx);
        lerp(top, bottom, sy) * GRADIENT_SCALE
    }

    /// Distances to the nearest two of one jittered feature point per cell.
    pub fn cellular(self, at: [f32; 2]) -> Cellular {
        let ([column, row], [x, y]) = self.locate(at);
        let mut found = Cellular {
            nearest: f32::MAX,
            second: f32::MAX,
            bits: 0,
        };
        for j in -1..=1 {
            for i in -1..=1 {
                let bits = self.bits(column + i, row + j);
                let dx = i as f32 + 0.5 + CELL_JITTER * (2.0 * unit(bits, 1) - 1.0) - x;
                let dy = j as f32 + 0.5 + CELL_JITTER * (2.0 * unit(bits, 2) - 1.0) - y;
                let squared = dx * dx + dy * dy;
                if squared < found.nearest {
                    found = Cellular {
                        nearest: squared,
                        second: found.nearest,
                        bits,
                    };
                } else if squared < found.second {
                    found.second = squared;
                }
            }
        }
        Cellular {
            nearest: found.nearest.sqrt(),
            second: found.second.sqrt(),
            ..found
        }
    }

    /// Fractal Brownian motion: `octaves` layers of gradient noise, each twice as fine and half as
    /// strong, scaled to stay in [-1, 1].
    pub fn fbm(self, at: [f32; 2], octaves: u32) -> f32 {
        self.octave_sum(at, octaves, |n| n)
    }

    /// Ridged fractal noise in [0, 1], 1 on thin crooked lines.
    pub fn ridged(self, at: [f32; 2], octaves: u32) -> f32 {
        self.octave_sum(at, octaves, |n| {
            let ridge = 1.0 - n.abs();
            ridge * ridge
        })
    }

    fn octave_sum(self, at: [f32; 2], octaves: u32, shape: impl Fn(f32) -> f32) -> f32 {
        let (mut sum, mut weights, mut weight, mut lattice) = (0.0, 0.0, 1.0, self);
        for _ in 0..octaves.max(1) {
            sum += weight * shape(lattice.gradient(at));
            weights += weight;
            weight *= 0.5;
            lattice = lattice.finer();
        }
        sum / weights
    }
}

/// Sixteen unit vectors, 22.5° apart.
const DIRECTIONS: [[f32; 2]; 16] = {
    const C: f32 = 0.923_879_5; // cos 22.5°
    const S: f32 = 0.382_683_43; // sin 22.5°
    const D: f32 = std::f32::consts::FRAC_1_SQRT_2;
    [
        [1.0, 0.0],
        [C, S],
        [D, D],
        [S, C],
        [0.0, 1.0],
        [-S, C],
        [-D, D],
        [-C, S],
        [-1.0, 0.0],
        [-C, -S],
        [-D, -D],
        [-S, -C],
        [0.0, -1.0],
        [S, -C],
        [D, -D],
        [C, -S],
    ]
};

fn wrap(index: i32, cells: u32) -> u32 {
    // Nearly all places lie inside the unit square, where no division is needed.
    if index >= 0 && (index as u32) < cells {
        return index as u32;
    }
    // The remainder is in [0, cells), which fits.
    i64::from(index).rem_euclid(i64::from(cells.max(1))) as u32
}

/// Quintic step from 0 to 1 with zero first and second derivatives at both ends (Perlin 2002).
fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

fn lerp(from: f32, to: f32, t: f32) -> f32 {
    from + (to - from) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    const LATTICE: NoiseLattice = NoiseLattice {
        cells: [7, 5],
        seed: 11,
    };

    fn points() -> impl Iterator<Item = [f32; 2]> {
        (0..4000).map(|i| [unit(i, 1), unit(i, 2)])
    }

    #[test]
    fn noise_repeats_with_the_unit_square() {
        for [u, v] in points() {
            // Dyadic coordinates, so that adding 1 loses no bits.
            let at = [(u * 1024.0).floor() / 1024.0, (v * 1024.0).floor() / 1024.0];
            let moved = [at[0] + 1.0, at[1] - 1.0];
            assert!((LATTICE.fbm(at, 4) - LATTICE.fbm(moved, 4)).abs() < 1e-5);
            let (one, other) = (LATTICE.cellular(at), LATTICE.cellular(moved));
            assert_eq!(one.bits, other.bits);
            assert!((one.second - other.second).abs() < 1e-4);
        }
    }

    #[test]
    fn noise_fills_its_range_and_has_no_bias() {
        let values: Vec<f32> = points()
            .map(|at| NoiseLattice::square(64, 3).gradient(at))
            .collect();
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        let variance = values.iter().map(|v| v * v).sum::<f32>() / values.len() as f32;
        assert!(values.iter().all(|v| v.abs() <= 1.0));
        // Standard error of the mean is 0.3 / √4000 = 0.005.
        assert!(mean.abs() < 0.025, "mean {mean}");
        assert!((0.05..0.2).contains(&variance), "variance {variance}");
        assert!(points().all(|at| (0.0..=1.0).contains(&LATTICE.ridged(at, 5))));
    }

    #[test]
    fn cellular_noise_finds_what_a_search_of_all_cells_finds() {
        let lattice = NoiseLattice::square(6, 5);
        for at in points().take(500) {
            let mut distances = Vec::new();
            for row in -6..12 {
                for column in -6..12 {
                    let bits = lattice.bits(column, row);
                    let x = column as f32 + 0.5 + CELL_JITTER * (2.0 * unit(bits, 1) - 1.0);
                    let y = row as f32 + 0.5 + CELL_JITTER * (2.0 * unit(bits, 2) - 1.0);
                    distances.push(((x - at[0] * 6.0).powi(2) + (y - at[1] * 6.0).powi(2)).sqrt());
                }
            }
            distances.sort_by(f32::total_cmp);
            assert!((lattice.cellular(at).nearest - distances[0]).abs() < 1e-4);
        }
    }

    #[test]
    fn hashed_numbers_are_uniform() {
        let mut bins = [0_u32; 16];
        (0..16_000).for_each(|i| bins[(unit(hash(i, 3, 9), 4) * 16.0) as usize] += 1);
        // 1000 expected in each; 5 standard deviations are 153.
        assert!(bins.iter().all(|&n| n.abs_diff(1000) < 153), "{bins:?}");
    }
}
