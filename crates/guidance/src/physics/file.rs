//! Water files (`uw-water/1`): what predictions by physics need of a water, a vehicle and a target seen before.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;
use uw_calib::photo::{Exposed, Shot, exposed};
use uw_calib::response::{CountResponse, LinearNoise};
use uw_calib::vehicle::Vignetting;
use uw_calib::{Encoding, Even, Rig};

use super::doubt::WaterDoubt;
use super::grid::PATCHES;
use super::predict::Place;
use super::target::Sight;
use super::water::{Field, SourceTables, WaterTables};
use crate::model_file::digest;

/// Name and version of the format.
pub const WATER_FORMAT: &str = "uw-water/1";
/// Most views, depths and waves of tables, and remembered sights: far more than any use has.
const MOST_NODES: usize = 1000;

/// Why there is no water file.
#[derive(Debug, Error)]
pub enum WaterFileError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// File name.
        file: String,
        /// The system's answer.
        source: std::io::Error,
    },
    /// It is no water file.
    #[error("{file}: not a usable water file ({WATER_FORMAT}): {reason}")]
    Content {
        /// File name.
        file: String,
        /// What is wrong: the field, what it must be and what it is.
        reason: String,
    },
}

/// The camera's sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorNumbers {
    /// Width of the pictures, pixels.
    pub width_px: usize,
    /// Height of the pictures, pixels.
    pub height_px: usize,
    /// How counts stand for light: "srgb" or "linear".
    pub encoding: Encoding,
    /// Linear signal per radiance, m² sr/W.
    pub exposure_m2_sr_per_w: f64,
    /// Variance of the linear signal y is `noise_a`·y + `noise_b`.
    pub noise_a: f64,
    /// See `noise_a`.
    pub noise_b: f64,
    /// What the camera's lens leaves of the light away from the middle; pictures are rid of it. `None`: all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vignetting: Option<Vignetting>,
}

impl SensorNumbers {
    /// What is compared with other files.
    pub fn rig(&self) -> Rig {
        Rig {
            width_px: Some(self.width_px as f64),
            height_px: Some(self.height_px as f64),
            exposure_m2_sr_per_w: Some(self.exposure_m2_sr_per_w),
            noise_a: Some(self.noise_a),
            noise_b: Some(self.noise_b),
            ..Rig::default()
        }
    }
}

/// The water itself, in three bands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaterNumbers {
    /// Absorption per channel, 1/m.
    pub a_per_m: [f64; 3],
    /// Scattering per channel, 1/m.
    pub b_per_m: [f64; 3],
    /// Share of the light that is scattered by more than 90°.
    pub backscatter_fraction: f64,
}

/// How a water was fitted to pictures. Errors are relative standard errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitNumbers {
    /// Of the absorption.
    pub a_relative_error: [f64; 3],
    /// Of the scattering.
    pub b_relative_error: [f64; 3],
    /// Of the backscatter fraction.
    pub backscatter_relative_error: f64,
    /// The water on Jerlov's scale, such as "3C-5C@0.42", where it was taken to be on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jerlov: Option<String>,
    /// Standard error of its place on the scale, types.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jerlov_error: Option<f64>,
    /// Light of the lamps times exposure, over those of the vehicle's file; the tables have it in them.
    pub lamp_gain: [f64; 3],
    /// Its error.
    pub lamp_gain_relative_error: [f64; 3],
    /// Daylight times exposure, over those of the vehicle's file; the tables have it in them. `None` where no picture shows daylight.
    pub daylight_gain: Option<[f64; 3]>,
    /// How far it is off in a picture, one with another; `None` also in files of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub daylight_gain_relative_error: Option<[f64; 3]>,
    /// Mean reflectance of the target, as far as the lamps' gain is known.
    pub reflectance: [f64; 3],
    /// What the rows and columns of `correlation` are.
    pub names: Vec<String>,
    /// Correlation of the logarithms of the fitted numbers.
    pub correlation: Vec<Vec<f64>>,
    /// Of `names`, what the pictures do not tell: its value is no more than a guess.
    pub not_identified: Vec<String>,
    /// Mean square of the residuals over what noise and model leave.
    pub misfit: f64,
    /// Exposure of the pictures that it is for, as EXIF states it: time (s) · ISO / f-number². `None` where no file states all three; also in files of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_s: Option<f64>,
    /// Sensitivity (ISO) of those pictures, where all that state it have the same; finite and > 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iso: Option<f64>,
}

