//! Daylight on a cloud of turbid water: sunlight scattered once by quadrature, and skylight scattered any number of times by
//! analogue walks with fictitious collisions, which know nothing of optical depths in closed form.

use glam::DVec3;
use uw_media::Iops;
use uw_media::phase::{FournierForand, HenyeyGreenstein, Phase, PhaseFunction, PhaseTable};
use uw_render::sampling::{
    Draws, MAX_BATCH,
    directions::{sin2_half, turn},
};
use uw_render::scene::{Plume, Scene};
use uw_tests::gpu::everywhere;
use uw_tests::measure;
use uw_tests::single_ray::{camera, empty, layer, sun, surface, vary, water};

/// Coefficients of the water around, 1/m.
const A: [f64; 3] = [0.05, 0.1, 0.2];
const B: [f64; 3] = [0.1, 0.05, 0.15];
const SKY_RADIANCE: f64 = 0.3;

fn cloud() -> Plume {
    Plume {
        centre_m: DVec3::new(0.3, -0.1, -2.0),
        sigma_m: 0.4,
        iops: Iops {
            a: [0.3, 0.1, 0.2],
            b: [1.5, 2.5, 1.0],
        },
    }
}

/// A view along `direction` from `origin` under a surface that does not refract.
fn view(origin: DVec3, direction: DVec3, phase: Phase) -> Scene {
    let mut scene = empty(camera(origin, direction, 64));
    scene.water = Some(water(A, B, phase));
    scene.surface = Some(surface(false));
    vary(&mut scene, vec![layer(0.0, A, B)], vec![cloud()]);
    scene
}

/// Coefficients at a point, 1/m.
fn iops_at(point: DVec3, k: usize) -> (f64, f64) {
    let cloud = cloud();
    let share = (-0.5 * (point - cloud.centre_m).length_squared() / cloud.sigma_m.powi(2)).exp();
    (
        A[k] + share * cloud.iops.a[k],
        B[k] + share * cloud.iops.b[k],
    )
}

/// Optical depth of a segment by the midpoint rule, which is exact to 1e-9 for a Gaussian at this step.
fn optical_depth(from: DVec3, direction: DVec3, length_m: f64, k: usize) -> f64 {
    let steps = (length_m / 0.05).ceil().max(1.0);
    let step = length_m / steps;
    (0..steps as usize)
        .map(|i| {
            let (a, b) = iops_at(from + (i as f64 + 0.5) * step * direction, k);
            (a + b) * step
        })
        .sum()
}

const VIEWS: [([f64; 3], [f64; 3]); 3] = [
    ([-1.5, 0.0, -2.0], [1.0, 0.0, 0.1]),
    ([0.2, 0.1, -3.5], [0.05, -0.1, 1.0]),
    ([0.3, 0.0, -2.1], [0.3, 1.0, -0.3]),
];

#[test]
fn sunlight_scattered_once_in_and_around_a_cloud_is_as_quadrature_says() {
    let phase = Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"));
    let light = sun(40.0, [1.0, 2.0, 3.0]);
    let towards = -light.travel_direction;
    everywhere(|backend| {
        for (origin, direction) in VIEWS {
            let (origin, direction) = (
                DVec3::from_array(origin),
                DVec3::from_array(direction).normalize(),
            );
            let mut scene = view(origin, direction, phase.clone());
            scene.sun = Some(light);
            let value = phase.value(sin2_half(direction, towards));
            let to_surface = match direction.z > 0.0 {
                true => -origin.z / direction.z,
                false => 60.0,
            };
            let expected: [f64; 3] = std::array::from_fn(|k| {
                let step = 0.02;
                let (mut before, mut sum, mut t) = (0.0, 0.0, 0.5 * step);
                while t < to_surface {
                    let point = origin + t * direction;
                    let (a, b) = iops_at(point, k);
                    let half = 0.5 * step * (a + b);
                    let down = optical_depth(point, towards, -point.z / towards.z, k);
                    sum += step * b * (-before - half - down).exp();
                    before += 2.0 * half;
                    t += step;
                }
                sum * value * light.irradiance[k]
            });
            let (mean, error) = measure(backend, &scene, 4096, 1, 9);
            for k in 0..3 {
                println!(
                    "{origin} {k}: {:.5e} ± {:.1e}, {:.5e}",
                    mean[k], error[k], expected[k]
                );
                assert!(
                    (mean[k] - expected[k]).abs() < 3.5 * error[k] + 2e-3 * expected[k],
                    "{origin}, channel {k}"
                );
                assert!(error[k] < 0.01 * backend.noise() * expected[k]);
            }
        }
    });
}

/// Radiance of skylight that comes against `direction` to `origin`, and its standard error.
fn skylight_by_walks(origin: DVec3, direction: DVec3, phase: &Phase, k: usize) -> (f64, f64) {
    const WALKS: u32 = 1 << 18;
    let table = PhaseTable::new(phase);
    let densest = A[k] + B[k] + cloud().iops.a[k] + cloud().iops.b[k];
    let mut arrived = 0u32;
    for walk in 0..WALKS {
        let mut draws = Draws::new(77, k as u32, walk / MAX_BATCH, walk % MAX_BATCH, 0);
        let (mut at, mut along) = (origin, direction);
        loop {
            at += -draws.uniform().ln() / densest * along;
            if at.z >= 0.0 {
                arrived += 1;
                break;
            }
            let (a, b) = iops_at(at, k);
            let number = draws.uniform() * densest;
            if number < a {
                break;
            }
            if number < a + b {
                along = turn(along, table.sample_x(draws.uniform()), draws.uniform());
            }
        }
    }
    let share = f64::from(arrived) / f64::from(WALKS);
    let error = (share * (1.0 - share) / f64::from(WALKS)).sqrt();
    (SKY_RADIANCE * share, SKY_RADIANCE * error)
}

#[test]
fn skylight_in_and_around_a_cloud_is_that_of_analogue_walks() {
    let phase = Phase::HenyeyGreenstein(HenyeyGreenstein::new(0.8).expect("valid"));
    let expected = VIEWS.map(|(origin, direction)| {
        let direction = DVec3::from_array(direction).normalize();
        [0, 1, 2].map(|k| skylight_by_walks(DVec3::from_array(origin), direction, &phase, k))
    });
    everywhere(|backend| {
        for ((origin, direction), expected) in VIEWS.into_iter().zip(&expected) {
            let (origin, direction) = (DVec3::from_array(origin), DVec3::from_array(direction));
            let mut scene = view(origin, direction, phase.clone());
            scene.sky_radiance = [SKY_RADIANCE; 3];
            let (mean, error) = measure(backend, &scene, 4096, 0, 9);
            for (k, &(value, its_error)) in expected.iter().enumerate() {
                println!(
                    "{origin} {k}: {:.5e} ± {:.1e}, {value:.5e} ± {its_error:.1e}",
                    mean[k], error[k]
                );
                assert!(
                    (mean[k] - value).abs() < 3.5 * error[k].hypot(its_error) + 2e-3 * value,
                    "{origin}, channel {k}"
                );
                assert!(error[k] < 0.02 * backend.noise() * value);
            }
        }
    });
}
