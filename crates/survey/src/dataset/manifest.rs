//! What the dataset is made of: every parameter, seed and version, and the meaning of every column.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::plan::{Counts, groups};
use super::{Column, DatasetError, ExposureMode, WORDS, Workshop, numbers};
use uw_twin::estimate::fields::GROUPS;

/// Name of the manifest in the output folder.
pub const MANIFEST: &str = "manifest.json";

/// The manifest's text, with the CRC-32 of the other files that are made from the parts. It holds no time and no place, so
/// that the same dataset has the same bytes everywhere.
pub(super) fn text(
    workshop: &Workshop,
    sums: &BTreeMap<String, String>,
) -> Result<String, DatasetError> {
    let config = workshop.config;
    let counts = Counts::of(config);
    let colours = config.vehicle.colours();
    let colours = colours.map_err(|e| DatasetError::Inconsistent(e.to_string()))?;
    let mut waters = Vec::new();
    for water in config.waters() {
        let iops = config
            .water_bands()
            .iops(water.jerlov, &colours.response)
            .map_err(|e| DatasetError::Inconsistent(e.to_string()))?;
        waters.push(json!({
            "name": water.name(), "type": water.jerlov.to_string(),
            "backscatter_fraction": water.backscatter_fraction,
            "a_per_m": iops.a, "b_per_m": iops.b,
        }));
    }
    let exposure = match config.exposure {
        ExposureMode::Auto => Value::Null,
        ExposureMode::Chosen | ExposureMode::Fixed => json!(workshop.exposure),
    };
    let seeds: serde_json::Map<String, Value> = groups(config)
        .map(|g| {
            let daylight: Vec<u64> = config
                .depths_m
                .iter()
                .map(|&z| g.daylight(z).seed(config.seed))
                .collect();
            let path = g.images_path(std::path::Path::new(""));
            let name = path.with_extension("").display().to_string();
            (
                name,
                json!({"daylight": daylight, "lamps": g.lamps().seed(config.seed)}),
            )
        })
        .collect();
    let manifest = json!({
        "format": "uw-dataset-manifest/1",
        "made_by": concat!("uw ", env!("CARGO_PKG_VERSION")),
        "config": config,
        "entries": counts.entries,
        "images": counts.images,
        "renders": {"daylight": counts.daylight, "lamps": counts.lamps, "upward": counts.upward},
        "groups_of_paths": GROUPS,
        "exposure_m2_sr_per_w": exposure,
        "waters": waters,
        "columns": WORDS.iter().chain(&numbers()).map(describe).collect::<Vec<_>>(),
        "seeds": seeds,
        "crc32": sums,
    });
    Ok(format!("{manifest:#}\n"))
}

fn describe(column: &Column) -> Value {
    json!({"name": column.name, "unit": column.unit, "meaning": column.meaning})
}
