//! What a dataset covers: the grid, the calibration routine, the vehicle, and how well images must be known.

use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::{Table, Value};
use uw_media::WaterType;
use uw_media::spectral::WaterBands;

use super::accuracy::Accuracy;
use super::presets;
use uw_calib::vehicle::{Vehicle, VehicleFile};
use uw_scenery::textures::Pattern;
use uw_twin::environment::{JerlovWater, MEAN, WaterBody};

/// The value of the field `format`.
const FORMAT: &str = "uw-dataset/1";

/// How the exposure of images of the target is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ExposureMode {
    /// One for the whole set, chosen once from renders of every environment; see `exposure_grey`.
    Chosen,
    /// One for the whole set: `vehicle.exposure`.
    Fixed,
    /// Each image's own, bringing its mean signal to `exposure_grey`.
    Auto,
}

/// Which tables are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TableFormat {
    /// Parquet.
    Parquet,
    /// Comma-separated text.
    Csv,
}

/// A dataset's configuration (TOML); every field but `format` has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DatasetConfig {
    /// "uw-dataset/1".
    pub format: String,
    /// Seed of all renders.
    pub seed: u64,
    /// Names of textures.
    pub textures: Vec<String>,
    /// Jerlov types, or mixtures such as "IB-II@0.4".
    pub water_types: Vec<String>,
    /// How wavelengths become channels: "mean" and the other names of three bands, or by wavelength "spectral" and
    /// "spectral-measured".
    pub bands: String,
    /// Backscatter fractions of the phase function.
    pub backscatter_fractions: Vec<f64>,
    /// Depths of the camera, m.
    pub depths_m: Vec<f64>,
    /// Distances to the target, now and after the change, m.
    pub distances_m: Vec<f64>,
    /// Lamp levels, now and after the change, percent.
    pub light_pct: Vec<f64>,
    /// Tilts of the optical axis against the target's normal, degrees. A change of distance keeps the tilt.
    pub tilts_deg: Vec<f64>,
    /// Depths of the calibration's images that look up, m, increasing.
    pub calibration_depths_m: Vec<f64>,
    /// Depth at which the calibration takes its contrast profiles, m; one of `depths_m`.
    pub calibration_depth_m: f64,
    /// Lamp level of the calibration's profile with lamps on, percent.
    pub calibration_light_pct: f64,
    /// How the exposure is set.
    pub exposure: ExposureMode,
    /// Mean linear signal of the brightest channel that a typical image (`chosen`) or every image (`auto`) gets.
    pub exposure_grey: f64,
    /// Tables to write.
    pub tables: Vec<TableFormat>,
    /// When a render stops.
    pub accuracy: Accuracy,
    /// The vehicle.
    pub vehicle: Vehicle,
}

impl Default for DatasetConfig {
    /// The grid of the paper.
    fn default() -> Self {
        Self {
            format: FORMAT.into(),
            seed: 1,
            textures: vec!["hull_red".into(), "seabed".into()],
            water_types: WaterType::ALL.iter().map(ToString::to_string).collect(),
            bands: MEAN.to_string(),
            backscatter_fractions: vec![0.005, 0.01, 0.0183, 0.05],
            depths_m: vec![1.0, 3.0, 5.0],
            distances_m: vec![0.5, 1.0, 1.5, 2.0, 2.5, 3.0],
            light_pct: vec![0.0, 33.0, 67.0, 100.0],
            tilts_deg: vec![0.0],
            calibration_depths_m: vec![0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            calibration_depth_m: 3.0,
            calibration_light_pct: 67.0,
            exposure: ExposureMode::Chosen,
            exposure_grey: 0.18,
            tables: vec![TableFormat::Parquet, TableFormat::Csv],
            accuracy: Accuracy::default(),
            vehicle: Vehicle::default(),
        }
    }
}

/// A configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Read {
        /// The file.
        path: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is not valid; the message of the parser holds line and field.
    #[error("{path}: {message}")]
    Parse {
        /// The file.
        path: String,
        /// What is wrong where.
        message: String,
    },
    /// A value is wrong.
    #[error("{path}: {message}")]
    Value {
        /// The file.
        path: String,
        /// Field, value and what would be right.
        message: String,
    },
}

impl DatasetConfig {
    /// The grid of that name: "paper" or "wide".
    pub fn preset(name: &str) -> Option<Self> {
        presets::preset(name)
    }

