//! What a solution says: the numbers with their errors, which of them the pictures do not tell, and what a user should know.

use nalgebra::DMatrix;

use super::layout::{LN_BACKSCATTER, Layout, PLACE};
use super::least_squares::{Residual, Solution};
use super::problem::{Problem, RARE_PATHS};
use super::{Fit, Fitted, FittedMixture};
use uw_twin::estimate::every_water::GROUPS;

/// Relative error of a coefficient beyond which it counts as not identified: its 90 % interval is wider than a tenth on either side.
const MOST_ERROR: f64 = 0.1 / 1.645;
/// By how much absorption over the pictures' distances may be off from the mean over a channel's wavelengths, as a share: what water absorbs
/// most of is gone first, which is much in red and nothing in blue (`examples/fit_accuracy` by wavelength: up to 8 % too little in red).
const BAND_ERROR: [f64; 3] = [0.05, 0.03, 0.0];
/// Share of what was not known before that is left of a number that counts as not identified.
const MOST_LEFT: f64 = 0.7;

/// What the solution says.
pub(super) fn told(problem: &Problem, found: &Solution, dark: [bool; 3]) -> Fit {
    let layout = &problem.layout;
    let residuals = problem.residuals(&found.parameters);
    let free = residuals.len() - found.parameters.len();
    let misfit = found.sum / free as f64;
    let scale = misfit.max(1.0);
    let of_paths = covariance_of_paths(problem, found, &residuals);
    let indices: Vec<usize> = (0..3)
        .map(|k| layout.ln_a(k))
        .chain((0..3).map(|k| layout.ln_b(k)))
        .chain((0..3).map(Layout::ln_gain))
        .chain([LN_BACKSCATTER])
        .collect();
    let mut covariance = &found.covariance * scale + of_paths;
    for (k, error) in BAND_ERROR.into_iter().enumerate() {
        covariance[(layout.ln_a(k), layout.ln_a(k))] += error * error;
    }
    let fitted = |index: usize| Fitted {
        value: found.parameters[index].exp(),
        relative_error: covariance[(index, index)].sqrt(),
    };
    let correlation = correlations(&covariance, &indices);
    let names = Fit::names();
    let left = |i: usize| fitted(indices[i]).relative_error;
    let not_identified = (0..indices.len()).filter(|&i| match i {
        0..6 => left(i) > MOST_ERROR || dark[i % 3],
        6..9 => left(i) > MOST_LEFT * problem.prior.gain_error || dark[i % 3],
        _ => left(i) > MOST_LEFT * problem.prior.backscatter_error,
    });
    Fit {
        a_per_m: [0, 1, 2].map(|k| fitted(layout.ln_a(k))),
        b_per_m: [0, 1, 2].map(|k| fitted(layout.ln_b(k))),
        backscatter_fraction: fitted(LN_BACKSCATTER),
        jerlov: problem.prior.jerlov.then(|| FittedMixture {
            water: problem.scale.water(found.parameters[PLACE]),
            error: covariance[(PLACE, PLACE)].sqrt(),
        }),
        lamp_gain: [0, 1, 2].map(|k| fitted(Layout::ln_gain(k))),
        correlation,
        not_identified: not_identified.map(|i| names[i].clone()).collect(),
        misfit,
        pictures: problem.fitted_pictures(&found.parameters),
        reflectance: problem.reflectances(&found.parameters),
        warnings: warnings(problem, found, misfit, dark),
        exposure_s: problem.pictures.exposure_s,
        iso: problem.pictures.iso,
        places: problem.pictures.places.clone(),
        up: problem.pictures.up.clone(),
    }
}

/// Covariance that the finite number of paths adds: from how far each independent group of them would be off.
fn covariance_of_paths(
    problem: &Problem,
    found: &Solution,
    residuals: &[Residual],
) -> DMatrix<f64> {
    let n = found.parameters.len();
    let mut sum = DMatrix::zeros(n, n);
    for group in 0..GROUPS {
        let other = problem.residuals_of_group(&found.parameters, group);
        let shift = found.shift(residuals, &other);
        sum += &shift * shift.transpose();
    }
    sum * (RARE_PATHS * RARE_PATHS / (GROUPS * (GROUPS - 1)) as f64)
}

fn correlations(covariance: &DMatrix<f64>, indices: &[usize]) -> Vec<Vec<f64>> {
    let error = |i: usize| covariance[(i, i)].sqrt();
    let of = |i: usize, j: usize| covariance[(i, j)] / (error(i) * error(j));
    let row = |&i: &usize| indices.iter().map(|&j| of(i, j)).collect();
    indices.iter().map(row).collect()
}

fn warnings(problem: &Problem, found: &Solution, misfit: f64, dark: [bool; 3]) -> Vec<String> {
    let mut warnings = Vec::new();
    if !found.settled {
        warnings.push("the search was given up before it settled".to_owned());
    }
    if misfit > 4.0 {
        warnings.push(format!(
            "pictures and fit differ by {:.1} times what noise and model leave; errors are scaled with that: check distances, lamp \
             levels, encoding and the vehicle's file, and whether the target is flat and all pictures have the same spot in the middle",
            misfit.sqrt()
        ));
    }
    if let Some(names) = uw_calib::detail::channel_names(dark) {
        warnings.push(format!(
            "{names}: the lamps' light is not told from noise; the water there is a guess"
        ));
    }
    if problem.pictures.single > 0 {
        warnings.push(format!(
            "{} places have one picture, lamps on, which daylight cannot be taken off from; they are left out",
            problem.pictures.single
        ));
    }
    warnings
}
