//! Converged pictures kept as files: pixel means, their standard errors, and what they were made from.
//!
//! A reference is an EXR file in half floats, R G B for the means and a layer `standard_error`, both multiplied by a
//! power of two (attribute `uw.scale`) so that the brightest value sits near the top of what half floats hold and
//! dark ones keep their precision. Rounding adds about 1e-7 to a relative mean squared error.
//! Standard errors are kept to six bits.

use std::path::{Path, PathBuf};

use uw_render::film::{Film, FilmLayer};
use uw_render::image::{ExrImage, ImageError, Layer, LayerData, Picture};

use super::scene::BenchmarkScene;

/// Layer of the standard errors of the pixel means.
const ERROR_LAYER: &str = "standard_error";
/// What the brightest stored value stays below; half floats end at 65504.
const BRIGHTEST: f64 = 32_768.0;

const FORMAT: (&str, &str) = ("uw.format", "uw-reference/1");
const SCENE_HASH: &str = "uw.scene_hash";
const SEED: &str = "uw.seed";
const SAMPLES: &str = "uw.samples_per_pixel";
const VERSION: &str = "uw.version";
const SCALE: &str = "uw.scale";

/// A converged picture with its own uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Mean radiance per pixel, W/(m² sr), row by row from the top.
    pub mean: Vec<[f64; 3]>,
    /// Standard error of `mean`, W/(m² sr).
    pub standard_error: Vec<[f64; 3]>,
    /// What it was made from.
    pub made: Provenance,
}

/// What a reference was made from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Provenance {
    /// Hash of the scene's content, see [`super::scene::content_hash`].
    pub scene_hash: String,
    /// Seed of the render.
    pub seed: u64,
    /// Samples per pixel.
    pub samples_per_pixel: u64,
    /// Version of the program.
    pub version: String,
}

/// A reference that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// There is no file.
    #[error(
        "{}: no such reference; make it with `uw error-time --make-references {} --references {}`{}",
        path.display(), scene.display(), folder.display(), if *resized { " and the same --width and --height" } else { "" }
    )]
    Missing {
        /// Where it was looked for.
        path: PathBuf,
        /// The scene file.
        scene: PathBuf,
        /// The folder of references.
        folder: PathBuf,
        /// Whether the picture has another size than the scene file says.
        resized: bool,
    },
    /// The file cannot be read.
    #[error(transparent)]
    Unreadable(#[from] ImageError),
    /// Something is missing in the file or makes no sense.
    #[error("{}: {field} must be {expected}, got {got}; is this a file of `uw error-time --make-references`?", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Attribute or layer.
        field: &'static str,
        /// What it should be.
        expected: &'static str,
        /// What it is.
        got: String,
    },
    /// The reference was made from another scene.
    #[error(
        "{}: was made from another scene: the content of {} has the hash {expected}, that of the reference's scene {got}; restore the scene or make the reference again with --make-references",
        path.display(), scene.display()
    )]
    OtherScene {
        /// The file.
        path: PathBuf,
        /// The scene file.
        scene: PathBuf,
        /// Hash of the scene.
        expected: String,
        /// Hash in the reference.
        got: String,
    },
    /// The reference has another size than its name and the scene say.
    #[error("{}: must have {} × {} pixels like its scene, got {} × {}", path.display(), expected.0, expected.1, got.0, got.1)]
    OtherSize {
        /// The file.
        path: PathBuf,
        /// Width and height of the scene's picture.
        expected: (u32, u32),
        /// Width and height of the reference.
        got: (u32, u32),
    },
}

impl Reference {
    /// A film as a reference. It must have two batches or more, or the standard errors are not numbers.
    pub fn of_film(film: &Film, made: Provenance) -> Self {
        Self {
            width: film.width,
            height: film.height,
            mean: film.layer(FilmLayer::Total),
            standard_error: film
                .layer(FilmLayer::Variance)
                .into_iter()
                .map(|variance| variance.map(f64::sqrt))
                .collect(),
            made,
        }
    }

