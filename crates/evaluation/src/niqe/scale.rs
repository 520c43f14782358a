//! The two scales of an image and their local normalisation.

/// Edge and standard deviation of the Gaussian window, pixels.
const WINDOW: usize = 7;
const WINDOW_SIGMA_PX: f64 = 7.0 / 6.0;
/// Added to the local standard deviation before dividing by it, 8-bit counts.
const STABILITY: f64 = 1.0;
/// Parameter of the cubic that images are resized with.
const CUBIC: f64 = -0.5;

/// An image of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    width: usize,
    height: usize,
    values: Vec<f64>,
}

impl Plane {
    /// The upper left part of an image whose rows are `stride` values long.
    pub fn cut(values: &[f64], stride: usize, width: usize, height: usize) -> Self {
        let rows = values.chunks_exact(stride).take(height);
        Self {
            width,
            height,
            values: rows.flat_map(|row| &row[..width]).copied().collect(),
        }
    }

    /// The square of `edge` × `edge` values at (left, top).
    pub fn block(&self, left: usize, top: usize, edge: usize) -> Vec<f64> {
        (top..top + edge)
            .flat_map(|y| &self.values[y * self.width + left..][..edge])
            .copied()
            .collect()
    }

    /// (value − local mean)/(local standard deviation + 1) under a Gaussian window; edges are continued.
    pub fn normalised(&self) -> Self {
        let window = gaussian();
        let mean = self.filtered(&window);
        let squares = Self {
            values: self.values.iter().map(|v| v * v).collect(),
            ..*self
        }
        .filtered(&window);
        let values = self
            .values
            .iter()
            .zip(mean.values.iter().zip(&squares.values))
            .map(|(v, (m, s))| (v - m) / ((s - m * m).abs().sqrt() + STABILITY))
            .collect();
        Self { values, ..*self }
    }

    /// Half the width and height by cubic interpolation widened against aliasing; the image is mirrored at its edges.
    pub fn halved(&self) -> Self {
        let across = self.halved_rows();
        across.transposed().halved_rows().transposed()
    }

    fn halved_rows(&self) -> Self {
        let weights = half_weights();
        let width = self.width / 2;
        let mut values = Vec::with_capacity(width * self.height);
        for row in self.values.chunks_exact(self.width) {
            for x in 0..width {
                let first = 2 * x as isize - 3;
                let taps = weights.iter().zip(first..);
                values.push(taps.map(|(w, i)| w * row[mirrored(i, self.width)]).sum());
            }
        }
        Self {
            width,
            height: self.height,
            values,
        }
    }

    fn transposed(&self) -> Self {
        let value = |i: usize| self.values[i % self.height * self.width + i / self.height];
        Self {
            width: self.height,
            height: self.width,
            values: (0..self.values.len()).map(value).collect(),
        }
    }

    /// Separable filter; edges are continued.
    fn filtered(&self, window: &[f64; WINDOW]) -> Self {
        let rows = self.filtered_rows(window);
        rows.transposed().filtered_rows(window).transposed()
    }

    fn filtered_rows(&self, window: &[f64; WINDOW]) -> Self {
        let reach = WINDOW / 2;
        let mut values = Vec::with_capacity(self.values.len());
        for row in self.values.chunks_exact(self.width) {
            for x in 0..self.width {
                let at = |k: usize| row[(x + k).saturating_sub(reach).min(self.width - 1)];
                values.push(window.iter().enumerate().map(|(k, w)| w * at(k)).sum());
            }
        }
        Self { values, ..*self }
    }
}

fn gaussian() -> [f64; WINDOW] {
    let weight = |k: usize| {
        let offset = k as f64 - (WINDOW / 2) as f64;
        (-0.5 * (offset / WINDOW_SIGMA_PX).powi(2)).exp()
    };
    let window: [f64; WINDOW] = std::array::from_fn(weight);
    let sum: f64 = window.iter().sum();
    window.map(|w| w / sum)
}

/// Weights of the eight values around the centre of two: the cubic stretched by two.
fn half_weights() -> [f64; 8] {
    let weights: [f64; 8] = std::array::from_fn(|k| cubic(0.5 * (k as f64 - 3.5)));
    let sum: f64 = weights.iter().sum();
    weights.map(|w| w / sum)
}

fn cubic(x: f64) -> f64 {
    let x = x.abs();
    if x <= 1.0 {
        (CUBIC + 2.0) * x.powi(3) - (CUBIC + 3.0) * x.powi(2) + 1.0
    } else if x <= 2.0 {
        CUBIC * x.powi(3) - 5.0 * CUBIC * x.powi(2) + 8.0 * CUBIC * x - 4.0 * CUBIC
    } else {
        0.0
    }
}

/// Index mirrored at the ends, which are repeated.
fn mirrored(index: isize, length: usize) -> usize {
    let period = 2 * length as isize;
    let at = index.rem_euclid(period);
    at.min(period - 1 - at) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_keeps_constants_and_ramps() {
        let ramp = Plane {
            width: 32,
            height: 8,
            values: (0..256).map(|i| f64::from(i % 32)).collect(),
        };
        let half = ramp.halved();
        assert_eq!((half.width, half.height), (16, 4));
        for x in 2..14 {
            // The centre of pixels 2x and 2x + 1.
            assert!((half.values[16 + x] - (2.0 * x as f64 + 0.5)).abs() < 1e-12);
        }
    }

    #[test]
    fn normalisation_takes_level_and_most_of_the_amplitude_away() {
        let pattern = |scale: f64, level: f64| Plane {
            width: 24,
            height: 24,
            values: (0..576_i32)
                .map(|i| level + scale * f64::from(i * 7 % 11))
                .collect(),
        };
        let (dim, bright) = (
            pattern(10.0, 0.0).normalised(),
            pattern(20.0, 90.0).normalised(),
        );
        for (a, b) in dim.values.iter().zip(&bright.values) {
            assert!((a - b).abs() < 0.06, "{a} {b}");
        }
    }
}
