//! How long a large picture takes to be written, so that a time limit can leave room for it.

use std::path::Path;
use std::time::{Duration, Instant};

use uw_render::image::{ExrImage, ImageError, ImageFormat, Picture, write_frame};
use uw_render::scene::Sensor;

/// Pixels from which on writing takes long enough to matter.
const LARGE: u64 = 1 << 22;
/// Size of the picture that is written for trial, pixels.
const TRIAL_PX: (u32, u32) = (1024, 512);
/// Largest part of a time limit that is left for writing: something has to be rendered too.
const MOST: f64 = 0.8;

/// A picture to be written.
pub(super) struct Writing<'a> {
    pub(super) file: &'a Path,
    pub(super) format: ImageFormat,
    pub(super) sensor: Sensor,
    pub(super) pixels: u64,
    /// Layers beside the picture itself.
    pub(super) layers: usize,
}

impl Writing<'_> {
    /// Time to leave for writing out of `limit`: reckoned from a smaller picture that is written for trial beside the file.
    /// None for pictures of ordinary size, and where the trial fails, as the writing itself will then.
    pub(super) fn reserve(&self, limit: Duration) -> Duration {
        if self.pixels < LARGE {
            return Duration::ZERO;
        }
        let (width, height) = TRIAL_PX;
        let Ok(trial) = self.trial(&noise(width, height)) else {
            return Duration::ZERO;
        };
        let times = self.pixels as f64 / f64::from(width * height);
        let layers = match self.format {
            ImageFormat::Exr => 1 + self.layers,
            ImageFormat::Png | ImageFormat::Tiff => 1,
        };
        let whole = trial.as_secs_f64() * times * layers as f64;
        let most = MOST * limit.as_secs_f64();
        Duration::try_from_secs_f64(whole.min(most)).unwrap_or(Duration::ZERO)
    }

    fn trial(&self, picture: &Picture) -> Result<Duration, ImageError> {
        let folder = match self.file.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let extension = self.file.extension().unwrap_or_default().to_string_lossy();
        let suffix = format!(".{extension}");
        let made = tempfile::Builder::new().suffix(&suffix).tempfile_in(folder);
        let file = made.map_err(|source| ImageError::System {
            path: folder.to_path_buf(),
            action: "written",
            source,
        })?;
        let start = Instant::now();
        match self.format {
            ImageFormat::Exr => ExrImage::new(picture.clone()).write(file.path())?,
            ImageFormat::Png | ImageFormat::Tiff => {
                write_frame(file.path(), &self.sensor.expose(picture, 0))?;
            }
        }
        Ok(start.elapsed())
    }
}

/// A picture of noise, which takes longest to compress.
fn noise(width: u32, height: u32) -> Picture {
    let mut state = 1_u32;
    let mut next = || {
        // The generator of Numerical Recipes, 32 bits.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state as f32 / u32::MAX as f32
    };
    let mut picture = Picture::black(width, height);
    for pixel in &mut picture.data {
        *pixel = [next(), next(), next()];
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;

    fn writing(file: &Path, pixels: u64) -> Writing<'_> {
        Writing {
            file,
            format: ImageFormat::Png,
            sensor: Sensor::default(),
            pixels,
            layers: 0,
        }
    }

    #[test]
    fn large_pictures_get_time_for_writing_and_leave_no_file() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("out.png");
        let limit = Duration::from_secs(3600);
        assert_eq!(writing(&file, LARGE - 1).reserve(limit), Duration::ZERO);
        let some = writing(&file, 1 << 24).reserve(limit);
        assert!(some > Duration::ZERO && some < limit / 2, "{some:?}");
        let short = Duration::from_millis(2);
        assert_eq!(writing(&file, 1 << 26).reserve(short), short.mul_f64(MOST));
        let nowhere = folder.path().join("no/out.png");
        assert_eq!(writing(&nowhere, 1 << 24).reserve(limit), Duration::ZERO);
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 0);
    }
}
