//! What the vehicle knows at the moment it asks.

use uw_calib::json::FieldError;
use uw_calib::{Detail, Processing};

/// Distance, depth, lamp level and the statistics of the current image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Depth below the surface, m, finite and >= 0.
    pub depth_m: f64,
    /// Distance to the target along the optical axis, m, finite and > 0.
    pub distance_m: f64,
    /// Lamp level, percent of full intensity, in [0, 100].
    pub light_pct: f64,
    /// Mean of the image per channel, 8-bit counts, in [0, 255].
    pub mean: [f64; 3],
    /// Contrast of the image per channel (mean over patches of the standard deviation, as in
    /// [`uw_calib::stats`]), 8-bit counts, in [0, 255].
    pub std: [f64; 3],
    /// What of the picture is detail and what is clipped, where it is known. Noise counts in [`std`](Self::std), as networks were
    /// trained on it.
    pub quality: Option<Quality>,
}

/// What of a picture is detail, and what is clipped ([`uw_calib::detail`]), per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Contrast without the sensor's noise, 8-bit counts, in [-255, 255]; near 0 it may be a little below.
    pub std_corrected: [f64; 3],
    /// What noise alone stays below, 8-bit counts, in [0, 255].
    pub noise_floor: [f64; 3],
    /// Share of the pixels at full scale, in [0, 1].
    pub saturated: [f64; 3],
    /// What was done to the picture before it was stored, as far as its file shows it.
    pub processing: Processing,
}

impl Quality {
    /// Of a measured picture.
    pub fn of(detail: &Detail, processing: Processing) -> Self {
        Self {
            std_corrected: detail.contrast,
            noise_floor: detail.floor,
            saturated: detail.saturated,
            processing,
        }
    }

    /// Which channels show no more than noise.
    pub fn at_floor(&self) -> [bool; 3] {
        std::array::from_fn(|k| self.std_corrected[k] <= self.noise_floor[k])
    }

    /// Refuses values that no picture has.
    pub fn check(&self) -> Result<(), FieldError> {
        let fields = [
            (
                "std_corrected",
                self.std_corrected,
                -255.0..=255.0,
                "from -255 to 255 8-bit counts",
            ),
            (
                "noise_floor",
                self.noise_floor,
                0.0..=255.0,
                "from 0 to 255 8-bit counts",
            ),
            (
                "saturated",
                self.saturated,
                0.0..=1.0,
                "from 0 to 1, a share of the pixels",
            ),
        ];
        for (name, values, range, expected) in fields {
            if let Some(k) = values.iter().position(|v| !range.contains(v)) {
                let field = format!("{name}[{k}]");
                return Err(FieldError::out_of_range(field, expected, values[k]));
            }
        }
        Ok(())
    }
}

/// Darkest and brightest mean of a picture that shows anything, 8-bit counts: the noise of a sensor in the dark already
/// has more, and a picture with all channels beyond is black or saturated.
const SHOWING_COUNTS: [f64; 2] = [1.0, 254.0];
/// Contrast below which all channels hold neither detail nor noise, 8-bit counts: a frozen or missing picture.
const BLANK_COUNTS: f64 = 0.01;
/// Least share of a picture that lies in the patches of its contrast; the mean is that of the whole picture.
const PATCHED_SHARE: f64 = 0.98;
/// Rounding of a mean on its way here, 8-bit counts.
const ROUNDED_COUNTS: f64 = 0.05;

impl Observation {
    /// Refuses values that no vehicle and no image can have. Whether they are calibrated is another question.
    pub fn check(&self) -> Result<(), FieldError> {
        let depth_ok = self.depth_m.is_finite() && self.depth_m >= 0.0;
        let distance_ok = self.distance_m.is_finite() && self.distance_m > 0.0;
        let light_ok = (0.0..=100.0).contains(&self.light_pct);
        if !depth_ok {
            return Err(FieldError::out_of_range(
                "depth_m",
                "finite and >= 0 m",
                self.depth_m,
            ));
        }
        if !distance_ok {
            return Err(FieldError::out_of_range(
                "distance_m",
                "finite and > 0 m",
                self.distance_m,
            ));
        }
        if !light_ok {
            return Err(FieldError::out_of_range(
                "light_pct",
                "from 0 to 100 percent",
                self.light_pct,
            ));
        }
        for (name, values) in [("mean", self.mean), ("std", self.std)] {
            if let Some(k) = values.iter().position(|v| !(0.0..=255.0).contains(v)) {
                let field = format!("{name}[{k}]");
                return Err(FieldError::out_of_range(
                    field,
                    "from 0 to 255 8-bit counts",
                    values[k],
                ));
            }
        }
        self.quality.as_ref().map_or(Ok(()), Quality::check)?;
        self.check_picture()
    }

