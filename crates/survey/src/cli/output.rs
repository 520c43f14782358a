//! Results: to standard output or to a file that appears whole or not at all.

use std::fs;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use uw_render::image::{ImageError, write_atomically};

use super::error::CliError;

/// Checks before any work that a file can be made at `path`: a file name in a folder that exists and can be
/// written to.
pub(crate) fn check_writable(path: &Path) -> Result<(), CliError> {
    let refuse = |reason: String| Err(CliError::input(format!("{}: {reason}", path.display())));
    let Some(_) = path.file_name() else {
        return refuse("the output must be a file".to_owned());
    };
    // A finished file replaces what stands at its path: right for a file, fatal for /dev/null.
    if path.symlink_metadata().is_ok_and(|found| !found.is_file()) {
        let expected =
            "the output must be an ordinary file or a new one, not a folder, link or device";
        return refuse(expected.to_owned());
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        return refuse(format!("the folder {} does not exist", folder.display()));
    }
    match tempfile::tempfile_in(&folder) {
        Ok(_) => Ok(()),
        Err(error) => refuse(format!(
            "cannot write to the folder {}: {error}",
            folder.display()
        )),
    }
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Whether two paths lead to the same place, as far as the folders on the way exist.
pub(crate) fn same_file(one: &Path, other: &Path) -> bool {
    let folder = |path: &Path| {
        let folder = fs::canonicalize(folder_of(path)).ok()?;
        Some(folder.join(path.file_name()?))
    };
    one == other || folder(one).is_some_and(|folder_of_one| folder(other) == Some(folder_of_one))
}

/// Writes a file, whole or not at all.
pub(crate) fn to_file(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), CliError> {
    let written = write_atomically(path, |writer| {
        write(writer).map_err(|source| ImageError::System {
            path: path.to_path_buf(),
            action: "written",
            source,
        })
    });
    written.map_err(CliError::failed)
}

/// Writes to standard output. A reader that has closed the pipe has seen enough: no error.
pub(crate) fn to_stdout(
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), CliError> {
    let mut writer = BufWriter::new(io::stdout().lock());
    match write(&mut writer).and_then(|()| writer.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(CliError::failed(format!(
            "cannot write to standard output: {error}"
        ))),
        _ => Ok(()),
    }
}

/// Writes to the file, or to standard output when there is none.
pub(crate) fn to_file_or_stdout(
    path: Option<&Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), CliError> {
    match path {
        Some(path) => to_file(path, write),
        None => to_stdout(write),
    }
}
