//! Rays leave surfaces without leaking through them or shadowing themselves, from millimetres to kilometres and far
//! from the origin.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use uw_render::{
    film::FilmLayer,
    scene::{Camera, Material, Mesh, Scene, Sun},
};
use uw_tests::single_ray::{add_plate, camera as ray_camera, empty};
use uw_tests::{plan, render};

/// Sizes of what stands in the scene, m.
const SCALES_M: [f64; 5] = [1e-3, 0.1, 1.0, 100.0, 1e4];
/// Distances from the origin in sizes.
const OFFSETS: [f64; 3] = [0.0, 1e3, 1e6];
/// Radiance that may leak into a cube under a sky of 1 at the greatest offset, where the least distance of a surface is
/// a few millionths of the edge: rays that leave so close to an edge of the cube miss the next wall.
const LEAK_FAR_AWAY: f64 = 1e-4;

/// Reflectance of what the sun shines on.
const REFLECTANCE: f64 = 0.5;

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
    at_every_place(|centre, size, place| {
        let mut scene: Scene = empty(camera(centre + size * DVec3::new(0.1, 0.2, -0.05)));
        scene.sky_radiance = [1.0; 3];
        scene.materials.push(material(0.9));
        scene.meshes.push(cube(centre, size));
        let (film, _) = render(&scene, &plan(64, 4));
        let allowed = if centre.length() > 1e5 * size {
            LEAK_FAR_AWAY
        } else {
            0.0
        };
        let radiance = film.mean()[0];
        assert!(radiance <= allowed, "cube of {place}: {radiance}");
    });
}

/// A picture of the top of what stands around `centre` from `height` edges above it, 0.6 edges wide and high, under a
/// sun `elevation_deg` above the horizon.
fn seen_from_above(centre: DVec3, edge: f64, height: f64, elevation_deg: f64) -> Scene {
    let mut view = camera(centre + edge * (0.5 + height) * DVec3::Z);
    view.forward = -DVec3::Z;
    view.right = DVec3::X;
    view.down = -DVec3::Y;
    view.focal_px = DVec2::splat(40.0 * height);
    let mut scene = empty(view);
    scene.materials.push(material(REFLECTANCE));
    let (sin, cos) = elevation_deg.to_radians().sin_cos();
    scene.sun = Some(Sun {
        travel_direction: DVec3::new(0.6 * cos, 0.8 * cos, -sin),
        irradiance: [1.0; 3],
    });
    scene
}

/// Every pixel shows a horizontal surface without a shadow.
fn assert_lit(scene: &Scene, what: &str) {
    let sun = scene.sun.as_ref().expect("a sun");
    let expected = REFLECTANCE / PI * -sun.travel_direction.z;
    let (film, _) = render(scene, &plan(4, 4));
    for pixel in film.layer(FilmLayer::Total) {
        assert!(
            (pixel[0] / expected - 1.0).abs() < 1e-9,
            "{what}: {} instead of {expected}",
            pixel[0]
        );
    }
}

/// Calls `check` for every scale and offset with the centre of the scene, its size in metres and what it is.
fn at_every_place(check: impl Fn(DVec3, f64, &str)) {
    for scale in SCALES_M {
        for offset in OFFSETS {
            let centre = scale * offset * DVec3::new(1.0, -1.0, 0.7);
            check(centre, scale, &format!("{scale} m at {offset} edges"));
        }
    }
}

/// Only because a ray skips the primitive it starts from: at this angle the rounding of its start is 1e-10 of the size.
#[test]
fn no_plate_or_triangle_shadows_itself_under_a_grazing_sun() {
    at_every_place(|centre, size, place| {
        let scene = || seen_from_above(centre, size, 1.0, 1e-4);
        let mut plate = scene();
        let top = centre + 0.5 * size * DVec3::Z;
        add_plate(&mut plate, top, DVec3::Z, 0.5 * size, [REFLECTANCE; 3]);
        assert_lit(&plate, &format!("plate of {place}"));
        let mut mesh = scene();
        mesh.meshes.push(cube(centre, size));
        assert_lit(&mesh, &format!("cube of {place}"));
    });
}

