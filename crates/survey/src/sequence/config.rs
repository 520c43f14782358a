//! What a folder of frames is: what was asked for, written down, so that none of another sequence comes among them. Files that the
//! scene names (textures, meshes, spectra) are not looked at.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{SequenceError, Shutter, Trajectory};
use uw_render::image::write_bytes;

/// Format and version.
const FORMAT: &str = "uw-sequence/1";
/// Its name in the folder.
const FILE: &str = "sequence.json";

/// What frames are asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceConfig {
    /// "uw-sequence/1".
    pub format: String,
    /// Scene file as it was given.
    pub scene: String,
    /// CRC-32 of the scene file.
    pub scene_crc32: u32,
    /// Frames.
    pub frames: usize,
    /// CRC-32 of their poses.
    pub poses_crc32: u32,
    /// When the rows of a frame see, where that is not one moment.
    #[serde(default, skip_serializing_if = "Shutter::is_instant")]
    pub shutter: Shutter,
    /// CRC-32 of the poses as they were given, which count where the shutter is open for a time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path_crc32: Option<u32>,
    /// What the command line says instead of the scene file.
    pub changes: Vec<String>,
    /// Lamps that stay where they are.
    pub fixed_lamps: Vec<String>,
    /// Distance of the right eye from the left one, m; without it there is one eye.
    pub stereo_baseline_m: Option<f64>,
    /// Samples per pixel.
    pub samples_per_pixel: u32,
    /// Most scatterings and reflections of a path, 0 for no limit.
    pub max_bounces: u32,
    /// Whether the noise is taken off.
    pub denoise: bool,
    /// Layers of the EXR files besides depth.
    pub layers: Vec<String>,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl SequenceConfig {
    /// Says the version that this program writes.
    pub fn format() -> String {
        FORMAT.to_owned()
    }

    /// Checksum of poses, with the lamps' levels.
    pub fn checksum(trajectory: &Trajectory) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        for pose in trajectory.poses() {
            let numbers = [
                [pose.time_s].as_slice(),
                &pose.position_m.to_array(),
                &pose.rotation.to_array(),
            ]
            .concat();
            let levels = pose.level_pct.into_iter();
            (numbers.into_iter().chain(levels)).for_each(|x| hasher.update(&x.to_le_bytes()));
        }
        hasher.finalize()
    }

    /// Makes `folder` the one of this sequence, or finds that it is.
    pub(super) fn claim(&self, folder: &Path) -> Result<(), SequenceError> {
        fs::create_dir_all(folder).map_err(|e| SequenceError::system(folder, e))?;
        let path = folder.join(FILE);
        match fs::read_to_string(&path) {
            Ok(text) => self.compare(&path, &text),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => self.begin(folder, &path),
            Err(e) => Err(SequenceError::Folder(format!(
                "{}: cannot be read: {e}",
                path.display()
            ))),
        }
    }

    fn begin(&self, folder: &Path, path: &Path) -> Result<(), SequenceError> {
        let mut held = fs::read_dir(folder).map_err(|e| SequenceError::system(folder, e))?;
        // Parts that run side by side write this file at the same time.
        let is_other = |name: &std::ffi::OsStr| !name.to_string_lossy().contains(FILE);
        if let Some(other) =
            held.find_map(|entry| entry.ok().map(|e| e.file_name()).filter(|n| is_other(n)))
        {
            return Err(SequenceError::Folder(format!(
                "{}: holds {} and is no folder of a sequence; a new or an empty one is needed",
                folder.display(),
                other.display()
            )));
        }
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        Ok(write_bytes(path, text.as_bytes())?)
    }

    fn compare(&self, path: &Path, text: &str) -> Result<(), SequenceError> {
        let refuse = |reason: String| {
            Err(SequenceError::Folder(format!(
                "{}: {reason}",
                path.display()
            )))
        };
        let stored = match serde_json::from_str::<Self>(text) {
            Ok(stored) => stored,
            Err(error) => return refuse(format!("is no description of a sequence: {error}")),
        };
        if stored == *self {
            return Ok(());
        }
        let [there, asked] =
            [&stored, self].map(|config| serde_json::to_value(config).unwrap_or_default());
        let fields = [&there, &asked].map(Value::as_object);
        let mut names = fields.into_iter().flatten().flat_map(|own| own.keys());
        let differs = |name: &&String| asked[name.as_str()] != there[name.as_str()];
        let Some(name) = names.find(differs) else {
            return refuse("is of another sequence".to_owned());
        };
        refuse(format!(
            "the frames here were made with {name} = {}, asked for is {}; take another folder",
            there[name.as_str()],
            asked[name.as_str()]
        ))
    }
}
