//! Pictures as messages bring them, compressed or as pixels, as the files that the protocol takes.

use std::borrow::Cow;
use std::io::Cursor;

use image::codecs::tiff::TiffEncoder;
use image::{ExtendedColorType, ImageEncoder as _};

use super::messages::{CompressedImage, Header, Image};

/// A picture of either type.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Picture {
    Compressed(CompressedImage),
    Raw(Image),
}

impl Picture {
    pub(super) fn header(&self) -> &Header {
        match self {
            Self::Compressed(image) => &image.header,
            Self::Raw(image) => &image.header,
        }
    }

    /// The bytes of a file: a compressed picture as it came, pixels as TIFF, which takes least time and loses nothing.
    ///
    /// # Errors
    /// The pixels are none that are known, or too few.
    pub(super) fn file(&self) -> Result<Cow<'_, [u8]>, String> {
        match self {
            Self::Compressed(image) => Ok(Cow::Borrowed(&image.data)),
            Self::Raw(image) => tiff(image).map(Cow::Owned),
        }
    }
}

/// What a pixel is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Layout {
    channels: usize,
    /// Bytes of a channel.
    bytes: usize,
    /// Which channels are red, green and blue; one alone is grey.
    order: &'static [usize],
}

const RGB: &[usize] = &[0, 1, 2];
const BGR: &[usize] = &[2, 1, 0];
/// The encodings that are read, as `sensor_msgs/image_encodings.hpp` names them.
const KNOWN: [(&str, Layout); 10] = [
    ("rgb8", layout(3, 1, RGB)),
    ("bgr8", layout(3, 1, BGR)),
    ("rgba8", layout(4, 1, RGB)),
    ("bgra8", layout(4, 1, BGR)),
    ("mono8", layout(1, 1, &[0])),
    ("rgb16", layout(3, 2, RGB)),
    ("bgr16", layout(3, 2, BGR)),
    ("rgba16", layout(4, 2, RGB)),
    ("bgra16", layout(4, 2, BGR)),
    ("mono16", layout(1, 2, &[0])),
];

const fn layout(channels: usize, bytes: usize, order: &'static [usize]) -> Layout {
    Layout {
        channels,
        bytes,
        order,
    }
}

/// The layout of an encoding, or why it is not read.
fn layout_of(encoding: &str) -> Result<Layout, String> {
    if let Some((_, found)) = KNOWN.iter().find(|(known, _)| *known == encoding) {
        return Ok(*found);
    }
    let hint = match encoding {
        bayer if bayer.starts_with("bayer_") => {
            "; image_proc publishes such pictures in colour as image_color: name that in ros2.image_topic"
        }
        _ => "",
    };
    let known: Vec<&str> = KNOWN.iter().map(|(known, _)| *known).collect();
    Err(format!(
        "encoding must be one of {}, got {encoding:?}{hint}",
        known.join(", ")
    ))
}

/// Refuses sizes that do not fit each other or the data.
fn check_size(image: &Image, layout: Layout) -> Result<(), String> {
    let (width, height, step) = (image.width, image.height, image.step);
    let pixel = layout.channels * layout.bytes;
    if width == 0 || height == 0 {
        return Err(format!(
            "width and height must be above 0, got {width} and {height}"
        ));
    }
    let row = u64::from(width) * pixel as u64;
    if u64::from(step) < row {
        return Err(format!(
            "step must be at least {row} bytes ({width} pixels of {pixel}), got {step}"
        ));
    }
    let needed = u64::from(step) * (u64::from(height) - 1) + row;
    let given = image.data.len();
    match given as u64 >= needed {
        true => Ok(()),
        false => Err(format!(
            "data must have at least {needed} bytes ({height} rows of {step}), got {given}"
        )),
    }
}

/// The pixels as an uncompressed TIFF without alpha.
fn tiff(image: &Image) -> Result<Vec<u8>, String> {
    let layout = layout_of(&image.encoding)?;
    check_size(image, layout)?;
    let [width, height, step] = [image.width, image.height, image.step].map(|side| side as usize);
    let row = width * layout.channels * layout.bytes;
    let mut samples = Vec::with_capacity(width * height * layout.order.len() * layout.bytes);
    for row in image.data.chunks(step).take(height).map(|all| &all[..row]) {
        copy_row(row, layout, image.is_bigendian != 0, &mut samples);
    }
    let colour = match (layout.order.len(), layout.bytes) {
        (1, 1) => ExtendedColorType::L8,
        (1, _) => ExtendedColorType::L16,
        (_, 1) => ExtendedColorType::Rgb8,
        (_, _) => ExtendedColorType::Rgb16,
    };
    let mut file = Cursor::new(Vec::with_capacity(samples.len() + 1024));
    TiffEncoder::new(&mut file)
        .write_image(&samples, image.width, image.height, colour)
        .map_err(|error| format!("no picture of {width} × {height} pixels: {error}"))?;
    Ok(file.into_inner())
}

