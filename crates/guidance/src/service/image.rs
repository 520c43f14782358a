//! The image of `suggest_image`: which files may be read, and its statistics.

use std::fs::{File, Metadata};
use std::io::Read as _;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use uw_calib::photo::{Exposed, Shot};
use uw_calib::picture::{Counts, Decoded};
use uw_calib::{Measured, NoiseModel, Processing, StatsError, Treatment};

use crate::feed::Picture;
use crate::observation::Quality;
use crate::physics::Water;
use crate::service::Settings;
use crate::wire::reply::{self, COUNTS_DECIMALS, Code, SHARE_DECIMALS, WireError};
use crate::wire::request::ImageSource;

/// Largest image file read for a request, bytes; above that of any camera's single frame.
const MAX_IMAGE_FILE_BYTES: u64 = 256 << 20;

/// Which image files clients may name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ImagePolicy {
    /// None; images come in base64. Any other answer to a name would tell which files there are.
    #[default]
    NoFile,
    /// Files under this directory, links followed as long as they stay there; relative names start there.
    Under(PathBuf),
}

impl ImagePolicy {
    /// The file meant, opened. Files elsewhere and files that are not there are refused with the same words.
    fn open(&self, path: &str) -> Result<File, String> {
        match self {
            Self::NoFile => Err(
                "image.path must be absent (no image directory is configured: images.directory), got a path"
                    .to_owned(),
            ),
            Self::Under(directory) => open_under(directory, path).ok_or_else(|| {
                "image.path must be an image file of at most 256 MiB under the configured image directory, \
                 got something else"
                    .to_owned()
            }),
        }
    }
}

fn open_under(directory: &Path, path: &str) -> Option<File> {
    let directory = directory.canonicalize().ok()?;
    let path = directory.join(path).canonicalize().ok()?;
    // A pipe or a device could be endless, or never answer.
    let usable = |meta: &Metadata| meta.is_file() && meta.len() <= MAX_IMAGE_FILE_BYTES;
    if !path.starts_with(&directory) || !usable(&path.metadata().ok()?) {
        return None;
    }
    let file = File::open(&path).ok()?;
    let same = path.canonicalize().ok()? == path;
    (same && usable(&file.metadata().ok()?)).then_some(file)
}

/// Reads and measures an image, as the settings treat it: without what is masked and what the lens does. Its noise is taken from where the settings say,
/// and compared with the sensor's where they or `water` know it. The pixels come with it where it has the size of the water's pictures. A port's way differs
/// with the distance, m, where that is known. A picture that was exposed longer or shorter than the water file's, as its EXIF states, is brought to theirs.
pub(super) fn measure(
    image: &ImageSource,
    settings: &Settings,
    water: Option<&Water>,
    distance_m: Option<f64>,
) -> Result<(Picture, Option<Counts>), WireError> {
    let (field, bytes) = bytes(image, settings)?;
    let unusable = |error: StatsError| bad(field, error.to_string());
    let noise = &settings.noise;
    let decoded = Decoded::new(&bytes, field).map_err(unusable)?;
    let file = water.map(|water| water.file());
    let exposed = file.and_then(|file| file.exposed(&Shot::of_bytes(&bytes)));
    let unknown_exposure =
        exposed.is_none() && file.is_some_and(|file| file.exposure_s().is_some());
    let exposed = exposed.unwrap_or(Exposed::ALIKE);
    let Seen { measured, counts } =
        seen(&decoded, settings, water, (distance_m, exposed)).map_err(unusable)?;
    let Measured { grid, detail } = measured;
    let of_water = water.filter(|water| water.size_px() == [grid.width, grid.height]);
    let sensor = match (noise, of_water) {
        (NoiseModel::Picture, Some(water)) => water.noise(),
        (noise, _) => noise,
    };
    let processing = Processing::of(&decoded, sensor);
    // Noise grows as the root of the sensitivity, that of reading a pixel out faster.
    let share = |share: f64| reply::rounded(share / exposed.gain.sqrt(), COUNTS_DECIMALS);
    let processing = Processing {
        noise_share: processing.noise_share.map(|of| of.map(share)),
        unknown_exposure,
        ..processing
    };
    // A picture that is decoded has far fewer pixels a side than this could hold.
    let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
    let picture = Picture {
        mean: grid.stats.mean.map(told),
        std: grid.stats.contrast.map(told),
        size_px: Some([side(grid.width), side(grid.height)]),
        quality: detail
            .as_ref()
            .map(|detail| Quality::of(detail, processing))
            .map(|quality| Quality {
                std_corrected: quality.std_corrected.map(told),
                noise_floor: quality.noise_floor.map(told),
                saturated: quality
                    .saturated
                    .map(|share| reply::rounded(share, SHARE_DECIMALS)),
                ..quality
            }),
    };
    Ok((picture, of_water.and(counts)))
}