    /// Reads and checks a configuration file. `vehicle` may be the name of a shipped vehicle or a file (relative to the
    /// configuration) in the place of a table; the configuration then holds its values.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|source| ConfigError::Read {
            path: name.clone(),
            source,
        })?;
        let wrong = |message: String| ConfigError::Parse {
            path: name.clone(),
            message,
        };
        let config = match vehicle_named(&text) {
            Some((mut table, named)) => {
                let folder = path.parent().unwrap_or(Path::new(""));
                let vehicle = VehicleFile::find(&named, folder)
                    .map_err(|e| wrong(format!("vehicle: {e}")))?
                    .vehicle;
                table.remove("vehicle");
                let config = Self::deserialize(Value::Table(table));
                config.map(|config| Self { vehicle, ..config })
            }
            None => toml::from_str(&text),
        };
        let config = config.map_err(|e| wrong(e.to_string()))?;
        config.check().map_err(|message| ConfigError::Value {
            path: name,
            message,
        })?;
        Ok(config)
    }

    /// Checks every value.
    pub fn check(&self) -> Result<(), String> {
        if self.format != FORMAT {
            return Err(format!(
                "format must be \"{FORMAT}\", got {:?}",
                self.format
            ));
        }
        for name in &self.textures {
            if Pattern::from_name(name).is_none() {
                let known = Pattern::ALL.map(Pattern::name).join(", ");
                return Err(format!(
                    "textures: unknown texture {name:?}; known are {known}"
                ));
            }
        }
        let bands: WaterBands = self.bands.parse().map_err(|e| format!("bands: {e}"))?;
        self.vehicle.check()?;
        let colours = self
            .vehicle
            .colours()
            .map_err(|e| format!("vehicle: {e}"))?;
        for name in &self.water_types {
            let water: JerlovWater = name.parse().map_err(|e| format!("water_types: {e}"))?;
            let iops = bands.iops(water, &colours.response);
            iops.map_err(|e| format!("bands: {e}"))?;
        }
        if let (WaterBands::Three(_), Some(field)) = (bands, self.vehicle.needs_wavelengths()) {
            return Err(format!(
                "vehicle.{field} counts by wavelength alone: bands must be \"spectral\", got {:?}",
                self.bands
            ));
        }
        if self.textures.is_empty() || self.water_types.is_empty() {
            return Err("textures and water_types must not be empty".into());
        }
        self.check_numbers()?;
        self.check_calibration()?;
        self.accuracy.check()
    }

    fn check_numbers(&self) -> Result<(), String> {
        let fractions = &self.backscatter_fractions;
        numbers("backscatter_fractions", fractions, 1e-6, 0.499_999)?;
        numbers("depths_m", &self.depths_m, 0.01, 1e4)?;
        numbers("distances_m", &self.distances_m, 0.05, 10.0)?;
        numbers("light_pct", &self.light_pct, 0.0, 100.0)?;
        numbers("tilts_deg", &self.tilts_deg, -60.0, 60.0)?;
        let depths = &self.calibration_depths_m;
        numbers("calibration_depths_m", depths, 0.01, 1e4)?;
        let level = [self.calibration_light_pct];
        numbers("calibration_light_pct", &level, 1e-3, 100.0)?;
        numbers("exposure_grey", &[self.exposure_grey], 1e-3, 1.0)?;
        for (field, values) in [
            ("backscatter_fractions", &self.backscatter_fractions),
            ("depths_m", &self.depths_m),
            ("distances_m", &self.distances_m),
            ("light_pct", &self.light_pct),
            ("tilts_deg", &self.tilts_deg),
        ] {
            let again = |i: usize| values[..i].contains(&values[i]);
            if let Some(i) = (0..values.len()).find(|&i| again(i)) {
                return Err(format!(
                    "{field} must not repeat a value, got {} twice",
                    values[i]
                ));
            }
        }
        Ok(())
    }

    fn check_calibration(&self) -> Result<(), String> {
        if self.calibration_depths_m.windows(2).any(|w| w[0] >= w[1]) {
            return Err(format!(
                "calibration_depths_m must increase, got {:?}",
                self.calibration_depths_m
            ));
        }
        if !self.depths_m.contains(&self.calibration_depth_m) {
            let (got, known) = (self.calibration_depth_m, &self.depths_m);
            return Err(format!(
                "calibration_depth_m must be one of depths_m {known:?}, got {got}"
            ));
        }
        let levels = &self.light_pct;
        if !(levels.contains(&0.0) && levels.contains(&self.calibration_light_pct)) {
            return Err(format!(
                "light_pct must hold 0 and calibration_light_pct ({}), got {levels:?}",
                self.calibration_light_pct
            ));
        }
        let (first, last) = (
            self.calibration_depths_m[0],
            self.calibration_depths_m[self.calibration_depths_m.len() - 1],
        );
        if let Some(outside) = self.depths_m.iter().find(|d| !(first..=last).contains(*d)) {
            return Err(format!(
                "depths_m must lie inside calibration_depths_m ({first} to {last} m), got {outside}"
            ));
        }
        Ok(())
    }

    /// The configuration as TOML.
    pub fn to_text(&self) -> Result<String, String> {
        toml::to_string(self).map_err(|e| e.to_string())
    }

    /// The targets' textures.
    pub fn patterns(&self) -> Vec<Pattern> {
        self.textures
            .iter()
            .filter_map(|n| Pattern::from_name(n))
            .collect()
    }

    /// How wavelengths become channels.
    pub fn water_bands(&self) -> WaterBands {
        self.bands.parse().unwrap_or(MEAN)
    }

    /// All waters, types outermost.
    pub fn waters(&self) -> Vec<WaterBody> {
        let kinds = self.water_types.iter().filter_map(|t| t.parse().ok());
        kinds
            .flat_map(|jerlov: JerlovWater| {
                self.backscatter_fractions
                    .iter()
                    .map(move |&backscatter_fraction| WaterBody {
                        jerlov,
                        backscatter_fraction,
                    })
            })
            .collect()
    }
}

/// A configuration whose `vehicle` is a text instead of a table, and that text.
fn vehicle_named(text: &str) -> Option<(Table, String)> {
    let table: Table = toml::from_str(text).ok()?;
    let named = table.get("vehicle")?.as_str()?.to_owned();
    Some((table, named))
}

fn numbers(field: &str, values: &[f64], least: f64, most: f64) -> Result<(), String> {
    if values.is_empty() {
        return Err(format!("{field} must not be empty"));
    }
    match values.iter().find(|v| !(least..=most).contains(*v)) {
        Some(v) => Err(format!("{field} must be in [{least}, {most}], got {v}")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
