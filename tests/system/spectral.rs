//! Scenes by wavelength: against quadrature where nothing scatters, and what does not go together.

use std::path::Path;

use uw_render::scene::Scene;
use uw_tests::{
    file,
    gpu::{Backend, everywhere},
    measure,
};

/// A scene of one view, whose tables lie in `assets`.
pub(crate) fn parsed(text: &str) -> Scene {
    let text = format!("format = \"uw-scene/1\"\n{text}");
    Scene::parse(&text, &file("../assets"), "spectral.toml").unwrap_or_else(|e| panic!("{e}"))
}

/// A column of a table in `assets`, read anew: wavelengths, nm, and values.
pub(crate) fn column(path: &str, name: &str) -> Vec<(f64, f64)> {
    let text = std::fs::read_to_string(file("../assets").join(path)).expect("readable");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let column_of = |wanted: &str| header.iter().position(|n| *n == wanted).expect(wanted);
    let (x, y) = (column_of("wavelength_nm"), column_of(name));
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            (cells[x].parse().expect("nm"), cells[y].parse().expect(name))
        })
        .collect()
}

fn at(nodes: &[(f64, f64)], nm: f64) -> f64 {
    let pair = nodes
        .windows(2)
        .find(|pair| pair[0].0 <= nm && nm <= pair[1].0);
    pair.map_or(0.0, |p| {
        p[0].1 + (p[1].1 - p[0].1) * (nm - p[0].0) / (p[1].0 - p[0].0)
    })
}

/// The bands along a ray, weighted by the camera's response, are the channels of the picture's pixel, also with coloured
/// light, and of lamps that are narrow.
#[test]
fn bands_along_a_ray_add_up_to_the_channels() {
    for emission in ["", "emission = [0.02, 0.05, 0.01]\n"] {
        let scene = parsed(&format!("{BEFORE_A_WALL}{emission}"));
        let (expected, error) = measure(Backend::VectorUnits, &scene, 256, 0, 3);
        let geometry = std::sync::Arc::new(uw_render::prepare::Geometry::build(&scene));
        let camera = &scene.camera;
        let bands = uw_render::ray_spectrum::ray_spectrum(
            &scene,
            &geometry,
            (camera.position_m, camera.forward),
            (8192, 5),
            &std::sync::atomic::AtomicBool::new(false),
        )
        .expect("rendered");
        assert_eq!(bands.len(), 30);
        for (k, nm) in [(0, 600.0..700.0), (1, 500.0..600.0), (2, 400.0..500.0)] {
            let own = bands.iter().filter(|band| nm.contains(&band.wavelength_nm));
            let (sum, variance) = own.fold((0.0, 0.0), |(sum, variance), band| {
                (sum + band.radiance, variance + band.standard_error.powi(2))
            });
            let allowed = 3.0 * (variance.sqrt() / 10.0).hypot(error[k]) + 2e-3 * expected[k];
            let off = sum / 10.0 - expected[k];
            assert!(off.abs() < allowed, "{k}: {} {}", sum / 10.0, expected[k]);
            assert!(
                allowed < 0.03 * expected[k],
                "{k}: {allowed} of {expected:?}"
            );
        }
    }
}

/// A wall lit by two lamps of different colours, one of them of a narrow spectrum.
const BEFORE_A_WALL: &str = "water = { jerlov = \"3C\" }\n\
     camera = { position_m = [0.0, 0.0, 0.0], forward = [1.0, 0.0, 0.0], hfov_deg = 0.5, width = 16, height = 16 }\n\
     [[lamp]]\nname = \"a\"\nposition_m = [0.0, 0.3, 0.0]\nintensity = [9.0, 4.0, 2.0]\nspectrum = \"led-green\"\n\
     [[lamp]]\nname = \"b\"\nposition_m = [0.0, -0.3, 0.0]\nintensity = [1.0, 2.0, 3.0]\n\
     [[object]]\nplane = { center_m = [1.0, 0.0, 0.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [3.0, 3.0] }\n\
     reflectance = [0.6, 0.3, 0.1]\n";

/// Patches that cover the gamut, one of them grey.
const PATCHES: [&str; 5] = ["red", "blue", "yellow", "foliage", "neutral_5_(.70_D)"];

/// A chart lit by an LED lamp beside the camera, in water that absorbs: ∫ I ρ e^(−2 a d) w dλ / (π d²).
#[test]
fn a_chart_without_scattering_is_as_quadrature_says() {
    everywhere(chart);
}