    /// The file of a scene's reference: named by scene and size.
    pub fn path(folder: &Path, scene: &BenchmarkScene) -> PathBuf {
        let (width, height) = scene.size_px();
        folder.join(format!("{}_{width}x{height}.exr", scene.name))
    }

    /// Reads the reference of `scene` and checks that it belongs to it.
    ///
    /// # Errors
    /// No file, a file that is no reference, or one of another scene or size.
    pub fn read_for(folder: &Path, scene: &BenchmarkScene) -> Result<Self, ReferenceError> {
        let path = Self::path(folder, scene);
        if !path.exists() {
            return Err(ReferenceError::Missing {
                path,
                scene: scene.path.clone(),
                folder: folder.to_path_buf(),
                resized: scene.resized,
            });
        }
        let reference = Self::read(&path)?;
        if reference.made.scene_hash != scene.hash {
            return Err(ReferenceError::OtherScene {
                path,
                scene: scene.path.clone(),
                expected: scene.hash.clone(),
                got: reference.made.scene_hash,
            });
        }
        let (expected, got) = (scene.size_px(), (reference.width, reference.height));
        if expected != got {
            return Err(ReferenceError::OtherSize {
                path,
                expected,
                got,
            });
        }
        Ok(reference)
    }

    fn read(path: &Path) -> Result<Self, ReferenceError> {
        let image = ExrImage::read(path)?;
        let refuse = |field, expected, got: String| ReferenceError::Content {
            path: path.to_path_buf(),
            field,
            expected,
            got,
        };
        let attribute = |name: &'static str, expected: &'static str| {
            let found = image.attributes.iter().find(|(n, _)| n == name);
            let (_, value) = found.ok_or_else(|| refuse(name, expected, "nothing".to_owned()))?;
            Ok::<&str, ReferenceError>(value)
        };
        let whole = |name| {
            let expected = "a whole number >= 0";
            let text = attribute(name, expected)?;
            text.parse::<u64>()
                .map_err(|_| refuse(name, expected, format!("{text:?}")))
        };
        let format = attribute(FORMAT.0, FORMAT.1)?;
        if format != FORMAT.1 {
            return Err(refuse(FORMAT.0, FORMAT.1, format!("{format:?}")));
        }
        let text = attribute(SCALE, "a number > 0")?;
        let scale = text
            .parse::<f64>()
            .ok()
            .filter(|s| s.is_normal() && *s > 0.0);
        let scale = scale.ok_or_else(|| refuse(SCALE, "a number > 0", format!("{text:?}")))?;
        let errors = match image.layer(ERROR_LAYER) {
            Some(LayerData::Colour(errors)) => errors,
            _ => return Err(refuse(ERROR_LAYER, "a layer of R, G, B", "none".to_owned())),
        };
        let values = |pixels: &[[f32; 3]]| -> Vec<[f64; 3]> {
            pixels
                .iter()
                .map(|p| p.map(|v| f64::from(v) / scale))
                .collect()
        };
        let reference = Self {
            width: image.picture.width,
            height: image.picture.height,
            mean: values(&image.picture.data),
            standard_error: values(errors),
            made: Provenance {
                scene_hash: attribute(SCENE_HASH, "a hash")?.to_owned(),
                seed: whole(SEED)?,
                samples_per_pixel: whole(SAMPLES)?,
                version: attribute(VERSION, "a version")?.to_owned(),
            },
        };
        for (field, pixels) in [
            ("R, G, B", &reference.mean),
            (ERROR_LAYER, &reference.standard_error),
        ] {
            let bad = pixels
                .iter()
                .flatten()
                .find(|v| !(v.is_finite() && **v >= 0.0));
            if let Some(value) = bad {
                return Err(refuse(field, "finite and >= 0", value.to_string()));
            }
        }
        Ok(reference)
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ImageError> {
        let values = self.mean.iter().chain(&self.standard_error).flatten();
        let brightest = values.copied().fold(0.0, f64::max);
        let scale = power_of_two_below(BRIGHTEST, brightest);
        let scaled = |pixels: &[[f64; 3]]| -> Vec<[f32; 3]> {
            pixels
                .iter()
                .map(|p| p.map(|v| (scale * v) as f32))
                .collect()
        };
        let mut image = ExrImage::new(Picture {
            width: self.width,
            height: self.height,
            data: scaled(&self.mean),
        });
        image.layers.push(Layer {
            name: ERROR_LAYER.to_owned(),
            data: LayerData::Colour(
                scaled(&self.standard_error)
                    .into_iter()
                    .map(|p| p.map(to_six_bits))
                    .collect(),
            ),
        });
        image.attributes = [
            (FORMAT.0, FORMAT.1.to_owned()),
            (SCENE_HASH, self.made.scene_hash.clone()),
            (SEED, self.made.seed.to_string()),
            (SAMPLES, self.made.samples_per_pixel.to_string()),
            (VERSION, self.made.version.clone()),
            (SCALE, scale.to_string()),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .to_vec();
        image.write_half(path)
    }
}

/// A number >= 0 rounded to six significant bits (within 1.6 %): an estimated standard error holds no more, and
/// zeros take less room in a file.
fn to_six_bits(value: f32) -> f32 {
    const DROPPED: u32 = 18;
    f32::from_bits((value.to_bits() + (1 << (DROPPED - 1))) & !((1 << DROPPED) - 1))
}

/// The largest power of two that takes `brightest` no higher than `limit`; 1 for a black picture.
fn power_of_two_below(limit: f64, brightest: f64) -> f64 {
    if brightest > 0.0 {
        // Within the exponents of f32, through which the values go.
        (limit / brightest)
            .log2()
            .floor()
            .clamp(-100.0, 100.0)
            .exp2()
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dim() -> Reference {
        let mean: Vec<[f64; 3]> = (0..64)
            .map(|i| [3e-9, 1e-6, 2e-4].map(|level| level * 1.1_f64.powi(i % 8)))
            .collect();
        Reference {
            width: 8,
            height: 8,
            standard_error: mean.iter().map(|p| p.map(|v| 0.013 * v)).collect(),
            mean,
            made: Provenance {
                scene_hash: "0123456789abcdef".to_owned(),
                seed: u64::MAX,
                samples_per_pixel: 1 << 33,
                version: "0.1.0".to_owned(),
            },
        }
    }

    #[test]
    fn dim_pictures_keep_their_precision_and_their_provenance() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dim.exr");
        dim().write(&path).unwrap();
        let read = Reference::read(&path).unwrap();
        assert_eq!(read.made, dim().made);
        assert_eq!((read.width, read.height), (8, 8));
        // Half floats have eleven bits; unscaled ones would hold nothing of 3e-9.
        let largest = |read: &[[f64; 3]], written: &[[f64; 3]]| {
            let pairs = read.iter().flatten().zip(written.iter().flatten());
            pairs.map(|(r, w)| (r / w - 1.0).abs()).fold(0.0, f64::max)
        };
        assert!(largest(&read.mean, &dim().mean) <= 2f64.powi(-11));
        let error = largest(&read.standard_error, &dim().standard_error);
        assert!(error <= 2f64.powi(-6) + 2f64.powi(-11), "{error}");
    }

    #[test]
    fn other_pictures_are_refused_with_what_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plain.exr");
        let mut image = ExrImage::new(Picture::black(2, 2));
        image.write(&path).unwrap();
        let message = Reference::read(&path).unwrap_err().to_string();
        assert!(
            message.contains("plain.exr: uw.format must be uw-reference/1, got nothing"),
            "{message}"
        );
        image.attributes = [("uw.format", "uw-reference/1"), ("uw.scale", "-1")]
            .map(|(n, v)| (n.to_owned(), v.to_owned()))
            .to_vec();
        image.write(&path).unwrap();
        let message = Reference::read(&path).unwrap_err().to_string();
        assert!(
            message.contains("uw.scale must be a number > 0, got \"-1\""),
            "{message}"
        );
        image.attributes[1].1 = "1".to_owned();
        image.write(&path).unwrap();
        let message = Reference::read(&path).unwrap_err().to_string();
        assert!(
            message.contains("standard_error must be a layer of R, G, B"),
            "{message}"
        );
    }
}
