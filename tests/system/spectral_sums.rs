//! Scenes by wavelength against renders at single wavelengths of the same program, added up with the camera's response.

use uw_media::{
    Iops, Spectrum,
    spectral::{Curve, primaries},
};
use uw_render::irradiance::{DepthIrradiance, Estimate, IrradiancePlan};
use uw_render::prepare::Prepared;
use uw_render::scene::{Lamp, Material, Scene};
use uw_tests::{
    gpu::{Backend, everywhere},
    measure_prepared,
    same_numbers::{Means, PART, assert_same_irradiances, assert_same_radiances},
};

use crate::spectral::{LAMP, VIEW, column, parsed, plane};

fn at_depth(parts: &[&str], depth_m: f64) -> Scene {
    parsed(&parts.concat().replace("DEPTH", &format!("{:?}", -depth_m)))
}

/// The groove between two bumpy plates whose spectrum is measured, seen along its middle: light goes from one to the other.
const GROOVE: &str = "[[object]]\ngltf = \"benchmarks/bumpy_plate.glb\"\nreflectance = { spectrum = \"YELLOW\" }\nscale = 0.125\n\
     rotation_deg = [0.0, -45.0, 0.0]\ntranslation_m = [1.2, 0.0, 0.3535]\n\
     [[object]]\ngltf = \"benchmarks/bumpy_plate.glb\"\nreflectance = { spectrum = \"YELLOW\" }\nscale = 0.125\n\
     rotation_deg = [0.0, 45.0, 0.0]\ntranslation_m = [1.2, 0.0, -0.3535]\n";

const DAYLIGHT: &str = "[surface]\n[sun]\nzenith_deg = 30.0\nirradiance = [1.0, 1.0, 1.0]\nspectrum = \"clear-sky\"\n[sky]\n\
     radiance = [0.05, 0.05, 0.05]\nspectrum = \"clear-sky\"\n";

