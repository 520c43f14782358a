//! Rays leave surfaces without leaking through them or shadowing themselves, from millimetres to kilometres and far
//! from the origin.

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};
use uw_render::{
    film::FilmLayer,
    scene::{Camera, Lens, Material, Mesh, Scene, Sun},
};
use uw_tests::single_ray::{add_plate, camera as ray_camera, empty};
use uw_tests::{
    gpu::{Backend, everywhere},
    plan,
};

/// Sizes of what stands in the scene, m.
const SIZES_M: [f64; 5] = [1e-3, 0.1, 1.0, 100.0, 1e4];
/// Distances from the origin in sizes.
const OFFSETS: [f64; 3] = [0.0, 1e3, 1e6];
/// Mean radiance that may leak into a cube under a sky of 1 at the greatest offset, where the least distance of a
/// surface is a few millionths of the edge: rays that leave so close to an edge miss the next wall.
const LEAK_FAR_AWAY: f64 = 1e-4;
/// Reflectance of what the sun shines on.
const REFLECTANCE: f64 = 0.5;
/// Relative tolerance of a lit surface. A shadowed sample would take a quarter of a pixel; at the greatest offset the
/// rounding of corners turns normals by 1e-10, which is 1e-4 of the sine of the lowest sun.
const LIT_TOLERANCE: f64 = 1e-3;

/// Departure of cosines in single precision: directions and normals carry 6e-8 in each of three components.
const COSINES_F32: f64 = 2e-7;

/// Whether lengths are in single precision. Then the least distance of a surface is everywhere a millionth of the
/// coordinates, as in double precision at the greatest offset.
fn is_single(backend: Backend) -> bool {
    matches!(backend, Backend::VectorUnits | Backend::Adapter)
}

/// Where a scene stands, and how large it is.
struct Site {
    centre_m: DVec3,
    size_m: f64,
    turn: DQuat,
    name: String,
}

impl Site {
    fn direction(&self, x: f64, y: f64, z: f64) -> DVec3 {
        self.turn * DVec3::new(x, y, z)
    }

    /// The point at coordinates in sizes.
    fn point(&self, x: f64, y: f64, z: f64) -> DVec3 {
        self.centre_m + self.size_m * self.direction(x, y, z)
    }
}

/// Calls `check` everywhere for every size and offset, along the axes and turned.
fn at_every_site(check: impl Fn(Backend, &Site)) {
    everywhere(|backend| {
        // Small pictures are slow on an adapter.
        let step = match backend {
            Backend::Adapter => 2,
            _ => 1,
        };
        at_sites(&mut SIZES_M.into_iter().step_by(step), &|site| {
            check(backend, site)
        });
    });
}

fn at_sites(sizes_m: &mut dyn Iterator<Item = f64>, check: &dyn Fn(&Site)) {
    let turned = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 0.7);
    for size_m in sizes_m {
        for offset in OFFSETS {
            for (how, turn) in [("upright", DQuat::IDENTITY), ("turned", turned)] {
                check(&Site {
                    centre_m: size_m * offset * DVec3::new(1.0, -1.0, 0.7),
                    size_m,
                    turn,
                    name: format!("{size_m} m, {how}, at {offset} sizes"),
                });
            }
        }
    }
}

fn camera(position_m: DVec3, forward: DVec3, right: DVec3, focal_px: f64) -> Camera {
    Camera {
        position_m,
        forward,
        right,
        down: forward.cross(right),
        width: 24,
        height: 24,
        focal_px: DVec2::splat(focal_px),
        centre_px: DVec2::splat(12.0),
        lens: Lens::default(),
        opening: None,
        port: None,
    }
}

fn material(reflectance: f64) -> Material {
    Material {
        reflectance: [reflectance; 3],
        ..Material::default()
    }
}

fn sun(towards: DVec3) -> Option<Sun> {
    Some(Sun {
        travel_direction: -towards,
        irradiance: [1.0; 3],
    })
}

/// A closed cube of twelve triangles.
fn cube(site: &Site) -> Mesh {
    let corner = |i: usize| {
        let side = |bit: usize| if i & bit == 0 { -0.5 } else { 0.5 };
        site.point(side(1), side(2), side(4))
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
        triangles: faces
            .iter()
            .flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]])
            .collect(),
        ..Mesh::default()
    }
}

