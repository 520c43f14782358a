//! What an operation is: the track, the waters, the vehicle, the methods.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use uw_calib::vehicle::Vehicle;
use uw_guidance::features::Candidate;
use uw_media::WaterType;
use uw_scenery::textures::Pattern;
use uw_twin::environment::WaterBody;

/// The value of the field `format`.
pub(super) const FORMAT: &str = "uw-operation/1";

/// The configuration of an operation (TOML); every field but `format` has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OperationConfig {
    /// "uw-operation/1".
    pub format: String,
    /// Seed of renders, sensor noise and tracks.
    pub seed: u64,
    /// Texture of the target; upright targets are inspected sideways, bottoms from above.
    pub target: String,
    /// Depths of the legs, m, from the shallowest.
    pub depths_m: Vec<f64>,
    /// Distances at which views are rendered, m, increasing; a method gets the view nearest to what it chose.
    pub distances_m: Vec<f64>,
    /// Lamp levels that methods try that try all, percent.
    pub light_pct: Vec<f64>,
    /// Way along the target between views, m.
    pub step_m: f64,
    /// Sideways distance of the legs over a bottom, m; on an upright target their depths hold them apart.
    pub lane_m: f64,
    /// Largest error of a place along its leg, m.
    pub track_error_m: f64,
    /// Places on each leg at which views are rendered.
    pub stations: usize,
    /// Views of one repetition per leg, at most `stations`; repetitions start at different stations.
    pub views_per_leg: usize,
    /// Repetitions.
    pub repetitions: usize,
    /// Speed along the path, m/s.
    pub speed_m_per_s: f64,
    /// Distance before the first view, m.
    pub start_distance_m: f64,
    /// Lamp level before the first view, percent.
    pub start_light_pct: f64,
    /// Model file of the guidance; none for the shipped one.
    pub model: Option<PathBuf>,
    /// Presets of the objective that the guidance is flown with; the first is "proposed".
    pub presets: Vec<String>,
    /// Set distances and lamp levels that are flown beside the methods, the nearest of `distances_m` being seen; those of
    /// the publication are 1 m at 50 % and 2 m at 25 %.
    pub patterns: Vec<Candidate>,
    /// Edge of NIQE's blocks, pixels, even.
    pub niqe_block_px: usize,
    /// Fewest true inliers for which the area of a view counts as covered.
    pub covered_inliers: usize,
    /// The waters.
    pub water: Vec<WaterConfig>,
    /// The calibration before the operation.
    pub calibration: CalibrationConfig,
    /// The twin, which advises by physics from a water fitted to the calibration's pictures; without it only waters with a
    /// `water_file` have a twin.
    pub twin: Option<TwinConfig>,
    /// How long views are rendered.
    pub quality: QualityConfig,
    /// The vehicle.
    pub vehicle: Vehicle,
}

/// Patterns of the publication.
pub(super) const PUBLISHED_PATTERNS: [Candidate; 2] = [
    Candidate {
        distance_m: 1.0,
        light_pct: 50.0,
    },
    Candidate {
        distance_m: 2.0,
        light_pct: 25.0,
    },
];

/// One of the waters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaterConfig {
    /// Name in tables, such as "low".
    pub name: String,
    /// Jerlov type.
    pub jerlov: String,
    /// Backscatter fraction of the phase function.
    pub backscatter_fraction: f64,
    /// Distance of the image whose value the methods hold that hold a value, m, one of `distances_m`.
    pub held_distance_m: f64,
    /// Water file (uw-water/1) that a twin beside the fitted one advises from; relative to the configuration's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub water_file: Option<PathBuf>,
}

/// How the twin's water is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TwinConfig {
    /// Paths per distance of the fit, in thousands.
    pub kilo_paths: u32,
    /// Paths per view and source of the water's tables, in thousands.
    pub table_kilo_paths: u32,
    /// Whether it has in mind what it saw on its way, as the daemon has.
    pub remembers: bool,
}

