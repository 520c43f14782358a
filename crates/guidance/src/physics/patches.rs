//! What each patch of a part of a picture shows of a target.

use uw_calib::stats::{PATCH_COLUMNS, PATCH_ROWS};

use super::cleared::Sums;
use super::noise::NoiseMap;

/// Largest deviation of a patch over their root mean square.
const MOST_UNEVEN: f64 = 4.0;

/// One of them.
struct Patch {
    mean: f64,
    /// Variance without that of noise, which may be below 0.
    detail: f64,
    /// Variance of a pixel's noise.
    noise: f64,
    /// What its detail counts.
    weight: f64,
}

/// The patches of a part of a picture, places with less light counting less.
pub(super) struct Patches {
    all: Vec<Patch>,
    /// Pixels of each.
    pixels: f64,
}

impl Patches {
    /// The first columns and rows of patches of `width` × `height` pixels: small parts have room for another one.
    pub(super) fn new(sums: &Sums, (width, height): (usize, usize), noise: &NoiseMap) -> Self {
        let patch = |(i, (mean, variance)): (usize, (f64, f64))| {
            let corner_px = [i % PATCH_COLUMNS * width, i / PATCH_COLUMNS * height];
            let (own, weight) = noise.over(corner_px, [width, height]);
            Patch {
                mean,
                detail: variance - own.of_pixel,
                noise: own.of_pixel,
                weight,
            }
        };
        let windows = sums.window_grid([PATCH_COLUMNS, PATCH_ROWS], width, height);
        Self {
            all: windows.enumerate().map(patch).collect(),
            pixels: (width * height) as f64,
        }
    }

    /// Mean variance of the target's detail, below 0 where noise is taken to be too large.
    pub(super) fn detail(&self) -> f64 {
        self.weighted(|patch| patch.detail)
    }

    /// Mean value: patches count the same as long as their noise, which is that of many pixels, is less than the detail.
    pub(super) fn mean(&self) -> f64 {
        let detail = self.positive();
        let (mut sum, mut weights) = (0.0, 0.0);
        for patch in &self.all {
            let of_mean = patch.noise / self.pixels;
            let weight = match detail > 0.0 {
                true => detail / (detail + of_mean),
                false => patch.weight,
            };
            sum += weight * patch.mean;
            weights += weight;
        }
        sum / weights.max(f64::MIN_POSITIVE)
    }

    /// Per patch its mean over that of all.
    pub(super) fn means(&self, mean: f64) -> Vec<f64> {
        self.all.iter().map(|patch| patch.mean / mean).collect()
    }

    /// Per patch the deviation of its detail over the root mean square, 1 as far as noise hides it.
    pub(super) fn deviations(&self) -> Vec<f64> {
        let of_all = self.positive().max(f64::MIN_POSITIVE);
        let happens = (2.0 / self.pixels).sqrt();
        let of_patch = |patch: &Patch| {
            let trust = 1.0 / (1.0 + (happens * patch.noise / of_all).powi(2));
            let square = 1.0 + trust * (patch.detail / of_all - 1.0);
            square.max(0.0).sqrt().min(MOST_UNEVEN)
        };
        self.all.iter().map(of_patch).collect()
    }

    /// Mean variance of detail, none where noise is taken to be too large.
    fn positive(&self) -> f64 {
        self.weighted(|patch| patch.detail.max(0.0))
    }

    fn weighted(&self, of: impl Fn(&Patch) -> f64) -> f64 {
        let sum: f64 = self.all.iter().map(|patch| patch.weight * of(patch)).sum();
        let weights: f64 = self.all.iter().map(|patch| patch.weight).sum();
        sum / weights.max(f64::MIN_POSITIVE)
    }
}
