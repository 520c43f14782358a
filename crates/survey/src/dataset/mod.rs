//! The training set: renders of a grid of waters, targets, depths and distances, and every pair of images.
//!
//! | stage | file | what it does |
//! |---|---|---|
//! | 1 | [`DatasetConfig`] | the grid, the vehicle, the accuracy asked for |
//! | 2 | `plan` | the fewest renders, their names and seeds, and the parts of several processes |
//! | 3 | `exposure` | one exposure for the whole set, from preliminary renders |
//! | 4 | `group`, `upward` | the renders, each in a file of its own (`store`), and the images' statistics |
//! | 5 | `table`, `parquet` | profiles and entries |
//! | 6 | `manifest` | every parameter, seed and version |
//!
//! Files that a later run reads carry a checksum (`seal`): `.sums` (`store`), tables of images (`rows`), `exposure.json`,
//! entries of a check and lists of kept pictures. `check_files` holds a finished folder against its own parts.
//!
//! Everything follows from the configuration and the names of the renders: neither the number of threads, nor
//! interruptions, nor the parts in which it was made change a byte of the result.

mod accuracy;
mod check;
mod check_files;
mod config;
mod exposure;
mod finish;
mod group;
mod manifest;
mod merge;
mod parquet;
mod pictures;
mod plan;
mod presets;
mod rows;
mod seal;
mod store;
mod table;
mod times;
mod upward;
mod verdict;
mod views;

pub use accuracy::Accuracy;
pub use check::{CheckPlan, CheckReport, CheckedEntry, check};
pub use config::{ConfigError, DatasetConfig, ExposureMode, TableFormat};
pub use merge::merge;
pub use plan::{Counts, Shard};
pub(crate) use seal::name_in;
pub use table::{Column, WORDS, numbers};
pub use times::Times;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use uw_render::image::ImageError;
use uw_render::integrator::RenderError;

use manifest::MANIFEST;
use plan::Task;
use seal::Watch;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{EnvironmentError, Target, sensor};
use uw_twin::estimate::fields::GROUPS;
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::response::CountResponse;
use uw_twin::estimate::statistics::Shot;
use uw_twin::estimate::target_model::Effort;
use uw_twin::routine::RoutineError;

/// Name of the text table in the output folder.
pub const TABLE: &str = "dataset.csv";
/// Name of the Parquet table in the output folder.
pub const PARQUET_TABLE: &str = "dataset.parquet";

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
    /// The configuration asks for something that cannot be.
    #[error("the configuration cannot be used: {0}")]
    Config(String),
    /// A file of the dataset does not fit the others.
    #[error("{0}")]
    Inconsistent(String),
    /// Files of the dataset are damaged or differ from their parts.
    #[error("{}\nThe same command without --check makes them again.", .0.join("\n"))]
    Faulty(Vec<String>),
    /// A render was stopped from outside.
    #[error("stopped")]
    Stopped,
    /// Stopped from outside; finished renders are kept.
    #[error("interrupted after {done} of {total} images; the same command goes on from there")]
    Interrupted {
        /// Images finished.
        done: usize,
        /// Images in all.
        total: usize,
    },
}

/// How far a run is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Images finished, those of earlier runs counted in.
    pub images: usize,
    /// Images of this shard in all.
    pub images_total: usize,
    /// Images finished by this run per second.
    pub images_per_s: f64,
}

/// What a run reports.
pub struct Observer<'a> {
    /// Called from any thread after each task.
    pub progress: &'a (dyn Fn(&Progress) + Sync),
    /// Called from any thread with what a user should know, such as the name of a damaged file.
    pub tell: &'a (dyn Fn(&str) + Sync),
    /// Stops the run when set.
    pub cancel: &'a AtomicBool,
}

/// Facts about a run that came to its end.
#[derive(Debug)]
pub struct Summary {
    /// Renders, images and entries of the grid.
    pub counts: Counts,
    /// Linear signal per radiance of images of targets, unless each has its own.
    pub exposure: f64,
    /// The tables; empty when other shards are still missing.
    pub tables: Vec<PathBuf>,
    /// Where the time of this run went.
    pub times: Times,
}

/// A texture with its blurred versions.
struct LoadedTarget {
    pattern: Pattern,
    target: Target,
    pyramid: TexturePyramid,
}

/// What all tasks share.
struct Workshop<'a> {
    config: &'a DatasetConfig,
    folder: &'a Path,
    patterns: Vec<Pattern>,
    targets: Vec<LoadedTarget>,
    response: CountResponse,
    effort: Effort,
    exposure: f64,
    keep_images: bool,
    cancel: &'a AtomicBool,
    watch: Watch<'a>,
    times: Times,
}

impl Workshop<'_> {
    fn target(&self, pattern: Pattern) -> Result<&LoadedTarget, DatasetError> {
        let found = self.targets.iter().find(|t| t.pattern == pattern);
        found.ok_or_else(|| DatasetError::Inconsistent(format!("{} is not loaded", pattern.name())))
    }

    /// Linear signal per radiance of an image, of which `unexposed` has exposure 1.
    fn exposure_of(&self, unexposed: &Shot) -> f64 {
        match self.config.exposure {
            ExposureMode::Auto => self.config.exposure_grey / unexposed.mean_signal().max(1e-30),
            ExposureMode::Chosen | ExposureMode::Fixed => self.exposure,
        }
    }
}

