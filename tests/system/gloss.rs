//! Surfaces that shine: white ones lose nothing, lamps are reflected as the formula says, normals are those of their map.
//! In scattering water they are in the validator's corpus.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use uw_media::phase::Phase;
use uw_render::{
    film::FilmLayer,
    scene::{Gloss, Material, Mesh, NormalMap, Scene, Texture, TextureFilter},
};
use uw_tests::{
    gpu::everywhere,
    measure, plan,
    single_ray::{add_plate, camera, empty, point_lamp, water},
};

/// Equal pixels of the camera.
const PIXELS: u32 = 64;
/// What a white surface may lose or gain: nodes of tables lie this far apart.
const ENERGY_TOLERANCE: f64 = 0.01;

fn glossy(scene: &mut Scene, roughness: f64, metallic: f64, index: f64) {
    let material = scene.materials.last_mut().expect("a plate");
    material.gloss = Some(Gloss {
        roughness,
        metallic,
        index,
        texture: None,
    });
}

/// A plate at the origin that faces +z, seen under an angle.
fn plate(view_deg: f64, reflectance: [f64; 3]) -> Scene {
    let (sin, cos) = view_deg.to_radians().sin_cos();
    let towards = DVec3::new(sin, 0.0, cos);
    let mut scene = empty(camera(towards, -towards, PIXELS));
    add_plate(&mut scene, DVec3::ZERO, DVec3::Z, 1e3, reflectance);
    scene
}

/// Below the least roughness a metal is a mirror but for a blur of some tenths of a degree: it shows bright squares as a camera in its mirror
/// image sees them, in water that absorbs. Pixels within 2 % of the squares' light, but for those that an edge goes through.
#[test]
fn a_polished_metal_is_a_mirror() {
    const SIZE: u32 = 32;
    let (middle, normal) = (DVec3::X, DVec3::new(-1.0, 1.0, 0.0).normalize());
    let mut squares = empty(camera(DVec3::ZERO, DVec3::X, SIZE));
    squares.camera.height = SIZE;
    squares.camera.focal_px = DVec2::splat(48.0);
    squares.camera.centre_px = DVec2::splat(16.0);
    squares.water = Some(water([0.3, 0.1, 0.2], [0.0; 3], Phase::Isotropic));
    for (x, z, half_m) in [(1.1, 0.1, 0.15), (0.7, -0.3, 0.2), (1.4, -0.2, 0.1)] {
        let centre = DVec3::new(x, 1.2, z);
        add_plate(&mut squares, centre, DVec3::NEG_Y, half_m, [0.0; 3]);
        squares.materials.last_mut().expect("a plate").emission = [3.0, 2.0, 1.0];
    }
    let mut mirrored = squares.clone();
    add_plate(&mut mirrored, middle, normal, 2.0, [1.0; 3]);
    glossy(&mut mirrored, 0.0, 1.0, 1.5);
    let turned = |v: DVec3| v - 2.0 * v.dot(normal) * normal;
    let eye = &mut squares.camera;
    eye.position_m = middle + turned(eye.position_m - middle);
    (eye.forward, eye.right, eye.down) = (turned(eye.forward), turned(eye.right), turned(eye.down));
    everywhere(|backend| {
        let light = |scene: &Scene| {
            backend
                .render(scene, &plan(256, 4))
                .0
                .layer(FilmLayer::Total)
        };
        let (direct, seen) = (light(&squares), light(&mirrored));
        let at = |x: usize, y: usize| direct[y * SIZE as usize + x][0];
        let (mut even, mut bright) = (0, 0);
        for (y, x) in
            (1..SIZE as usize - 1).flat_map(|y| (1..SIZE as usize - 1).map(move |x| (y, x)))
        {
            let around = [
                at(x - 1, y),
                at(x + 1, y),
                at(x, y - 1),
                at(x, y + 1),
                at(x, y),
            ];
            let (least, most) = around
                .iter()
                .fold((f64::MAX, 0.0_f64), |(l, m), &v| (l.min(v), m.max(v)));
            if most - least < 0.05 {
                let off = (seen[y * SIZE as usize + x][0] - at(x, y)).abs();
                assert!(off < 0.05, "({x}, {y}): {off} off {}", at(x, y));
                even += 1;
                bright += usize::from(at(x, y) > 1.0);
            }
        }
        println!("{even} even pixels, {bright} of them bright");
        assert!(even > 500 && bright > 30, "{even} {bright}");
    });
}

