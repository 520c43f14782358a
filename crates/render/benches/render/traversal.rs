//! Rays through a bumpy field of triangles, against its size.

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use glam::{DVec2, DVec3};
use uw_render::prepare::{Geometry, Primitive};
use uw_render::sampling::Rng;
use uw_render::scene::{Camera, Lens, Material, Mesh, RenderSettings, Scene};

/// Rays per iteration.
const RAYS: u32 = 4096;

/// The rates of the nearest hit and of the question whether there is any, and the time to build the tree.
pub fn bench(criterion: &mut Criterion) {
    let rays = rays();
    for exponent in 3..=6 {
        let scene = field(10_u32.pow(exponent));
        let geometry = Geometry::build(&scene);
        let mut group = criterion.benchmark_group(format!("traversal/1e{exponent} triangles"));
        group.throughput(Throughput::Elements(u64::from(RAYS)));
        group.bench_function("closest", |bencher| {
            bencher.iter(|| {
                let hits = black_box(&rays).iter().filter_map(|&(origin, direction)| {
                    geometry.closest(origin, direction, f64::INFINITY, Primitive::None)
                });
                hits.map(|hit| hit.t).sum::<f64>()
            });
        });
        group.bench_function("occluded", |bencher| {
            bencher.iter(|| {
                let hidden = |&&(origin, direction): &&(DVec3, DVec3)| {
                    geometry.occluded(origin, direction, 3.0, Primitive::None)
                };
                black_box(&rays).iter().filter(hidden).count()
            });
        });
        group.throughput(Throughput::Elements(geometry.len() as u64));
        group.sample_size(10);
        group.bench_function("build", |bencher| {
            bencher.iter(|| Geometry::build(black_box(&scene)))
        });
        group.finish();
    }
}

/// Rays without any order from 2 m above the field: half of them meet it, at all angles.
fn rays() -> Vec<(DVec3, DVec3)> {
    (0..RAYS)
        .map(|i| {
            let mut rng = Rng::new(3, i, 0, 0);
            let origin = DVec3::new(8.0 * rng.uniform() - 4.0, 8.0 * rng.uniform() - 4.0, 2.0);
            let azimuth = std::f64::consts::TAU * rng.uniform();
            let z = 2.0 * rng.uniform() - 1.0;
            let across = (1.0 - z * z).sqrt();
            (
                origin,
                DVec3::new(across * azimuth.cos(), across * azimuth.sin(), z),
            )
        })
        .collect()
}

/// A field of 8 m × 8 m around the origin with bumps of 10 cm, of about `triangles` triangles.
fn field(triangles: u32) -> Scene {
    let cells = (f64::from(triangles) / 2.0).sqrt().round() as u32;
    let backend = |i: u32| 8.0 * f64::from(i) / f64::from(cells) - 4.0;
    let mut mesh = Mesh::default();
    for (row, column) in (0..=cells).flat_map(|r| (0..=cells).map(move |c| (r, c))) {
        let (x, y) = (backend(column), backend(row));
        let height = 0.1 * (5.0 * x).sin() * (7.0 * y).cos();
        mesh.positions.push(DVec3::new(x, y, height));
    }
    for (row, column) in (0..cells).flat_map(|r| (0..cells).map(move |c| (r, c))) {
        let corner = row * (cells + 1) + column;
        let above = corner + cells + 1;
        mesh.triangles.push([corner, corner + 1, above + 1]);
        mesh.triangles.push([corner, above + 1, above]);
    }
    Scene {
        meshes: vec![mesh],
        ..empty()
    }
}

fn empty() -> Scene {
    Scene {
        water: None,
        surface: None,
        sun: None,
        sky_radiance: [0.0; 3],
        camera: Camera {
            position_m: DVec3::ZERO,
            forward: DVec3::X,
            right: -DVec3::Y,
            down: -DVec3::Z,
            width: 1,
            height: 1,
            focal_px: DVec2::ONE,
            centre_px: DVec2::splat(0.5),
            lens: Lens::default(),
            opening: None,
            port: None,
        },
        snow: None,
        spectral: None,
        lamps: Vec::new(),
        quads: Vec::new(),
        meshes: Vec::new(),
        materials: vec![Material {
            reflectance: [0.5; 3],
            ..Material::default()
        }],
        textures: Vec::new(),
        sensor: None,
        render: RenderSettings {
            samples_per_pixel: 1,
            max_bounces: 0,
        },
        warnings: Vec::new(),
    }
}
