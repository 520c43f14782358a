//! Which waves the variance between two sizes of windows consists of.
//!
//! A window's mean keeps exp(-x / 3 - x² / 120) of the power of waves of frequency f, x being (π a f)² and a its side (the mean over all
//! directions of sinc²(a f cos φ) sinc²(a f sin φ), to fourth order; within 0.02 everywhere). What lies between windows of a and b is that of a less that of
//! b: a band three octaves wide, in which a target with more power in long waves than in short ones (nearly all have) is seen by its
//! long ones, of which water leaves more.

/// Frequencies an octave.
const PER_OCTAVE: f64 = 2.0;
/// How far beyond the peaks of the finest and the coarsest band, as a factor.
const BEYOND: [f64; 2] = [3.0, 8.0];
/// Frequency of a band's peak times the root of the product of its windows.
const PEAK: f64 = 0.53;
/// Least power of a band over the largest, where logarithms are taken.
const LEAST_POWER: f64 = 1e-6;
/// Least variance of a band of a target that has any.
const LEAST_VARIANCE: f64 = 1e-20;
/// Steepest slope of the logarithm of power over that of frequency which goes on beyond the coarsest band.
const STEEPEST: f64 = 1.5;
/// Rounds in which the power of the bands is found.
const ROUNDS: usize = 4;
/// Most by which a round changes a band.
const MOST_CHANGE: f64 = 3.0;

/// Share of the power of waves of a frequency that the means of windows keep.
fn kept(side_m: f64, frequency_per_m: f64) -> f64 {
    let x = (std::f64::consts::PI * side_m * frequency_per_m).powi(2);
    (-x / 3.0 - x * x / 120.0).exp()
}

/// Bands between rising windows, as sums of waves.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Waves {
    /// Rising, 1/m.
    frequencies_per_m: Vec<f64>,
    /// Per band and frequency: the share that counts in the band.
    bands: Vec<Vec<f64>>,
    /// Logarithm of the peaks' frequencies, falling as the windows rise.
    peaks: Vec<f64>,
    /// Octaves of each band.
    octaves: Vec<f64>,
}

impl Waves {
    /// Of the bands between `windows_m`, at least two that rise.
    pub(super) fn new(windows_m: &[f64]) -> Self {
        let pairs = || windows_m.windows(2).map(|pair| (pair[0], pair[1]));
        let peak = |(a, b): (f64, f64)| PEAK / (a * b).sqrt();
        let peaks: Vec<f64> = pairs().map(peak).collect();
        let lowest = peaks.last().map_or(1.0, |last| last / BEYOND[1]);
        let highest = peaks.first().map_or(1.0, |first| first * BEYOND[0]);
        let steps = ((highest / lowest).log2() * PER_OCTAVE).ceil() as i32;
        let frequencies_per_m: Vec<f64> = (0..=steps)
            .map(|i| lowest * (f64::from(i) / PER_OCTAVE).exp2())
            .collect();
        let band = |(a, b): (f64, f64)| {
            let share = |&f: &f64| kept(a, f) - kept(b, f);
            frequencies_per_m.iter().map(share).collect()
        };
        Self {
            bands: pairs().map(band).collect(),
            octaves: pairs().map(|(a, b)| (b / a).log2()).collect(),
            peaks: peaks.iter().map(|peak| peak.ln()).collect(),
            frequencies_per_m,
        }
    }

    /// Something of each frequency, 1/m.
    pub(super) fn each(&self, of: impl Fn(f64) -> f64) -> Vec<f64> {
        self.frequencies_per_m.iter().map(|&f| of(f)).collect()
    }

    /// Per band the weight of each wave in means over the band, each wave counting with its power: that which gives the `variance` of all
    /// bands where `left` of each wave's power is left.
    pub(super) fn weights(&self, variance: &[f64], left: &[f64]) -> Vec<Vec<f64>> {
        let most = variance.iter().fold(LEAST_VARIANCE, |a, &b| a.max(b));
        let measured: Vec<f64> = variance.iter().map(|v| v.max(LEAST_POWER * most)).collect();
        let mut density: Vec<f64> = (measured.iter().zip(&self.octaves))
            .map(|(variance, octaves)| variance / octaves)
            .collect();
        let mut power = self.between_peaks(&density);
        for _ in 0..ROUNDS {
            for (i, band) in self.bands.iter().enumerate() {
                let sum: f64 = (band.iter().zip(&power).zip(left))
                    .map(|((k, p), l)| k * p * l)
                    .sum();
                density[i] *=
                    (measured[i] * PER_OCTAVE / sum).clamp(1.0 / MOST_CHANGE, MOST_CHANGE);
            }
            power = self.between_peaks(&density);
        }
        let of_band = |band: &Vec<f64>| {
            let own: Vec<f64> = band.iter().zip(&power).map(|(k, p)| k * p).collect();
            let sum = own.iter().sum::<f64>().max(f64::MIN_POSITIVE);
            own.into_iter().map(|p| p / sum).collect()
        };
        self.bands.iter().map(of_band).collect()
    }

