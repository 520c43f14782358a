//! The rows of one environment.

use std::fmt::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_calib::{DepthMeasurement, ImageStats, Profile};
use uw_guidance::features::{Candidate, FEATURES, FeatureValue, Situation};
use uw_guidance::observation::Observation;

use super::{DatasetConfig, DatasetError, environment_name};
use crate::environment::{Target, View, WaterBody, scene, sensor};
use crate::measure::{Quality, RenderedView};
use crate::routine;

/// Columns before the network's inputs.
const LEADING: [&str; 4] = [
    "environment",
    "texture",
    "water_type",
    "backscatter_fraction",
];
/// Columns after them: contrast after the change, 8-bit counts.
const OUTPUTS: [&str; 3] = ["contrast_r", "contrast_g", "contrast_b"];

/// The header line of the table.
pub(super) fn header() -> String {
    let names = LEADING
        .iter()
        .copied()
        .chain(FEATURES.iter().map(|f| f.name))
        .chain(OUTPUTS);
    names.collect::<Vec<_>>().join(",") + "\n"
}

/// Statistics of the image at one place and lamp level.
struct Image {
    depth_m: f64,
    distance_m: f64,
    light_pct: f64,
    stats: ImageStats,
}

/// Renders the environment, writes its profile, and returns its rows.
pub(super) fn make(
    config: &DatasetConfig,
    target: &Target,
    water: &WaterBody,
    depth: &[DepthMeasurement],
    quality: Quality,
    cancel: &AtomicBool,
    folder: &Path,
) -> Result<String, DatasetError> {
    let sensor = sensor(&config.vehicle, config.vehicle.exposure);
    let mut images = Vec::new();
    let mut contrast = Vec::new();
    let mut seed = quality.seed + 100;
    for &depth_m in &config.depths_m {
        for &distance_m in &config.distances_m {
            let scene = scene(
                &config.vehicle,
                water,
                target,
                View::Target {
                    depth_m,
                    distance_m,
                },
            )?;
            let view = RenderedView::render(&scene, Quality { seed, ..quality }, cancel)?;
            seed += 1;
            for &light_pct in &config.light_pct {
                images.push(Image {
                    depth_m,
                    distance_m,
                    light_pct,
                    stats: view.statistics(&sensor, light_pct),
                });
            }
            if depth_m == config.calibration_depth_m {
                let views = [(distance_m, &view)];
                contrast.extend(routine::measure_contrasts(
                    &sensor,
                    &views,
                    config.calibration_light_pct,
                ));
            }
        }
    }
    let made_by = concat!("uw dataset ", env!("CARGO_PKG_VERSION"));
    let profile = routine::profile(depth, &contrast, made_by)?;
    let name = environment_name(target.pattern, water);
    let path = folder.join("profiles").join(format!("{name}.json"));
    profile
        .write(&path)
        .map_err(|e| DatasetError::Inconsistent(e.to_string()))?;
    let leading = format!(
        "{name},{},{},{}",
        target.pattern.name(),
        water.jerlov,
        water.backscatter_fraction
    );
    rows(&images, &profile, &leading)
}

/// Every image with every image at the same depth.
fn rows(images: &[Image], profile: &Profile, leading: &str) -> Result<String, DatasetError> {
    let mut text = String::new();
    for now in images {
        let observation = Observation {
            depth_m: now.depth_m,
            distance_m: now.distance_m,
            light_pct: now.light_pct,
            mean: now.stats.mean,
            std: now.stats.contrast,
        };
        let situation = Situation::new(&observation, profile)
            .map_err(|e| DatasetError::Inconsistent(e.to_string()))?;
        for next in images.iter().filter(|i| i.depth_m == now.depth_m) {
            let candidate = Candidate {
                distance_m: next.distance_m,
                light_pct: next.light_pct,
            };
            text.push_str(leading);
            for feature in &FEATURES {
                let value = match feature.value {
                    FeatureValue::Fixed(of) => of(&situation),
                    FeatureValue::Varying(of) => of(&situation, &candidate),
                };
                push_number(&mut text, value);
            }
            next.stats
                .contrast
                .iter()
                .for_each(|&c| push_number(&mut text, c));
            text.push('\n');
        }
    }
    Ok(text)
}

fn push_number(text: &mut String, value: f64) {
    // Seven significant digits; writing to a string cannot fail.
    let rounded = format!("{value:.6e}").parse::<f64>().unwrap_or(value);
    let _ = write!(text, ",{rounded}");
}
