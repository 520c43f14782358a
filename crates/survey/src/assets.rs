//! Where the files that ship with the program are.

use std::path::PathBuf;

/// The environment variable that names the folder of assets.
pub const ASSETS_VARIABLE: &str = "UW_ASSETS";

/// The assets cannot be found.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot find the folder `assets` (looked at {looked_at}); run from the repository or set {ASSETS_VARIABLE} to the folder"
)]
pub struct AssetsNotFound {
    /// The places tried.
    pub looked_at: String,
}

/// The folder of assets: named by `UW_ASSETS`, or `assets` in the working directory, beside the program's
/// build folder, or in the sources it was built from.
pub fn assets_dir() -> Result<PathBuf, AssetsNotFound> {
    let mut folders = Vec::new();
    if let Some(named) = std::env::var_os(ASSETS_VARIABLE) {
        folders.push(PathBuf::from(named));
    } else {
        folders.push(PathBuf::from("assets"));
        if let Ok(program) = std::env::current_exe() {
            folders.extend(
                program
                    .ancestors()
                    .skip(1)
                    .take(3)
                    .map(|p| p.join("assets")),
            );
        }
        folders.push(PathBuf::from(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../assets"
        )));
    }
    let found = folders.iter().find(|p| p.join("textures").is_dir());
    found.cloned().ok_or_else(|| AssetsNotFound {
        looked_at: folders
            .iter()
            .map(|p| p.display().to_string())
            .collect::<Vec<_>>()
            .join(", "),
    })
}