/// Scenes with their names.
fn scenes() -> [(&'static str, Scene); 7] {
    let water = |jerlov: &str| format!("[water]\njerlov = \"{jerlov}\"\nbands = \"spectral\"\n");
    let canon = VIEW.to_owned() + "response = \"canon5d2\"\n";
    let led = LAMP.to_owned() + "spectrum = \"led-5000k\"\n";
    let second = LAMP.replace("0.4, DEPTH", "-0.4, DEPTH") + "spectrum = \"halogen\"\n";
    let day = DAYLIGHT;
    let folder = tempfile::tempdir().expect("a folder");
    let yellow = folder.path().join("yellow.csv");
    let rows = column("spectra/colorchecker_reflectances.csv", "yellow");
    let rows: String = rows.iter().map(|(nm, x)| format!("{nm},{x}\n")).collect();
    std::fs::write(&yellow, format!("wavelength_nm,reflectance\n{rows}")).expect("written");
    let groove = GROOVE.replace("YELLOW", &yellow.display().to_string());
    let into_groove = canon.replace("hfov_deg = 20.0", "hfov_deg = 3.0");
    let groove = at_depth(&[&water("III"), &into_groove, &led, &groove], 0.0);
    let of_spectrum = |m: &Material| m.spectrum.is_some() && m.texture.is_none();
    assert!(groove.materials.iter().all(of_spectrum));
    [
        (
            "lamp, II, 3 m",
            at_depth(&[&water("II"), &canon, &led, &plane(3.0, 0.0)], 0.0),
        ),
        (
            "lamp, 5C, 1.5 m",
            at_depth(&[&water("5C"), VIEW, LAMP, &plane(1.5, 0.0)], 0.0),
        ),
        (
            "lamp, 3C, no target",
            at_depth(&[&water("3C"), &canon, &led], 0.0),
        ),
        (
            "daylight, IB, 10 m deep",
            at_depth(&[&water("IB"), day, VIEW, &plane(2.0, 10.0)], 10.0),
        ),
        (
            "daylight, 3C, 4 m deep",
            at_depth(&[&water("3C"), day, &canon, &plane(1.0, 4.0)], 4.0),
        ),
        (
            "two lamps, 1C, 2 m",
            at_depth(&[&water("1C"), VIEW, &led, &second, &plane(2.0, 0.0)], 0.0),
        ),
        ("groove of meshes, III", groove),
    ]
}

/// The scene at three wavelengths, as its channels.
fn monochromatic(scene: &Scene, wavelengths_nm: [f64; 3]) -> Scene {
    let spectral = scene.spectral.as_ref().expect("by wavelength");
    let mut single = scene.clone();
    let water = spectral.water.as_ref().expect("water");
    let curve = |curve: &Curve| wavelengths_nm.map(|nm| curve.at(nm));
    if let Some(medium) = &mut single.water {
        medium.iops = Iops {
            a: curve(&water.a),
            b: curve(&water.b),
        };
    }
    let mixed = primaries();
    for material in &mut single.materials {
        material.reflectance = reflectance(material, &mixed, wavelengths_nm);
        material.spectrum = None;
    }
    single.spectral = None;
    single
}

/// Reflectance of a surface at three wavelengths.
fn reflectance(material: &Material, mixed: &[Curve; 3], wavelengths_nm: [f64; 3]) -> Spectrum {
    let rgb = material.reflectance;
    let mixture = |nm: f64| (0..3).map(|j| rgb[j] * mixed[j].at(nm)).sum();
    wavelengths_nm.map(|nm| {
        material
            .spectrum
            .as_ref()
            .map_or_else(|| mixture(nm), |own| own.at(nm))
    })
}

/// The scene with one of its lights at a time, and the spectrum of that light.
fn one_light_each(scene: &Scene) -> Vec<(Scene, Option<&Curve>)> {
    let spectral = scene.spectral.as_ref().expect("by wavelength");
    let dark = Scene {
        lamps: Vec::new(),
        sun: None,
        sky_radiance: [0.0; 3],
        ..scene.clone()
    };
    let of_lamp = |lamp: &Lamp| Scene {
        lamps: vec![lamp.clone()],
        ..dark.clone()
    };
    let lamps = scene.lamps.iter();
    let mut all: Vec<_> = lamps
        .map(|lamp| (of_lamp(lamp), lamp.spectrum.as_ref()))
        .collect();
    if scene.sun.is_some() {
        let (mut sun, mut sky) = (dark.clone(), dark);
        sun.sun.clone_from(&scene.sun);
        sky.sky_radiance = scene.sky_radiance;
        all.extend([(sun, spectral.sun.as_ref()), (sky, spectral.sky.as_ref())]);
    }
    all
}

/// Light of a lamp, the sun or the sky at one wavelength relative to the mean of each channel.
fn relative(scene: &Scene, of: Option<&Curve>, nm: f64) -> [f64; 3] {
    scene
        .spectral
        .as_ref()
        .expect("by wavelength")
        .relative_light(of)([nm; 3])
}

/// What `measured` makes, with a seed, of every light at every node of the water's table, three nodes at a time, each with
/// light of the same strength; then added up with the response.
fn added_up(scene: &Scene, measured: &dyn Fn(&Scene, u64) -> Means) -> Means {
    let mut sums = ([0.0; 3], [0.0; 3]);
    for (lit, light) in one_light_each(scene) {
        let (mean, error) = added_up_of(&lit, light, measured);
        for k in 0..3 {
            sums.0[k] += mean[k];
            sums.1[k] = error[k].hypot(sums.1[k]);
        }
    }
    sums
}

/// The same of one light; between nodes as exponentials are.
fn added_up_of(
    scene: &Scene,
    light: Option<&Curve>,
    measured: &dyn Fn(&Scene, u64) -> Means,
) -> Means {
    let spectral = scene.spectral.as_ref().expect("by wavelength");
    let water = spectral.water.as_ref().expect("water");
    let nodes: Vec<f64> = water.a.nodes().iter().map(|n| n.0).collect();
    let mut radiance = Vec::new();
    for (i, three) in nodes.chunks(3).enumerate() {
        let wavelengths = [0, 1, 2].map(|k| three[k.min(three.len() - 1)]);
        let single = monochromatic(scene, wavelengths);
        let (mean, error) = measured(&single, 100 + i as u64);
        radiance.extend((0..three.len()).map(|k| (mean[k], error[k])));
    }
    let mut sums = ([0.0; 3], [0.0; 3]);
    for k in 0..3 {
        let (mut total, mut weights) = (0.0, vec![0.0; nodes.len()]);
        for i in 0..nodes.len() - 1 {
            let (from, to) = (nodes[i], nodes[i + 1]);
            for part in 0..40 {
                let share = (f64::from(part) + 0.5) / 40.0;
                let nm = from + share * (to - from);
                let w = spectral.response.channels[k].at(nm) * (to - from) / 40.0;
                let own = relative(scene, light, nm)[k];
                let between = radiance[i].0.powf(1.0 - share) * radiance[i + 1].0.powf(share);
                total += w;
                sums.0[k] += w * own * between;
                weights[i] += w * own * (1.0 - share);
                weights[i + 1] += w * own * share;
            }
        }
        let variance: f64 = weights
            .iter()
            .zip(&radiance)
            .map(|(w, r)| (w * r.1).powi(2))
            .sum();
        sums.0[k] /= total;
        sums.1[k] = variance.sqrt() / total;
    }
    sums
}

/// Of the spectral render on the vector units; of each monochromatic one a quarter.
const SAMPLES_PER_PIXEL: u32 = 512;
/// Directions of spectral sensors; of monochromatic ones an eighth.
const DIRECTIONS: u32 = 1 << 15;
const SEED: u64 = 1;

/// On other backends a spectral render is what it is on the vector units.
#[test]
fn a_spectral_render_is_the_sum_of_monochromatic_ones() {
    let scenes = scenes().map(|(name, scene)| (name, Prepared::build(&scene), scene));
    everywhere(|backend| match backend {
        Backend::VectorUnits => judge(
            &scenes
                .iter()
                .flat_map(sum_of_monochromatic)
                .collect::<Vec<_>>(),
        ),
        _ => {
            for (name, scene, _) in &scenes {
                let sampled = (SAMPLES_PER_PIXEL / PART, 0, SEED);
                assert_same_radiances(backend, name, scene, sampled);
            }
        }
    });
}

fn sum_of_monochromatic((name, prepared, scene): &(&str, Prepared, Scene)) -> [f64; 3] {
    let measured = |scene: &Prepared, samples: u32, seed: u64| {
        measure_prepared(Backend::VectorUnits, scene, samples, 0, seed)
    };
    let expected = added_up(scene, &|single, seed| {
        measured(&Prepared::build(single), SAMPLES_PER_PIXEL / 4, seed)
    });
    compare(name, measured(prepared, SAMPLES_PER_PIXEL, SEED), expected)
}

/// The same of sensors of irradiance in daylight that scatters.
#[test]
fn a_spectral_irradiance_is_the_sum_of_monochromatic_ones() {
    let water = "[water]\njerlov = \"1C\"\nbands = \"spectral\"\n";
    let canon = VIEW.to_owned() + "response = \"canon5d2\"\n";
    let scene = at_depth(&[water, DAYLIGHT, &canon], 1.0);
    let plan = |samples: u32, seed: u64| IrradiancePlan {
        depths_m: vec![6.0],
        samples,
        seed,
        threads: None,
        max_bounces: 0,
    };
    let prepared = Prepared::build(&scene);
    everywhere(|backend| match backend {
        Backend::VectorUnits => {
            let downward: fn(&DepthIrradiance) -> Estimate = |row| row.e_d;
            let mut scores = Vec::new();
            for (name, of) in [("downward", downward), ("upward", |row| row.e_u)] {
                let measured = |samples: u32, scene: &Prepared, seed: u64| -> Means {
                    let rows = backend.irradiances_prepared(scene, &plan(samples, seed));
                    let estimate = of(&rows.expect("measured")[0]);
                    (estimate.value, estimate.standard_error)
                };
                let monochromatic = |single: &Scene, seed: u64| {
                    measured(DIRECTIONS / 8, &Prepared::build(single), seed)
                };
                let expected = added_up(&scene, &monochromatic);
                let got = measured(DIRECTIONS, &prepared, SEED);
                scores.extend(compare(name, got, expected));
            }
            judge(&scores);
        }
        _ => assert_same_irradiances(backend, "1C", &prepared, &plan(DIRECTIONS / PART, SEED)),
    });
}

/// Deviations over what noise and straight lines between the nodes' logarithms allow.
fn compare(name: &str, got: Means, expected: Means) -> [f64; 3] {
    let ((mean, error), (expected, own)) = (got, expected);
    std::array::from_fn(|k| {
        let interpolation = 1e-3 * expected[k];
        let z = (mean[k] - expected[k]) / own[k].hypot(error[k]).hypot(interpolation);
        println!(
            "  {name}, channel {k}: {:.5e} ± {:.1}% against {:.5e} ± {:.1}%, z {z:+.2}",
            mean[k],
            100.0 * error[k] / mean[k],
            expected[k],
            100.0 * own[k] / expected[k]
        );
        assert!(error[k] < 0.03 * mean[k], "{name}: too noisy to tell");
        z
    })
}

fn judge(scores: &[f64]) {
    let square = scores.iter().map(|z| z * z).sum::<f64>() / scores.len() as f64;
    let largest = scores.iter().fold(0.0f64, |most, z| most.max(z.abs()));
    println!("  rms z {:.2}, largest {largest:.2}", square.sqrt());
    assert!(
        largest < 4.0 && square.sqrt() < 1.8,
        "rms {square}, largest {largest}"
    );
}