/// The calibration routine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CalibrationConfig {
    /// Depths of the images that look up, m, increasing.
    pub depths_m: Vec<f64>,
    /// Depth of the images of the target, m.
    pub contrast_depth_m: f64,
    /// Distances of the images of the target, m, out of `distances_m`.
    pub distances_m: Vec<f64>,
    /// Lamp level of those with lamps on, percent.
    pub light_pct: f64,
    /// Samples per pixel of each half of an image that looks up.
    pub up_samples_per_half: u32,
}

/// How long views are rendered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QualityConfig {
    /// Standard deviation of the render of daylight and of lamps, each against that of the sensor's noise in its
    /// picture alone: root of the ratio of the mean variances over pixels and channels.
    pub noise_share: f64,
    /// Fewest samples per pixel of either.
    pub least_samples: u32,
    /// Most samples per pixel of either.
    pub most_samples: u32,
    /// Samples per pixel of the renders that tell the variance.
    pub pilot_samples: u32,
}

impl Default for OperationConfig {
    fn default() -> Self {
        Self {
            format: FORMAT.into(),
            seed: 1,
            target: Pattern::HullRed.name().into(),
            depths_m: vec![1.0, 2.0, 3.5, 5.0],
            distances_m: (2..=12).map(|i| 0.25 * f64::from(i)).collect(),
            light_pct: vec![0.0, 25.0, 50.0, 75.0, 100.0],
            step_m: 0.5,
            lane_m: 1.5,
            track_error_m: 0.05,
            stations: 10,
            views_per_leg: 8,
            repetitions: 5,
            speed_m_per_s: 0.25,
            start_distance_m: 1.5,
            start_light_pct: 50.0,
            model: None,
            presets: vec!["release".into(), "paper".into(), "tracking".into()],
            patterns: PUBLISHED_PATTERNS.to_vec(),
            niqe_block_px: 48,
            covered_inliers: 15,
            water: vec![
                WaterConfig {
                    name: "low".into(),
                    jerlov: "IB".into(),
                    backscatter_fraction: 0.01,
                    held_distance_m: 2.0,
                    water_file: None,
                },
                WaterConfig {
                    name: "high".into(),
                    jerlov: "3C".into(),
                    backscatter_fraction: 0.0183,
                    held_distance_m: 1.0,
                    water_file: None,
                },
            ],
            calibration: CalibrationConfig::default(),
            twin: None,
            quality: QualityConfig::default(),
            vehicle: small_camera(),
        }
    }
}

/// A camera with few pixels, because a flight shows many views: use it with a model that was trained with the same.
fn small_camera() -> Vehicle {
    Vehicle {
        width: 240,
        height: 135,
        exposure: 8.0,
        ..Vehicle::default()
    }
}

impl Default for CalibrationConfig {
    fn default() -> Self {
        Self {
            depths_m: vec![0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            contrast_depth_m: 3.0,
            distances_m: vec![0.5, 1.0, 1.5, 2.0, 2.5, 3.0],
            light_pct: 67.0,
            up_samples_per_half: 64,
        }
    }
}

impl Default for TwinConfig {
    fn default() -> Self {
        Self {
            kilo_paths: 64,
            table_kilo_paths: 128,
            remembers: true,
        }
    }
}

impl Default for QualityConfig {
    fn default() -> Self {
        Self {
            noise_share: 5.0,
            least_samples: 2,
            most_samples: 8,
            pilot_samples: 2,
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
    /// The file is no valid configuration.
    #[error("{path}: {message}")]
    Invalid {
        /// The file.
        path: String,
        /// Field, value and what would be right.
        message: String,
    },
}

impl WaterConfig {
    /// The water body.
    pub fn body(&self) -> Result<WaterBody, String> {
        let jerlov: WaterType = self
            .jerlov
            .parse()
            .map_err(|e| format!("water.jerlov: {e}"))?;
        Ok(WaterBody {
            jerlov: jerlov.into(),
            backscatter_fraction: self.backscatter_fraction,
        })
    }
}

impl OperationConfig {
    /// Reads and checks a configuration file; relative paths of model and water files are relative to the file.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|source| ConfigError::Read {
            path: name.clone(),
            source,
        })?;
        let invalid = |message| ConfigError::Invalid {
            path: name.clone(),
            message,
        };
        let mut config: Self = toml::from_str(&text).map_err(|e| invalid(e.to_string()))?;
        config.check().map_err(invalid)?;
        if let Some(folder) = path.parent() {
            let waters = config.water.iter_mut().map(|water| &mut water.water_file);
            for file in waters.chain([&mut config.model]).flatten() {
                *file = folder.join(&*file);
            }
        }
        Ok(config)
    }

