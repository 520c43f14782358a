//! Lamps, bridges to them, and the weights of the paths that they make.

use uw_media::phase::PhaseTable;

use super::{
    BATCH, FUNCTIONS, LAMPS, ROWS, SCENE, SEED, Within, absolute, adapter, compare, direction_of,
    draws_of, in_box, parsed, probe, relative, scene, spread, three_numbers, uniform_rows,
};
use crate::{
    integrator::{
        cpu::{
            bridge::Bridge,
            camera_ray::{CameraRay, Segment},
            equiangular::Equiangular,
            lamp_landing::{Landing, Scouts},
            lamp_target::{LampWorkspace, Target},
            lamp_walk::{FirstSegment, Walk, lit_length2, survival, survival_in_veil},
            order::OrderLaw,
            spectral::Spectral,
            ways::{Junction, Vertex, contribution},
        },
        sampling::Draws,
    },
    prepare::{Medium, Prepared, SurfacePoint},
};
use glam::DVec3;

/// Directions within 1e-5 of the cone's edge may fall to either side; at the disk's rim likewise.
#[test]
fn lamps_shine_alike() {
    let Some(gpu) = adapter() else { return };
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
    compare(gpu, &scene, FUNCTIONS, 7, &inputs, within, |r| {
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
    let Some(gpu) = adapter() else { return };
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
    compare(gpu, &scene, FUNCTIONS, 8, &inputs, within, |r| {
        let strategies = &medium.by_scattering;
        let mut s = Spectral::start(strategies, f64::from(r[0]));
        s.scatter(medium, strategies, f64::from(r[1]));
        s.pass(medium, strategies, f64::from(r[2]));
        let w = s.weight();
        [w[0], w[1], w[2], s.chosen as f64]
    });
}

/// Orders are whole numbers: where `u` lies within the rounding of a step of the law they may differ by one. `inputs` are
/// an optical depth, `u`, and an order of the law's tail.
fn assert_orders_agree(scene: &Prepared, inputs: &[[f32; 4]], most_different: usize) {
    let Some(gpu) = adapter() else { return };
    let medium: &Medium = scene.medium.as_ref().expect("water");
    let law = OrderLaw::new(medium.largest_albedo());
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
    compare(gpu, scene, FUNCTIONS, 9, inputs, within, |r| {
        let [all, scattered] = orders(r);
        [
            all,
            scattered,
            law.scattered_share(f64::from(r[0])),
            law.ln_tail(r[2] as usize),
        ]
    });
    let found = probe(gpu, scene, FUNCTIONS, 9, inputs);
    let different = inputs.iter().zip(found).filter(|(input, row)| {
        let [all, scattered] = orders(**input);
        f64::from(row[0]) != all || f64::from(row[1]) != scattered
    });
    let different = different.count();
    assert!(different <= most_different, "{different} orders differ");
}

#[test]
fn orders_of_bridges_agree() {
    let inputs: Vec<_> = uniform_rows(9)
        .iter()
        .map(|r| [30.0 * spread(r[0], 4.0), r[1], (100.0 * r[2]).floor(), 0.0])
        .collect();
    assert_orders_agree(&scene(), &inputs, 3);
}

/// Depths at which the first terms of the law are below the range of a float, in water that absorbs little.
#[test]
fn orders_of_bridges_through_thick_water_agree() {
    let text = SCENE.replace("a = [0.45, 0.20, 0.05]", "a = [0.001, 0.001, 0.001]");
    let inputs: Vec<_> = uniform_rows(9)
        .iter()
        .map(|r| [60.0 + 340.0 * r[0], r[1], 100.0, 0.0])
        .collect();
    // The logarithm of a term has an error of 1e-4 after a hundred sums, so that one in some hundred steps is another.
    assert_orders_agree(&parsed(&text), &inputs, ROWS / 100);
}

/// The same random numbers give the same bridge: errors of a dozen turns of 1e-7 each, times the stretch of the shape.
#[test]
fn bridges_have_the_same_shape() {
    let Some(gpu) = adapter() else { return };
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
    let found = probe(gpu, &scene, FUNCTIONS, 10, &inputs);
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

/// Sums of logarithms of up to 20, rounded to 1e-6 of themselves in a handful of steps, and the bridge's own errors, which
/// grow with the stretch of its shape.
#[test]
fn ways_of_making_a_path_weigh_the_same() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let medium: &Medium = scene.medium.as_ref().expect("water");
    let inputs = uniform_rows(13);
    let found = probe(gpu, &scene, LAMPS, 1, &inputs);
    let mut made = 0;
    for (row, (input, found)) in (0..).zip(inputs.iter().zip(found)) {
        let Some((light, stretch)) = way_of_row(&scene, medium, row, *input) else {
            continue;
        };
        made += 1;
        let allowed = 1e-4 + 2e-5 * stretch * stretch;
        for k in 0..3 {
            let ratio = f64::from(found[k]) / light[k];
            assert!(
                (ratio - 1.0).abs() < allowed,
                "row {row} {input:?}: {} instead of {} (within {allowed})",
                found[k],
                light[k]
            );
        }
    }
    assert!(made > ROWS / 2, "{made}");
}

/// The light of the path that the probe makes of a row, and how much longer it is than straight.
fn way_of_row(
    scene: &Prepared,
    medium: &Medium,
    row: u32,
    input: [f32; 4],
) -> Option<([f64; 3], f64)> {
    let a = input.map(f64::from);
    let mut draws = draws_of(row);
    let mut work = LampWorkspace::new(Some(medium));
    let strategies = &medium.by_scattering;
    let mut spectral = Spectral::start(strategies, a[1]);
    let mut position = scene.camera.position_m + DVec3::new(0.2, 0.0, 0.0);
    let mut length = 0.0;
    let rooted = input[0] < 0.5;
    let count = 1 + (3.0 * input[2]) as usize;
    work.trail.start();
    for i in 0..count {
        let on_surface = rooted && i == 0;
        if !on_surface {
            let u = three_numbers(&mut draws);
            let t = 0.1 + 0.4 * u[0];
            position += t * direction_of(u[1], u[2]);
            length += t;
            spectral.scatter(medium, strategies, t);
        }
        let vertex = Vertex {
            position,
            length,
            lobe: 0.0,
            reflected: 1.0,
        };
        if on_surface {
            work.trail.root(vertex, input[3] < 0.7, input[3] < 0.3);
        } else {
            work.trail.vertices.push(vertex);
        }
        if i + 1 < count {
            work.trail.leave(0.05 + draws.uniform());
        }
    }
    let order = (4.0 * draws.uniform()) as usize;
    let lamp = scene.lamps[0].position;
    let (phase, c_min) = (&medium.phase, medium.c_min);
    if !work
        .bridge
        .draw(position, lamp, order, phase, c_min, &mut draws)
    {
        return None;
    }
    work.crossings = vec![0.9; order + 1];
    let junction = Junction {
        lobe: 0.3,
        lamp,
        facing: 0.01,
    };
    let worth = |first: DVec3, emission: DVec3| {
        let beam = if emission.x < -0.3 { 1.0 } else { 0.0 };
        beam * (1.5 + first.z)
    };
    let axis = (lamp - position).normalize();
    let chosen = work
        .bridge
        .choose_roll(position, axis, draws.uniform(), worth);
    let factor = chosen? * (2.0 + work.bridge.first.z);
    let light = contribution(Some(medium), &spectral, &work, &junction).map(|l| factor * l);
    Some((light, work.bridge.length / work.bridge.distance))
}

/// The distance of the ray from the lamp is a difference of lengths: 1e-7 of error, relative to itself. Of the sampled
/// distance the error counts as a share of the distribution. Other draws are as dense as in half a free path.
#[test]
fn distances_beside_a_lamp_agree() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let camera = scene.camera.position_m;
    let centre = scene.lamps[1].position;
    let target = Target {
        lamp: 1,
        mirrored: false,
        weight: 1.0,
    };
    let inputs = uniform_rows(14);
    let found = probe(gpu, &scene, LAMPS, 2, &inputs);
    let mut drawn = 0;
    for (input, found) in inputs.iter().zip(found) {
        let a = input.map(f64::from);
        let towards = centre - camera + 0.1 * DVec3::new(a[0] - 0.5, a[1] - 0.5, 0.0);
        let ray = Segment {
            origin: camera,
            direction: towards.normalize(),
            length: 0.5 + 3.0 * a[2],
        };
        let (law, share) = Equiangular::beside(&scene, target, &ray, 0.5);
        drawn += usize::from(share > 0.0);
        let foot = (centre - camera).dot(ray.direction);
        let height = (centre - camera - foot * ray.direction).length();
        let within = 1e-5 + 1e-6 / height;
        assert!(
            (f64::from(found[0]) - share).abs() < within,
            "{input:?}: {} {share}",
            found[0]
        );
        let t = law.sample(a[3]);
        let moved = (f64::from(found[1]) - t).abs() * law.density(t);
        assert!(moved < 1e-5 + 4e-7 / height, "{input:?}: {} {t}", found[1]);
        let density = law.density(a[3] * ray.length);
        let error = (f64::from(found[2]) / density - 1.0).abs();
        assert!(error < within, "{input:?}: {} {density}", found[2]);
    }
    assert!(drawn > ROWS / 2, "{drawn}");
}

/// An exponential of up to 4, and quotients; along a ray that ends on a surface and along an open one.
#[test]
fn roulette_of_walks_agrees() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let inputs = uniform_rows(15);
    compare(gpu, &scene, LAMPS, 3, &inputs, [relative(1e-5); 4], |r| {
        let direction = if r[0] < 0.5 { DVec3::X } else { DVec3::NEG_X };
        let ray = CameraRay::trace(&scene, scene.camera.position_m, direction);
        let mut walk = walk_in_box(&scene, [r[0], r[1], r[2]]);
        walk.lit_length2 = lit_length2(&scene, &[0, 1], &ray);
        let weight = f64::from(r[3]);
        let in_water = survival(&scene, &[0, 1], &walk, weight);
        walk.best = 10.0 * f64::from(r[0]);
        let in_veil = survival_in_veil(&scene, &[0, 1], &mut walk, weight);
        walk.land(&scene, &[0, 1]);
        walk.met_surface = true;
        let from_surface = survival(&scene, &[0, 1], &walk, weight);
        [in_water, from_surface, in_veil, walk.best]
    });
}

