//! Stage 7: what the model file says about where the network can be trusted.
//!
//! The range of every input and the residuals come from the table, camera, lamps, textures and sun from the manifest
//! that `uw dataset` writes beside it. The daemon refuses what lies outside; see `docs/interfaces.md`, section 5.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use uw_calib::Rig;
use uw_calib::json::{FieldError, Object};
use uw_calib::stats::{contrast_misfit, misfit_allowance};

use crate::columns::{INPUTS, Offsets, inputs};
use crate::{Error, Model, Table};

/// Format of the manifests that are read.
const MANIFEST_FORMAT: &str = "uw-dataset-manifest/1";
/// Name of the manifest beside a dataset.
const MANIFEST: &str = "manifest.json";
/// Largest standard error of a contrast that counts as known, as a share of what a misfit allows.
const KNOWN_SHARE: f64 = 0.1;
/// In every dataset of that format the sun stands behind the camera.
const SUN_AZIMUTH_DEG: f64 = 0.0;

/// What the manifests of a dataset say about its pictures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictures {
    /// Camera, sensor and lamps.
    pub rig: Rig,
    /// Names of the textures.
    pub textures: Vec<String>,
    /// Jerlov types, or mixtures of two.
    pub water_types: Vec<String>,
    /// Zenith angle of the sun, degrees.
    pub sun_zenith_deg: Option<f64>,
}

impl Pictures {
    /// What these manifests say together; without any, that beside the dataset, if there is one.
    ///
    /// # Errors
    /// When a manifest that was named cannot be read, or their cameras or suns differ.
    pub fn read(dataset: &Path, manifests: &[PathBuf]) -> Result<Option<Self>, Error> {
        if manifests.is_empty() {
            let folder = match dataset.is_dir() {
                true => Some(dataset),
                false => dataset.parent(),
            };
            let beside = folder.map(|folder| folder.join(MANIFEST));
            // A file of that name may be something else's.
            return Ok(beside.and_then(|path| read_one(&path).ok()));
        }
        let mut all: Option<Self> = None;
        for path in manifests {
            let one = read_one(path)?;
            match &mut all {
                None => all = Some(one),
                Some(all) => all.join(one, path)?,
            }
        }
        Ok(all)
    }

    fn join(&mut self, other: Self, path: &Path) -> Result<(), Error> {
        let refuse = |reason: String| {
            Err(Error::Manifest {
                path: path.to_path_buf(),
                reason,
            })
        };
        if let Some(difference) = self.rig.differences(&other.rig).first() {
            return refuse(format!(
                "its pictures must be of the same camera and lamps as those before, got {difference}"
            ));
        }
        if self.sun_zenith_deg != other.sun_zenith_deg {
            return refuse("its sun must stand as in those before".to_owned());
        }
        for (words, more) in [
            (&mut self.textures, other.textures),
            (&mut self.water_types, other.water_types),
        ] {
            for word in more {
                if !words.contains(&word) {
                    words.push(word);
                }
            }
        }
        Ok(())
    }
}

fn read_one(path: &Path) -> Result<Pictures, Error> {
    let refuse = |reason: String| Error::Manifest {
        path: path.to_path_buf(),
        reason,
    };
    let text = fs::read(path).map_err(|error| refuse(format!("cannot be read: {error}")))?;
    let value: Value = serde_json::from_slice(&text)
        .map_err(|error| refuse(format!("not valid JSON: {error}")))?;
    let document = Object::new(&value, "").map_err(|error| refuse(error.to_string()))?;
    if value["format"] != MANIFEST_FORMAT {
        return Err(refuse(format!("format must be {MANIFEST_FORMAT:?}")));
    }
    pictures(&document).map_err(|error| refuse(error.to_string()))
}

fn pictures(document: &Object) -> Result<Pictures, FieldError> {
    let config = document.object("config")?;
    let vehicle = config.object("vehicle")?;
    let exposure = document.get("exposure_m2_sr_per_w");
    Ok(Pictures {
        rig: Rig {
            width_px: Some(vehicle.number("width")?),
            height_px: Some(vehicle.number("height")?),
            hfov_deg: Some(vehicle.number("hfov_deg")?),
            exposure_m2_sr_per_w: exposure.and_then(Value::as_f64),
            noise_a: Some(vehicle.number("noise_a")?),
            noise_b: Some(vehicle.number("noise_b")?),
            lamps: Some(2.0),
            lamp_offset_m: Some(vehicle.number("lamp_offset_m")?),
            lamp_intensity_w_per_sr: Some(vehicle.number("lamp_intensity")?),
            lamp_half_angle_deg: Some(vehicle.number("lamp_half_angle_deg")?),
        },
        textures: words(&config, "textures")?,
        water_types: words(&config, "water_types")?,
        sun_zenith_deg: Some(vehicle.number("sun_zenith_deg")?),
    })
}

