//! Scenes by wavelength: against quadrature where nothing scatters, and what does not go together.

use std::path::Path;

use uw_render::film::FilmLayer;
use uw_render::prepare::{Prepared, Way};
use uw_render::scene::Scene;
use uw_tests::{
    file,
    gpu::{Backend, everywhere},
    measure,
};

use crate::agreement::assert_same_means;

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

/// Columns and rows of the chart.
const CHART: (usize, usize) = (6, 4);
/// Pixels of a patch in either direction; those at its edges are left out.
const PATCH_PX: usize = 10;

/// The sets of wavelengths add up to the light of a chart of 24 patches in the ten waters without their scattering, lit by an
/// LED lamp beside the camera: ∫ I ρ e^(−2 a d) w dλ.
#[test]
fn sets_of_wavelengths_add_up_to_quadrature() {
    let mut worst = 0.0_f64;
    for jerlov in ["I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C"] {
        for distance_m in [0.5, 2.0, 5.0, 10.0] {
            let chart = Chart::new(jerlov, distance_m);
            let prepared = Prepared::build(&chart.scene);
            let sets = prepared.spectrum.as_ref().expect("by wavelength");
            for (patch, expected) in chart.expected().iter().enumerate() {
                let mean = sets.mean(|set| {
                    let left = set.transmittance_of(&Way::Length(2.0 * distance_m));
                    [0, 1, 2].map(|k| set.lamps[0][k] * set.reflectances[patch][k] * left[k])
                });
                for k in 0..3 {
                    worst = worst.max((mean[k] / expected[k] - 1.0).abs());
                }
            }
        }
    }
    println!("  largest deviation {worst:.1e}");
    assert!(worst < 1e-3, "{worst}");
}

/// Renders of that chart: L = I ∫ ρ e^(−2 a d) w dλ / (π d²).
#[test]
fn a_chart_without_scattering_is_as_quadrature_says() {
    everywhere(|backend| {
        for (jerlov, distance_m) in [("I", 10.0), ("II", 0.5), ("3C", 2.0), ("9C", 5.0)] {
            chart_is_as_quadrature_says(backend, &Chart::new(jerlov, distance_m));
        }
    });
}

fn chart_is_as_quadrature_says(backend: Backend, chart: &Chart) {
    let plan = uw_tests::plan(backend.samples(512), 1);
    let pixels = backend
        .render(&chart.scene, &plan)
        .0
        .layer(FilmLayer::Total);
    let area = std::f64::consts::PI * chart.distance_m * chart.distance_m;
    let (mut scores, mut largest) = (Vec::new(), 0.0_f64);
    for (patch, expected) in chart.expected().iter().enumerate() {
        let own = pixels_of(patch, &pixels);
        let n = own.len() as f64;
        for k in 0..3 {
            let mean = own.iter().map(|p| p[k]).sum::<f64>() / n;
            let square = own.iter().map(|p| (p[k] - mean).powi(2)).sum::<f64>();
            let error = (square / (n * (n - 1.0))).sqrt();
            let off = mean - [10.0, 20.0, 30.0][k] * expected[k] / area;
            largest = largest.max(off.abs() / mean);
            scores.push(off / error.hypot(3e-4 * mean));
        }
    }
    let square = scores.iter().map(|z| z * z).sum::<f64>() / scores.len() as f64;
    let worst = scores.iter().fold(0.0_f64, |most, z| most.max(z.abs()));
    println!(
        "  {} at {} m: rms z {:.2}, largest {worst:.1}, {largest:.1e}",
        chart.jerlov,
        chart.distance_m,
        square.sqrt()
    );
    assert!(
        worst < 4.5 && square.sqrt() < 1.3,
        "rms {square}, largest {worst}"
    );
    assert!(
        largest < 4e-3 * backend.noise(),
        "too noisy to tell: {largest}"
    );
}

/// The inner pixels of a patch.
fn pixels_of(patch: usize, pixels: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let (columns, inner) = (CHART.0, 1..PATCH_PX - 1);
    let first = (patch / columns * PATCH_PX, patch % columns * PATCH_PX);
    let rows = inner
        .clone()
        .map(|y| (first.0 + y) * columns * PATCH_PX + first.1);
    rows.flat_map(|row| inner.clone().map(move |x| pixels[row + x]))
        .collect()
}

/// A chart of 24 patches in water that does not scatter.
struct Chart {
    jerlov: &'static str,
    distance_m: f64,
    scene: Scene,
    absorption: Vec<(f64, f64)>,
    reflectances: Vec<Vec<(f64, f64)>>,
}

