//! Parts of a dataset that were made elsewhere.

use std::fs;
use std::path::{Path, PathBuf};

use super::finish::io;
use super::seal::{Found, name_in};
use super::{DatasetConfig, DatasetError, exposure, pictures, rows, store};

/// Copies the renders and images that `parts` hold into `folder`, which then lacks nothing that they have. All
/// must have been made from the same configuration. A damaged file is named through `tell` and left out.
pub fn merge(
    config: &DatasetConfig,
    folder: &Path,
    parts: &[PathBuf],
    tell: &(dyn Fn(&str) + Sync),
) -> Result<(), DatasetError> {
    let expected = config.to_text().map_err(DatasetError::Inconsistent)?;
    for part in parts {
        let path = part.join("config.toml");
        let text = fs::read_to_string(&path).map_err(|e| {
            DatasetError::Config(format!(
                "{}: {e}; a folder to merge holds a part of this dataset",
                path.display()
            ))
        })?;
        if text != expected {
            return Err(DatasetError::OtherConfig {
                folder: part.display().to_string(),
            });
        }
    }
    super::claim(config, folder)?;
    for part in parts {
        let way = Way { part, folder, tell };
        for kind in ["renders", "images"] {
            for water in config.waters() {
                way.copy_missing(&Path::new(kind).join(water.name()))?;
            }
        }
        way.copy(Path::new(exposure::EXPOSURE))?;
    }
    Ok(())
}

/// From a part to the folder of the whole.
struct Way<'a> {
    part: &'a Path,
    folder: &'a Path,
    tell: &'a (dyn Fn(&str) + Sync),
}

impl Way<'_> {
    /// Copies the finished files under `inside` that are missing, with the folders they are in.
    fn copy_missing(&self, inside: &Path) -> Result<(), DatasetError> {
        let (from, to) = (self.part.join(inside), self.folder.join(inside));
        fs::create_dir_all(&to).map_err(|e| io(&to, e))?;
        for entry in fs::read_dir(&from).map_err(|e| io(&from, e))? {
            let entry = entry.map_err(|e| io(&from, e))?;
            let name = entry.file_name();
            if entry.path().is_dir() {
                self.copy_missing(&inside.join(name))?;
            } else if !name.to_string_lossy().starts_with('.') {
                self.copy(&inside.join(name))?;
            }
        }
        Ok(())
    }

    /// Copies a file, unless it is there or is damaged where it comes from.
    fn copy(&self, inside: &Path) -> Result<(), DatasetError> {
        let (source, target) = (self.part.join(inside), self.folder.join(inside));
        match inspect(self.folder, &target)? {
            Found::Absent | Found::Damaged(_) => {}
            Found::Unsealed(()) | Found::Sealed(()) => return Ok(()),
        }
        match inspect(self.part, &source)? {
            Found::Absent => Ok(()),
            Found::Damaged(reason) => {
                let path = source.display();
                (self.tell)(&format!(
                    "{path} is damaged: {reason}; it is not taken over"
                ));
                Ok(())
            }
            Found::Unsealed(()) | Found::Sealed(()) => {
                let bytes = fs::read(&source).map_err(|e| io(&source, e))?;
                Ok(uw_render::image::write_bytes(&target, &bytes)?)
            }
        }
    }
}

/// Whether the file at `path` in `folder` is as it was written.
fn inspect(folder: &Path, path: &Path) -> Result<Found<()>, DatasetError> {
    if !path.exists() {
        return Ok(Found::Absent);
    }
    let name = name_in(folder, path);
    match path.extension().and_then(|e| e.to_str()) {
        Some("sums") => store::inspect(&name, path),
        Some("csv") => {
            let bytes = fs::read(path).map_err(|e| io(path, e))?;
            Ok(rows::from_text(&name, &bytes).and_then("", |_| Some(())))
        }
        _ if name == exposure::EXPOSURE => Ok(exposure::read(path)?.and_then("", |_| Some(()))),
        _ => pictures::inspect(folder, path),
    }
}
