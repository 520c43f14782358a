//! A texture blurred in steps of two, to be mixed into any smooth blur.

use uw_render::scene::Texture;

/// Fewest texels of a level's edge.
const SMALLEST: usize = 8;

/// A square, repeating texture and its blurred versions.
///
/// Level 0 is the texture as the renderer sees it (bilinear). Each further level is the one before, blurred by
/// the binomial kernel (1 5 10 10 5 1)/32 and taken at every second texel; seen bilinearly, level j differs from
/// level 0 by a blur of variance 7/12 (4^j - 1) t², t being the size of a texel (5/4 texel² for each kernel, 1/6
/// for the interpolation). The last level is the mean.
#[derive(Clone, Debug)]
pub struct TexturePyramid {
    levels: Vec<Level>,
    mean: [f32; 3],
    texel_m: f64,
}

#[derive(Clone, Debug)]
struct Level {
    size: usize,
    texels: Vec<[f32; 3]>,
}

impl TexturePyramid {
    /// The pyramid of a square `texture` whose tile measures `tile_m`.
    pub fn new(texture: &Texture, tile_m: f64) -> Self {
        let size = texture.width.min(texture.height) as usize;
        let mut levels = vec![Level {
            size,
            texels: texture.texels.iter().collect(),
        }];
        while let Some(next) = levels.last().and_then(Level::next) {
            levels.push(next);
        }
        let n = texture.texels.len().max(1) as f64;
        let mean = std::array::from_fn(|k| {
            (texture.texels.iter().map(|t| f64::from(t[k])).sum::<f64>() / n) as f32
        });
        Self {
            levels,
            mean,
            texel_m: tile_m / size as f64,
        }
    }

    /// Number of levels, with the mean.
    pub fn levels(&self) -> usize {
        self.levels.len() + 1
    }

    /// Size of a texel of level 0, m.
    pub fn texel_m(&self) -> f64 {
        self.texel_m
    }

    /// Standard deviation of the blur of `level` against level 0 along each axis, m; infinite for the mean.
    pub fn blur_m(&self, level: usize) -> f64 {
        if level >= self.levels.len() {
            return f64::INFINITY;
        }
        self.texel_m * (7.0 / 12.0 * (4f64.powi(level as i32) - 1.0)).sqrt()
    }

    /// Reflectance of `level` at (u, v) in tiles; everything repeats.
    #[inline]
    pub fn sample(&self, level: usize, u: f64, v: f64) -> [f32; 3] {
        match self.levels.get(level) {
            Some(l) => l.bilinear((u - u.floor()) as f32, (v - v.floor()) as f32),
            None => self.mean,
        }
    }
}

impl Level {
    fn next(&self) -> Option<Self> {
        if !self.size.is_multiple_of(2) || self.size / 2 < SMALLEST {
            return None;
        }
        // The new texel covers old texels 2i and 2i + 1; the kernel is centred between them.
        const KERNEL: [f32; 6] = [0.03125, 0.15625, 0.3125, 0.3125, 0.15625, 0.03125];
        let (n, half) = (self.size, self.size / 2);
        let taps: [(isize, f32); 6] = std::array::from_fn(|t| (t as isize - 2, KERNEL[t]));
        let wrap = |i: isize| i.rem_euclid(n as isize) as usize;
        let mut across = vec![[0f32; 3]; n * half];
        for row in 0..n {
            for column in 0..half {
                for &(offset, weight) in &taps {
                    let texel = self.texels[row * n + wrap(2 * column as isize + offset)];
                    (0..3).for_each(|k| across[row * half + column][k] += weight * texel[k]);
                }
            }
        }
        let mut texels = vec![[0f32; 3]; half * half];
        for row in 0..half {
            for &(offset, weight) in &taps {
                let source = wrap(2 * row as isize + offset) * half;
                for column in 0..half {
                    let texel = across[source + column];
                    (0..3).for_each(|k| texels[row * half + column][k] += weight * texel[k]);
                }
            }
        }
        Some(Self { size: half, texels })
    }

    #[inline]
    fn bilinear(&self, u: f32, v: f32) -> [f32; 3] {
        let n = self.size;
        let cell = |t: f32| {
            let x = t * n as f32 - 0.5;
            let floor = x.floor();
            let before = if floor < 0.0 {
                n - 1
            } else {
                (floor as usize).min(n - 1)
            };
            let after = if before + 1 == n { 0 } else { before + 1 };
            (before, after, x - floor)
        };
        let ((left, right, s), (upper, lower, t)) = (cell(u), cell(v));
        let texel = |row: usize, column: usize| &self.texels[row * n + column];
        let (a, b) = (texel(upper, left), texel(upper, right));
        let (c, d) = (texel(lower, left), texel(lower, right));
        std::array::from_fn(|k| {
            let top = a[k] + s * (b[k] - a[k]);
            let bottom = c[k] + s * (d[k] - c[k]);
            top + t * (bottom - top)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_render::scene::TextureFilter;

    /// A level must damp a wave as the Gaussian of its stated blur does.
    #[test]
    fn levels_damp_waves_as_their_blur_says() {
        let size = 256;
        for cycles in [2.0, 4.0, 8.0] {
            let wave = |i: usize| {
                0.5 + 0.4 * (std::f64::consts::TAU * cycles * (i as f64 + 0.5) / size as f64).cos()
            };
            let texture = Texture {
                width: size as u32,
                height: size as u32,
                texels: (0..size * size)
                    .map(|i| [wave(i % size) as f32; 3])
                    .collect::<Vec<_>>()
                    .into(),
                filter: TextureFilter::Bilinear,
            };
            let pyramid = TexturePyramid::new(&texture, 2.0);
            assert_eq!(pyramid.levels(), 7);
            for level in 1..4 {
                let frequency = cycles / 2.0;
                let x = std::f64::consts::TAU * frequency * pyramid.blur_m(level);
                let expected = 0.4 * (-0.5 * x * x).exp();
                if expected < 0.02 {
                    continue;
                }
                // Amplitude by projection on the wave.
                let amplitude = 2.0 / 512.0
                    * (0..512)
                        .map(|i| {
                            let u = (f64::from(i) + 0.5) / 512.0;
                            let value = f64::from(pyramid.sample(level, u, 0.3)[0]) - 0.5;
                            value * (std::f64::consts::TAU * cycles * u).cos()
                        })
                        .sum::<f64>();
                assert!(
                    (amplitude / expected - 1.0).abs() < 0.03,
                    "{cycles} cycles, level {level}: {amplitude} {expected}"
                );
            }
        }
    }
}