/// White metals and white varnish under an even sky are as bright as that, from a polished surface to the roughest.
#[test]
fn white_surfaces_lose_nothing_of_an_even_sky() {
    everywhere(|backend| {
        for (metallic, index) in [(1.0, 1.5), (0.0, 1.5), (0.0, 2.4), (0.5, 1.5)] {
            for roughness in [0.05, 0.2, 0.45, 0.7, 1.0] {
                for view_deg in [0.0, 45.0, 75.0] {
                    let mut scene = plate(view_deg, [1.0; 3]);
                    glossy(&mut scene, roughness, metallic, index);
                    scene.sky_radiance = [1.0; 3];
                    let (mean, error) = measure(backend, &scene, 2048, 0, 1);
                    let what = format!(
                        "metallic {metallic}, index {index}, roughness {roughness}, {view_deg}°"
                    );
                    assert!(
                        error[0] < 0.4 * ENERGY_TOLERANCE,
                        "{what}: noisy, {error:?}"
                    );
                    assert!(
                        (mean[0] - 1.0).abs() < ENERGY_TOLERANCE,
                        "{what}: {mean:?} ± {error:?}"
                    );
                }
            }
        }
    });
}

/// Radiance by the formulas of GGX (Walter et al. 2007), height-correlated masking (Heitz 2014) and Schlick, without what is
/// reflected more than once.
fn formula(alpha: f64, reflectance: f64, view: DVec3, light: DVec3) -> f64 {
    let half = (view + light).normalize();
    let d = {
        let c2 = half.z * half.z;
        alpha * alpha / (PI * (c2 * (alpha * alpha - 1.0) + 1.0).powi(2))
    };
    let lambda = |c: f64| 0.5 * ((1.0 + alpha * alpha * (1.0 / (c * c) - 1.0)).sqrt() - 1.0);
    let g = 1.0 / (1.0 + lambda(view.z) + lambda(light.z));
    let f = reflectance + (1.0 - reflectance) * (1.0 - half.dot(light)).powi(5);
    d * g * f / (4.0 * view.z)
}

/// Metals that are not rough have the facets' light alone, or nearly so.
#[test]
fn a_lamp_is_reflected_as_the_formula_says() {
    let index: f64 = 1.5;
    everywhere(|backend| {
        for (roughness, light_deg) in [(0.05, -41.0), (0.1, -38.0), (0.3, -30.0), (0.3, 60.0)] {
            let mut scene = plate(40.0, [0.9, 0.5, 0.0]);
            glossy(&mut scene, roughness, 1.0, index);
            let (sin, cos) = f64::to_radians(light_deg).sin_cos();
            let light = DVec3::new(sin, 0.0, cos);
            scene.lamps.push(point_lamp(2.0 * light, 3.0));
            let view = -scene.camera.forward;
            let (mean, _) = measure(backend, &scene, 4, 0, 1);
            for (k, reflectance) in [0.9, 0.5, 0.0].into_iter().enumerate() {
                // Irradiance across the beam is 3 W/sr over 4 m².
                let expected = 0.75 * formula(roughness * roughness, reflectance, view, light);
                // What is reflected more than once is below 1.5 % of what a matt surface sends on: the facets keep 1 to 2 % for it.
                let more = 0.015 * 0.75 * light.z / PI;
                let rounding = 1e-3 * expected;
                assert!(
                    mean[k] > expected - rounding && mean[k] < expected + more + rounding,
                    "roughness {roughness}, {light_deg}°, channel {k}: {} {expected}",
                    mean[k]
                );
            }
        }
    });
}

/// In water a dielectric of index 1.5 reflects 0.3 % where it reflects 4 % in the air.
#[test]
fn varnish_is_nearly_gone_in_water() {
    everywhere(|backend| {
        let mut peaks = [0.0; 2];
        for (peak, wet) in peaks.iter_mut().zip([false, true]) {
            let mut scene = plate(20.0, [0.0; 3]);
            glossy(&mut scene, 0.3, 0.0, 1.5);
            scene.water = wet.then(|| water([0.0; 3], [0.0; 3], Phase::Isotropic));
            let (sin, cos) = f64::to_radians(-20.0).sin_cos();
            scene
                .lamps
                .push(point_lamp(2.0 * DVec3::new(sin, 0.0, cos), 3.0));
            *peak = measure(backend, &scene, 4, 0, 1).0[0];
        }
        let normal = |ratio: f64| ((ratio - 1.0) / (ratio + 1.0)).powi(2);
        let expected = normal(1.5 / 1.34) / normal(1.5);
        // At 20° Fresnel's reflectance is within 1 % of that at 0°.
        assert!(
            (peaks[1] / peaks[0] / expected - 1.0).abs() < 0.02,
            "{peaks:?} {expected}"
        );
    });
}

