//! Image files in and out: linear float pictures (EXR) and stored numbers (PNG, TIFF).

mod atomic;
mod encoded;
mod exr;
mod png_tiff;

use std::path::{Path, PathBuf};

pub use atomic::{write_atomically, write_bytes};
pub(crate) use encoded::{Reader, reader};
pub use exr::{ExrImage, Layer, LayerData};
pub use png_tiff::{read_frame, write_frame};
pub use uw_media::encoding::{linear_to_srgb, srgb_to_linear};

/// A picture in linear float: radiance, W/(m² sr), or whatever its maker says.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// R, G, B per pixel, row 0 at the top.
    pub data: Vec<[f32; 3]>,
}

impl Picture {
    /// A picture of zeros.
    pub fn black(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            data: vec![[0.0; 3]; width as usize * height as usize],
        }
    }

    /// Mean of each channel.
    pub fn mean(&self) -> [f64; 3] {
        let count = self.data.len().max(1) as f64;
        std::array::from_fn(|k| {
            self.data
                .iter()
                .map(|pixel| f64::from(pixel[k]))
                .sum::<f64>()
                / count
        })
    }
}

/// A picture of stored numbers, as a sensor gives them and PNG and TIFF hold them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// R, G, B, R, ... row by row from the top.
    pub counts: Counts,
}

/// Stored numbers of one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Counts {
    /// 0 to 255.
    Bits8(Vec<u8>),
    /// 0 to 65535.
    Bits16(Vec<u16>),
}

impl Frame {
    /// The numbers on the scale of 8 bits, 0 to 255: 16-bit ones are divided by 257.
    pub fn in_8_bit_counts(&self) -> Vec<[f64; 3]> {
        match &self.counts {
            Counts::Bits8(counts) => counts
                .chunks_exact(3)
                .map(|c| [c[0], c[1], c[2]].map(f64::from))
                .collect(),
            Counts::Bits16(counts) => counts
                .chunks_exact(3)
                .map(|c| [c[0], c[1], c[2]].map(|count| f64::from(count) / 257.0))
                .collect(),
        }
    }
}

/// Kinds of image files that are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// OpenEXR, float32, linear.
    Exr,
    /// PNG, 8 or 16 bits.
    Png,
    /// TIFF, 8 or 16 bits.
    Tiff,
}

impl ImageFormat {
    /// By the extension of a file name, in upper or lower case.
    ///
    /// # Errors
    /// [`ImageError::UnknownExtension`] lists the known ones.
    pub fn of(path: &Path) -> Result<Self, ImageError> {
        let extension = path
            .extension()
            .and_then(|extension| extension.to_str())
            .unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "exr" => Ok(Self::Exr),
            "png" => Ok(Self::Png),
            "tif" | "tiff" => Ok(Self::Tiff),
            _ => Err(ImageError::UnknownExtension {
                path: path.to_path_buf(),
            }),
        }
    }
}

/// Why an image file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The extension says nothing about the format.
    #[error("{}: the extension must be one of .exr, .png, .tif, .tiff", path.display())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// The system refused to open, write or rename.
    #[error("{}: cannot be {action}: {source}", path.display())]
    System {
        /// The file.
        path: PathBuf,
        /// "read" or "written".
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not what it should be, or the picture does not fit the format.
    #[error("{}: {reason}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_known_by_extension() {
        for (name, format) in [
            ("a.exr", ImageFormat::Exr),
            ("a.PNG", ImageFormat::Png),
            ("b.x.tiff", ImageFormat::Tiff),
        ] {
            assert_eq!(ImageFormat::of(Path::new(name)).ok(), Some(format));
        }
        for name in ["a.bmp", "a", "exr"] {
            let error = ImageFormat::of(Path::new(name))
                .expect_err(name)
                .to_string();
            assert!(
                error.contains(name) && error.contains(".exr, .png, .tif, .tiff"),
                "{error}"
            );
        }
    }

    #[test]
    fn sixteen_bit_counts_are_scaled() {
        let frame = Frame {
            width: 1,
            height: 1,
            counts: Counts::Bits16(vec![0, 257, 65535]),
        };
        assert_eq!(frame.in_8_bit_counts(), [[0.0, 1.0, 255.0]]);
    }
}
