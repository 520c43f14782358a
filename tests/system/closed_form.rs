//! Renders against the closed forms in `data/closed_forms.json` (quadrature, relative error below 1e-9).

use glam::DVec3;
use serde_json::Value;
use uw_media::phase::{FournierForand, HenyeyGreenstein, Phase, PhaseTable};
use uw_media::transmittance::{free_path_m, transmittance};
use uw_render::sampling::{Rng, directions::turn};
use uw_render::scene::{Falloff, Sun};
use uw_tests::single_ray::{add_plate, camera, empty, point_lamp, surface, water};
use uw_tests::{
    file,
    gpu::{Backend, everywhere},
    measure,
};

fn forms(key: &str) -> Vec<Value> {
    document()[key].as_array().expect("a list").clone()
}

fn document() -> Value {
    let text = std::fs::read_to_string(file("data/closed_forms.json")).expect("readable");
    serde_json::from_str(&text).expect("JSON")
}

fn number(v: &Value) -> f64 {
    v.as_f64().expect("a number")
}

fn triple(v: &Value) -> [f64; 3] {
    [number(&v[0]), number(&v[1]), number(&v[2])]
}

fn vector(v: &Value) -> DVec3 {
    DVec3::from_array(triple(v))
}

fn phase(v: &Value) -> Phase {
    match v["type"].as_str() {
        Some("fournier_forand") => Phase::FournierForand(
            FournierForand::new(number(&v["n"]), number(&v["B"])).expect("valid"),
        ),
        _ if number(&v["g"]) == 0.0 => Phase::Isotropic,
        _ => Phase::HenyeyGreenstein(HenyeyGreenstein::new(number(&v["g"])).expect("valid")),
    }
}

/// z-scores of independent renders must look standard normal: none beyond 4.5, rms below 1 plus four standard
/// deviations; and the errors small enough for the test to mean something.
fn assert_standard_normal(z: &[f64], what: &str) {
    let n = z.len() as f64;
    let rms = (z.iter().map(|z| z * z).sum::<f64>() / n).sqrt();
    let largest = z.iter().fold(0.0f64, |m, z| m.max(z.abs()));
    println!("{what}: {n} values, rms z {rms:.3}, largest {largest:.2}");
    assert!(
        largest < 4.5 && rms < 1.0 + 4.0 / (2.0 * n).sqrt(),
        "{what}: rms {rms}, largest {largest}"
    );
}

#[test]
fn lambertian_plane_under_a_point_lamp_in_absorbing_water() {
    everywhere(lambertian_plane);
}

fn lambertian_plane(backend: Backend) {
    for case in forms("a_lambert_plane_point_source_absorbing") {
        for pixel in case["pixels"].as_array().expect("a list") {
            let mut scene = empty(camera(DVec3::ZERO, vector(&pixel["ray_dir"]), 1));
            scene.water = Some(water(triple(&case["abs"]), [0.0; 3], Phase::Isotropic));
            let mut lamp = point_lamp(vector(&case["src"]), 1.0);
            lamp.intensity = triple(&case["I"]);
            scene.lamps.push(lamp);
            add_plate(
                &mut scene,
                DVec3::new(0.0, 0.0, number(&case["D"])),
                -DVec3::Z,
                1e3,
                triple(&case["albedo"]),
            );
            // One event, so no interreflection; without scattering nothing is random.
            let (mean, _) = measure(backend, &scene, 1, 1, 1);
            let expected = triple(&pixel["centre"]);
            for k in 0..3 {
                println!("  off by {:+.1e}", mean[k] / expected[k] - 1.0);
                // Eight digits are printed; the camera's pixel covers 1e-9 rad.
                assert!(
                    (mean[k] / expected[k] - 1.0).abs() < 3e-8 + backend.rounding(),
                    "{}: {} {}",
                    case["id"],
                    mean[k],
                    expected[k]
                );
            }
        }
    }
}

#[test]
fn single_scattering_from_point_and_spot_lamps() {
    everywhere(single_scattering_from_lamps);
}

