//! Water that varies with depth and place, lit by lamps against quadrature, and where it only seems to vary.

use uw_render::{prepare::Prepared, scene::Scene};
use uw_tests::{
    file,
    gpu::{Backend, everywhere},
    measure_prepared,
    same_numbers::{PART, assert_same_radiances},
};

use crate::agreement::assert_same_means;

/// Of each pixel on the vector units where waters are compared.
const SAMPLES: u32 = 1024;
/// The same where quadrature is.
const SAMPLES_SCATTERED_ONCE: u32 = 8192;

/// Rows of a table in `data`, cells by the header's names.
fn rows(name: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(file("data").join(name)).expect("readable");
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect()
}

fn numbers(cell: &str, separator: char) -> Vec<f64> {
    cell.split(separator)
        .map(|x| x.parse().expect(cell))
        .collect()
}

/// A profile of points written depth:a:b.
fn profile(points: &str) -> String {
    let entries = points.split(' ').map(|point| {
        let [depth, a, b] = numbers(point, ':')[..] else {
            panic!("{point}")
        };
        format!("{{ depth_m = {depth:?}, a = [{a:?}, {a:?}, {a:?}], b = [{b:?}, {b:?}, {b:?}] }}")
    });
    format!("profile = [ {} ]\n", entries.collect::<Vec<_>>().join(", "))
}

/// Clouds written x:y:depth:sigma:a:b.
fn plumes(points: &str) -> String {
    let clouds = points.split(' ').filter(|point| !point.is_empty()).map(|point| {
        let [x, y, depth, sigma, a, b] = numbers(point, ':')[..] else { panic!("{point}") };
        format!(
            "[[water.plume]]\ncenter_m = [{x:?}, {y:?}, {:?}]\nsigma_m = {sigma:?}\na = [{a:?}, {a:?}, {a:?}]\n\
             b = [{b:?}, {b:?}, {b:?}]\n",
            -depth
        )
    });
    clouds.collect()
}

fn phase(name: &str) -> &'static str {
    match name {
        "hg0.8" => "phase = { model = \"henyey-greenstein\", g = 0.8 }\n",
        "petzold" => "phase = { model = \"petzold\" }\n",
        _ => "phase = { model = \"fournier-forand\", n = 1.10, backscatter_fraction = 0.0183 }\n",
    }
}