#[test]
fn no_light_leaks_into_a_closed_cube() {
    at_every_site(|backend, site| {
        let forward = DVec3::new(0.8, 0.36, 0.48);
        let right = forward.any_orthonormal_vector();
        let mut scene = empty(camera(site.point(0.1, 0.2, -0.05), forward, right, 8.0));
        scene.sky_radiance = [1.0; 3];
        scene.materials.push(material(0.9));
        scene.meshes.push(cube(site));
        let far = site.centre_m.length() > 1e5 * site.size_m;
        let allowed = if far || is_single(backend) {
            LEAK_FAR_AWAY
        } else {
            0.0
        };
        let radiance = backend.render(&scene, &plan(64, 4)).0.mean()[0];
        assert!(radiance <= allowed, "cube of {}: {radiance}", site.name);
    });
}

/// The top of what stands at `site`, 0.6 sizes wide and high, from `height` sizes above it, under a sun
/// `elevation_deg` above its plane.
fn seen_from_above(site: &Site, height: f64, elevation_deg: f64) -> Scene {
    let down = site.direction(0.0, 0.0, -1.0);
    let right = site.direction(1.0, 0.0, 0.0);
    let position = site.point(0.0, 0.0, 0.5 + height);
    let mut scene = empty(camera(position, down, right, 40.0 * height));
    scene.materials.push(material(REFLECTANCE));
    let (sin, cos) = elevation_deg.to_radians().sin_cos();
    scene.sun = sun(site.direction(-0.6 * cos, -0.8 * cos, sin));
    scene
}

/// A plate on top of the cube.
fn add_top(scene: &mut Scene, site: &Site) {
    let top = site.point(0.0, 0.0, 0.5);
    let up = site.direction(0.0, 0.0, 1.0);
    add_plate(scene, top, up, 0.5 * site.size_m, [REFLECTANCE; 3]);
}

/// Every pixel shows the top without a shadow.
fn assert_lit(backend: Backend, scene: &Scene, elevation_deg: f64, what: &str) {
    let sine = elevation_deg.to_radians().sin();
    let expected = REFLECTANCE / PI * sine;
    let cosines = if is_single(backend) { COSINES_F32 } else { 0.0 };
    let (film, _) = backend.render(scene, &plan(4, 4));
    for pixel in film.layer(FilmLayer::Total) {
        assert!(
            (pixel[0] / expected - 1.0).abs() < LIT_TOLERANCE + cosines / sine,
            "{what}: {} instead of {expected}",
            pixel[0]
        );
    }
}

/// Only because a ray skips the primitive it starts from: under so low a sun it leaves the rounding of its start
/// behind it after 1e-10 of the coordinates only. In single precision triangles reach a millionth beyond their edges, so that
/// rays do not slip between them: the sun has to lift a ray by more than that before it meets the side of the cube.
#[test]
fn no_plate_or_triangle_shadows_itself_under_a_grazing_sun() {
    at_every_site(|backend, site| {
        let elevation_deg = if is_single(backend) { 1e-3 } else { 1e-4 };
        let mut plate = seen_from_above(site, 1.0, elevation_deg);
        add_top(&mut plate, site);
        let what = format!("plate of {}", site.name);
        assert_lit(backend, &plate, elevation_deg, &what);
        let mut mesh = seen_from_above(site, 1.0, elevation_deg);
        mesh.meshes.push(cube(site));
        let what = format!("cube of {}", site.name);
        assert_lit(backend, &mesh, elevation_deg, &what);
    });
}

/// Only because rays have a least distance: surfaces in the same place do not know of each other.
#[test]
fn surfaces_in_one_place_do_not_shadow_each_other() {
    let elevation_deg = 0.1;
    at_every_site(|backend, site| {
        for height in [1.0, 1e3] {
            let mut scene = seen_from_above(site, height, elevation_deg);
            for _ in 0..2 {
                add_top(&mut scene, site);
                scene.meshes.push(cube(site));
            }
            let what = format!("two of {}, {height} sizes away", site.name);
            assert_lit(backend, &scene, elevation_deg, &what);
        }
    });
}

