//! From images to calibration profiles: what a camera sees of the water, as numbers.
//!
//! 1. [`stats`]: mean and contrast of one image.
//! 2. [`manifest`]: the list of images of a calibration routine, with depth, distance and lamp level.
//! 3. [`calibrate`]: measurements become a profile.
//! 4. [`profile`]: the profile, its file and its interpolation inside the calibrated range.
//! 5. [`rig`]: the camera, sensor and lamps that profiles and models are made for.
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
pub mod json;
pub mod manifest;
pub mod profile;
pub mod rig;
pub mod stats;

pub use calibrate::{
    CalibrateError, ContrastMeasurement, DepthMeasurement, calibrate_manifest, measure_manifest,
};
pub use manifest::{Manifest, ManifestError, Row, RowKind};
pub use profile::{ContrastSample, DepthSample, Profile, ProfileError, Source};
pub use rig::Rig;
pub use stats::{ImageStats, PatchGrid, PatchStats, StatsError, patch_statistics};
