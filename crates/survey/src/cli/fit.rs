//! `uw fit`: water and lamps from the pictures of a calibration.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::Args;
use uw_calib::response::LinearNoise;
use uw_calib::{Encoding, Manifest, NoiseModel, SensorNoise, Treatment, processing};
use uw_guidance::physics::WaterFile;

use super::camera::CurveName;
use super::error::{CliError, note};
use super::interrupt::cancel_flag;
use super::output;
use super::photo::{ExposureArguments, PhotoArguments};
use super::progress::ProgressDisplay;
use crate::fit::{self, Fit, FitError, Fitted, Options, WaterError, fit, water_file};
use crate::treatment::distances_m;
use uw_calib::vehicle::{Vehicle, VehicleFile};

/// Arguments of `uw fit`.
#[derive(Debug, Args)]
#[command(after_help = NEEDS)]
pub(super) struct FitArguments {
    /// CSV table of the pictures, as of `uw calibrate`: file,kind,depth_m,distance_m,light_pct.
    manifest: PathBuf,
    /// Vehicle that took them: a name among assets/vehicles or a file (*.toml).
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    vehicle: String,
    #[command(flatten)]
    photo: PhotoArguments,
    #[command(flatten)]
    exposure: ExposureArguments,
    /// Water file to write (uw-water/1).
    #[arg(short, long)]
    output: PathBuf,
    /// Folder for a report: plots of what was measured and fitted.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// How the camera's counts stand for light, where the vehicle's file is not to be asked.
    #[arg(long, value_enum)]
    encoding: Option<CurveName>,
    /// There is no daylight (night, or deep): pictures with the lamps on need none without, and the water file holds at any depth, without
    /// daylight.
    #[arg(long)]
    dark: bool,
    /// The vehicle looks down at the bottom rather than ahead at a wall.
    #[arg(long)]
    bottom: bool,
    /// The water is between two neighbouring ones of Jerlov's types: one number instead of six.
    #[arg(long)]
    jerlov: bool,
    /// Depths that the water file is for besides those of the pictures, m, such as 1,3,6; without them a metre around.
    #[arg(long, value_delimiter = ',')]
    depths_m: Vec<f64>,
    /// Backscatter fraction that is expected.
    #[arg(long, default_value_t = Options::default().backscatter_fraction)]
    backscatter_fraction: f64,
    /// How well it is expected, as a relative error: 0.6 for waters of which nothing is known.
    #[arg(long, default_value_t = Options::default().backscatter_error)]
    backscatter_error: f64,
    /// How well the vehicle's file knows its lamps' intensity times exposure, as a relative error.
    #[arg(long, default_value_t = Options::default().gain_error)]
    gain_error: f64,
    /// Paths per distance of the fit, in thousands.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(4..=1024))]
    kilo_paths: u32,
    /// Paths per view and source of the tables, in thousands.
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(8..=8192))]
    table_kilo_paths: u32,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

const NEEDS: &str = "\
What is needed, with one exposure (others are brought to it by EXIF or a column `exposure`), gain and white balance for all pictures: the same spot of a flat target in the middle, square on, from
three distances or more, the farthest at least 1.8 times as far as the nearest; from each a picture with the lamps on (light_pct > 0) and
one with the lamps off. Pictures that look up are compared in the report. docs/fit.md says which pictures tell what.";

impl FitArguments {
    /// Fits the water and writes its file, and the report.
    pub(super) fn run(&self) -> Result<(), CliError> {
        output::check_writable(&self.output)?;
        let here = Path::new("");
        let vehicle = VehicleFile::find(&self.vehicle, here).map_err(CliError::input)?;
        let options = self.options(&vehicle.vehicle)?;
        self.warn_of_processing(&vehicle.vehicle, options.encoding);
        let cancel = cancel_flag()?;
        let display = ProgressDisplay::start(false, true);
        let progress = |done: usize, all: usize| {
            display.update(Some(done as f64 / all as f64), || "fit".to_owned());
            !cancel.load(Ordering::Relaxed)
        };
        let found = fit(&self.manifest, &vehicle.vehicle, &options, &progress);
        display.finish();
        let found = found.map_err(|error| match error {
            FitError::Interrupted => interrupted(),
            other => CliError::input(other),
        })?;
        tell(&found);
        if let Some(folder) = &self.report {
            let depths =
                fit::depths(&found, &vehicle.vehicle, &options).map_err(CliError::failed)?;
            fit::report(&found, &depths, folder).map_err(CliError::failed)?;
        }
        let of_group = 1024 * self.table_kilo_paths / 8;
        let made_by = concat!("uw fit ", env!("CARGO_PKG_VERSION"));
        let display = ProgressDisplay::start(false, true);
        let goes_on = |share: f64| {
            display.update(Some(share), || "tables of this water".to_owned());
            !cancel.load(Ordering::Relaxed)
        };
        let of = (of_group, made_by);
        let file = water_file(&found, &vehicle.vehicle, &options, of, goes_on);
        display.finish();
        let file = file.map_err(|error| match error {
            WaterError::Interrupted => interrupted(),
            other => CliError::failed(other),
        })?;
        write(&file, &self.output)
    }

