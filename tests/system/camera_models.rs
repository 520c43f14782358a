//! Fisheye lenses and ports: pictures of every backend against the projection of points, and against closed forms.

use glam::{DVec2, DVec3};
use uw_render::{
    film::FilmLayer,
    image::LayerData,
    layers::{RenderLayer, exr_image},
    prepare::Prepared,
    scene::{Camera, Scene},
};
use uw_tests::{file, gpu::everywhere, plan};

/// Lens and port of some cameras, the fields of `[camera]` that say them.
const CAMERAS: [(&str, &str); 5] = [
    (
        "fisheye",
        "hfov_deg = 120.0\nfisheye = [0.03, -0.01, 0.002, 0.0]",
    ),
    (
        "flat port",
        "hfov_deg = 70.0\nport = { kind = \"flat\", distance_m = 0.03, thickness_m = 0.012, glass_index = 1.49 }",
    ),
    (
        "flat port, distorting lens",
        "fx = 70.0\ndistortion = [-0.2, 0.05, 0.001, -0.002, 0.0]\n\
         port = { kind = \"flat\", distance_m = 0.03, thickness_m = 0.012, glass_index = 1.52 }",
    ),
    (
        "dome off its centre",
        "hfov_deg = 80.0\nport = { kind = \"dome\", radius_m = 0.05, thickness_m = 0.006, offset_m = [0.004, -0.002, -0.012] }",
    ),
    (
        "fisheye behind a dome",
        "hfov_deg = 150.0\nfisheye = [0.03, -0.01, 0.002, 0.0]\n\
         port = { kind = \"dome\", radius_m = 0.05, thickness_m = 0.006, offset_m = 0.005 }",
    ),
];
/// Size of the pictures, pixels.
const SIZE: DVec2 = DVec2::new(96.0, 64.0);

/// A scene whose camera looks along +x from the origin, in water with these coefficients.
fn scene(camera: &str, a: f64, rest: &str) -> Scene {
    let text = format!(
        "format = \"uw-scene/1\"\nwater = {{ a = [{a}, {a}, {a}], b = [0.0, 0.0, 0.0] }}\n\
         [camera]\nposition_m = [0.0, 0.0, 0.0]\nforward = [1.0, 0.0, 0.0]\n{camera}\nwidth = {}\nheight = {}\n{rest}",
        SIZE.x, SIZE.y
    );
    Scene::parse(&text, &file("scenes"), "camera").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn wall(distance_m: f64, emission: f64) -> String {
    format!(
        "[[object]]\nplane = {{ center_m = [{distance_m}, 0.0, 0.0], normal = [-1.0, 0.1, 0.2], size_m = [400.0, 400.0] }}\n\
         reflectance = [0.0, 0.0, 0.0]\nemission = [{emission}, {emission}, {emission}]\n"
    )
}

/// Where small bright squares are, and how large.
const SQUARES: [DVec2; 5] = [
    DVec2::new(0.17, 0.21),
    DVec2::new(0.52, 0.49),
    DVec2::new(0.81, 0.30),
    DVec2::new(0.33, 0.78),
    DVec2::new(0.86, 0.84),
];
const HALF_EDGE_PX: f64 = 2.5;

/// A square across the ray of an image point at a distance in the water: its centre and its half edges, m.
fn square(camera: &Camera, at: DVec2, distance_m: f64) -> [DVec3; 3] {
    let ray = camera.ray(at.x, at.y);
    let centre = ray.origin_m + distance_m * ray.direction;
    let scale = camera.pixels_per_rad(centre).expect("seen");
    let (u, v) = ray.direction.any_orthonormal_pair();
    let half = HALF_EDGE_PX / scale * distance_m;
    [centre, half * u, half * v]
}

/// The image of a square: its edge.
fn image_of(camera: &Camera, [centre, u, v]: [DVec3; 3]) -> Vec<DVec2> {
    const PARTS: u32 = 40;
    let corners = [-u - v, u - v, u + v, -u + v];
    let along = |k: usize, i: u32| {
        let t = f64::from(i) / f64::from(PARTS);
        let point = centre + corners[k].lerp(corners[(k + 1) % 4], t);
        camera.project(point).expect("seen")
    };
    (0..4)
        .flat_map(|k| (0..PARTS).map(move |i| (k, i)))
        .map(|(k, i)| along(k, i))
        .collect()
}

/// The part of an area where coordinate `axis` is above `least` (or, with `sign` -1, below).
fn clipped(edge: &[DVec2], axis: usize, least: f64, sign: f64) -> Vec<DVec2> {
    let above = |p: DVec2| sign * (p[axis] - least);
    let mut kept = Vec::new();
    for (i, &p) in edge.iter().enumerate() {
        let q = edge[(i + 1) % edge.len()];
        if above(p) >= 0.0 {
            kept.push(p);
        }
        if above(p) * above(q) < 0.0 {
            kept.push(p.lerp(q, above(p) / (above(p) - above(q))));
        }
    }
    kept
}

/// The picture of an area of radiance 1.
fn picture_of(edge: &[DVec2]) -> Vec<[f64; 3]> {
    let width = SIZE.x as usize;
    let mut pixels = vec![[0.0; 3]; width * SIZE.y as usize];
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let mut part = edge.to_vec();
        for (axis, least) in [(0, (i % width) as f64), (1, (i / width) as f64)] {
            part = clipped(&part, axis, least, 1.0);
            part = clipped(&part, axis, least + 1.0, -1.0);
        }
        let next = part.iter().cycle().skip(1);
        let twice: f64 = part.iter().zip(next).map(|(p, &q)| p.perp_dot(q)).sum();
        pixel[0] = 0.5 * twice.abs();
    }
    pixels
}