fn chart(backend: Backend) {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, head: &str, rows: &[(f64, f64)]| {
        let rows: String = rows.iter().map(|(nm, x)| format!("{nm},{x}\n")).collect();
        std::fs::write(folder.path().join(name), format!("{head}\n{rows}")).expect("written");
    };
    let table = std::fs::read_to_string(file("../assets/water/jerlov_iop_10nm.csv")).expect("read");
    let absorption: Vec<(f64, f64)> = table
        .lines()
        .filter(|line| line.starts_with("II,"))
        .map(|line| {
            let cells: Vec<f64> = line.split(',').skip(1).flat_map(str::parse).collect();
            (cells[0], cells[1])
        })
        .collect();
    let with_no_b: String = absorption
        .iter()
        .map(|(nm, a)| format!("{nm},{a},0\n"))
        .collect();
    std::fs::write(
        folder.path().join("water.csv"),
        format!("wavelength_nm,a_per_m,b_per_m\n{with_no_b}"),
    )
    .expect("written");
    let led = column("spectra/lamp_spectra.csv", "LED-B4");
    let response =
        ["r", "g", "b"].map(|c| column("water/camera_responses.csv", &format!("canon5d2_{c}")));
    for patch in PATCHES {
        let reflectance = column("spectra/colorchecker_reflectances.csv", patch);
        write("chart.csv", "wavelength_nm,reflectance", &reflectance);
        for distance_m in [0.5, 2.0, 5.0] {
            let text = format!(
                "format = \"uw-scene/1\"\n[water]\nspectrum = \"water.csv\"\n[camera]\nposition_m = [0.0, 0.0, 0.0]\n\
                 forward = [1.0, 0.0, 0.0]\nhfov_deg = 1e-4\nwidth = 24\nheight = 24\nresponse = \"canon5d2\"\n[[lamp]]\n\
                 position_m = [0.0, 0.0, 0.0]\nintensity = [10.0, 20.0, 30.0]\nspectrum = \"led-5000k\"\n[[object]]\n\
                 plane = {{ center_m = [{distance_m}, 0.0, 0.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], \
                 size_m = [9.0, 9.0] }}\nreflectance = {{ spectrum = \"chart.csv\" }}\n"
            );
            let scene =
                Scene::parse(&text, folder.path(), "chart.toml").unwrap_or_else(|e| panic!("{e}"));
            let (mean, error) = measure(backend, &scene, 1024, 1, 1);
            for k in 0..3 {
                let sum = |of: &dyn Fn(f64) -> f64| -> f64 {
                    (0..6000)
                        .map(|i| 400.025 + 0.05 * f64::from(i))
                        .map(|nm| at(&response[k], nm) * of(nm))
                        .sum()
                };
                let light = sum(&|nm| at(&led, nm));
                let seen = sum(&|nm| {
                    at(&led, nm)
                        * at(&reflectance, nm)
                        * (-2.0 * distance_m * at(&absorption, nm)).exp()
                });
                let expected = [10.0, 20.0, 30.0][k] * seen
                    / light
                    / (std::f64::consts::PI * distance_m * distance_m);
                let (off, noise) = (mean[k] / expected - 1.0, error[k] / mean[k]);
                println!("  {patch} at {distance_m} m, channel {k}: {off:+.1e} ± {noise:.1e}");
                assert!(
                    off.abs() < 3e-4 + 3.5 * noise && noise < 1.5e-3 * backend.noise(),
                    "{patch} {distance_m} {k}: {} {expected}",
                    mean[k]
                );
            }
        }
    }
}

pub(crate) const VIEW: &str = "[camera]\nposition_m = [0.0, 0.0, DEPTH]\nforward = [1.0, 0.0, 0.0]\nhfov_deg = 20.0\nwidth = 12\nheight = 12\n";
pub(crate) const LAMP: &str = "[[lamp]]\nposition_m = [0.0, 0.4, DEPTH]\nforward = [1.0, 0.0, 0.0]\nhalf_angle_deg = 60.0\n\
                    intensity = [10.0, 10.0, 10.0]\n";

pub(crate) fn plane(distance_m: f64, depth_m: f64) -> String {
    format!(
        "[[object]]\nplane = {{ center_m = [{distance_m}, 0.0, {}], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], \
         size_m = [4.0, 4.0] }}\nreflectance = [0.4, 0.4, 0.4]\n",
        -depth_m
    )
}

/// Water whose coefficients are the same at every wavelength renders as the same three numbers do, but for noise.
#[test]
fn water_without_colour_is_as_three_numbers_say() {
    everywhere(|backend| {
        let folder = tempfile::tempdir().expect("a folder");
        let table = "wavelength_nm,a_per_m,b_per_m\n400,0.2,0.6\n450,0.2,0.6\n500,0.2,0.6\n550,0.2,0.6\n600,0.2,0.6\n\
                     650,0.2,0.6\n700,0.2,0.6\n";
        std::fs::write(folder.path().join("grey.csv"), table).expect("written");
        let rest = (VIEW.to_owned() + LAMP + &plane(1.5, 0.0)).replace("DEPTH", "0.0");
        let of = |water: &str| {
            let text = format!("format = \"uw-scene/1\"\n[water]\n{water}\n{rest}");
            Scene::parse(&text, folder.path(), "grey.toml").unwrap_or_else(|e| panic!("{e}"))
        };
        let by_wavelength = of("spectrum = \"grey.csv\"");
        let spectral = by_wavelength.spectral.as_ref().expect("by wavelength");
        assert_eq!(spectral.response.name, "boxes");
        assert_eq!(spectral.lights, Vec::<String>::new());
        let (mean, error) = measure(backend, &by_wavelength, 256, 0, 1);
        let (expected, own) = measure(
            backend,
            &of("a = [0.2, 0.2, 0.2]\nb = [0.6, 0.6, 0.6]"),
            256,
            0,
            2,
        );
        for k in 0..3 {
            let z = (mean[k] - expected[k]) / error[k].hypot(own[k]);
            println!("  channel {k}: {} {}, z {z:+.2}", mean[k], expected[k]);
            assert!(
                z.abs() < 4.0 && error[k] < 0.02 * backend.noise() * mean[k],
                "{z}"
            );
        }
    });
}

