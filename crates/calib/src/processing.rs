//! What was done to a picture before it was stored, as far as its file shows it: JPEG compression, and noise that was taken out.
//!
//! Both take noise and fine detail off, and the published contrast, which counts both, and K_c with them. A JPEG's quantisation table is in the file. Denoising shows
//! where the sensor's noise is known: differences of neighbouring pixels ([`crate::noise`]) hold less than it must. They are an upper
//! bound, as fine texture counts in them, so that less is a sign of processing and enough is none that there was no. Sharpening raises
//! them, as fine texture does, and is not seen.

use std::path::Path;

use crate::detail::{Detail, channel_names};
use crate::manifest::Manifest;
use crate::noise::NoiseModel;
use crate::photo::frames;
use crate::picture::Decoded;
use crate::planes::Planes;
use crate::stats::{PatchGrid, StatsError};

/// Sum of the entries of the JPEG standard's luminance table (ITU-T T.81, table K.1), which is that of quality 50.
const STANDARD_SUM: f64 = 3688.0;
/// Entries of a table.
const ENTRIES: usize = 64;
/// A deviation of the noise below this share of the sensor's is no chance: the estimate is good to a few percent.
const LEAST_NOISE: f64 = 0.7;
/// Least noise of a sensor that is told from rounding, 8-bit counts.
const TOLD_COUNTS: f64 = 0.5;
/// Largest share of black or saturated pixels of a channel whose noise is judged: clipping takes noise off, too.
const MOST_CLIPPED: f64 = 0.01;
/// Quality, and the most that it took off the contrast of the shipped targets, as a share (`crates/survey/examples/processing.rs`,
/// docs/vehicle.md).
const TAKEN_OFF: [(u8, f64); 3] = [(75, 0.31), (85, 0.25), (95, 0.18)];

/// What a picture's file shows of its processing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Processing {
    /// Quality of a JPEG on the scale of the IJG's library, 1 to 100; `None` for other files.
    pub jpeg_quality: Option<u8>,
    /// Per channel the noise's deviation over that of the sensor; `None` where the sensor's is not known, below what rounding hides, or
    /// clipped.
    pub noise_share: [Option<f64>; 3],
    /// Whether it does not state how it was exposed, where those that it is compared with did.
    pub unknown_exposure: bool,
}

impl Processing {
    /// Of the bytes of a picture's file; `sensor` is what is known of the noise, `name` is for messages.
    ///
    /// # Errors
    /// It is no picture of 8 or 16 bits per channel.
    pub fn of_encoded(bytes: &[u8], name: &str, sensor: &NoiseModel) -> Result<Self, StatsError> {
        Ok(Self::of(&Decoded::new(bytes, name)?, sensor))
    }

    /// The same of a decoded picture.
    pub fn of(decoded: &Decoded, sensor: &NoiseModel) -> Self {
        Self {
            jpeg_quality: decoded.jpeg_quality,
            noise_share: match sensor {
                NoiseModel::Picture => [None; 3],
                NoiseModel::Sensor(_) => noise_share(&decoded.planes, sensor),
            },
            unknown_exposure: false,
        }
    }

    /// The same of a file.
    ///
    /// # Errors
    /// It cannot be read, or is no picture of 8 or 16 bits per channel.
    pub fn of_file(path: &Path, sensor: &NoiseModel) -> Result<Self, StatsError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| StatsError::Read {
            name: name.clone(),
            source,
        })?;
        Self::of_encoded(&bytes, &name, sensor)
    }

    /// Which channels have less noise than the sensor makes.
    pub fn smoothed(&self) -> [bool; 3] {
        (self.noise_share).map(|share| share.is_some_and(|share| share < LEAST_NOISE))
    }

    /// What should be known of it, a sentence each.
    pub fn warnings(&self) -> Vec<String> {
        self.compressed()
            .into_iter()
            .chain(self.denoised())
            .collect()
    }

    /// About a JPEG.
    pub fn compressed(&self) -> Option<String> {
        let quality = self.jpeg_quality?;
        let most = 100.0 * taken_off(quality);
        Some(format!(
            "a JPEG of quality {quality}: compression takes up to {most:.0} % off the contrast, in turbid water most, where much of it is noise; store PNG or TIFF"
        ))
    }

    /// About noise that is missing.
    pub fn denoised(&self) -> Option<String> {
        let channels = channel_names(self.smoothed())?;
        let least = self
            .noise_share
            .into_iter()
            .flatten()
            .fold(f64::MAX, f64::min);
        Some(format!(
            "{channels}: the noise is {least:.2} times that of the sensor or less, so the picture was denoised, smoothed or compressed, and fine detail with it; \
             store it as the sensor has it, or check noise and encoding"
        ))
    }
}