/// Only because rays have a least distance: surfaces in the same place do not know of each other.
#[test]
fn surfaces_in_one_place_do_not_shadow_each_other() {
    for distance in [1.0, 1e3] {
        at_every_place(|centre, size, place| {
            let mut scene = seen_from_above(centre, size, distance, 0.1);
            let top = centre + 0.5 * size * DVec3::Z;
            for _ in 0..2 {
                add_plate(&mut scene, top, DVec3::Z, 0.5 * size, [REFLECTANCE; 3]);
                scene.meshes.push(cube(centre, size));
            }
            assert_lit(&scene, &format!("two of {place} from {distance}"));
        });
    }
}

/// A ball of 80 triangles around `centre`: an icosahedron, every face divided in four.
fn ball(centre: DVec3, radius: f64) -> Mesh {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut corners = Vec::new();
    for (short, long) in [
        (1.0, golden),
        (-1.0, golden),
        (1.0, -golden),
        (-1.0, -golden),
    ] {
        corners.extend([
            DVec3::new(0.0, short, long),
            DVec3::new(short, long, 0.0),
            DVec3::new(long, 0.0, short),
        ]);
    }
    let mut mesh = Mesh::default();
    let neighbours = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in &corners[j + 1..] {
                if neighbours(a, b) && neighbours(b, c) && neighbours(c, a) {
                    let (ab, bc, ca) = (a + b, b + c, c + a);
                    for face in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                        let first = mesh.positions.len() as u32;
                        mesh.positions
                            .extend(face.map(|p| centre + radius * p.normalize()));
                        mesh.triangles.push([first, first + 1, first + 2]);
                    }
                }
            }
        }
    }
    mesh
}

/// Aimed exactly at corners and edges, where the ray's start lies on several triangles at once.
#[test]
fn corners_and_edges_of_a_ball_are_neither_shadowed_nor_open() {
    let towards_sun = DVec3::new(0.3, -0.5, 0.81).normalize();
    at_every_place(|centre, size, place| {
        let mesh = ball(centre, 0.5 * size);
        assert_eq!(mesh.triangles.len(), 80);
        let mut scene = empty(camera(centre));
        scene.materials.push(material(REFLECTANCE));
        scene.sun = Some(Sun {
            travel_direction: -towards_sun,
            irradiance: [1.0; 3],
        });
        scene.meshes.push(mesh.clone());
        let mut compared = 0;
        for target in mesh.positions.chunks_exact(3).flat_map(|p| {
            [
                p[0],
                p[1],
                p[2],
                0.5 * (p[0] + p[1]),
                0.5 * (p[1] + p[2]),
                0.5 * (p[2] + p[0]),
            ]
        }) {
            let lit = adjoining_radiances(&mesh, target, towards_sun, 1e-6 * size);
            // Where a face turns away from the sun, the horizon runs through the point.
            if lit
                .iter()
                .any(|&radiance| radiance < 0.05 * REFLECTANCE / PI)
            {
                continue;
            }
            let outwards = (target - centre).normalize();
            scene.camera = ray_camera(target + 3.0 * size * outwards, -outwards, 1);
            // Straight at the point: the whole pixel is narrower than the rounding of its direction.
            scene.camera.focal_px = DVec2::splat(1e20);
            let radiance = render(&scene, &plan(1, 1)).0.mean()[0];
            assert!(
                lit.iter().any(|&l| (radiance / l - 1.0).abs() < 1e-6),
                "ball of {place} at {target}: {radiance} is none of {lit:?}"
            );
            compared += 1;
        }
        assert!(compared > 100, "{compared}");
    });
}

/// What the faces that hold `point` send on from the sun.
fn adjoining_radiances(
    mesh: &Mesh,
    point: DVec3,
    towards_sun: DVec3,
    tolerance_m: f64,
) -> Vec<f64> {
    let corners = |t: &[u32; 3]| t.map(|i| mesh.positions[i as usize]);
    let holds = |[a, b, c]: &[DVec3; 3]| {
        let on = |p: DVec3, q: DVec3| {
            p.distance(point) + q.distance(point) < p.distance(q) + tolerance_m
        };
        on(*a, *b) || on(*b, *c) || on(*c, *a)
    };
    let faces = mesh.triangles.iter().map(corners).filter(holds);
    faces
        .map(|[a, b, c]| {
            let normal = (b - a).cross(c - a).normalize();
            let centroid = a + b + c - 3.0 * mesh_centre(mesh);
            REFLECTANCE / PI * (normal * centroid.dot(normal).signum()).dot(towards_sun)
        })
        .collect()
}

fn mesh_centre(mesh: &Mesh) -> DVec3 {
    mesh.positions.iter().sum::<DVec3>() / mesh.positions.len() as f64
}