    /// Refuses black, saturated and blank pictures, and deviations that no picture of that mean can have.
    fn check_picture(&self) -> Result<(), FieldError> {
        let [dark, bright] = SHOWING_COUNTS;
        let refuse = |field: &str, expected: String, got: &[f64; 3]| {
            Err(FieldError::out_of_range(
                field,
                expected,
                got.map(|value| value.to_string()).join(" "),
            ))
        };
        if self.mean.iter().all(|&m| m < dark) {
            let expected = format!("at least {dark} 8-bit count in some channel (black frame)");
            return refuse("mean", expected, &self.mean);
        }
        if self.mean.iter().all(|&m| m > bright) {
            let expected =
                format!("at most {bright} 8-bit counts in some channel (saturated frame)");
            return refuse("mean", expected, &self.mean);
        }
        if self.std.iter().all(|&s| s < BLANK_COUNTS) {
            let expected =
                format!("at least {BLANK_COUNTS} 8-bit counts in some channel (blank frame)");
            return refuse("std", expected, &self.std);
        }
        for (k, (&mean, &std)) in self.mean.iter().zip(&self.std).enumerate() {
            let most = largest_deviation(mean);
            if std > most {
                let expected = format!(
                    "at most {most:.1} 8-bit counts with a mean of {mean} (no picture deviates more than sqrt(m (255 - m)))"
                );
                return Err(FieldError::out_of_range(format!("std[{k}]"), expected, std));
            }
        }
        Ok(())
    }
}

/// The largest mean over patches of their deviations that a picture can have, 8-bit counts: sqrt(m (255 - m)) with the
/// mean m of the patches nearest to the middle that the picture's mean allows.
fn largest_deviation(mean: f64) -> f64 {
    let outside = 1.0 - PATCHED_SHARE;
    let least = (mean - 255.0 * outside) / PATCHED_SHARE - ROUNDED_COUNTS;
    let most = mean / PATCHED_SHARE + ROUNDED_COUNTS;
    let m = 127.5_f64.clamp(least.max(0.0), most.min(255.0));
    (m * (255.0 - m)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Observation = Observation {
        depth_m: 3.0,
        distance_m: 1.0,
        light_pct: 20.0,
        mean: [41.0, 88.0, 79.0],
        std: [4.1, 7.7, 6.2],
        quality: None,
    };

    #[test]
    fn impossible_values_are_named() {
        assert_eq!(GOOD.check(), Ok(()));
        let cases = [
            (
                Observation {
                    depth_m: f64::NAN,
                    ..GOOD
                },
                "depth_m",
            ),
            (
                Observation {
                    distance_m: 0.0,
                    ..GOOD
                },
                "distance_m",
            ),
            (
                Observation {
                    light_pct: 100.1,
                    ..GOOD
                },
                "light_pct",
            ),
            (
                Observation {
                    mean: [0.0, 255.5, 0.0],
                    ..GOOD
                },
                "mean[1]",
            ),
            (
                Observation {
                    std: [0.0, 1.0, f64::NAN],
                    ..GOOD
                },
                "std[2]",
            ),
        ];
        for (observation, field) in cases {
            assert_eq!(observation.check().unwrap_err().field, field);
        }
    }

    #[test]
    fn frames_that_show_nothing_are_refused_dark_ones_are_not() {
        let picture = |mean: [f64; 3], std: [f64; 3]| Observation { mean, std, ..GOOD }.check();
        let cases = [
            ([0.0; 3], [0.0; 3], "black frame"),
            ([0.3, 0.4, 0.9], [0.2; 3], "black frame"),
            ([255.0; 3], [0.0; 3], "saturated frame"),
            ([254.5; 3], [1.0; 3], "saturated frame"),
            ([16.0, 128.0, 128.0], [0.0; 3], "blank frame"),
        ];
        for (mean, std, told) in cases {
            let message = picture(mean, std).unwrap_err().to_string();
            assert!(message.contains(told), "{message}");
        }
        // A red channel that water has swallowed, and the noise of a sensor in the dark.
        assert_eq!(picture([0.0, 20.0, 30.0], [0.0, 2.0, 3.0]), Ok(()));
        assert_eq!(picture([1.4; 3], [1.9; 3]), Ok(()));
    }

    #[test]
    fn deviations_that_no_picture_can_have_are_refused() {
        let with = |mean: f64, std: f64| {
            let observation = Observation {
                mean: [100.0, mean, 100.0],
                std: [5.0, std, 5.0],
                ..GOOD
            };
            observation.check().map_err(|error| error.to_string())
        };
        let message = with(250.0, 100.0).unwrap_err();
        assert!(
            message.starts_with("std[1] must be at most 35") && message.contains("got 100"),
            "{message}"
        );
        for (mean, std) in [(0.0, 5.0), (255.0, 5.0), (127.5, 128.0), (20.0, 75.0)] {
            assert!(with(mean, std).is_err(), "{mean} {std}");
        }
        // Half black, half white patches, and a mean that was rounded to nothing.
        for (mean, std) in [(127.5, 127.5), (250.0, 35.3), (5.0, 35.3), (0.0, 1.0)] {
            assert_eq!(with(mean, std), Ok(()), "{mean} {std}");
        }
    }
}
