//! Finite variance, seen: errors against the references fall as N^-1/2, the estimated error is the true one, and
//! no single sample holds a share of the variance that does not fall with their number.
//!
//! The reference scenes are rendered at 16 × 9 pixels, each of which is a tile of the reference.

use uw_render::{
    film::{Film, FilmLayer},
    sampling::Rng,
    scene::Scene,
};
use uw_tests::{
    corpus_scene,
    gpu::{Backend, everywhere},
    plan, reference,
    tails::{largest_share, largest_share_of},
    tiles::TILE,
};

const SCENES: [(&str, &str); 4] = [
    ("s1_clear", "s1"),
    ("s1d_clear_disk", "s1d"),
    ("s2_turbid", "s2"),
    ("s3_sun", "s3"),
];
const LADDER: [u32; 5] = [16, 64, 256, 1024, 4096];
/// Root of the number of samples among which one may hold the variance.
const SAMPLES_ROOT: u32 = 256;

/// The scene with one pixel for each tile.
fn by_tiles(name: &str) -> Scene {
    let mut scene = corpus_scene(name);
    let camera = &mut scene.camera;
    camera.width /= TILE as u32;
    camera.height /= TILE as u32;
    camera.focal_px /= TILE as f64;
    camera.centre_px /= TILE as f64;
    scene
}

/// Relative mean squared error of a film against the tiles, without the tiles' own variance.
fn squared_error(film: &Film, name: &str) -> f64 {
    let tiles = reference::tiles(name);
    let total = film.layer(FilmLayer::Total);
    let (mean, _) = tiles.picture_mean();
    let mut sum = 0.0;
    for (i, pixel) in total.iter().enumerate() {
        for k in 0..3 {
            let expected = tiles.mean[i][k];
            let level = expected * expected + 1e-4 * mean[k] * mean[k];
            let own = tiles.standard_error[i][k].powi(2);
            sum += ((pixel[k] - expected).powi(2) - own) / level;
        }
    }
    sum / (3 * total.len()) as f64
}

/// ln of the numbers of samples on the first rungs of the ladder, from their mean.
fn abscissae(rungs: usize) -> Vec<f64> {
    let x = LADDER[..rungs].iter().map(|&n| f64::from(n).ln());
    let centre = x.clone().sum::<f64>() / rungs as f64;
    x.map(|x| x - centre).collect()
}

fn square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// Slope of ln error over ln samples by least squares.
fn slope(errors: &[f64]) -> f64 {
    let x = abscissae(errors.len());
    let above: f64 = x.iter().zip(errors).map(|(x, e)| x * e.ln()).sum();
    above / square(&x)
}

/// How far a slope may be from −1/2: 0.05 on the whole ladder, and on its first rungs as much more as slopes scatter more.
fn slope_within(rungs: usize) -> f64 {
    0.05 * (square(&abscissae(LADDER.len())) / square(&abscissae(rungs))).sqrt()
}

#[test]
fn errors_fall_as_the_root_of_the_samples_and_are_estimated_rightly() {
    everywhere(errors_fall);
}

fn errors_fall(backend: Backend) {
    for (scene_name, reference_name) in SCENES {
        let scene = by_tiles(scene_name);
        let mut errors = Vec::new();
        let rungs = match backend {
            Backend::Adapter(_) => 4,
            _ => LADDER.len(),
        };
        for (i, samples) in LADDER.into_iter().take(rungs).enumerate() {
            let (film, stats) = backend.render(&scene, &plan(samples, 100 + i as u64));
            let error = squared_error(&film, reference_name).max(0.0).sqrt();
            let estimated = stats.relative_error.expect("several batches");
            println!("{scene_name} {samples}: error {error:.5}, estimated {estimated:.5}");
            // From few batches the estimate of a pixel's relative error is itself too noisy to be held to 20 %.
            if samples >= 256 {
                assert!(
                    (estimated / error - 1.0).abs() < 0.2,
                    "{scene_name} at {samples}: error {error}, estimated {estimated}"
                );
            }
            errors.push(error);
        }
        let slope = slope(&errors);
        println!("{scene_name}: slope {slope:.3}");
        assert!(
            (slope + 0.5).abs() < slope_within(rungs),
            "{scene_name}: slope {slope}"
        );
    }
}

#[test]
fn no_single_sample_holds_the_variance() {
    everywhere(no_sample_holds_the_variance);
}

fn no_sample_holds_the_variance(backend: Backend) {
    for (scene_name, _) in SCENES {
        let scene = by_tiles(scene_name);
        let rows = (1..scene.camera.height).step_by(3);
        let columns = || (1..scene.camera.width).step_by(3);
        let pixels = rows.flat_map(|row| columns().map(move |column| (column, row)));
        let pixels = pixels.take(backend.samples(18) as usize);
        let share = largest_share_of(backend, &scene, pixels, SAMPLES_ROOT);
        println!("{scene_name}: largest share of one in 65536 samples {share:.4}");
        assert!(share < 0.1, "{scene_name}: {share}");
    }
}

/// Contributions with the tail of next event estimation to a point lamp (index 1.5) are told apart.
#[test]
fn an_infinite_variance_is_seen() {
    let shares: Vec<f64> = (0..20u32)
        .map(|seed| {
            let mut rng = Rng::new(7, seed, 0, 0);
            let values: Vec<f64> = (0..65_536)
                .map(|_| rng.uniform().powf(-1.0 / 1.5))
                .collect();
            largest_share(&values)
        })
        .collect();
    let seen = shares.iter().filter(|&&s| s >= 0.1).count();
    // A scene has eighteen pixels, any of which gives it away.
    assert!(seen > 10, "{shares:?}");
}
