//! What is done to photographs before they are measured, from the files that say it.

use std::path::{Path, PathBuf};

use uw_assets::AssetError;
use uw_calib::vehicle::Vehicle;
use uw_calib::{Encoding, Even, Manifest, Mask, MaskError, Rig, RowKind, Treatment, Undistortion};
use uw_render::scene::{Scene, SceneError};

use crate::undistort::undistortion;

/// Share of the picture that may be unseen or masked before that is told.
const FEW: f64 = 0.005;
/// Share of the vehicle's picture that a camera has to see.
const LEAST_SEEN: f64 = 0.5;

/// Files about photographs.
#[derive(Clone, Debug, Default)]
pub struct Photographs {
    /// The camera that took them: a scene file, or the name of a shipped one, whose `[camera]` has their size, lens and port; or a calibration (`*.yaml`, `*.xml`).
    pub camera: Option<PathBuf>,
    /// What of them is not the target: polygons (`uw-mask/1`) or a picture.
    pub mask: Option<PathBuf>,
}

/// Pictures cannot be treated so. Texts name `camera` and `vehicle` as arguments.
#[derive(Debug, thiserror::Error)]
pub enum TreatmentError {
    /// The mask cannot be read.
    #[error(transparent)]
    Mask(#[from] MaskError),
    /// There is no such shipped scene.
    #[error(transparent)]
    Asset(#[from] AssetError),
    /// The camera's scene cannot be read.
    #[error("camera: {0}")]
    Scene(#[from] SceneError),
    /// A camera without a vehicle.
    #[error(
        "camera needs vehicle, whose width, height and hfov_deg are those of the pictures that are made"
    )]
    NoVehicle,
    /// The camera sees less than half of the vehicle's picture.
    #[error(
        "camera: {}: sees {:.0} % of the vehicle's picture (hfov_deg {hfov_deg}); give the vehicle a smaller field of view",
        file.display(), 100.0 * seen
    )]
    Unseen {
        /// The camera's scene.
        file: PathBuf,
        /// Share that it sees.
        seen: f64,
        /// The vehicle's horizontal field of view, degrees.
        hfov_deg: f64,
    },
}

impl Photographs {
    /// What is done to pictures from `distances_m`, and what should be known of it, a sentence each.
    ///
    /// # Errors
    /// A file that cannot be used, or a camera without a vehicle.
    pub fn treatment(
        &self,
        (vehicle, even, encoding): (Option<&Vehicle>, Option<Even>, Encoding),
        distances_m: &[f64],
    ) -> Result<(Treatment, Vec<String>), TreatmentError> {
        let mask = self.mask.as_deref().map(Mask::read).transpose()?;
        let mut warnings = Vec::new();
        if let Some(mask) = mask.as_ref().filter(|mask| mask.share() > 0.5) {
            let share = 100.0 * mask.share();
            warnings.push(format!(
                "{}: the mask leaves {share:.0} % of the picture out",
                mask.name
            ));
        }
        let undistortion = match &self.camera {
            Some(file) => Some(way(file, vehicle, distances_m, &mut warnings)?),
            None => None,
        };
        let treatment = Treatment {
            encoding,
            exposure: None,
            even,
            mask,
            undistortion,
        };
        Ok((treatment, warnings))
    }
}

/// The ideal camera of a rig, as far as it states it; the rest is the default vehicle's.
pub fn ideal_camera(rig: &Rig) -> Option<Vehicle> {
    let [width, height] = rig.size_px()?;
    Some(Vehicle {
        width: width as u32,
        height: height as u32,
        hfov_deg: rig.hfov_deg?,
        ..Vehicle::default()
    })
}

/// The way from the camera's pictures to the vehicle's.
fn way(
    file: &Path,
    vehicle: Option<&Vehicle>,
    distances_m: &[f64],
    warnings: &mut Vec<String>,
) -> Result<Undistortion, TreatmentError> {
    let vehicle = vehicle.ok_or(TreatmentError::NoVehicle)?;
    let scene = Scene::read(&uw_assets::ALL.named(file, "scenes", "toml")?)?;
    let way = undistortion(&scene.placed_camera(), vehicle, distances_m);
    let (seen, hfov_deg) = (way.far().seen(), vehicle.hfov_deg);
    if seen < LEAST_SEEN {
        let file = file.to_path_buf();
        return Err(TreatmentError::Unseen {
            file,
            seen,
            hfov_deg,
        });
    }
    if seen < 1.0 - FEW {
        warnings.push(format!(
            "{}: the camera does not see {:.0} % of the vehicle's picture (hfov_deg {hfov_deg}); patches of which it sees less than half are left \
             out",
            file.display(),
            100.0 * (1.0 - seen),
        ));
    }
    Ok(way)
}

/// Distances of the pictures of a manifest, m, each once; none of one that cannot be read, which others refuse.
pub fn distances_m(manifest: &Path, vehicle: Option<&Vehicle>) -> Vec<f64> {
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
