use std::sync::atomic::AtomicBool;

use super::*;
use crate::backend::Device;
use crate::integrator::{Plan, render_lanes};
use crate::scene::Scene;

/// A textured wall and a post before it, in turbid water; the wall's texture is made of `wall` and the post has `post`.
fn scene(post: &str) -> Prepared {
    before_wall("[0.02, 0.02, 0.02]", post)
}

fn before_wall(wall: &str, post: &str) -> Prepared {
    let text = format!(
        r#"
        format = "uw-scene/1"
        water = {{ a = [0.3, 0.2, 0.25], b = [0.6, 0.7, 0.8], phase = {{ model = "fournier-forand", n = 1.10, backscatter_fraction = 0.0183 }} }}
        camera = {{ position_m = [0, 0, 0], forward = [1, 0, 0], hfov_deg = 60, width = 96, height = 64 }}
        [[lamp]]
        position_m = [0.0, -0.3, 0.0]
        forward = [1.0, 0.0, 0.0]
        intensity = [10.0, 10.0, 10.0]
        half_angle_deg = 90.0
        radius_m = 0.02
        [[object]]
        plane = {{ center_m = [2.0, 0, 0], normal = [-1, 0, 0], up = [0, 0, 1], size_m = [8, 8] }}
        reflectance = {wall}
        {post}
        "#
    );
    let folder = env!("CARGO_MANIFEST_DIR");
    Prepared::build(&Scene::parse(&text, folder.as_ref(), "test").expect("valid"))
}

const POST: &str = r#"
        [[object]]
        plane = { center_m = [1.0, 0, 0], normal = [-1, 0, 0], up = [0, 0, 1], size_m = [0.4, 8] }
        reflectance = [0.9, 0.9, 0.9]
"#;

fn plan(samples: u32, seed: u64) -> Plan {
    Plan {
        samples_per_pixel: Some(samples),
        threads: Some(1),
        ..Plan::new(seed)
    }
}

fn denoised(scene: &Prepared, samples: u32, seed: u64) -> Film {
    denoised_on(&Device::CpuSimd, scene, samples, seed)
}

fn denoised_on(device: &Device, scene: &Prepared, samples: u32, seed: u64) -> Film {
    let observe = |_: &crate::integrator::Progress| {};
    let cancel = AtomicBool::new(false);
    let rendered = render(device, scene, &plan(samples, seed), true, &cancel, &observe);
    rendered.expect("rendered").0
}

pub(super) fn rendered(scene: &Prepared, samples: u32, seed: u64) -> Film {
    let cancel = AtomicBool::new(false);
    render_lanes(scene, &plan(samples, seed), &cancel, &|_| {})
        .expect("rendered")
        .0
}

/// Two independent pictures of a scene, whose noise is not in the product of what another one is off by from each.
type Truths = [Vec<Spectrum>; 2];

fn truths(scene: &Prepared, samples: u32) -> Truths {
    [98, 99].map(|seed| rendered(scene, samples, seed).layer(FilmLayer::Total))
}

/// Relative squared error, as the estimate is meant.
fn relative_square(film: &Film, [one, other]: &Truths) -> f64 {
    let total = film.layer(FilmLayer::Total);
    let n = total.len() as f64;
    let level = |i: usize, k: usize| 0.5 * (one[i][k] + other[i][k]);
    let mean = [0, 1, 2].map(|k| (0..total.len()).map(|i| level(i, k)).sum::<f64>() / n);
    let mut sum = 0.0;
    for (i, value) in total.iter().enumerate() {
        for k in 0..3 {
            let square = (value[k] - one[i][k]) * (value[k] - other[i][k]);
            sum += square / (level(i, k).powi(2) + 1e-4 * mean[k] * mean[k]);
        }
    }
    sum / (3.0 * n)
}

/// The estimate is of the size of the true error over seeds, with edges in depth and without, and that is far less than before
/// (docs/denoise.md has the benchmark scenes).
#[test]
fn the_estimated_error_is_of_the_true_ones_size_and_far_less_than_before() {
    const SEEDS: u64 = 6;
    for (post, samples) in [(POST, 8), ("", 8)] {
        let scene = scene(post);
        let truth = truths(&scene, 256);
        let (mut estimated, mut actual, mut before) = (0.0, 0.0, 0.0);
        for seed in 0..SEEDS {
            let mut film = denoised(&scene, samples, seed);
            let facts = film.denoised().expect("denoised").facts;
            estimated += facts.relative_error.powi(2);
            actual += relative_square(&film, &truth);
            film.show_denoised(None);
            before += relative_square(&film, &truth);
        }
        let ratio = (estimated / actual).sqrt();
        assert!(
            (0.4..2.5).contains(&ratio),
            "estimated over true error {ratio}"
        );
        assert!(before > 10.0 * actual, "{before} {actual}");
    }
}

