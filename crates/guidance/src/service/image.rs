//! The image of `suggest_image`: which files may be read, and its statistics.

use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use uw_calib::PatchGrid;

use crate::feed::Picture;
use crate::wire::reply::{self, COUNTS_DECIMALS, Code, WireError};
use crate::wire::request::ImageSource;

/// Largest image file read for a request, bytes; above that of any camera's single frame.
const MAX_IMAGE_FILE_BYTES: u64 = 256 << 20;

/// Which image files clients may name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ImagePolicy {
    /// Any file the daemon can read: for clients on the same machine, which could read it themselves.
    #[default]
    AnyFile,
    /// Files under this directory, links followed; relative names start there.
    Under(PathBuf),
    /// None; images come in base64.
    NoFile,
}

impl ImagePolicy {
    /// The file meant, if it may be read.
    fn resolve(&self, path: &str) -> Result<PathBuf, String> {
        let cannot = |error| format!("image.path cannot be read: {error}");
        match self {
            Self::AnyFile => Ok(PathBuf::from(path)),
            Self::NoFile => Err(
                "image.path must be absent (no image directory is configured), got a path"
                    .to_owned(),
            ),
            Self::Under(directory) => {
                let directory = directory.canonicalize().map_err(cannot)?;
                let file = directory.join(path).canonicalize().map_err(cannot)?;
                if file.starts_with(&directory) {
                    Ok(file)
                } else {
                    let expected = "a file under the configured image directory";
                    Err(format!("image.path must be {expected}, got one elsewhere"))
                }
            }
        }
    }
}

/// Reads and measures an image.
pub(super) fn measure(image: &ImageSource, policy: &ImagePolicy) -> Result<Picture, WireError> {
    let bad = |field: &str, message: String| WireError::new(Code::BadImage, message).at(field);
    let grid = match image {
        ImageSource::Path(path) => {
            let field = "image.path";
            let file = policy
                .resolve(path)
                .map_err(|message| bad(field, message))?;
            of_file(&file).map_err(|message| bad(field, message))?
        }
        ImageSource::Base64(text) => {
            let field = "image.base64_png";
            let bytes = base64::engine::general_purpose::STANDARD
                .decode(text)
                .map_err(|error| bad(field, format!("image.base64_png is not base64: {error}")))?;
            PatchGrid::from_encoded(&bytes, field).map_err(|error| bad(field, error.to_string()))?
        }
    };
    // A picture that is decoded has far fewer pixels a side than this could hold.
    let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
    Ok(Picture {
        mean: grid.stats.mean.map(told),
        std: grid.stats.contrast.map(told),
        size_px: Some([side(grid.width), side(grid.height)]),
    })
}

/// The advice is made from what the reply tells, so that it can be made again from a recording.
fn told(counts: f64) -> f64 {
    reply::rounded(counts, COUNTS_DECIMALS)
}

fn of_file(path: &Path) -> Result<PatchGrid, String> {
    // A device or a pipe could be endless, or never answer.
    let file = fs::metadata(path).map_err(|error| format!("image.path cannot be read: {error}"))?;
    if !file.is_file() || file.len() > MAX_IMAGE_FILE_BYTES {
        let expected = "a file of at most 256 MiB";
        return Err(format!("image.path must be {expected}, got something else"));
    }
    PatchGrid::from_file(path).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_outside_the_directory_are_refused_links_and_dots_too() {
        let dir = tempfile::tempdir().unwrap();
        let images = dir.path().join("images");
        fs::create_dir(&images).unwrap();
        fs::write(images.join("inside.png"), "x").unwrap();
        fs::write(dir.path().join("outside.png"), "x").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink("../outside.png", images.join("link.png")).unwrap();
        let policy = ImagePolicy::Under(images.clone());
        assert!(policy.resolve("inside.png").is_ok());
        let absolute = images.join("inside.png").display().to_string();
        assert!(policy.resolve(&absolute).is_ok());
        for path in ["../outside.png", "link.png", "/etc/passwd"] {
            let error = policy.resolve(path).unwrap_err();
            assert!(error.contains("elsewhere"), "{path}: {error}");
        }
        assert!(ImagePolicy::NoFile.resolve("inside.png").is_err());
    }
}
