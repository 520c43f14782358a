//! Shared functions of the shaders over tables of inputs, against their twins in f64.

use std::{
    f64::consts::TAU,
    path::Path,
    sync::{LazyLock, Mutex},
};

use glam::DVec3;
use uw_media::phase::PhaseTable;

use super::{
    AdapterChoice, Gpu, GpuError, faults::adapter_is_missing, layout::Dispatch, pipeline::Loaded,
    upload::Tables,
};
use crate::{
    integrator::{
        cpu::{bridge::Bridge, order::OrderLaw, spectral::Spectral},
        sampling::{Draws, Rng, directions},
    },
    prepare::{Medium, Prepared, Primitive},
    scene::Scene,
};

const SEED: u64 = 0x1234_5678_9abc;
const BATCH: u32 = 3;
const ROWS: usize = 2048;

/// Water with a surface, a disk lamp with a profile, two parallelograms; enough pixels for the tables.
const SCENE: &str = r#"
format = "uw-scene/1"
[water]
a = [0.45, 0.20, 0.05]
b = [0.9, 1.0, 0.1]
phase = { model = "fournier-forand", n = 1.10, backscatter_fraction = 0.0183 }
[surface]
height_m = 3.0
[camera]
position_m = [0.1, 0.2, 0.3]
forward = [1.0, 0.1, -0.1]
hfov_deg = 60.0
width = 64
height = 64
[[lamp]]
name = "disk"
position_m = [1.0, -0.3, 0.2]
forward = [-1.0, 0.1, 0.3]
intensity = [10.0, 5.0, 2.0]
half_angle_deg = 60.0
falloff = "cosine"
radius_m = 0.2
[[object]]
plane = { center_m = [1.5, 0.0, 0.0], normal = [-1.0, 0.2, 0.1], up = [0.0, 0.0, 1.0], size_m = [2.0, 3.0] }
reflectance = [0.2, 0.4, 0.6]
[[object]]
plane = { center_m = [0.0, 0.0, -2.0], normal = [0.0, 0.0, 1.0], up = [0.0, 1.0, 0.0], size_m = [4.0, 4.0] }
reflectance = [0.3, 0.5, 0.7]
"#;

static GPU: LazyLock<Result<Gpu, GpuError>> = LazyLock::new(|| Gpu::open(AdapterChoice::Best));
/// One probe at a time, because software adapters use all cores.
static TURN: Mutex<()> = Mutex::new(());

fn scene() -> Prepared {
    let scene = Scene::parse(SCENE, Path::new("."), "twins").unwrap_or_else(|e| panic!("{e}"));
    Prepared::build(&scene)
}

/// How far a number may be from its twin: `absolute + relative·|twin|`.
#[derive(Clone, Copy)]
struct Within {
    absolute: f64,
    relative: f64,
}

fn absolute(absolute: f64) -> Within {
    Within {
        absolute,
        relative: 0.0,
    }
}

fn relative(relative: f64) -> Within {
    Within {
        absolute: 1e-36,
        relative,
    }
}

/// The rows of `function` of the probe for `inputs`; `None` where there is no adapter.
fn probe(scene: &Prepared, function: u32, inputs: &[[f32; 4]]) -> Option<Vec<[f32; 4]>> {
    let gpu = match &*GPU {
        Ok(gpu) => gpu,
        Err(error) => {
            adapter_is_missing(error);
            return None;
        }
    };
    let _turn = TURN.lock().unwrap_or_else(|e| e.into_inner());
    let tables = Tables::build(scene, &[0]).expect("tables");
    let loaded = Loaded::new(gpu, scene, &tables).expect("fits");
    let pipeline = loaded.pipeline("probe/functions").expect("compiles");
    gpu.queue
        .write_buffer(&loaded.scratch, 0, bytemuck::cast_slice(inputs));
    let dispatch = Dispatch {
        seed_low: SEED as u32,
        seed_high: (SEED >> 32) as u32,
        batch: BATCH,
        pixel_count: inputs.len() as u32,
        max_events: function,
        slots: loaded.slots,
        lanes: loaded.lanes,
        ..bytemuck::Zeroable::zeroed()
    };
    loaded.run(&pipeline, &dispatch).expect("runs");
    let film = loaded.read_film().expect("comes back");
    let rows = film.chunks_exact(4).take(inputs.len());
    Some(rows.map(|r| [r[0], r[1], r[2], r[3]]).collect())
}

