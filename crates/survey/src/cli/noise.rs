//! Options that say which noise a camera has.

use clap::{Args, ValueEnum};
use uw_calib::response::LinearNoise;
use uw_calib::{Encoding, NoiseModel, SensorNoise};

use super::error::CliError;

/// The noise of the camera that took the pictures.
#[derive(Debug, Args)]
pub(super) struct NoiseArguments {
    /// Noise of the camera: the variance of the linear signal y in [0, 1] is A·y + B (noise_a and noise_b of scenes and
    /// vehicles), sent through --encoding. Without it the noise is found from differences of neighbouring pixels.
    #[arg(
        long,
        value_name = "A",
        requires = "noise_b",
        allow_hyphen_values = true
    )]
    noise_a: Option<f64>,
    /// See --noise-a.
    #[arg(
        long,
        value_name = "B",
        requires = "noise_a",
        allow_hyphen_values = true
    )]
    noise_b: Option<f64>,
}

impl NoiseArguments {
    /// Where the noise is taken from.
    pub(super) fn model(&self, curve: CurveName) -> Result<NoiseModel, CliError> {
        let (Some(a), Some(b)) = (self.noise_a, self.noise_b) else {
            return Ok(NoiseModel::Picture);
        };
        let noise = SensorNoise::new(curve.encoding(), LinearNoise { a, b });
        noise.map(NoiseModel::Sensor).ok_or_else(|| {
            CliError::input(format_args!(
                "--noise-a and --noise-b must be finite and >= 0, got {a} and {b}"
            ))
        })
    }
}

/// The word for an encoding.
pub(super) fn name_of(encoding: Encoding) -> &'static str {
    match encoding {
        Encoding::Srgb => "srgb",
        Encoding::Linear => "linear",
    }
}

/// The names of the encodings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum CurveName {
    /// sRGB, as cameras write PNG and JPEG files.
    Srgb,
    /// Counts in proportion to light.
    Linear,
}

impl CurveName {
    /// The encoding of that name.
    pub(super) fn encoding(self) -> Encoding {
        match self {
            Self::Srgb => Encoding::Srgb,
            Self::Linear => Encoding::Linear,
        }
    }
}
