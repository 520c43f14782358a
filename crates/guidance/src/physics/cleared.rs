//! A picture cleared of the water before it, and the variance inside its windows.

use uw_calib::Encoding;
use uw_calib::photo::PatchOrigin;
use uw_calib::picture::Counts;
use uw_calib::response::CountResponse;

use super::full_scale::CutOff;
use super::grid;
use super::light::Seen;
use super::made::Made;

/// Linear signal from which a pixel counts as clipped.
const FULL_SCALE: f64 = 0.995;
/// Side of the blocks by whose mean noise is known, pixels.
const BLOCK_PX: usize = 6;
/// Least side of the patches of a part, pixels.
const LEAST_PATCH_PX: usize = 5;

/// A linear picture: signal per pixel and channel, row by row.
#[derive(Clone, Debug)]
pub struct LinearPicture {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Signal per pixel.
    pub signal: Vec<[f32; 3]>,
    /// What tells its noise where it was made of stored ones.
    made: Option<Made>,
}

impl LinearPicture {
    /// Of a picture, as it is stored or made of such.
    pub fn of_counts(picture: &Counts, encoding: Encoding) -> Self {
        let light = |pixel: &[f64; 3]| pixel.map(|count| encoding.light(count) as f32);
        Self {
            width: picture.width,
            height: picture.height,
            signal: picture.pixels.iter().map(light).collect(),
            made: Made::new(picture, encoding),
        }
    }

    /// The share of its light that the stored picture has, on average.
    pub(super) fn stored_share(&self) -> f64 {
        self.made.as_ref().map_or(1.0, Made::share)
    }

    /// The contrast that was `measured` of it, 8-bit counts, as it would be with the noise of the pictures of `response`.
    pub(super) fn own_contrast(&self, measured: [f64; 3], response: &CountResponse) -> [f64; 3] {
        let made = self.made.as_ref();
        made.map_or(measured, |made| made.contrast(measured, response))
    }
}

/// Variance that the sensor's noise has in a picture's pixels, and in means over many of them times their number: less than that where
/// neighbours have noise in common.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Noise {
    pub(super) of_pixel: f64,
    of_means: f64,
}

impl Noise {
    /// Variance of the means over `pixels` pixels: near one pixel that of a pixel, far from it that of independent ones. Right to 6 % for
    /// means over 2 × 2 to 8 × 8 pixels that are interpolated by cubics and 0.6 to 2 stored pixels wide.
    pub(super) fn of(self, pixels: f64) -> f64 {
        match pixels > 1.0 {
            true => 1.0 / (1.0 / self.of_pixel + (pixels - 1.0) / self.of_means),
            false => self.of_pixel,
        }
    }
}

/// One channel of a picture, cleared of veil and light: reflectance as the camera would see it in clear water.
pub(super) struct Cleared {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f64>,
    /// Mean over the picture.
    pub(super) noise: Noise,
    /// Which pixels are at full scale; their values are what they may have been without it.
    pub(super) at_full: Vec<bool>,
}

impl Cleared {
    /// The middle of it, `share` as wide and high; `None` where its patches would be too small.
    pub(super) fn middle(&self, share: f64) -> Option<Self> {
        let side = |whole: usize| (whole as f64 * share).round() as usize;
        let (width, height) = (side(self.width), side(self.height));
        if width / 10 < LEAST_PATCH_PX || height / 6 < LEAST_PATCH_PX {
            return None;
        }
        let (left, top) = ((self.width - width) / 2, (self.height - height) / 2);
        let row = |y: usize| {
            let from = (top + y) * self.width + left;
            from..from + width
        };
        let pixels = || (0..height).flat_map(row);
        Some(Self {
            width,
            height,
            values: pixels().map(|i| self.values[i]).collect(),
            noise: self.noise,
            at_full: pixels().map(|i| self.at_full[i]).collect(),
        })
    }

    /// Share of pixels at full scale.
    pub(super) fn clipped(&self) -> f64 {
        let clipped = self.at_full.iter().filter(|&&at_full| at_full).count();
        clipped as f64 / self.at_full.len() as f64
    }
}

