//! Cameras against OpenCV, against AquaCal, and against the shortest optical path through their ports.

use std::{fs, path::Path};

use glam::{DVec2, DVec3};
use uw_render::scene::{Camera, Lens, Port, PortShape, Scene};

const WATER: f64 = 1.34;
const GLASS: f64 = 1.49;

/// A camera somewhere in the world, with fx, fy, cx, cy of 1280 × 720 pixels.
fn camera([fx, fy, cx, cy]: [f64; 4], lens: Lens, port: Option<Port>) -> Camera {
    let text = "format = \"uw-scene/1\"\ncamera = { position_m = [0.4, -2.0, 1.0], forward = [1.0, 0.2, -0.1], \
                hfov_deg = 60.0, width = 1280, height = 720 }\n";
    let scene = Scene::parse(text, Path::new("."), "camera").unwrap_or_else(|e| panic!("{e}"));
    Camera {
        focal_px: DVec2::new(fx, fy),
        centre_px: DVec2::new(cx, cy),
        lens,
        opening: None,
        port,
        ..scene.camera
    }
}

fn port(shape: PortShape, thickness_m: f64) -> Option<Port> {
    Some(Port {
        shape,
        thickness_m,
        glass_index: GLASS,
        outside_index: WATER,
    })
}

/// A point of the world from its right, down and forward parts.
fn in_world(camera: &Camera, [x, y, z]: [f64; 3]) -> DVec3 {
    camera.position_m + x * camera.right + y * camera.down + z * camera.forward
}

/// Columns of numbers and the words before them, of a file of `tests/data`.
fn rows(name: &str) -> Vec<(String, Vec<f64>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name);
    let text = fs::read_to_string(path).expect("there");
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    let row = |line: &str| {
        let (words, numbers): (Vec<&str>, Vec<&str>) = line
            .split(',')
            .partition(|field| field.parse::<f64>().is_err());
        let numbers = numbers.into_iter().filter_map(|n| n.parse().ok());
        (words.concat(), numbers.collect())
    };
    lines.map(row).collect()
}

/// Asserts that the largest distance between image points is below `allowed_px`.
fn agree(what: &str, distances_px: impl Iterator<Item = f64>, allowed_px: f64) {
    let distances: Vec<f64> = distances_px.collect();
    assert!(distances.len() >= 100, "{what}: {}", distances.len());
    let largest = distances.into_iter().fold(0.0, f64::max);
    assert!(largest < allowed_px, "{what}: {largest} px");
}

/// Asked are 1e-3 px; the reference is written to 1e-9.
#[test]
fn lenses_project_as_opencv_does() {
    let table = rows("opencv_projection.csv");
    for model in ["perspective", "rational", "fisheye"] {
        let distances = table.iter().filter(|row| row.0 == model).map(|(_, row)| {
            let (numbers, rest) = row.split_first_chunk::<12>().expect("17 numbers");
            let [fx, fy, cx, cy, k @ ..] = *numbers;
            let &[x, y, z, px, py] = rest else {
                panic!("17 numbers, got {row:?}")
            };
            let lens = match model {
                "fisheye" => Lens::Fisheye([k[0], k[1], k[2], k[3]]),
                _ => Lens::Perspective(k),
            };
            let camera = camera([fx, fy, cx, cy], lens, None);
            let seen = camera.project(in_world(&camera, [x, y, z])).expect("seen");
            (seen - DVec2::new(px, py)).length()
        });
        agree(model, distances, 1e-6);
    }
}

/// Asked are 1e-3 px. AquaCal's iteration ends when a step is below 1e-9 m on the interface.
#[test]
fn flat_ports_without_glass_project_as_aquacal_does() {
    let table = rows("aquacal_flat_port.csv");
    let distances = table.iter().map(|(_, row)| {
        let [fx, fy, cx, cy, distance_m, index, x, y, z, px, py] = row[..] else {
            panic!("11 numbers, got {row:?}")
        };
        assert_eq!(index, WATER);
        let port = port(PortShape::Flat { distance_m }, 0.0);
        let camera = camera([fx, fy, cx, cy], Lens::default(), port);
        let seen = camera.project(in_world(&camera, [x, y, z])).expect("seen");
        (seen - DVec2::new(px, py)).length()
    });
    agree("AquaCal", distances, 1e-6);
}

/// Image points of a grid, and points on their rays at some distances along the optical axis, beyond the port.
fn grid(camera: &Camera, ranges_m: &[f64]) -> Vec<(DVec2, DVec3)> {
    let mut points = Vec::new();
    for i in 0..=8 {
        for j in 0..=6 {
            let pixel = DVec2::new(160.0 * f64::from(i), 120.0 * f64::from(j));
            let ray = camera.ray(pixel.x, pixel.y);
            for range_m in ranges_m {
                let start = (ray.origin_m - camera.position_m).dot(camera.forward);
                let t = (range_m - start) / ray.direction.dot(camera.forward);
                points.push((pixel, ray.origin_m + t * ray.direction));
            }
        }
    }
    points
}

/// A point of a curve across the axis (radius, distance along the axis), and the curve's direction there.
type OnCurve = (DVec2, DVec2);

