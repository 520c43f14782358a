//! Pictures as messages bring them, compressed or as pixels, as the files that the protocol takes.

use std::borrow::Cow;
use std::io::Cursor;

use image::codecs::tiff::TiffEncoder;
use image::{ExtendedColorType, ImageEncoder as _};

use super::colours::{Chroma, Mosaic, Rows};
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

/// Channels of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Channels {
    count: usize,
    /// Bytes of a channel.
    bytes: usize,
    /// Which channels are red, green and blue; one alone is grey.
    order: &'static [usize],
}

/// What is stored of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layout {
    Channels(Channels),
    Mosaic(Mosaic),
    Chroma(Chroma),
}

impl Layout {
    /// Bytes of a pixel.
    fn pixel(self) -> usize {
        match self {
            Self::Channels(channels) => channels.count * channels.bytes,
            Self::Mosaic(mosaic) => mosaic.bytes,
            Self::Chroma(_) => 2,
        }
    }

    /// Least width and height, and of what the width is a multiple, pixels.
    fn least(self) -> ([u32; 2], u32) {
        match self {
            Self::Channels(_) => ([1, 1], 1),
            Self::Mosaic(_) => ([2, 2], 1),
            Self::Chroma(_) => ([2, 1], 2),
        }
    }
}

const RGB: &[usize] = &[0, 1, 2];
const BGR: &[usize] = &[2, 1, 0];
/// The encodings that are read, as `sensor_msgs/image_encodings.hpp` names them.
const KNOWN: [(&str, Layout); 22] = [
    ("rgb8", channels(3, 1, RGB)),
    ("bgr8", channels(3, 1, BGR)),
    ("rgba8", channels(4, 1, RGB)),
    ("bgra8", channels(4, 1, BGR)),
    ("mono8", channels(1, 1, &[0])),
    ("rgb16", channels(3, 2, RGB)),
    ("bgr16", channels(3, 2, BGR)),
    ("rgba16", channels(4, 2, RGB)),
    ("bgra16", channels(4, 2, BGR)),
    ("mono16", channels(1, 2, &[0])),
    ("bayer_rggb8", mosaic([0, 0], 1)),
    ("bayer_bggr8", mosaic([1, 1], 1)),
    ("bayer_grbg8", mosaic([1, 0], 1)),
    ("bayer_gbrg8", mosaic([0, 1], 1)),
    ("bayer_rggb16", mosaic([0, 0], 2)),
    ("bayer_bggr16", mosaic([1, 1], 2)),
    ("bayer_grbg16", mosaic([1, 0], 2)),
    ("bayer_gbrg16", mosaic([0, 1], 2)),
    ("yuv422", chroma(false)),
    ("uyvy", chroma(false)),
    ("yuv422_yuy2", chroma(true)),
    ("yuyv", chroma(true)),
];

const fn channels(count: usize, bytes: usize, order: &'static [usize]) -> Layout {
    Layout::Channels(Channels {
        count,
        bytes,
        order,
    })
}

const fn mosaic(red: [usize; 2], bytes: usize) -> Layout {
    Layout::Mosaic(Mosaic { red, bytes })
}

const fn chroma(luma_first: bool) -> Layout {
    Layout::Chroma(Chroma { luma_first })
}

/// The layout of an encoding, or why it is not read.
fn layout_of(encoding: &str) -> Result<Layout, String> {
    if let Some((_, found)) = KNOWN.iter().find(|(known, _)| *known == encoding) {
        return Ok(*found);
    }
    let known: Vec<&str> = KNOWN.iter().map(|(known, _)| *known).collect();
    Err(format!(
        "encoding must be one of {}, got {encoding:?}",
        known.join(", ")
    ))
}

