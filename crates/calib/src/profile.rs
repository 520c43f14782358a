//! The calibration profile: how illumination falls with depth and contrast with distance.
//!
//! K_z(z) is the mean of an upward-looking image at depth z divided by the mean at the shallowest depth.
//! K_c(d) is the contrast of an image of the target from distance d, with the lamps on and with them off.
//! Between samples values are interpolated linearly; outside them there is no value.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;
use thiserror::Error;

use crate::json::{FieldError, Object};

/// Format name and version of a profile file.
pub const PROFILE_FORMAT: &str = "uw-profile/1";
/// Unit of the contrasts in a profile file.
pub const PROFILE_UNIT: &str = "8-bit counts";

/// Why a profile cannot be read, written or asked.
#[derive(Debug, Error)]
pub enum ProfileError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// File name.
        file: String,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error("{file}: cannot be written: {source}")]
    Write {
        /// File name.
        file: String,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The file is not JSON.
    #[error("{file}: not valid JSON: {source}")]
    Json {
        /// File name.
        file: String,
        /// What the parser found, with line and column.
        source: serde_json::Error,
    },
    /// A field of the file is wrong.
    #[error("{file}: {source}")]
    File {
        /// File name.
        file: String,
        /// The field and what is wrong with it.
        source: FieldError,
    },
    /// A field of a profile that came from elsewhere is wrong.
    #[error("profile: {0}")]
    Field(#[from] FieldError),
    /// Asked for a value outside the calibrated range.
    #[error("{what} must be between {min} and {max} m (calibrated), got {value}")]
    OutsideCalibration {
        /// `depth_m` or `distance_m`.
        what: &'static str,
        /// Value asked for, m.
        value: f64,
        /// Smallest calibrated value, m.
        min: f64,
        /// Largest calibrated value, m.
        max: f64,
    },
}

/// Illumination at one depth, relative to the shallowest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthSample {
    /// Depth, m, >= 0.
    pub depth_m: f64,
    /// K_z per channel, no unit, >= 0.
    pub k_z: [f64; 3],
}

/// Contrast of the target from one distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ContrastSample {
    /// Distance along the optical axis, m, > 0.
    pub distance_m: f64,
    /// K_c per channel, 8-bit counts, >= 0.
    pub k_c: [f64; 3],
}

/// Where a profile comes from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Source {
    /// Program and version.
    pub made_by: String,
    /// Number of images measured.
    pub images: u64,
    /// Anything worth knowing, such as the water or the place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// A calibration profile; always complete: samples strictly increasing, all numbers finite, and the
/// distances with lamps on and off overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    depth: Vec<DepthSample>,
    contrast_on: Vec<ContrastSample>,
    contrast_off: Vec<ContrastSample>,
    source: Source,
}

impl Profile {
    /// A profile from its samples, in order of increasing depth and distance.
    pub fn new(
        depth: Vec<DepthSample>,
        contrast_on: Vec<ContrastSample>,
        contrast_off: Vec<ContrastSample>,
        source: Source,
    ) -> Result<Self, ProfileError> {
        let rows = |samples: &[ContrastSample]| -> Vec<_> {
            samples.iter().map(|s| (s.distance_m, s.k_c)).collect()
        };
        let depths: Vec<_> = depth.iter().map(|s| (s.depth_m, s.k_z)).collect();
        check_samples("depth", "depth_m", "k_z", &depths)?;
        check_samples("contrast_on", "distance_m", "k_c", &rows(&contrast_on))?;
        check_samples("contrast_off", "distance_m", "k_c", &rows(&contrast_off))?;
        let profile = Self {
            depth,
            contrast_on,
            contrast_off,
            source,
        };
        let (min, max) = profile.distance_range_m();
        if min > max {
            return Err(FieldError::invalid(
                "contrast_off",
                "sampled over distances that overlap with those of contrast_on",
                "no common distance",
            )
            .into());
        }
        Ok(profile)
    }

