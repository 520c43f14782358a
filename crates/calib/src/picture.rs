//! Pictures from files, in 8-bit counts.

use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

use image::{DynamicImage, ImageDecoder as _, ImageReader, ImageResult, Limits};

use crate::even::Even;
use crate::photo::Origin;
use crate::planes::Planes;
use crate::processing::jpeg_quality;
use crate::stats::{self, PATCH_COLUMNS, PATCH_ROWS, StatsError};

/// Longest image side that is decoded, pixels; several times that of any camera on a vehicle.
const MAX_SIDE_PX: u32 = 32_768;
/// Memory the decoder may take, bytes, so that a small hostile file cannot ask for all of it.
const MAX_DECODE_BYTES: u64 = 512 << 20;
/// 8-bit counts per 16-bit count.
pub(crate) const COUNTS_PER_U16: f64 = 255.0 / 65_535.0;

/// A file in memory, decoded once for all that is asked of it.
#[derive(Debug)]
pub struct Decoded {
    pub(crate) planes: Planes,
    /// Counts from one stored value to the next.
    pub(crate) step: f64,
    pub(crate) name: String,
    /// Quality of a JPEG.
    pub(crate) jpeg_quality: Option<u8>,
}

impl Decoded {
    /// The bytes of a PNG, TIFF or JPEG file, turned upright as its EXIF says; `name` is for messages.
    ///
    /// # Errors
    /// It is no picture that can be decoded, of 8 or 16 bits per channel.
    pub fn new(bytes: &[u8], name: &str) -> Result<Self, StatsError> {
        let image = decode(Box::new(Cursor::new(bytes)), name)?;
        Ok(Self {
            planes: Planes::of_image(&image, name, &|count| count)?,
            step: step(&image),
            name: name.to_owned(),
            jpeg_quality: jpeg_quality(bytes),
        })
    }
}

/// A picture as it is stored, or one that was made of such.
#[derive(Clone, Debug, PartialEq)]
pub struct Counts {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// R, G, B per pixel, row by row from the top left, 8-bit counts in [0, 255].
    pub pixels: Vec<[f64; 3]>,
    /// What it has of the stored pictures' noise; `None` where it is one itself.
    pub origin: Option<Origin>,
}

impl Counts {
    /// As the camera stored it: of `width` × `height` `pixels`.
    pub fn stored(width: usize, height: usize, pixels: Vec<[f64; 3]>) -> Self {
        Self {
            width,
            height,
            pixels,
            origin: None,
        }
    }

    /// Reads a PNG, TIFF or JPEG file, turned upright as its EXIF says; alpha is ignored, grey is replicated. `even` takes its lens out.
    ///
    /// # Errors
    /// The file cannot be read, or is no picture of 8 or 16 bits per channel.
    pub fn read(path: &Path, even: Option<&Even>) -> Result<Self, StatsError> {
        let (image, name) = of_file(path)?;
        Ok(Self::of(&image, &name)?.evened(even))
    }

    /// The same of a file held in memory; `name` is for messages.
    ///
    /// # Errors
    /// It is no picture of 8 or 16 bits per channel.
    pub fn from_encoded(bytes: &[u8], name: &str, even: Option<&Even>) -> Result<Self, StatsError> {
        Ok(Self::of_decoded(&Decoded::new(bytes, name)?, even))
    }

    /// The same of a decoded one.
    pub fn of_decoded(decoded: &Decoded, even: Option<&Even>) -> Self {
        Self::of_planes(&decoded.planes).evened(even)
    }

    /// Without what a lens does, where one is given.
    pub(crate) fn evened(mut self, even: Option<&Even>) -> Self {
        if let Some(even) = even {
            even.apply(&mut self);
        }
        self
    }

    fn of(image: &DynamicImage, name: &str) -> Result<Self, StatsError> {
        let planes = Planes::of_image(image, name, &|count| count)?;
        Ok(Self::of_planes(&planes))
    }

    /// With masked and unseen pixels (NaN) at the mean of the known ones of their patch of the 10 × 6 grid, or of the picture where there is none.
    pub fn filled(mut self) -> Self {
        if self.pixels.iter().flatten().all(|counts| !counts.is_nan()) {
            return self;
        }
        let grid = stats::patch_statistics(self.width, self.height, |i| self.pixels[i]);
        let Ok(grid) = grid else {
            return self;
        };
        let side = [self.width / PATCH_COLUMNS, self.height / PATCH_ROWS];
        for (i, pixel) in self.pixels.iter_mut().enumerate() {
            let column = (i % self.width / side[0]).min(PATCH_COLUMNS - 1);
            let row = (i / self.width / side[1]).min(PATCH_ROWS - 1);
            let patch = grid.patches[row * PATCH_COLUMNS + column].mean;
            for (k, counts) in pixel.iter_mut().enumerate().filter(|(_, c)| c.is_nan()) {
                *counts = match patch[k] {
                    unknown if unknown.is_nan() => grid.stats.mean[k],
                    mean => mean,
                };
            }
        }
        self
    }

    pub(crate) fn of_planes(planes: &Planes) -> Self {
        let [red, green, blue] = &planes.channels;
        let rows = red.iter().zip(green).zip(blue);
        let pixels = rows.map(|((&r, &g), &b)| [r, g, b]).collect();
        Self::stored(planes.width, planes.height, pixels)
    }
}

/// What files and memory have in common, so that the decoders are compiled for one type.
pub(crate) trait Encoded: Read + Seek {}

impl<T: Read + Seek> Encoded for T {}

/// The decoded file and its name.
pub(crate) fn of_file(path: &Path) -> Result<(DynamicImage, String), StatsError> {
    let name = path.display().to_string();
    let file = File::open(path).map_err(|source| StatsError::Read {
        name: name.clone(),
        source,
    })?;
    Ok((decode(Box::new(file), &name)?, name))
}

pub(crate) fn decode(
    encoded: Box<dyn Encoded + '_>,
    name: &str,
) -> Result<DynamicImage, StatsError> {
    let mut reader = ImageReader::new(BufReader::new(encoded))
        .with_guessed_format()
        .map_err(|source| StatsError::Read {
            name: name.to_owned(),
            source,
        })?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE_PX);
    limits.max_image_height = Some(MAX_SIDE_PX);
    limits.max_alloc = Some(MAX_DECODE_BYTES);
    reader.limits(limits.clone());
    let upright = || -> ImageResult<DynamicImage> {
        let mut decoder = reader.into_decoder()?;
        limits.reserve(decoder.total_bytes())?;
        let orientation = decoder.orientation()?;
        let mut image = DynamicImage::from_decoder(decoder)?;
        image.apply_orientation(orientation);
        Ok(image)
    };
    upright().map_err(|source| StatsError::Decode {
        name: name.to_owned(),
        source,
    })
}

/// Counts from one stored value to the next.
pub(crate) fn step(image: &DynamicImage) -> f64 {
    match image.color().bytes_per_pixel() > image.color().channel_count() {
        true => COUNTS_PER_U16,
        false => 1.0,
    }
}