fn words(object: &Object, name: &str) -> Result<Vec<String>, FieldError> {
    let word = |item: &Value| match item.as_str() {
        Some(text) => Ok(text.to_owned()),
        None => Err(FieldError::wrong_type(object.path_of(name), "words", item)),
    };
    object.array(name)?.iter().map(word).collect()
}

/// Smallest and largest value of each input over the listed rows (not empty).
pub fn ranges(table: &Table, rows: &[usize]) -> Vec<[f32; 2]> {
    let columns = inputs(table.offsets).len();
    (0..columns)
        .map(|column| {
            let values = rows.iter().map(|&row| table.inputs[row][column]);
            values.fold([f32::INFINITY, f32::NEG_INFINITY], |[min, max], x| {
                [min.min(x), max.max(x)]
            })
        })
        .collect()
}

/// Median and 99th percentile of how far the prediction for no change is from the picture's own contrast, over the listed
/// rows in which nothing changes; `None` where there is no such row. Where the table tells the errors of that contrast, rows
/// are left out in which they are above a tenth of the allowance: there the misfit would be the picture's.
pub fn residual_here(model: &Model, table: &Table, rows: &[usize]) -> Option<[f64; 2]> {
    let column_of = |name: &str| inputs(table.offsets).iter().position(|i| i.name == name);
    let std = [
        column_of("std_r")?,
        column_of("std_g")?,
        column_of("std_b")?,
    ];
    let (distance, light) = (column_of("distance")?, column_of("light")?);
    let stays = |row: &[f32; INPUTS]| match table.offsets {
        Offsets::Delta => match (column_of("delta_distance"), column_of("delta_light")) {
            (Some(d), Some(l)) => row[d] == 0.0 && row[l] == 0.0,
            _ => false,
        },
        Offsets::Target | Offsets::Ahead => {
            match (column_of("target_distance"), column_of("target_light")) {
                (Some(d), Some(l)) => row[d] == row[distance] && row[l] == row[light],
                _ => false,
            }
        }
    };
    let well_known = |&row: &usize| match &table.std_errors {
        None => true,
        Some(errors) => (0..3).all(|k| {
            let allowed = misfit_allowance(f64::from(table.inputs[row][std[k]]));
            f64::from(errors[row][k]) <= KNOWN_SHARE * allowed
        }),
    };
    let here: Vec<[f32; INPUTS]> = rows
        .iter()
        .copied()
        .filter(well_known)
        .map(|row| table.inputs[row])
        .filter(stays)
        .collect();
    let mut misfits: Vec<f64> = model
        .predict(&here)
        .iter()
        .zip(&here)
        .map(|(predicted, row)| {
            contrast_misfit(predicted.map(f64::from), std.map(|k| f64::from(row[k])))
        })
        .collect();
    misfits.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let rank = (share * misfits.len() as f64).ceil() as usize;
        misfits.get(rank.max(1) - 1).copied()
    };
    Some([at(0.5)?, at(0.99)?])
}

/// The objects `camera`, `sensor`, `lamps` and `training` of a model file.
pub(crate) fn fields(
    rows: usize,
    residual_here: Option<[f64; 2]>,
    pictures: Option<&Pictures>,
) -> Map<String, Value> {
    let mut training = Map::new();
    training.insert("rows".to_owned(), rows.into());
    if let Some([median, p99]) = residual_here {
        let short = |misfit: f64| (misfit * 1e4).round() / 1e4;
        let normal = json!({"median": short(median), "p99": short(p99)});
        training.insert("residual_here".to_owned(), normal);
    }
    let mut fields = Map::new();
    if let Some(pictures) = pictures {
        fields = pictures.rig.to_json();
        training.insert("textures".to_owned(), json!(pictures.textures));
        training.insert("water_types".to_owned(), json!(pictures.water_types));
        if let Some(zenith_deg) = pictures.sun_zenith_deg {
            let sun = json!({"zenith_deg": zenith_deg, "azimuth_deg": SUN_AZIMUTH_DEG});
            training.insert("sun".to_owned(), sun);
        }
    }
    fields.insert("training".to_owned(), Value::Object(training));
    fields
}
