//! The files of a check: entries, a file each, so that a check goes on where it was stopped; and a finished folder held
//! against its own parts.

use std::path::{Path, PathBuf};

use super::check::{CheckPlan, CheckedEntry};
use super::plan::{Group, Upward, groups};
use super::seal::{self, Found};
use super::{DatasetError, Workshop, exposure, finish, rows, store};

/// Where an entry of this check is kept.
pub(super) fn entry_path(folder: &Path, plan: &CheckPlan, index: u32) -> PathBuf {
    let (samples, pixels) = (plan.samples_per_pixel, plan.pixels_per_patch);
    let name = format!("{samples}spp_{pixels}px_{index}.json");
    folder.join("check").join(name)
}

/// The entry, where it was checked before.
pub(super) fn kept(
    workshop: &Workshop,
    path: &Path,
    group: &Group,
    depth_m: f64,
    light_pct: f64,
) -> Result<Option<CheckedEntry>, DatasetError> {
    let Some(text) = store::read_bytes(path)? else {
        return Ok(None);
    };
    let found = match seal::from_json::<CheckedEntry>(&workshop.watch.name(path), &text) {
        Found::Unsealed(_) => Found::Damaged("it carries no checksum".into()),
        found => found,
    };
    let entry = workshop.watch.accept(path, found);
    Ok(entry.filter(|e| {
        e.image == image_name(group) && e.depth_m == depth_m && e.light_pct == light_pct
    }))
}

/// Keeps the entry.
pub(super) fn keep(
    workshop: &Workshop,
    path: &Path,
    entry: &CheckedEntry,
) -> Result<(), DatasetError> {
    let failed = |source: std::io::Error| DatasetError::Io {
        path: path.display().to_string(),
        source,
    };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    let text = seal::to_json(&workshop.watch.name(path), entry).map_err(|e| failed(e.into()))?;
    Ok(uw_render::image::write_bytes(path, text.as_bytes())?)
}

/// Name of the group's images.
pub(super) fn image_name(group: &Group) -> String {
    group.images_path(Path::new("")).display().to_string()
}

/// What is wrong with the file that holds the exposure, if anything.
pub(super) fn exposure_fault(folder: &Path) -> Result<Option<String>, DatasetError> {
    let path = folder.join(exposure::EXPOSURE);
    Ok(fault(&path, &exposure::read(&path)?))
}

/// What is wrong with the folder's files: renders and tables of images that are not as they were written, and, where
/// the dataset is complete, profiles, tables and a manifest that are not what these parts give.
pub(super) fn faults(workshop: &Workshop) -> Result<Vec<String>, DatasetError> {
    let (config, folder) = (workshop.config, workshop.folder);
    let mut faults = Vec::new();
    let mut renders = Vec::new();
    for water in config.waters() {
        let depths = config.calibration_depths_m.iter();
        renders.extend(depths.map(|&depth_m| Upward { water, depth_m }.render()));
    }
    renders.extend(groups(config).flat_map(|g| g.renders(config).collect::<Vec<_>>()));
    // The preliminary renders are read where the exposure has to be chosen again.
    let pilots: Vec<_> = renders.iter().map(|r| r.clone().pilot()).collect();
    for render in renders.into_iter().chain(pilots) {
        let path = render.path(folder);
        faults.extend(fault(
            &path,
            &store::inspect(&workshop.watch.name(&path), &path)?,
        ));
    }
    for group in groups(config) {
        faults.extend(fault(
            &group.images_path(folder),
            &rows::inspect(workshop, &group)?,
        ));
    }
    if faults.is_empty() && finish::is_complete(workshop) {
        finish::outputs(workshop, &mut |path, made| {
            match store::read_bytes(path)? {
                Some(bytes) if bytes == made => {}
                Some(_) => faults.push(format!(
                    "{} differs from what its parts give",
                    path.display()
                )),
                None => faults.push(format!("{} is missing", path.display())),
            }
            Ok(())
        })?;
    }
    Ok(faults)
}

fn fault<T>(path: &Path, found: &Found<T>) -> Option<String> {
    let reason = found.damage()?;
    Some(format!("{} is damaged: {reason}", path.display()))
}
