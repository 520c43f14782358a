//! Irradiance sensors where the light field is known, on every processor: sky, lamps, shadows, a bottom; and what they
//! refuse.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use uw_media::interface::fresnel_reflectance;
use uw_media::phase::{HenyeyGreenstein, Phase};
use uw_render::backend::Device;
use uw_render::irradiance::{Estimate, IrradianceError, IrradiancePlan, measure};
use uw_render::prepare::Prepared;
use uw_render::scene::Scene;
use uw_tests::discrete_ordinates::{Problem, irradiances};
use uw_tests::gpu::{Backend, everywhere};
use uw_tests::single_ray::{add_plate, camera, empty, point_lamp, sun, surface, water};

const INDEX: f64 = 1.34;

fn plan(depths_m: &[f64]) -> IrradiancePlan {
    IrradiancePlan {
        depths_m: depths_m.to_vec(),
        samples: 1 << 14,
        seed: 5,
        threads: None,
        max_bounces: 0,
    }
}

/// Water under a surface at z = 0, seen from above the origin.
fn under_surface(a: [f64; 3], b: [f64; 3], refractive: bool) -> Scene {
    let mut scene = empty(camera(DVec3::ZERO, -DVec3::Z, 1));
    let phase = Phase::HenyeyGreenstein(HenyeyGreenstein::new(0.9).expect("valid"));
    scene.water = Some(water(a, b, phase));
    scene.surface = Some(surface(refractive));
    scene
}

const SUN: [f64; 3] = [1.0, 2.0, 3.0];

fn assert_near(backend: Backend, estimate: &Estimate, expected: [f64; 3], what: &str) {
    for k in 0..3 {
        let (value, error) = (estimate.value[k], estimate.standard_error[k]);
        assert!(
            error < 0.01 * expected[k],
            "{what}: error {error} of {}",
            expected[k]
        );
        assert!(
            (value - expected[k]).abs()
                <= 4.0 * error + (4.0 * backend.rounding() + 1e-9) * expected[k],
            "{what}, channel {k}: {value} ± {error}, {}",
            expected[k]
        );
    }
}

#[test]
fn a_uniform_sky_through_absorbing_water_follows_exponential_integrals() {
    everywhere(|backend| {
        let a = [0.1, 0.3, 0.0];
        let depth_m = 1.5;
        let mut scene = under_surface(a, [0.0; 3], false);
        scene.sky_radiance = [1.0, 2.0, 0.5];
        let row = backend
            .irradiances(&scene, &plan(&[depth_m]))
            .expect("valid")[0];
        // 2π L ∫ μ^p exp(-a z/μ) dμ by midpoints.
        let integral = |k: usize, power: i32| {
            const N: usize = 100_000;
            let mu = |i: usize| (i as f64 + 0.5) / N as f64;
            let term = |mu: f64| mu.powi(power) * (-a[k] * depth_m / mu).exp();
            2.0 * PI * scene.sky_radiance[k] * (0..N).map(|i| term(mu(i))).sum::<f64>() / N as f64
        };
        assert_near(backend, &row.e_d, [0, 1, 2].map(|k| integral(k, 1)), "E_d");
        assert_near(
            backend,
            &row.e_od,
            [0, 1, 2].map(|k| integral(k, 0)),
            "E_od",
        );
        for dark in [row.e_u, row.e_ou, row.l_u] {
            assert_eq!(dark, Estimate::default());
        }
    });
}

#[test]
fn a_lamp_and_its_reflection_add_their_unscattered_light_exactly() {
    everywhere(|backend| {
        let a = [0.1, 0.2, 0.4];
        let mut scene = under_surface(a, [0.0; 3], true);
        let lamp = DVec3::new(0.6, -0.3, -2.0);
        scene.lamps.push(point_lamp(lamp, 4.0));
        scene.lamps[0].level_pct = 50.0;
        let row = backend.irradiances(&scene, &plan(&[1.2])).expect("valid")[0];
        let point = DVec3::new(0.0, 0.0, -1.2);
        let image = DVec3::new(lamp.x, lamp.y, -lamp.z);
        let light = |source: DVec3| {
            let way = source - point;
            let cosine = way.normalize().z.abs();
            (
                cosine,
                a.map(|a| 2.0 * (-a * way.length()).exp() / way.length_squared()),
            )
        };
        // The lamp lies below the sensor, its image above it.
        let (cosine, direct) = light(lamp);
        assert_near(backend, &row.e_u, direct.map(|e| e * cosine), "E_u");
        assert_near(backend, &row.e_ou, direct, "E_ou");
        let (cosine, reflected) = light(image);
        let reflected = reflected.map(|e| e * fresnel_reflectance(cosine, INDEX, 1.0));
        assert_near(backend, &row.e_d, reflected.map(|e| e * cosine), "E_d");
        assert_near(backend, &row.e_od, reflected, "E_od");
    });
}

