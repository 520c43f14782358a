//! Lamps above the water: on a bottom against a closed form, beside lamps in the water, and their disks in view. In scattering water they are
//! in the validator's corpus.

use glam::{DVec2, DVec3};
use uw_render::{
    film::{Film, FilmLayer},
    integrator::Plan,
    irradiance::IrradiancePlan,
    scene::{Camera, Scene},
};
use uw_tests::{file, gpu::everywhere, plan};

/// Water down to a wide bottom 1.5 m deep of reflectance 0.5, which the camera 1 m deep looks down at, with a lamp.
fn over_bottom(water: &str, surface: &str, lamp: &str, more: &str) -> Scene {
    let text = format!(
        "format = \"uw-scene/1\"\nwater = {{ {water} }}\nsurface = {{ {surface} }}\n\
         [camera]\nposition_m = [0, 0, -1]\nforward = [0, 0, -1]\nup = [0, 1, 0]\nhfov_deg = 30\nwidth = 6\nheight = 6\n\
         [[lamp]]\nforward = [0, 0, -1]\nintensity = [9, 6, 3]\n{lamp}\n\
         [[object]]\nplane = {{ center_m = [0, 0, -1.5], normal = [0, 0, 1], up = [0, 1, 0], size_m = [60, 60] }}\nreflectance = [0.5, 0.5, 0.5]\n{more}"
    );
    Scene::parse(&text, &file("scenes"), "air").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn mean(film: &Film, layer: FilmLayer) -> [f64; 3] {
    let pixels = film.layer(layer);
    std::array::from_fn(|k| pixels.iter().map(|p| p[k]).sum::<f64>() / pixels.len() as f64)
}

/// Share of unpolarised light that goes from air into water of index 1.34 (Fresnel).
fn transmitted(cosine: f64) -> f64 {
    let n = 1.34_f64;
    let behind = (1.0 - (1.0 - cosine * cosine) / (n * n)).sqrt();
    let s = (cosine - n * behind) / (cosine + n * behind);
    let p = (n * cosine - behind) / (n * cosine + behind);
    1.0 - 0.5 * (s * s + p * p)
}

/// Irradiance across it of a beam from a lamp of 1 W/sr `height_m` above water of index 1.34, on a level plane `depth_m` deep at a distance
/// `reach_m` beside the lamp, times the cosine there, with attenuation `c`: by the ring that a step of the angle in the air covers; and that angle's cosine.
fn level_irradiance(height_m: f64, depth_m: f64, reach_m: f64, c: f64) -> (f64, f64) {
    const STEP: f64 = 1e-6;
    let wet = |angle: f64| (angle.sin() / 1.34).asin();
    let reach = |angle: f64| height_m * angle.tan() + depth_m * wet(angle).tan();
    let (mut low, mut high) = (0.0, std::f64::consts::FRAC_PI_2);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if reach(middle) < reach_m {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (inner, outer) = ((low - STEP).max(0.0), low + STEP);
    let solid_angle = inner.cos() - outer.cos();
    let ring = 0.5 * (reach(outer).powi(2) - reach(inner).powi(2));
    let range = depth_m / wet(low).cos();
    let irradiance = transmitted(low.cos()) * solid_angle / ring * (-c * range).exp();
    (irradiance, low.cos())
}

/// Without scattering a point lamp lights the bottom by refraction, Fresnel's transmittance and absorption, straight below it and far
/// aside: within 0.3 %, what the bottom sends up and gets back left out.
#[test]
fn a_bottom_is_lit_through_the_surface() {
    const A: f64 = 0.3;
    for (height_m, aside_m) in [(0.5, 0.0), (0.5, 3.0), (4.0, 2.0), (0.05, 1.0)] {
        let lamp = format!("position_m = [{aside_m}, 0, {height_m}]");
        let scene = over_bottom("a = [0.3, 0.3, 0.3], b = [0, 0, 0]", "", &lamp, "");
        // The mean over the picture, of points in the middle of parts of its pixels.
        let half = 15f64.to_radians().tan();
        let parts = 60;
        let at = |i: i32| half * (2.0 * (f64::from(i) + 0.5) / f64::from(parts) - 1.0);
        let mut expected = 0.0;
        for (x, y) in (0..parts).flat_map(|i| (0..parts).map(move |j| (at(i), at(j)))) {
            let reach_m = (0.5 * x - aside_m).hypot(0.5 * y);
            let seen = (-A * 0.5 * (1.0 + x * x + y * y).sqrt()).exp();
            let (light, _) = level_irradiance(height_m, 1.5, reach_m, A);
            expected += seen * light * 0.5 / std::f64::consts::PI / f64::from(parts * parts);
        }
        everywhere(|backend| {
            let once = Plan {
                max_bounces: 1,
                ..plan(64, 3)
            };
            let film = backend.render(&scene, &once).0;
            for (k, intensity) in [9.0, 6.0, 3.0].into_iter().enumerate() {
                let found = mean(&film, FilmLayer::Lamp(0))[k] / intensity;
                println!(
                    "{height_m} m above, {aside_m} m aside: {:.5}",
                    found / expected - 1.0
                );
                assert!(
                    (found / expected - 1.0).abs() < 3e-3,
                    "{found} instead of {expected}"
                );
                assert_eq!(mean(&film, FilmLayer::Ambient)[k], 0.0);
            }
        });
    }
}

/// Sensors in absorbing water measure a point lamp to 1e-5, as it comes from one direction, and a disk, met by drawn directions, within four
/// standard errors of at most 2 %: the sum of its points with their own cosine.
#[test]
fn sensors_measure_lamps_through_the_surface() {
    const A: f64 = 0.3;
    let water = "a = [0.3, 0.3, 0.3], b = [0, 0, 0]";
    for radius_m in [0.0, 0.5] {
        let lamp = format!("position_m = [0.8, 0, 0.7]\nradius_m = {radius_m:?}");
        let mut scene = over_bottom(water, "", &lamp, "");
        scene.quads.clear();
        let parts: u32 = if radius_m > 0.0 { 4000 } else { 1 };
        let expected = (0..parts).map(|i| {
            let range_m = radius_m * ((f64::from(i) + 0.5) / f64::from(parts)).sqrt();
            let aside = range_m * DVec2::from_angle(2.399_963_229_728_653 * f64::from(i));
            let reach_m = (DVec2::new(0.8, 0.0) + aside).length();
            let (light, cosine) = level_irradiance(0.7, 1.2, reach_m, A);
            let own = if radius_m > 0.0 { cosine } else { 1.0 };
            9.0 * light * own / f64::from(parts)
        });
        let expected: f64 = expected.sum();
        everywhere(|backend| {
            let plan = IrradiancePlan {
                depths_m: vec![1.2],
                samples: 1 << 16,
                seed: 3,
                threads: None,
                max_bounces: 0,
            };
            let found = backend.irradiances(&scene, &plan).expect("valid")[0].e_d;
            let (value, error) = (found.value[0], found.standard_error[0]);
            println!("radius {radius_m} m: {value} ± {error}, {expected}");
            assert!(error < 0.02 * expected, "{error} of {expected}");
            let off = (value - expected).abs();
            assert!(
                off < 4.0 * error + 1e-5 * expected,
                "{value} instead of {expected}"
            );
        });
    }
}

/// Where the surface does not refract, a lamp in the air lights clear water as one in it would, and things in the air cast shadows.
#[test]
fn without_refraction_it_is_a_lamp_like_any_other() {
    let water = "a = [0, 0, 0], b = [0, 0, 0], refractive_index = 1.34";
    let lamp =
        "position_m = [0.4, 0.2, 0.7]\nhalf_angle_deg = 50\nfalloff = \"cosine\"\nradius_m = 0.1";
    let above = over_bottom(water, "refractive = false", lamp, "");
    let mut below = above.clone();
    if let Some(surface) = &mut below.surface {
        surface.height_m = 5.0;
    }
    let lid = "[[object]]\nplane = { center_m = [0.2, 0.1, 0.3], normal = [0, 0, 1], up = [0, 1, 0], size_m = [4, 4] }\nreflectance = [0, 0, 0]\n";
    let covered = over_bottom(water, "refractive = false", lamp, lid);
    everywhere(|backend| {
        let light =
            |scene: &Scene| mean(&backend.render(scene, &plan(256, 5)).0, FilmLayer::Total)[0];
        let (above, below, covered) = (light(&above), light(&below), light(&covered));
        println!("{}", above / below - 1.0);
        assert!((above / below - 1.0).abs() < 0.01, "{above} {below}");
        assert_eq!(covered, 0.0);
    });
}

/// A camera that looks up at a disk sees its radiance less what the surface reflects, times the square of the index; one in the air sees
/// it as it is.
#[test]
fn disks_are_seen_from_below_and_above() {
    let lamp = "position_m = [0, 0, 2]\nradius_m = 1.5";
    let mut scene = over_bottom("a = [0, 0, 0], b = [0, 0, 0]", "", lamp, "");
    let up = |camera: &Camera, position_m: DVec3| Camera {
        position_m,
        forward: DVec3::Z,
        right: -camera.right,
        ..camera.clone()
    };
    let radiance = 9.0 / (std::f64::consts::PI * 1.5 * 1.5);
    let passed = transmitted(1.0) * 1.34 * 1.34;
    for (height_m, factor) in [(-1.0, passed), (1.0, 1.0)] {
        scene.camera = up(&scene.camera, DVec3::new(0.0, 0.0, height_m));
        let mut lit = scene.clone();
        // Something in the air, so that what leaves the water is followed.
        let mut beside = scene.quads[0];
        beside.centre_m = DVec3::new(50.0, 0.0, 5.0);
        lit.quads.push(beside);
        everywhere(|backend| {
            for scene in [&scene, &lit] {
                let found = mean(&backend.render(scene, &plan(64, 2)).0, FilmLayer::Lamp(0))[0];
                let expected = radiance * factor;
                assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
            }
        });
    }
}
