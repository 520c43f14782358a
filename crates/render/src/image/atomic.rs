//! Files that appear whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

use super::ImageError;

/// Writes a file under a temporary name in the same folder and renames it once it is complete.
/// When `write` fails nothing is left behind and an older file of the name stays as it was.
///
/// # Errors
/// What `write` returns, or [`ImageError::System`].
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), ImageError>,
) -> Result<(), ImageError> {
    let system = |source| ImageError::System {
        path: path.to_path_buf(),
        action: "written",
        source,
    };
    let temporary = temporary_name(path);
    let file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&temporary)
        .map_err(system)?;
    let mut writer = BufWriter::new(file);
    let result = write(&mut writer).and_then(|()| {
        writer
            .flush()
            .and_then(|()| writer.get_ref().sync_data())
            .and_then(|()| fs::rename(&temporary, path))
            .map_err(system)
    });
    if result.is_err() {
        // The first error is the one to report; a left-over temporary file cannot be helped here.
        let _ = fs::remove_file(&temporary);
    }
    result
}

/// Writes a file of these bytes, whole or not at all.
///
/// # Errors
/// [`ImageError::System`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    write_atomically(path, |file| {
        file.write_all(bytes).map_err(|source| ImageError::System {
            path: path.to_path_buf(),
            action: "written",
            source,
        })
    })
}

/// A name beside `path` that no other thread or process uses.
fn temporary_name(path: &Path) -> PathBuf {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let count = COUNTER.fetch_add(1, Ordering::Relaxed);
    path.with_file_name(format!(".{name}.{}-{count}.part", process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("out.png");
        write_atomically(&path, |writer| {
            writer.write_all(b"old").expect("writable");
            Ok(())
        })
        .expect("written");
        let failed = write_atomically(&path, |writer| {
            writer.write_all(b"half").expect("writable");
            Err(ImageError::Content {
                path: path.clone(),
                reason: "stopped".to_string(),
            })
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).expect("still there"), b"old");
        assert_eq!(fs::read_dir(folder.path()).expect("folder").count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let path = Path::new("no/such/folder/out.png");
        let error = write_atomically(path, |_| Ok(()))
            .expect_err("no folder")
            .to_string();
        assert!(
            error.contains("no/such/folder/out.png: cannot be written"),
            "{error}"
        );
    }
}
