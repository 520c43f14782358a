//! The report, for people and for programs.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::json;
use uw_calib::Profile;

use super::{DemoError, DemoOptions, Visit, stages::write_text, why};

/// Writes `report.json` and `report.md` and returns the path of the latter.
pub(super) fn write(
    folder: &Path,
    options: &DemoOptions,
    model: &str,
    profile: &Profile,
    visits: &[Visit],
    elapsed: Duration,
) -> Result<PathBuf, DemoError> {
    let rows: Vec<_> = visits
        .iter()
        .map(|v| {
            json!({
                "depth_m": v.depth_m, "distance_m": v.distance_m, "light_pct": v.light_pct,
                "contrast_before": v.contrast_before,
                "suggested_distance_m": v.suggestion.distance_m, "suggested_light_pct": v.suggestion.light_pct,
                "predicted_contrast": v.suggestion.predicted_contrast, "rendered_contrast": v.contrast_after,
                "score": v.suggestion.score, "score_here": v.suggestion.score_here,
                "pilot": why::orders(v), "choices": choices(profile, v),
                "evaluations": v.suggestion.evaluations, "elapsed_us": v.suggestion.elapsed_us,
            })
        })
        .collect();
    let document = json!({
        "format": "uw-demo/1", "jerlov": options.water.jerlov.to_string(),
        "backscatter_fraction": options.water.backscatter_fraction, "target": options.pattern.name(),
        "vehicle": &options.vehicle,
        "seed": options.seed, "model": model, "elapsed_s": elapsed.as_secs_f64(), "visits": rows,
    });
    write_text(&folder.join("report.json"), &format!("{document:#}\n"))?;
    let path = folder.join("report.md");
    write_text(&path, &text(options, model, profile, visits, elapsed))?;
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
        "# Demonstration\n\nJerlov {} water, backscatter fraction {}, target `{}`, predicted by `{model}`, seed {}; {:.0} s.\n",
        water.jerlov,
        water.backscatter_fraction,
        options.pattern.name(),
        options.seed,
        elapsed.as_secs_f64()
    );
    out.push_str(TERMS);
    out.push_str(CALIBRATION);
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
        "\n## Suggestions\n\nAt each depth a picture was taken, the daemon asked, its suggestion followed, and a second picture \
         taken. Contrast in 8-bit counts.\n"
    );
    for v in visits {
        visit_text(&mut out, profile, v);
    }
    let error = mean_error(visits);
    let _ = writeln!(
        out,
        "## How good the predictions were\n\nPredicted and rendered contrast differ by {error:.2} counts on average.\n\n![contrast](contrast.png)"
    );
    out
}

/// What was seen, suggested and gained at one depth.
fn visit_text(out: &mut String, profile: &Profile, v: &Visit) {
    let s = &v.suggestion;
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "### {0} m deep\n\n![{0} m deep, before and after](depth_{0}m.png)\n\n**A pilot would {1}**: from {2} m with the lamps at \
         {3} % to {4:.2} m with the lamps at {5:.0} %. The score is {6:.3} there and {7:.3} here ({8} candidates in {9} µs).\n",
        v.depth_m,
        why::orders(v),
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
        "| contrast | red | green | blue |\n|---|---|---|---|\n| before | {} |\n| after, predicted | {} |\n| after, rendered | {} |\n",
        triple(&v.contrast_before, 2),
        triple(&s.predicted_contrast, 2),
        triple(&v.contrast_after, 2)
    );
    let Some(weighing) = why::weigh(profile, v) else {
        return;
    };
    let _ = writeln!(
        out,
        "**Why.** {}\n\n| choice, as predicted | contrast, average | contrast term | distance term | score |\n|---|---|---|---|---|",
        why::reasons(v, &weighing)
    );
    let names = [
        "stay",
        "lamps off there",
        "full lamps there",
        "the suggestion",
    ];
    for ((choice, terms), name) in v.choices.iter().zip(&weighing.terms).zip(names) {
        let _ = writeln!(
            out,
            "| {name}: {:.2} m, {:.0} % | {:.2} | {:.3} | {:.3} | {:.3} |",
            choice.distance_m,
            choice.light_pct,
            why::mean(choice.contrast),
            terms.contrast,
            terms.distance,
            choice.score
        );
    }
    let _ = writeln!(out);
}

/// The choices of a visit with the terms of their scores.
fn choices(profile: &Profile, v: &Visit) -> Vec<serde_json::Value> {
    let terms = why::weigh(profile, v).map_or_else(Vec::new, |w| w.terms);
    let choice = |(c, t): (&super::Choice, why::Terms)| {
        json!({
            "distance_m": c.distance_m, "light_pct": c.light_pct, "predicted_contrast": c.contrast,
            "score": c.score, "contrast_term": t.contrast, "distance_term": t.distance,
        })
    };
    v.choices.iter().zip(terms).map(choice).collect()
}

const TERMS: &str = "\
## What the words mean

* **Contrast** of a picture: how much its counts (0 to 255) vary inside small patches, their standard deviation, averaged over a grid \
of 10 × 6 patches, for red, green and blue. It is what a person or a program can recognise the target by. Below about 1 count \
little is seen; noise and rounding alone make some tenths. It depends on what is in view, too: a patch of growth that leaves the \
picture takes its contrast with it.
* **K_c** is the contrast of this target from each distance, with the lamps on (67 %) and off: how the water takes contrast away.
* **K_z** is the brightness of a picture that looks up, as the camera stores it, against that at the shallowest depth: how daylight \
falls. It may rise above 1 at first, where the sun's dazzling disk gives way to a bright sky of scattered light.
* **Score**: what the daemon maximises. The *contrast term* (0.65 × predicted contrast / 15) wants detail. The *distance term* (0 \
to 1) wants the distance from which much is seen at once and still seen well: the better the water shows the target in daylight \
(K_c off), the further away that is, and deeper down it is nearer. The better of two scores is the better compromise, not the higher \
contrast.

Contrasts here are expectations: the sensor's noise is in them, the noise of the renderer's paths is not. `uw stats` measures one \
written picture, which has both, so the third digit differs.

";

const CALIBRATION: &str = "\
## Calibration

Six pictures that look up and twelve of the target (in `calibration/`) make `profile.json`, all that the daemon knows of this \
water.

| depth, m | K_z red | green | blue |
|---|---|---|---|
";

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
