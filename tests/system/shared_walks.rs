//! Daylight walks that neighbouring pixels share: the same expectation, errors that are what they say.

use glam::{DVec2, DVec3};
use uw_render::{
    film::{Film, FilmLayer},
    scene::Scene,
};
use uw_tests::{corpus_scene, plan, render, single_ray::point_lamp, tiles::spread};

/// Width and height of the pictures, pixels, and of the tiles they are compared by.
const SIZE: (usize, usize) = (48, 18);
const TILE: (usize, usize) = (12, 3);
/// Renders per picture that differ in their seeds only: their scatter gives the errors, because the noise of neighbouring
/// pixels is not independent.
const REPEATS: u64 = 24;
const SAMPLES: u32 = 8;

/// Water with the sun overhead, seen by a rolled camera whose rows cross the horizon.
fn sunlit() -> Scene {
    let mut scene = corpus_scene("s3_sun");
    let camera = &mut scene.camera;
    camera.position_m.z = 2.0;
    camera.forward = DVec3::new(1.0, 0.2, 0.1).normalize();
    camera.right = camera
        .forward
        .cross(DVec3::new(-0.1, 0.25, 1.0))
        .normalize();
    camera.down = camera.forward.cross(camera.right);
    camera.focal_px *= SIZE.0 as f64 / f64::from(camera.width);
    (camera.width, camera.height) = (SIZE.0 as u32, SIZE.1 as u32);
    camera.centre_px = DVec2::new(SIZE.0 as f64, SIZE.1 as f64) / 2.0;
    scene
}

fn films(scene: &Scene, share_walks: u32, first_seed: u64) -> Vec<Film> {
    let mut plan = plan(SAMPLES, 0);
    plan.share_walks = share_walks;
    let film = |seed| {
        plan.seed = seed;
        let (film, stats) = render(scene, &plan);
        assert_eq!(stats.share_walks, share_walks);
        film
    };
    (first_seed..first_seed + REPEATS).map(film).collect()
}

/// Means of the tiles of one film in all channels.
fn tiles(film: &Film, layer: FilmLayer) -> Vec<f64> {
    let pixels = film.layer(layer);
    let mut tiles = Vec::new();
    for top in (0..SIZE.1).step_by(TILE.1) {
        for left in (0..SIZE.0).step_by(TILE.0) {
            for k in 0..3 {
                let row = |y: usize| (left..left + TILE.0).map(move |x| y * SIZE.0 + x);
                let sum: f64 = (top..top + TILE.1)
                    .flat_map(row)
                    .map(|i| pixels[i][k])
                    .sum();
                tiles.push(sum / (TILE.0 * TILE.1) as f64);
            }
        }
    }
    tiles
}

/// Mean and variance of the mean of each entry over the rows.
fn statistics(rows: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let n = rows.len() as f64;
    let of = |i: usize| {
        let mean = rows.iter().map(|r| r[i]).sum::<f64>() / n;
        let square = rows.iter().map(|r| (r[i] - mean).powi(2)).sum::<f64>();
        (mean, square / (n * (n - 1.0)))
    };
    (0..rows[0].len()).map(of).collect()
}

fn of_films(films: &[Film], layer: FilmLayer) -> Vec<(f64, f64)> {
    let rows: Vec<_> = films.iter().map(|film| tiles(film, layer)).collect();
    statistics(&rows)
}

/// Compares tiles of pictures with and without sharing. Sharing must also pay: `gain` is the least ratio of the mean
/// variances of pixels, where daylight is all there is.
fn compare(name: &str, scene: &Scene, share_walks: u32, gain: Option<f64>) {
    let (apart, together) = (films(scene, 1, 1000), films(scene, share_walks, 5000));
    for layer in [FilmLayer::Total, FilmLayer::Ambient, FilmLayer::Backscatter] {
        let pairs = of_films(&apart, layer)
            .into_iter()
            .zip(of_films(&together, layer));
        let z: Vec<f64> = pairs
            .map(|((a, va), (b, vb))| (b - a) / (va + vb).sqrt())
            .collect();
        let mean = z.iter().sum::<f64>() / z.len() as f64;
        let (rms, largest) = spread(&z);
        println!("{name}, {layer:?}: z mean {mean:+.2}, rms {rms:.2}, largest {largest:.2}");
        // 72 values of a t distribution with about 46 degrees of freedom, of which the channels are not independent.
        assert!(
            mean.abs() < 0.5 && rms < 1.35 && largest < 4.5,
            "{name}, {layer:?}"
        );
    }
    let variance = |films: &[Film]| {
        let all = films
            .iter()
            .flat_map(|film| film.layer(FilmLayer::Variance));
        all.map(|v| v[2]).sum::<f64>()
    };
    let ratio = variance(&apart) / variance(&together);
    println!("{name}: variance of pixels {ratio:.2} times lower");
    assert!(gain.is_none_or(|gain| ratio > gain), "{name}: {ratio}");
}