fn bad(field: &str, message: String) -> WireError {
    WireError::new(Code::BadImage, message).at(field)
}

/// The bytes of an image and the field that they are from.
fn bytes<'a>(image: &ImageSource, settings: &Settings) -> Result<(&'a str, Vec<u8>), WireError> {
    match image {
        ImageSource::Path(path) => {
            let field = "image.path";
            let file = settings
                .images
                .open(path)
                .map_err(|message| bad(field, message))?;
            let bytes = of_file(file).map_err(|message| bad(field, message))?;
            Ok((field, bytes))
        }
        ImageSource::Base64(text) => {
            let field = "image.base64_png";
            let bytes = base64::engine::general_purpose::STANDARD
                .decode(text)
                .map_err(|error| bad(field, format!("image.base64_png is not base64: {error}")))?;
            Ok((field, bytes))
        }
    }
}

/// An image as it is treated.
struct Seen {
    measured: Measured,
    /// Its pixels, where a water is to know them.
    counts: Option<Counts>,
}

fn seen(
    decoded: &Decoded,
    settings: &Settings,
    water: Option<&Water>,
    (distance_m, exposed): (Option<f64>, Exposed),
) -> Result<Seen, StatsError> {
    let of_water = water.and_then(|water| water.even());
    let even = settings.treatment.even.as_ref().or(of_water);
    let is_plain = settings.treatment.mask.is_none() && settings.treatment.undistortion.is_none();
    if is_plain && exposed == Exposed::ALIKE {
        return Ok(Seen {
            measured: Measured::of(decoded, &settings.noise, even)?,
            counts: water.map(|_| Counts::of_decoded(decoded, even)),
        });
    }
    let treatment = Treatment {
        encoding: water.map_or(settings.treatment.encoding, |water| {
            water.file().sensor.encoding
        }),
        even: even.cloned(),
        ..settings.treatment.clone()
    };
    let opened = treatment.of_decoded(decoded, distance_m, exposed)?;
    Ok(Seen {
        measured: opened.measure(&settings.noise)?,
        counts: water.map(|_| opened.counts().filled()),
    })
}

/// The advice is made from what the reply tells, so that it can be made again from a recording.
fn told(counts: f64) -> f64 {
    reply::rounded(counts, COUNTS_DECIMALS)
}

fn of_file(file: File) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    // The file could grow while it is read.
    file.take(MAX_IMAGE_FILE_BYTES)
        .read_to_end(&mut bytes)
        .map_err(|error| format!("image.path cannot be read: {error}"))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn files_outside_the_directory_are_refused_links_and_dots_too() {
        let dir = tempfile::tempdir().unwrap();
        let images = dir.path().join("images");
        fs::create_dir(&images).unwrap();
        fs::write(images.join("inside.png"), "x").unwrap();
        fs::write(dir.path().join("outside.png"), "x").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink("../outside.png", images.join("link.png")).unwrap();
        let policy = ImagePolicy::Under(images.clone());
        assert!(policy.open("inside.png").is_ok());
        let absolute = images.join("inside.png").display().to_string();
        assert!(policy.open(&absolute).is_ok());
        let missing = policy.open("missing.png").unwrap_err();
        for path in ["../outside.png", "link.png", "/etc/passwd", "."] {
            assert_eq!(policy.open(path).unwrap_err(), missing, "{path}");
        }
        assert!(ImagePolicy::default().open(&absolute).is_err());
    }
}
