//! The camera, the water surface, and surfaces in it.

use glam::DVec2;

use super::{
    ROWS, SCENE, absolute, adapter, compare, direction_of, parsed, probe, scene, uniform_rows,
};
use crate::prepare::Primitive;

/// Rounding of the sum of three vectors.
#[test]
fn camera_rays_agree() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let inputs: Vec<_> = uniform_rows(11)
        .iter()
        .map(|r| {
            [
                f32::from_bits((64.0 * r[0]) as u32),
                f32::from_bits((64.0 * r[1]) as u32),
                r[2],
                r[3],
            ]
        })
        .collect();
    compare(gpu, &scene, 8, &inputs, [absolute(4e-7); 4], |r| {
        let at = |whole: f32, rest: f32| f64::from(whole.to_bits()) + f64::from(rest);
        let d = scene.camera.direction(at(r[0], r[2]), at(r[1], r[3]));
        [d.x, d.y, d.z, 0.0]
    });
}

/// Lenses, openings and ports of all kinds: directions, and where rays leave the port, m.
#[test]
fn camera_rays_agree_through_every_lens_and_port() {
    let Some(gpu) = adapter() else { return };
    let lenses = [
        "distortion = [-0.2, 0.05, 0.001, -0.002, 0.0]",
        "distortion = [0.62, 0.11, 0.0004, -0.0003, 0.006, 0.93, 0.21, 0.021]",
        "fisheye = [0.03, -0.01, 0.002, 0.0]",
    ];
    let ports = [
        "",
        "port = { kind = \"flat\", distance_m = 0.03, thickness_m = 0.012 }",
        "port = { kind = \"dome\", radius_m = 0.05, thickness_m = 0.006, offset_m = [0.004, -0.002, -0.012] }",
    ];
    let openings = ["", "aperture_mm = 30.0\nfocus_m = 0.8"];
    let inputs: Vec<_> = uniform_rows(12)
        .iter()
        .map(|r| [r[0], r[1]].map(|whole| f32::from_bits((64.0 * whole) as u32)))
        .zip(uniform_rows(13))
        .map(|(whole, rest)| [whole[0], whole[1], rest[2], rest[3]])
        .collect();
    let parts = lenses.iter().flat_map(|lens| {
        let of_port =
            move |port| openings.map(|opening| format!("{lens}\n{port}\n{opening}\nwidth"));
        ports.into_iter().flat_map(of_port)
    });
    for parts in parts {
        let text = SCENE.replacen("width", &parts, 1);
        let scene = parsed(&text);
        let ray = |r: [f32; 4]| {
            let at = |whole: f32, rest: f32| f64::from(whole.to_bits()) + f64::from(rest);
            let on_opening = 1.4 * DVec2::new(f64::from(r[3]), f64::from(r[2])) - 0.7;
            (scene.camera).ray_from(at(r[0], r[2]), at(r[1], r[3]), on_opening)
        };
        compare(gpu, &scene, 8, &inputs, [absolute(6e-7); 4], |r| {
            ray(r).direction.extend(0.0).to_array()
        });
        compare(gpu, &scene, 9, &inputs, [absolute(5e-8); 4], |r| {
            let left = ray(r).origin_m - scene.camera.position_m;
            left.extend(0.0).to_array()
        });
    }
}

/// Near the critical angle the refracted cosine is the root of a small difference: 3e-4 of error there, 2e-6 elsewhere.
#[test]
fn the_interface_reflects_and_refracts_alike() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let boundary = scene.boundary.expect("surface");
    let critical = (1.0 - boundary.index.powi(-2)).sqrt();
    let mut inputs = uniform_rows(5);
    inputs.retain(|r| (f64::from(r[0]) - critical).abs() > 1e-3);
    inputs.extend([
        [1.0, 0.3, 0.4, 0.0],
        [1e-4, 0.3, 0.4, 0.0],
        [0.999, 0.1, 0.9, 0.0],
    ]);
    compare(
        gpu,
        &scene,
        5,
        &inputs,
        [
            absolute(2e-5),
            absolute(2e-6),
            absolute(2e-6),
            absolute(2e-6),
        ],
        |r| {
            let cosine = f64::from(r[0]);
            let into = boundary.refract_into_water(direction_of(r[1], r[2]));
            [
                boundary.internal_reflectance(cosine),
                boundary.external_reflectance(cosine),
                into.z,
                into.x,
            ]
        },
    );
}

/// Rays within 1e-5 of an edge may fall to either side and are left out; distances are rounded to 1e-6 of themselves,
/// more at grazing incidence.
#[test]
fn rays_meet_the_same_surfaces() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let inputs = uniform_rows(6);
    let found = probe(gpu, &scene, 6, &inputs);
    let mut hits = 0;
    for (input, row) in inputs.iter().zip(found) {
        let d = direction_of(input[0], input[1]);
        let origin = scene.camera.position_m;
        let Some(hit) = scene
            .geometry
            .closest(origin, d, f64::INFINITY, Primitive::None)
        else {
            assert!(row[0] < 0.0 || row[0] > 2.0, "{input:?}: met at {}", row[0]);
            continue;
        };
        if hit.local.iter().any(|l| (l.abs() - 1.0).abs() < 1e-5) {
            continue;
        }
        hits += 1;
        let point = scene.geometry.surface_point(&hit, d);
        let grazing = d.dot(point.normal).abs();
        assert!(
            (f64::from(row[0]) / hit.t - 1.0).abs() < 2e-6 / grazing,
            "{input:?}: {} {}",
            row[0],
            hit.t
        );
        assert!((f64::from(row[1]) - point.shading_normal.x).abs() < 1e-6);
        assert!((f64::from(row[3]) - point.reflectance[1]).abs() < 1e-6);
    }
    assert!(hits > ROWS / 4, "{hits}");
}
