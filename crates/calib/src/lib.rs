//! From images to calibration profiles: what a camera sees of the water, as numbers.
//!
//! 1. [`stats`]: mean and contrast of one image; [`detail`]: its contrast without [`noise`], of which [`response`] is the closed
//!    form.
//! 2. [`manifest`]: the list of images of a calibration routine, with depth, distance and lamp level; [`photo`] makes them ready.
//! 3. [`calibrate`]: measurements become a profile; [`routine`]: the pictures of a manifest do, several lamp levels brought to
//!    one (`levels`) and K_z from elsewhere where no picture looks up (`daylight`); `coverage` says what is missing, `doubts` which
//!    pictures are noise or clipped.
//! 4. [`profile`]: the profile, its file and its interpolation inside the calibrated range.
//! 5. [`rig`]: the camera, sensor and lamps that profiles and models are made for; [`vehicle`]: those of a user, from a file.
//!
//! [`json`] reads JSON field by field with errors that name the field; the guidance crate uses it too.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let profile = uw_calib::calibrate_manifest("routine.csv".as_ref(), "uw calibrate 0.1.0")?;
//! profile.write("profile.json".as_ref())?;
//! let k_z = profile.k_z(2.5)?; // at 2.5 m depth, per channel
//! # Ok(()) }
//! ```

pub mod calibrate;
mod coverage;
mod daylight;
pub mod detail;
mod doubts;
pub mod even;
pub mod json;
mod levels;
pub mod manifest;
pub mod noise;
#[cfg(test)]
mod normal;
pub mod photo;
pub mod picture;
mod planes;
pub mod processing;
pub mod profile;
pub mod response;
pub mod rig;
pub mod routine;
pub mod stats;
pub mod vehicle;

pub use calibrate::{
    CalibrateError, ContrastMeasurement, DepthMeasurement, relative_to_shallowest,
};
pub use detail::Detail;
pub use even::Even;
pub use manifest::{Manifest, ManifestError, Row, RowKind};
pub use noise::{NoiseModel, NoiseSource, SensorNoise};
pub use photo::{
    Mask, MaskError, Opened, Resampling, Treatment, Undistortion, UndistortionError, View,
};
pub use processing::Processing;
pub use profile::{
    ContrastSample, Corrected, CorrectedSample, DepthSample, Profile, ProfileError, Source,
};
pub use rig::Rig;
pub use routine::{
    Calibration, Daylight, DaylightFit, RoutineOptions, calibrate_manifest, check_manifest,
    fit_daylight, from_manifest,
};
pub use stats::{ImageStats, Measured, PatchGrid, PatchStats, StatsError, patch_statistics};
pub use uw_media::Encoding;
pub use vehicle::{Vehicle, VehicleFile};