#[test]
fn a_plate_shadows_the_sun_and_reflects_it() {
    everywhere(|backend| {
        let mut scene = under_surface([0.2; 3], [0.0; 3], true);
        scene.sun = Some(sun(60.0, SUN));
        let lit = backend.irradiances(&scene, &plan(&[1.0])).expect("valid")[0];
        let mu = (1.0 - (60f64.to_radians().sin() / INDEX).powi(2)).sqrt();
        let entering = 0.5 * (1.0 - fresnel_reflectance(0.5, 1.0, INDEX));
        let below = |e: f64| e * entering * (-0.2 / mu).exp();
        assert_near(backend, &lit.e_d, [1.0, 2.0, 3.0].map(below), "E_d");
        assert_near(
            backend,
            &lit.e_od,
            [1.0, 2.0, 3.0].map(|e| below(e) / mu),
            "E_od",
        );
        let reflectance = 0.5;
        add_plate(
            &mut scene,
            DVec3::new(0.0, 0.0, -0.5),
            DVec3::Z,
            400.0,
            [reflectance; 3],
        );
        let around = backend
            .irradiances(&scene, &plan(&[0.4, 1.0]))
            .expect("valid");
        assert_eq!(around[1].e_d.value, [0.0; 3], "below the plate");
        // What goes up from a Lambertian plate, attenuated on the way straight up, without what comes back to it
        // from the surface: less than 3 % of it inside Snell's window, all of it outside, seen at other backends.
        let at_plate = |e: f64| e * entering * (-0.2 * 0.5 / mu).exp();
        let least = [1.0, 2.0, 3.0].map(|e| reflectance / PI * at_plate(e) * (-0.2f64 * 0.1).exp());
        for k in 0..3 {
            let seen = around[0].l_u.value[k];
            assert!(
                seen > least[k] && seen < 1.5 * least[k],
                "{seen} {}",
                least[k]
            );
        }
    });
}

/// Sky, sun, a Lambertian bottom and a scattering water body at once, against discrete ordinates.
#[test]
fn a_lambertian_bottom_under_sun_and_sky_is_that_of_discrete_ordinates() {
    everywhere(|backend| {
        let (a, b) = ([0.2, 0.5, 0.8], [0.8, 0.5, 0.2]);
        let reflectance = [0.3, 0.6, 0.9];
        let depths_m = [0.0, 1.0, 1.9];
        let mut scene = under_surface(a, b, true);
        scene.sun = Some(sun(30.0, SUN));
        scene.sky_radiance = [0.3, 0.2, 0.1];
        add_plate(
            &mut scene,
            DVec3::new(0.0, 0.0, -2.0),
            DVec3::Z,
            400.0,
            reflectance,
        );
        let mut plan = plan(&depths_m);
        plan.samples = backend.samples(1 << 16);
        let measured = backend.irradiances(&scene, &plan).expect("valid");
        let phase = &scene.water.as_ref().expect("water").phase;
        let mut z = Vec::new();
        for k in 0..3 {
            let problem = Problem {
                sun_zenith_deg: 30.0,
                sun_irradiance: SUN[k],
                sky_radiance: scene.sky_radiance[k],
                bottom: Some((2.0, reflectance[k])),
                ..Problem::benchmark(phase, b[k])
            };
            for (row, solved) in measured.iter().zip(irradiances(&problem, &depths_m, 32)) {
                for (name, estimate) in row.quantities() {
                    let (value, error) = (estimate.value[k], estimate.standard_error[k]);
                    let expected = solved.quantity(name);
                    println!(
                        "{name} at {} m, {k}: {value:.5} ± {error:.5}, {expected:.5}",
                        row.depth_m
                    );
                    assert!(
                        error < 0.02 * backend.noise() * expected,
                        "{name}: error {error} of {expected}"
                    );
                    // Discrete ordinates are good to 1e-4 here, but for the one direction of L_u.
                    let own = if name == "L_u" { 2e-3 } else { 2e-4 } * expected;
                    z.push((value - expected) / error.hypot(own));
                }
            }
        }
        let (rms, largest) = uw_tests::tiles::spread(&z);
        println!("{} values, rms z {rms:.2}, largest {largest:.2}", z.len());
        assert!(largest < 4.5 && rms < 1.0 + 4.0 / 18f64.sqrt());
    });
}

#[test]
fn the_number_of_threads_changes_nothing() {
    everywhere(|backend| {
        let mut scene = under_surface([0.1; 3], [0.4, 0.9, 0.2], true);
        scene.sun = Some(sun(40.0, SUN));
        scene
            .lamps
            .push(point_lamp(DVec3::new(0.5, 0.0, -1.0), 2.0));
        let mut plan = plan(&[0.0, 0.7]);
        plan.samples = 512;
        let [one, many] = [1, 5].map(|threads| {
            plan.threads = Some(threads);
            backend.irradiances(&scene, &plan).expect("valid")
        });
        assert_eq!(one, many);
        plan.seed += 1;
        assert_ne!(one, backend.irradiances(&scene, &plan).expect("valid"));
    });
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let scene = under_surface([0.1; 3], [0.0; 3], true);
    let refusal = |plan: &IrradiancePlan, scene: &Scene| {
        let refused = Backend::Double.irradiances(scene, plan);
        refused.expect_err("refused").to_string()
    };
    for depth in [-0.1, f64::NAN, f64::INFINITY] {
        let message = refusal(&plan(&[1.0, depth]), &scene);
        assert!(
            message.contains("depths must be finite and >= 0 m, got"),
            "{message}"
        );
    }
    assert!(refusal(&plan(&[]), &scene).contains("got 0"));
    let mut few = plan(&[1.0]);
    few.samples = 1;
    assert!(refusal(&few, &scene).contains("at least 2 samples"));
    let mut boundless = scene.clone();
    boundless.surface = None;
    assert!(refusal(&plan(&[1.0]), &boundless).contains("no water surface"));
    let cancelled = measure(
        &Device::Cpu,
        &Prepared::build(&scene),
        &plan(&[1.0]),
        &AtomicBool::new(true),
        &|_| {},
    );
    assert!(matches!(cancelled, Err(IrradianceError::Interrupted)));
}