    /// The target's texture.
    pub fn pattern(&self) -> Result<Pattern, String> {
        Pattern::from_name(&self.target).ok_or_else(|| {
            let known = Pattern::ALL.map(Pattern::name).join(", ");
            format!("target must be one of {known}, got {:?}", self.target)
        })
    }

    /// Index of the rendered distance nearest to a chosen one.
    pub fn nearest_distance(&self, distance_m: f64) -> usize {
        let off = |i: &usize| (self.distances_m[*i] - distance_m).abs();
        (0..self.distances_m.len())
            .min_by(|i, j| off(i).total_cmp(&off(j)))
            .unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_survives_its_text() {
        let config = OperationConfig::default();
        config.check().expect("valid");
        let text = toml::to_string(&config).expect("text");
        assert_eq!(
            toml::from_str::<OperationConfig>(&text).expect("parsed"),
            config
        );
    }

    #[test]
    fn the_shipped_configurations_differ_in_their_patterns_only() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
        let [operation, mut pairs] = ["operation.toml", "set_pairs.toml"]
            .map(|name| OperationConfig::read(&folder.join(name)).expect("valid"));
        assert!(pairs.patterns.len() > operation.patterns.len());
        pairs.patterns.clone_from(&operation.patterns);
        assert_eq!(operation, pairs);
    }

    #[test]
    fn the_twin_s_configurations_fly_one_operation_before_two_targets() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
        let [operation, seen, mut unseen] = ["operation.toml", "twin.toml", "twin_unseen.toml"]
            .map(|name| OperationConfig::read(&folder.join(name)).expect("valid"));
        assert_eq!(seen.twin, Some(TwinConfig::default()));
        assert!(seen.target != unseen.target);
        unseen.target.clone_from(&seen.target);
        assert_eq!(seen, unseen);
        assert_eq!(
            (&seen.water, &seen.vehicle),
            (&operation.water, &operation.vehicle)
        );
    }

    #[test]
    fn files_are_looked_for_beside_the_configuration() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("operation.toml");
        let water = OperationConfig::default().water.remove(0);
        let config = OperationConfig {
            model: Some("model.json".into()),
            water: vec![WaterConfig {
                water_file: Some("water.json".into()),
                ..water
            }],
            ..OperationConfig::default()
        };
        std::fs::write(&path, toml::to_string(&config).expect("text")).expect("written");
        let read = OperationConfig::read(&path).expect("valid");
        assert_eq!(read.model, Some(folder.path().join("model.json")));
        let file = read.water[0].water_file.clone();
        assert_eq!(file, Some(folder.path().join("water.json")));
    }

    #[test]
    fn set_pairs_are_checked() {
        let flown = |distance_m, light_pct| {
            let mut config = OperationConfig::default();
            config.patterns.push(Candidate {
                distance_m,
                light_pct,
            });
            config.check()
        };
        assert_eq!(flown(1.25, 100.0), Ok(()));
        for (distance_m, light_pct, words) in [
            (0.0, 50.0, "patterns.distance_m must be in [0.1, 10], got 0"),
            (
                1.5,
                101.0,
                "patterns.light_pct must be in [0, 100], got 101",
            ),
            (2.0, 25.0, "2 m at 25 % twice"),
        ] {
            let message = flown(distance_m, light_pct).expect_err(words);
            assert!(message.contains(words), "{message}");
        }
    }

    #[test]
    fn the_nearest_rendered_distance_is_taken() {
        let config = OperationConfig::default();
        assert_eq!(config.distances_m[config.nearest_distance(1.62)], 1.5);
        assert_eq!(config.distances_m[config.nearest_distance(1.63)], 1.75);
        assert_eq!(config.distances_m[config.nearest_distance(9.0)], 3.0);
    }
}