    /// Power at each frequency between the bands' peaks, in straight lines of logarithms; the last one goes on to longer waves, to shorter
    /// ones power stays.
    fn between_peaks(&self, density: &[f64]) -> Vec<f64> {
        let of = |&f: &f64| {
            let at = f.ln();
            let n = self.peaks.len();
            let after = self.peaks.partition_point(|&peak| peak > at);
            if after == 0 || n < 2 {
                return density.first().copied().unwrap_or(0.0);
            }
            let to = after.min(n - 1);
            let [a, b] = [density[to - 1], density[to]].map(f64::ln);
            let over = (self.peaks[to - 1] - at) / (self.peaks[to - 1] - self.peaks[to]);
            match over > 1.0 {
                true => {
                    let steepest = STEEPEST * (self.peaks[to - 1] - self.peaks[to]);
                    (b + (over - 1.0) * (b - a).clamp(-steepest, steepest)).exp()
                }
                false => (a + over * (b - a)).exp(),
            }
        };
        self.frequencies_per_m.iter().map(of).collect()
    }
}

/// Mean with `weights`.
pub(super) fn mean(weights: &[f64], values: &[f64]) -> f64 {
    weights.iter().zip(values).map(|(w, v)| w * v).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Windows of 1 mm, 2 mm .. 64 mm.
    fn windows() -> Vec<f64> {
        (0..7).map(|i| 1e-3 * f64::from(1 << i)).collect()
    }

    /// The angular mean of what square windows keep of waves, from its definition.
    fn kept_by_definition(side_m: f64, frequency_per_m: f64) -> f64 {
        let sinc = |x: f64| (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x);
        let u = side_m * frequency_per_m;
        let at = |i: u32| {
            let angle = (f64::from(i) + 0.5) / 64.0 * std::f64::consts::FRAC_PI_2;
            (sinc(u * angle.cos()) * sinc(u * angle.sin())).powi(2)
        };
        (0..64).map(at).sum::<f64>() / 64.0
    }

    #[test]
    fn windows_keep_of_waves_what_they_do_by_definition() {
        for i in 1..400 {
            let frequency_per_m = 0.01 * f64::from(i);
            let [ours, exact] = [kept, kept_by_definition].map(|of| of(1.0, frequency_per_m));
            assert!(
                (ours - exact).abs() < 0.02,
                "{frequency_per_m}: {ours} {exact}"
            );
        }
    }

    /// Variance between windows of a target whose power an octave is `power`, of which `left` is left.
    fn variance(power: &dyn Fn(f64) -> f64, left: &dyn Fn(f64) -> f64) -> Vec<f64> {
        let between = |pair: &[f64]| {
            let at = |i: i32| {
                let f = 1000.0 * (0.02 * f64::from(i)).exp2();
                0.02 * power(f)
                    * left(f).powi(2)
                    * (kept_by_definition(pair[0], f) - kept_by_definition(pair[1], f))
            };
            (-600..200).map(at).sum()
        };
        windows().windows(2).map(between).collect()
    }

    #[test]
    fn blur_is_undone_of_steep_and_of_peaked_spectra() {
        let left = |f: f64| 0.6 + 0.4 / (1.0 + (f / 20.0).powi(2));
        let waves = Waves::new(&windows());
        let share = waves.each(|f| left(f).powi(2));
        let targets: [&dyn Fn(f64) -> f64; 3] = [&|_| 1.0, &|f| (f / 100.0).powf(-1.2), &|f| {
            (-(f / 40.0).ln().powi(2)).exp()
        }];
        for power in targets {
            let (sharp, blurred) = (variance(power, &|_| 1.0), variance(power, &left));
            let weights = waves.weights(&blurred, &share);
            for i in 0..sharp.len() {
                let found = blurred[i] / mean(&weights[i], &share);
                let off = found / sharp[i] - 1.0;
                assert!(off.abs() < 0.03, "band {i}: {off}");
            }
        }
    }

    #[test]
    fn bands_without_power_are_numbers() {
        let waves = Waves::new(&windows());
        let share = waves.each(|_| 1.0);
        for variance in [[0.0; 6], [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]] {
            for weights in waves.weights(&variance, &share) {
                assert!((mean(&weights, &share) - 1.0).abs() < 1e-9);
            }
        }
    }
}
