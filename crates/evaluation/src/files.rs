//! Files that appear whole or not at all.

use std::io::Write;
use std::path::Path;

use uw_render::image::{ImageError, write_atomically};

use crate::error::EvalError;

/// Writes a text file under a temporary name and renames it once it is complete.
pub fn write_text(path: &Path, text: &str) -> Result<(), EvalError> {
    write_bytes(path, text.as_bytes())
}

/// Writes a file under a temporary name and renames it once it is complete.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), EvalError> {
    let written = write_atomically(path, |file| {
        file.write_all(bytes).map_err(|source| ImageError::System {
            path: path.to_path_buf(),
            action: "written",
            source,
        })
    });
    Ok(written?)
}