fn single_scattering_from_lamps(backend: Backend) {
    let mut z = Vec::new();
    for case in forms("b_single_scatter_point_spot") {
        for (i, pixel) in case["pixels"]
            .as_array()
            .expect("a list")
            .iter()
            .enumerate()
        {
            let mut scene = empty(camera(DVec3::ZERO, vector(&pixel["ray_dir"]), 400));
            scene.water = Some(water(
                triple(&case["abs"]),
                triple(&case["scat"]),
                phase(&case["phase"]),
            ));
            let mut lamp = point_lamp(vector(&case["src"]), number(&case["I"]));
            if case["spot"].is_object() {
                lamp.forward =
                    (vector(&case["spot"]["axis_towards"]) - lamp.position_m).normalize();
                lamp.half_angle_deg = number(&case["spot"]["half_angle_deg"]);
                lamp.falloff = Falloff::Uniform;
            }
            scene.lamps.push(lamp);
            if let Some(distance) = case["T_plane_black_at_z"].as_f64() {
                add_plate(
                    &mut scene,
                    DVec3::new(0.0, 0.0, distance),
                    -DVec3::Z,
                    1e3,
                    [0.0; 3],
                );
            }
            let (mean, error) = measure(backend, &scene, 512, 1, 100 + i as u64);
            let expected = triple(&pixel["centre"]);
            for k in 0..3 {
                if expected[k] == 0.0 {
                    assert_eq!(
                        mean[k], 0.0,
                        "{} pixel {i}: light outside the cone",
                        case["id"]
                    );
                    continue;
                }
                assert!(
                    error[k] < 0.02 * backend.noise() * expected[k],
                    "{} pixel {i}: error {} of {}",
                    case["id"],
                    error[k],
                    expected[k]
                );
                z.push((mean[k] - expected[k]) / error[k]);
            }
        }
    }
    assert_standard_normal(&z, "single scattering from lamps");
}

/// Radiance of sunlight scattered once on an upward ray from `depth` to the surface or a downward one.
fn half_space(
    c: f64,
    b: f64,
    phase: f64,
    irradiance: f64,
    depth: f64,
    up: f64,
    sun_up: f64,
) -> f64 {
    let k = c * (1.0 - up / sun_up);
    let start = b * phase * irradiance * (-c * depth / sun_up).exp();
    if up > 0.0 {
        start * -(-k * depth / up).exp_m1() / k
    } else {
        start / k
    }
}

#[test]
fn single_scattering_of_sunlight_in_a_half_space() {
    everywhere(single_scattering_of_sunlight);
}

fn single_scattering_of_sunlight(backend: Backend) {
    let mut z = Vec::new();
    for case in forms("c_single_scatter_directional_half_space") {
        let refractive = case["n_water"].is_number();
        let zenith = number(&case["sun_zenith_deg"]).to_radians();
        let (a, b) = (number(&case["a"]), number(&case["b"]));
        let law = phase(&case["phase"]);
        for (i, ray) in case["rays"].as_array().expect("a list").iter().enumerate() {
            let flip = DVec3::new(1.0, 1.0, -1.0);
            let direction = vector(&ray["view_dir_zdown"]) * flip;
            let depth = number(&ray["camera_depth"]);
            let mut scene = empty(camera(DVec3::new(0.0, 0.0, -depth), direction, 400));
            scene.water = Some(water([a; 3], [b; 3], law.clone()));
            scene.surface = Some(surface(refractive));
            scene.sun = Some(Sun {
                travel_direction: DVec3::new(zenith.sin(), 0.0, -zenith.cos()),
                irradiance: [number(&case["E_perp"]); 3],
            });
            let (mean, error) = measure(backend, &scene, 64, 1, i as u64);
            let mut expected = number(&ray["L"]);
            if refractive && direction.z > 0.0 {
                // The reference leaves out light that scatters on the ray's reflection at the surface.
                expected += reflected_part(&case, direction, depth, a + b, b, &law);
            }
            // Rays of one picture differ by up to 4e-7 rad.
            if error[0] > 2.0 * backend.rounding().max(0.5e-5) * expected {
                z.push((mean[0] - expected) / error[0]);
            } else {
                let deviation = mean[0] / expected - 1.0;
                // The phase function's table is within 1e-5.
                assert!(
                    deviation.abs() < 2e-5 + 4.0 * backend.rounding(),
                    "{} ray {i}: {} {expected}",
                    case["id"],
                    mean[0]
                );
            }
        }
    }
    assert_standard_normal(&z, "sunlight seen in reflection");
}

