//! The training set: renders of a grid of waters, targets, depths and distances, and every pair of images.
//!
//! An entry is a pair (image now, image after a change of distance and lamp). Entries share renders: one per
//! environment, depth and distance gives the image at every lamp level, because radiance is linear in it.
//!
//! Every environment becomes one part file, written when it is complete; a run that is stopped goes on with
//! the parts that are missing. The whole table is joined from the parts at the end.

mod config;
mod environment_part;

pub use config::{ConfigError, DatasetConfig};

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use uw_calib::DepthMeasurement;
use uw_render::image::{ImageError, write_atomically};
use uw_render::integrator::RenderError;

use crate::environment::{EnvironmentError, Target, WaterBody};
use crate::measure::Quality;
use crate::routine::{self, RoutineError};
use crate::scenery::textures::Pattern;

/// Name of the joined table in the output folder.
pub const TABLE: &str = "dataset.csv";

/// A dataset cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The environment is not valid.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// A calibration failed.
    #[error(transparent)]
    Routine(#[from] RoutineError),
    /// A render failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] ImageError),
    /// A file or folder cannot be read or made.
    #[error("{path}: {source}")]
    Io {
        /// The path.
        path: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The folder holds parts of another configuration.
    #[error(
        "{folder} holds parts of another dataset (its config.toml differs); choose an empty folder or the same configuration"
    )]
    OtherConfig {
        /// The output folder.
        folder: String,
    },
    /// A profile or an image could not be evaluated.
    #[error("{0}")]
    Inconsistent(String),
    /// Stopped from outside; finished parts are kept.
    #[error(
        "interrupted after {done} of {total} environments; the same command goes on from there"
    )]
    Interrupted {
        /// Environments finished.
        done: usize,
        /// Environments in all.
        total: usize,
    },
}

/// What a run reports.
pub struct Observer<'a> {
    /// Called with the environments done, their total and the name of the next one.
    pub progress: &'a dyn Fn(usize, usize, &str),
    /// Stops the run when set.
    pub cancel: &'a AtomicBool,
}

/// Facts about a finished dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Rows in the table.
    pub entries: usize,
    /// Renders of targets in the whole grid.
    pub renders: usize,
    /// The table.
    pub table: PathBuf,
}

/// Makes the dataset of `config` in `folder`; `assets` holds the textures, `threads` render.
pub fn generate(
    config: &DatasetConfig,
    folder: &Path,
    assets: &Path,
    threads: Option<usize>,
    observer: &Observer,
) -> Result<Summary, DatasetError> {
    claim(config, folder)?;
    let environments = config.environments();
    let total = environments.len();
    let mut up_cache: Vec<(WaterBody, Vec<DepthMeasurement>)> = Vec::new();
    let mut target: Option<Target> = None;
    for (done, (pattern, water)) in environments.iter().enumerate() {
        let part = part_path(folder, *pattern, water);
        (observer.progress)(done, total, &environment_name(*pattern, water));
        if part.exists() {
            continue;
        }
        if target.as_ref().is_none_or(|t| t.pattern != *pattern) {
            target = Some(Target::read(*pattern, assets)?);
        }
        let Some(target) = &target else { continue };
        let quality = Quality {
            samples_per_half: config.samples_per_half,
            seed: config.environment_seed(done),
            threads,
        };
        let result = depths(
            config,
            water,
            target,
            quality,
            observer.cancel,
            &mut up_cache,
        )
        .and_then(|depth| {
            environment_part::make(
                config,
                target,
                water,
                &depth,
                quality,
                observer.cancel,
                folder,
            )
        });
        match result {
            Ok(text) => write_text(&part, &text)?,
            Err(_) if observer.cancel.load(Ordering::Relaxed) => {
                return Err(DatasetError::Interrupted { done, total });
            }
            Err(e) => return Err(e),
        }
    }
    (observer.progress)(total, total, "");
    let entries = join(folder, &environments)?;
    Ok(Summary {
        entries,
        renders: config.renders(),
        table: folder.join(TABLE),
    })
}

/// Name of an environment in the table and in file names.
pub fn environment_name(pattern: Pattern, water: &WaterBody) -> String {
    format!("{}_{}", pattern.name(), water.name())
}

/// The depth series of a water does not depend on the target: rendered once per water.
fn depths(
    config: &DatasetConfig,
    water: &WaterBody,
    target: &Target,
    quality: Quality,
    cancel: &AtomicBool,
    cache: &mut Vec<(WaterBody, Vec<DepthMeasurement>)>,
) -> Result<Vec<DepthMeasurement>, DatasetError> {
    if let Some((_, known)) = cache.iter().find(|(w, _)| w == water) {
        return Ok(known.clone());
    }
    let quality = Quality {
        samples_per_half: config.up_samples_per_half,
        ..quality
    };
    let (sensor, views) = routine::look_up(
        &config.vehicle,
        water,
        target,
        &config.calibration_depths_m,
        quality,
        cancel,
    )?;
    let measured = routine::measure_depths(&sensor, &views);
    cache.push((*water, measured.clone()));
    Ok(measured)
}

/// Makes the folder and writes the configuration into it, or checks that it is the same one.
fn claim(config: &DatasetConfig, folder: &Path) -> Result<(), DatasetError> {
    for sub in ["parts", "profiles"] {
        let path = folder.join(sub);
        fs::create_dir_all(&path).map_err(|source| DatasetError::Io {
            path: path.display().to_string(),
            source,
        })?;
    }
    let path = folder.join("config.toml");
    let text = config.to_text().map_err(DatasetError::Inconsistent)?;
    match fs::read_to_string(&path) {
        Ok(old) if old == text => Ok(()),
        Ok(_) => Err(DatasetError::OtherConfig {
            folder: folder.display().to_string(),
        }),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => write_text(&path, &text),
        Err(source) => Err(DatasetError::Io {
            path: path.display().to_string(),
            source,
        }),
    }
}

/// Joins the parts in the order of the grid; returns the number of rows.
fn join(folder: &Path, environments: &[(Pattern, WaterBody)]) -> Result<usize, DatasetError> {
    let mut table = environment_part::header();
    let mut entries = 0;
    for (pattern, water) in environments {
        let path = part_path(folder, *pattern, water);
        let text = fs::read_to_string(&path).map_err(|source| DatasetError::Io {
            path: path.display().to_string(),
            source,
        })?;
        entries += text.lines().count();
        table.push_str(&text);
    }
    write_text(&folder.join(TABLE), &table)?;
    Ok(entries)
}

fn part_path(folder: &Path, pattern: Pattern, water: &WaterBody) -> PathBuf {
    folder
        .join("parts")
        .join(format!("{}.csv", environment_name(pattern, water)))
}

fn write_text(path: &Path, text: &str) -> Result<(), DatasetError> {
    use std::io::Write;
    Ok(write_atomically(path, |file| {
        file.write_all(text.as_bytes())
            .map_err(|source| ImageError::System {
                path: path.to_path_buf(),
                action: "written",
                source,
            })
    })?)
}
