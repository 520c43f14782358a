//! Stage 6: where the results go; files appear whole or not at all.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::Error;
use crate::table::dataset_file;

/// How JSON is laid out.
#[derive(Clone, Copy)]
pub(crate) enum JsonLayout {
    /// On one line, for files that are mostly numbers.
    Compact,
    /// Indented, for files that people read.
    Indented,
}

/// Writes `value` as JSON beside `path` and renames it into place.
pub(crate) fn write_json<T: Serialize>(
    path: &Path,
    value: &T,
    layout: JsonLayout,
) -> Result<(), Error> {
    let unfinished = unfinished(path);
    let written = fill(&unfinished, value, layout).and_then(|()| fs::rename(&unfinished, path));
    written.map_err(|source| {
        // The file may not exist; the first error is the one to tell.
        let _ = fs::remove_file(&unfinished);
        Error::Write {
            path: path.to_path_buf(),
            source,
        }
    })
}

/// Writes a text whole or not at all.
///
/// # Errors
/// When the folder or the disk refuses.
pub fn write_text(path: &Path, text: &str) -> Result<(), Error> {
    let unfinished = unfinished(path);
    let written = fs::write(&unfinished, text).and_then(|()| fs::rename(&unfinished, path));
    written.map_err(|source| {
        // The file may not exist; the first error is the one to tell.
        let _ = fs::remove_file(&unfinished);
        Error::Write {
            path: path.to_path_buf(),
            source,
        }
    })
}

fn fill<T: Serialize>(path: &Path, value: &T, layout: JsonLayout) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    match layout {
        JsonLayout::Compact => serde_json::to_writer(&mut out, value)?,
        JsonLayout::Indented => serde_json::to_writer_pretty(&mut out, value)?,
    }
    out.write_all(b"\n")?;
    out.into_inner()?.sync_all()
}

/// A hidden name in the same folder, so that the rename stays on one file system.
fn unfinished(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

/// Checks that a model can be written to `model`, and says where its report goes: a file of the
/// model's name ending in `.report.json`, in `folder` (made if missing) or else beside the model.
///
/// # Errors
/// When a path cannot work, so that no time is spent on a result that would be lost, or when the
/// model would replace its own dataset.
pub fn report_path(dataset: &Path, model: &Path, folder: Option<&Path>) -> Result<PathBuf, Error> {
    check(model)?;
    if let (Ok(dataset), Ok(model_now)) =
        (dataset_file(dataset).canonicalize(), model.canonicalize())
        && dataset == model_now
    {
        return Err(Error::Output {
            path: model.to_path_buf(),
            reason: "it is the dataset; give another name".to_owned(),
        });
    }
    let mut name = model.file_stem().unwrap_or_default().to_owned();
    name.push(".report.json");
    let report = match folder {
        None => model.with_file_name(name),
        Some(folder) => {
            fs::create_dir_all(folder).map_err(|source| Error::Output {
                path: folder.to_path_buf(),
                reason: format!("the folder cannot be made: {source}"),
            })?;
            folder.join(name)
        }
    };
    check(&report)?;
    Ok(report)
}

fn check(path: &Path) -> Result<(), Error> {
    let refuse = |reason: String| {
        Err(Error::Output {
            path: path.to_path_buf(),
            reason,
        })
    };
    if path.is_dir() || path.file_name().is_none() {
        return refuse("it is a folder; give the name of a file".to_owned());
    }
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => refuse(format!(
            "the folder {} does not exist; make it first",
            folder.display()
        )),
        _ => Ok(()),
    }
}