/// In and about the sun's disk light that scattered once is that of the mean of the phase function over it; the errors told are those
/// that seeds show.
#[test]
fn the_sun_behind_water_has_a_finite_peak() {
    everywhere(sun_behind_water);
}

fn sun_behind_water(backend: Backend) {
    use uw_media::phase::disk_mean;
    let law = Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("a phase function"));
    let (a, b, depth) = (0.1, 1e-4, 5.0);
    let towards = DVec3::new(-0.6, 0.0, 0.8);
    let mut z = Vec::new();
    for (i, off_rad) in [0.0, 1e-3, 4.0e-3, 4.64e-3, 5.0e-3, 9e-3, 0.05, 0.3]
        .into_iter()
        .enumerate()
    {
        let (sin, cos) = f64::sin_cos(off_rad);
        let direction = cos * towards + sin * DVec3::Y;
        let mut scene = empty(camera(DVec3::new(0.0, 0.0, -depth), direction, 400));
        scene.water = Some(water([a; 3], [b; 3], law.clone()));
        scene.surface = Some(surface(false));
        scene.sun = Some(Sun {
            travel_direction: -towards,
            irradiance: [1.0; 3],
        });
        let (mean, error) = measure(backend, &scene, 64, 1, i as u64);
        let phase = disk_mean(&law, 4.65e-3, (0.5 * off_rad).sin().powi(2));
        let once = match i {
            // Along the sun's own beam light is as far whichever way it comes.
            0 => b * phase * (-(a + b) * depth / towards.z).exp() * depth / towards.z,
            _ => half_space(a + b, b, phase, 1.0, depth, direction.z, towards.z),
        };
        // A thousandth of the light scatters twice, the table is within 1e-3, the width of the disk within 1.1 %.
        let share = mean[0] / once - 1.0;
        let rim = if (4e-3..6e-3).contains(&off_rad) {
            0.15
        } else {
            0.03
        };
        assert!(
            share.abs() < rim + 5.0 * error[0] / once,
            "{off_rad}: {share}"
        );
        let (again, other) = measure(backend, &scene, 64, 1, 100 + i as u64);
        if error[0] > 1e-4 * once {
            z.push((mean[0] - again[0]) / error[0].hypot(other[0]));
        }
    }
    assert!(z.iter().all(|z| z.abs() < 4.5), "{z:?}");
}

fn reflected_part(case: &Value, direction: DVec3, depth: f64, c: f64, b: f64, law: &Phase) -> f64 {
    use uw_media::phase::PhaseFunction;
    let angle = number(&case["theta_water_deg"]).to_radians();
    let towards_sun = DVec3::new(-angle.sin(), 0.0, angle.cos());
    let reflected = DVec3::new(direction.x, direction.y, -direction.z);
    let x = 0.25 * (reflected - towards_sun).length_squared();
    let below = half_space(
        c,
        b,
        law.value(x),
        number(&case["E_perp_in_water"]),
        0.0,
        reflected.z,
        towards_sun.z,
    );
    let reflectance = uw_media::interface::fresnel_reflectance(direction.z, 1.34, 1.0);
    reflectance * (-c * depth / direction.z).exp() * below
}

#[test]
fn white_furnace_under_matched_and_refracting_surfaces() {
    everywhere(white_furnace);
}