pub(super) fn clear(
    picture: &LinearPicture,
    seen: &Seen,
    exposure: f64,
    k: usize,
    response: &CountResponse,
) -> Cleared {
    let (width, height) = (picture.width, picture.height);
    let mut values = Vec::with_capacity(width * height);
    let mut at_full = Vec::with_capacity(width * height);
    for y in 0..height {
        let v = (y as f64 + 0.5) / height as f64;
        for x in 0..width {
            let u = (x as f64 + 0.5) / width as f64;
            let gain = exposure * grid::at(&seen.gain[k], u, v).max(1e-12);
            let veil = exposure * grid::at(&seen.veil[k], u, v);
            let signal = f64::from(picture.signal[y * width + x][k]);
            values.push((signal - veil) / gain);
            at_full.push(signal >= FULL_SCALE);
        }
    }
    let mut cut_off = CutOff {
        width,
        height,
        values: &mut values,
        at_full: &at_full,
    };
    cut_off.restore();
    Cleared {
        width,
        height,
        values,
        noise: noise(picture, seen, exposure, k, response),
        at_full,
    }
}

/// What the sensor's noise makes of the reflectance, by the mean signal of small blocks.
fn noise(
    picture: &LinearPicture,
    seen: &Seen,
    exposure: f64,
    k: usize,
    response: &CountResponse,
) -> Noise {
    let (columns, rows) = (picture.width / BLOCK_PX, picture.height / BLOCK_PX);
    let mut sum = Noise::default();
    for row in 0..rows {
        for column in 0..columns {
            let pixel = |i: usize| {
                let (x, y) = (
                    column * BLOCK_PX + i % BLOCK_PX,
                    row * BLOCK_PX + i / BLOCK_PX,
                );
                f64::from(picture.signal[y * picture.width + x][k])
            };
            let mean =
                (0..BLOCK_PX * BLOCK_PX).map(pixel).sum::<f64>() / (BLOCK_PX * BLOCK_PX) as f64;
            let (u, v) = (
                (column as f64 + 0.5) / columns as f64,
                (row as f64 + 0.5) / rows as f64,
            );
            let gain = exposure * grid::at(&seen.gain[k], u, v).max(1e-12);
            let made = picture.made.as_ref();
            let of = made.map_or(PatchOrigin::STORED, |made| made.at(u, v));
            let stored = noise_variance(of.share * mean, response) / (of.share * gain).powi(2);
            sum.of_pixel += of.left * stored;
            sum.of_means += stored / of.pixels;
        }
    }
    let blocks = (columns * rows).max(1) as f64;
    Noise {
        of_pixel: sum.of_pixel / blocks,
        of_means: sum.of_means / blocks,
    }
}

/// Variance of the linear signal as read back from its count, noise and rounding together.
fn noise_variance(signal: f64, response: &CountResponse) -> f64 {
    let step = (0.02 * signal).max(1e-4);
    let (low, _) = response.at((signal - step).max(0.0) as f32);
    let (high, _) = response.at((signal + step) as f32);
    let (_, variance) = response.at(signal.max(0.0) as f32);
    let slope = f64::from(high - low) / (signal + step - (signal - step).max(0.0));
    f64::from(variance) / (slope * slope).max(1.0)
}

/// Sums of values and squares over rectangles from the top left.
pub(super) struct Sums {
    width: usize,
    height: usize,
    sums: Vec<(f64, f64)>,
}

impl Sums {
    pub(super) fn new(cleared: &Cleared) -> Self {
        let stride = cleared.width + 1;
        let mut sums = vec![(0.0, 0.0); stride * (cleared.height + 1)];
        for y in 0..cleared.height {
            let mut row = (0.0, 0.0);
            for x in 0..cleared.width {
                let value = cleared.values[y * cleared.width + x];
                row.0 += value;
                row.1 += value * value;
                let above = sums[y * stride + x + 1];
                sums[(y + 1) * stride + x + 1] = (above.0 + row.0, above.1 + row.1);
            }
        }
        Self {
            width: cleared.width,
            height: cleared.height,
            sums,
        }
    }