/// Two triangles at z = 0 that face +z, whose texture runs to the right along `right`, seen from above by a pixel.
fn mapped(right: DVec3, texel: [f32; 3], mirrored: bool) -> Scene {
    let mut scene = empty(camera(DVec3::new(0.1, 0.2, 1.0), -DVec3::Z, PIXELS));
    let up = DVec3::Z.cross(right);
    let corners = [-right - up, right - up, right + up, -right + up];
    let across = |u: f32| if mirrored { 1.0 - u } else { u };
    scene.textures.push(Texture {
        width: 1,
        height: 1,
        texels: vec![texel].into(),
        filter: TextureFilter::Nearest,
    });
    scene.materials.push(Material {
        reflectance: [0.8; 3],
        normal_map: Some(NormalMap {
            texture: 0,
            scale: 1.0,
        }),
        ..Material::default()
    });
    scene.meshes.push(Mesh {
        positions: corners.to_vec(),
        uvs: vec![
            [across(0.0), 1.0],
            [across(1.0), 1.0],
            [across(1.0), 0.0],
            [across(0.0), 0.0],
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: 0,
        ..Mesh::default()
    });
    scene
        .lamps
        .push(point_lamp(DVec3::new(3.0, 4.0, 12.0), 100.0));
    scene
}

/// A matt surface shows the cosine between lamp and mapped normal.
#[test]
fn normals_are_those_of_their_map() {
    let own = DVec3::new(0.48, -0.36, 0.8);
    let texel = (0.5 * (own + 1.0)).as_vec3().to_array();
    everywhere(|backend| {
        for (turn_deg, mirrored) in [(0.0, false), (130.0, false), (0.0, true)] {
            let turn = DVec2::from_angle(f64::to_radians(turn_deg));
            let right = DVec3::new(turn.x, turn.y, 0.0);
            let scene = mapped(right, texel, mirrored);
            let side = if mirrored { -1.0 } else { 1.0 };
            let normal = side * own.x * right + own.y * DVec3::Z.cross(right) + own.z * DVec3::Z;
            let offset = DVec3::new(3.0, 4.0, 12.0) - DVec3::new(0.1, 0.2, 0.0);
            let cosine = normal.dot(offset.normalize());
            let expected = 100.0 / offset.length_squared() * cosine * 0.8 / PI;
            let (mean, _) = measure(backend, &scene, 4, 0, 1);
            assert!(
                (mean[0] / expected - 1.0).abs() < 2e-5,
                "{turn_deg}°, mirrored {mirrored}: {} {expected}",
                mean[0]
            );
        }
    });
}

/// What a texture leaves of emission, roughness and metallic is what it says, on every backend.
#[test]
fn textures_of_emission_and_gloss_are_factors() {
    everywhere(|backend| {
        let mut scene = mapped(DVec3::X, [0.5, 0.25, 0.75], false);
        let material = &mut scene.materials[0];
        material.normal_map = None;
        material.emission = [2.0, 4.0, 8.0];
        material.emission_texture = Some(0);
        material.gloss = Some(Gloss {
            roughness: 1.0,
            metallic: 1.0,
            index: 1.5,
            texture: Some(0),
        });
        let film = backend.render(&scene, &plan(4, 1)).0;
        let lit = film.layer(FilmLayer::Total)[0];
        let mut plain = scene.clone();
        let material = &mut plain.materials[0];
        material.emission = [1.0, 1.0, 6.0];
        material.emission_texture = None;
        material.gloss = Some(Gloss {
            roughness: 0.25,
            metallic: 0.75,
            index: 1.5,
            texture: None,
        });
        let expected = backend
            .render(&plain, &plan(4, 1))
            .0
            .layer(FilmLayer::Total)[0];
        for k in 0..3 {
            assert!(
                (lit[k] / expected[k] - 1.0).abs() < 1e-5,
                "{lit:?} {expected:?}"
            );
        }
        assert!(lit[2] > 6.0);
    });
}