/// A water file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaterFile {
    /// [`WATER_FORMAT`].
    pub format: String,
    /// What made it.
    pub made_by: String,
    /// The water.
    pub water: WaterNumbers,
    /// The sensor.
    pub sensor: SensorNumbers,
    /// What the water does to pictures.
    pub tables: WaterTables,
    /// A target as it was seen in it, from any distances; may be empty.
    pub sights: Vec<Sight>,
    /// How the water was found, where it was fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<FitNumbers>,
}

impl SensorNumbers {
    /// Mean and variance of the counts that it stores.
    pub fn response(&self) -> CountResponse {
        CountResponse::new(self.encoding, self.noise())
    }

    /// What takes the lens out of its pictures, where that is to be done.
    pub fn even(&self) -> Option<Even> {
        self.vignetting.map(|lens| Even::new(lens, self.encoding))
    }

    /// Noise of the linear signal.
    pub fn noise(&self) -> LinearNoise {
        LinearNoise {
            a: self.noise_a,
            b: self.noise_b,
        }
    }
}

impl WaterFile {
    /// Exposure of the pictures that it is for, as EXIF states it, where that is known.
    pub fn exposure_s(&self) -> Option<f64> {
        self.fit.as_ref()?.exposure_s
    }

    /// How a picture was exposed beside those that it is for; `None` where one of them is not known.
    pub fn exposed(&self, shot: &Shot) -> Option<Exposed> {
        exposed(shot, self.exposure_s(), self.fit.as_ref()?.iso)
    }

    /// The camera of its pictures.
    pub fn rig(&self) -> Rig {
        Rig {
            hfov_deg: Some(2.0 * self.tables.half_view[0].atan().to_degrees()),
            ..self.sensor.rig()
        }
    }

    /// Reads a water file.
    ///
    /// # Errors
    /// It cannot be read, or a field is missing, unknown or wrong.
    pub fn read(path: &Path) -> Result<Self, WaterFileError> {
        Ok(Self::read_with_digest(path)?.0)
    }

    /// The same with a digest of the file's bytes that tells it from others.
    ///
    /// # Errors
    /// It cannot be read, or a field is missing, unknown or wrong.
    pub fn read_with_digest(path: &Path) -> Result<(Self, String), WaterFileError> {
        let file = path.display().to_string();
        let bytes = fs::read(path).map_err(|source| WaterFileError::Read {
            file: file.clone(),
            source,
        })?;
        let content = |reason: String| WaterFileError::Content {
            file: file.clone(),
            reason,
        };
        let value: Value = serde_json::from_slice(&bytes).map_err(|e| content(e.to_string()))?;
        match value["format"].as_str() {
            Some(WATER_FORMAT) => {}
            other => {
                let got = other.map_or_else(|| "none".to_owned(), |name| format!("{name:?}"));
                let reason = format!("format must be {WATER_FORMAT:?}, got {got}");
                return Err(content(reason));
            }
        }
        let read: Self = serde_json::from_slice(&bytes).map_err(|e| content(e.to_string()))?;
        read.check().map_err(content)?;
        Ok((read, digest(&bytes)))
    }

    /// The file's text, its numbers to six digits: far more than they are known to.
    pub fn to_json(&self) -> String {
        let mut value = serde_json::to_value(self).unwrap_or_default();
        round(&mut value);
        let mut text = value.to_string();
        text.push('\n');
        text
    }

    /// The place of pictures in this water.
    pub fn place<'a>(&'a self, response: &'a CountResponse, depth_m: f64) -> Place<'a> {
        Place {
            tables: &self.tables,
            response,
            exposure: self.sensor.exposure_m2_sr_per_w,
            daylight: [1.0; 3],
            lamps: [1.0; 3],
            depth_m,
            doubt: self.doubt().and_then(Result::ok),
        }
    }

    /// What the fit leaves open of the water; `None` where it was not fitted.
    fn doubt(&self) -> Option<Result<WaterDoubt, String>> {
        let fit = self.fit.as_ref()?;
        Some(WaterDoubt::new(fit, &self.water))
    }