/// Compares `function` with `twin` on `inputs`.
fn compare(
    scene: &Prepared,
    function: u32,
    inputs: &[[f32; 4]],
    within: [Within; 4],
    twin: impl Fn([f32; 4]) -> [f64; 4],
) {
    let Some(found) = probe(scene, function, inputs) else {
        return;
    };
    for (input, row) in inputs.iter().zip(found) {
        let expected = twin(*input);
        for k in 0..4 {
            let allowed = within[k].absolute + within[k].relative * expected[k].abs();
            let error = (f64::from(row[k]) - expected[k]).abs();
            assert!(
                error <= allowed,
                "function {function}, number {k} at {input:?}: {} instead of {} (allowed {allowed})",
                row[k],
                expected[k]
            );
        }
    }
}

/// Rows of numbers in (0, 1).
fn uniform_rows(stream: u32) -> Vec<[f32; 4]> {
    let mut rng = Rng::new(1, 2, 3, stream);
    let row = |_| std::array::from_fn(|_| (rng.uniform() as f32).min(0.999_999));
    (0..ROWS).map(row).collect()
}

fn direction_of(u: f32, v: f32) -> DVec3 {
    let up = 2.0 * f64::from(u) - 1.0;
    let across = (1.0 - up * up).max(0.0).sqrt();
    let (sin, cos) = (TAU * f64::from(v)).sin_cos();
    DVec3::new(across * cos, across * sin, up)
}

/// A number between 10^-`decades` and 1, evenly in its logarithm.
fn spread(u: f32, decades: f32) -> f32 {
    10f32.powf(-decades * u)
}

#[test]
fn random_bits_are_equal() {
    let scene = scene();
    let bits = |i: u32| Rng::new(u64::from(i), 0, 0, 0).bits();
    let inputs: Vec<_> = (0..ROWS as u32)
        .map(|i| {
            // As bits: no number that a float cannot hold unchanged.
            let key = [bits(i) >> 9, bits(i + 7) % 4096, i % 3].map(f32::from_bits);
            [key[0], key[1], key[2], 0.0]
        })
        .collect();
    let Some(found) = probe(&scene, 0, &inputs) else {
        return;
    };
    for (input, row) in inputs.iter().zip(found) {
        let [pixel, index, stream] = [input[0], input[1], input[2]].map(f32::to_bits);
        let mut draws = Draws::new(SEED, pixel, BATCH, index, stream);
        let numbers = [
            draws.uniform(),
            draws.uniform(),
            draws.leading(2),
            draws.leading(5),
        ];
        for (number, got) in numbers.iter().zip(row) {
            let expected = (number * 4_294_967_296.0 - 0.5) as u32;
            // A float that is no number may come back as another one.
            if !f32::from_bits(expected).is_nan() {
                assert_eq!(got.to_bits(), expected, "{pixel} {index} {stream}");
            }
        }
    }
}

/// Cubics in f32 with the CPU's coefficients: rounding of four terms, a few 1e-7, more where they nearly cancel.
#[test]
fn phase_function_and_its_inverse_follow_the_tables() {
    let scene = scene();
    let table = scene
        .medium
        .as_ref()
        .map(|m| m.phase.clone())
        .expect("water");
    let inputs: Vec<_> = uniform_rows(1)
        .iter()
        .map(|r| {
            [
                spread(r[0], 30.0),
                f32::from_bits((r[1] * 2e9) as u32),
                0.0,
                0.0,
            ]
        })
        .collect();
    let within = [relative(1e-5), relative(1e-5), absolute(0.0), absolute(0.0)];
    compare(&scene, 1, &inputs, within, |r| {
        let u = (f64::from(r[1].to_bits()) + 0.5) / 4_294_967_296.0;
        [table.value(f64::from(r[0])), table.sample_x(u), 0.0, 0.0]
    });
}

/// The table of the inverse CDF that both sides use: |ΔCDF| <= 1e-4, and the angle within 1e-3 above 0.01°.
#[test]
fn inverse_cdf_has_the_stated_error() {
    use uw_media::phase::{FournierForand, Phase, PhaseFunction};
    let scene = scene();
    let phase = Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"));
    let inputs: Vec<_> = uniform_rows(2)
        .iter()
        .map(|r| {
            [
                0.5,
                f32::from_bits((spread(r[1], 9.0) * 4.29e9) as u32 & 0x7fff_ffff),
                0.0,
                0.0,
            ]
        })
        .collect();
    let Some(found) = probe(&scene, 1, &inputs) else {
        return;
    };
    for (input, row) in inputs.iter().zip(found) {
        let u = (f64::from(input[1].to_bits()) + 0.5) / 4_294_967_296.0;
        let x = f64::from(row[1]);
        assert!((phase.cdf(x) - u).abs() <= 1e-4, "{u}: {x}");
        let exact = phase.inverse_cdf(u);
        let angle = |x: f64| 2.0 * x.sqrt().asin();
        if angle(exact) > 0.01f64.to_radians() {
            assert!(
                (angle(x) / angle(exact) - 1.0).abs() < 1e-3,
                "{u}: {x} {exact}"
            );
        }
    }
}

