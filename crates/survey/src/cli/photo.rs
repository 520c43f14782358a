//! Options that say what is done to photographs before they are measured.

use std::path::PathBuf;

use clap::Args;
use uw_calib::vehicle::Vehicle;
use uw_calib::{Encoding, Even, Treatment};

use super::error::{CliError, note};
use crate::treatment::{Photographs, TreatmentError};

/// What is done to photographs.
#[derive(Debug, Args)]
pub(super) struct PhotoArguments {
    /// Camera that took the pictures: a scene file whose [camera] has their size, lens (distortion or fisheye) and port, or a calibration (*.yaml, *.xml) of ROS, OpenCV, Kalibr or Metashape. They are measured as the ideal camera
    /// of --vehicle would have taken them, with its width, height and hfov_deg.
    #[arg(long, value_name = "NAME|FILE")]
    camera: Option<PathBuf>,
    /// What of the pictures is not the target, such as parts of the vehicle: polygons (*.toml, uw-mask/1) or a picture whose dark pixels are left
    /// out. Of the pictures as they are shown, before --camera.
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
}

impl PhotoArguments {
    /// By a camera and a mask.
    pub(super) fn new(camera: Option<PathBuf>, mask: Option<PathBuf>) -> Self {
        Self { camera, mask }
    }

    /// What the options say of pictures from `distances_m`.
    ///
    /// # Errors
    /// A file that cannot be used, or a camera without a vehicle.
    pub(super) fn treatment(
        &self,
        known: (Option<&Vehicle>, Option<Even>, Encoding),
        distances_m: &[f64],
    ) -> Result<Treatment, CliError> {
        let photographs = Photographs {
            camera: self.camera.clone(),
            mask: self.mask.clone(),
        };
        let treatment = photographs.treatment(known, distances_m);
        let (treatment, warnings) = treatment.map_err(|error| match error {
            TreatmentError::NoVehicle => CliError::input(
                "--camera needs --vehicle, whose width, height and hfov_deg are those of the pictures that are made",
            ),
            TreatmentError::Scene(_) | TreatmentError::Unseen { .. } => {
                CliError::input(format_args!("--{error}"))
            }
            TreatmentError::Mask(_) | TreatmentError::Asset(_) => CliError::input(error),
        })?;
        for warning in warnings {
            note(format_args!("uw: warning: {warning}"));
        }
        Ok(treatment)
    }
}

/// To which exposure photographs are brought.
#[derive(Debug, Args)]
pub(super) struct ExposureArguments {
    /// Exposure that the pictures of the target are brought to in linear light: time in seconds · ISO / f-number², as EXIF has it, or in the unit of the manifest's
    /// column `exposure`. Without it that of the shortest.
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    exposure: Option<f64>,
}

impl ExposureArguments {
    /// The exposure, where one is asked for.
    ///
    /// # Errors
    /// It is none.
    pub(super) fn exposure(&self) -> Result<Option<f64>, CliError> {
        match self.exposure {
            Some(e) if !(e > 0.0 && e.is_finite()) => Err(CliError::input(format_args!(
                "--exposure must be finite and above 0, got {e}"
            ))),
            asked => Ok(asked),
        }
    }
}
