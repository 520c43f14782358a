//! Files of the daemon and who may read them.

use std::fs::{File, Metadata};
use std::io;
use std::path::Path;

/// Makes a file, which must not exist, for its owner only, or for its group too.
pub fn create(path: &Path, group_may_read: bool) -> io::Result<File> {
    let mut options = File::options();
    options.append(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(path)?;
    if group_may_read {
        open_to_group(&file)?;
    }
    Ok(file)
}

/// Opens a file to append to, made by [`create`] where there is none; one that exists keeps what its owner gave it.
pub fn append(path: &Path, group_may_read: bool) -> io::Result<File> {
    match create(path, group_may_read) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            File::options().append(true).open(path)
        }
        other => other,
    }
}

#[cfg(unix)]
fn open_to_group(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o640))
}

#[cfg(not(unix))]
fn open_to_group(_: &File) -> io::Result<()> {
    Ok(())
}

/// A warning when a regular file can be read or written by others than its owner, or than its group where
/// that `group_may_read`.
pub fn exposure(path: &Path, group_may_read: bool) -> Option<String> {
    let file = std::fs::metadata(path).ok().filter(Metadata::is_file)?;
    let mode = mode(&file);
    let allowed = if group_may_read { 0o740 } else { 0o700 };
    let what = match mode & 0o666 & !allowed {
        0 => return None,
        bits if bits & 0o044 == 0 => "written",
        _ => "read",
    };
    let right = if group_may_read { "640" } else { "600" };
    let path = path.display();
    Some(format!(
        "{path}: can be {what} by others than its owner (mode {mode:04o}); chmod {right} {path}"
    ))
}

#[cfg(unix)]
fn mode(file: &Metadata) -> u32 {
    use std::os::unix::fs::PermissionsExt;
    file.permissions().mode() & 0o7777
}

#[cfg(not(unix))]
fn mode(_: &Metadata) -> u32 {
    0o600
}

/// Refuses what is no regular file: opening a pipe or a device could wait for ever.
pub fn regular(path: &Path) -> io::Result<()> {
    if std::fs::metadata(path)?.is_file() {
        return Ok(());
    }
    let message = "must be a regular file, got something else";
    Err(io::Error::new(io::ErrorKind::InvalidInput, message))
}
