//! Mean and contrast of one image, in 8-bit counts.
//!
//! Contrast is the mean over a 10 × 6 grid of patches of the population standard deviation inside each
//! patch. Patches make it robust against slow gradients (a lamp's beam, ambient light from above), which
//! raise the standard deviation of the whole image although no detail is visible.
//! The file's values are used as stored: no linearisation, alpha ignored, grey replicated to R, G, B.
//! Noise counts as contrast; [`crate::detail`] has it without.

use std::path::Path;

use thiserror::Error;

use crate::detail::{Behind, Detail};
use crate::even::Even;
use crate::noise::NoiseModel;
use crate::photo::Shot;
use crate::picture::{self, COUNTS_PER_U16, Decoded};
use crate::planes::{Part, Planes, Sample};
use crate::processing::Processing;

/// Patches along the width.
pub const PATCH_COLUMNS: usize = 10;
/// Patches along the height.
pub const PATCH_ROWS: usize = 6;

/// Why an image has no statistics.
#[derive(Debug, Error)]
pub enum StatsError {
    /// The file cannot be opened or read.
    #[error("{name}: cannot be read: {source}")]
    Read {
        /// File name.
        name: String,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The bytes are no image this build can decode.
    #[error("{name}: not a usable PNG, TIFF or JPEG image: {source}")]
    Decode {
        /// File name, or a word for bytes without one.
        name: String,
        /// What the decoder found.
        source: image::ImageError,
    },
    /// Samples that are not unsigned 8- or 16-bit integers.
    #[error("{name}: samples must be 8 or 16 bits per channel, got {got}")]
    SampleType {
        /// File name.
        name: String,
        /// Colour type of the file.
        got: String,
    },
    /// Too small for the patch grid.
    #[error(
        "{name}: image must be at least 10 x 6 pixels for the patch grid, got {width} x {height}"
    )]
    TooSmall {
        /// File name, or a word for buffers without one.
        name: String,
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
    },
    /// A picture of another size than mask or camera have.
    #[error("{name}: {message}")]
    OtherSize {
        /// File name.
        name: String,
        /// What would be right.
        message: String,
    },
    /// A folder without frames.
    #[error("{name}: the folder holds no picture (PNG, TIFF or JPEG)")]
    NoFrames {
        /// Folder.
        name: String,
    },
    /// Frames of different sizes.
    #[error("{name}: must have the {} x {} pixels of the folder's first frame, got {} x {}", first[0], first[1], got[0], got[1])]
    FrameSize {
        /// File name.
        name: String,
        /// Width and height of the first frame, pixels.
        first: [usize; 2],
        /// Those of this one.
        got: [usize; 2],
    },
    /// A mask, or a camera that sees other parts, leaves no patch.
    #[error("{name}: no patch of the 10 x 6 grid is half left by the mask or seen by the camera")]
    NothingLeft {
        /// File name, or a word for buffers without one.
        name: String,
    },
    /// A buffer whose length does not fit its size.
    #[error(
        "pixel buffer of a {width} x {height} RGB image must hold {expected} samples, got {got}"
    )]
    BufferLength {
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// 3 · width · height.
        expected: usize,
        /// Samples given.
        got: usize,
    },
}

/// Mean and contrast of an image per channel (R, G, B), 8-bit counts in [0, 255].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageStats {
    /// Mean over the patch grid of the standard deviation inside each patch.
    pub contrast: [f64; 3],
    /// Mean over all pixels, the remainder outside the grid included.
    pub mean: [f64; 3],
}

/// Mean and population standard deviation inside one patch, per channel, 8-bit counts; of its known pixels where some are masked or not
/// seen, NaN where more than half of them are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchStats {
    /// Mean.
    pub mean: [f64; 3],
    /// Population standard deviation (divided by the number of pixels).
    pub std: [f64; 3],
}

/// The measured image: size, statistics of the whole and of each patch.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchGrid {
    /// Image width, pixels.
    pub width: usize,
    /// Image height, pixels.
    pub height: usize,
    /// Contrast and mean of the image.
    pub stats: ImageStats,
    /// [`PATCH_ROWS`] rows of [`PATCH_COLUMNS`] patches from the top left, row by row.
    pub patches: Vec<PatchStats>,
}

/// A measured picture: its statistics, and what of them is noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Size and statistics.
    pub grid: PatchGrid,
    /// Contrast without noise, noise floor and clipped shares; `None` where the noise is to be taken from the picture and
    /// patches are smaller than 3 × 3 pixels.
    pub detail: Option<Detail>,
}

