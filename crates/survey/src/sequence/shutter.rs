//! When the rows of a frame see the scene: how long they are exposed, and how long the read-out takes from the first to the last.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use uw_render::sampling::Rng;

/// Parts of a picture whose rows open at one time, where they do not all open at once.
const MOST_BANDS: u32 = 16;
/// Most moments that stand for an exposure.
const MOST_MOMENTS: u32 = 8;

/// A camera's shutter. A frame's pose is that of the moment when its first row opens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Shutter {
    /// For how long a row is open, s; at 0 the picture is of one moment.
    pub exposure_s: f64,
    /// From the opening of the first row to that of the last, s; at 0 all open at once.
    pub rolling_s: f64,
}

/// Rows that open together.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Band {
    pub(super) rows: Range<u32>,
    /// After the first row, s: when the middle one of these opens.
    pub(super) opens_s: f64,
}

impl Shutter {
    /// Whether it sees one moment alone.
    pub fn is_instant(&self) -> bool {
        *self == Self::default()
    }

    /// The rows of a picture of `height`, by when they open.
    pub(super) fn bands(&self, height: u32) -> Vec<Band> {
        let count = match self.rolling_s > 0.0 {
            true => height.min(MOST_BANDS),
            false => 1,
        };
        let edge = |i: u32| (u64::from(i) * u64::from(height) / u64::from(count)) as u32;
        let last_row = f64::from(height.max(2) - 1);
        (0..count)
            .map(|i| {
                let rows = edge(i)..edge(i + 1);
                let middle = 0.5 * (f64::from(rows.start) + f64::from(rows.end - 1));
                Band {
                    opens_s: self.rolling_s * middle / last_row,
                    rows,
                }
            })
            .collect()
    }

    /// How many moments stand for the exposure, and samples per pixel of each, together at least `samples`; an even number where
    /// they are denoised.
    pub(super) fn moments(&self, samples: u32, denoised: bool) -> (u32, u32) {
        let least = if denoised { 2 } else { 1 };
        let count = match self.exposure_s > 0.0 {
            true => (samples / least).clamp(1, MOST_MOMENTS),
            false => 1,
        };
        (count, samples.div_ceil(count).next_multiple_of(least))
    }

    /// Those moments after the rows have opened, s: one drawn in each of as many equal parts of the exposure, so that the mean over
    /// frames is that over the exposure.
    pub(super) fn times_s(&self, count: u32, seed: u64) -> Vec<f64> {
        let mut rng = Rng::new(seed, 0, 0, 0);
        let part_s = self.exposure_s / f64::from(count);
        (0..count)
            .map(|i| part_s * (f64::from(i) + rng.uniform()))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_all_rows_and_open_one_after_another() {
        let at_once = Shutter::default().bands(90);
        assert_eq!(
            at_once,
            [Band {
                rows: 0..90,
                opens_s: 0.0
            }]
        );
        let rolling = Shutter {
            exposure_s: 0.0,
            rolling_s: 0.89,
        };
        for height in [1, 7, 90] {
            let bands = rolling.bands(height);
            assert_eq!(bands.len() as u32, height.min(16));
            let mut next = 0;
            for band in &bands {
                assert!(band.rows.start == next && band.rows.end > next, "{bands:?}");
                next = band.rows.end;
            }
            assert_eq!(next, height);
        }
        // A row of 90 opens every 10 ms; the first five open around the third.
        let bands = rolling.bands(90);
        assert_eq!(bands[0].rows, 0..5);
        assert!((bands[0].opens_s - 0.02).abs() < 1e-12);
        assert!((bands[15].opens_s - 0.865).abs() < 1e-12, "{bands:?}");
    }

    #[test]
    fn moments_share_the_samples_and_lie_in_the_exposure() {
        let shutter = Shutter {
            exposure_s: 0.4,
            rolling_s: 0.0,
        };
        assert_eq!(Shutter::default().moments(64, true), (1, 64));
        assert_eq!(shutter.moments(64, false), (8, 8));
        assert_eq!(shutter.moments(4, false), (4, 1));
        assert_eq!(shutter.moments(4, true), (2, 2));
        assert_eq!(shutter.moments(20, true), (8, 4));
        let times = shutter.times_s(8, 5);
        for (i, time) in times.iter().enumerate() {
            assert!(
                (0.05 * i as f64..0.05 * (i + 1) as f64).contains(time),
                "{times:?}"
            );
        }
        assert_ne!(times, shutter.times_s(8, 6));
        assert_eq!(Shutter::default().times_s(1, 5), [0.0]);
    }
}
