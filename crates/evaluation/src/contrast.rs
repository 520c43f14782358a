//! Contrast of the whole image against the mean contrast of its patches, over distance (the published Fig. "Standard
//! deviation comparison"): the standard deviation of the whole image also holds slow gradients of light, which say
//! nothing about what can be seen.

use std::fmt::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_render::image::Frame;
use uw_twin::environment::Target;

use crate::error::EvalError;
use crate::files::write_text;
use crate::operation::config::OperationConfig;
use crate::operation::seed_of;
use crate::operation::site::{Site, ViewKey};
use crate::plot::{self, Panel, Series};
use uw_calib::ImageStats;

/// Both contrasts of one image, mean over the channels, 8-bit counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contrasts {
    /// Distance, m.
    pub distance_m: f64,
    /// Lamp level, percent.
    pub light_pct: f64,
    /// Standard deviation of the whole image.
    pub whole: f64,
    /// Mean of the standard deviations of 10 × 6 patches.
    pub patches: f64,
}

/// Measures both contrasts over distance in every water and writes `contrast.csv`, `contrast.png`, `contrast.svg` and
/// `contrast.md`. Views are shared with an operation in the same folder.
pub fn run(
    config: &OperationConfig,
    folder: &Path,
    assets: &Path,
    threads: Option<usize>,
    cancel: &AtomicBool,
) -> Result<(), EvalError> {
    let pattern = config.pattern().map_err(EvalError::Input)?;
    let target = Target::read(pattern, assets)?;
    let mut waters = Vec::new();
    for water in &config.water {
        let views = folder.join("views").join(&water.name);
        let mut site = Site::new(config, water, &target, &views, threads)?;
        let mut rows = Vec::new();
        for light_pct in [0.0, config.calibration.light_pct] {
            for &distance_m in &config.distances_m {
                let key = ViewKey::new(config.calibration.contrast_depth_m, 0, distance_m);
                let view = site.view(key, cancel)?;
                let seed = seed_of(&[config.seed, light_pct.to_bits(), distance_m.to_bits()]);
                let frame = site.sensor.expose(&view.picture(light_pct), seed);
                let (whole, patches) = contrasts(&frame)?;
                rows.push(Contrasts {
                    distance_m,
                    light_pct,
                    whole,
                    patches,
                });
            }
        }
        waters.push((water.name.clone(), rows));
    }
    write_text(&folder.join("contrast.csv"), &csv(&waters))?;
    plot::write(&folder.join("contrast"), &panels(config, &waters))?;
    write_text(&folder.join("contrast.md"), &markdown(config, &waters))
}

/// Standard deviation of the whole image and mean over its patches, each the mean over the channels.
fn contrasts(frame: &Frame) -> Result<(f64, f64), EvalError> {
    let pixels = frame.in_8_bit_counts();
    let n = pixels.len() as f64;
    let whole = |k: usize| {
        let mean = pixels.iter().map(|p| p[k]).sum::<f64>() / n;
        (pixels.iter().map(|p| (p[k] - mean).powi(2)).sum::<f64>() / n).sqrt()
    };
    let (width, height) = (frame.width as usize, frame.height as usize);
    let stats = ImageStats::from_counts(width, height, &pixels)
        .map_err(|e| EvalError::Input(e.to_string()))?;
    let mean = |values: [f64; 3]| values.iter().sum::<f64>() / 3.0;
    Ok((mean([whole(0), whole(1), whole(2)]), mean(stats.contrast)))
}

fn csv(waters: &[(String, Vec<Contrasts>)]) -> String {
    let mut text = String::from("water,light_pct,distance_m,whole_counts,patches_counts\n");
    for (water, rows) in waters {
        for r in rows {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{water},{},{},{:.4},{:.4}",
                r.light_pct, r.distance_m, r.whole, r.patches
            );
        }
    }
    text
}

fn panels(config: &OperationConfig, waters: &[(String, Vec<Contrasts>)]) -> Vec<Panel> {
    let panel = |(water, rows): &(String, Vec<Contrasts>)| {
        let line = |name: &str, light_pct: f64, of: fn(&Contrasts) -> f64| Series {
            name: format!("{name}, lamps {light_pct} %"),
            points: rows
                .iter()
                .filter(|r| r.light_pct == light_pct)
                .map(|r| (r.distance_m, of(r)))
                .collect(),
        };
        let on = config.calibration.light_pct;
        Panel {
            title: format!("Standard deviation, {water} turbidity"),
            x: "distance, m".into(),
            y: "8-bit counts".into(),
            series: vec![
                line("whole", 0.0, |r| r.whole),
                line("patches", 0.0, |r| r.patches),
                line("whole", on, |r| r.whole),
                line("patches", on, |r| r.patches),
            ],
            logarithmic: [false, false],
        }
    };
    waters.iter().map(panel).collect()
}

fn markdown(config: &OperationConfig, waters: &[(String, Vec<Contrasts>)]) -> String {
    let mut text = format!(
        "# Contrast of the whole image and of patches\n\nTarget `{}` at {} m depth; standard deviation in 8-bit counts, \
         mean over the channels. From the nearest to the farthest view each falls (or rises) to this share:\n\n\
         | water | lamps, % | whole image | patches |\n|---|---|---|---|\n",
        config.target, config.calibration.contrast_depth_m
    );
    for (water, rows) in waters {
        for light_pct in [0.0, config.calibration.light_pct] {
            let of_light: Vec<&Contrasts> =
                rows.iter().filter(|r| r.light_pct == light_pct).collect();
            if let [first, .., last] = of_light.as_slice() {
                // Writing to a string cannot fail.
                let _ = writeln!(
                    text,
                    "| {water} | {light_pct} | {:.2} ({:.1} to {:.1}) | {:.2} ({:.1} to {:.1}) |",
                    last.whole / first.whole,
                    first.whole,
                    last.whole,
                    last.patches / first.patches,
                    first.patches,
                    last.patches,
                );
            }
        }
    }
    text.push_str("\n![contrast over distance](contrast.png)\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_render::image::Counts;

    #[test]
    fn a_slow_gradient_counts_for_the_whole_image_only() {
        let (width, height) = (100_u32, 60_u32);
        let counts = (0..width * height).flat_map(|i| [(i / width * 4) as u8; 3]);
        let frame = Frame {
            width,
            height,
            counts: Counts::Bits8(counts.collect()),
        };
        let (whole, patches) = contrasts(&frame).expect("size");
        // 60 steps of 4 counts: sqrt((60² − 1)/12)·4 over the whole, sqrt((10² − 1)/12)·4 in a patch.
        assert!((whole - 4.0 * (3599.0f64 / 12.0).sqrt()).abs() < 1e-9);
        assert!((patches - 4.0 * (99.0f64 / 12.0).sqrt()).abs() < 1e-9);
    }
}