    /// Reads a profile file.
    pub fn read(path: &Path) -> Result<Self, ProfileError> {
        let file = path.display().to_string();
        let text = fs::read(path).map_err(|source| ProfileError::Read {
            file: file.clone(),
            source,
        })?;
        let value: Value = serde_json::from_slice(&text).map_err(|source| ProfileError::Json {
            file: file.clone(),
            source,
        })?;
        Self::from_json(&value).map_err(|error| match error {
            ProfileError::Field(source) => ProfileError::File { file, source },
            other => other,
        })
    }

    /// A profile from the parsed JSON of a profile file.
    pub fn from_json(value: &Value) -> Result<Self, ProfileError> {
        let document = Object::new(value, "")?;
        document.only(&[
            "format",
            "unit",
            "depth",
            "contrast_on",
            "contrast_off",
            "source",
        ])?;
        expect_text(&document, "format", PROFILE_FORMAT)?;
        expect_text(&document, "unit", PROFILE_UNIT)?;
        let mut depth = Vec::new();
        for (k, item) in document.array("depth")?.iter().enumerate() {
            let sample = Object::new(item, format!("depth[{k}]"))?;
            sample.only(&["depth_m", "k_z"])?;
            depth.push(DepthSample {
                depth_m: sample.number("depth_m")?,
                k_z: sample.numbers("k_z")?,
            });
        }
        Self::new(
            depth,
            contrast_samples(&document, "contrast_on")?,
            contrast_samples(&document, "contrast_off")?,
            read_source(&document)?,
        )
    }

    /// The text of the profile file, one sample a line.
    pub fn to_json(&self) -> String {
        let lines = |samples: Vec<Value>| {
            let rows: Vec<String> = samples.iter().map(|s| format!("  {s}")).collect();
            format!("[\n{}\n ]", rows.join(",\n"))
        };
        let contrast = |samples: &[ContrastSample]| {
            lines(samples.iter().map(|s| serde_json::json!(s)).collect())
        };
        format!(
            "{{\"format\": \"{PROFILE_FORMAT}\", \"unit\": \"{PROFILE_UNIT}\",\n \"depth\": {},\n \"contrast_on\": {},\n \"contrast_off\": {},\n \"source\": {}}}\n",
            lines(self.depth.iter().map(|s| serde_json::json!(s)).collect()),
            contrast(&self.contrast_on),
            contrast(&self.contrast_off),
            serde_json::json!(self.source),
        )
    }

    /// Writes the profile file; the old file stays untouched until the new one is complete.
    pub fn write(&self, path: &Path) -> Result<(), ProfileError> {
        write_atomically(path, self.to_json().as_bytes()).map_err(|source| ProfileError::Write {
            file: path.display().to_string(),
            source,
        })
    }

    /// K_z per channel at a depth, no unit.
    pub fn k_z(&self, depth_m: f64) -> Result<[f64; 3], ProfileError> {
        let samples = self.depth.iter().map(|s| (s.depth_m, s.k_z));
        interpolate(samples, depth_m, "depth_m", self.depth_range_m())
    }

    /// K_c per channel with the lamps on from a distance, 8-bit counts.
    pub fn k_c_on(&self, distance_m: f64) -> Result<[f64; 3], ProfileError> {
        let samples = self.contrast_on.iter().map(|s| (s.distance_m, s.k_c));
        interpolate(
            samples,
            distance_m,
            "distance_m",
            distance_range(&self.contrast_on),
        )
    }

    /// K_c per channel with the lamps off from a distance, 8-bit counts.
    pub fn k_c_off(&self, distance_m: f64) -> Result<[f64; 3], ProfileError> {
        let samples = self.contrast_off.iter().map(|s| (s.distance_m, s.k_c));
        interpolate(
            samples,
            distance_m,
            "distance_m",
            distance_range(&self.contrast_off),
        )
    }

    /// Smallest and largest calibrated depth, m.
    pub fn depth_range_m(&self) -> (f64, f64) {
        (
            self.depth[0].depth_m,
            self.depth[self.depth.len() - 1].depth_m,
        )
    }

    /// Smallest and largest distance calibrated both with lamps on and off, m.
    pub fn distance_range_m(&self) -> (f64, f64) {
        let (on, off) = (
            distance_range(&self.contrast_on),
            distance_range(&self.contrast_off),
        );
        (on.0.max(off.0), on.1.min(off.1))
    }