/// Series of our own, made for 1e-6; logarithms of the device 1e-6; the angle 3e-6 by its series.
#[test]
fn elementary_functions_are_accurate() {
    let scene = scene();
    let inputs: Vec<_> = uniform_rows(3)
        .iter()
        .enumerate()
        .map(|(i, r)| {
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            [
                sign * 20.0 * spread(r[0], 8.0),
                sign * 0.999 * spread(r[1], 8.0),
                if i % 3 == 0 {
                    1.0 - spread(r[2], 6.0) * 0.9
                } else {
                    r[2]
                },
                20.0 * r[3] - 10.0,
            ]
        })
        .collect();
    let within = [
        relative(4e-6),
        relative(4e-6),
        Within {
            absolute: 1e-9,
            relative: 4e-6,
        },
        Within {
            absolute: 3e-6,
            relative: 3e-6,
        },
    ];
    compare(&scene, 2, &inputs, within, |r| {
        let r = r.map(f64::from);
        [r[0].exp_m1(), r[1].ln_1p(), -r[2].ln(), r[3].atan2(r[0])]
    });
}

/// Directions are rounded to 6e-8 at each of a dozen steps; the angle between them, taken from their difference, to 2e-7.
#[test]
fn turned_directions_agree() {
    let scene = scene();
    let inputs: Vec<_> = uniform_rows(4)
        .iter()
        .map(|r| [r[0], r[1], spread(r[2], 20.0), r[3]])
        .collect();
    let turned = |r: [f32; 4]| {
        let d = direction_of(r[0], r[1]);
        (d, directions::turn(d, f64::from(r[2]), f64::from(r[3])))
    };
    compare(
        &scene,
        3,
        &inputs,
        [
            absolute(2e-6),
            absolute(2e-6),
            absolute(2e-6),
            absolute(1e-6),
        ],
        |r| {
            let (d, t) = turned(r);
            [t.x, t.y, t.z, directions::sin2_half(d, t)]
        },
    );
    let Some(found) = probe(&scene, 3, &inputs) else {
        return;
    };
    for (input, row) in inputs.iter().zip(found) {
        let (d, t) = turned(*input);
        let error = f64::from(row[3]).sqrt() - directions::sin2_half(d, t).sqrt();
        assert!(error.abs() < 4e-7, "{input:?}: half angle off by {error}");
    }
    compare(&scene, 4, &inputs, [absolute(2e-6); 4], |r| {
        let d = directions::cosine_hemisphere(
            direction_of(r[0], r[1]),
            f64::from(r[2]),
            f64::from(r[3]),
        );
        [d.x, d.y, d.z, 0.0]
    });
}

