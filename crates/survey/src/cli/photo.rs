//! Options that say what is done to photographs before they are measured.

use std::path::{Path, PathBuf};

use clap::Args;
use uw_calib::{Encoding, Even, Manifest, Mask, RowKind, Treatment, Undistortion};
use uw_render::scene::Scene;

use super::error::{CliError, note};
use super::scene_file;
use crate::undistort::undistortion;
use uw_calib::vehicle::Vehicle;

/// Share of the picture that may be unseen or masked before that is told.
const FEW: f64 = 0.005;

/// What is done to photographs.
#[derive(Debug, Args)]
pub(super) struct PhotoArguments {
    /// Camera that took the pictures: a scene file whose [camera] has their size, lens (distortion or fisheye) and port. They are measured as the ideal camera
    /// of --vehicle would have taken them, with its width, height and hfov_deg.
    #[arg(long, value_name = "NAME|FILE")]
    camera: Option<PathBuf>,
    /// What of the pictures is not the target, such as parts of the vehicle: polygons (*.toml, uw-mask/1) or a picture whose dark pixels are left
    /// out. Of the pictures as they are shown, before --camera.
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
}

impl PhotoArguments {
    /// What the options say of pictures from `distances_m`.
    ///
    /// # Errors
    /// A file that cannot be used, or a camera without a vehicle.
    pub(super) fn treatment(
        &self,
        (vehicle, even, encoding): (Option<&Vehicle>, Option<Even>, Encoding),
        distances_m: &[f64],
    ) -> Result<Treatment, CliError> {
        let mask = self.mask.as_deref().map(Mask::read).transpose();
        let mask = mask.map_err(CliError::input)?;
        if let Some(mask) = mask.as_ref().filter(|mask| mask.share() > 0.5) {
            let share = 100.0 * mask.share();
            note(format_args!(
                "uw: warning: {}: the mask leaves {share:.0} % of the picture out",
                mask.name
            ));
        }
        Ok(Treatment {
            encoding,
            exposure: None,
            even,
            mask,
            undistortion: self.undistortion(vehicle, distances_m)?,
        })
    }

    fn undistortion(
        &self,
        vehicle: Option<&Vehicle>,
        distances_m: &[f64],
    ) -> Result<Option<Undistortion>, CliError> {
        let Some(file) = &self.camera else {
            return Ok(None);
        };
        let Some(vehicle) = vehicle else {
            return Err(CliError::input(
                "--camera needs --vehicle, whose width, height and hfov_deg are those of the pictures that are made",
            ));
        };
        let scene = Scene::read(&scene_file(file)?)
            .map_err(|error| CliError::input(format_args!("--camera: {error}")))?;
        let way = undistortion(&scene.placed_camera(), vehicle, distances_m);
        let seen = way.far().seen();
        if seen < 0.5 {
            return Err(CliError::input(format_args!(
                "--camera: {}: sees {:.0} % of the vehicle's picture (hfov_deg {}); give the vehicle a smaller field of view",
                file.display(),
                100.0 * seen,
                vehicle.hfov_deg
            )));
        }
        if seen < 1.0 - FEW {
            note(format_args!(
                "uw: warning: {}: the camera does not see {:.0} % of the vehicle's picture (hfov_deg {}); patches of which it sees less than half are left \
                 out",
                file.display(),
                100.0 * (1.0 - seen),
                vehicle.hfov_deg
            ));
        }
        Ok(Some(way))
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

/// Distances of the pictures of a manifest, m, each once; none of one that cannot be read, which others refuse.
pub(super) fn distances_m(manifest: &Path, vehicle: Option<&Vehicle>) -> Vec<f64> {
    let curve = vehicle.and_then(|vehicle| vehicle.level_curve.as_ref());
    let rows = Manifest::parse(manifest, curve).map(|manifest| manifest.rows);
    let distance = |kind: RowKind| match kind {
        RowKind::Depth { .. } => None,
        RowKind::Contrast { distance_m, .. } => Some(distance_m),
    };
    let rows = rows.unwrap_or_default();
    let mut distances_m: Vec<f64> = rows.iter().filter_map(|row| distance(row.kind)).collect();
    distances_m.sort_by(f64::total_cmp);
    distances_m.dedup();
    distances_m
}
