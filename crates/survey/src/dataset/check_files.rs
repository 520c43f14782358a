//! Entries of a check, a file each, so that a check goes on where it was stopped.

use std::io::Write;
use std::path::{Path, PathBuf};

use uw_render::image::{ImageError, write_atomically};

use super::DatasetError;
use super::check::{CheckPlan, CheckedEntry};
use super::plan::Group;

/// Where an entry of this check is kept.
pub(super) fn entry_path(folder: &Path, plan: &CheckPlan, index: u32) -> PathBuf {
    let (samples, pixels) = (plan.samples_per_pixel, plan.pixels_per_patch);
    let name = format!("{samples}spp_{pixels}px_{index}.json");
    folder.join("check").join(name)
}

/// The entry, where it was checked before.
pub(super) fn kept(
    path: &Path,
    group: &Group,
    depth_m: f64,
    light_pct: f64,
) -> Option<CheckedEntry> {
    let text = std::fs::read(path).ok()?;
    let entry: CheckedEntry = serde_json::from_slice(&text).ok()?;
    let same = entry.image == image_name(group)
        && entry.depth_m == depth_m
        && entry.light_pct == light_pct;
    same.then_some(entry)
}

/// Keeps the entry.
pub(super) fn keep(path: &Path, entry: &CheckedEntry) -> Result<(), DatasetError> {
    let failed = |source: std::io::Error| DatasetError::Io {
        path: path.display().to_string(),
        source,
    };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    let text = serde_json::to_vec_pretty(entry).map_err(|e| failed(e.into()))?;
    write_atomically(path, |out| {
        out.write_all(&text).map_err(|source| ImageError::System {
            path: path.to_path_buf(),
            action: "written",
            source,
        })
    })?;
    Ok(())
}

/// Name of the group's images.
pub(super) fn image_name(group: &Group) -> String {
    group.images_path(Path::new("")).display().to_string()
}
