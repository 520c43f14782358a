//! The report, for people and for programs.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::json;
use uw_calib::Profile;

use super::{DemoError, DemoOptions, Visit, stages::write_text};

/// Writes `report.json` and `report.md` and returns the path of the latter.
pub(super) fn write(
    folder: &Path,
    options: &DemoOptions,
    model: &Path,
    profile: &Profile,
    visits: &[Visit],
    elapsed: Duration,
) -> Result<PathBuf, DemoError> {
    let model_name = model
        .file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let rows: Vec<_> = visits
        .iter()
        .map(|v| {
            json!({
                "depth_m": v.depth_m, "distance_m": v.distance_m, "light_pct": v.light_pct,
                "contrast_before": v.contrast_before,
                "suggested_distance_m": v.suggestion.distance_m, "suggested_light_pct": v.suggestion.light_pct,
                "predicted_contrast": v.suggestion.predicted_contrast, "rendered_contrast": v.contrast_after,
                "score": v.suggestion.score, "score_here": v.suggestion.score_here,
                "evaluations": v.suggestion.evaluations, "elapsed_us": v.suggestion.elapsed_us,
            })
        })
        .collect();
    let document = json!({
        "format": "uw-demo/1", "jerlov": options.water.jerlov.to_string(),
        "backscatter_fraction": options.water.backscatter_fraction, "target": options.pattern.name(),
        "seed": options.seed, "model": model_name, "elapsed_s": elapsed.as_secs_f64(), "visits": rows,
    });
    write_text(&folder.join("report.json"), &format!("{document:#}\n"))?;
    let path = folder.join("report.md");
    write_text(&path, &text(options, &model_name, profile, visits, elapsed))?;
    Ok(path)
}

fn text(
    options: &DemoOptions,
    model: &str,
    profile: &Profile,
    visits: &[Visit],
    elapsed: Duration,
) -> String {
    let mut out = String::new();
    let water = options.water;
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "# Demonstration\n\nJerlov {} water, backscatter fraction {}, target `{}`, model `{model}`, seed {}; {:.0} s.\n",
        water.jerlov,
        water.backscatter_fraction,
        options.pattern.name(),
        options.seed,
        elapsed.as_secs_f64()
    );
    let _ = writeln!(
        out,
        "## Calibration\n\n| depth, m | K_z red | green | blue |\n|---|---|---|---|"
    );
    for sample in profile.depth() {
        let _ = writeln!(out, "| {} | {} |", sample.depth_m, triple(&sample.k_z, 3));
    }
    let _ = writeln!(
        out,
        "\n| distance, m | K_c on, red | green | blue | K_c off, red | green | blue |\n|---|---|---|---|---|---|---|"
    );
    for (on, off) in profile.contrast_on().iter().zip(profile.contrast_off()) {
        let _ = writeln!(
            out,
            "| {} | {} | {} |",
            on.distance_m,
            triple(&on.k_c, 2),
            triple(&off.k_c, 2)
        );
    }
    let _ = writeln!(
        out,
        "\n## Suggestions\n\nContrast in 8-bit counts, red / green / blue.\n"
    );
    for v in visits {
        let s = &v.suggestion;
        let _ = writeln!(
            out,
            "### {} m deep\n\nFrom {} m at {} % to **{:.2} m at {:.0} %** (score {:.3} instead of {:.3}; {} candidates, {} µs).\n",
            v.depth_m,
            v.distance_m,
            v.light_pct,
            s.distance_m,
            s.light_pct,
            s.score,
            s.score_here,
            s.evaluations,
            s.elapsed_us
        );
        let _ = writeln!(
            out,
            "| | red | green | blue |\n|---|---|---|---|\n| before, rendered | {} |",
            triple(&v.contrast_before, 2)
        );
        let _ = writeln!(
            out,
            "| after, predicted | {} |\n| after, rendered | {} |\n",
            triple(&s.predicted_contrast, 2),
            triple(&v.contrast_after, 2)
        );
        let _ = writeln!(
            out,
            "![before](depth_{0}m_before.png) ![after](depth_{0}m_after.png)\n",
            v.depth_m
        );
    }
    let error = mean_error(visits);
    let _ = writeln!(
        out,
        "Mean absolute difference of predicted and rendered contrast: {error:.2} counts.\n\n![contrast](contrast.png)"
    );
    out
}

fn triple(values: &[f64; 3], digits: usize) -> String {
    values.map(|v| format!("{v:.digits$}")).join(" | ")
}

fn mean_error(visits: &[Visit]) -> f64 {
    let sum: f64 = visits
        .iter()
        .flat_map(|v| {
            (0..3).map(move |k| (v.suggestion.predicted_contrast[k] - v.contrast_after[k]).abs())
        })
        .sum();
    sum / (3.0 * visits.len() as f64)
}