impl Measured {
    /// What `uw stats --json` and Python's `statistics` tell of a picture besides file and warnings: an object with null
    /// where something is not known.
    pub fn told(&self, processing: Option<&Processing>, shot: &Shot) -> serde_json::Value {
        let (grid, detail) = (&self.grid, self.detail.as_ref());
        let triple = |of: fn(&Detail) -> [f64; 3]| detail.map(of);
        serde_json::json!({
            "width": grid.width,
            "height": grid.height,
            "contrast": grid.stats.contrast,
            "mean": grid.stats.mean,
            "contrast_corrected": triple(|d| d.contrast),
            "noise_floor": triple(|d| d.floor),
            "noise": triple(|d| d.noise),
            "noise_source": detail.map(|d| d.source.name()),
            "black": triple(|d| d.black),
            "saturated": triple(|d| d.saturated),
            "jpeg_quality": processing.and_then(|p| p.jpeg_quality),
            "noise_share": processing.map(|p| p.noise_share),
            "exposure_time_s": shot.time_s,
            "f_number": shot.f_number,
            "iso": shot.iso,
            "exposure": shot.stated_exposure(),
        })
    }

    /// Measures a PNG, TIFF or JPEG file; `even` takes its lens out.
    pub fn from_file(
        path: &Path,
        noise: &NoiseModel,
        even: Option<&Even>,
    ) -> Result<Self, StatsError> {
        let (image, name) = picture::of_file(path)?;
        let planes = Planes::of_image(&image, &name, &|counts| counts)?;
        named(measure(&planes, picture::step(&image), noise, even), &name)
    }

    /// Measures interleaved 8-bit R, G, B samples, row 0 at the top; `even` takes the lens out.
    pub fn from_rgb8(
        width: usize,
        height: usize,
        samples: &[u8],
        noise: &NoiseModel,
        even: Option<&Even>,
    ) -> Result<Self, StatsError> {
        Self::from_samples((width, height), samples, 1.0, noise, even)
    }

    /// The same of 16-bit samples, which are scaled to 8-bit counts (65535 is 255).
    pub fn from_rgb16(
        width: usize,
        height: usize,
        samples: &[u16],
        noise: &NoiseModel,
        even: Option<&Even>,
    ) -> Result<Self, StatsError> {
        Self::from_samples((width, height), samples, COUNTS_PER_U16, noise, even)
    }

    fn from_samples<T: Sample>(
        (width, height): (usize, usize),
        samples: &[T],
        step: f64,
        noise: &NoiseModel,
        even: Option<&Even>,
    ) -> Result<Self, StatsError> {
        check_length(width, height, samples.len())?;
        let planes = Planes::of_samples((width, height), samples, 3, step, &|counts| counts);
        measure(&planes, step, noise, even)
    }

    /// Measures an image held in memory as the bytes of a PNG, TIFF or JPEG file; `name` is for messages.
    pub fn from_encoded(
        bytes: &[u8],
        name: &str,
        noise: &NoiseModel,
        even: Option<&Even>,
    ) -> Result<Self, StatsError> {
        Self::of(&Decoded::new(bytes, name)?, noise, even)
    }

    /// Measures a decoded image.
    ///
    /// # Errors
    /// It is smaller than 10 × 6 pixels.
    pub fn of(
        decoded: &Decoded,
        noise: &NoiseModel,
        even: Option<&Even>,
    ) -> Result<Self, StatsError> {
        let measured = measure(&decoded.planes, decoded.step, noise, even);
        named(measured, &decoded.name)
    }
}

impl ImageStats {
    /// Statistics of interleaved 8-bit R, G, B samples, row 0 at the top.
    pub fn from_rgb8(width: usize, height: usize, samples: &[u8]) -> Result<Self, StatsError> {
        check_length(width, height, samples.len())?;
        let planes = Planes::of_samples((width, height), samples, 3, 1.0, &|counts| counts);
        Ok(PatchGrid::of(&planes)?.stats)
    }

    /// Statistics of interleaved 16-bit R, G, B samples, scaled to 8-bit counts (65535 is 255).
    pub fn from_rgb16(width: usize, height: usize, samples: &[u16]) -> Result<Self, StatsError> {
        check_length(width, height, samples.len())?;
        let size = (width, height);
        let planes = Planes::of_samples(size, samples, 3, COUNTS_PER_U16, &|counts| counts);
        Ok(PatchGrid::of(&planes)?.stats)
    }

    /// Statistics of pixels given as R, G, B in 8-bit counts, fractions allowed; row 0 first.
    pub fn from_counts(
        width: usize,
        height: usize,
        pixels: &[[f64; 3]],
    ) -> Result<Self, StatsError> {
        check_length(width, height, 3 * pixels.len())?;
        Ok(patch_statistics(width, height, |i| pixels[i])?.stats)
    }

    /// Statistics of a PNG, TIFF or JPEG file.
    pub fn from_file(path: &Path) -> Result<Self, StatsError> {
        Ok(PatchGrid::from_file(path)?.stats)
    }
}