/// Where the way from the eye meets the inner side of a port, by Fermat's principle: the optical path to `point` through the inner
/// and the outer side does not change when its points move along these.
fn fermat(
    inner: impl Fn(f64) -> OnCurve,
    outer: impl Fn(f64) -> OnCurve,
    point: DVec2,
    reach: (f64, f64),
) -> DVec2 {
    let turning_point = |slope: &dyn Fn(f64) -> f64| {
        let (mut low, mut high) = reach;
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            match slope(middle) < 0.0 {
                true => low = middle,
                false => high = middle,
            }
        }
        0.5 * (low + high)
    };
    let slope = |from: DVec2, (at, along): OnCurve| (at - from).normalize_or_zero().dot(along);
    let left_at = |u: f64| {
        outer(turning_point(&|v| {
            GLASS * slope(inner(u).0, outer(v)) + WATER * slope(point, outer(v))
        }))
    };
    let met = |u: f64| slope(DVec2::ZERO, inner(u)) + GLASS * slope(left_at(u).0, inner(u));
    inner(turning_point(&met)).0
}

/// The image point of a world point through a port that is symmetric about the optical axis, by Fermat's principle.
fn seen_by_fermat(camera: &Camera, port: &Port, point: DVec3) -> DVec2 {
    let offset = point - camera.position_m;
    let across = DVec2::new(offset.dot(camera.right), offset.dot(camera.down));
    let in_plane = DVec2::new(across.length(), offset.dot(camera.forward));
    let thickness_m = port.thickness_m;
    let met = match port.shape {
        PortShape::Flat { distance_m } => fermat(
            |u| (DVec2::new(u, distance_m), DVec2::X),
            |v| (DVec2::new(v, distance_m + thickness_m), DVec2::X),
            in_plane,
            (0.0, in_plane.x),
        ),
        PortShape::Dome { radius_m, offset_m } => {
            let at = |radius: f64, angle: f64| {
                let (sine, cosine) = angle.sin_cos();
                let middle = DVec2::new(0.0, offset_m.z);
                let place = middle + radius * DVec2::new(sine, cosine);
                (place, DVec2::new(cosine, -sine))
            };
            fermat(
                |u| at(radius_m, u),
                |v| at(radius_m + thickness_m, v),
                in_plane,
                (0.0, 1.5),
            )
        }
    };
    let ideal = met.x / met.y * across.normalize_or_zero();
    camera.centre_px + ideal * camera.focal_px
}

const INTRINSICS: [f64; 4] = [612.5, 608.25, 641.3, 355.8];

/// Asked are 1e-3 px.
#[test]
fn a_flat_port_refracts_by_the_shortest_optical_path() {
    for (distance_m, thickness_m) in [(0.005, 0.003), (0.02, 0.01), (0.1, 0.03)] {
        let flat = port(PortShape::Flat { distance_m }, thickness_m);
        let camera = camera(INTRINSICS, Lens::default(), flat);
        let points = grid(&camera, &[0.3, 1.0, 3.0, 10.0]);
        let distances = points.iter().map(|&(pixel, point)| {
            let seen = camera.project(point).expect("before the port");
            assert!(
                (seen - pixel).length() < 1e-8,
                "{pixel} came back as {seen}"
            );
            (seen - seen_by_fermat(&camera, &flat.expect("port"), point)).length()
        });
        agree(&format!("flat port at {distance_m} m"), distances, 1e-6);
    }
}

#[test]
fn a_dome_off_its_centre_refracts_by_the_shortest_optical_path() {
    for ahead_m in [-0.03, -0.004, 0.012] {
        let shape = PortShape::Dome {
            radius_m: 0.05,
            offset_m: DVec3::new(0.0, 0.0, ahead_m),
        };
        let dome = port(shape, 0.008);
        let camera = camera(INTRINSICS, Lens::default(), dome);
        let points = grid(&camera, &[0.3, 1.0, 3.0, 10.0]);
        let distances = points.iter().map(|&(_, point)| {
            let seen = camera.project(point).expect("before the port");
            (seen - seen_by_fermat(&camera, &dome.expect("port"), point)).length()
        });
        agree(&format!("dome {ahead_m} m ahead"), distances, 1e-6);
    }
}

/// By how many pixels the dome moves image points of the grid, at most.
fn moved_px(offset_m: DVec3, thickness_m: f64) -> f64 {
    let shape = PortShape::Dome {
        radius_m: 0.05,
        offset_m,
    };
    let dome = camera(INTRINSICS, Lens::default(), port(shape, thickness_m));
    let plain = camera(INTRINSICS, Lens::default(), None);
    let moved = grid(&plain, &[0.3, 1.0, 10.0])
        .into_iter()
        .map(|(pixel, point)| (dome.project(point).expect("before the port") - pixel).length());
    moved.fold(0.0, f64::max)
}

#[test]
fn a_centred_dome_is_no_port_at_all() {
    for thickness_m in [0.0, 0.005, 0.02] {
        let moved = moved_px(DVec3::ZERO, thickness_m);
        assert!(moved < 1e-9, "{moved} px");
    }
    // And off its centre it is one, to the side as well as along the axis.
    for offset_m in [0.002 * DVec3::Z, 0.002 * DVec3::X] {
        let moved = moved_px(offset_m, 0.005);
        assert!((0.5..50.0).contains(&moved), "{moved} px");
    }
}

/// Light through a port goes both ways: the ray of an image point, wherever the dome's middle is, is seen there.
#[test]
fn rays_through_a_dome_off_the_axis_return() {
    let shape = PortShape::Dome {
        radius_m: 0.05,
        offset_m: DVec3::new(0.006, -0.011, -0.015),
    };
    let camera = camera(
        INTRINSICS,
        Lens::Fisheye([0.02, -0.004, 0.0, 0.0]),
        port(shape, 0.008),
    );
    let distances = grid(&camera, &[0.3, 10.0])
        .into_iter()
        .map(|(pixel, point)| (camera.project(point).expect("seen") - pixel).length());
    agree("dome off the axis", distances, 1e-8);
}
