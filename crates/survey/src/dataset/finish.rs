//! The tables, once every part is there, and the merging of parts made elsewhere.

use std::fs;
use std::path::{Path, PathBuf};

use super::plan::{environments, groups};
use super::table::{self, Entries};
use super::{
    DatasetConfig, DatasetError, PARQUET_TABLE, TABLE, TableFormat, Workshop, manifest, parquet,
    store,
};

/// Writes profiles, tables and manifest when the images of all groups are there; the tables' paths.
pub(super) fn tables_if_complete(workshop: &Workshop) -> Result<Vec<PathBuf>, DatasetError> {
    let (config, folder) = (workshop.config, workshop.folder);
    if groups(config).any(|g| !g.images_path(folder).exists()) {
        return Ok(Vec::new());
    }
    let mut all: Vec<Entries> = Vec::new();
    for environment in environments(config) {
        let (entries, profile) = table::entries(workshop, &environment)?;
        let path = folder
            .join("profiles")
            .join(format!("{}.json", environment.name()));
        profile
            .write(&path)
            .map_err(|e| DatasetError::Inconsistent(e.to_string()))?;
        all.push(entries);
    }
    let mut tables = Vec::new();
    for format in &config.tables {
        let path = match format {
            TableFormat::Csv => {
                let mut text = table::header();
                all.iter().for_each(|e| text.push_str(&table::lines(e)));
                let path = folder.join(TABLE);
                store::write_bytes(&path, text.as_bytes())?;
                path
            }
            TableFormat::Parquet => {
                let path = folder.join(PARQUET_TABLE);
                parquet::write(&path, &all)?;
                path
            }
        };
        tables.push(path);
    }
    manifest::write(workshop)?;
    remove_leftovers(folder)?;
    Ok(tables)
}

/// Copies the renders and images that `parts` hold into `folder`, which then lacks nothing that they have. All
/// must have been made from the same configuration.
pub fn merge(config: &DatasetConfig, folder: &Path, parts: &[PathBuf]) -> Result<(), DatasetError> {
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
        for kind in ["renders", "images"] {
            for water in config.waters() {
                copy_missing(
                    &part.join(kind).join(water.name()),
                    &folder.join(kind).join(water.name()),
                )?;
            }
        }
        let chosen = Path::new("exposure.json");
        if part.join(chosen).exists() && !folder.join(chosen).exists() {
            copy(&part.join(chosen), &folder.join(chosen))?;
        }
    }
    Ok(())
}

/// Copies the finished files under `from` that `to` lacks, with the folders they are in.
fn copy_missing(from: &Path, to: &Path) -> Result<(), DatasetError> {
    fs::create_dir_all(to).map_err(|e| io(to, e))?;
    for entry in fs::read_dir(from).map_err(|e| io(from, e))? {
        let name = entry.map_err(|e| io(from, e))?.file_name();
        let (source, target) = (from.join(&name), to.join(&name));
        if source.is_dir() {
            copy_missing(&source, &target)?;
        } else if !name.to_string_lossy().starts_with('.') && !target.exists() {
            copy(&source, &target)?;
        }
    }
    Ok(())
}

fn copy(from: &Path, to: &Path) -> Result<(), DatasetError> {
    let bytes = fs::read(from).map_err(|e| io(from, e))?;
    Ok(store::write_bytes(to, &bytes)?)
}

/// Removes unfinished files that killed runs have left.
fn remove_leftovers(folder: &Path) -> Result<(), DatasetError> {
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).map_err(|e| io(&folder, e))? {
            let path = entry.map_err(|e| io(&folder, e))?.path();
            let name = path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            if path.is_dir() {
                folders.push(path);
            } else if name.starts_with('.') && name.ends_with(".part") {
                fs::remove_file(&path).map_err(|e| io(&path, e))?;
            }
        }
    }
    Ok(())
}

fn io(path: &Path, source: std::io::Error) -> DatasetError {
    DatasetError::Io {
        path: path.display().to_string(),
        source,
    }
}
