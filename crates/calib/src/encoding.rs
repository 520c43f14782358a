//! How a camera's counts stand for light.

use serde::{Deserialize, Serialize};

/// The curve between linear light and the counts that a camera stores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// sRGB (IEC 61966-2-1), as cameras write PNG and JPEG files unless told otherwise.
    #[default]
    Srgb,
    /// Counts in proportion to light.
    Linear,
}

impl Encoding {
    /// Linear light in [0, 1] of 8-bit counts in [0, 255].
    pub fn light(self, counts: f64) -> f64 {
        let code = counts / 255.0;
        match self {
            Self::Linear => code,
            Self::Srgb if code <= 0.040_45 => code / 12.92,
            Self::Srgb => ((code + 0.055) / 1.055).powf(2.4),
        }
    }

    /// 8-bit counts, fractions allowed, of linear light; light above 1 is clipped.
    pub fn counts(self, light: f64) -> f64 {
        let light = light.clamp(0.0, 1.0);
        255.0
            * match self {
                Self::Linear => light,
                Self::Srgb if light <= 0.003_130_8 => 12.92 * light,
                Self::Srgb => 1.055 * light.powf(1.0 / 2.4) - 0.055,
            }
    }

    /// Counts per light at a light: the slope of [`counts`](Self::counts) below the clipping.
    pub fn slope(self, light: f64) -> f64 {
        let light = light.clamp(0.0, 1.0);
        255.0
            * match self {
                Self::Linear => 1.0,
                Self::Srgb if light <= 0.003_130_8 => 12.92,
                Self::Srgb => 1.055 / 2.4 * light.powf(1.0 / 2.4 - 1.0),
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_light_are_inverse_and_the_slope_is_that_of_the_curve() {
        for encoding in [Encoding::Srgb, Encoding::Linear] {
            for counts in [0.0, 3.0, 10.5, 100.0, 255.0] {
                let light = encoding.light(counts);
                assert!((encoding.counts(light) - counts).abs() < 1e-4, "{counts}");
            }
            for light in [1e-3, 0.01, 0.2, 0.9] {
                let step = 1e-6;
                let rise = encoding.counts(light + step) - encoding.counts(light - step);
                assert!((rise / (2.0 * step) / encoding.slope(light) - 1.0).abs() < 1e-5);
            }
        }
        // The middle grey of sRGB.
        assert!((Encoding::Srgb.light(118.0) - 0.181_16).abs() < 1e-4);
    }
}