/// Pictures do not show an error here: any estimate gives the same mean. Exponentials of up to 15; the profile of the
/// disk has an edge, where directions may fall to either side.
#[test]
fn landings_are_worth_the_same() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let medium: &Medium = scene.medium.as_ref().expect("water");
    let ray = CameraRay::trace(&scene, scene.camera.position_m, DVec3::X);
    let scouts = Scouts {
        scene: &scene,
        active: &[0, 1],
        ray: &ray,
        first: FirstSegment::Free,
        max_events: usize::MAX,
        lit_length2: 1.0,
    };
    let mut work = LampWorkspace::new(Some(medium));
    work.targets = [(0, false), (1, true)]
        .map(|(lamp, mirrored)| Target {
            lamp,
            mirrored,
            weight: 1.0,
        })
        .to_vec();
    let inputs = uniform_rows(16);
    let found = probe(gpu, &scene, LAMPS, 4, &inputs);
    let mut different = 0;
    for (row, (input, found)) in (0..).zip(inputs.iter().zip(found)) {
        let a = input.map(f64::from);
        let mut walk = walk_in_box(&scene, [input[0], input[1], input[2]]);
        walk.unscattered = input[3] < 0.3;
        walk.mirrored = input[3] > 0.8;
        let start = Spectral::start(&medium.by_scattering, a[3]);
        walk.spectral = start.after(medium, (6.0 * input[3]) as usize, 4.0 * a[3]);
        let u = three_numbers(&mut draws_of(row));
        let normal = direction_of(u[0], u[1]);
        let point = SurfacePoint {
            normal,
            shading_normal: normal,
            reflectance: [u[2], 0.5, 0.2],
            emission: [0.0; 3],
        };
        let worth = scouts.worth(&Landing { walk, point }, medium, &work);
        different += usize::from((f64::from(found[0]) / worth - 1.0).abs() > 1e-4);
    }
    assert!(different < 8, "{different} of {ROWS}");
}

/// A walk that stands at a point of the box.
fn walk_in_box(scene: &Prepared, numbers: [f32; 3]) -> Walk {
    let segment = Segment {
        origin: in_box(scene, numbers),
        direction: DVec3::X,
        length: 1.0,
    };
    Walk::start(segment, 1.0)
}
