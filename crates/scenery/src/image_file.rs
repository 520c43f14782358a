//! Reflectance pictures as encoded image files.

use super::SceneryError;
use super::textures::ReflectanceImage;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// The picture as an 8-bit sRGB PNG file.
pub fn png_bytes(picture: &ReflectanceImage) -> Result<Vec<u8>, SceneryError> {
    let mut file = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::Avg);
    encode(encoder, picture, "PNG")?;
    Ok(file)
}

/// The picture as an 8-bit sRGB JPEG file of a quality in 1..=100.
pub fn jpeg_bytes(picture: &ReflectanceImage, quality: u8) -> Result<Vec<u8>, SceneryError> {
    let mut file = Vec::new();
    encode(
        JpegEncoder::new_with_quality(&mut file, quality),
        picture,
        "JPEG",
    )?;
    Ok(file)
}

fn encode(
    encoder: impl ImageEncoder,
    picture: &ReflectanceImage,
    format: &'static str,
) -> Result<(), SceneryError> {
    encoder
        .write_image(
            &picture.srgb_bytes(),
            picture.width,
            picture.height,
            ExtendedColorType::Rgb8,
        )
        .map_err(|source| SceneryError::Encode {
            format,
            width: picture.width,
            height: picture.height,
            source,
        })
}