    /// Tells of pictures that were compressed or denoised before they were stored.
    fn warn_of_processing(&self, vehicle: &Vehicle, encoding: Encoding) {
        let noise = LinearNoise {
            a: vehicle.noise_a,
            b: vehicle.noise_b,
        };
        let sensor = SensorNoise::new(encoding, noise).map(NoiseModel::Sensor);
        // A manifest that cannot be read is the fit's to refuse.
        let manifest = Manifest::parse(&self.manifest, vehicle.level_curve.as_ref());
        if let (Ok(manifest), Some(sensor)) = (manifest, sensor) {
            for warning in processing::warnings_of(&manifest, &sensor) {
                note(format_args!("uw: warning: {warning}"));
            }
        }
    }

    fn options(&self, vehicle: &Vehicle) -> Result<Options, CliError> {
        let encoding = self.encoding.map_or(vehicle.encoding, CurveName::encoding);
        let distances_m = distances_m(&self.manifest, Some(vehicle));
        let known = (Some(vehicle), None, encoding);
        let Treatment {
            mask, undistortion, ..
        } = self.photo.treatment(known, &distances_m)?;
        let options = Options {
            encoding,
            exposure: self.exposure.exposure()?,
            mask,
            undistortion,
            dark: self.dark,
            down: self.bottom,
            backscatter_fraction: self.backscatter_fraction,
            backscatter_error: self.backscatter_error,
            gain_error: self.gain_error,
            jerlov: self.jerlov,
            depths_m: self.depths_m.clone(),
            paths: 1024 * self.kilo_paths as usize,
            seed: self.seed,
        };
        match options.wrong() {
            Some((field, wrong)) => {
                let option = field.replace('_', "-");
                Err(CliError::input(format_args!("--{option} {wrong}")))
            }
            None => Ok(options),
        }
    }
}

fn interrupted() -> CliError {
    CliError::Interrupted("interrupted; nothing was written".to_owned())
}

fn write(file: &WaterFile, to: &Path) -> Result<(), CliError> {
    output::to_file(to, |out| write!(out, "{}", file.to_json()))
}

/// What was found, for people.
fn tell(found: &Fit) {
    let percent = |fitted: &Fitted| 100.0 * fitted.relative_error;
    let triple = |what: &str, unit: &str, of: &[Fitted; 3]| {
        let each = of.map(|f| format!("{:.4} ± {:.0} %", f.value, percent(&f)));
        note(format_args!(
            "uw: {what} R {}, G {}, B {}{unit}",
            each[0], each[1], each[2]
        ));
    };
    triple("absorption", " (1/m)", &found.a_per_m);
    triple("scattering", " (1/m)", &found.b_per_m);
    if let Some(mixture) = &found.jerlov {
        let (water, error) = (mixture.water, mixture.error);
        note(format_args!(
            "uw: water on Jerlov's scale {water} ± {error:.2} types"
        ));
    }
    let b = &found.backscatter_fraction;
    note(format_args!(
        "uw: backscatter fraction {:.4} ± {:.0} %",
        b.value,
        percent(b)
    ));
    triple("lamps over the vehicle's file", "", &found.lamp_gain);
    if !found.not_identified.is_empty() {
        note(format_args!(
            "uw: the pictures do not tell (within 10 %, lamps and backscatter: more than was known): {}",
            found.not_identified.join(", ")
        ));
    }
    for warning in &found.warnings {
        note(format_args!("uw: warning: {warning}"));
    }
}
