//! Pixels sorted by signal: the variance from frame to frame, and what tells a moved view.
//!
//! A pixel's bin is chosen by its neighbours and never by itself, so that the choice knows nothing of the pixel's own noise: the
//! mean of a bin is that of its true signals, and pixels near black or full scale are left out with their whole distribution.

use super::frames::Linear;
use uw_calib::response::LinearNoise;

/// Bins of a channel, evenly spaced in the root of the signal.
pub(super) const BINS: usize = 40;
/// Standard deviations by which a pixel's neighbours must be inside the unclipped range.
const MARGIN: f64 = 4.0;

/// Sums over the pixels of a bin.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bin {
    /// Pixels.
    pub count: f64,
    /// Signal.
    signal: f64,
    /// Variance from frame to frame.
    variance: f64,
    /// Its square.
    square: f64,
    /// Square of the signal that a count is worth.
    count_square: f64,
    /// Squared slope of the picture, per squared pixel.
    slope: f64,
    /// Its square.
    slope_square: f64,
    /// What the variance is above that of the noise that is expected at the neighbours' level.
    excess: f64,
    /// Slope times excess.
    both: f64,
    /// Products of differences of neighbours.
    alike: f64,
}

/// The bins of all channels, `BINS` each, by rising signal.
pub(super) struct Binned {
    /// By channel, rising in signal.
    pub bins: Vec<[Bin; BINS]>,
}

impl Bin {
    /// Mean signal.
    pub fn mean(&self) -> f64 {
        self.signal / self.count
    }

    /// Variance of one frame's signal, rounding included.
    pub fn variance(&self) -> f64 {
        self.variance / self.count
    }

    /// Squared standard error of [`variance`](Self::variance), from the scatter of the pixels.
    pub fn squared_error(&self) -> f64 {
        let mean = self.variance();
        (self.square / self.count - mean * mean).max(0.0) / self.count
    }

    /// Mean square of the signal that a count is worth.
    pub fn count_square(&self) -> f64 {
        self.count_square / self.count
    }

    /// Of the regression of the variance on the picture's squared slope: sum of products, of squares, and squared error of the
    /// sum of products.
    pub fn regression(&self) -> [f64; 3] {
        let (n, slope) = (self.count, self.slope / self.count);
        let products = self.both - slope * self.excess;
        let squares = self.slope_square - n * slope * slope;
        [products, squares, squares * n * self.squared_error()]
    }

    /// Sum of the squared slopes.
    pub fn slopes(&self) -> f64 {
        self.slope
    }

    /// Sum of the variances, and of the products of differences of neighbours.
    pub fn correlation(&self) -> [f64; 2] {
        [self.variance, self.alike]
    }
}

/// Sorts the pixels; those within reach of `noise` from black or full scale are left out.
pub(super) fn sort(linear: &Linear, noise: LinearNoise) -> Binned {
    let (low, high) = linear.unclipped();
    let bins = (0..linear.channels).map(|k| channel(linear, k, noise, (low, high)));
    Binned {
        bins: bins.collect(),
    }
}

fn channel(linear: &Linear, k: usize, noise: LinearNoise, (low, high): (f64, f64)) -> [Bin; BINS] {
    let (width, frames) = (linear.width, linear.frames());
    let planes: Vec<&[f32]> = linear.signal.iter().map(|f| f[k].as_slice()).collect();
    let mean: Vec<f64> = (0..width * linear.height)
        .map(|i| planes.iter().map(|p| f64::from(p[i])).sum::<f64>() / frames as f64)
        .collect();
    let safe = |y: f64| {
        let reach = MARGIN * noise.standard_deviation(y);
        y - reach > low && y + reach < high
    };
    let safe: Vec<bool> = mean.iter().map(|&y| safe(y)).collect();
    let mut bins = [Bin::default(); BINS];
    for row in 1..linear.height.saturating_sub(1) {
        for column in 1..width.saturating_sub(1) {
            let i = row * width + column;
            let around = [i - width - 1, i - width, i - width + 1, i - 1, i + 1];
            let below = [i + width - 1, i + width, i + width + 1];
            if !around.iter().chain(&below).all(|&j| safe[j]) {
                continue;
            }
            // Clipped although no neighbour is near: a bright or dark speck.
            let clipped = |y: f64| y <= low || y >= high;
            if planes.iter().any(|p| clipped(f64::from(p[i]))) {
                continue;
            }
            let [left, right, up, down] = [i - 1, i + 1, i - width, i + width].map(|j| mean[j]);
            let level = 0.25 * (left + right + up + down);
            let slope = 0.25 * ((right - left).powi(2) + (down - up).powi(2));
            let expected = noise.standard_deviation(level).powi(2);
            let part = ((level.max(0.0).sqrt() * BINS as f64) as usize).min(BINS - 1);
            let bin = &mut bins[part];
            let variance = add(bin, linear, &planes, (i, mean[i], mean[i + 1]));
            bin.slope += slope;
            bin.slope_square += slope * slope;
            bin.excess += variance - expected;
            bin.both += slope * (variance - expected);
        }
    }
    bins
}

/// Adds pixel `i` and returns its variance; `mean` is that of its frames, `next` that of the pixel to its right.
fn add(
    bin: &mut Bin,
    linear: &Linear,
    planes: &[&[f32]],
    (i, mean, next): (usize, f64, f64),
) -> f64 {
    let freedom = planes.len() as f64 - 1.0;
    let (mut variance, mut alike) = (0.0, 0.0);
    for plane in planes {
        let off = f64::from(plane[i]) - mean;
        variance += off * off / freedom;
        alike += off * (f64::from(plane[i + 1]) - next) / freedom;
    }
    bin.count += 1.0;
    bin.signal += mean;
    bin.variance += variance;
    bin.square += variance * variance;
    bin.count_square += linear.slope(mean).powi(-2);
    bin.alike += alike;
    variance
}
