//! Finite variance, seen: errors against the references fall as N^-1/2, the estimated error is the true one, and
//! no single sample holds a share of the variance that does not fall with their number.
//!
//! The reference scenes are rendered at 16 × 9 pixels, each of which is a tile of the reference.

use std::path::Path;

use uw_render::{
    film::{Film, FilmLayer},
    prepare::Prepared,
    sampling::Rng,
    scene::Scene,
};
use uw_tests::{
    corpus_scene,
    gpu::{Backend, everywhere},
    plan, reference,
    same_numbers::assert_same_pictures,
    tails::{largest_share, largest_share_of},
    tiles::{TILE, Tiles},
};

const SCENES: [(&str, &str); 4] = [
    ("s1_clear", "s1"),
    ("s1d_clear_disk", "s1d"),
    ("s2_turbid", "s2"),
    ("s3_sun", "s3"),
];
/// Ladder of scenes whose reference is rendered, and its samples: its error, which is taken off, is half of that of the last rung.
const SHORT_LADDER: [u32; 4] = [4, 16, 64, 256];
const REFERENCE_SAMPLES: u32 = 1024;
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
fn squared_error(film: &Film, tiles: &Tiles) -> f64 {
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
        let tiles = reference::tiles(reference_name);
        let rungs = match backend {
            Backend::VectorUnits => LADDER.len(),
            Backend::Double | Backend::Adapter => 4,
        };
        let scene = by_tiles(scene_name);
        let errors = ladder(backend, scene_name, &scene, &tiles, &LADDER[..rungs]);
        let slope = slope(&errors);
        println!("{scene_name}: slope {slope:.3}");
        assert!(
            (slope + 0.5).abs() < slope_within(rungs),
            "{scene_name}: slope {slope}"
        );
    }
}

/// Errors of a scene with more and more samples, of which the estimate is held to the true one.
fn ladder(
    backend: Backend,
    scene_name: &str,
    scene: &Scene,
    tiles: &Tiles,
    samples: &[u32],
) -> Vec<f64> {
    let mut errors = Vec::new();
    for (i, &samples) in samples.iter().enumerate() {
        let (film, stats) = backend.render(scene, &plan(samples, 100 + i as u64));
        let error = squared_error(&film, tiles).max(0.0).sqrt();
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
    errors
}

/// A plate before a lamp and a camera, looked at through half a metre of turbid water: b rises from 0.15 to 4 1/m and falls
/// again. The same with the same mean optical depth everywhere.
#[test]
fn errors_behind_a_thin_layer_fall_too_and_are_no_larger_than_thrice_those_of_even_water() {
    let coefficients = |b: f64| format!("a = [0.1, 0.1, 0.1], b = [{b:?}, {b:?}, {b:?}]");
    let entry =
        |(depth_m, b): (f64, f64)| format!("{{ depth_m = {depth_m:?}, {} }}", coefficients(b));
    let thin = [(5.0, 0.15), (5.25, 4.0), (5.5, 0.15)]
        .map(entry)
        .join(", ");
    // On 1.5 m: 1 m of 0.15, half a metre of 2.075 in the mean.
    let even = coefficients((0.15 + 0.5 * 2.075) / 1.5).replace("], ", "]\n");
    let scenes = [format!("profile = [{thin}]"), even].map(|water| through(&water));
    let tiles = scenes.each_ref().map(|scene| {
        let (film, _) = Backend::VectorUnits.render(scene, &plan(REFERENCE_SAMPLES, 7));
        let error = film.layer(FilmLayer::Variance);
        Tiles {
            mean: film.layer(FilmLayer::Total),
            standard_error: error.iter().map(|v| v.map(f64::sqrt)).collect(),
        }
    });
    everywhere(|backend| {
        let names = ["thin layer", "even water"];
        if !matches!(backend, Backend::VectorUnits) {
            for (name, scene) in names.iter().zip(&scenes) {
                assert_same_pictures(backend, name, &Prepared::build(scene), 0);
            }
            return;
        }
        let [layered, even] = [0, 1].map(|i| {
            let name = names[i];
            let errors = ladder(backend, name, &scenes[i], &tiles[i], &SHORT_LADDER);
            let slope = slope(&errors);
            println!("{name}: slope {slope:.3}");
            assert!((slope + 0.5).abs() < 0.05, "{name}: slope {slope}");
            errors[3].powi(2) * f64::from(SHORT_LADDER[3])
        });
        println!(
            "squared error times samples: {layered:.3} behind the layer, {even:.3} in even water"
        );
        assert!(layered < 3.0 * even, "{layered} {even}");
    });
}

/// A scene that looks down at a plate 1.5 m away, 6 m below the surface of `water`.
fn through(water: &str) -> Scene {
    let text = format!(
        "format = \"uw-scene/1\"\n[water]\n{water}\nphase = {{ model = \"fournier-forand\", n = 1.10, backscatter_fraction = 0.0183 }}\n\
         [surface]\nrefractive = false\n\
         [camera]\nposition_m = [0.0, 0.0, -4.5]\nforward = [0.0, 0.0, -1.0]\nup = [1.0, 0.0, 0.0]\nhfov_deg = 60.0\n\
         width = 64\nheight = 36\n\
         [[lamp]]\nposition_m = [0.0, 0.3, -4.5]\nforward = [0.0, 0.0, -1.0]\nintensity = [10.0, 10.0, 10.0]\n\
         half_angle_deg = 40.0\n\
         [[object]]\nplane = {{ center_m = [0.0, 0.0, -6.0], normal = [0.0, 0.0, 1.0], up = [1.0, 0.0, 0.0], size_m = [8.0, 8.0] }}\n\
         reflectance = [0.5, 0.5, 0.5]\n"
    );
    Scene::parse(&text, Path::new(""), "through.toml").expect("valid")
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
