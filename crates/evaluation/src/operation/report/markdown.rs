//! The report's text.

use crate::operation::Operation;
use crate::operation::config::OperationConfig;
use crate::operation::measure::{FlightMeasure, mean_and_error};
use crate::operation::method::Method;
use crate::operation::summary::{MethodResult, WaterResult};

use super::published::{PUBLISHED, Published};

/// The whole report.
pub fn text(config: &OperationConfig, found: &Operation) -> String {
    let mut out = String::from("# Does the guidance pay?\n\n");
    out.push_str(&setting(config, found));
    out.push_str("\n## Features and inliers (the published Table II)\n\n");
    out.push_str(
        "Mean ± standard error over the repetitions. Inlier ratio: inliers over features of the earlier of two \
         consecutive views, mean over pairs; *true* counts only inliers that agree with the known motion within 3 \
         pixels. Published: full-size pictures of another renderer, so that ratios compare and counts do not.\n\n",
    );
    for water in &found.waters {
        out.push_str(&inlier_table(water));
    }
    out.push_str(
        "Difference of the inlier ratio to the best method that is neither guidance nor oracle, over the same \
         repetitions:\n\n",
    );
    for water in &found.waters {
        out.push_str(&margins(water));
    }
    out.push_str("\n## Coverage (the published Table III), way and steadiness\n\n");
    out.push_str(&format!(
        "Area in m² of the target that usable views show (at least {} true inliers with a neighbour), counted once. \
         Changes are means between consecutive views of a leg.\n\n",
        config.covered_inliers
    ));
    for water in &found.waters {
        out.push_str(&coverage_table(water));
    }
    out.push_str("\n## Regret\n\n");
    out.push_str(
        "(best true score − true score of the choice) / best true score, mean over views, in percent, in the objective \
         of each preset. The true score takes the contrast of the rendered image at the chosen distance (interpolated \
         between rendered distances) and lamp level.\n\n",
    );
    for water in &found.waters {
        out.push_str(&regret_table(config, water));
    }
    out.push_str("\n## Pictures\n\n");
    for water in &found.waters {
        let name = &water.water.name;
        out.push_str(&format!(
            "![distance and lamp level, {name}](settings_{name}.png)\n\n\
             ![inliers, {name}](inliers_{name}.png)\n\n![contact sheet, {name}](contact_{name}.jpg)\n\n"
        ));
    }
    out
}

fn setting(config: &OperationConfig, found: &Operation) -> String {
    let waters = config.water.iter().map(|w| {
        format!(
            "{} turbidity: Jerlov {}, backscatter fraction {}",
            w.name, w.jerlov, w.backscatter_fraction
        )
    });
    let cost = &found.cost;
    format!(
        "Target `{}`; {}. Legs at {:?} m depth, {} views per leg every {} m, views rendered at distances {:?} m; {} \
         repetitions (other stretch, direction and sensor noise each). Model: {}.\n\n\
         Processor time: {} views of {} × {} pixels and on average {:.1} samples per pixel took {:.0} s; this run took \
         {:.0} s with what it rendered itself.\n",
        config.target,
        waters.collect::<Vec<_>>().join("; "),
        config.depths_m,
        config.views_per_leg,
        config.step_m,
        config.distances_m,
        config.repetitions,
        config
            .model
            .as_ref()
            .and_then(|m| m.file_name())
            .map_or("the shipped one".into(), |m| m
                .to_string_lossy()
                .into_owned()),
        cost.views,
        config.vehicle.width,
        config.vehicle.height,
        cost.mean_samples,
        cost.render_cpu_s,
        cost.run_cpu_s,
    )
}

/// "mean ± standard error" with `digits` decimals.
fn cell(result: &MethodResult, digits: usize, value: impl Fn(&FlightMeasure) -> f64) -> String {
    let (mean, error) = result.over_repetitions(value);
    format!("{mean:.digits$} ± {error:.digits$}")
}

fn heading(water: &WaterResult) -> String {
    format!("**{} turbidity**\n\n", water.water.name)
}