    /// Checks every number; the error names the field, what it must be and what it is.
    pub(super) fn check(&self) -> Result<(), String> {
        let sensor = &self.sensor;
        let not_negative = [
            ("sensor.noise_a", sensor.noise_a),
            ("sensor.noise_b", sensor.noise_b),
            (
                "water.backscatter_fraction",
                self.water.backscatter_fraction,
            ),
        ];
        for (field, value) in not_negative {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(format!("{field} must be finite and >= 0, got {value}"));
            }
        }
        if !(sensor.exposure_m2_sr_per_w > 0.0 && sensor.exposure_m2_sr_per_w.is_finite()) {
            return Err(format!(
                "sensor.exposure_m2_sr_per_w must be finite and > 0, got {}",
                sensor.exposure_m2_sr_per_w
            ));
        }
        if let Some(Err(error)) = self.doubt() {
            return Err(format!("fit.{error}"));
        }
        let fit = self.fit.as_ref();
        let stated = [
            ("exposure_s", fit.and_then(|fit| fit.exposure_s)),
            ("iso", fit.and_then(|fit| fit.iso)),
        ];
        for (field, value) in stated {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(format!("fit.{field} must be finite and > 0, got {value}"));
            }
        }
        self.tables.check()?;
        for (i, sight) in self.sights.iter().enumerate() {
            sight.check().map_err(|e| format!("sights[{i}].{e}"))?;
        }
        match self.sights.len() <= MOST_NODES {
            true => Ok(()),
            false => Err(format!("sights must be at most {MOST_NODES}")),
        }
    }
}

fn round(value: &mut Value) {
    match value {
        Value::Number(number) => {
            let rounded = number
                .as_f64()
                .and_then(|v| format!("{v:.5e}").parse().ok());
            if let Some(rounded) = rounded.and_then(serde_json::Number::from_f64)
                && number.is_f64()
            {
                *number = rounded;
            }
        }
        Value::Array(list) => list.iter_mut().for_each(round),
        Value::Object(object) => object.values_mut().for_each(round),
        _ => {}
    }
}

impl WaterTables {
    fn check(&self) -> Result<(), String> {
        let rising = |field: &str, values: &[f64], least: f64, fewest: usize| {
            let rise = values.windows(2).all(|pair| pair[0] < pair[1]);
            let right = values.iter().all(|v| v.is_finite() && *v >= least);
            match rise && right && (fewest..=MOST_NODES).contains(&values.len()) {
                true => Ok(()),
                false => Err(format!(
                    "tables.{field} must be {fewest} to {MOST_NODES} finite rising numbers >= {least}, got {values:?}"
                )),
            }
        };
        rising("depths_m", &self.depths_m, 0.0, 0)?;
        if let Some(sun) = self.sun
            && !((0.0..90.0).contains(&sun.zenith_deg) && sun.azimuth_deg.is_finite())
        {
            return Err(format!(
                "tables.sun must have a zenith_deg in [0, 90) and a finite azimuth_deg, got {} and {}",
                sun.zenith_deg, sun.azimuth_deg
            ));
        }
        rising("frequencies_per_m", &self.frequencies_per_m, 1e-9, 2)?;
        rising("views.distance_m", &self.distances_m(), 1e-3, 2)?;
        if !self.half_view.iter().all(|v| *v > 0.0 && v.is_finite()) {
            return Err(format!(
                "tables.half_view must be > 0, got {:?}",
                self.half_view
            ));
        }
        for (i, view) in self.views.iter().enumerate() {
            if view.daylight.len() != self.depths_m.len() {
                return Err(format!(
                    "tables.views[{i}].daylight must have one entry for each of the {} depths, got {}",
                    self.depths_m.len(),
                    view.daylight.len()
                ));
            }
            let named = |e: String| format!("tables.views[{i}].{e}");
            let waves = self.frequencies_per_m.len();
            view.lamps.check("lamps", waves).map_err(named)?;
            for (j, source) in view.daylight.iter().enumerate() {
                let name = format!("daylight[{j}]");
                source.check(&name, waves).map_err(named)?;
            }
        }
        Ok(())
    }
}

impl SourceTables {
    fn check(&self, name: &str, waves: usize) -> Result<(), String> {
        let fields: [(&str, &Field); 4] = [
            ("veil", &self.veil),
            ("light", &self.light),
            ("straight", &self.straight),
            ("scattered", &self.scattered),
        ];
        for (field, values) in fields {
            for channel in values {
                let right = channel.iter().all(|v| v.is_finite() && *v >= 0.0);
                if channel.len() != PATCHES || !right {
                    return Err(format!(
                        "{name}.{field} must be {PATCHES} finite numbers >= 0 per channel, got {}",
                        channel.len()
                    ));
                }
            }
        }
        for channel in &self.transfer {
            if channel.len() != waves || !channel.iter().all(|v| (-1.0..=1.0).contains(v)) {
                return Err(format!(
                    "{name}.transfer must be {waves} numbers in [-1, 1] per channel, one for each wave, got {}",
                    channel.len()
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