    /// Mean and variance of windows of `w` × `h` pixels side by side, row by row.
    pub(super) fn windows(&self, w: usize, h: usize) -> impl Iterator<Item = (f64, f64)> {
        self.window_grid([self.width / w, self.height / h], w, h)
    }

    /// The same of the first columns and rows of windows alone.
    pub(super) fn window_grid(
        &self,
        [columns, rows]: [usize; 2],
        w: usize,
        h: usize,
    ) -> impl Iterator<Item = (f64, f64)> {
        let stride = self.width + 1;
        let area = (w * h) as f64;
        (0..rows * columns).map(move |i| {
            let (top, left) = (i / columns * h * stride, i % columns * w);
            let bottom = top + h * stride;
            let (a, b) = (self.sums[top + left], self.sums[top + left + w]);
            let (c, d) = (self.sums[bottom + left], self.sums[bottom + left + w]);
            let mean = (d.0 - b.0 - c.0 + a.0) / area;
            let square = (d.1 - b.1 - c.1 + a.1) / area;
            (mean, square - mean * mean)
        })
    }

    /// Mean variance inside such windows without the share of `noise`, below 0 where that is taken to be too large, and their mean deviation over its root.
    pub(super) fn inside(&self, w: usize, h: usize, noise: Noise) -> (f64, f64) {
        let of_noise = noise.of_pixel - noise.of((w * h) as f64);
        let (mut sum, mut deviation, mut n) = (0.0, 0.0, 0.0);
        for (_, variance) in self.windows(w, h) {
            sum += variance - of_noise;
            deviation += (variance - of_noise).max(0.0).sqrt();
            n += 1.0;
        }
        let n = f64::max(n, 1.0);
        let variance = sum / n;
        match variance > 0.0 {
            true => (variance, (deviation / n / variance.sqrt()).clamp(0.2, 1.0)),
            false => (variance, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Noise;

    /// Shares of four stored pixels in a point `t` behind the second, by Keys' cubics.
    fn shares(t: f64) -> [f64; 4] {
        [
            -0.5 * t + t * t - 0.5 * t.powi(3),
            1.0 - 2.5 * t * t + 1.5 * t.powi(3),
            0.5 * t + 2.0 * t * t - 1.5 * t.powi(3),
            -0.5 * t * t + 0.5 * t.powi(3),
        ]
    }

    /// Variance of the mean over `n` pixels in a row that are `width` stored pixels wide, of `samples` points each; those have 1.
    fn of_row(n: usize, width: f64, samples: usize) -> f64 {
        let phases = 200;
        let of_phase = |phase: usize| {
            let mut stored = [0.0; 64];
            for i in 0..n * samples {
                let part = (i as f64 + 0.5) / samples as f64;
                let at = 20.0 + phase as f64 / f64::from(phases) + width * part;
                let first = at as usize;
                for (k, share) in shares(at - at.floor()).into_iter().enumerate() {
                    stored[first - 1 + k] += share / (n * samples) as f64;
                }
            }
            stored.iter().map(|share| share * share).sum::<f64>()
        };
        (0..phases as usize).map(of_phase).sum::<f64>() / f64::from(phases)
    }

    #[test]
    fn means_of_interpolated_pixels_have_the_noise_that_is_said() {
        for (width, samples) in [(0.6, 1), (0.8, 1), (1.0, 1), (1.3, 2), (2.0, 2)] {
            let noise = Noise {
                of_pixel: of_row(1, width, samples).powi(2),
                of_means: 1.0 / (width * width),
            };
            for n in [2, 4, 8] {
                let found = of_row(n, width, samples).powi(2);
                let off = noise.of((n * n) as f64) / found - 1.0;
                assert!(off.abs() < 0.065, "{width} {n}: {off}");
            }
        }
    }
}