impl PatchGrid {
    /// Measures a PNG, TIFF or JPEG file.
    pub fn from_file(path: &Path) -> Result<Self, StatsError> {
        let (image, name) = picture::of_file(path)?;
        named(
            Self::of(&Planes::of_image(&image, &name, &|counts| counts)?),
            &name,
        )
    }

    /// Measures an image held in memory as the bytes of a PNG, TIFF or JPEG file; `name` is for messages.
    pub fn from_encoded(bytes: &[u8], name: &str) -> Result<Self, StatsError> {
        named(Self::of(&Decoded::new(bytes, name)?.planes), name)
    }
}

/// Part of the allowance of [`contrast_misfit`] that does not depend on the picture, 8-bit counts.
const ALLOWANCE_COUNTS: f64 = 0.5;
/// Its other part, as a share of the picture's contrast.
const ALLOWANCE_SHARE: f64 = 0.1;

/// The unit of [`contrast_misfit`] at a measured contrast, both 8-bit counts.
pub fn misfit_allowance(measured: f64) -> f64 {
    ALLOWANCE_COUNTS + ALLOWANCE_SHARE * measured
}

/// How far a predicted contrast is from the measured one (both 8-bit counts): the largest of the channels in units of
/// 0.5 counts and 10 % of the measured contrast. NaN where one of them is.
pub fn contrast_misfit(predicted: [f64; 3], measured: [f64; 3]) -> f64 {
    let share = |k: usize| (predicted[k] - measured[k]).abs() / misfit_allowance(measured[k]);
    let shares = [share(0), share(1), share(2)];
    match shares.iter().any(|share| share.is_nan()) {
        true => f64::NAN,
        false => shares.into_iter().fold(0.0, f64::max),
    }
}

/// Measures an image whose pixel `i` (row by row from the top left) is `pixel(i)`: R, G, B in 8-bit counts.
///
/// Patches are `width / 10` by `height / 6` pixels; what is left over at the right and at the bottom
/// belongs to no patch.
pub fn patch_statistics(
    width: usize,
    height: usize,
    pixel: impl Fn(usize) -> [f64; 3],
) -> Result<PatchGrid, StatsError> {
    PatchGrid::of(&Planes::new(width, height, pixel))
}

impl PatchGrid {
    pub(crate) fn of(planes: &Planes) -> Result<Self, StatsError> {
        let (width, height) = (planes.width, planes.height);
        check_size(width, height)?;
        let mut patches = vec![
            PatchStats {
                mean: [0.0; 3],
                std: [0.0; 3]
            };
            PATCH_ROWS * PATCH_COLUMNS
        ];
        let mut stats = ImageStats {
            contrast: [0.0; 3],
            mean: [0.0; 3],
        };
        for (k, plane) in planes.channels.iter().enumerate() {
            for (i, patch) in patches.iter_mut().enumerate() {
                (patch.mean[k], patch.std[k]) =
                    mean_and_deviation(&part(plane, [width, height], i));
            }
            let known = patches.iter().map(|patch| patch.std[k]);
            let (mut contrast, mut n) = (0.0, 0);
            for deviation in known.filter(|deviation| !deviation.is_nan()) {
                contrast += deviation;
                n += 1;
            }
            if n == 0 {
                let name = "image".to_owned();
                return Err(StatsError::NothingLeft { name });
            }
            stats.contrast[k] = contrast / f64::from(n);
            stats.mean[k] = Part::whole(plane).mean_of_known(|value| value);
        }
        Ok(Self {
            width,
            height,
            stats,
            patches,
        })
    }
}

/// Mean and deviation of a patch's known pixels; unknown (NaN) where fewer than half are.
fn mean_and_deviation(part: &Part<'_>) -> (f64, f64) {
    let mean = part.mean(|value| value);
    if mean.is_nan() && 2 * part.known() < part.width * part.height {
        return (f64::NAN, f64::NAN);
    }
    let mean = part.mean_of_known(|value| value);
    let variance = part.mean_of_known(|value| (value - mean) * (value - mean));
    (mean, variance.sqrt())
}

/// Top left pixel of patch `i`, row by row of patches.
fn corner([width, height]: [usize; 2], i: usize) -> usize {
    let (column, row) = (i % PATCH_COLUMNS, i / PATCH_COLUMNS);
    row * (height / PATCH_ROWS) * width + column * (width / PATCH_COLUMNS)
}

/// Those of all patches.
pub(crate) fn corners(size: [usize; 2]) -> Vec<usize> {
    let patches = 0..PATCH_ROWS * PATCH_COLUMNS;
    patches.map(|patch| corner(size, patch)).collect()
}

/// Patch `i` of a plane.
pub(crate) fn part(plane: &[f64], [width, height]: [usize; 2], i: usize) -> Part<'_> {
    let size = [width / PATCH_COLUMNS, height / PATCH_ROWS];
    Part {
        plane,
        first: corner([width, height], i),
        width: size[0],
        height: size[1],
        stride: width,
    }
}