/// Refuses sizes that do not fit each other or the data.
fn check_size(image: &Image, layout: Layout) -> Result<(), String> {
    let (width, height, step) = (image.width, image.height, image.step);
    let pixel = layout.pixel();
    let ([across, down], multiple) = layout.least();
    if width < across || height < down {
        return Err(format!(
            "width and height must be at least {across} and {down} for {}, got {width} and {height}",
            image.encoding
        ));
    }
    if width % multiple != 0 {
        return Err(format!(
            "width must be a multiple of {multiple} for {}, got {width}",
            image.encoding
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
    let rows = Rows {
        data: &image.data,
        step,
        width,
        height,
    };
    let is_bigendian = image.is_bigendian != 0;
    let (samples, colour) = match layout {
        Layout::Channels(channels) => of_channels(&rows, channels, is_bigendian),
        Layout::Mosaic(mosaic) => of_mosaic(&rows, mosaic, is_bigendian),
        Layout::Chroma(chroma) => (chroma.colours(&rows), ExtendedColorType::Rgb8),
    };
    let mut file = Cursor::new(Vec::with_capacity(samples.len() + 1024));
    TiffEncoder::new(&mut file)
        .write_image(&samples, image.width, image.height, colour)
        .map_err(|error| format!("no picture of {width} × {height} pixels: {error}"))?;
    Ok(file.into_inner())
}

/// Samples in this machine's order of bytes.
fn of_channels(
    rows: &Rows<'_>,
    channels: Channels,
    is_bigendian: bool,
) -> (Vec<u8>, ExtendedColorType) {
    let size = rows.width * rows.height * channels.order.len() * channels.bytes;
    let mut samples = Vec::with_capacity(size);
    for y in 0..rows.height {
        let row = rows.row(y, rows.width * channels.count * channels.bytes);
        copy_row(row, channels, is_bigendian, &mut samples);
    }
    let colour = match (channels.order.len(), channels.bytes) {
        (1, 1) => ExtendedColorType::L8,
        (1, _) => ExtendedColorType::L16,
        (_, 1) => ExtendedColorType::Rgb8,
        (_, _) => ExtendedColorType::Rgb16,
    };
    (samples, colour)
}

fn of_mosaic(rows: &Rows<'_>, mosaic: Mosaic, is_bigendian: bool) -> (Vec<u8>, ExtendedColorType) {
    let colours = mosaic.colours(rows, is_bigendian);
    match mosaic.bytes {
        // Means of samples of 8 bits have 8 bits.
        1 => {
            let samples = colours.into_iter().map(|sample| sample as u8).collect();
            (samples, ExtendedColorType::Rgb8)
        }
        _ => {
            let samples = colours.into_iter().flat_map(u16::to_ne_bytes).collect();
            (samples, ExtendedColorType::Rgb16)
        }
    }
}

/// The samples of a row in the order of the file, in this machine's order of bytes.
fn copy_row(row: &[u8], channels: Channels, is_bigendian: bool, samples: &mut Vec<u8>) {
    let swapped = channels.bytes == 2 && is_bigendian != cfg!(target_endian = "big");
    if !swapped && channels.order == &RGB[..channels.count.min(3)] && channels.count != 4 {
        samples.extend_from_slice(row);
        return;
    }
    for pixel in row.chunks_exact(channels.count * channels.bytes) {
        for &channel in channels.order {
            let sample = &pixel[channel * channels.bytes..][..channels.bytes];
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
        let Ok(Layout::Channels(layout)) = layout_of(encoding) else {
            panic!("{encoding} has no channels");
        };
        let order = match encoding.starts_with("bgr") {
            true => [2, 1, 0],
            false => [0, 1, 2],
        };
        let mut data = Vec::new();
        for row in pixels.chunks(2) {
            for pixel in row {
                let mut stored = [pixel[3]; 4];
                for (channel, &value) in order.into_iter().zip(pixel).take(layout.count) {
                    stored[channel] = value;
                }
                for value in &stored[..layout.count] {
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
            step: u32::try_from(2 * layout.count * layout.bytes + 5).unwrap(),
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
            let Layout::Channels(layout) = layout else {
                continue;
            };
            for is_bigendian in [false, true] {
                // Counts of 16 bits are 257 to one of 8.
                let scale = if layout.bytes == 2 { 257 } else { 1 };
                let stored = small.map(|pixel| pixel.map(|value| value * scale));
                let picture = Picture::Raw(image(encoding, is_bigendian, &stored));
                let file = picture.file().unwrap();
                let counts = Counts::from_encoded(&file, encoding, None).unwrap();
                assert_eq!((counts.width, counts.height), (2, 2));
                for (pixel, expected) in counts.pixels.iter().zip(small) {
                    let grey = layout.count == 1;
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
    fn filters_and_differences_of_colour_are_read_in_their_order() {
        // A picture of one colour, as each of the encodings has it.
        let of = |encoding: &str, rows: [&[u8]; 2]| {
            let image = Image {
                header: Header::default(),
                height: 2,
                width: 2,
                encoding: encoding.to_owned(),
                is_bigendian: 1,
                step: rows[0].len() as u32,
                data: rows.concat(),
            };
            let file = Picture::Raw(image).file().unwrap().into_owned();
            let counts = Counts::from_encoded(&file, encoding, None).unwrap();
            assert_eq!((counts.width, counts.height), (2, 2));
            counts.pixels
        };
        let expected = [[10.0, 80.0, 200.0]; 4];
        let filters = [
            ("rggb", [[10, 80], [80, 200]]),
            ("bggr", [[200, 80], [80, 10]]),
            ("grbg", [[80, 10], [200, 80]]),
            ("gbrg", [[80, 200], [10, 80]]),
        ];
        for (name, [upper, lower]) in filters {
            assert_eq!(of(&format!("bayer_{name}8"), [&upper, &lower]), expected);
            let twice = |row: [u8; 2]| row.map(|sample| [sample, sample]).concat();
            let rows = [twice(upper), twice(lower)];
            let found = of(&format!("bayer_{name}16"), [&rows[0], &rows[1]]);
            assert_eq!(found, expected);
        }
        let red = [[255.0, 0.0, 0.0]; 4];
        for (encoding, row) in [
            ("yuv422", [90, 81, 240, 81]),
            ("uyvy", [90, 81, 240, 81]),
            ("yuv422_yuy2", [81, 90, 81, 240]),
            ("yuyv", [81, 90, 81, 240]),
        ] {
            for (found, expected) in of(encoding, [&row, &row]).iter().zip(red) {
                let near = (0..3).all(|k| (found[k] - expected[k]).abs() <= 1.0);
                assert!(near, "{encoding}: {found:?}");
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
        let other = told(|image| image.encoding = "8UC3".to_owned());
        assert!(other.ends_with("yuyv, got \"8UC3\""), "{other}");
        assert!(told(|image| image.width = 0).contains("at least 1 and 1 for bgr8, got 0 and 2"));
        let narrow = |image: &mut Image| {
            image.encoding = "bayer_rggb8".to_owned();
            image.width = 1;
        };
        assert!(told(narrow).contains("at least 2 and 2 for bayer_rggb8, got 1 and 2"));
        let odd = |image: &mut Image| {
            image.encoding = "yuyv".to_owned();
            image.width = 3;
        };
        assert!(told(odd).contains("a multiple of 2 for yuyv, got 3"));
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
