//! Files that appear whole or not at all.

use std::path::Path;

use crate::error::EvalError;

/// Writes a text file under a temporary name and renames it once it is complete.
pub fn write_text(path: &Path, text: &str) -> Result<(), EvalError> {
    write_bytes(path, text.as_bytes())
}

/// Writes a file under a temporary name and renames it once it is complete.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), EvalError> {
    Ok(uw_render::image::write_bytes(path, bytes)?)
}