/// The samples of a row in the order of the file, in this machine's order of bytes.
fn copy_row(row: &[u8], layout: Layout, is_bigendian: bool, samples: &mut Vec<u8>) {
    let swapped = layout.bytes == 2 && is_bigendian != cfg!(target_endian = "big");
    if !swapped && layout.order == &RGB[..layout.channels.min(3)] && layout.channels != 4 {
        samples.extend_from_slice(row);
        return;
    }
    for pixel in row.chunks_exact(layout.channels * layout.bytes) {
        for &channel in layout.order {
            let sample = &pixel[channel * layout.bytes..][..layout.bytes];
            match swapped {
                true => samples.extend(sample.iter().rev()),
                false => samples.extend_from_slice(sample),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use uw_calib::picture::Counts;

    use super::*;

    /// Two rows of two pixels, with bytes of no meaning behind each row.
    fn image(encoding: &str, is_bigendian: bool, pixels: &[[u16; 4]; 4]) -> Image {
        let layout = layout_of(encoding).unwrap();
        let order = match encoding.starts_with("bgr") {
            true => [2, 1, 0],
            false => [0, 1, 2],
        };
        let mut data = Vec::new();
        for row in pixels.chunks(2) {
            for pixel in row {
                let mut stored = [pixel[3]; 4];
                for (channel, &value) in order.into_iter().zip(pixel).take(layout.channels) {
                    stored[channel] = value;
                }
                for value in &stored[..layout.channels] {
                    match (layout.bytes, is_bigendian) {
                        (1, _) => data.push(u8::try_from(*value).unwrap()),
                        (_, true) => data.extend(value.to_be_bytes()),
                        (_, false) => data.extend(value.to_le_bytes()),
                    }
                }
            }
            data.extend([99; 5]);
        }
        Image {
            header: Header::default(),
            height: 2,
            width: 2,
            encoding: encoding.to_owned(),
            is_bigendian: is_bigendian.into(),
            step: u32::try_from(2 * layout.channels * layout.bytes + 5).unwrap(),
            data,
        }
    }

    #[test]
    fn pixels_of_every_encoding_are_read_as_they_are() {
        let small = [
            [10, 20, 30, 7],
            [40, 50, 60, 7],
            [70, 80, 90, 7],
            [0, 255, 1, 7],
        ];
        for (encoding, layout) in KNOWN {
            for is_bigendian in [false, true] {
                // Counts of 16 bits are 257 to one of 8.
                let scale = if layout.bytes == 2 { 257 } else { 1 };
                let stored = small.map(|pixel| pixel.map(|value| value * scale));
                let picture = Picture::Raw(image(encoding, is_bigendian, &stored));
                let file = picture.file().unwrap();
                let counts = Counts::from_encoded(&file, encoding, None).unwrap();
                assert_eq!((counts.width, counts.height), (2, 2));
                for (pixel, expected) in counts.pixels.iter().zip(small) {
                    let grey = layout.channels == 1;
                    for k in 0..3 {
                        let expected = f64::from(expected[if grey { 0 } else { k }]);
                        assert!(
                            (pixel[k] - expected).abs() < 1e-9,
                            "{encoding}, big endian {is_bigendian}: {pixel:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn pictures_that_are_none_are_told() {
        let pixels = [[1, 2, 3, 4]; 4];
        let told = |change: fn(&mut Image)| {
            let mut image = image("bgr8", false, &pixels);
            change(&mut image);
            Picture::Raw(image).file().unwrap_err()
        };
        let bayer = told(|image| image.encoding = "bayer_rggb8".to_owned());
        assert!(bayer.contains("got \"bayer_rggb8\"; image_proc"), "{bayer}");
        let other = told(|image| image.encoding = "8UC3".to_owned());
        assert!(other.ends_with("mono16, got \"8UC3\""), "{other}");
        assert!(told(|image| image.width = 0).contains("above 0, got 0 and 2"));
        assert!(told(|image| image.step = 5).contains("at least 6 bytes (2 pixels of 3), got 5"));
        let short = told(|image| image.data.truncate(16));
        assert!(
            short.contains("at least 17 bytes (2 rows of 11), got 16"),
            "{short}"
        );
        assert!(told(|image| image.height = u32::MAX).contains("data must have at least"));
        // What follows the last pixel may be missing.
        let mut whole = image("bgr8", false, &pixels);
        whole.data.truncate(17);
        assert!(Picture::Raw(whole).file().is_ok());
    }
}
