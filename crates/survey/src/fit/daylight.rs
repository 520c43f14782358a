//! How bright daylight is beside what the vehicle's file and the fitted target say.

use uw_calib::picture::Counts;
use uw_calib::stats::{PATCH_COLUMNS, PATCH_ROWS};
use uw_guidance::physics::WaterTables;
use uw_guidance::physics::water::SourceTables;

use super::water::{SOME_DEPTH_M, WaterError};
use super::{Fit, Options};
use uw_calib::vehicle::Vehicle;

/// Daylight's level over that of the vehicle's file.
pub(super) struct Daylight {
    /// Per channel what all pictures have on average.
    pub(super) gain: [f64; 3],
    /// Per channel the relative deviation of a picture from that: what is off is the model's, or the target's, so that more pictures do not
    /// lessen it.
    pub(super) relative_error: [f64; 3],
}

/// From the pictures with the lamps off; `None` where there are none. Each tells by the part of the target that the nearest one shows, which the
/// fit's reflectance is of: the rest may be brighter or darker.
pub(super) fn daylight(
    fit: &Fit,
    vehicle: &Vehicle,
    options: &Options,
    tables: &WaterTables,
) -> Result<Option<Daylight>, WaterError> {
    let treatment = options.treatment(vehicle);
    let mut ratios: [Vec<f64>; 3] = Default::default();
    let nearest_m = fit.places.first().map_or(0.0, |place| place[0].distance_m);
    let dark = fit.places.iter().map(|place| &place[0]);
    for row in dark.filter(|row| row.light_pct <= 0.0) {
        let depth_m = row.depth_m.unwrap_or(SOME_DEPTH_M);
        let place = |list: &[f64], at: f64| {
            let near = |i: &usize| (list[*i] - at).abs();
            (0..list.len()).min_by(|i, j| near(i).total_cmp(&near(j)))
        };
        let distances: Vec<f64> = tables.views.iter().map(|view| view.distance_m).collect();
        let Some((view, depth)) =
            place(&distances, row.distance_m).zip(place(&tables.depths_m, depth_m))
        else {
            continue;
        };
        let source = &tables.views[view].daylight[depth];
        let picture = treatment.open(&row.view())?.counts();
        let share = shown_from(nearest_m, row.distance_m);
        let Some(seen) = mean_light(&picture, share, options) else {
            continue;
        };
        for k in 0..3 {
            let made = vehicle.exposure * mean_radiance(source, k, share, fit.reflectance[k]);
            ratios[k].push(seen[k] / made);
        }
    }
    let n = ratios[0].len() as f64;
    if ratios[0].is_empty() {
        return Ok(None);
    }
    let gain = [0, 1, 2].map(|k| ratios[k].iter().sum::<f64>() / n);
    let relative_error = [0, 1, 2].map(|k| {
        let square = |ratio: &f64| (ratio / gain[k] - 1.0).powi(2);
        (ratios[k].iter().map(square).sum::<f64>() / n).sqrt()
    });
    Ok(Some(Daylight {
        gain,
        relative_error,
    }))
}

/// Share of the width and height of a picture that shows what one from nearer shows.
fn shown_from(nearest_m: f64, distance_m: f64) -> f64 {
    nearest_m / distance_m
}

/// Mean light of the middle of a picture, `share` as wide and high, where it is known; `None` where nothing of it is.
fn mean_light(picture: &Counts, share: f64, options: &Options) -> Option<[f64; 3]> {
    let middle = |size: usize| {
        let left = (0.5 * (1.0 - share) * size as f64).round() as usize;
        left.min(size / 2)..(size - left).max(size / 2 + 1)
    };
    let (mut sum, mut n) = ([0.0; 3], 0.0);
    for y in middle(picture.height) {
        for x in middle(picture.width) {
            let pixel = &picture.pixels[y * picture.width + x];
            if pixel.iter().any(|counts| counts.is_nan()) {
                continue;
            }
            for k in 0..3 {
                sum[k] += options.encoding.light(pixel[k]);
            }
            n += 1.0;
        }
    }
    (n > 0.0).then(|| sum.map(|s| s / n))
}

/// Mean radiance over that part of a view of an even target.
fn mean_radiance(source: &SourceTables, k: usize, share: f64, reflectance: f64) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for row in 0..PATCH_ROWS {
        for column in 0..PATCH_COLUMNS {
            let i = row * PATCH_COLUMNS + column;
            let weight = inside(column, PATCH_COLUMNS, share) * inside(row, PATCH_ROWS, share);
            let comes = source.straight[k][i] + source.scattered[k][i];
            sum += weight * (source.veil[k][i] + reflectance * source.light[k][i] * comes);
            weights += weight;
        }
    }
    sum / weights
}

/// Share of the `i`-th of `n` equal parts that lies in the middle, `share` of the whole.
fn inside(i: usize, n: usize, share: f64) -> f64 {
    let part = |edge: usize| edge as f64 / n as f64;
    let (low, high) = (0.5 * (1.0 - share), 0.5 * (1.0 + share));
    (part(i + 1).min(high) - part(i).max(low)).max(0.0) * n as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_nearest_picture_does_not_show_has_no_say() {
        let (width, height) = (20, 12);
        let is_middle = |i: usize| (5..15).contains(&(i % width)) && (3..9).contains(&(i / width));
        let pixel = |i: usize| if is_middle(i) { [200.0; 3] } else { [10.0; 3] };
        let picture = Counts::stored(width, height, (0..width * height).map(pixel).collect());
        let options = Options::default();
        let found = mean_light(&picture, shown_from(1.0, 2.0), &options);
        let expected = options.encoding.light(200.0);
        for found in found.expect("known") {
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn the_middle_of_a_grid_has_its_share() {
        let all = |n: usize, share: f64| (0..n).map(|i| inside(i, n, share)).sum::<f64>();
        for share in [0.1, 1.0 / 3.0, 0.8, 1.0] {
            for n in [PATCH_COLUMNS, PATCH_ROWS] {
                let expected = share * n as f64;
                let found = all(n, share);
                assert!((found - expected).abs() < 1e-12, "{n}: {found}, {expected}");
            }
        }
        assert!(inside(0, 10, 0.8) < 1e-12 && inside(0, 10, 0.7) == 0.0);
        assert!((inside(1, 10, 0.7) - 0.5).abs() < 1e-12);
    }
}
