//! What the daemon takes from other files: mask and undistortion of pictures; from a vehicle's the camera's noise, encoding and vignetting, and what models, water files and profiles have to fit.

use std::path::Path;

use uw_calib::response::LinearNoise;
use uw_calib::vehicle::VehicleError;
use uw_calib::{
    Even, Mask, MaskError, NoiseModel, SensorNoise, Undistortion, UndistortionError, VehicleFile,
};

use super::Config;

/// Why pictures cannot be treated as `[images]` says.
#[derive(Debug, thiserror::Error)]
pub enum PhotographsError {
    /// The mask.
    #[error("images.mask: {0}")]
    Mask(#[from] MaskError),
    /// The undistortion.
    #[error("images.undistortion: {0}")]
    Undistortion(#[from] UndistortionError),
}

impl Config {
    /// Puts the values of the vehicle's file into the settings; `[images]` goes before them.
    ///
    /// # Errors
    /// A vehicle that is not known, or a file that cannot be used.
    pub fn read_vehicle(&mut self) -> Result<(), VehicleError> {
        let Some(name) = &self.vehicle else {
            return Ok(());
        };
        let vehicle = VehicleFile::find(name, Path::new(""))?.vehicle;
        let settings = &mut self.settings;
        settings.vehicle = vehicle.rig(Some(vehicle.exposure));
        settings.treatment.even = Even::of_vehicle(&vehicle, vehicle.encoding);
        settings.treatment.encoding = vehicle.encoding;
        settings.level_curve = vehicle.level_curve;
        if settings.noise == NoiseModel::Picture {
            let noise = LinearNoise {
                a: vehicle.noise_a,
                b: vehicle.noise_b,
            };
            let sensor = SensorNoise::new(vehicle.encoding, noise);
            settings.noise = sensor.map_or(NoiseModel::Picture, NoiseModel::Sensor);
        }
        Ok(())
    }

    /// Reads the files of `[images]` that say what is done to pictures: mask and undistortion.
    ///
    /// # Errors
    /// A file that cannot be used.
    pub fn read_photographs(&mut self) -> Result<(), PhotographsError> {
        let mask = self.mask.as_deref().map(Mask::read).transpose()?;
        let undistortion = self.undistortion.as_deref().map(Undistortion::read);
        let undistortion = undistortion.transpose()?;
        self.settings.photographed(mask, undistortion);
        Ok(())
    }
}
