//! Making references again: long renders of the scenes.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use uw_render::integrator::{self, Plan, Progress};

use super::reference::{Provenance, Reference};
use super::scene::{BenchmarkScene, Size};
use super::seeds::seed_of_reference;
use super::{
    ErrorTimeError, ErrorTimeObserver, make_folder, program_version, references_of, threads_or_all,
};

/// When a reference is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// After this many samples per pixel, >= 2.
    Samples(u32),
    /// At this estimated relative error, the root of the relative mean squared error.
    TargetError(f64),
}

/// What references to make.
#[derive(Clone, Debug)]
pub struct Remake {
    /// Scene files.
    pub scenes: Vec<PathBuf>,
    /// Width and height that replace those of the scenes.
    pub size: Size,
    /// Folder for the references; `None` for `references` beside each scene.
    pub references: Option<PathBuf>,
    /// When to stop.
    pub until: Until,
    /// Seed from which that of the renders is made.
    pub seed: u64,
    /// Worker threads; `None` for one per core.
    pub threads: Option<usize>,
}

/// A reference that has been made.
#[derive(Clone, Debug, PartialEq)]
pub struct MadeReference {
    /// The file.
    pub path: PathBuf,
    /// Samples per pixel.
    pub samples_per_pixel: u64,
    /// Its own relative mean squared error, estimated from its variance.
    pub rel_mse: f64,
    /// Rendering, s of processor time.
    pub cpu_s: f64,
}

impl Remake {
    /// Renders all references, one after the other; each file appears when its render is done.
    ///
    /// # Errors
    /// A scene that cannot be used, a render that fails or is stopped, a file that cannot be written.
    pub fn make(&self, observer: &ErrorTimeObserver) -> Result<Vec<MadeReference>, ErrorTimeError> {
        let scenes = BenchmarkScene::read_all(&self.scenes, self.size)?;
        let mut made: Vec<MadeReference> = Vec::new();
        for scene in &scenes {
            let reference = self.make_one(scene, made.len(), scenes.len(), observer);
            made.push(reference.map_err(|error| {
                if observer.cancel.load(Ordering::Relaxed) {
                    ErrorTimeError::Interrupted {
                        done: made.len(),
                        total: scenes.len(),
                        what: "references",
                        kept: "those are written, the one being made is not".to_owned(),
                    }
                } else {
                    error
                }
            })?);
        }
        Ok(made)
    }

    fn make_one(
        &self,
        scene: &BenchmarkScene,
        done: usize,
        total: usize,
        observer: &ErrorTimeObserver,
    ) -> Result<MadeReference, ErrorTimeError> {
        let folder = references_of(scene, self.references.as_deref());
        make_folder(&folder)?;
        let plan = self.plan(scene);
        let observe = |progress: &Progress| {
            let of_this = progress
                .rows_total
                .map(|rows| progress.rows_done as f64 / rows as f64);
            let share = of_this.map(|of_this| (done as f64 + of_this) / total as f64);
            let rounds = progress.rows_done / u64::from(scene.size_px().1);
            let name = &scene.name;
            let message = format!(
                "reference of {name} ({} of {total}), {rounds} rounds over the picture",
                done + 1
            );
            (observer.progress)(share, &message);
        };
        let (film, stats) = integrator::render(scene.prepared(), &plan, observer.cancel, &observe)?;
        if stats.interrupted {
            return Err(ErrorTimeError::Stopped);
        }
        let reference = Reference::of_film(
            &film,
            Provenance {
                scene_hash: scene.hash.clone(),
                seed: plan.seed,
                samples_per_pixel: stats.samples_per_pixel,
                version: program_version(),
            },
        );
        let path = Reference::path(&folder, scene);
        reference.write(&path)?;
        Ok(MadeReference {
            path,
            samples_per_pixel: stats.samples_per_pixel,
            rel_mse: reference.rel_mse(),
            cpu_s: stats.cpu_s,
        })
    }

    fn plan(&self, scene: &BenchmarkScene) -> Plan {
        let (samples_per_pixel, target_error) = match self.until {
            Until::Samples(samples) => (Some(samples), None),
            Until::TargetError(error) => (None, Some(error)),
        };
        Plan {
            samples_per_pixel,
            target_error,
            threads: Some(threads_or_all(self.threads)),
            max_bounces: scene.max_bounces(),
            ..Plan::new(seed_of_reference(self.seed))
        }
    }
}
