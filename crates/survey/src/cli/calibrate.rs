//! `uw calibrate`: pictures of a calibration routine -> profile.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use uw_calib::{Daylight, RoutineOptions, Treatment, from_manifest};

use super::camera::CameraArguments;
use super::error::{CliError, note};
use super::interrupt::cancel_flag;
use super::output;
use super::photo::{ExposureArguments, PhotoArguments};
use crate::treatment::distances_m;
use uw_twin::daylight::{Known, attenuation, stand_in};

/// Arguments of `uw calibrate`.
#[derive(Debug, Args)]
#[command(after_help = NEEDS)]
pub(super) struct CalibrateArguments {
    /// CSV table of the pictures: file,kind,depth_m,distance_m,light_pct with kind `depth` or `contrast`; a file may be a folder of frames.
    manifest: PathBuf,
    /// Profile to write (uw-profile/1).
    #[arg(short, long)]
    output: PathBuf,
    /// Lamp level of K_c on, percent; by default that with pictures from the most distances. Pictures at other levels are
    /// brought there in linear light.
    #[arg(long, value_name = "PCT")]
    light_pct: Option<f64>,
    /// Without pictures that look up: K_z of this Jerlov type (or mixture such as IB-II@0.4), rendered.
    #[arg(long, value_name = "TYPE", conflicts_with = "kd_per_m")]
    jerlov: Option<String>,
    /// Backscatter fraction of the water that is rendered where no picture looks up.
    #[arg(long, default_value_t = 0.0183)]
    backscatter_fraction: f64,
    /// Without pictures that look up: K_z of the water on Jerlov's scale with this diffuse attenuation of daylight, 1/m, red,
    /// green and blue.
    #[arg(long, value_name = "R,G,B", value_delimiter = ',')]
    kd_per_m: Option<Vec<f64>>,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    photo: PhotoArguments,
    #[command(flatten)]
    exposure: ExposureArguments,
}

const NEEDS: &str = "\
What is needed, with one exposure for all pictures of a kind (others are brought to it by EXIF or a column `exposure`):
  kind contrast, light_pct 0      the target from several distances with the lamps off: K_c off
  kind contrast, light_pct > 0    the same with the lamps on, at one level or several: K_c on
  kind depth                      straight up from several depths: K_z, how daylight falls.
Without pictures that look up, K_z comes from pictures of the target with the lamps off at several depths (depth_m given, one
distance, at least 1 m apart), from --kd-per-m or from --jerlov: it is rendered for the water on Jerlov's scale whose daylight
falls alike. The profile's note then begins with \"approximate:\".";

impl CalibrateArguments {
    /// Measures the pictures and writes the profile.
    pub(super) fn run(&self) -> Result<(), CliError> {
        output::check_writable(&self.output)?;
        let made_by = concat!("uw calibrate ", env!("CARGO_PKG_VERSION"));
        if let Some(level) = self.light_pct
            && !(level > 0.0 && level <= 100.0)
        {
            return Err(CliError::input(format_args!(
                "--light-pct must be above 0 and at most 100, got {level}"
            )));
        }
        let camera = self.camera.camera()?;
        let vehicle = camera.vehicle.as_ref();
        let distances_m = distances_m(&self.manifest, vehicle);
        let known = (vehicle, camera.even, camera.encoding);
        let mut options = RoutineOptions {
            light_pct: self.light_pct,
            treatment: Treatment {
                exposure: self.exposure.exposure()?,
                ..self.photo.treatment(known, &distances_m)?
            },
            noise: camera.noise,
            levels: vehicle.and_then(|vehicle| vehicle.level_curve.clone()),
            rig: vehicle
                .map(|vehicle| vehicle.rig(Some(vehicle.exposure)))
                .unwrap_or_default(),
            daylight: Daylight::Pictures,
        };
        options.daylight = self.daylight(&options)?;
        let made = from_manifest(&self.manifest, made_by, &options).map_err(CliError::input)?;
        for warning in &made.warnings {
            note(format_args!("uw: warning: {warning}"));
        }
        made.profile.write(&self.output).map_err(CliError::failed)
    }

    /// Where K_z comes from.
    fn daylight(&self, options: &RoutineOptions) -> Result<Daylight, CliError> {
        let known = match (&self.jerlov, &self.kd_per_m) {
            (Some(jerlov), _) => Known::Jerlov(
                jerlov
                    .parse()
                    .map_err(|e| CliError::input(format_args!("--jerlov: {e}")))?,
            ),
            (None, Some(k_d)) => Known::Attenuation(
                attenuation(k_d).map_err(|e| CliError::input(format_args!("--kd-per-m {e}")))?,
            ),
            (None, None) => Known::Nothing,
        };
        let stand = stand_in(&self.manifest, options, known).map_err(CliError::input)?;
        let Some(stand) = stand else {
            return Ok(Daylight::Pictures);
        };
        let cancel = cancel_flag()?;
        let rendered = stand.render(self.backscatter_fraction, &cancel);
        rendered.map_err(|e| match cancel.load(Ordering::Relaxed) {
            true => CliError::Interrupted("interrupted; nothing was written".into()),
            false => CliError::input(e),
        })
    }
}
