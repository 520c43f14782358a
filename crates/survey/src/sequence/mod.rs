//! Pictures along a trajectory with what is true of them: a scene, poses -> a folder of frames with depth, poses and camera.
//!
//! [`trajectory`] reads poses, [`shutter`] tells when the rows of a frame see, [`placing`] puts camera and lamps there, [`config`] says
//! what a folder is and refuses another, [`frame`] renders and writes, [`exposed`] puts moments and rows together, [`lists`] and [`exports`] write what other programs read, once all frames are there.

mod config;
mod exports;
mod exposed;
mod frame;
mod lists;
mod mcap;
mod placing;
mod ros;
mod shutter;
mod trajectory;

use std::cell::LazyCell;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use uw_render::backend::Device;
use uw_render::denoise::DenoiseError;
use uw_render::image::ImageError;
use uw_render::layers::RenderLayer;
use uw_render::prepare::{DaylightField, Geometry, Prepared};
use uw_render::scene::Scene;

pub use config::SequenceConfig;
pub use exports::Export;
pub use shutter::Shutter;
pub use trajectory::{Pose, Trajectory, TrajectoryError};

use crate::dataset::Shard;
use frame::Eye;
use placing::Moment;

/// What a sequence is made of.
pub struct Sequence<'a> {
    /// The scene, whose camera and lamps move along.
    pub scene: &'a Scene,
    /// A pose for each frame.
    pub trajectory: &'a Trajectory,
    /// The poses as they were given, along which the camera moves while its shutter is open; beyond the last one it stands still.
    pub path: &'a Trajectory,
    /// What frames are asked for.
    pub config: &'a SequenceConfig,
    /// Layers of the EXR files besides depth.
    pub layers: &'a [RenderLayer],
}

/// How to make it.
pub struct RunOptions<'a> {
    /// Where to render.
    pub device: &'a Device,
    /// Whether double precision takes over where the kernels in single precision fail.
    pub falls_back: bool,
    /// Frames to make.
    pub shard: Shard,
    /// Worker threads; one per core where there is none.
    pub threads: Option<usize>,
    /// What to write for other programs when all frames are there.
    pub exports: &'a [Export],
}

/// Whom to tell, and who may stop it.
pub struct Observer<'a> {
    /// Called within a frame with its number among those to make, how many these are, and the share of it that is done.
    pub progress: &'a (dyn Fn(usize, usize, f64) + Sync),
    /// What a user should know.
    pub tell: &'a dyn Fn(&str),
    /// Set to stop.
    pub cancel: &'a AtomicBool,
}

/// What was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Made {
    /// Frames of the sequence, each with one picture per eye.
    pub frames: usize,
    /// Pictures that this run rendered.
    pub rendered: usize,
    /// Pictures of the sequence that are still missing.
    pub missing: usize,
}

/// Why there is no sequence.
#[derive(Debug, thiserror::Error)]
pub enum SequenceError {
    /// The folder holds another sequence, or something else.
    #[error("{0}")]
    Folder(String),
    /// A pose that the scene does not allow, or an export that the camera does not.
    #[error("{0}")]
    Unsuitable(String),
    /// A file.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A render.
    #[error("frame {frame} ({time_s} s): {source}")]
    Render {
        /// Number of the frame, from 0.
        frame: usize,
        /// Its time, s.
        time_s: f64,
        /// What went wrong.
        source: DenoiseError,
    },
    /// Stopped; whole frames are kept.
    #[error(
        "interrupted after {done} of {total} pictures, which are kept; the same command goes on"
    )]
    Interrupted {
        /// Pictures that are there of those that were to be made.
        done: usize,
        /// Pictures to be made.
        total: usize,
    },
}

impl SequenceError {
    /// An error of writing to `path`.
    fn system(path: &Path, source: std::io::Error) -> Self {
        Self::Image(ImageError::System {
            path: path.to_path_buf(),
            action: "written",
            source,
        })
    }
}

/// Renders the frames of a shard that `folder` does not hold yet, and writes lists and exports where all frames are there then.
///
/// # Errors
/// Before anything is rendered: a folder with something else in it, a pose at which a lamp would be in the air, an export that the
/// camera's lens or port cannot be written in. Then what renders and files fail at, and an interruption.
pub fn make(
    sequence: &Sequence<'_>,
    folder: &Path,
    options: &RunOptions<'_>,
    observer: &Observer<'_>,
) -> Result<Made, SequenceError> {
    let eyes = Eye::of(sequence.config.stereo_baseline_m);
    placing::check(sequence)?;
    for export in options.exports {
        export.check(sequence)?;
    }
    sequence.config.claim(folder)?;
    frame::make_folders(folder, &eyes)?;
    let frames = sequence.trajectory.poses().len();
    let all = || (0..frames).flat_map(|k| eyes.iter().map(move |&eye| (k, eye)));
    let is_there = |(k, eye): &(usize, Eye)| eye.picture(folder, *k).is_file();
    let own: Vec<_> = all().filter(|(k, _)| options.shard.holds(*k)).collect();
    let (done, missing): (Vec<_>, Vec<_>) = own.iter().copied().partition(is_there);
    let stage = LazyCell::new(|| Stage::of(sequence));
    for (i, &(k, eye)) in missing.iter().enumerate() {
        let progress = |share: f64| (observer.progress)(done.len() + i, own.len(), share);
        progress(0.0);
        let made = frame::make(&stage, k, eye, folder, options, observer, &progress)?;
        if !made || observer.cancel.load(Ordering::Relaxed) {
            return Err(SequenceError::Interrupted {
                done: done.len() + i + usize::from(made),
                total: own.len(),
            });
        }
    }
    let still_missing = all().filter(|part| !is_there(part)).count();
    if still_missing == 0 {
        lists::write(sequence, folder, &eyes)?;
        for export in options.exports {
            export.write(sequence, folder, &eyes)?;
        }
    }
    Ok(Made {
        frames,
        rendered: missing.len(),
        missing: still_missing,
    })
}

/// What all frames share: surfaces are flattened once, daylight is solved once.
struct Stage<'a> {
    sequence: &'a Sequence<'a>,
    /// The scene without its surfaces, which `geometry` holds.
    shell: Scene,
    geometry: Arc<Geometry>,
    daylight: Option<DaylightField>,
}

impl<'a> Stage<'a> {
    fn of(sequence: &'a Sequence<'a>) -> Self {
        let geometry = Arc::new(Geometry::build(sequence.scene));
        let shell = placing::without_surfaces(sequence.scene);
        let prepared = Prepared::build_unsteered(&shell, Arc::clone(&geometry));
        let daylight = prepared.solve_daylight(&shell);
        Self {
            sequence,
            shell,
            geometry,
            daylight,
        }
    }

    /// The scene as an eye sees it at a moment.
    fn placed(&self, moment: &Moment, eye: Eye) -> (Scene, Prepared) {
        let scene = placing::placed(&self.shell, self.sequence, moment, eye);
        let mut prepared = Prepared::build_unsteered(&scene, Arc::clone(&self.geometry));
        prepared.steer(self.daylight.clone());
        (scene, prepared)
    }
}
