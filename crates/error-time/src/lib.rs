//! Error against time: how long the renderer takes to come how close to converged pictures.
//!
//! [`remake`] makes the converged pictures ([`reference`]) of scenes ([`scene`], told apart by [`hash`]);
//! [`ladder`] renders with rising numbers of samples, [`error`] compares, [`table`] keeps every render, [`curve`]
//! joins them to curves and finds the seconds to an error, [`plot`] draws them beside other renderers' ([`peers`]).

pub mod backend;
pub mod curve;
pub mod error;
pub mod hash;
pub mod ladder;
pub mod peers;
mod plot;
pub mod reference;
pub mod remake;
pub mod scene;
mod seeds;
pub mod table;

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::thread::available_parallelism;
use std::{env, fs, io};

use uw_render::image::ImageError;
use uw_render::integrator::RenderError;

use peers::PeersError;
use reference::ReferenceError;
use scene::{BenchmarkScene, BenchmarkSceneError};
use table::TableError;

/// Folder of references beside a scene file.
const REFERENCES: &str = "references";

/// What a run reports, and what stops it.
pub struct ErrorTimeObserver<'a> {
    /// Called from any thread with the share that is done, where it is known, and what is being done.
    pub progress: &'a (dyn Fn(Option<f64>, &str) + Sync),
    /// Stops the run when set.
    pub cancel: &'a AtomicBool,
}

/// A run that did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum ErrorTimeError {
    /// A scene cannot be used.
    #[error(transparent)]
    Scene(#[from] BenchmarkSceneError),
    /// A reference cannot be used.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The table in the output folder cannot be used.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The table of peers cannot be used.
    #[error(transparent)]
    Peers(#[from] PeersError),
    /// A folder cannot be made.
    #[error("{}: the folder cannot be made: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A render failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] ImageError),
    /// A plot cannot be drawn.
    #[error("{}: {reason}", path.display())]
    Plot {
        /// The file.
        path: PathBuf,
        /// What the drawing library says.
        reason: String,
    },
    /// A render was stopped from outside.
    #[error("a render was stopped")]
    Stopped,
    /// The run was stopped from outside.
    #[error("interrupted after {done} of {total} {what}; {kept}")]
    Interrupted {
        /// What is finished.
        done: usize,
        /// What was to be done in all.
        total: usize,
        /// Renders or references.
        what: &'static str,
        /// What has been kept.
        kept: String,
    },
}

impl ErrorTimeError {
    /// Whether the input is at fault, not the run.
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::Scene(_)
                | Self::Reference(_)
                | Self::Table(_)
                | Self::Peers(_)
                | Self::Folder { .. }
        )
    }
}

/// The folder of a scene's reference: the given one, or `references` beside the scene file.
fn references_of(scene: &BenchmarkScene, given: Option<&Path>) -> PathBuf {
    match given {
        Some(folder) => folder.to_path_buf(),
        None => scene.path.with_file_name(REFERENCES),
    }
}

fn make_folder(path: &Path) -> Result<(), ErrorTimeError> {
    fs::create_dir_all(path).map_err(|source| ErrorTimeError::Folder {
        path: path.to_path_buf(),
        source,
    })
}

/// Number of threads asked for, or one per core.
fn threads_or_all(threads: Option<usize>) -> usize {
    threads.unwrap_or_else(|| available_parallelism().map_or(1, usize::from))
}

