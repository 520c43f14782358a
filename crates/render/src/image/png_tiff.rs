//! PNG and TIFF with 8 or 16 bits per channel, in and out as stored numbers.

use std::fs::File;
use std::path::Path;

use image::codecs::png::PngEncoder;
use image::codecs::tiff::TiffEncoder;
use image::{ColorType, ExtendedColorType, ImageEncoder};

use super::{Counts, Frame, ImageError, ImageFormat, write_atomically};

/// Writes a frame as PNG or TIFF, chosen by the extension. The file appears whole or not at all.
///
/// # Errors
/// An extension other than `.png`, `.tif`, `.tiff`, or a file that cannot be written.
pub fn write_frame(path: &Path, frame: &Frame) -> Result<(), ImageError> {
    let format = ImageFormat::of(path)?;
    write_atomically(path, |writer| {
        let result = match format {
            ImageFormat::Png => encode(PngEncoder::new(writer), frame),
            ImageFormat::Tiff => encode(TiffEncoder::new(writer), frame),
            ImageFormat::Exr => {
                let reason =
                    "stored numbers must go to .png, .tif or .tiff; .exr holds linear light"
                        .to_string();
                return Err(ImageError::Content {
                    path: path.to_path_buf(),
                    reason,
                });
            }
        };
        result.map_err(|error| content(path, error))
    })
}

fn encode(encoder: impl ImageEncoder, frame: &Frame) -> Result<(), image::ImageError> {
    let (width, height) = (frame.width, frame.height);
    match &frame.counts {
        Counts::Bits8(counts) => {
            encoder.write_image(counts, width, height, ExtendedColorType::Rgb8)
        }
        Counts::Bits16(counts) => {
            let bytes: Vec<u8> = counts
                .iter()
                .flat_map(|count| count.to_ne_bytes())
                .collect();
            encoder.write_image(&bytes, width, height, ExtendedColorType::Rgb16)
        }
    }
}

/// Reads the stored numbers of a PNG, TIFF or JPEG file, whatever its extension. Grey becomes three equal
/// channels, transparency is dropped.
///
/// # Errors
/// A file that cannot be read, is none of these, or holds floating-point values.
pub fn read_frame(path: &Path) -> Result<Frame, ImageError> {
    let system = |source| ImageError::System {
        path: path.to_path_buf(),
        action: "read",
        source,
    };
    let file = File::open(path).map_err(system)?;
    let reader = super::reader(file).map_err(system)?;
    let decoded = reader.decode().map_err(|error| content(path, error))?;
    let (width, height) = (decoded.width(), decoded.height());
    let counts = match decoded.color() {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            Counts::Bits8(decoded.into_rgb8().into_raw())
        }
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            Counts::Bits16(decoded.into_rgb16().into_raw())
        }
        other => {
            return Err(content(
                path,
                format!("must have 8 or 16 bits per channel, got {other:?}"),
            ));
        }
    };
    Ok(Frame {
        width,
        height,
        counts,
    })
}

fn content(path: &Path, reason: impl ToString) -> ImageError {
    ImageError::Content {
        path: path.to_path_buf(),
        reason: reason.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(counts: Counts) -> Frame {
        Frame {
            width: 3,
            height: 2,
            counts,
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let folder = tempfile::tempdir().expect("folder");
        let bits8 = frame(Counts::Bits8((0..18).map(|i| i * 14).collect()));
        let bits16 = frame(Counts::Bits16((0..18).map(|i| i * 3700 + 9).collect()));
        for (name, frame) in [
            ("a.png", &bits8),
            ("a.tif", &bits8),
            ("b.png", &bits16),
            ("b.tiff", &bits16),
        ] {
            let path = folder.path().join(name);
            write_frame(&path, frame).expect(name);
            assert_eq!(&read_frame(&path).expect(name), frame, "{name}");
        }
    }

    #[test]
    fn wrong_files_are_refused_by_name() {
        let folder = tempfile::tempdir().expect("folder");
        let missing = folder.path().join("missing.png");
        assert!(
            read_frame(&missing)
                .expect_err("missing")
                .to_string()
                .contains("missing.png: cannot be read")
        );
        let text = folder.path().join("text.png");
        std::fs::write(&text, "not a picture").expect("writable");
        assert!(
            read_frame(&text)
                .expect_err("text")
                .to_string()
                .contains("text.png")
        );
        let exr = folder.path().join("frame.exr");
        assert!(write_frame(&exr, &frame(Counts::Bits8(vec![0; 18]))).is_err());
        assert!(!exr.exists());
    }
}