fn check_size(width: usize, height: usize) -> Result<(), StatsError> {
    match width < PATCH_COLUMNS || height < PATCH_ROWS {
        true => Err(StatsError::TooSmall {
            name: "image".to_owned(),
            width,
            height,
        }),
        false => Ok(()),
    }
}

fn check_length(width: usize, height: usize, got: usize) -> Result<(), StatsError> {
    let expected = width.saturating_mul(height).saturating_mul(3);
    if got == expected {
        Ok(())
    } else {
        Err(StatsError::BufferLength {
            width,
            height,
            expected,
            got,
        })
    }
}

pub(crate) fn of_planes(
    planes: &Planes,
    step: f64,
    noise: Option<&NoiseModel>,
    behind: Option<&Behind<'_>>,
) -> Result<Measured, StatsError> {
    let grid = PatchGrid::of(planes)?;
    let detail = noise.and_then(|noise| Detail::measure(&grid, planes, step, noise, behind));
    Ok(Measured { grid, detail })
}

/// The error of a picture by its name.
pub(crate) fn named<T>(measured: Result<T, StatsError>, name: &str) -> Result<T, StatsError> {
    let name = name.to_owned();
    measured.map_err(|error| match error {
        StatsError::TooSmall { width, height, .. } => StatsError::TooSmall {
            name,
            width,
            height,
        },
        StatsError::NothingLeft { .. } => StatsError::NothingLeft { name },
        other => other,
    })
}

fn measure(
    stored: &Planes,
    step: f64,
    noise: &NoiseModel,
    even: Option<&Even>,
) -> Result<Measured, StatsError> {
    let Some(even) = even else {
        return of_planes(stored, step, Some(noise), None);
    };
    let behind = Behind {
        even: Some(even),
        stored,
        resampling: None,
        frames: 1.0,
    };
    of_planes(&even.of_planes(stored), step, Some(noise), Some(&behind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_image_has_its_value_as_mean_and_no_contrast() {
        let stats = ImageStats::from_counts(23, 13, &[[0.1, 77.7, 255.0]; 23 * 13]).unwrap();
        for (got, want) in stats.mean.into_iter().zip([0.1, 77.7, 255.0]) {
            assert!((got - want).abs() < 1e-12, "{got} {want}");
        }
        assert!(
            stats.contrast.into_iter().all(|c| c < 1e-12),
            "{:?}",
            stats.contrast
        );
    }

    #[test]
    fn remainder_counts_for_the_mean_but_not_for_the_contrast() {
        // 21 x 13: patches of 2 x 2, column 20 and row 12 left over and the only bright ones.
        let pixel = |i: usize| {
            [if i % 21 == 20 || i / 21 == 12 {
                200.0
            } else {
                0.0
            }; 3]
        };
        let grid = patch_statistics(21, 13, pixel).unwrap();
        assert_eq!(grid.stats.contrast, [0.0; 3]);
        assert!((grid.stats.mean[0] - 200.0 * (21.0 + 12.0) / 273.0).abs() < 1e-12);
    }

    #[test]
    fn standard_deviation_is_that_of_the_population() {
        // Patches of 2 x 1: values 0 and 4 have population deviation 2, sample deviation 2.83.
        let grid = patch_statistics(20, 6, |i| [if i % 2 == 0 { 0.0 } else { 4.0 }; 3]).unwrap();
        assert_eq!(grid.stats.contrast, [2.0; 3]);
        assert_eq!(grid.patches.len(), 60);
    }

    #[test]
    fn sixteen_bits_are_scaled_to_eight_bit_counts() {
        let eight: Vec<u8> = (0..20 * 12 * 3).map(|i| (i * 37 % 256) as u8).collect();
        let sixteen: Vec<u16> = eight.iter().map(|&v| u16::from(v) * 257).collect();
        let a = ImageStats::from_rgb8(20, 12, &eight).unwrap();
        let b = ImageStats::from_rgb16(20, 12, &sixteen).unwrap();
        for k in 0..3 {
            assert!((a.contrast[k] - b.contrast[k]).abs() < 1e-10);
            assert!((a.mean[k] - b.mean[k]).abs() < 1e-10);
        }
    }

    #[test]
    fn too_small_an_image_and_a_short_buffer_are_refused() {
        let error = ImageStats::from_rgb8(9, 6, &[0; 9 * 6 * 3]).unwrap_err();
        assert!(error.to_string().contains("at least 10 x 6"), "{error}");
        let error = ImageStats::from_rgb8(20, 12, &[0; 7]).unwrap_err();
        assert!(error.to_string().contains("720 samples, got 7"), "{error}");
    }
}