    /// Samples of K_z, depths increasing.
    pub fn depth(&self) -> &[DepthSample] {
        &self.depth
    }

    /// Samples of K_c with the lamps on, distances increasing.
    pub fn contrast_on(&self) -> &[ContrastSample] {
        &self.contrast_on
    }

    /// Samples of K_c with the lamps off, distances increasing.
    pub fn contrast_off(&self) -> &[ContrastSample] {
        &self.contrast_off
    }

    /// Where the profile comes from.
    pub fn source(&self) -> &Source {
        &self.source
    }
}

fn distance_range(samples: &[ContrastSample]) -> (f64, f64) {
    (samples[0].distance_m, samples[samples.len() - 1].distance_m)
}

fn interpolate(
    samples: impl Iterator<Item = (f64, [f64; 3])>,
    at_m: f64,
    what: &'static str,
    (min, max): (f64, f64),
) -> Result<[f64; 3], ProfileError> {
    if !(min..=max).contains(&at_m) {
        return Err(ProfileError::OutsideCalibration {
            what,
            value: at_m,
            min,
            max,
        });
    }
    let mut before: Option<(f64, [f64; 3])> = None;
    for (x, y) in samples {
        if x >= at_m {
            return Ok(match before {
                Some((x0, y0)) => {
                    let t = (at_m - x0) / (x - x0);
                    std::array::from_fn(|k| (1.0 - t) * y0[k] + t * y[k])
                }
                None => y,
            });
        }
        before = Some((x, y));
    }
    Err(ProfileError::OutsideCalibration {
        what,
        value: at_m,
        min,
        max,
    })
}

fn check_samples(
    list: &str,
    position: &str,
    curve: &str,
    samples: &[(f64, [f64; 3])],
) -> Result<(), FieldError> {
    if samples.is_empty() {
        return Err(FieldError::invalid(list, "at least one sample", "none"));
    }
    for (i, &(x, y)) in samples.iter().enumerate() {
        if !(x.is_finite() && x >= 0.0) {
            let field = format!("{list}[{i}].{position}");
            return Err(FieldError::invalid(field, "finite and >= 0 m", x));
        }
        if i > 0 && x <= samples[i - 1].0 {
            let field = format!("{list}[{i}].{position}");
            let expected = format!("greater than the sample before it ({} m)", samples[i - 1].0);
            return Err(FieldError::invalid(field, expected, x));
        }
        if let Some(k) = y.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            let field = format!("{list}[{i}].{curve}[{k}]");
            return Err(FieldError::invalid(field, "finite and >= 0", y[k]));
        }
    }
    Ok(())
}

fn contrast_samples(document: &Object, list: &str) -> Result<Vec<ContrastSample>, FieldError> {
    let mut samples = Vec::new();
    for (k, item) in document.array(list)?.iter().enumerate() {
        let sample = Object::new(item, format!("{list}[{k}]"))?;
        sample.only(&["distance_m", "k_c"])?;
        samples.push(ContrastSample {
            distance_m: sample.number("distance_m")?,
            k_c: sample.numbers("k_c")?,
        });
    }
    Ok(samples)
}

fn read_source(document: &Object) -> Result<Source, FieldError> {
    let source = document.object("source")?;
    source.only(&["made_by", "images", "note"])?;
    let images = source.required("images")?;
    Ok(Source {
        made_by: source.text("made_by")?.to_owned(),
        images: images.as_u64().ok_or_else(|| {
            FieldError::wrong_type("source.images", "a whole number >= 0", images)
        })?,
        note: match source.get("note") {
            None => None,
            Some(_) => Some(source.text("note")?.to_owned()),
        },
    })
}

fn expect_text(document: &Object, name: &str, expected: &str) -> Result<(), FieldError> {
    match document.text(name)? {
        got if got == expected => Ok(()),
        got => Err(FieldError::invalid(
            name,
            format!("{expected:?}"),
            format!("{got:?}"),
        )),
    }
}