/// Light that straight light is blurred to is a hundred times brighter in pixels that a bright post shares than in those of the
/// wall beside it, which a fit of the wall has met.
#[test]
fn the_edge_of_a_bright_post_has_no_light_but_its_own() {
    let scene = scene(POST);
    let truth = rendered(&scene, 512, 99).layer(FilmLayer::Total);
    for seed in 0..3 {
        let film = denoised(&scene, 8, seed);
        let off = |(value, t): (&Spectrum, &Spectrum)| (value[1] / t[1] - 1.0).abs();
        let total = film.layer(FilmLayer::Total);
        let far = total.iter().zip(&truth).filter(|&pair| off(pair) > 0.5);
        assert_eq!(far.count(), 0, "seed {seed}");
    }
}

/// Specks before the wall, objects half as wide as a pixel each.
fn specks() -> String {
    let speck = |i: u32| {
        let (column, row) = (f64::from(i % 12), f64::from(i / 12));
        let (y, z) = (0.151 * column - 0.83, 0.157 * row - 0.52);
        format!(
            "[[object]]\nplane = {{ center_m = [1.9, {y:.3}, {z:.3}], normal = [-1, 0, 0], up = [0, 0, 1], size_m = [0.012, 0.012] }}\nreflectance = [0.3, 0.3, 0.3]\n"
        )
    };
    (0..48).map(speck).collect()
}

/// Squared errors of the pixels that show a speck, before and after.
fn errors_at_specks(wall: &str) -> [f64; 2] {
    let scene = before_wall(wall, &specks());
    let [one, other] = truths(&scene, 48);
    let mut film = denoised(&scene, 8, 1);
    let guides = guides(&scene, &film);
    let with_speck: Vec<usize> = (0..one.len())
        .filter(|&i| guides.pixel(i).len() > 1)
        .collect();
    assert!(with_speck.len() > 48, "{}", with_speck.len());
    let mean_square = |film: &Film| {
        let total = film.layer(FilmLayer::Total);
        let off = |&i: &usize| {
            let level = 0.5 * (one[i][1] + other[i][1]);
            (total[i][1] - one[i][1]) * (total[i][1] - other[i][1]) / (level * level)
        };
        with_speck.iter().map(off).sum::<f64>() / with_speck.len() as f64
    };
    let after = mean_square(&film);
    film.show_denoised(None);
    [mean_square(&film), after]
}

/// Surfaces too small for a fit of their own follow that of what is beside them, instead of staying as noisy as their samples. A wall all
/// of one colour does not tell how its scattered light goes with reflectance; then it is a guess, which is still nearer.
#[test]
fn specks_far_away_are_no_noisier_than_what_is_behind_them() {
    let rock = r#"{ texture = "../../assets/textures/coral_rock.png", encoding = "srgb", tile_m = [1.5, 1.5] }"#;
    for (wall, least) in [(rock, 10.0), ("[0.02, 0.02, 0.02]", 1.0)] {
        let [before, after] = errors_at_specks(wall);
        assert!(before > least * after, "{wall}: {before} {after}");
    }
}

/// What is known without noise, but for where samples looked.
pub(super) fn guides(scene: &Prepared, film: &Film) -> Guides {
    let nowhere = || Half {
        film,
        seed: 0,
        batches: &[],
    };
    let never = AtomicBool::new(false);
    Guides::of(scene, &[nowhere(), nowhere()], &never).expect("looked")
}

/// A textured plane under a lamp so far away that its light is even to 1e-7.
pub(super) fn evenly_lit() -> Prepared {
    let text = r#"
        format = "uw-scene/1"
        camera = { position_m = [0, 0, 2], forward = [0, 0, -1], up = [1, 0, 0], hfov_deg = 60, width = 64, height = 48 }
        [[lamp]]
        position_m = [0.0, 0.0, 1e4]
        forward = [0.0, 0.0, -1.0]
        intensity = [1e8, 1e8, 1e8]
        half_angle_deg = 90.0
        [[object]]
        plane = { center_m = [0, 0, 0], normal = [0, 0, 1], up = [1, 0, 0], size_m = [8, 8] }
        reflectance = { texture = "../../assets/textures/coral_rock.png", encoding = "srgb", tile_m = [1.5, 1.5] }
    "#;
    let folder = env!("CARGO_MANIFEST_DIR");
    Prepared::build(&Scene::parse(text, folder.as_ref(), "test").expect("valid"))
}