/// The published row that a method corresponds to.
fn published(result: &MethodResult) -> Option<&'static Published> {
    let name = result.method.name();
    let known = |p: &&Published| match p.name {
        "Proposed" => name.starts_with("proposed"),
        "1m pattern" => name == "1 m pattern",
        "2m pattern" => name == "2 m pattern",
        other => name.eq_ignore_ascii_case(other),
    };
    PUBLISHED.iter().find(known)
}

fn published_cell(
    result: &MethodResult,
    water: &WaterResult,
    value: impl Fn(&Published, usize) -> String,
) -> String {
    // The published waters are known by the same names.
    let column = ["low", "high"].iter().position(|n| *n == water.water.name);
    match (published(result), column) {
        (Some(row), Some(column)) => value(row, column),
        _ => String::new(),
    }
}

fn inlier_table(water: &WaterResult) -> String {
    let mut out = heading(water);
    out.push_str(
        "| method | features | inliers | ratio | true ratio | published: features | inliers | ratio |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for result in &water.methods {
        out.push_str(&format!(
            "| {} | {} | {} | {} | {} | {} | {} | {} |\n",
            result.method.name(),
            cell(result, 0, |m| m.features),
            cell(result, 1, |m| m.inliers),
            cell(result, 3, |m| m.inlier_ratio),
            cell(result, 3, |m| m.true_inlier_ratio),
            published_cell(result, water, |p, i| format!("{}", p.features[i])),
            published_cell(result, water, |p, i| format!("{}", p.inliers[i])),
            published_cell(result, water, |p, i| format!("{:.2}", p.ratio[i])),
        ));
    }
    out.push('\n');
    out
}

/// How far each preset of the guidance is ahead of the best other method, with the standard error of the difference.
fn margins(water: &WaterResult) -> String {
    let ratio = |result: &MethodResult| result.over_repetitions(|m| m.inlier_ratio).0;
    let others = water
        .methods
        .iter()
        .filter(|r| !(r.method.is_guidance() || matches!(r.method, Method::Oracle(..))));
    let Some(best) = others.max_by(|a, b| ratio(a).total_cmp(&ratio(b))) else {
        return String::new();
    };
    let mut out = String::new();
    let guided = water.methods.iter();
    for result in guided.filter(|r| r.method.is_guidance()) {
        let pairs = result.measures.iter().zip(&best.measures);
        let differences: Vec<f64> = pairs
            .map(|(a, b)| a.inlier_ratio - b.inlier_ratio)
            .collect();
        let (mean, error) = mean_and_error(&differences);
        out.push_str(&format!(
            "* {} turbidity, {} against {}: {mean:+.3} ± {error:.3} ({:+.1} standard errors)\n",
            water.water.name,
            result.method.name(),
            best.method.name(),
            mean / error
        ));
    }
    out
}

fn coverage_table(water: &WaterResult) -> String {
    let mut out = heading(water);
    out.push_str(
        "| method | coverage, m² | published, m² | distance, m | change, m | lamp, % | change, % | path, m | time, s |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for result in &water.methods {
        out.push_str(&format!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
            result.method.name(),
            cell(result, 1, |m| m.coverage_m2),
            published_cell(result, water, |p, i| format!("{:.1}", p.coverage_m2[i])),
            cell(result, 2, |m| m.distance_m),
            cell(result, 3, |m| m.distance_change_m),
            cell(result, 1, |m| m.light_pct),
            cell(result, 2, |m| m.light_change_pct),
            cell(result, 1, |m| m.path_m),
            cell(result, 0, |m| m.time_s),
        ));
    }
    out.push('\n');
    out
}

fn regret_table(config: &OperationConfig, water: &WaterResult) -> String {
    let mut out = heading(water);
    let presets = config.presets.join(" | ");
    out.push_str(&format!("| method | {presets} |\n|---|"));
    config.presets.iter().for_each(|_| out.push_str("---|"));
    out.push('\n');
    for result in &water.methods {
        let cells: Vec<String> = (0..config.presets.len())
            .map(|k| cell(result, 1, |m| 100.0 * m.regret[k]))
            .collect();
        out.push_str(&format!(
            "| {} | {} |\n",
            result.method.name(),
            cells.join(" | ")
        ));
    }
    out.push('\n');
    out
}
