//! White furnaces to one part in a thousand: where everything that light meets gives back all of it, or makes up by
//! emission for what it takes, the radiance is the same everywhere. Energy that is made or lost anywhere shows.

use glam::DVec3;
use uw_media::phase::{FournierForand, Phase};
use uw_render::scene::Scene;
use uw_tests::single_ray::{add_plate, camera, empty, surface, water};
use uw_tests::{
    gpu::{Backend, everywhere},
    measure,
};

/// Largest departure from the furnace's radiance, relative.
const ENERGY_TOLERANCE: f64 = 1e-3;
/// Standard error to which every channel is measured, relative.
const STANDARD_ERROR: f64 = 3e-4;
/// Both on an adapter by what they are on the processor: a ninth of the samples.
const ON_ADAPTER: f64 = 3.0;
/// Samples of each of the camera's pixels between two looks at the error, on the vector units.
const SAMPLES_PER_ROUND: u32 = 2048;
/// Rounds of so many samples after which the estimates are too noisy to be of use: four times what they need.
const MOST_ROUNDS: u32 = 80;
/// Equal pixels of the camera.
const PIXELS: u32 = 256;

/// Renders `scene` until every channel is known to `STANDARD_ERROR` and compares it with the furnace's `radiance`.
fn assert_furnace(backend: Backend, what: &str, scene: &Scene, radiance: f64) {
    let allowed = match backend {
        Backend::Adapter => ON_ADAPTER,
        _ => 1.0,
    };
    // Where a round has fewer samples, there are as many more of them.
    let most_rounds = MOST_ROUNDS * (SAMPLES_PER_ROUND / backend.samples(SAMPLES_PER_ROUND));
    let (mut mean, mut variance) = ([0.0; 3], [0.0; 3]);
    for round in 1..=u64::from(most_rounds) {
        let (value, error) = measure(backend, scene, SAMPLES_PER_ROUND, 0, round);
        for k in 0..3 {
            mean[k] += value[k] / radiance;
            variance[k] += (error[k] / radiance).powi(2);
        }
        let n = round as f64;
        let errors = variance.map(|v| v.sqrt() / n);
        if errors.iter().all(|&e| e <= allowed * STANDARD_ERROR) {
            return assert_white(what, mean.map(|m| m / n - 1.0), errors, allowed);
        }
    }
    panic!("{what}: not within {STANDARD_ERROR} after {most_rounds} rounds");
}

/// `departures` from a radiance of 1 are small, `allowed` times the tolerance, and as small as the standard `errors` say.
fn assert_white(what: &str, departures: [f64; 3], errors: [f64; 3], allowed: f64) {
    println!("{what}: off by {departures:.6?} ± {errors:.6?}");
    for (departure, error) in departures.into_iter().zip(errors) {
        assert!(
            departure.abs() <= allowed * ENERGY_TOLERANCE && departure.abs() <= 4.0 * error,
            "{what}: off by {departure:.2e} ± {error:.2e}"
        );
    }
}

fn laws() -> [(&'static str, Phase); 2] {
    let peaked = FournierForand::new(1.10, 0.0183).expect("valid");
    [
        ("Fournier-Forand", Phase::FournierForand(peaked)),
        ("isotropic", Phase::Isotropic),
    ]
}

/// A closed unit cube of lossless water. Every wall emits what it does not reflect; the one in view differs from the
/// others in two channels, which a roulette shared with the third keeps from being noisy.
fn glowing_box(law: Phase) -> Scene {
    const REFLECTANCE_IN_VIEW: [f64; 3] = [0.3, 0.8, 0.8];
    const REFLECTANCE: [f64; 3] = [0.3, 0.1, 0.1];
    let camera = camera(
        DVec3::new(0.1, 0.2, -0.1),
        DVec3::new(0.5, 0.6, -0.4),
        PIXELS,
    );
    let mut scene = empty(camera);
    scene.water = Some(water([0.0; 3], [0.3; 3], law));
    for inwards in [
        DVec3::X,
        -DVec3::X,
        DVec3::Y,
        -DVec3::Y,
        DVec3::Z,
        -DVec3::Z,
    ] {
        let reflectance = if inwards == -DVec3::Y {
            REFLECTANCE_IN_VIEW
        } else {
            REFLECTANCE
        };
        add_plate(&mut scene, -0.5 * inwards, inwards, 0.5, reflectance);
    }
    for material in &mut scene.materials {
        material.emission = material.reflectance.map(|r| 1.0 - r);
    }
    scene
}

#[test]
fn glowing_walls_around_lossless_water_are_seen_as_white() {
    everywhere(|backend| {
        for (name, law) in laws() {
            assert_furnace(backend, &format!("box, {name}"), &glowing_box(law), 1.0);
        }
    });
}

#[test]
fn lossless_water_over_a_white_bottom_holds_the_squared_index_of_the_sky() {
    everywhere(half_space_under_a_sky);
}

fn half_space_under_a_sky(backend: Backend) {
    // The isotropic water is clearer, because at b = 1 1/m it takes five times as long to measure.
    for ((name, law), b) in laws().into_iter().zip([1.0, 0.3]) {
        let camera = camera(
            DVec3::new(0.0, 0.0, -0.25),
            DVec3::new(0.1, 0.0, 1.0),
            PIXELS,
        );
        let mut scene = empty(camera);
        scene.water = Some(water([0.0; 3], [b; 3], law));
        scene.surface = Some(surface(true));
        scene.sky_radiance = [1.0; 3];
        let bottom = DVec3::new(0.0, 0.0, -0.5);
        add_plate(&mut scene, bottom, DVec3::Z, 1e5, [1.0; 3]);
        let index = scene.water.as_ref().expect("water").refractive_index;
        assert_furnace(
            backend,
            &format!("half space, {name}"),
            &scene,
            index * index,
        );
    }
}
