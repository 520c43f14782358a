//! The water of the twin: fitted to the pictures of the operation's own calibration, as `uw fit` does.
//!
//! The calibration's views, through the vehicle's sensor with noise, go to disk with their manifest, and the survey's fit
//! makes a water file of them. It is kept beside the pictures with the settings that it depends on, so that the next run
//! reads it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;
use uw_guidance::physics::{Water, WaterFile};
use uw_render::image::write_frame;
use uw_survey::fit::{self, FitError, Options, WaterError};

use super::config::{CalibrationConfig, OperationConfig, TwinConfig, WaterConfig};
use super::seed_of;
use super::site::{Site, ViewKey};
use crate::error::EvalError;
use crate::files::write_text;

/// Separates the sensor noise of the calibration's pictures from that of others.
const CALIBRATION: u64 = 5;
/// Paths of a thousand, and groups of the tables that share them.
const PER_THOUSAND: u32 = 1024;
const TABLE_GROUPS: u32 = 8;

/// Where the twin's water is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaterFrom {
    /// Fitted to the calibration's pictures.
    Fit,
    /// The water file that the configuration names.
    File,
}

/// Waters that the twin is flown with.
pub type TwinWaters = Vec<(WaterFrom, Arc<Water>)>;

/// What a fit depends on besides the views, which belong to their folder; what the twin has in mind later is nothing to it.
#[derive(Serialize)]
struct Inputs<'a> {
    seed: u64,
    calibration: &'a CalibrationConfig,
    twin: TwinConfig,
    made_by: &'static str,
}

/// The water fitted at a site, where the configuration asks for the twin. `folder` keeps the fit's pictures, manifest, report and water
/// file, which is made where the folder does not hold one of the same settings.
///
/// # Errors
/// The pictures tell no water, or the folder cannot be written.
pub fn fitted(
    site: &mut Site,
    config: &OperationConfig,
    folder: &Path,
    threads: Option<usize>,
    cancel: &AtomicBool,
) -> Result<TwinWaters, EvalError> {
    let Some(twin) = &config.twin else {
        return Ok(Vec::new());
    };
    std::fs::create_dir_all(folder).map_err(|e| EvalError::output(folder, e))?;
    let (made_with, water) = (folder.join("made_with.toml"), folder.join("water.json"));
    let inputs = inputs(config, twin).map_err(|e| EvalError::output(&made_with, e))?;
    let same = std::fs::read_to_string(&made_with).is_ok_and(|old| old == inputs);
    if !(same && water.exists()) {
        let manifest = pictures(site, config, folder, cancel)?;
        let down = site.is_bottom();
        let file = on_threads(threads, || fit_to(&manifest, config, twin, down, cancel))??;
        write_text(&water, &file.to_json())?;
        write_text(&made_with, &inputs)?;
    }
    // Also a new file is read back: its numbers have six digits, and every run shall see the same ones.
    let file = WaterFile::read(&water)?;
    Ok(vec![(WaterFrom::Fit, Arc::new(Water::new(file)))])
}

fn inputs(config: &OperationConfig, twin: &TwinConfig) -> Result<String, toml::ser::Error> {
    toml::to_string(&Inputs {
        seed: config.seed,
        calibration: &config.calibration,
        twin: TwinConfig {
            remembers: true,
            ..*twin
        },
        made_by: env!("CARGO_PKG_VERSION"),
    })
}

/// Takes the calibration's pictures of the target, lamps off and on from each distance, and writes their manifest.
fn pictures(
    site: &mut Site,
    config: &OperationConfig,
    folder: &Path,
    cancel: &AtomicBool,
) -> Result<PathBuf, EvalError> {
    let calibration = &config.calibration;
    let depth_m = calibration.contrast_depth_m;
    let mut manifest = "file,kind,depth_m,distance_m,light_pct\n".to_owned();
    for (i, &distance_m) in calibration.distances_m.iter().enumerate() {
        let view = site.view(ViewKey::new(depth_m, 0, distance_m), cancel)?;
        for light_pct in [0.0, calibration.light_pct] {
            let seed = seed_of(&[config.seed, CALIBRATION, i as u64, light_pct.to_bits()]);
            let frame = site.sensor.expose(&view.picture(light_pct), seed);
            let name = format!("d{distance_m}_l{light_pct}.png");
            write_frame(&folder.join(&name), &frame)?;
            // Writing to a string cannot fail.
            let _ = writeln!(
                manifest,
                "{name},contrast,{depth_m},{distance_m},{light_pct}"
            );
        }
    }
    let path = folder.join("manifest.csv");
    write_text(&path, &manifest)?;
    Ok(path)
}