fn white_furnace(backend: Backend) {
    let laws = [
        Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid")),
        Phase::HenyeyGreenstein(HenyeyGreenstein::new(0.9).expect("valid")),
        Phase::Isotropic,
    ];
    let mut z = Vec::new();
    for (i, law) in laws.into_iter().enumerate() {
        for (j, b) in [0.05, 1.0, 20.0].into_iter().enumerate() {
            for refractive in [false, true] {
                // Half a metre of lossless water over a perfectly white bottom under a uniform sky.
                let direction = [
                    DVec3::new(0.8, 0.1, 0.59),
                    DVec3::new(0.3, 0.2, -0.9),
                    DVec3::new(0.1, 0.0, 1.0),
                ][j];
                let mut scene = empty(camera(DVec3::new(0.0, 0.0, -0.25), direction, 200));
                scene.water = Some(water([0.0; 3], [b, 0.5 * b, b], law.clone()));
                scene.surface = Some(surface(refractive));
                scene.sky_radiance = [1.0; 3];
                add_plate(
                    &mut scene,
                    DVec3::new(0.0, 0.0, -0.5),
                    DVec3::Z,
                    1e5,
                    [1.0; 3],
                );
                let (mean, error) = measure(backend, &scene, 128, 0, (10 * i + j) as u64);
                let expected = if refractive { 1.34 * 1.34 } else { 1.0 };
                for k in 0..2 {
                    // With nothing lost every path brings the sky's radiance: often there is no noise at all.
                    let floor = error[k].max(1e-9);
                    // Roulette on what remains after scoring costs most where nothing is lost: up to 4 %.
                    assert!(
                        error[k] < 0.05 * backend.noise(),
                        "b {b}: error {}",
                        error[k]
                    );
                    z.push((mean[k] - expected) / floor);
                }
            }
        }
    }
    assert_standard_normal(&z, "white furnace");
}

#[test]
fn absorbing_ball_seen_against_a_uniform_sky() {
    for row in document()["d_white_furnace"]["d3"]["expected"]
        .as_array()
        .expect("a list")
    {
        let chord = 2.0 * (1.0 - number(&row["h"]).powi(2)).sqrt();
        assert!((transmittance(0.7, chord) / number(&row["L"]) - 1.0).abs() < 3e-8);
    }
}

#[test]
fn walks_in_infinite_water_have_the_right_length_and_reach() {
    let rows = document()["d_white_furnace"]["d4"]["mean_square_absorption_distance"].clone();
    for row in rows.as_array().expect("a list") {
        let (albedo, g) = (number(&row["w0"]), number(&row["g"]));
        let law = match g {
            0.0 => Phase::Isotropic,
            g if g == 0.924 => Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).expect("valid")),
            _ => Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid")),
        };
        let table = PhaseTable::new(&law);
        let mut rng = Rng::new(4, 0, 0, 0);
        let n = 100_000;
        let (mut scatterings, mut square, mut fourth) = (0u64, 0.0, 0.0);
        for _ in 0..n {
            let (mut position, mut direction) = (DVec3::ZERO, DVec3::Z);
            loop {
                position += free_path_m(1.0, rng.uniform()) * direction;
                if rng.uniform() >= albedo {
                    break;
                }
                scatterings += 1;
                direction = turn(direction, table.sample_x(rng.uniform()), rng.uniform());
            }
            let r2 = position.length_squared();
            square += r2;
            fourth += r2 * r2;
        }
        let n = f64::from(n);
        let (mean, expected) = (square / n, number(&row["value"]));
        let error = ((fourth / n - mean * mean) / n).sqrt();
        assert!(
            ((mean - expected) / error).abs() < 4.0,
            "albedo {albedo}, g {g}: {mean} ± {error}, {expected}"
        );
        let orders = albedo / (1.0 - albedo);
        let order_error = (orders * (1.0 + orders) / n).sqrt();
        assert!(((scatterings as f64 / n - orders) / order_error).abs() < 4.0);
    }
}