/// A camera one of whose channels sees nothing, with water and without.
#[test]
fn a_channel_that_sees_nothing_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let rows = "wavelength_nm,r,g,b\n400,0,1,1\n450,0,1,1\n500,0,1,1\n550,0,1,1\n600,0,1,1\n650,0,1,1\n700,0,1,1\n";
    std::fs::write(folder.path().join("dark.csv"), rows).expect("written");
    for water in ["", "[water]\njerlov = \"II\"\nbands = \"spectral\"\n"] {
        let view = VIEW.replace("DEPTH", "0.0");
        let text =
            format!("format = \"uw-scene/1\"\n{water}{view}response = {{ file = \"dark.csv\" }}\n");
        let error = Scene::parse(&text, folder.path(), "dark.toml")
            .expect_err("dark")
            .to_string();
        assert!(
            error.contains("camera.response") && error.contains("none in r"),
            "{error}"
        );
    }
}

#[test]
fn what_does_not_go_together_is_refused() {
    let view = VIEW.replace("DEPTH", "0.0");
    let cases = [
        (
            "[water]\njerlov = \"II\"\nspectrum = \"x.csv\"\n",
            "water.jerlov must be left out where water.spectrum is given",
        ),
        (
            "[water]\nspectrum = \"x.csv\"\nbands = \"mean\"\n",
            "water.bands must be \"spectral\"",
        ),
        ("[water]\nspectrum = \"x.csv\"\n", "x.csv"),
        (
            "[water]\njerlov = \"I\"\nbands = \"spectral-measured\"\n",
            "IB II III 1C 3C 5C",
        ),
        (
            "[water]\njerlov = \"II\"\nbands = \"spectral\"\n[[lamp]]\nposition_m = [0.0, 0.0, 0.0]\n\
             intensity = [1.0, 1.0, 1.0]\nspectrum = \"led-5000\"\n",
            "led-5000k",
        ),
    ];
    for (text, expected) in cases {
        let text = format!("format = \"uw-scene/1\"\n{text}{view}");
        let error = Scene::parse(&text, Path::new("."), "wrong.toml")
            .expect_err(&text)
            .to_string();
        assert!(error.contains(expected), "{text}: {error}");
        assert!(error.starts_with("wrong.toml:"), "{error}");
    }
}

/// A Jerlov type goes by wavelength unless bands are named; in three bands a spectrum is told not to count.
#[test]
fn a_type_goes_by_wavelength_unless_bands_are_named() {
    let view = VIEW.replace("DEPTH", "0.0");
    let lamp = "[[lamp]]\nposition_m = [0.0, 0.0, 0.0]\nintensity = [1.0, 1.0, 1.0]\nspectrum = \"led-5000k\"\n";
    let scene = |water: &str| parsed(&format!("[water]\n{water}{lamp}{view}"));
    for water in [
        "jerlov = \"3C\"\n",
        "jerlov = \"3C\"\nbands = \"spectral\"\n",
    ] {
        let scene = scene(water);
        assert!(
            scene.spectral.is_some() && scene.warnings.is_empty(),
            "{water}"
        );
    }
    let between = scene("jerlov = { between = [\"1C\", \"3C\"], share = 0.25 }\n");
    let water = |scene: &Scene| {
        scene
            .spectral
            .clone()
            .and_then(|s| s.water)
            .expect("spectral")
    };
    let types = ["1C", "3C"].map(|t| water(&scene(&format!("jerlov = \"{t}\"\n"))));
    let (mixed, parts) = (water(&between).a.at(525.0), types.map(|w| w.a.at(525.0)));
    assert!((mixed - 0.75 * parts[0] - 0.25 * parts[1]).abs() < 1e-12);
    for water in [
        "jerlov = \"3C\"\nbands = \"mean\"\n",
        "a = [1.0, 1.0, 1.0]\nb = [1.0, 1.0, 1.0]\n",
    ] {
        let scene = scene(water);
        assert!(scene.spectral.is_none());
        let told = &scene.warnings[..];
        assert!(
            matches!(told, [one] if one.starts_with("lamp 1 spectrum does not count")),
            "{told:?}"
        );
    }
}
