//! Mean and contrast of the stored image, with their standard errors.

use uw_calib::ImageStats;
use uw_calib::stats::{PATCH_COLUMNS, PATCH_ROWS};

use super::radiance::RadianceImage;
use super::response::CountResponse;

/// Daylight and lamps of one view at one lamp level, and the linear signal per radiance.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// Daylight.
    pub ambient: &'a RadianceImage,
    /// Lamps at 100 %.
    pub lamps: &'a RadianceImage,
    /// Lamp level, percent.
    pub light_pct: f64,
    /// Linear signal per radiance.
    pub exposure: f64,
}

impl Shot<'_> {
    /// Linear signal of pixel `i` in estimate `e`.
    #[inline]
    pub fn signal(&self, e: usize, i: usize) -> [f32; 3] {
        let level = (0.01 * self.light_pct) as f32;
        let exposure = self.exposure as f32;
        let (ambient, lamps) = (&self.ambient.estimates[e][i], &self.lamps.estimates[e][i]);
        std::array::from_fn(|k| exposure * (ambient[k] + level * lamps[k]))
    }

    /// Mean linear signal of the brightest channel, all estimates together.
    pub fn mean_signal(&self) -> f64 {
        let mut sum = [0.0; 3];
        let mut n = 0.0;
        for e in 0..self.ambient.estimates.len() {
            for i in 0..self.ambient.estimates[e].len() {
                let signal = self.signal(e, i);
                (0..3).for_each(|k| sum[k] += f64::from(signal[k]));
                n += 1.0;
            }
        }
        sum.into_iter().fold(0.0, f64::max) / n
    }

    /// Mean and contrast from two independent estimates: a patch's variance is their covariance plus the mean
    /// variance of the sensor's noise and rounding in it.
    pub fn statistics(&self, response: &CountResponse) -> ImageStats {
        self.over_patches(|signal| {
            let (a, b) = (response.at(signal[0]), response.at(signal[1]));
            let noise = response.at(0.5 * (signal[0] + signal[1])).1;
            (a.0, b.0, noise)
        })
    }

    /// Mean and contrast of one estimate alone; noise of the paths counts as contrast.
    fn statistics_of(&self, response: &CountResponse, e: usize) -> ImageStats {
        Shot {
            ambient: &only(self.ambient, e),
            lamps: &only(self.lamps, e),
            ..*self
        }
        .over_patches(|signal| {
            let (mean, variance) = response.at(signal[0]);
            (mean, mean, variance)
        })
    }

    /// Statistics over patches; `counts` gives the mean count in each of two estimates and the variance of one
    /// stored count from their signals.
    fn over_patches(&self, counts: impl Fn([f32; 2]) -> (f32, f32, f32)) -> ImageStats {
        let lattice = self.ambient.lattice;
        let (columns, rows) = (
            lattice.columns() / PATCH_COLUMNS,
            lattice.rows() / PATCH_ROWS,
        );
        let second = self.ambient.estimates.len() - 1;
        let mut contrast = [0.0; 3];
        let mut mean = [0.0; 3];
        let mut pixels = 0.0;
        for (patch_row, patch_column) in
            (0..PATCH_ROWS).flat_map(|r| (0..PATCH_COLUMNS).map(move |c| (r, c)))
        {
            let mut sums = [PatchSums::default(); 3];
            for row in patch_row * rows..(patch_row + 1) * rows {
                let start = row * lattice.columns() + patch_column * columns;
                for i in start..start + columns {
                    let (first, second) = (self.signal(0, i), self.signal(second, i));
                    for k in 0..3 {
                        sums[k].add(counts([first[k], second[k]]));
                    }
                }
            }
            let n = (rows * columns) as f64;
            pixels += n;
            for k in 0..3 {
                contrast[k] += sums[k].variance(n).max(0.0).sqrt();
                mean[k] += 0.5 * (sums[k].first + sums[k].second);
            }
        }
        let patches = (PATCH_COLUMNS * PATCH_ROWS) as f64;
        ImageStats {
            contrast: contrast.map(|c| c / patches),
            mean: mean.map(|m| m / pixels),
        }
    }
}

/// One estimate of an image.
fn only(image: &RadianceImage, e: usize) -> RadianceImage {
    RadianceImage {
        lattice: image.lattice,
        estimates: vec![image.estimates[e].clone()],
    }
}

/// Standard errors of an image's statistics that the paths of its renders leave, 8-bit counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandardErrors {
    /// Of the mean.
    pub mean: [f64; 3],
    /// Of the contrast.
    pub contrast: [f64; 3],
}

/// Standard errors from the spread of the estimates of single groups, of which the shot holds one each.
pub fn standard_errors(shot: &Shot, response: &CountResponse) -> StandardErrors {
    let groups = shot.ambient.estimates.len();
    let stats: Vec<ImageStats> = (0..groups)
        .map(|e| shot.statistics_of(response, e))
        .collect();
    let error = |of: fn(&ImageStats) -> [f64; 3]| {
        std::array::from_fn(|k| {
            let mean = stats.iter().map(|s| of(s)[k]).sum::<f64>() / groups as f64;
            let spread = stats.iter().map(|s| (of(s)[k] - mean).powi(2)).sum::<f64>();
            (spread / (groups * (groups - 1)) as f64).sqrt()
        })
    };
    StandardErrors {
        mean: error(|s| s.mean),
        contrast: error(|s| s.contrast),
    }
}

/// Sums over a patch and channel.
#[derive(Clone, Copy, Debug, Default)]
struct PatchSums {
    first: f64,
    second: f64,
    product: f64,
    noise: f64,
}

impl PatchSums {
    #[inline]
    fn add(&mut self, (first, second, noise): (f32, f32, f32)) {
        let (first, second) = (f64::from(first), f64::from(second));
        self.first += first;
        self.second += second;
        self.product += first * second;
        self.noise += f64::from(noise);
    }

    fn variance(&self, n: f64) -> f64 {
        (self.product + self.noise) / n - (self.first / n) * (self.second / n)
    }
}
