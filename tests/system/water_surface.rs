//! Lamp light that reflects at the underside of the water surface.

use glam::DVec3;
use uw_media::interface::fresnel_reflectance;
use uw_media::phase::{FournierForand, Phase};
use uw_render::scene::{Scene, Water};
use uw_tests::single_ray::{add_plate, camera, empty, point_lamp, surface, water};
use uw_tests::{
    gpu::{Backend, everywhere},
    measure,
};

const INDEX: f64 = 1.34;

/// A plate at x = 2 m, from 3 m deep up to the surface, seen along a ray that rises towards it.
fn scene(medium: Water, top_m: f64) -> Scene {
    let mut scene = empty(camera(
        DVec3::new(0.0, 0.0, -0.5),
        DVec3::new(1.0, 0.1, 0.12),
        300,
    ));
    scene.water = Some(medium);
    add_plate(
        &mut scene,
        DVec3::new(2.0, 0.0, 0.0),
        -DVec3::X,
        1.0,
        [0.6, 0.5, 0.4],
    );
    let quad = &mut scene.quads[0];
    quad.half_u = DVec3::new(0.0, 4.0, 0.0);
    quad.half_v = DVec3::new(0.0, 0.0, 0.5 * (top_m + 3.0));
    quad.centre_m.z = 0.5 * (top_m - 3.0);
    scene
}

#[test]
fn a_plate_in_absorbing_water_is_lit_by_the_lamp_and_its_reflection() {
    let a = [0.3, 0.1, 0.05];
    let mut scene = scene(water(a, [0.0; 3], Phase::Isotropic), 0.0);
    scene.surface = Some(surface(true));
    let lamp = DVec3::new(0.2, -0.4, -0.3);
    scene.lamps.push(point_lamp(lamp, 5.0));
    let direction = scene.camera.forward;
    let range = 2.0 / direction.x;
    let point = scene.camera.position_m + range * direction;
    let image = DVec3::new(lamp.x, lamp.y, -lamp.z);
    let expected: [f64; 3] = std::array::from_fn(|k| {
        let light = |source: DVec3, factor: f64| {
            let way = source - point;
            let r = way.length();
            factor * 5.0 * (-way.x / r) / (r * r) * (-a[k] * r).exp()
        };
        let cosine = (image - point).normalize().z;
        let irradiance = light(lamp, 1.0) + light(image, fresnel_reflectance(cosine, INDEX, 1.0));
        let reflectance = [0.6, 0.5, 0.4][k];
        reflectance / std::f64::consts::PI * irradiance * (-a[k] * range).exp()
    });
    everywhere(|backend| {
        let (mean, error) = measure(backend, &scene, 64, 1, 3);
        for k in 0..3 {
            // The lamp or its image is drawn, so that there is some noise.
            assert!(error[k] < 0.01 * backend.noise() * expected[k]);
            let z = (mean[k] - expected[k]) / error[k];
            println!("channel {k}: {} ± {}, z {z:.2}", mean[k], error[k]);
            assert!(z.abs() < 4.5, "channel {k}: z {z}");
        }
    });
}

/// Under a surface that reflects everything the scene looks like one without a surface, in which lamp and plate
/// are there twice, mirrored at the plane. Multiple scattering, the veil included.
#[test]
fn a_perfect_mirror_is_a_mirrored_scene() {
    let phase = || Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"));
    let medium = || water([0.2, 0.1, 0.15], [0.8, 1.0, 0.5], phase());
    let lamp = DVec3::new(0.2, -0.4, -0.3);
    let mut mirror = scene(medium(), 0.0);
    mirror.surface = Some(surface(true));
    if let Some(water) = &mut mirror.water {
        // Total reflection from 1e-6 rad off the vertical.
        water.refractive_index = 1e6;
    }
    mirror.lamps.push(point_lamp(lamp, 5.0));
    let mut doubled = scene(medium(), 3.0);
    doubled.lamps.push(point_lamp(lamp, 5.0));
    doubled
        .lamps
        .push(point_lamp(DVec3::new(lamp.x, lamp.y, -lamp.z), 5.0));
    doubled.lamps[1].name = "image".into();
    everywhere(|backend| assert_same(backend, &mirror, &doubled));
}

fn assert_same(backend: Backend, mirror: &Scene, doubled: &Scene) {
    let (one, one_error) = measure(backend, mirror, 256, 0, 21);
    let (two, two_error) = measure(backend, doubled, 256, 0, 22);
    for k in 0..3 {
        let error = one_error[k].hypot(two_error[k]);
        println!("channel {k}: {} and {} ± {error}", one[k], two[k]);
        assert!(
            error < 0.01 * backend.noise() * two[k],
            "channel {k}: error {error} of {}",
            two[k]
        );
        assert!(
            ((one[k] - two[k]) / error).abs() < 4.5,
            "channel {k}: {} {} ± {error}",
            one[k],
            two[k]
        );
    }
}