/// How to go about it; none of this changes what is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunOptions {
    /// The part to make.
    pub shard: Shard,
    /// Threads; `None` for one per core.
    pub threads: Option<usize>,
    /// Whether to write every image as well.
    pub keep_images: bool,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self {
            shard: Shard::WHOLE,
            threads: None,
            keep_images: false,
        }
    }
}

/// Makes the dataset of `config` in `folder`, or a part of it, and the tables once nothing is missing. `assets`
/// holds the textures.
pub fn generate(
    config: &DatasetConfig,
    folder: &Path,
    assets: &Path,
    options: &RunOptions,
    observer: &Observer,
) -> Result<Summary, DatasetError> {
    views::check(config)?;
    claim(config, folder)?;
    let pool = pool(options.threads)?;
    let mut workshop = workshop(config, folder, assets, observer)?;
    workshop.keep_images = options.keep_images;
    let result = exposure::choose(&workshop, &pool);
    workshop.exposure = result.map_err(|e| interrupted(e, 0, config))?;
    render_all(&workshop, &pool, options.shard, observer)?;
    let tables = finish::tables_if_complete(&workshop)?;
    workshop.watch.tell_unsealed();
    Ok(Summary {
        counts: Counts::of(config),
        exposure: workshop.exposure,
        tables,
        times: workshop.times,
    })
}

fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool, DatasetError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .map_err(|e| DatasetError::Inconsistent(format!("cannot start threads: {e}")))
}

fn workshop<'a>(
    config: &'a DatasetConfig,
    folder: &'a Path,
    assets: &Path,
    observer: &Observer<'a>,
) -> Result<Workshop<'a>, DatasetError> {
    let patterns = config.patterns();
    let mut targets = Vec::new();
    for &pattern in &patterns {
        let target = Target::read(pattern, assets)?;
        let pyramid = TexturePyramid::new(&target.texture, f64::from(pattern.tile_m()));
        targets.push(LoadedTarget {
            pattern,
            target,
            pyramid,
        });
    }
    let per_group = |paths: u32| paths.div_ceil(GROUPS as u32);
    Ok(Workshop {
        config,
        folder,
        patterns,
        targets,
        response: CountResponse::new(&sensor(&config.vehicle, config.vehicle.exposure)),
        effort: Effort {
            least: per_group(config.accuracy.least_paths),
            most: per_group(config.accuracy.most_paths),
        },
        exposure: config.vehicle.exposure,
        keep_images: false,
        cancel: observer.cancel,
        watch: Watch::new(folder, observer.tell),
        times: Times::default(),
    })
}

/// Makes what is missing of the shard's renders and images.
fn render_all(
    workshop: &Workshop,
    pool: &rayon::ThreadPool,
    shard: Shard,
    observer: &Observer,
) -> Result<(), DatasetError> {
    let config = workshop.config;
    let tasks = plan::tasks(config, shard);
    let per_group = config.depths_m.len() * config.light_pct.len();
    let images_of = |task: &Task| match task {
        Task::Upward(_) => 0,
        Task::Group(_) => per_group,
    };
    let total = tasks.iter().map(images_of).sum();
    let (all, fresh) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let started = Instant::now();
    let result: Result<(), DatasetError> = pool.install(|| {
        tasks.par_iter().with_max_len(1).try_for_each(|task| {
            if workshop.cancelled() {
                return Err(DatasetError::Stopped);
            }
            let before = workshop.times.renders();
            match task {
                Task::Upward(upward) => upward::make(workshop, upward)?,
                Task::Group(group) => group::make(workshop, group)?,
            }
            let images = all.fetch_add(images_of(task), Ordering::Relaxed) + images_of(task);
            if workshop.times.renders() > before {
                fresh.fetch_add(images_of(task), Ordering::Relaxed);
            }
            let elapsed = started.elapsed().as_secs_f64().max(1e-3);
            (observer.progress)(&Progress {
                images,
                images_total: total,
                images_per_s: fresh.load(Ordering::Relaxed) as f64 / elapsed,
            });
            Ok(())
        })
    });
    result.map_err(|e| interrupted(e, all.into_inner(), config))
}

/// An interruption with what has been done.
fn interrupted(error: DatasetError, done: usize, config: &DatasetConfig) -> DatasetError {
    match error {
        DatasetError::Stopped => DatasetError::Interrupted {
            done,
            total: Counts::of(config).images,
        },
        other => other,
    }
}

/// Makes the folders and writes the configuration, or checks that it is the same one.
fn claim(config: &DatasetConfig, folder: &Path) -> Result<(), DatasetError> {
    let make = |path: PathBuf| {
        fs::create_dir_all(&path).map_err(|source| DatasetError::Io {
            path: path.display().to_string(),
            source,
        })
    };
    make(folder.join("profiles"))?;
    for water in config.waters() {
        make(folder.join("renders").join(water.name()))?;
        make(folder.join("images").join(water.name()))?;
    }
    let path = folder.join("config.toml");
    let text = config.to_text().map_err(DatasetError::Inconsistent)?;
    match fs::read_to_string(&path) {
        Ok(old) if old == text => Ok(()),
        Ok(_) => Err(DatasetError::OtherConfig {
            folder: folder.display().to_string(),
        }),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            Ok(uw_render::image::write_bytes(&path, text.as_bytes())?)
        }
        Err(source) => Err(DatasetError::Io {
            path: path.display().to_string(),
            source,
        }),
    }
}
