//! Settings from scene files and back.

use std::path::Path;

use glam::DVec3;
use uw_media::Iops;
use uw_render::scene::{Lens, Port, PortShape, Snow};
use uw_viewer::model::{Coefficients, OpenScene, PhaseModel, Settings, scene_text};

use crate::support::{repository, small};

/// The settings after they were written to and read from a file in another folder.
fn saved(open: &OpenScene, settings: &Settings, folder: &Path) -> (OpenScene, Settings) {
    let path = folder.join("saved.toml");
    scene_text::save(open, settings, &path).expect("saved");
    match OpenScene::read(&path) {
        Ok(read) => read,
        Err(error) => panic!(
            "{error}\n{}",
            std::fs::read_to_string(&path).unwrap_or_default()
        ),
    }
}

#[test]
fn shipped_scenes_survive_saving_elsewhere() {
    let folder = tempfile::tempdir().expect("folder");
    let scenes = repository().join("assets/scenes");
    let mut seen = 0;
    for entry in std::fs::read_dir(scenes).expect("there").flatten() {
        let path = entry.path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        seen += 1;
        let (open, settings) = OpenScene::read(&path).expect("valid");
        let (again, mut read) = saved(&open, &settings, folder.path());
        // Up is made perpendicular to forward anew, which may move its last bit.
        assert!(read.camera.up.distance(settings.camera.up) < 1e-15);
        read.camera.up = settings.camera.up;
        // Objects name their files from elsewhere.
        let text = |open: &OpenScene, settings: &Settings| {
            scene_text::scene_text(open, settings, Path::new("/"))
        };
        assert_eq!(text(&again, &read), text(&open, &settings));
        read.objects = settings.objects.clone();
        assert_eq!(read, settings, "{}", path.display());
        assert_eq!(again.geometry.len(), open.geometry.len());
        assert_eq!(again.geometry.bounds(), open.geometry.bounds());
    }
    assert!(seen >= 6);
}

#[test]
fn every_knob_is_saved() {
    let folder = tempfile::tempdir().expect("folder");
    let (open, mut settings) = small();
    let water = settings.water.as_mut().expect("water");
    water.refractive_index = 1.33;
    water.coefficients = Coefficients::Direct(Iops {
        a: [0.3, 0.1, 0.05],
        b: [0.2, 0.25, 0.3],
    });
    settings.surface = None;
    settings.sun = None;
    settings.camera.set_hfov_deg(75.0);
    settings.camera.lens = Lens::Perspective([0.1, 0.0, 0.001, 0.0, 0.0, 0.02, 0.0, 0.003]);
    settings.lamps[0].level_pct = 12.5;
    settings.lamps[0].falloff = uw_render::scene::Falloff::Cosine;
    settings.lamps[0].radius_m = 0.05;
    settings.sensor.bits = 16;
    settings.sensor.noise = Some(uw_render::scene::Noise { a: 1e-3, b: 1e-5 });
    settings.samples_per_pixel = 77;
    settings.max_bounces = 5;
    for phase in PhaseModel::CHOICES {
        settings.water.as_mut().expect("water").phase = phase;
        let (_, read) = saved(&open, &settings, folder.path());
        assert_eq!(read, settings);
    }
}

/// Lenses and ports are kept; what is outside a port follows the scene's water, in pictures, in circles of clouds and when saved.
#[test]
fn lenses_and_ports_are_saved() {
    let folder = tempfile::tempdir().expect("folder");
    let (open, mut settings) = small();
    let shapes = [
        PortShape::Flat { distance_m: 0.02 },
        PortShape::Dome {
            radius_m: 0.05,
            offset_m: DVec3::new(0.0, 0.0, -0.01),
        },
        PortShape::Dome {
            radius_m: 0.05,
            offset_m: DVec3::new(0.001, 0.002, -0.01),
        },
    ];
    for (shape, fisheye) in shapes.into_iter().zip([false, true, true]) {
        settings.camera.port = Some(Port {
            shape,
            thickness_m: 0.006,
            glass_index: 1.52,
            outside_index: 1.0,
        });
        if fisheye {
            settings.camera.lens = Lens::Fisheye([0.02, -0.003, 0.0, 0.0]);
        }
        settings.camera.set_hfov_deg(70.0);
        settings.water.as_mut().expect("water").refractive_index = 1.31;
        let (_, read) = saved(&open, &settings, folder.path());
        assert_eq!(read, settings);
        assert!((settings.camera.hfov_deg() - 70.0).abs() < 1e-6);
        let scene = settings.scene().expect("valid");
        assert_eq!(scene.camera.port.map(|port| port.outside_index), Some(1.31));
        assert_eq!(settings.snow_in_view(), None);
    }
    // Snow and a port do not go together: the file leaves the snow out.
    settings.snow = Some(Snow::default());
    let (_, read) = saved(&open, &settings, folder.path());
    assert_eq!((read.snow, read.camera.port), (None, settings.camera.port));
}