#[test]
fn sunlight_in_index_matched_water() {
    compare("index-matched", &sunlit(), 8, Some(1.3));
}

/// Little is scattered twice, so that most walks end before they begin.
#[test]
fn sunlight_in_absorbing_water() {
    let mut scene = sunlit();
    let water = scene.water.as_mut().expect("water");
    water.iops.a = [0.6, 0.3, 0.15];
    water.iops.b = [0.1, 0.08, 0.05];
    compare("absorbing", &scene, 8, Some(1.1));
}

#[test]
fn sun_and_sky_under_a_refracting_surface() {
    let mut scene = sunlit();
    scene.surface.as_mut().expect("surface").refractive = true;
    scene.sun.as_mut().expect("sun").travel_direction = DVec3::new(-0.6, 0.5, -0.8).normalize();
    scene.sky_radiance = [0.1, 0.12, 0.15];
    compare("refracting", &scene, 16, Some(1.3));
}

#[test]
fn sky_alone_and_deep_in_absorbing_water() {
    let mut scene = sunlit();
    scene.sun = None;
    scene.sky_radiance = [1.0; 3];
    scene.camera.position_m.z = -25.0;
    compare("deep", &scene, 8, Some(1.2));
}

/// A lamp in view has image points of its own, which the pixels around it share with their daylight.
#[test]
fn beside_a_lamp_in_view() {
    let mut scene = sunlit();
    let ahead = scene.camera.position_m + 3.0 * scene.camera.forward;
    scene.lamps.push(point_lamp(ahead, 0.05));
    compare("lamp in view", &scene, 8, None);
}

/// The variance that a film reports, of its pixels and of its mean, against the scatter of independent films.
#[test]
fn reported_variances_are_those_of_repeated_renders() {
    let films = films(&sunlit(), 16, 100);
    let pixels: Vec<_> = films.iter().map(|f| f.layer(FilmLayer::Total)).collect();
    let rows = |k: usize| -> Vec<Vec<f64>> {
        pixels
            .iter()
            .map(|p| p.iter().map(|p| p[k]).collect())
            .collect()
    };
    for k in 0..3 {
        let scatter: f64 = statistics(&rows(k)).iter().map(|s| s.1).sum();
        let reported: f64 = films
            .iter()
            .flat_map(|film| film.layer(FilmLayer::Variance))
            .map(|v| v[k])
            .sum();
        let ratio = reported / REPEATS as f64 / (scatter * REPEATS as f64);
        println!("channel {k}: variance of pixels reported by that seen {ratio:.3}");
        assert!((0.8..1.25).contains(&ratio), "channel {k}: {ratio}");
        let means: Vec<_> = films.iter().map(|film| vec![film.mean()[k]]).collect();
        let seen = statistics(&means)[0].1 * REPEATS as f64;
        let reported: f64 = films
            .iter()
            .map(|film| film.variance_of_mean()[k])
            .sum::<f64>()
            / REPEATS as f64;
        // 23 degrees of freedom: the ratio is within a factor of 2.2 but once in 1000.
        println!(
            "channel {k}: variance of the mean reported by that seen {:.3}",
            reported / seen
        );
        assert!((0.45..2.2).contains(&(reported / seen)), "channel {k}");
    }
}

#[test]
fn a_plan_with_sharing_leaves_scenes_with_surfaces_as_they_are() {
    let mut scene = corpus_scene("s2_turbid");
    (scene.camera.width, scene.camera.height) = (16, 9);
    let mut shared = plan(4, 3);
    shared.share_walks = 8;
    let (with, stats) = render(&scene, &shared);
    let (without, _) = render(&scene, &plan(4, 3));
    assert_eq!(stats.share_walks, 1);
    assert_eq!(
        with.layer(FilmLayer::Total),
        without.layer(FilmLayer::Total)
    );
}

#[test]
fn shared_walks_are_the_same_on_any_number_of_threads() {
    let mut plan = plan(4, 8);
    plan.share_walks = 16;
    let [one, two] = [1, 2].map(|threads| {
        plan.threads = Some(threads);
        render(&sunlit(), &plan).0.layer(FilmLayer::Total)
    });
    assert_eq!(one, two);
}
