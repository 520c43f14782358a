//! The exposure of the whole set, chosen once from preliminary renders of every environment.

use std::path::Path;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::plan::{Group, Render, groups};
use super::seal::{self, Found};
use super::{DatasetError, ExposureMode, Workshop, group, store};
use uw_twin::estimate::radiance::{Estimates, RadianceImage, Reflection};
use uw_twin::estimate::statistics::Shot;
use uw_twin::estimate::target_model::Effort;

/// Paths per group of a preliminary render.
const PILOT_PATHS: u32 = 64;

/// Name of the file with the exposure in the output folder.
pub(super) const EXPOSURE: &str = "exposure.json";

/// What the file [`EXPOSURE`] holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Chosen {
    /// Linear signal per radiance, m² sr/W.
    exposure: f64,
}

/// The exposure at which a typical environment, at the calibration's depth, the middle distance and the middle
/// lamp level, has the mean signal that the configuration asks for in its brightest channel. Typical is
/// [`middle_mean`].
pub(super) fn choose(workshop: &Workshop, pool: &rayon::ThreadPool) -> Result<f64, DatasetError> {
    let config = workshop.config;
    if config.exposure != ExposureMode::Chosen {
        return Ok(config.vehicle.exposure);
    }
    let path = workshop.folder.join(EXPOSURE);
    if let Some(known) = workshop.watch.accept(&path, read(&path)?) {
        return Ok(known);
    }
    let middle = |values: &[f64]| {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    let (distance_m, light_pct) = (middle(&config.distances_m), middle(&config.light_pct));
    let pilots: Vec<Group> = groups(config)
        .filter(|g| g.distance_m == distance_m)
        .collect();
    let means: Result<Vec<f64>, DatasetError> = pool.install(|| {
        pilots
            .par_iter()
            .with_max_len(1)
            .map(|group| mean_radiance(workshop, group, light_pct))
            .collect()
    });
    let typical = middle_mean(means?);
    let chosen = Chosen {
        // Three digits are plenty and easy to quote.
        exposure: round(config.exposure_grey / typical.max(1e-12)),
    };
    let text =
        seal::to_json(EXPOSURE, &chosen).map_err(|e| DatasetError::Inconsistent(e.to_string()))?;
    uw_render::image::write_bytes(&path, text.as_bytes())?;
    Ok(chosen.exposure)
}

/// The exposure that the file at `path` holds.
pub(super) fn read(path: &Path) -> Result<Found<f64>, DatasetError> {
    let Some(text) = store::read_bytes(path)? else {
        return Ok(Found::Absent);
    };
    let found = seal::from_json::<Chosen>(EXPOSURE, &text);
    Ok(found.and_then("its exposure is not above 0", |chosen| {
        let good = chosen.exposure > 0.0 && chosen.exposure.is_finite();
        good.then_some(chosen.exposure)
    }))
}

/// Mean radiance of the brightest channel of a group's image at the calibration's depth.
fn mean_radiance(workshop: &Workshop, group: &Group, light_pct: f64) -> Result<f64, DatasetError> {
    let depth_m = workshop.config.calibration_depth_m;
    let views = group::views(workshop, group, &[depth_m])?;
    let effort = Effort {
        least: PILOT_PATHS,
        most: PILOT_PATHS,
    };
    let light = group::light(workshop, group, &views, Render::pilot, &effort)?;
    let model = &views[0].model;
    let lattice = model.error_lattice();
    let image = |source, fields| {
        RadianceImage::new(
            &source,
            fields,
            &Reflection::new(&source, lattice),
            Estimates::Whole,
        )
    };
    let (ambient, lamps) = (
        image(model.daylight(), &light.daylight[0]),
        image(model.lamps(), &light.lamps),
    );
    let shot = Shot {
        ambient: &ambient,
        lamps: &lamps,
        light_pct,
        exposure: 1.0,
    };
    Ok(shot.mean_signal())
}

/// Geometric mean of the middle half of `values`, which must not be empty. Unlike the median it does not jump from
/// one side of a gap to the other where one value crosses it.
fn middle_mean(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let cut = values.len() / 4;
    let middle = &values[cut..values.len() - cut];
    let logarithms: f64 = middle.iter().map(|v| v.max(1e-12).ln()).sum();
    (logarithms / middle.len() as f64).exp()
}

/// To three significant digits.
fn round(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_mean_leaves_out_both_quarters() {
        assert!((middle_mean(vec![1e6, 8.0, 2.0, 0.0]) - 4.0).abs() < 1e-12);
        assert!((middle_mean(vec![3.0]) - 3.0).abs() < 1e-12);
    }

    /// Half of the environments are twice as bright as the others: a median would double where one more is.
    #[test]
    fn one_environment_across_a_gap_moves_the_middle_mean_little() {
        let of_40 =
            |bright: usize| middle_mean([vec![1.0; 40 - bright], vec![2.0; bright]].concat());
        let (fewer, more) = (of_40(19), of_40(20));
        assert!((1.0..1.04).contains(&(more / fewer)), "{fewer} {more}");
    }
}
