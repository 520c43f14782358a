//! Curves along the track: distance and lamp level, inliers and inlier ratio.

use std::path::Path;

use crate::error::EvalError;
use crate::operation::config::OperationConfig;
use crate::operation::flight::Step;
use crate::operation::measure::mean;
use crate::operation::summary::WaterResult;
use crate::plot::{self, Panel, Series};

/// Writes `settings_WATER` and `inliers_WATER`, each as PNG and SVG.
pub fn write(
    config: &OperationConfig,
    water: &WaterResult,
    folder: &Path,
) -> Result<(), EvalError> {
    let name = &water.water.name;
    let depths: Vec<String> = config.depths_m.iter().map(ToString::to_string).collect();
    let title = |what: &str| {
        format!(
            "{what}, {name} turbidity, legs at {} m (means over repetitions)",
            depths.join(", ")
        )
    };
    let panel = |what: &str, y: &str, value: &dyn Fn(&Step) -> Option<f64>| Panel {
        title: title(what),
        x: "time, s".into(),
        y: y.into(),
        series: series(config, water, value),
        logarithmic: [false, false],
    };
    let settings = [
        panel("Distance", "distance, m", &|s| Some(s.chosen.distance_m)),
        panel("Lamp level", "lamp level, %", &|s| Some(s.chosen.light_pct)),
    ];
    plot::write(&folder.join(format!("settings_{name}")), &settings)?;
    let inliers = [
        panel("Inliers", "inliers", &|s| {
            Some(s.pair.as_ref()?.inliers as f64)
        }),
        panel("Inlier ratio", "inliers / features", &|s| {
            Some(s.pair.as_ref()?.inlier_ratio())
        }),
    ];
    plot::write(&folder.join(format!("inliers_{name}")), &inliers)
}

/// One line per method: mean over the repetitions of each view; a gap where there is no value.
fn series(
    config: &OperationConfig,
    water: &WaterResult,
    value: &dyn Fn(&Step) -> Option<f64>,
) -> Vec<Series> {
    let line = |result: &crate::operation::summary::MethodResult| {
        let views = result.flights.first().map_or(0, Vec::len);
        let point = |i: usize| {
            let values: Vec<f64> = result.flights.iter().filter_map(|f| value(&f[i])).collect();
            let y = if values.is_empty() {
                f64::NAN
            } else {
                mean(values.into_iter())
            };
            // The nominal time: views come every step along the track.
            (i as f64 * config.step_m / config.speed_m_per_s, y)
        };
        Series {
            name: result.method.name(),
            points: (0..views).map(point).collect(),
        }
    };
    water.methods.iter().map(line).collect()
}