impl Chart {
    fn new(jerlov: &'static str, distance_m: f64) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, head: &str, rows: &[(f64, f64)], rest: &str| {
            let rows: String = rows
                .iter()
                .map(|(nm, x)| format!("{nm},{x}{rest}\n"))
                .collect();
            std::fs::write(folder.path().join(name), format!("{head}\n{rows}")).expect("written");
        };
        let absorption = absorption_of(jerlov);
        write(
            "water.csv",
            "wavelength_nm,a_per_m,b_per_m",
            &absorption,
            ",0",
        );
        let table = "spectra/colorchecker_reflectances.csv";
        let reflectances: Vec<_> = patches().iter().map(|name| column(table, name)).collect();
        assert_eq!(reflectances.len(), CHART.0 * CHART.1);
        for (i, reflectance) in reflectances.iter().enumerate() {
            write(
                &format!("{i}.csv"),
                "wavelength_nm,reflectance",
                reflectance,
                "",
            );
        }
        let scene = Scene::parse(&chart_scene(distance_m), folder.path(), "chart.toml");
        Self {
            jerlov,
            distance_m,
            scene: scene.unwrap_or_else(|e| panic!("{e}")),
            absorption,
            reflectances,
        }
    }

    /// What is left of each channel's light by each patch.
    fn expected(&self) -> Vec<[f64; 3]> {
        let light: Vec<(f64, [f64; 3])> = chart_light()
            .into_iter()
            .map(|(nm, light)| {
                let left = (-2.0 * self.distance_m * at(&self.absorption, nm)).exp();
                (nm, light.map(|light| light * left))
            })
            .collect();
        let seen = |reflectance: &Vec<(f64, f64)>| {
            light.iter().fold([0.0; 3], |sum, (nm, light)| {
                let reflected = at(reflectance, *nm);
                std::array::from_fn(|k| sum[k] + light[k] * reflected)
            })
        };
        self.reflectances.iter().map(seen).collect()
    }
}

/// Names of the patches, in the order of the table's columns.
fn patches() -> Vec<String> {
    let path = file("../assets/spectra/colorchecker_reflectances.csv");
    let text = std::fs::read_to_string(path).expect("readable");
    let header = text.lines().find(|line| !line.starts_with('#'));
    let names = header.expect("a header").split(',').skip(1);
    names.map(str::to_owned).collect()
}

/// Absorption of a type by wavelength, read anew.
fn absorption_of(jerlov: &str) -> Vec<(f64, f64)> {
    let table = std::fs::read_to_string(file("../assets/water/jerlov_iop_10nm.csv")).expect("read");
    let rows = table
        .lines()
        .filter_map(|line| line.strip_prefix(jerlov)?.strip_prefix(','));
    rows.map(|row| {
        let cells: Vec<f64> = row.split(',').flat_map(str::parse).collect();
        (cells[0], cells[1])
    })
    .collect()
}

/// What the LED brings to each channel in small steps of wavelength, 1 together.
fn chart_light() -> Vec<(f64, [f64; 3])> {
    let led = column("spectra/lamp_spectra.csv", "LED-B4");
    let response =
        ["r", "g", "b"].map(|c| column("water/camera_responses.csv", &format!("canon5d2_{c}")));
    let wavelengths = (0..6000).map(|i| 400.025 + 0.05 * f64::from(i));
    let mut light: Vec<(f64, [f64; 3])> = wavelengths
        .map(|nm| (nm, [0, 1, 2].map(|k| at(&response[k], nm) * at(&led, nm))))
        .collect();
    for k in 0..3 {
        let sum: f64 = light.iter().map(|(_, light)| light[k]).sum();
        light.iter_mut().for_each(|(_, light)| light[k] /= sum);
    }
    light
}

/// The patches in a narrow view.
fn chart_scene(distance_m: f64) -> String {
    let (columns, rows) = CHART;
    let patch_m = 2.0 * distance_m * 0.25_f64.to_radians().tan() / columns as f64;
    let mut text = format!(
        "format = \"uw-scene/1\"\n[water]\nspectrum = \"water.csv\"\n[camera]\nposition_m = [0.0, 0.0, 0.0]\n\
         forward = [1.0, 0.0, 0.0]\nhfov_deg = 0.5\nwidth = {}\nheight = {}\nresponse = \"canon5d2\"\n\
         [[lamp]]\nposition_m = [0.0, 0.0, 0.0]\nintensity = [10.0, 20.0, 30.0]\nspectrum = \"led-5000k\"\n",
        PATCH_PX * columns,
        PATCH_PX * rows
    );
    for i in 0..columns * rows {
        let to_left = (columns - 1) as f64 / 2.0 - (i % columns) as f64;
        let up = (rows - 1) as f64 / 2.0 - (i / columns) as f64;
        text += &format!(
            "[[object]]\nplane = {{ center_m = [{distance_m}, {}, {}], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], \
             size_m = [{patch_m}, {patch_m}] }}\nreflectance = {{ spectrum = \"{i}.csv\" }}\n",
            to_left * patch_m,
            up * patch_m
        );
    }
    text
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
        let by_numbers = of("a = [0.2, 0.2, 0.2]\nb = [0.6, 0.6, 0.6]");
        let measured = measure(backend, &by_wavelength, 256, 0, 1);
        assert_same_means(backend, measured, measure(backend, &by_numbers, 256, 0, 2));
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
