//! Profiles, tables and manifest, once every part is there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::plan::{environments, groups};
use super::table::{self, Entries};
use super::{
    DatasetError, MANIFEST, PARQUET_TABLE, TABLE, TableFormat, Workshop, manifest, parquet, store,
};

/// Whether the images of all groups are there.
pub(super) fn is_complete(workshop: &Workshop) -> bool {
    groups(workshop.config).all(|g| g.images_path(workshop.folder).exists())
}

/// Writes profiles, tables and manifest when the images of all groups are there; the tables' paths. One that is there
/// and is not what the parts give is told of.
pub(super) fn tables_if_complete(workshop: &Workshop) -> Result<Vec<PathBuf>, DatasetError> {
    if !is_complete(workshop) {
        return Ok(Vec::new());
    }
    outputs(workshop, &mut |path, made| {
        match store::read_bytes(path)? {
            Some(bytes) if bytes == made => return Ok(()),
            Some(_) => workshop.watch.say(&format!(
                "{} differs from what its parts give; it is written again",
                path.display()
            )),
            None => {}
        }
        Ok(uw_render::image::write_bytes(path, made)?)
    })?;
    remove_leftovers(workshop.folder)?;
    let name = |format: &TableFormat| match format {
        TableFormat::Csv => TABLE,
        TableFormat::Parquet => PARQUET_TABLE,
    };
    let tables = workshop.config.tables.iter();
    Ok(tables.map(|t| workshop.folder.join(name(t))).collect())
}

/// What becomes of an output, given its path and its bytes.
type Taker<'a> = dyn FnMut(&Path, &[u8]) -> Result<(), DatasetError> + 'a;

/// Makes profiles, tables and manifest from the parts and hands each to `each` with its path.
pub(super) fn outputs(workshop: &Workshop, each: &mut Taker<'_>) -> Result<(), DatasetError> {
    let (config, folder) = (workshop.config, workshop.folder);
    let mut sums = BTreeMap::new();
    let mut hand_on = |name: String, bytes: &[u8]| {
        let path = folder.join(&name);
        sums.insert(name, format!("{:08x}", crc32fast::hash(bytes)));
        each(&path, bytes)
    };
    let mut all: Vec<Entries> = Vec::new();
    for environment in environments(config) {
        let (entries, profile) = table::entries(workshop, &environment)?;
        let name = format!("profiles/{}.json", environment.name());
        hand_on(name, profile.to_json().as_bytes())?;
        all.push(entries);
    }
    for format in &config.tables {
        match format {
            TableFormat::Csv => {
                let mut text = table::header();
                all.iter().for_each(|e| text.push_str(&table::lines(e)));
                hand_on(TABLE.into(), text.as_bytes())?;
            }
            TableFormat::Parquet => hand_on(PARQUET_TABLE.into(), &parquet::bytes(&all)?)?,
        }
    }
    let text = manifest::text(workshop, &sums)?;
    each(&folder.join(MANIFEST), text.as_bytes())
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

pub(super) fn io(path: &Path, source: std::io::Error) -> DatasetError {
    DatasetError::Io {
        path: path.display().to_string(),
        source,
    }
}
