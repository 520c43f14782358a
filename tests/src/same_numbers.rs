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

use crate::{
    gpu::Backend,
    measure_prepared, plan,
    tiles::{Tiles, spread},
};

/// Part of the vector units' samples that is enough for other backends: by [`APART`] they are then known to be within less than
/// one standard error of all samples.
pub const PART: u32 = 64;
/// Largest difference of two backends, as a share of the standard error of their samples; up to 0.04 was seen.
const APART: f64 = 0.1;
/// Largest relative difference of their standard errors; up to 0.007 was seen.
const ERRORS_APART: f64 = 0.05;

/// The same of pictures of few samples with independent pixels: of the mean (up to 0.028 was seen), of tiles (root mean square, up to
/// 0.029, and largest, up to 0.14), and of the tiles' errors (root mean square, up to 0.002). Behind a flat port with a point lamp in view,
/// around which rounding moves light, 0.15, 0.11, 0.32 and 0.024 were seen.
const PICTURES_APART: f64 = 0.3;
const TILES_APART: f64 = 0.2;
const TILE_APART: f64 = 0.6;
const TILE_ERRORS_APART: f64 = 0.05;

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

/// Pictures with one seed have the same means in each tile and all over, and the same standard errors, but for the walks that
/// rounding sends another way: few samples tell more of a difference than many with seeds of their own would.
///
/// # Panics
/// When they have not.
pub fn assert_same_tiles(what: &str, ours: &Film, theirs: &Film) {
    let (ours, theirs) = (Tiles::of(ours), Tiles::of(theirs));
    let shares = |of: fn(&Tiles, usize, usize) -> f64, k: usize| -> Vec<f64> {
        let tiles = 0..theirs.mean.len();
        let share = |i| (of(&ours, i, k) - of(&theirs, i, k)) / theirs.standard_error[i][k];
        tiles.map(share).collect()
    };
    let ((mean, _), (expected, error)) = (ours.picture_mean(), theirs.picture_mean());
    for k in 0..3 {
        let (rms, largest) = spread(&shares(|tiles, i, k| tiles.mean[i][k], k));
        let (rms_of_errors, _) = spread(&shares(|tiles, i, k| tiles.standard_error[i][k], k));
        let apart = (mean[k] - expected[k]) / error[k];
        println!(
            "  {what}, channel {k}: means {apart:+.4} standard errors apart, tiles {rms:.4} and up to {largest:.3}, errors {rms_of_errors:.4}"
        );
        assert!(
            apart.abs() <= PICTURES_APART
                && rms <= TILES_APART
                && largest <= TILE_APART
                && rms_of_errors <= TILE_ERRORS_APART,
            "{what}, channel {k}: with one seed, means {apart} standard errors apart, tiles {rms} (rms) and up to {largest}, their errors {rms_of_errors}"
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
