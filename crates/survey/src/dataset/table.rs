//! The entries: every image with every image of the same depth, as columns.

use std::fmt::Write;

use uw_calib::{ContrastMeasurement, DepthMeasurement, Profile};
use uw_guidance::features::{Candidate, FEATURES, FeatureValue, Situation};
use uw_guidance::observation::Observation;

use super::plan::{Environment, Upward};
use super::rows::{self, ImageRow};
use super::{DatasetError, ExposureMode, Workshop};
use uw_twin::routine;

/// A column of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name.
    pub name: &'static str,
    /// Unit as model files write it; empty for words.
    pub unit: &'static str,
    /// What it holds.
    pub meaning: &'static str,
}

/// Columns of words, before the numbers.
pub const WORDS: [Column; 3] = [
    column(
        "environment",
        "",
        "texture, water, backscatter fraction and tilt",
    ),
    column("texture", "", "texture of the target"),
    column("water_type", "", "Jerlov type, or a mixture of two"),
];

/// Columns of numbers around the network's inputs.
const BEFORE: [Column; 2] = [
    column("backscatter_fraction", "1", "of the phase function"),
    column("tilt", "deg", "optical axis against the target's normal"),
];
const AFTER: [Column; 9] = [
    column(
        "contrast_r",
        "8bit_counts",
        "output: contrast after the change, red",
    ),
    column(
        "contrast_g",
        "8bit_counts",
        "output: contrast after the change, green",
    ),
    column(
        "contrast_b",
        "8bit_counts",
        "output: contrast after the change, blue",
    ),
    column(
        "contrast_error_r",
        "8bit_counts",
        "standard error of contrast_r",
    ),
    column(
        "contrast_error_g",
        "8bit_counts",
        "standard error of contrast_g",
    ),
    column(
        "contrast_error_b",
        "8bit_counts",
        "standard error of contrast_b",
    ),
    column("std_error_r", "8bit_counts", "standard error of std_r"),
    column("std_error_g", "8bit_counts", "standard error of std_g"),
    column("std_error_b", "8bit_counts", "standard error of std_b"),
];

const fn column(name: &'static str, unit: &'static str, meaning: &'static str) -> Column {
    Column {
        name,
        unit,
        meaning,
    }
}

/// All columns of numbers, in order.
pub fn numbers() -> Vec<Column> {
    let inputs = FEATURES
        .iter()
        .map(|f| column(f.name, f.unit, "input of the network"));
    BEFORE.iter().cloned().chain(inputs).chain(AFTER).collect()
}

/// The entries of one environment.
pub struct Entries {
    /// Values of [`WORDS`], the same for all its rows.
    pub words: [String; 3],
    /// Rows of [`numbers`], rounded to seven significant digits.
    pub rows: Vec<Vec<f32>>,
}

/// The entries of an environment, and its profile.
pub(super) fn entries(
    workshop: &Workshop,
    environment: &Environment,
) -> Result<(Entries, Profile), DatasetError> {
    let config = workshop.config;
    let mut images: Vec<(f64, ImageRow)> = Vec::new();
    for &distance_m in &config.distances_m {
        let rows = rows::read(workshop, &environment.group(distance_m))?;
        images.extend(rows.into_iter().map(|row| (distance_m, row)));
    }
    let profile = profile(workshop, environment, &images)?;
    let mut rows = Vec::new();
    for &depth_m in &config.depths_m {
        let here: Vec<_> = images
            .iter()
            .filter(|(_, i)| i.depth_m == depth_m)
            .collect();
        for &&(distance_m, now) in &here {
            let observation = Observation {
                depth_m,
                distance_m,
                light_pct: now.light_pct,
                mean: now.stats.mean,
                std: now.stats.contrast,
                quality: None,
            };
            let situation = Situation::new(&observation, &profile)
                .map_err(|e| DatasetError::Inconsistent(e.to_string()))?;
            rows.extend(here.iter().map(|(distance_m, next)| {
                let candidate = Candidate {
                    distance_m: *distance_m,
                    light_pct: next.light_pct,
                };
                row(environment, &situation, &candidate, &now, next)
            }));
        }
    }
    let words = [
        environment.name(),
        environment.pattern.name().to_owned(),
        environment.water.jerlov.to_string(),
    ];
    Ok((Entries { words, rows }, profile))
}

fn row(
    environment: &Environment,
    situation: &Situation,
    candidate: &Candidate,
    now: &ImageRow,
    next: &ImageRow,
) -> Vec<f32> {
    let inputs = FEATURES.iter().map(|feature| match feature.value {
        FeatureValue::Fixed(of) => of(situation),
        FeatureValue::Varying(of) => of(situation, candidate),
    });
    [environment.water.backscatter_fraction, environment.tilt_deg]
        .into_iter()
        .chain(inputs)
        .chain(next.stats.contrast)
        .chain(next.errors.contrast)
        .chain(now.errors.contrast)
        .map(|value| value as f32)
        .collect()
}

/// The calibration profile of an environment, from its own images and those that look up.
fn profile(
    workshop: &Workshop,
    environment: &Environment,
    images: &[(f64, ImageRow)],
) -> Result<Profile, DatasetError> {
    let config = workshop.config;
    let depth = depth_series(workshop, environment)?;
    let mut contrast = Vec::new();
    for &(distance_m, image) in images
        .iter()
        .filter(|(_, i)| i.depth_m == config.calibration_depth_m)
    {
        if image.light_pct == 0.0 || image.light_pct == config.calibration_light_pct {
            contrast.push(ContrastMeasurement {
                distance_m,
                light_pct: image.light_pct,
                contrast: image.stats.contrast,
            });
        }
    }
    let made_by = concat!("uw dataset ", env!("CARGO_PKG_VERSION"));
    let exposure = match config.exposure {
        ExposureMode::Auto => None,
        ExposureMode::Chosen | ExposureMode::Fixed => Some(workshop.exposure),
    };
    let profile = routine::profile(&depth, &contrast, made_by)?;
    Ok(profile.with_rig(config.vehicle.rig(exposure)))
}

/// Means of the images that look up: one exposure for all, set at the shallowest.
fn depth_series(
    workshop: &Workshop,
    environment: &Environment,
) -> Result<Vec<DepthMeasurement>, DatasetError> {
    let config = workshop.config;
    let mut exposure = None;
    let mut depth = Vec::new();
    for &depth_m in &config.calibration_depths_m {
        let upward = Upward {
            water: environment.water,
            depth_m,
        };
        let path = upward.render().path(workshop.folder);
        let image = workshop
            .watch
            .read_upward(&path)?
            .ok_or_else(|| DatasetError::Inconsistent(format!("{} is missing", path.display())))?;
        let exposure =
            *exposure.get_or_insert(config.vehicle.up_mean / image.mean_radiance().max(1e-30));
        depth.push(DepthMeasurement {
            depth_m,
            mean: image
                .mean(&workshop.response, exposure)
                .0
                .map(|m| m.max(0.0)),
        });
    }
    Ok(depth)
}

/// The header line of the text table.
pub(super) fn header() -> String {
    let numbers = numbers();
    let names = WORDS.iter().chain(&numbers).map(|c| c.name);
    names.collect::<Vec<_>>().join(",") + "\n"
}

/// The lines of the text table, seven significant digits a number.
pub(super) fn lines(entries: &Entries) -> String {
    let leading = entries.words.join(",");
    let mut text = String::new();
    for row in &entries.rows {
        text.push_str(&leading);
        for value in row {
            // A float's shortest text that reads back as the same float; writing to a string cannot fail.
            let _ = write!(text, ",{value}");
        }
        text.push('\n');
    }
    text
}