fn parsed(text: &str) -> Scene {
    let text = format!("format = \"uw-scene/1\"\n{text}");
    Scene::parse(&text, &file(""), "varying.toml").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Once-scattered light of a point lamp of 1 W/sr in layers and clouds.
#[test]
fn once_scattered_light_of_a_lamp_is_as_quadrature_says() {
    everywhere(|backend| {
        for row in rows("lamp_varying_water.csv") {
            let [
                case,
                phase_name,
                points,
                clouds,
                camera,
                direction,
                lamp,
                _,
                expected,
            ] = &row[..]
            else {
                panic!("{row:?}")
            };
            let place = |cell: &str| {
                let [x, y, depth] = numbers(cell, ' ')[..] else {
                    panic!("{cell}")
                };
                format!("[{x:?}, {y:?}, {:?}]", -depth)
            };
            let scene = parsed(&format!(
                "[water]\n{}{}{}[surface]\nrefractive = false\n[camera]\nposition_m = {}\nforward = {}\nup = [0.3, 0.8, 0.1]\n\
                 hfov_deg = 1e-4\nwidth = 16\nheight = 16\n[[lamp]]\nposition_m = {}\nintensity = [1.0, 1.0, 1.0]\n",
                profile(points),
                phase(phase_name),
                plumes(clouds),
                place(camera),
                place(direction),
                place(lamp),
            ));
            let scene = Prepared::build(&scene);
            if !matches!(backend, Backend::VectorUnits) {
                let sampled = (SAMPLES_SCATTERED_ONCE / PART, 1, 5);
                assert_same_radiances(backend, case, &scene, sampled);
                continue;
            }
            let expected: f64 = expected.parse().expect("a number");
            let (mean, error) = measure_prepared(backend, &scene, SAMPLES_SCATTERED_ONCE, 1, 5);
            let (off, noise) = (mean[1] / expected - 1.0, error[1] / expected);
            println!("  {case} {direction}: {off:+.2e} ± {noise:.1e}");
            assert!(
                off.abs() < 2e-3 + 3.0 * noise,
                "{case}: {} {expected}",
                mean[1]
            );
            assert!(noise < 4e-3, "{case}: too noisy to tell");
        }
    });
}

/// Layers that say the same everywhere are the water without them, bit by bit up to the mean of equal numbers; layers that
/// differ by less than anything shows go the way of layers.
#[test]
fn equal_layers_are_homogeneous_water() {
    everywhere(|backend| {
        let rest = "phase = { model = \"fournier-forand\", n = 1.10, backscatter_fraction = 0.0183 }\n[surface]\n[sun]\n\
                    zenith_deg = 30.0\nirradiance = [1.0, 1.0, 1.0]\n[sky]\nradiance = [0.1, 0.1, 0.1]\n[camera]\n\
                    position_m = [0.0, 0.0, -2.0]\nforward = [1.0, 0.0, -0.2]\nhfov_deg = 1e-4\nwidth = 12\nheight = 12\n\
                    [[lamp]]\nposition_m = [0.0, 0.4, -2.0]\nintensity = [9.0, 8.0, 7.0]\nradius_m = 0.05\n\
                    forward = [1.0, 0.0, 0.0]\nhalf_angle_deg = 60.0\n[[object]]\nplane = { center_m = [2.0, 0.0, -2.0], \
                    normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [3.0, 3.0] }\nreflectance = [0.5, 0.4, 0.3]\n";
        let same = "a = [0.3, 0.1, 0.05], b = [0.4, 0.5, 0.6]";
        let nearly = "a = [0.3000001, 0.1, 0.05], b = [0.4, 0.5, 0.6]";
        let profile = |second: &str| {
            format!(
                "profile = [ {{ depth_m = 0.5, {same} }}, {{ depth_m = 2.1, {second} }}, {{ depth_m = 2.1, {same} }} ]\n"
            )
        };
        let plain = parsed(&format!(
            "[water]\n{}\n{rest}",
            same.replace("], b", "]\nb")
        ));
        let equal = parsed(&format!("[water]\n{}{rest}", profile(same)));
        let layered = parsed(&format!("[water]\n{}{rest}", profile(nearly)));
        let [equal, layered, plain] = [equal, layered, plain].map(|scene| Prepared::build(&scene));
        assert!(layered.layers.is_some());
        if matches!(backend, Backend::VectorUnits) {
            let of = |scene, seed| measure_prepared(backend, scene, SAMPLES, 0, seed);
            assert_same_means(backend, of(&layered, 1), of(&plain, 2));
        } else {
            let sampled = (SAMPLES / PART, 0, 1);
            assert_same_radiances(backend, "layers", &layered, sampled);
        }
        let samples = backend.samples(64);
        let [equal, plain] =
            [equal, plain].map(|scene| measure_prepared(backend, &scene, samples, 0, 3).0);
        for k in 0..3 {
            assert!(
                (equal[k] / plain[k] - 1.0).abs() < 1e-6,
                "{equal:?} {plain:?}"
            );
        }
    });
}

/// A profile with more points than a short search finds is the water of the few between which they lie on straight lines.
#[test]
fn many_points_on_straight_lines_are_the_water_of_few() {
    let rest = "phase = { model = \"henyey-greenstein\", g = 0.8 }\n[surface]\n[sun]\nzenith_deg = 30.0\nirradiance = [1.0, 1.0, 1.0]\n\
                [camera]\nposition_m = [0.0, 0.0, -2.6]\nforward = [1.0, 0.0, -0.2]\nhfov_deg = 1e-4\nwidth = 16\nheight = 16\n\
                [[lamp]]\nposition_m = [0.5, 0.4, -3.4]\nintensity = [9.0, 8.0, 7.0]\n";
    let scene = |between: usize| {
        let [upper, lower] = [[0.3, 0.1], [0.5, 1.5]];
        let points = (0..=between).map(|k| {
            let share = k as f64 / between as f64;
            let at = |i: usize| upper[i] + share * (lower[i] - upper[i]);
            format!("{}:{}:{}", 4.0 * share, at(0), at(1))
        });
        let points = profile(&points.collect::<Vec<_>>().join(" "));
        Prepared::build(&parsed(&format!("[water]\n{points}{rest}")))
    };
    let [few, many] = [scene(1), scene(30)];
    assert_eq!(many.layers.as_ref().map(|l| l.depths_m.len()), Some(31));
    everywhere(|backend| {
        if matches!(backend, Backend::VectorUnits) {
            let of = |scene, seed| measure_prepared(backend, scene, 4 * SAMPLES, 0, seed);
            assert_same_means(backend, of(&many, 1), of(&few, 2));
        } else {
            assert_same_radiances(backend, "many points", &many, (SAMPLES / PART, 0, 1));
        }
    });
}

/// Jerlov types by depth go by wavelength as layers of three numbers do where wavelengths do not matter: two types, one below
/// the other, seen from the upper one, are neither.
#[test]
fn types_by_depth_go_by_wavelength() {
    let scene = |water: &str| {
        parsed(&format!(
            "[water]\n{water}[surface]\n[camera]\nposition_m = [0.0, 0.0, -3.0]\nforward = [1.0, 0.0, -0.3]\n\
             response = \"canon5d2\"\nhfov_deg = 1e-4\nwidth = 16\nheight = 16\n[[lamp]]\nposition_m = [0.0, 0.4, -3.0]\n\
             intensity = [9.0, 8.0, 7.0]\n"
        ))
    };
    let both =
        "profile = [ { depth_m = 3.2, jerlov = \"IB\" }, { depth_m = 3.2, jerlov = \"3C\" } ]\n";
    // Equal layers would be none.
    let same = "profile = [ { depth_m = 3.2, jerlov = \"IB\" }, \
         { depth_m = 3.2, jerlov = { between = [\"IB\", \"II\"], share = 1e-7 } } ]\n";
    let scenes = [same, both, "jerlov = \"IB\"\n"].map(|water| Prepared::build(&scene(water)));
    everywhere(|backend| {
        if !matches!(backend, Backend::VectorUnits) {
            for (scene, seed) in scenes.iter().zip(1..) {
                assert_same_radiances(backend, "types", scene, (SAMPLES / PART, 0, seed));
            }
            return;
        }
        let of = |i: usize| measure_prepared(backend, &scenes[i], SAMPLES, 0, 1 + i as u64);
        let (layered, mixed, plain) = (of(0), of(1), of(2));
        assert_same_means(backend, layered, plain);
        for k in 0..3 {
            assert!(
                (mixed.0[k] / plain.0[k] - 1.0).abs() > 0.05,
                "{mixed:?} {plain:?}"
            );
        }
    });
}