/// What should be known of the pictures of a manifest, a sentence each, of a folder by its first frame; pictures that cannot be read are passed over.
pub fn warnings_of(manifest: &Manifest, sensor: &NoiseModel) -> Vec<String> {
    let (mut compressed, mut denoised) = (Vec::new(), Vec::new());
    for row in &manifest.rows {
        let files = frames::files(&row.image).unwrap_or_default();
        let found = files.first().map(|file| Processing::of_file(file, sensor));
        let Some(Ok(found)) = found else {
            continue;
        };
        let name = row.image.file_name().unwrap_or_default().to_string_lossy();
        if let Some(quality) = found.jpeg_quality {
            compressed.push((quality, format!("{name} (line {})", row.line)));
        }
        if let Some(channels) = channel_names(found.smoothed()) {
            denoised.push(format!("{name} (line {}; {channels})", row.line));
        }
    }
    let names = compressed
        .iter()
        .map(|(_, name)| name.as_str())
        .collect::<Vec<_>>();
    let worst = compressed.iter().map(|(quality, _)| *quality).min();
    let of_worst = worst.and_then(|quality| {
        let worst = Processing {
            jpeg_quality: Some(quality),
            ..Processing::default()
        };
        Some(format!(
            "{} (the worst of: {})",
            worst.compressed()?,
            names.join("; ")
        ))
    });
    let of_noise = (!denoised.is_empty()).then(|| {
        format!(
            "less noise than the sensor makes: denoised, smoothed or compressed pictures, whose fine detail is gone as well; store them as the sensor has them, or check \
             noise and encoding: {}",
            denoised.join("; ")
        )
    });
    let told = of_worst.into_iter().chain(of_noise);
    told.map(|what| format!("{}: {what}", manifest.path.display()))
        .collect()
}

/// Share of the contrast that a quality takes off at most: that of the nearest one that was measured below it.
fn taken_off(quality: u8) -> f64 {
    let [worst, ..] = TAKEN_OFF;
    let known = TAKEN_OFF.iter().rev().find(|known| known.0 <= quality);
    known.unwrap_or(&worst).1
}

fn noise_share(picture: &Planes, sensor: &NoiseModel) -> [Option<f64>; 3] {
    let Ok(grid) = PatchGrid::of(picture) else {
        return [None; 3];
    };
    let measure = |model: &NoiseModel| Detail::measure(&grid, picture, 1.0, model, None);
    let (Some(found), Some(known)) = (measure(&NoiseModel::Picture), measure(sensor)) else {
        return [None; 3];
    };
    std::array::from_fn(|k| {
        let clipped = known.black[k] + known.saturated[k] > MOST_CLIPPED;
        let told = known.noise[k] >= TOLD_COUNTS && !clipped;
        told.then(|| found.noise[k] / known.noise[k])
    })
}

/// Quality of a JPEG by its luminance table, on the scale of the IJG's library (too high below 20, where entries reach their largest);
/// `None` for other files.
pub fn jpeg_quality(bytes: &[u8]) -> Option<u8> {
    let mut rest = bytes.strip_prefix(&[0xff, 0xd8])?;
    loop {
        let [0xff, marker, tail @ ..] = rest else {
            return None;
        };
        match marker {
            // Fill bytes, and segments without a length.
            0xff => {
                rest = &rest[1..];
                continue;
            }
            0x01 | 0xd0..=0xd7 => {
                rest = tail;
                continue;
            }
            // The picture begins, or ends.
            0xda | 0xd9 => return None,
            _ => {}
        }
        let length = usize::from(u16::from_be_bytes(*tail.first_chunk()?));
        let segment = tail.get(2..length)?;
        if let Some(sum) = (*marker == 0xdb).then(|| luminance_sum(segment)).flatten() {
            let scale = 100.0 * sum / STANDARD_SUM;
            let quality = match scale <= 100.0 {
                true => 100.0 - 0.5 * scale,
                false => 5000.0 / scale,
            };
            return Some(quality.round().clamp(1.0, 100.0) as u8);
        }
        rest = &tail[length..];
    }
}