#[test]
fn a_mixture_of_types_is_saved_as_such() {
    let folder = tempfile::tempdir().expect("folder");
    let (open, mut settings) = small();
    for bands in ["spectral", "spectral-measured", "mean", "camera:imx219"] {
        let water = settings.water.as_mut().expect("water");
        water.coefficients = Coefficients::Jerlov {
            scale: 5.5,
            bands: bands.parse().expect("known"),
        };
        let (_, read) = saved(&open, &settings, folder.path());
        assert_eq!(read, settings);
        let scene = settings.scene().expect("covered");
        assert_eq!(scene.spectral.is_some(), bands.starts_with("spectral"));
    }
}

/// A scene that says of every light, of a surface and of the camera what it is by wavelength.
const SPECTRAL: &str = r#"format = "uw-scene/1"
water = { spectrum = "tables/water.csv" }
surface = { height_m = 0.0 }
sun = { zenith_deg = 40.0, irradiance = [1.0, 1.0, 1.0], spectrum = "clear-sky" }
sky = { radiance = [0.1, 0.1, 0.1], spectrum = { file = "tables/sky.csv" } }
camera = { position_m = [0.0, 0.0, -3.0], forward = [1.0, 0.0, 0.0], hfov_deg = 60.0, width = 64, height = 36, response = { file = "tables/camera.csv" } }
sensor = { exposure = { auto_mean = 0.4 }, white_balance = "d65", color_matrix = [[1.5, -0.5, 0.0], [0.0, 1.0, 0.0], [0.0, -0.25, 1.25]], vignetting = [-0.3, 0.02, -0.01] }
[[lamp]]
name = "left"
position_m = [0.0, 0.3, -3.0]
intensity = [1.0, 1.0, 1.0]
spectrum = "led-5000k"
[[object]]
plane = { center_m = [1.5, 0.0, -3.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [4.0, 4.0] }
reflectance = { spectrum = "tables/patch.csv" }
"#;

/// Nothing of what is known by wavelength is lost on the way through the window to a file elsewhere, and the window renders
/// what the file says.
#[test]
fn spectra_of_all_kinds_survive_saving_elsewhere() {
    let (from, to) = (
        tempfile::tempdir().expect("folder"),
        tempfile::tempdir().expect("folder"),
    );
    let tables = from.path().join("tables");
    std::fs::create_dir(&tables).expect("made");
    for (name, columns, from_values, to_values) in [
        ("water", "a_per_m,b_per_m", vec![0.1, 0.2], vec![0.6, 0.1]),
        ("sky", "relative", vec![2.0], vec![1.0]),
        ("camera", "r,g,b", vec![0.1, 0.2, 1.0], vec![1.0, 0.3, 0.1]),
        ("patch", "reflectance", vec![0.1], vec![0.9]),
    ] {
        let mut text = format!("wavelength_nm,{columns}\n");
        for step in 0..=8 {
            let share = f64::from(step) / 8.0;
            let values = from_values.iter().zip(&to_values);
            let values = values.map(|(x, y): (&f64, &f64)| (x + share * (y - x)).to_string());
            let row: Vec<String> = values.collect();
            text += &format!("{},{}\n", 380 + 45 * step, row.join(","));
        }
        std::fs::write(tables.join(name).with_extension("csv"), text).expect("written");
    }
    let path = from.path().join("spectral.toml");
    std::fs::write(&path, SPECTRAL).expect("written");
    let file = uw_render::scene::Scene::read(&path).expect("valid");
    let (open, settings) = OpenScene::read(&path).expect("valid");
    let lights = |scene: uw_render::scene::Scene| scene.spectral.expect("spectral").lights;
    assert_eq!(
        lights(settings.scene().expect("valid")),
        lights(file.clone())
    );
    let (again, read) = saved(&open, &settings, to.path());
    assert!(again.warnings.is_empty(), "{:?}", again.warnings);
    for settings in [&settings, &read] {
        let scene = settings.scene().expect("valid");
        let (own, shown) = (file.spectral.as_ref(), scene.spectral.as_ref());
        let (own, shown) = (own.expect("spectral"), shown.expect("spectral"));
        assert_eq!(shown.water, own.water);
        assert_eq!(shown.response.channels, own.response.channels);
        assert_eq!((&shown.sun, &shown.sky), (&own.sun, &own.sky));
        assert_eq!(scene.lamps[0].spectrum, file.lamps[0].spectrum);
        assert_eq!(scene.sensor, file.sensor);
        assert!(own.sun.is_some() && own.sky.is_some() && file.lamps[0].spectrum.is_some());
    }
    // In three bands the same file opens with a word about what does not count, and loses nothing either.
    let mut in_bands = settings.clone();
    in_bands.water.as_mut().expect("water").coefficients = Coefficients::Direct(Iops {
        a: [0.3, 0.1, 0.05],
        b: [0.2, 0.25, 0.3],
    });
    let (again, read) = saved(&open, &in_bands, to.path());
    assert_eq!(again.warnings.len(), 5, "{:?}", again.warnings);
    assert!(read.scene().expect("valid").spectral.is_none());
    assert_eq!(read.lamps[0].spectrum, settings.lamps[0].spectrum);
}

#[test]
fn tables_and_beams_are_found_after_saving_elsewhere() {
    let from = tempfile::tempdir().expect("folder");
    let to = tempfile::tempdir().expect("folder");
    std::fs::write(
        from.path().join("phase.csv"),
        "angle_deg,p\n0,10\n10,5\n180,1\n",
    )
    .expect("written");
    std::fs::write(
        from.path().join("beam.csv"),
        "angle_deg,relative\n0,1\n60,0.2\n",
    )
    .expect("written");
    let text = crate::support::SCENE
        .replace(
            "water = { jerlov = \"IB\" }",
            "water = { jerlov = \"IB\", phase = { model = \"mix\", parts = [\
             { weight = 1.0, phase = { model = \"table\", file = \"phase.csv\" } }, \
             { weight = 2.0, phase = { model = \"isotropic\" } }] } }",
        )
        .replace(
            "name = \"left\"",
            "name = \"left\"\nforward = [1.0, 0.0, 0.0]\nfalloff = { file = \"beam.csv\" }",
        );
    let path = from.path().join("scene.toml");
    std::fs::write(&path, text).expect("written");
    let (open, settings) = OpenScene::read(&path).expect("valid");
    let (_, read) = saved(&open, &settings, to.path());
    assert_eq!(read.lamps[0].falloff, settings.lamps[0].falloff);
    let water = |s: &Settings| s.water.clone().expect("water").phase;
    assert!(matches!(water(&read), PhaseModel::OfFile { .. }));
    use uw_media::phase::PhaseFunction;
    let value = |s: &Settings| water(s).phase().expect("valid").value(0.3);
    assert_eq!(value(&read), value(&settings));
}

#[test]
fn a_water_between_types_keeps_its_place_however_it_is_written() {
    let folder = tempfile::tempdir().expect("folder");
    for written in [
        "\"1C-3C@0.4\"",
        "{ between = [\"1C\", \"3C\"], share = 0.4 }",
    ] {
        let text = crate::support::SCENE.replace("\"IB\"", written);
        let (open, settings) = OpenScene::parse(&text, "between.toml".as_ref()).expect("valid");
        let water = settings.water.as_ref().expect("water");
        let Coefficients::Jerlov { scale, .. } = water.coefficients else {
            panic!("{written}: {:?}", water.coefficients);
        };
        assert!((scale - 5.4).abs() < 1e-12, "{written}: {scale}");
        let (_, read) = saved(&open, &settings, folder.path());
        assert_eq!(read.water, settings.water, "{written}");
    }
}

#[test]
fn a_gltf_file_is_seen_from_outside_and_lit() {
    let path = repository().join("assets/scenes/seabed.glb");
    let (open, settings) = OpenScene::read(&path).expect("valid");
    assert_eq!(open.title, "seabed.glb");
    let (lower, upper) = open.geometry.bounds().expect("something");
    let camera = settings.camera.build();
    let seen = camera.project(0.5 * (lower + upper)).expect("in front");
    assert!((seen - camera.centre_px).length() < 1.0);
    assert_eq!(settings.lamps.len(), 1);
    let folder = tempfile::tempdir().expect("folder");
    let (again, _) = saved(&open, &settings, folder.path());
    assert_eq!(again.geometry.len(), open.geometry.len());
}

/// A file on the disk, as the system drops it on a window.
#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

#[test]
fn files_that_are_dropped_are_opened_as_what_they_are() {
    let folder = tempfile::tempdir().expect("folder");
    let profile = folder.path().join("profile.json");
    crate::support::profile().write(&profile).expect("written");
    let record = folder.path().join("operation.jsonl");
    std::fs::write(&record, crate::support::recording(1.0)).expect("written");
    let scene = crate::support::repository().join("assets/scenes/clear_lamp.toml");
    let mut harness = crate::panels::viewer();
    for path in [profile, record, scene] {
        let file = std::sync::Arc::new(Dropped(path));
        harness.input_mut().dropped_files.push(file);
        harness.step();
        crate::panels::until(&mut harness, "the file", |v| !v.is_loading());
    }
    let viewer = harness.state();
    assert!(viewer.guidance.profile.is_some());
    assert!(viewer.guidance.operation.is_some());
    assert_eq!(viewer.open.title, "clear_lamp.toml");
}
