//! What a dataset covers: the grid, the calibration routine, the vehicle.

use std::path::Path;

use serde::{Deserialize, Serialize};
use uw_media::WaterType;

use crate::environment::WaterBody;
use crate::scenery::textures::Pattern;
use crate::vehicle::Vehicle;

/// The value of the field `format`.
const FORMAT: &str = "uw-dataset/1";

/// A dataset's configuration (TOML); every field but `format` has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DatasetConfig {
    /// "uw-dataset/1".
    pub format: String,
    /// Seed of all renders.
    pub seed: u64,
    /// Samples per pixel of each of the two halves of a view of the target.
    pub samples_per_half: u32,
    /// The same for views that look up.
    pub up_samples_per_half: u32,
    /// Names of textures.
    pub textures: Vec<String>,
    /// Jerlov types.
    pub water_types: Vec<String>,
    /// Backscatter fractions of the phase function.
    pub backscatter_fractions: Vec<f64>,
    /// Depths of the camera, m.
    pub depths_m: Vec<f64>,
    /// Distances to the target, now and after the change, m.
    pub distances_m: Vec<f64>,
    /// Lamp levels, now and after the change, percent.
    pub light_pct: Vec<f64>,
    /// Depths of the calibration's images that look up, m, increasing.
    pub calibration_depths_m: Vec<f64>,
    /// Depth at which the calibration takes its contrast profiles, m; one of `depths_m`.
    pub calibration_depth_m: f64,
    /// Lamp level of the calibration's profile with lamps on, percent.
    pub calibration_light_pct: f64,
    /// The vehicle.
    pub vehicle: Vehicle,
}

impl Default for DatasetConfig {
    fn default() -> Self {
        Self {
            format: FORMAT.into(),
            seed: 1,
            samples_per_half: 8,
            up_samples_per_half: 64,
            textures: vec!["hull_red".into(), "seabed".into()],
            water_types: WaterType::ALL.iter().map(ToString::to_string).collect(),
            backscatter_fractions: vec![0.005, 0.01, 0.0183, 0.05],
            depths_m: vec![1.0, 3.0, 5.0],
            distances_m: vec![0.5, 1.0, 1.5, 2.0, 2.5, 3.0],
            light_pct: vec![0.0, 33.0, 67.0, 100.0],
            calibration_depths_m: vec![0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            calibration_depth_m: 3.0,
            calibration_light_pct: 67.0,
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
    /// Reads and checks a configuration file.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|source| ConfigError::Read {
            path: name.clone(),
            source,
        })?;
        let config: Self = toml::from_str(&text).map_err(|e| ConfigError::Parse {
            path: name.clone(),
            message: e.to_string(),
        })?;
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
        if self.samples_per_half == 0 || self.up_samples_per_half == 0 {
            return Err("samples_per_half and up_samples_per_half must be at least 1".into());
        }
        for name in &self.textures {
            if Pattern::from_name(name).is_none() {
                let known = Pattern::ALL.map(Pattern::name).join(", ");
                return Err(format!(
                    "textures: unknown texture {name:?}; known are {known}"
                ));
            }
        }
        for name in &self.water_types {
            name.parse::<WaterType>()
                .map_err(|e| format!("water_types: {e}"))?;
        }
        numbers(
            "backscatter_fractions",
            &self.backscatter_fractions,
            1e-6,
            0.499_999,
        )?;
        numbers("depths_m", &self.depths_m, 0.01, 1e4)?;
        numbers("distances_m", &self.distances_m, 0.05, 10.0)?;
        numbers("light_pct", &self.light_pct, 0.0, 100.0)?;
        numbers(
            "calibration_depths_m",
            &self.calibration_depths_m,
            0.01,
            1e4,
        )?;
        numbers(
            "calibration_light_pct",
            &[self.calibration_light_pct],
            1e-3,
            100.0,
        )?;
        if self.textures.is_empty() || self.water_types.is_empty() {
            return Err("textures and water_types must not be empty".into());
        }
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
        let (first, last) = (
            self.calibration_depths_m[0],
            self.calibration_depths_m[self.calibration_depths_m.len() - 1],
        );
        if let Some(outside) = self.depths_m.iter().find(|d| !(first..=last).contains(*d)) {
            return Err(format!(
                "depths_m must lie inside calibration_depths_m ({first} to {last} m), got {outside}"
            ));
        }
        self.vehicle.check()
    }

    /// The configuration as TOML.
    pub fn to_text(&self) -> Result<String, String> {
        toml::to_string(self).map_err(|e| e.to_string())
    }

    /// All environments, targets outermost.
    pub fn environments(&self) -> Vec<(Pattern, WaterBody)> {
        let mut all = Vec::new();
        for pattern in self.textures.iter().filter_map(|n| Pattern::from_name(n)) {
            for jerlov in self.water_types.iter().filter_map(|t| t.parse().ok()) {
                for &backscatter_fraction in &self.backscatter_fractions {
                    all.push((
                        pattern,
                        WaterBody {
                            jerlov,
                            backscatter_fraction,
                        },
                    ));
                }
            }
        }
        all
    }

    /// Seed of the renders of environment `index`.
    pub fn environment_seed(&self, index: usize) -> u64 {
        self.seed
            .wrapping_mul(1_000_003)
            .wrapping_add(1000 * index as u64)
    }

    /// Number of renders of targets, two halves each counted as one.
    pub fn renders(&self) -> usize {
        self.environments().len() * self.depths_m.len() * self.distances_m.len()
    }
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
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_is_the_grid_of_the_paper() {
        let config = DatasetConfig::default();
        config.check().unwrap();
        let pairs = (config.distances_m.len() * config.light_pct.len()).pow(2);
        assert_eq!(
            config.environments().len() * config.depths_m.len() * pairs,
            138_240
        );
        assert_eq!(config.renders(), 1440);
    }

    #[test]
    fn wrong_values_are_named() {
        let mut config = DatasetConfig::default();
        config.textures.push("lawn".into());
        assert!(config.check().unwrap_err().contains("lawn"));
        let config = DatasetConfig {
            distances_m: vec![0.5, f64::NAN],
            ..DatasetConfig::default()
        };
        assert!(
            config
                .check()
                .unwrap_err()
                .contains("distances_m must be in [0.05, 10], got NaN")
        );
    }
}