fn fit_to(
    manifest: &Path,
    config: &OperationConfig,
    twin: &TwinConfig,
    down: bool,
    cancel: &AtomicBool,
) -> Result<WaterFile, EvalError> {
    let vehicle = &config.vehicle;
    let options = Options {
        encoding: vehicle.encoding,
        down,
        paths: (PER_THOUSAND * twin.kilo_paths) as usize,
        seed: config.seed,
        ..Options::default()
    };
    let goes_on = |_, _| !cancel.load(Ordering::Relaxed);
    let found = fit::fit(manifest, vehicle, &options, &goes_on).map_err(|error| match error {
        FitError::Interrupted => EvalError::Interrupted,
        other => EvalError::Fit(Box::new(other)),
    })?;
    if let Some(folder) = manifest.parent() {
        fit::report(&found, &[], folder)?;
    }
    let of_group = PER_THOUSAND * twin.table_kilo_paths / TABLE_GROUPS;
    let made_by = concat!("uweval ", env!("CARGO_PKG_VERSION"));
    let goes_on = |_| !cancel.load(Ordering::Relaxed);
    let file = fit::water_file(&found, vehicle, &options, (of_group, made_by), goes_on);
    file.map_err(|error| match error {
        WaterError::Interrupted => EvalError::Interrupted,
        other => other.into(),
    })
}

/// The water file that the configuration names for a water, if it does; it must be of the vehicle's camera.
///
/// # Errors
/// It cannot be used.
pub fn given(water: &WaterConfig, config: &OperationConfig) -> Result<TwinWaters, EvalError> {
    let Some(path) = &water.water_file else {
        return Ok(Vec::new());
    };
    let file = WaterFile::read(path)?;
    let got = [file.sensor.width_px, file.sensor.height_px];
    let wanted = [
        config.vehicle.width as usize,
        config.vehicle.height as usize,
    ];
    if got != wanted {
        return Err(EvalError::Input(format!(
            "water.water_file: {} must be of a camera of {} x {} pixels as vehicle.width and vehicle.height, got {} x {}",
            path.display(),
            wanted[0],
            wanted[1],
            got[0],
            got[1]
        )));
    }
    Ok(vec![(WaterFrom::File, Arc::new(Water::new(file)))])
}

/// Runs on so many threads; `None` for one per core.
fn on_threads<R: Send>(
    threads: Option<usize>,
    run: impl FnOnce() -> R + Send,
) -> Result<R, EvalError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .map_err(|e| EvalError::Input(format!("cannot start threads: {e}")))?;
    Ok(pool.install(run))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_fit_is_made_with_tells_it_from_others() {
        let config = OperationConfig::default();
        let twin = TwinConfig::default();
        let text = inputs(&config, &twin).expect("text");
        let of = |change: &dyn Fn(&mut OperationConfig)| {
            let mut other = config.clone();
            change(&mut other);
            inputs(&other, &twin).expect("text")
        };
        assert_eq!(of(&|c| c.repetitions = 9), text);
        assert!(of(&|c| c.seed = 2) != text);
        assert!(of(&|c| c.calibration.light_pct = 50.0) != text);
        assert!(of(&|c| c.calibration.distances_m = vec![0.5, 1.0, 2.0]) != text);
        let forgetful = TwinConfig {
            remembers: false,
            ..twin
        };
        assert_eq!(inputs(&config, &forgetful).expect("text"), text);
        let fewer = TwinConfig {
            kilo_paths: 8,
            ..twin
        };
        assert!(inputs(&config, &fewer).expect("text") != text);
    }
}