/// Writes beside the target first and renames, so that a reader sees the old file or the whole new one.
fn write_atomically(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let name = path
        .file_name()
        .ok_or_else(|| std::io::Error::other("the path names no file"))?
        .to_string_lossy();
    let temporary = path.with_file_name(format!(".{name}.{}.part", std::process::id()));
    let written = fs::File::create(&temporary).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    let done = written.and_then(|()| fs::rename(&temporary, path));
    if done.is_err() {
        // The part file may never have come into being; the first error is the one that matters.
        let _ = fs::remove_file(&temporary);
    }
    done
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn profile() -> Profile {
        Profile::from_json(&document()).unwrap()
    }

    fn document() -> Value {
        json!({
            "format": "uw-profile/1", "unit": "8-bit counts",
            "depth": [
                {"depth_m": 0.5, "k_z": [1, 1, 1]},
                {"depth_m": 2.5, "k_z": [0.1, 0.61234567890123456, 0.55]}],
            "contrast_on": [
                {"distance_m": 0.5, "k_c": [17.2, 18.1, 14.0]},
                {"distance_m": 3.0, "k_c": [1.0, 4.0, 2.0]}],
            "contrast_off": [
                {"distance_m": 0.4, "k_c": [8.6, 9.1, 7.2]},
                {"distance_m": 2.0, "k_c": [2.6, 5.1, 3.2]},
                {"distance_m": 2.5, "k_c": [2.0, 5.0, 3.0]}],
            "source": {"made_by": "uw calibrate 0.1.0", "images": 24}
        })
    }

    #[test]
    fn round_trip_keeps_every_bit() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("profile.json");
        profile().write(&path).unwrap();
        assert_eq!(Profile::read(&path).unwrap(), profile());
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            1,
            "no part file is left behind"
        );
    }

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("taken");
        fs::create_dir(&target).unwrap();
        assert!(matches!(
            profile().write(&target),
            Err(ProfileError::Write { .. })
        ));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn values_between_samples_are_linear_and_those_at_samples_exact() {
        let p = profile();
        assert_eq!(p.k_z(0.5).unwrap(), [1.0; 3]);
        assert!((p.k_z(1.0).unwrap()[0] - 0.775).abs() < 1e-12);
        assert!((p.k_c_off(1.2).unwrap()[1] - 7.1).abs() < 1e-12);
        assert_eq!(p.k_c_off(2.5).unwrap(), [2.0, 5.0, 3.0]);
        assert_eq!(p.distance_range_m(), (0.5, 2.5));
    }

    #[test]
    fn outside_the_samples_there_is_no_value() {
        let error = profile().k_z(40.0).unwrap_err();
        assert_eq!(
            error.to_string(),
            "depth_m must be between 0.5 and 2.5 m (calibrated), got 40"
        );
        for distance_m in [0.49, 3.01, f64::NAN] {
            assert!(profile().k_c_on(distance_m).is_err());
        }
    }

    #[test]
    fn wrong_files_are_refused_with_the_field() {
        let cases: [(&str, Value, &str); 9] = [
            (
                "/format",
                json!("uw-profile/2"),
                "format must be \"uw-profile/1\"",
            ),
            ("/unit", json!("percent"), "unit must be \"8-bit counts\""),
            (
                "/depth/1/depth_m",
                json!(0.5),
                "depth[1].depth_m must be greater than",
            ),
            (
                "/depth/1/depth_m",
                json!("2.5"),
                "depth[1].depth_m must be a finite number",
            ),
            (
                "/contrast_on/0/k_c",
                json!([1, 2]),
                "contrast_on[0].k_c must be an array of 3",
            ),
            (
                "/contrast_on/0/k_c/2",
                json!(-1),
                "contrast_on[0].k_c[2] must be finite and >= 0",
            ),
            (
                "/contrast_off",
                json!([]),
                "contrast_off must be at least one sample",
            ),
            (
                "/source/images",
                json!(1.5),
                "source.images must be a whole number",
            ),
            (
                "/contrast_off/0",
                json!({"distance": 1, "k_c": [1, 1, 1]}),
                "did you mean distance_m?",
            ),
        ];
        for (pointer, value, expected) in cases {
            let mut wrong = document();
            *wrong.pointer_mut(pointer).unwrap() = value;
            let message = Profile::from_json(&wrong).unwrap_err().to_string();
            assert!(message.contains(expected), "{pointer}: {message}");
        }
    }
}
