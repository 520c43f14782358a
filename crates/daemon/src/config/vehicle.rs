//! What the daemon takes from a vehicle's file: the camera's noise, encoding and vignetting, and what models, water files and profiles have to fit.

use std::path::Path;

use uw_calib::response::LinearNoise;
use uw_calib::vehicle::VehicleError;
use uw_calib::{Even, NoiseModel, SensorNoise, VehicleFile};

use super::Config;

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
        settings.treatment.encoding = self.encoding.unwrap_or(vehicle.encoding);
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
}