/// The corners of a ball of 80 triangles: an icosahedron whose every face is divided in four.
fn ball(site: &Site) -> Vec<[DVec3; 3]> {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut corners = Vec::new();
    for (short, long) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        let long = long * golden;
        corners.extend([
            DVec3::new(0.0, short, long),
            DVec3::new(short, long, 0.0),
            DVec3::new(long, 0.0, short),
        ]);
    }
    let share_an_edge = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
    let at = |p: DVec3| {
        let p = 0.5 * p.normalize();
        site.point(p.x, p.y, p.z)
    };
    let mut faces = Vec::new();
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in &corners[j + 1..] {
                if share_an_edge(a, b) && share_an_edge(b, c) && share_an_edge(c, a) {
                    let (ab, bc, ca) = (a + b, b + c, c + a);
                    let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
                    faces.extend(parts.map(|part| part.map(at)));
                }
            }
        }
    }
    faces
}

fn mesh(faces: &[[DVec3; 3]]) -> Mesh {
    let first = |i: usize| 3 * i as u32;
    Mesh {
        positions: faces.concat(),
        triangles: (0..faces.len())
            .map(|i| [first(i), first(i) + 1, first(i) + 2])
            .collect(),
        ..Mesh::default()
    }
}

/// What the faces of the ball that hold `point` on their outline send on from the sun.
fn adjoining_radiances(
    site: &Site,
    faces: &[[DVec3; 3]],
    point: DVec3,
    towards_sun: DVec3,
) -> Vec<f64> {
    let on_edge = |p: DVec3, q: DVec3| {
        p.distance(point) + q.distance(point) < p.distance(q) + 1e-6 * site.size_m
    };
    let holds = |[a, b, c]: &&[DVec3; 3]| on_edge(*a, *b) || on_edge(*b, *c) || on_edge(*c, *a);
    let radiance = |[a, b, c]: &[DVec3; 3]| {
        let normal = (b - a).cross(c - a).normalize();
        let outwards = (a - site.centre_m).dot(normal).signum();
        REFLECTANCE / PI * outwards * normal.dot(towards_sun)
    };
    faces.iter().filter(holds).map(radiance).collect()
}

/// Aimed exactly at corners and edges, where a ray's start lies on several triangles at once.
#[test]
fn corners_and_edges_of_a_ball_are_neither_shadowed_nor_open() {
    let towards_sun = DVec3::new(0.3, -0.5, 0.81).normalize();
    at_every_site(|backend, site| {
        let faces = ball(site);
        assert_eq!(faces.len(), 80);
        let targets = faces.iter().flat_map(|&[a, b, c]| {
            let middle = |p: DVec3, q: DVec3| 0.5 * (p + q);
            [a, b, c, middle(a, b), middle(b, c), middle(c, a)]
        });
        let mut compared = 0;
        let (step, least) = match backend {
            Backend::Adapter => (120, 1),
            _ => (1, 100),
        };
        for target in targets.step_by(step) {
            let lit = adjoining_radiances(site, &faces, target, towards_sun);
            // Where a face turns away from the sun, the horizon runs through the point.
            if lit.iter().any(|&l| l < 0.05 * REFLECTANCE / PI) {
                continue;
            }
            let outwards = (target - site.centre_m).normalize();
            let position = target + 3.0 * site.size_m * outwards;
            let mut scene = empty(ray_camera(position, -outwards, 1));
            // The whole pixel is narrower than the rounding of its direction.
            scene.camera.focal_px = DVec2::splat(1e20);
            scene.materials.push(material(REFLECTANCE));
            scene.sun = sun(towards_sun);
            scene.meshes.push(mesh(&faces));
            let radiance = backend.render(&scene, &plan(1, 1)).0.mean()[0];
            assert!(
                lit.iter()
                    .any(|&l| (radiance / l - 1.0).abs() < 1e-6 + backend.rounding()),
                "ball of {}, {target}: {radiance} is none of {lit:?}",
                site.name
            );
            compared += 1;
        }
        assert!(compared > least, "{compared}");
    });
}