/// Sum and centre of the pixels' light, of what a picture shows within `reach_px` of a place.
fn found(pixels: &[[f64; 3]], width: usize, at: DVec2, reach_px: f64) -> (f64, DVec2) {
    let (mut sum, mut moment) = (0.0, DVec2::ZERO);
    for (i, pixel) in pixels.iter().enumerate() {
        let middle = DVec2::new((i % width) as f64, (i / width) as f64) + 0.5;
        if (middle - at).abs().max_element() < reach_px {
            sum += pixel[0];
            moment += pixel[0] * middle;
        }
    }
    (sum, moment / sum)
}

/// Rays of the kernels outwards against the projection inwards, with its area: small bright squares at all distances.
#[test]
fn bright_squares_are_where_they_are_projected() {
    for (name, fields) in CAMERAS {
        let mut scene = scene(fields, 0.0, &wall(1.0, 1.0));
        let pattern = scene.quads.remove(0);
        let squares: Vec<[DVec3; 3]> = SQUARES
            .iter()
            .zip([0.3, 0.6, 1.0, 3.0, 10.0])
            .map(|(&at, distance_m)| square(&scene.camera, at * SIZE, distance_m))
            .collect();
        for &[centre_m, half_u, half_v] in &squares {
            let normal = half_u.cross(half_v).normalize();
            scene.quads.push(uw_render::scene::Quad {
                centre_m,
                half_u,
                half_v,
                normal,
                ..pattern
            });
        }
        everywhere(|backend| {
            let picture = backend.render(&scene, &plan(256, 3)).0;
            let pixels = picture.layer(FilmLayer::Total);
            for &square in &squares {
                let edge = image_of(&scene.camera, square);
                let (area, centroid) = found(&picture_of(&edge), SIZE.x as usize, edge[0], 12.0);
                let (light, middle) = found(&pixels, SIZE.x as usize, edge[0], 12.0);
                println!(
                    "{name}: {centroid} off by {:.5} px, area {area:.3} by {:.5}",
                    (middle - centroid).length(),
                    light / area - 1.0
                );
                assert!(
                    (middle - centroid).length() < 0.03,
                    "{name}: {middle} {centroid}"
                );
                assert!((light / area - 1.0).abs() < 0.02, "{name}: {light} {area}");
            }
        });
    }
}

/// Edge of the part of a picture in which a lamp is looked for, pixels: no smaller than what is summed.
const LAMP_SIZE_PX: usize = 8;

/// The scene with a camera that is left with the pixels around an image point, and the corner of these.
fn around(scene: &Scene, at: DVec2) -> (Scene, DVec2) {
    let mut scene = scene.clone();
    let corner = at.round() - 0.5 * LAMP_SIZE_PX as f64;
    let camera = &mut scene.camera;
    (camera.width, camera.height) = (LAMP_SIZE_PX as u32, LAMP_SIZE_PX as u32);
    camera.centre_px -= corner;
    (scene, corner)
}

