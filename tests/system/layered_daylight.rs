//! Daylight in layered water against discrete ordinates: another solver's rows, and waters of which there are none.

use uw_media::phase::{FournierForand, Phase, Tabulated};
use uw_render::irradiance::{DepthIrradiance, IrradiancePlan};
use uw_render::scene::{Layer, Scene};
use uw_tests::discrete_ordinates::{Level, Problem, Travel, Water, irradiances, radiances};
use uw_tests::gpu::{Backend, everywhere};
use uw_tests::measure;
use uw_tests::reference::{LayeredCase, layered_irradiances};
use uw_tests::single_ray::{camera_against, empty, layer, sun, surface, vary, water};

use crate::agreement::{assert_agreement, compare, compare_radiance};

/// Optical depth of the slices of discrete ordinates: half of it changes E_ou by up to 1.4e-4, the rest by less than 3e-5.
const SLICE: f64 = 0.05;
const SKY_RADIANCE: f64 = 0.2;
const STRAIGHT_UP: Travel = Travel {
    down: -1.0,
    azimuth_deg: 0.0,
};

/// Layered water under a flat surface and the sun.
fn lit(phase: Phase, layers: Vec<Layer>, sun_zenith_deg: f64) -> Scene {
    let mut scene = empty(camera_against(1.0, STRAIGHT_UP, 64));
    scene.water = Some(water([0.0; 3], [0.0; 3], phase));
    vary(&mut scene, layers, Vec::new());
    scene.surface = Some(surface(true));
    scene.sun = Some(sun(sun_zenith_deg, [1.0; 3]));
    scene
}

/// Directions per depth and hemisphere: the program's default on the vector units. The others take the same random numbers, and half
/// of them, for fewer tell no standard error: rare walks carry much of the light from beyond a layer. (With a quarter E_d at 2.5 m of
/// the gradients' third channel was once off by 3.6 of the errors told; twelve other seeds were not by more than 1.8, and a million
/// directions by -0.4.)
fn samples(backend: Backend) -> u32 {
    match backend {
        Backend::VectorUnits => 1 << 16,
        Backend::Double | Backend::Adapter => 1 << 15,
    }
}

fn sensors(backend: Backend, scene: &Scene, depths_m: &[f64]) -> Vec<DepthIrradiance> {
    let plan = IrradiancePlan {
        depths_m: depths_m.to_vec(),
        samples: samples(backend),
        seed: 11,
        threads: None,
        max_bounces: 0,
    };
    backend.irradiances(scene, &plan).expect("measured")
}

#[test]
fn irradiances_in_layers_are_the_reference_rows() {
    let cases = layered_irradiances();
    everywhere(|backend| {
        for case in &cases {
            irradiances_are_the_rows(backend, case);
        }
    });
}

fn irradiances_are_the_rows(backend: Backend, case: &LayeredCase) {
    let layers = case.levels.iter();
    let layers = layers.map(|level| layer(level.depth_m, [level.a; 3], [level.b; 3]));
    let scene = lit(case.phase.clone(), layers.collect(), case.sun_zenith_deg);
    let depths_m = case.depths_m();
    let measured = sensors(backend, &scene, &depths_m);
    let comparisons = compare(&measured, 1, &case.name, |level, name| {
        Some(case.row(depths_m[level], name)?.reference)
    });
    assert_eq!(comparisons.len(), case.rows.len());
    assert_agreement(&comparisons, 3 * depths_m.len());
}

/// Clear water with half a metre of turbid water in it.
fn turbid_layer() -> Scene {
    let clear = ([0.10, 0.05, 0.08], [0.1, 0.15, 0.2]);
    let turbid = ([0.20, 0.10, 0.10], [1.5, 1.0, 0.6]);
    let layers = vec![
        layer(4.0, clear.0, clear.1),
        layer(4.0, turbid.0, turbid.1),
        layer(4.5, turbid.0, turbid.1),
        layer(4.5, clear.0, clear.1),
    ];
    let particles = FournierForand::new(1.10, 0.0183).expect("valid");
    lit(Phase::FournierForand(particles), layers, 30.0)
}

/// Straight lines all the way, up and down, other ones in each channel. (Channels share walks: where one scatters ten
/// times as much as another, rare walks carry much of the latter's light, and few samples tell no standard error.)
fn gradients() -> Scene {
    let layers = vec![
        layer(0.5, [0.10, 0.10, 0.05], [0.7, 0.4, 0.3]),
        layer(2.5, [0.05, 0.15, 0.10], [0.3, 0.4, 0.8]),
        layer(5.0, [0.15, 0.10, 0.10], [0.6, 0.3, 0.4]),
    ];
    lit(Phase::Tabulated(Tabulated::petzold()), layers, 30.0)
}

/// The problem of one channel of such a scene under a uniform sky.
fn problem(scene: &Scene, channel: usize) -> Problem<'_> {
    let water = scene.water.as_ref().expect("water");
    let layers = water.variation.layers.iter();
    let levels: Vec<Level> = layers
        .map(|layer| Level {
            depth_m: layer.depth_m,
            a: layer.iops.a[channel],
            b: layer.iops.b[channel],
        })
        .collect();
    Problem {
        water: Water::layered(&levels, SLICE),
        sun_zenith_deg: 30.0,
        sky_radiance: SKY_RADIANCE,
        ..Problem::benchmark(&water.phase, 0.0)
    }
}

#[test]
fn irradiances_under_sun_and_sky_are_those_of_discrete_ordinates() {
    for (what, mut scene, depths_m) in [
        ("turbid layer", turbid_layer(), [2.0, 4.25, 6.0]),
        ("gradients", gradients(), [1.0, 2.5, 4.0]),
    ] {
        scene.sky_radiance = [SKY_RADIANCE; 3];
        let solved = [0, 1, 2].map(|k| irradiances(&problem(&scene, k), &depths_m, 32));
        everywhere(|backend| {
            let measured = sensors(backend, &scene, &depths_m);
            let comparisons: Vec<_> = (0..3)
                .flat_map(|k| {
                    let what = format!("{what}, channel {k}");
                    compare(&measured, k, &what, |level, name| {
                        Some(solved[k][level].quantity(name))
                    })
                })
                .collect();
            // Hemispheres and one direction at each depth; quantities and channels share directions.
            assert_agreement(&comparisons, 3 * depths_m.len());
        });
    }
}

/// From above the turbid layer, from within and from below.
#[test]
fn radiances_around_a_turbid_layer_are_those_of_discrete_ordinates() {
    let mut scene = turbid_layer();
    scene.sky_radiance = [SKY_RADIANCE; 3];
    let directions = [(0.9, 120.0), (0.3, 60.0), (-0.3, 0.0), (-0.9, 180.0)]
        .map(|(down, azimuth_deg)| Travel { down, azimuth_deg });
    let depths_m = [3.5, 4.25, 5.0];
    let solved = radiances(&problem(&scene, 0), &depths_m, &directions, 24);
    everywhere(|backend| {
        let mut comparisons = Vec::new();
        for (&depth_m, level) in depths_m.iter().zip(&solved) {
            for (&travel, &reference) in directions.iter().zip(level) {
                let mut scene = scene.clone();
                scene.camera = camera_against(depth_m, travel, 64);
                let seen = measure(backend, &scene, 192, 0, 70 + comparisons.len() as u64);
                comparisons.push(compare_radiance(seen, 0, (depth_m, travel), reference));
            }
        }
        assert_agreement(&comparisons, comparisons.len());
    });
}