/// Sum of the entries of table 0, where a segment has it.
fn luminance_sum(mut segment: &[u8]) -> Option<f64> {
    while let [kind, rest @ ..] = segment {
        let wide = kind >> 4 != 0;
        let bytes = ENTRIES * (1 + usize::from(wide));
        let table = rest.get(..bytes)?;
        if kind & 15 == 0 {
            let entries = table.chunks_exact(1 + usize::from(wide));
            let value = |entry: &[u8]| entry.iter().fold(0, |sum, &b| 256 * sum + u32::from(b));
            return Some(f64::from(entries.map(value).sum::<u32>()));
        }
        segment = &rest[bytes..];
    }
    None
}

#[cfg(test)]
mod tests {
    use image::codecs::jpeg::JpegEncoder;
    use image::{ExtendedColorType, ImageEncoder as _, ImageFormat, RgbImage};

    use super::*;
    use crate::Encoding;
    use crate::noise::SensorNoise;
    use crate::normal::Normal;
    use crate::response::LinearNoise;

    fn jpeg(picture: &RgbImage, quality: u8) -> Vec<u8> {
        let mut bytes = Vec::new();
        let (width, height) = picture.dimensions();
        JpegEncoder::new_with_quality(&mut bytes, quality)
            .write_image(picture, width, height, ExtendedColorType::Rgb8)
            .unwrap();
        bytes
    }

    fn png(picture: &RgbImage) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    /// A slope of light with a sensor's noise, mean of `over` frames.
    fn noisy(over: u32) -> RgbImage {
        let mut normal = Normal::new(7);
        RgbImage::from_fn(320, 192, |x, _| {
            let light = 0.1 + 0.3 * f64::from(x) / 320.0;
            let deviation = (1e-3 * light + 1e-5).sqrt() / f64::from(over).sqrt();
            image::Rgb([0; 3].map(|_: u8| {
                Encoding::Srgb
                    .counts(light + deviation * normal.next())
                    .round() as u8
            }))
        })
    }

    fn sensor() -> NoiseModel {
        let noise = LinearNoise { a: 1e-3, b: 1e-5 };
        NoiseModel::Sensor(SensorNoise::new(Encoding::Srgb, noise).unwrap())
    }

    #[test]
    fn the_quality_of_a_jpeg_is_read_from_its_table() {
        for quality in [30, 50, 75, 85, 90, 95, 99] {
            let found = jpeg_quality(&jpeg(&noisy(1), quality)).unwrap();
            assert!(found.abs_diff(quality) <= 1, "{quality}: {found}");
        }
        assert_eq!(jpeg_quality(&png(&noisy(1))), None);
    }

    #[test]
    fn files_that_are_cut_anywhere_are_read_without_harm() {
        let whole = jpeg(&noisy(1), 80);
        for end in 0..700 {
            jpeg_quality(&whole[..end]);
        }
        assert_eq!(jpeg_quality(&[0xff, 0xd8, 0xff, 0xdb, 0, 0]), None);
        assert_eq!(jpeg_quality(&[0xff, 0xd8, 0xff, 0xff, 0xff]), None);
    }

    #[test]
    fn noise_that_was_taken_out_is_missed_and_a_raw_picture_is_not_suspected() {
        let of = |bytes: &[u8], model: &NoiseModel| {
            Processing::of_encoded(bytes, "a test", model).unwrap()
        };
        let raw = of(&png(&noisy(1)), &sensor());
        assert_eq!(
            (raw.smoothed(), raw.warnings().len()),
            ([false; 3], 0),
            "{raw:?}"
        );
        let mean = of(&png(&noisy(4)), &sensor());
        assert_eq!(mean.smoothed(), [true; 3], "{mean:?}");
        assert!(
            mean.warnings()[0].contains("R, G, B: the noise is 0.5"),
            "{mean:?}"
        );
        // Nobody knows without the sensor.
        assert_eq!(
            of(&png(&noisy(4)), &NoiseModel::Picture).warnings().len(),
            0
        );
        let compressed = of(&jpeg(&noisy(1), 85), &NoiseModel::Picture);
        assert!(compressed.warnings()[0].contains("JPEG of quality 85"));
    }
}
