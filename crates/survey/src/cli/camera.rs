//! Options that say which camera took pictures: its encoding and its noise.

use std::path::Path;

use clap::{Args, ValueEnum};
use uw_calib::response::LinearNoise;
use uw_calib::{Encoding, Even, NoiseModel, SensorNoise, Vehicle, VehicleFile};

use super::error::CliError;

/// The camera that took the pictures.
#[derive(Debug, Args)]
pub(super) struct CameraArguments {
    /// The vehicle that took the pictures: a name among assets/vehicles or a file (*.toml). Its encoding and noise serve where they are
    /// not given; its vignetting is taken out of the pictures.
    #[arg(long, value_name = "NAME|FILE")]
    vehicle: Option<String>,
    /// How the camera's counts stand for light: that of --vehicle, else srgb, where it is left out.
    #[arg(long, value_enum)]
    encoding: Option<CurveName>,
    /// Noise of the camera: the variance of the linear signal y in [0, 1] is A·y + B (noise_a and noise_b of scenes and
    /// vehicles), sent through the encoding. Without it and --vehicle the noise is found from differences of neighbouring pixels.
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

/// What is known of the camera.
pub(super) struct Camera {
    /// How counts stand for light.
    pub(super) encoding: Encoding,
    /// Where the noise is taken from.
    pub(super) noise: NoiseModel,
    /// What takes the vehicle's lens out of pictures, where it is known.
    pub(super) even: Option<Even>,
    /// The vehicle, where one was named.
    pub(super) vehicle: Option<Vehicle>,
}

impl CameraArguments {
    /// What the options say.
    ///
    /// # Errors
    /// A vehicle that cannot be used, or noise that is none.
    pub(super) fn camera(&self) -> Result<Camera, CliError> {
        let vehicle = match &self.vehicle {
            None => None,
            Some(name) => {
                let file = VehicleFile::find(name, Path::new(""));
                let wrong = |error| CliError::input(format_args!("--vehicle: {error}"));
                Some(file.map_err(wrong)?.vehicle)
            }
        };
        let of_vehicle = vehicle.as_ref().map(|vehicle| vehicle.encoding);
        let given = self.encoding.map(CurveName::encoding);
        let encoding = given.or(of_vehicle).unwrap_or_default();
        Ok(Camera {
            encoding,
            noise: self.noise(encoding, vehicle.as_ref())?,
            even: (vehicle.as_ref()).and_then(|vehicle| Even::of_vehicle(vehicle, encoding)),
            vehicle,
        })
    }

    fn noise(&self, encoding: Encoding, vehicle: Option<&Vehicle>) -> Result<NoiseModel, CliError> {
        let (a, b) = match (self.noise_a, self.noise_b, vehicle) {
            (Some(a), Some(b), _) => (a, b),
            (.., Some(vehicle)) => (vehicle.noise_a, vehicle.noise_b),
            _ => return Ok(NoiseModel::Picture),
        };
        let noise = SensorNoise::new(encoding, LinearNoise { a, b });
        noise.map(NoiseModel::Sensor).ok_or_else(|| {
            CliError::input(format_args!(
                "--noise-a and --noise-b must be finite and >= 0, got {a} and {b}"
            ))
        })
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
