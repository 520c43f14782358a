//! A picture cleared of the water before it, and the variance inside its windows.

use uw_calib::Encoding;
use uw_calib::photo::PatchOrigin;
use uw_calib::picture::Counts;
use uw_calib::response::CountResponse;

use super::full_scale::CutOff;
use super::grid;
use super::light::Seen;
use super::made::Made;
use super::noise::{Light, NoiseMap};

/// Linear signal from which a pixel counts as clipped.
const FULL_SCALE: f64 = 0.995;
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

    /// The stored pixels that its pixels at (`u`, `v`) in [0, 1] were made of.
    pub(super) fn origin(&self, u: f64, v: f64) -> PatchOrigin {
        let made = self.made.as_ref();
        made.map_or(PatchOrigin::STORED, |made| made.at(u, v))
    }

    /// The contrast that was `measured` of it, 8-bit counts, as it would be with the noise of the pictures of `response`.
    pub(super) fn own_contrast(&self, measured: [f64; 3], response: &CountResponse) -> [f64; 3] {
        let made = self.made.as_ref();
        made.map_or(measured, |made| made.contrast(measured, response))
    }
}

/// One channel of a picture, cleared of veil and light: reflectance as the camera would see it in clear water.
pub(super) struct Cleared {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f64>,
    pub(super) noise: NoiseMap,
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
            noise: self.noise.part([left, top], [width, height]),
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
    let light = Light::new(&seen.gain[k]);
    let mut values = Vec::with_capacity(width * height);
    let mut at_full = Vec::with_capacity(width * height);
    for y in 0..height {
        let v = (y as f64 + 0.5) / height as f64;
        for x in 0..width {
            let u = (x as f64 + 0.5) / width as f64;
            let gain = exposure * light.at(u, v);
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
        noise: NoiseMap::new(picture, seen, exposure, k, response),
        at_full,
    }
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

    /// Mean variance inside such windows without the share of `noise`, below 0 where that is taken to be too large, and their mean deviation over its
    /// root; windows in less light count less.
    pub(super) fn inside(&self, w: usize, h: usize, noise: &NoiseMap) -> (f64, f64) {
        let (mut sum, mut deviation, mut weights) = (0.0, 0.0, 0.0);
        let columns = self.width / w;
        for (i, (_, variance)) in self.windows(w, h).enumerate() {
            let (own, weight) = noise.over([i % columns * w, i / columns * h], [w, h]);
            let detail = variance - (own.of_pixel - own.of((w * h) as f64));
            sum += weight * detail;
            deviation += weight * detail.max(0.0).sqrt();
            weights += weight;
        }
        let weights = weights.max(f64::MIN_POSITIVE);
        let variance = sum / weights;
        match variance > 0.0 {
            true => (
                variance,
                (deviation / weights / variance.sqrt()).clamp(0.2, 1.0),
            ),
            false => (variance, 1.0),
        }
    }
}