/// Version of the program with a hash of its file, so that measurements of another build are not taken for its own.
fn program_version() -> String {
    let version = env!("CARGO_PKG_VERSION");
    let build = env::current_exe()
        .ok()
        .and_then(|program| hash::file_hash(&program).ok());
    match build {
        Some(build) => format!("{version}+{build}"),
        None => version.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use reference::Reference;

    fn repository(path: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../..")
            .join(path)
    }

    fn benchmark_scenes() -> Vec<PathBuf> {
        let entries = fs::read_dir(repository("assets/benchmarks")).unwrap();
        let paths = entries.map(|entry| entry.unwrap().path());
        let mut scenes: Vec<PathBuf> = paths
            .filter(|path| path.extension().is_some_and(|e| e == "toml"))
            .collect();
        scenes.sort();
        scenes
    }

    #[test]
    fn the_shipped_references_belong_to_their_scenes_and_are_good() {
        let scenes = benchmark_scenes();
        assert_eq!(scenes.len(), 9);
        for scene in BenchmarkScene::read_all(&scenes, scene::Size::default()).unwrap() {
            let reference = Reference::read_for(&references_of(&scene, None), &scene).unwrap();
            assert_eq!((reference.width, reference.height), scene.size_px());
            let rel_mse = reference.rel_mse();
            assert!(
                rel_mse > 1e-6 && rel_mse < 5e-4,
                "{}: {rel_mse}",
                scene.name
            );
        }
    }

    /// The shipped references of lamps against tile means that an independent program made (`tests/data`): 144 tiles per channel
    /// whose deviations must be those of the standard errors of both.
    #[test]
    fn the_shipped_references_agree_with_independent_ones() {
        for (name, other) in [
            ("s1_clear", "s1"),
            ("s1d_clear_disk", "s1d"),
            ("s2_turbid", "s2"),
        ] {
            let path = repository("assets/benchmarks")
                .join(name)
                .with_extension("toml");
            let scene = BenchmarkScene::read(&path, scene::Size::default()).unwrap();
            let reference = Reference::read_for(&references_of(&scene, None), &scene).unwrap();
            let tiles = repository(&format!("tests/data/reference_{other}.csv"));
            let z = z_scores_by_tiles(&reference, &fs::read_to_string(tiles).unwrap());
            assert_eq!(z.len(), 3 * 144);
            let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
            let largest = z.iter().fold(0.0_f64, |largest, z| largest.max(z.abs()));
            // Channels share their paths: as many independent values as tiles, four standard deviations of their rms.
            assert!(
                rms > 0.76 && rms < 1.24 && largest < 4.5,
                "{name}: {rms} {largest}"
            );
        }
    }

    /// Deviations of the means of 20 × 20 pixels in their standard errors. Columns of `tiles`: row, column, mean and
    /// standard error of R, G, B.
    fn z_scores_by_tiles(reference: &Reference, tiles: &str) -> Vec<f64> {
        const TILE: usize = 20;
        let mut scores = Vec::new();
        for line in tiles.lines().skip(1) {
            let v: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            let (row, column) = (v[0] as usize * TILE, v[1] as usize * TILE);
            for k in 0..3 {
                let (mut mean, mut variance) = (0.0, 0.0);
                for i in 0..TILE * TILE {
                    let (x, y) = (column + i % TILE, row + i / TILE);
                    let pixel = y * reference.width as usize + x;
                    mean += reference.mean[pixel][k] / (TILE * TILE) as f64;
                    variance += (reference.standard_error[pixel][k] / (TILE * TILE) as f64).powi(2);
                }
                scores.push((mean - v[2 + k]) / variance.sqrt().hypot(v[5 + k]));
            }
        }
        scores
    }

    #[test]
    fn scenes_shared_with_the_system_tests_are_the_same() {
        let mut compared = 0;
        for path in benchmark_scenes() {
            let name = path.file_name().unwrap();
            let other = repository("tests/scenes").join(name);
            if other.exists() {
                assert_eq!(
                    hash::content_hash(&path).unwrap(),
                    hash::content_hash(&other).unwrap(),
                    "{}",
                    path.display()
                );
                compared += 1;
            }
        }
        assert_eq!(compared, 4);
    }

    #[test]
    fn the_shipped_peers_are_on_shipped_scenes() {
        let peers = peers::read(&repository("assets/benchmarks/peers.csv")).unwrap();
        assert!(!peers.is_empty());
        for peer in peers {
            let scene = repository("assets/benchmarks")
                .join(&peer.scene)
                .with_extension("toml");
            assert!(scene.exists(), "{peer:?}");
        }
    }
}
