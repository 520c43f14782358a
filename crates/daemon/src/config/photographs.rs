//! The files of `[images]` that say what is done to pictures: mask and undistortion.

use uw_calib::{Mask, MaskError, Undistortion, UndistortionError};

use super::Config;

/// Why pictures cannot be treated as `[images]` says.
#[derive(Debug, thiserror::Error)]
pub enum PhotographsError {
    /// The mask.
    #[error("images.mask: {0}")]
    Mask(#[from] MaskError),
    /// The undistortion.
    #[error("images.undistortion: {0}")]
    Undistortion(#[from] UndistortionError),
}

impl Config {
    /// Reads the files of `[images]` that say what is done to pictures: mask and undistortion.
    ///
    /// # Errors
    /// A file that cannot be used.
    pub fn read_photographs(&mut self) -> Result<(), PhotographsError> {
        let mask = self.mask.as_deref().map(Mask::read).transpose()?;
        let undistortion = self.undistortion.as_deref().map(Undistortion::read);
        let undistortion = undistortion.transpose()?;
        self.settings.photographed(mask, undistortion);
        Ok(())
    }
}
