//! Whether the pictures of a calibration suit a fit.

use std::path::Path;

use super::blocks::{Block, Sensor};
use super::pictures::{Row, SAME_M, Shown};
use super::{DEPTHS_M, FitError, Options};

/// Fewest distances of pictures with more and with less of the lamps.
pub const FEWEST_DISTANCES: usize = 3;
/// Least ratio of the largest to the smallest distance.
pub const LEAST_RATIO: f64 = 1.8;
/// Share of the lamps' light that a picture in the dark may show with the lamps off.
const LIT_SHARE: f64 = 0.01;

/// Whether there are places enough whose lamps can be told from daylight, and none deeper than daylight is made for.
pub(super) fn check(path: &Path, places: &[Vec<Row>], options: &Options) -> Result<(), FitError> {
    if !options.dark {
        check_depths(path, places)?;
    }
    let told = |place: &&Vec<Row>| {
        let lit = place.last().is_some_and(|row| row.light_pct > 0.0);
        lit && (place.len() > 1 || options.dark)
    };
    let mut distances_m: Vec<f64> = places
        .iter()
        .filter(told)
        .map(|place| place[0].distance_m)
        .collect();
    distances_m.dedup_by(|a, b| (*a - *b).abs() < SAME_M);
    let ends = distances_m.first().zip(distances_m.last());
    let wide = ends.is_some_and(|(near, far)| far / near >= LEAST_RATIO);
    match distances_m.len() >= FEWEST_DISTANCES && wide {
        true => Ok(()),
        false => Err(FitError::TooFew {
            manifest: path.display().to_string(),
            distances_m,
        }),
    }
}

fn check_depths(path: &Path, places: &[Vec<Row>]) -> Result<(), FitError> {
    let too_deep = places.iter().flatten().find_map(|row| {
        let depth_m = row.depth_m.filter(|z| z > DEPTHS_M.end())?;
        Some((row.listed.line, depth_m))
    });
    match too_deep {
        Some((line, depth_m)) => Err(FitError::TooDeep {
            manifest: path.display().to_string(),
            line,
            depth_m,
        }),
        None => Ok(()),
    }
}

/// Whether all channels show the same everywhere.
pub(super) fn are_grey(shown: &[Shown]) -> bool {
    shown.iter().flat_map(|shown| &shown.blocks).all(|block| {
        let [r, g, b] = block.signal.map(f64::to_bits);
        r == g && g == b
    })
}

/// A warning where a picture with the lamps off shows light, although there is said to be none: more than a black picture's noise, of which only what is
/// above black is stored, and than a hundredth of the light that the lamps add.
pub(super) fn lit_in_the_dark(
    (row, sensor): (&Row, &Sensor),
    off: &[Block],
    lamps: Option<&Shown>,
) -> Option<String> {
    let mean = |blocks: &[Block], k: usize| {
        let known = blocks.iter().filter(|block| block.variance[k].is_finite());
        let (sum, n) = known.fold((0.0, 0.0), |(sum, n), block| {
            (sum + block.signal[k], n + 1.0)
        });
        if n > 0.0 { sum / n } else { 0.0 }
    };
    let black = sensor.noise.b.sqrt().max(sensor.encoding.light(1.0));
    let shows = |k: usize| {
        let of_lamps = lamps.map_or(0.0, |lamps| mean(&lamps.blocks, k));
        mean(off, k) > black.max(LIT_SHARE * of_lamps)
    };
    (0..3).any(shows).then(|| {
        format!(
            "{}: shows light with the lamps off: if it is daylight leave --dark out, or the water file knows of none",
            row.listed.image.display()
        )
    })
}