/// Near the critical angle the refracted cosine is the root of a small difference: 3e-4 of error there, 2e-6 elsewhere.
#[test]
fn the_interface_reflects_and_refracts_alike() {
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
    let scene = scene();
    let inputs = uniform_rows(6);
    let Some(found) = probe(&scene, 6, &inputs) else {
        return;
    };
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

/// Directions within 1e-5 of the cone's edge may fall to either side; at the disk's rim likewise.
#[test]
fn lamps_shine_alike() {
    let scene = scene();
    let lamp = &scene.lamps[0];
    let mut inputs = uniform_rows(7);
    let origin = scene.camera.position_m;
    inputs.retain(|r| {
        let d = direction_of(r[0], r[1]);
        let at_edge = (lamp.forward.dot(d) - 0.5).abs() < 1e-5;
        let cosine = -lamp.forward.dot(d);
        let t = lamp.forward.dot(origin - lamp.position) / cosine;
        let rim = (origin + t * d).distance(lamp.position) - lamp.radius;
        !at_edge && rim.abs() > 1e-4
    });
    // A table of 2048 entries in the sine of half the angle: 1e-6; the cosine at the disk 1e-6 absolute.
    let within = [
        absolute(3e-6),
        absolute(1e-6),
        absolute(2e-6),
        relative(1e-4),
    ];
    compare(&scene, 7, &inputs, within, |r| {
        let d = direction_of(r[0], r[1]);
        let seen = lamp.radiance_along(origin, d, f64::INFINITY);
        [
            lamp.relative_intensity(d),
            lamp.facing_area(d),
            lamp.sample_point(f64::from(r[2]), f64::from(r[3])).x - origin.x,
            seen.map_or(0.0, |s| s.1[0]),
        ]
    });
}

/// Exponents of up to 60 in f32: 4e-6 each, and as much by the device's exponential.
#[test]
fn weights_of_paths_agree() {
    let scene = scene();
    let medium: &Medium = scene.medium.as_ref().expect("water");
    let inputs: Vec<_> = uniform_rows(8)
        .iter()
        .map(|r| [r[0], 20.0 * r[1], 5.0 * r[2], 0.0])
        .collect();
    let within = [
        relative(1e-4),
        relative(1e-4),
        relative(1e-4),
        absolute(0.0),
    ];
    compare(&scene, 8, &inputs, within, |r| {
        let strategies = &medium.by_scattering;
        let mut s = Spectral::start(strategies, f64::from(r[0]));
        s.scatter(medium, strategies, f64::from(r[1]));
        s.pass(medium, strategies, f64::from(r[2]));
        let w = s.weight();
        [w[0], w[1], w[2], s.chosen as f64]
    });
}

/// Orders are whole numbers: where `u` lies within the rounding of a step of the law they may differ by one.
#[test]
fn orders_of_bridges_agree() {
    let scene = scene();
    let medium: &Medium = scene.medium.as_ref().expect("water");
    let law = OrderLaw::new(medium.largest_albedo());
    let inputs: Vec<_> = uniform_rows(9)
        .iter()
        .map(|r| [30.0 * spread(r[0], 4.0), r[1], (100.0 * r[2]).floor(), 0.0])
        .collect();
    let within = [
        absolute(1.0),
        absolute(1.0),
        relative(1e-5),
        Within {
            absolute: 1e-5,
            relative: 1e-6,
        },
    ];
    let orders = |r: [f32; 4]| {
        let (depth, u) = (f64::from(r[0]), f64::from(r[1]));
        [law.sample(depth, u), law.sample_scattered(depth, u)].map(|k| k.map_or(-1.0, |k| k as f64))
    };
    compare(&scene, 9, &inputs, within, |r| {
        let [all, scattered] = orders(r);
        [
            all,
            scattered,
            law.scattered_share(f64::from(r[0])),
            law.ln_tail(r[2] as usize),
        ]
    });
    let Some(found) = probe(&scene, 9, &inputs) else {
        return;
    };
    let different = inputs.iter().zip(found).filter(|(input, row)| {
        let [all, scattered] = orders(**input);
        f64::from(row[0]) != all || f64::from(row[1]) != scattered
    });
    assert!(different.count() < 4);
}

/// The same random numbers give the same bridge: errors of a dozen turns of 1e-7 each, times the stretch of the shape.
#[test]
fn bridges_have_the_same_shape() {
    let scene = scene();
    let medium: &Medium = scene.medium.as_ref().expect("water");
    let table: &PhaseTable = &medium.phase;
    let inputs: Vec<_> = uniform_rows(10)
        .iter()
        .map(|r| {
            [
                0.5 + r[0],
                2.0 * r[1] - 1.0,
                2.0 * r[2] - 1.0,
                (1.0 + 7.0 * r[3]).floor(),
            ]
        })
        .collect();
    let Some(found) = probe(&scene, 10, &inputs) else {
        return;
    };
    let mut made = 0;
    for (input, row) in inputs.iter().zip(found) {
        let order = input[3] as usize;
        let mut draws = Draws::new(SEED, (input[0] * 1000.0) as u32, BATCH, 0, 0);
        let end = DVec3::new(
            f64::from(input[0]),
            f64::from(input[1]),
            f64::from(input[2]),
        );
        let mut bridge = Bridge::default();
        let drawn = bridge.draw(DVec3::ZERO, end, order, table, medium.c_min, &mut draws);
        assert_eq!(drawn, row[0] > 0.0, "{input:?}");
        if !drawn {
            continue;
        }
        made += 1;
        let stretch = bridge.length / bridge.distance;
        let allowed = 1e-5 * stretch * stretch;
        let (last, x) = (bridge.vertices[order - 1].x, bridge.sin2[order - 1]);
        assert!(
            (f64::from(row[0]) / bridge.length - 1.0).abs() < allowed,
            "{input:?}"
        );
        assert!(
            (f64::from(row[1]) - bridge.first.z).abs() < allowed,
            "{input:?}"
        );
        assert!(
            (f64::from(row[2]) - last).abs() < allowed * bridge.length,
            "{input:?}"
        );
        assert!((f64::from(row[3]) / x - 1.0).abs() < 1e-5, "{input:?}");
    }
    assert!(made > ROWS / 2);
}

/// Rounding of the sum of three vectors.
#[test]
fn camera_rays_agree() {
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
    compare(&scene, 11, &inputs, [absolute(4e-7); 4], |r| {
        let at = |whole: f32, rest: f32| f64::from(whole.to_bits()) + f64::from(rest);
        let d = scene.camera.direction(at(r[0], r[2]), at(r[1], r[3]));
        [d.x, d.y, d.z, 0.0]
    });
}
