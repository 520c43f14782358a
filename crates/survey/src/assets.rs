//! The folder of the files that ship with the program.

use std::path::PathBuf;

use uw_assets::Places;
pub use uw_assets::{AssetError, DEFAULT_MODEL};

/// The folder of the shipped files, whose paths are made by [`join`](std::path::Path::join). Where a folder was named
/// (`--assets`, `UWGUIDE_ASSETS`) files come from there alone, else see [`uw_assets`].
///
/// # Errors
/// A folder that was named and is none.
pub fn assets_dir() -> Result<PathBuf, AssetError> {
    Places::of_process().check()?;
    Ok(uw_assets::SCHEME.into())
}