/// Relative variance of reflectance inside pixels, mean over every fourth of them and over channels.
fn texture_variance(scene: &Prepared, film: &Film) -> f64 {
    const RAYS: u32 = 256;
    let mut of_pixels = Vec::new();
    for (x, y) in (0..film.height).flat_map(|y| (0..film.width).step_by(4).map(move |x| (x, y))) {
        let mut rng = crate::sampling::Rng::new(1, y * film.width + x, 0, 0);
        let mut sums = [[0.0; 3]; 2];
        for _ in 0..RAYS {
            let place = (f64::from(x) + rng.uniform(), f64::from(y) + rng.uniform());
            let look = look::Look::through(scene, place, glam::DVec2::ZERO);
            for k in 0..3 {
                sums[0][k] += look.reflectance[k] / f64::from(RAYS);
                sums[1][k] += look.reflectance[k].powi(2) / f64::from(RAYS);
            }
        }
        for (mean, square) in sums[0].iter().zip(sums[1]) {
            of_pixels.push(square / (mean * mean) - 1.0);
        }
    }
    of_pixels.iter().sum::<f64>() / of_pixels.len() as f64
}

/// What is filtered is light over the known reflectance: where the light is even, nothing of the texture is lost, however few
/// the samples and wherever in their pixels they looked, beyond what single precision leaves.
#[test]
fn in_even_light_a_texture_comes_back_exactly() {
    let scene = evenly_lit();
    // Single precision places a sample to some 1e-4 of a texel, and neighbouring texels differ by a tenth. What is known is kept
    // in single precision everywhere.
    let (double, single) = ((Device::Cpu, 1e-6), (Device::CpuSimd, 3e-5));
    for ((device, within), samples) in [
        (single.clone(), 2),
        (single, 4),
        (double.clone(), 2),
        (double, 4),
    ] {
        let film = denoised_on(&device, &scene, samples, 3);
        let guides = guides(&scene, &film);
        let (mut least, mut most) = ([f64::INFINITY; 3], [0.0_f64; 3]);
        for (i, value) in film.layer(FilmLayer::Total).iter().enumerate() {
            for k in 0..3 {
                let seen = |half: usize| guides.pixel(i)[0].shown[half].seen[k];
                let light = value[k] / (0.5 * f64::from(seen(0) + seen(1)));
                least[k] = least[k].min(light);
                most[k] = most[k].max(light);
            }
        }
        for k in 0..3 {
            let off = most[k] / least[k] - 1.0;
            assert!(off < within, "{samples} samples, channel {k}: {off}");
        }
        // Beside that there is what rays miss of the texture: no more than that many random ones do.
        let truth = truths(&scene, 256);
        let off = relative_square(&film, &truth);
        let expected = texture_variance(&scene, &film) / f64::from(2 * guides::VARIED_LOOKS);
        assert!(off < expected, "{samples} samples: {off} {expected}");
    }
}

#[test]
fn the_film_without_its_denoised_layers_is_the_two_halves() {
    let scene = scene(POST);
    let mut film = denoised(&scene, 4, 5);
    assert_eq!(film.samples(), 4);
    film.show_denoised(None);
    let total = film.layer(FilmLayer::Total);
    let halves = [5, 5 ^ 0x9e37_79b9_7f4a_7c15]
        .map(|seed| rendered(&scene, 2, seed).layer(FilmLayer::Total));
    for (i, value) in total.iter().enumerate() {
        let mean = 0.5 * (halves[0][i][1] + halves[1][i][1]);
        assert!((value[1] / mean - 1.0).abs() < 1e-12, "{value:?} {mean}");
    }
}

#[test]
fn plans_that_cannot_be_halved_are_refused() {
    let scene = scene("");
    let cancel = AtomicBool::new(false);
    let refuse = |plan: &Plan| {
        let result = render(&Device::CpuSimd, &scene, plan, false, &cancel, &|_| {});
        result.map(|_| ()).expect_err("refused").to_string()
    };
    for samples in [1, 7] {
        let message = refuse(&plan(samples, 0));
        assert!(message.contains(&format!("got {samples}")), "{message}");
    }
    assert!(refuse(&Plan::new(0)).contains("a number of samples or a time limit"));
}
