//! The numbers as tables: one row per view, one row per flight.

use std::fmt::Write;
use std::path::Path;

use crate::error::EvalError;
use crate::files::write_text;
use crate::operation::Operation;
use crate::operation::config::OperationConfig;
use crate::operation::summary::{MethodResult, WaterResult};

/// Writes `steps.csv` (one row per view) and `flights.csv` (one row per water, method and repetition).
pub fn write(config: &OperationConfig, found: &Operation, folder: &Path) -> Result<(), EvalError> {
    write_text(&folder.join("steps.csv"), &steps(config, found))?;
    write_text(&folder.join("flights.csv"), &flights(config, found))
}

/// Ends the row of names with the regrets.
fn end_head(text: &mut String, config: &OperationConfig) {
    for preset in &config.presets {
        text.push_str(&format!(",regret_{preset}"));
    }
    text.push('\n');
}

/// What every method gave in every water.
fn methods(found: &Operation) -> impl Iterator<Item = (&WaterResult, &MethodResult)> {
    let waters = found.waters.iter();
    waters.flat_map(|water| water.methods.iter().map(move |method| (water, method)))
}

fn steps(config: &OperationConfig, found: &Operation) -> String {
    let mut text = String::from(
        "water,method,repetition,view,leg,station,depth_m,along_m,distance_m,light_pct,view_distance_m,contrast,features,matches,inliers,true_inliers,inlier_ratio",
    );
    end_head(&mut text, config);
    for (water, result) in methods(found) {
        for (repetition, flight) in result.flights.iter().enumerate() {
            for (view, s) in flight.iter().enumerate() {
                // Writing to a string cannot fail.
                let _ = write!(
                    text,
                    "{},{},{repetition},{view},{},{},{},{},{:.4},{:.3},{},{:.4},{}",
                    water.water.name,
                    result.method.name(),
                    s.place.leg,
                    s.place.station,
                    s.depth_m,
                    s.along_m,
                    s.chosen.distance_m,
                    s.chosen.light_pct,
                    s.view_distance_m,
                    s.contrast,
                    s.features,
                );
                let _ = match &s.pair {
                    Some(p) => write!(
                        text,
                        ",{},{},{},{:.4}",
                        p.matches,
                        p.inliers,
                        p.true_inliers,
                        p.inlier_ratio()
                    ),
                    None => write!(text, ",,,,"),
                };
                s.regret
                    .iter()
                    .for_each(|r| text.push_str(&format!(",{r:.5}")));
                text.push('\n');
            }
        }
    }
    text
}

fn flights(config: &OperationConfig, found: &Operation) -> String {
    let mut text = String::from(
        "water,method,repetition,features,matches,inliers,inlier_ratio,true_inlier_ratio,coverage_m2,distance_change_m,light_change_pct,path_m,time_s,distance_m,light_pct",
    );
    end_head(&mut text, config);
    for (water, result) in methods(found) {
        for (repetition, m) in result.measures.iter().enumerate() {
            let numbers = [
                m.features,
                m.matches,
                m.inliers,
                m.inlier_ratio,
                m.true_inlier_ratio,
                m.coverage_m2,
                m.distance_change_m,
                m.light_change_pct,
                m.path_m,
                m.time_s,
                m.distance_m,
                m.light_pct,
            ];
            text.push_str(&format!(
                "{},{},{repetition}",
                water.water.name,
                result.method.name()
            ));
            for number in numbers.iter().chain(&m.regret) {
                text.push_str(&format!(",{number:.5}"));
            }
            text.push('\n');
        }
    }
    text
}
