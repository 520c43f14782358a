//! The profile file: JSON, format `uw-profile/1`.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use serde_json::Value;

use super::corrected::{self, Corrected};
use super::{ContrastSample, DepthSample, Profile, ProfileError, Source};
use crate::json::{FieldError, Object, expect_format};
use crate::rig::Rig;

/// Format name and version of a profile file.
pub const PROFILE_FORMAT: &str = "uw-profile/1";
/// Unit of the contrasts in a profile file.
pub const PROFILE_UNIT: &str = "8-bit counts";

impl Profile {
    /// Reads a profile file, a shipped one (`shipped:profiles/1C.json`) too.
    pub fn read(path: &Path) -> Result<Self, ProfileError> {
        let file = path.display().to_string();
        let text = uw_assets::SMALL
            .read(path)
            .map_err(|source| ProfileError::Read {
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
        expect_format(value, PROFILE_FORMAT)?;
        let document = Object::new(value, "")?;
        let known = [
            "format",
            "unit",
            "depth",
            "contrast_on",
            "contrast_off",
            "contrast_depth_m",
            corrected::FIELD,
            "source",
        ];
        document.only(&[&known[..], &Rig::SECTIONS].concat())?;
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
        let profile = Self::new(
            depth,
            contrast_samples(&document, "contrast_on")?,
            contrast_samples(&document, "contrast_off")?,
            read_source(&document)?,
        )?;
        let mut profile = profile.with_rig(Rig::read(&document)?);
        if let Some(corrected) = Corrected::read(&document)? {
            profile = profile.with_corrected(corrected)?;
        }
        match document.get("contrast_depth_m") {
            None => Ok(profile),
            Some(_) => profile.with_contrast_depth(document.numbers("contrast_depth_m")?),
        }
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
        let rig: String = self
            .rig
            .to_json()
            .iter()
            .map(|(name, object)| format!(" \"{name}\": {object},\n"))
            .collect();
        let depths = self.contrast_depth_m.map_or_else(String::new, |depths| {
            format!(" \"contrast_depth_m\": {},\n", serde_json::json!(depths))
        });
        let corrected = self.corrected.as_ref().map_or_else(String::new, |of| {
            format!(" \"{}\": {},\n", corrected::FIELD, of.to_json())
        });
        format!(
            "{{\"format\": \"{PROFILE_FORMAT}\", \"unit\": \"{PROFILE_UNIT}\",\n \"depth\": {},\n \"contrast_on\": {},\n \"contrast_off\": {},\n{depths}{corrected}{rig} \"source\": {}}}\n",
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
