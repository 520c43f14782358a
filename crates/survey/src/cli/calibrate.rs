//! `uw calibrate`: pictures of a calibration routine -> profile.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use uw_calib::{Daylight, Encoding, RoutineOptions, check_manifest, from_manifest};

use super::error::{CliError, note};
use super::interrupt::cancel_flag;
use super::output;
use crate::assets::assets_dir;
use crate::environment::{Target, WaterBody, WaterKind};
use crate::measure::Quality;
use crate::routine::{UP_DEPTHS_M, UP_SAMPLES, look_up, measure_depths};
use crate::scenery::textures::Pattern;
use crate::vehicle::Vehicle;

/// Arguments of `uw calibrate`.
#[derive(Debug, Args)]
#[command(after_help = NEEDS)]
pub(super) struct CalibrateArguments {
    /// CSV table of the pictures: file,kind,depth_m,distance_m,light_pct with kind `depth` or `contrast`.
    manifest: PathBuf,
    /// Profile to write (uw-profile/1).
    #[arg(short, long)]
    output: PathBuf,
    /// Lamp level of K_c on, percent; by default that with pictures from the most distances. Pictures at other levels are
    /// brought there in linear light.
    #[arg(long, value_name = "PCT")]
    light_pct: Option<f64>,
    /// How the camera's counts stand for light; needed where lamp levels are converted or K_z comes from pictures of the
    /// target.
    #[arg(long, value_enum, default_value_t = CurveName::Srgb)]
    encoding: CurveName,
    /// Without pictures that look up: K_z of this Jerlov type (or mixture such as IB-II@0.4), rendered.
    #[arg(long, value_name = "TYPE", conflicts_with = "kd_per_m")]
    jerlov: Option<String>,
    /// Backscatter fraction of that water.
    #[arg(long, default_value_t = 0.0183, requires = "jerlov")]
    backscatter_fraction: f64,
    /// Without pictures that look up: K_z from the diffuse attenuation of daylight, 1/m, red, green and blue.
    #[arg(long, value_name = "R,G,B", value_delimiter = ',')]
    kd_per_m: Option<Vec<f64>>,
    /// Shallowest and deepest depth of a profile from --kd-per-m, m.
    #[arg(long, value_name = "MIN,MAX", value_delimiter = ',', requires = "kd_per_m", default_values_t = [0.5, 6.0])]
    depths_m: Vec<f64>,
}

const NEEDS: &str = "\
What is needed, with one exposure for all pictures of a kind:
  kind contrast, light_pct 0      the target from several distances with the lamps off: K_c off
  kind contrast, light_pct > 0    the same with the lamps on, at one level or several: K_c on
  kind depth                      straight up from several depths: K_z, how daylight falls.
Without pictures that look up, K_z comes from pictures of the target with the lamps off at several depths (depth_m given, one
distance, at least 1 m apart), from --jerlov or from --kd-per-m. The profile's note then begins with \"approximate:\".";

/// The names of the encodings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum CurveName {
    /// sRGB, as cameras write PNG and JPEG files.
    Srgb,
    /// Counts in proportion to light.
    Linear,
}

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
        let daylight_given = self.jerlov.is_some() || self.kd_per_m.is_some();
        check_manifest(&self.manifest, daylight_given).map_err(CliError::input)?;
        let options = RoutineOptions {
            light_pct: self.light_pct,
            encoding: match self.encoding {
                CurveName::Srgb => Encoding::Srgb,
                CurveName::Linear => Encoding::Linear,
            },
            daylight: self.daylight()?,
        };
        let made = from_manifest(&self.manifest, made_by, &options).map_err(CliError::input)?;
        for warning in &made.warnings {
            note(format_args!("uw: warning: {warning}"));
        }
        made.profile.write(&self.output).map_err(CliError::failed)
    }

    fn daylight(&self) -> Result<Daylight, CliError> {
        if let Some(kd) = &self.kd_per_m {
            return self.attenuation(kd);
        }
        let Some(jerlov) = &self.jerlov else {
            return Ok(Daylight::Pictures);
        };
        let jerlov: WaterKind = jerlov
            .parse()
            .map_err(|e| CliError::input(format_args!("--jerlov: {e}")))?;
        let water = WaterBody {
            jerlov,
            backscatter_fraction: self.backscatter_fraction,
        };
        let vehicle = Vehicle::default();
        let assets = assets_dir().map_err(CliError::input)?;
        let target = Target::read(Pattern::HullRed, &assets).map_err(CliError::input)?;
        let quality = Quality {
            samples_per_half: UP_SAMPLES,
            seed: 1,
            threads: None,
        };
        let cancel = cancel_flag()?;
        let (sensor, views) = look_up(&vehicle, &water, &target, &UP_DEPTHS_M, quality, &cancel)
            .map_err(
                |e| match cancel.load(std::sync::atomic::Ordering::Relaxed) {
                    true => CliError::Interrupted("interrupted; nothing was written".into()),
                    false => CliError::input(e),
                },
            )?;
        Ok(Daylight::Measured {
            depth: measure_depths(&sensor, &views),
            what: format!(
                "rendered for Jerlov {jerlov} water at a backscatter fraction of {}, not measured",
                self.backscatter_fraction
            ),
        })
    }

    fn attenuation(&self, kd: &[f64]) -> Result<Daylight, CliError> {
        let good = |v: &f64| v.is_finite() && *v >= 0.0;
        let ([r, g, b], true) = (kd, kd.iter().all(good)) else {
            return Err(CliError::input(format_args!(
                "--kd-per-m must be three numbers >= 0 (1/m, red, green, blue), got {kd:?}"
            )));
        };
        match self.depths_m[..] {
            [min, max] if good(&min) && max.is_finite() && min < max => Ok(Daylight::Attenuation {
                k_d_per_m: [*r, *g, *b],
                depths_m: [min, max],
            }),
            _ => Err(CliError::input(format_args!(
                "--depths-m must be two depths >= 0, the shallower first (m), got {:?}",
                self.depths_m
            ))),
        }
    }
}