/// Small disk lamps that the camera looks at: found by image points of their own, with all their light.
#[test]
fn lamps_in_view_are_where_they_are_projected() {
    for (name, fields) in CAMERAS {
        let bare = scene(fields, 0.0, "");
        let mut rest = String::new();
        for (i, at) in SQUARES.iter().enumerate().take(3) {
            // A corner of four pixels, which share the light by the place to a small part of the lamp's radius.
            let corner = (*at * SIZE).round();
            let ray = bare.camera.ray(corner.x, corner.y);
            let position = ray.origin_m + 1.3 * ray.direction;
            let back = -ray.direction;
            rest += &format!(
                "[[lamp]]\nname = \"l{i}\"\nposition_m = {:?}\nforward = {:?}\nintensity = [1.0, 1.0, 1.0]\nradius_m = 0.006\n",
                position.to_array(),
                back.to_array()
            );
        }
        let scene = scene(fields, 0.0, &rest);
        everywhere(|backend| {
            for (i, lamp) in scene.lamps.iter().enumerate() {
                let (u, v) = lamp.forward.any_orthonormal_pair();
                let seen = |across| scene.camera.project(lamp.position_m + 1e-3 * across);
                let [left, right, below, above] = [-u, u, -v, v].map(|a| seen(a).expect("seen"));
                let area = (right - left).perp_dot(above - below).abs() / 4e-6;
                // Of the area π r² with the radiance I / (π r²).
                let expected = area;
                let at = scene.camera.project(lamp.position_m).expect("seen");
                let (part, corner) = around(&scene, at);
                let picture = backend.render(&part, &plan(1024, 3)).0;
                let pixels = picture.layer(FilmLayer::Lamp(i));
                let (light, middle) = found(&pixels, LAMP_SIZE_PX, at - corner, 3.0);
                let middle = middle + corner;
                println!(
                    "{name}, lamp {i}: off by {:.5} px, light by {:.5}",
                    (middle - at).length(),
                    light / expected - 1.0
                );
                assert!((middle - at).length() < 0.06, "{name}: {middle} {at}");
                assert!(
                    (light / expected - 1.0).abs() < 0.1,
                    "{name}: {light} {expected}"
                );
            }
        });
    }
}

/// A pixel holds the radiance in the water along its ray, which starts at the outer side of the port.
#[test]
fn water_dims_from_the_port_on() {
    const A: f64 = 0.7;
    for (name, fields) in CAMERAS {
        let scene = scene(fields, A, &wall(1.5, 2.0));
        let normal = scene.quads[0].normal;
        everywhere(|backend| {
            let picture = backend.render(&scene, &plan(64, 1)).0;
            let pixels = picture.layer(FilmLayer::Total);
            for (column, row) in [(48, 32), (20, 40), (70, 10), (30, 12)] {
                let ray = scene
                    .camera
                    .ray(f64::from(column) + 0.5, f64::from(row) + 0.5);
                let offset = scene.quads[0].centre_m - ray.origin_m;
                let length = offset.dot(normal) / ray.direction.dot(normal);
                let expected = 2.0 * (-A * length).exp();
                let got = pixels[row as usize * SIZE.x as usize + column as usize][0];
                assert!(
                    (got / expected - 1.0).abs() < 2e-3,
                    "{name}: {got} {expected}"
                );
            }
        });
    }
}

/// What the layers say each pixel shows is seen in the middle of that pixel.
#[test]
fn positions_project_back_onto_their_pixels() {
    for (name, fields) in CAMERAS {
        let scene = scene(fields, 0.1, &wall(1.5, 1.0));
        let prepared = Prepared::build(&scene);
        let camera = &prepared.camera;
        everywhere(|backend| {
            let film = backend.render(&scene, &plan(1, 1)).0;
            let image = exr_image(
                &prepared,
                &film,
                &[RenderLayer::Position, RenderLayer::Depth],
            );
            let [LayerData::Vector(positions), LayerData::Scalar(depths)] =
                [&image.layers[0].data, &image.layers[1].data]
            else {
                panic!("a vector and a number")
            };
            let mut furthest = 0.0_f64;
            let mut met = 0;
            for (i, (position, depth_m)) in positions.iter().zip(depths).enumerate() {
                if depth_m.is_infinite() {
                    continue;
                }
                let point = DVec3::from_array(position.map(f64::from));
                let width = SIZE.x as usize;
                let middle = DVec2::new((i % width) as f64, (i / width) as f64) + 0.5;
                let seen = camera.project(point).expect("seen");
                furthest = furthest.max((seen - middle).length());
                let along = (point - camera.position_m).dot(camera.forward);
                assert!((along - f64::from(*depth_m)).abs() < 1e-5 * along);
                met += 1;
            }
            println!("{name}: {met} pixels, off by {furthest:.6} px at most");
            assert!(
                met > 4000 && furthest < 1e-3,
                "{name}: {met} pixels, {furthest} px"
            );
        });
    }
}
