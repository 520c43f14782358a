//! Other backends beside the vector units with the same random numbers: they make the same walks, but for the few that
//! rounding sends another way. So both have the same noise, and few samples tell more of an error of one of them than very
//! many of its own would beside a reference.

#![allow(
    clippy::print_stdout,
    reason = "tests print the deviations they measured"
)]

use uw_render::{
    film::{Film, FilmLayer},
    irradiance::{DepthIrradiance, IrradiancePlan},
    prepare::Prepared,
};

use crate::{gpu::Backend, measure_prepared, plan};

/// Part of the vector units' samples that is enough for other backends: by [`APART`] they are then known to be within less than
/// one standard error of all samples.
pub const PART: u32 = 64;
/// Largest difference of two backends, as a share of the standard error of their samples; up to 0.04 was seen.
const APART: f64 = 0.1;
/// Largest relative difference of their standard errors; up to 0.007 was seen.
const ERRORS_APART: f64 = 0.05;

/// Samples per pixel of pictures that are compared pixel by pixel.
pub const PICTURE_SAMPLES: u32 = 2;
/// How far a pixel of a picture may be from that of another backend, relative to it and to the picture's mean: single precision
/// leaves 1e-6 of the light of most samples and 1e-4 of that of long walks.
const RELATIVE: f64 = 1e-3;
const OF_MEAN: f64 = 1e-5;
/// Largest share of the pixels of a layer that may be further apart: where a random number lies within the rounding of a
/// decision, the two walks go different ways. Up to 0.1 % were seen.
const DIFFERENT_SHARE: f64 = 0.004;

/// Means of three channels and their standard errors.
pub type Means = ([f64; 3], [f64; 3]);

/// Pixels that all see the same are to `backend` what they are to the vector units: with `samples` each, at most so many events
/// and one seed.
///
/// # Panics
/// When they are not.
pub fn assert_same_radiances(
    backend: Backend,
    what: &str,
    scene: &Prepared,
    (samples, max_bounces, seed): (u32, u32, u64),
) {
    let measured = |backend| measure_prepared(backend, scene, samples, max_bounces, seed);
    assert_same(what, measured(backend), measured(Backend::VectorUnits));
}

/// The same of irradiances.
///
/// # Panics
/// When they are others, or cannot be measured.
pub fn assert_same_irradiances(
    backend: Backend,
    what: &str,
    scene: &Prepared,
    plan: &IrradiancePlan,
) {
    let measured = |backend: Backend| -> Vec<DepthIrradiance> {
        let measured = backend.irradiances_prepared(scene, plan);
        measured.unwrap_or_else(|e| panic!("{what}: {e}"))
    };
    let (ours, theirs) = (measured(backend), measured(Backend::VectorUnits));
    assert_eq!(ours.len(), plan.depths_m.len());
    for (row, theirs) in ours.iter().zip(&theirs) {
        for ((name, ours), (_, theirs)) in row.quantities().iter().zip(theirs.quantities()) {
            assert_same(
                &format!("{what}, {name} at {} m", row.depth_m),
                (ours.value, ours.standard_error),
                (theirs.value, theirs.standard_error),
            );
        }
    }
}

/// A picture of `scene` by `backend` has the pixels of that by the vector units.
///
/// # Panics
/// When it has not.
pub fn assert_same_pictures(backend: Backend, what: &str, scene: &Prepared, max_bounces: u32) {
    let mut plan = plan(PICTURE_SAMPLES, 11);
    plan.max_bounces = max_bounces;
    let rendered = |backend: Backend| backend.render_prepared(scene, &plan).0;
    assert_same_pixels(what, &rendered(backend), &rendered(Backend::VectorUnits));
}

/// Pictures of [`PICTURE_SAMPLES`] with one seed: both sides draw the same numbers for the same decisions, so that every
/// sample, and with it every pixel of every layer, is the same but for rounding.
///
/// # Panics
/// When they are not.
pub fn assert_same_pixels(what: &str, ours: &Film, theirs: &Film) {
    let lamps = (0..theirs.lamps()).map(FilmLayer::Lamp);
    let layers = [
        FilmLayer::Total,
        FilmLayer::Ambient,
        FilmLayer::Direct,
        FilmLayer::Backscatter,
    ];
    for layer in layers.into_iter().chain(lamps) {
        let (ours, theirs) = (ours.layer(layer), theirs.layer(layer));
        let values = theirs.iter().flatten();
        let mean = values.sum::<f64>() / (3 * theirs.len()) as f64;
        let apart = |(a, b): (&[f64; 3], &[f64; 3])| {
            let within = |b: f64| RELATIVE * b.abs() + OF_MEAN * mean;
            (0..3).any(|k| (a[k] - b[k]).abs() > within(b[k]))
        };
        let different = ours.iter().zip(&theirs).filter(|&pair| apart(pair)).count();
        let share = different as f64 / ours.len() as f64;
        println!(
            "  one seed, {layer:?}: {:.3} % of the pixels differ",
            100.0 * share
        );
        assert!(
            share <= DIFFERENT_SHARE,
            "{what}, {layer:?}: {share} of the pixels differ with one seed"
        );
    }
}

/// The means lie within [`APART`] of their standard errors, which are alike.
///
/// # Panics
/// When they do not.
pub fn assert_same(what: &str, (ours, our_errors): Means, (theirs, errors): Means) {
    for k in 0..3 {
        let (ours, our_error, theirs, error) = (ours[k], our_errors[k], theirs[k], errors[k]);
        let apart = ours - theirs;
        println!("{what}, channel {k}: {theirs:.6e} ± {error:.1e}, apart by {apart:+.1e}");
        let rounding = Backend::VectorUnits.rounding() * theirs;
        assert!(
            apart.abs() <= APART * error + rounding
                && (our_error - error).abs() <= ERRORS_APART * error + rounding,
            "{what}, channel {k}: {ours} ± {our_error} with the same numbers as {theirs} ± {error}"
        );
    }
}
