//! Rays leave surfaces without leaking through them or shadowing themselves, from millimetres to kilometres and far
//! from the origin.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use uw_render::{
    film::FilmLayer,
    scene::{Camera, Material, Mesh, Scene, Sun},
};
use uw_tests::single_ray::empty;
use uw_tests::{plan, render};

/// Edges of the scene, m, and distances from the origin in edges. Beyond 1e6 edges a single-precision tree cannot
/// tell the walls apart.
const SCALES_M: [f64; 5] = [1e-3, 0.1, 1.0, 100.0, 1e4];
const OFFSETS: [f64; 2] = [0.0, 1e3];

fn camera(position: DVec3) -> Camera {
    let forward = DVec3::new(0.8, 0.36, 0.48);
    let (right, down) = forward.any_orthonormal_pair();
    Camera {
        position_m: position,
        forward,
        right,
        down,
        width: 24,
        height: 24,
        focal_px: DVec2::splat(8.0),
        centre_px: DVec2::splat(12.0),
        distortion: [0.0; 5],
    }
}

fn material(reflectance: f64) -> Material {
    Material {
        reflectance: [reflectance; 3],
        texture: None,
        emission: [0.0; 3],
    }
}

/// A closed cube of twelve triangles around `centre`.
fn cube(centre: DVec3, edge: f64) -> Mesh {
    let corner = |i: usize| {
        let side = |bit: usize| if i & bit == 0 { -0.5 } else { 0.5 };
        centre + edge * DVec3::new(side(1), side(2), side(4))
    };
    let faces = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    Mesh {
        positions: (0..8).map(corner).collect(),
        normals: Vec::new(),
        uvs: Vec::new(),
        triangles: faces
            .iter()
            .flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]])
            .collect(),
        material: 0,
    }
}

#[test]
fn no_light_leaks_into_a_closed_cube() {
    for scale in SCALES_M {
        for offset in OFFSETS {
            let centre = scale * offset * DVec3::new(1.0, -1.0, 0.7);
            let mut scene: Scene = empty(camera(centre + scale * DVec3::new(0.1, 0.2, -0.05)));
            scene.sky_radiance = [1.0; 3];
            scene.materials.push(material(0.9));
            scene.meshes.push(cube(centre, scale));
            let (film, _) = render(&scene, &plan(64, 4));
            let light: f64 = film.layer(FilmLayer::Total).iter().map(|p| p[0]).sum();
            assert!(light == 0.0, "cube of {scale} m at {offset} edges: {light}");
        }
    }
}

#[test]
fn nothing_shadows_itself_under_a_low_sun() {
    for scale in SCALES_M {
        for offset in OFFSETS {
            // The top of the cube, seen from above, under a sun one degree above its plane.
            let centre = scale * offset * DVec3::new(1.0, -1.0, 0.7);
            let mut scene = empty(camera(centre + scale * DVec3::new(0.0, 0.0, 0.6)));
            scene.camera.forward = -DVec3::Z;
            scene.camera.right = DVec3::X;
            scene.camera.down = -DVec3::Y;
            scene.camera.focal_px = DVec2::splat(24.0);
            scene.materials.push(material(0.5));
            scene.meshes.push(cube(centre, scale));
            let low = 1f64.to_radians();
            scene.sun = Some(Sun {
                travel_direction: DVec3::new(low.cos(), 0.0, -low.sin()),
                irradiance: [1.0; 3],
            });
            let (film, _) = render(&scene, &plan(16, 4));
            let expected = 0.5 / PI * low.sin();
            for pixel in film.layer(FilmLayer::Total) {
                assert!(
                    (pixel[0] / expected - 1.0).abs() < 1e-3,
                    "cube of {scale} m at {offset} edges: {} instead of {expected}",
                    pixel[0]
                );
            }
        }
    }
}
