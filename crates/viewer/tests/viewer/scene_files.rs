//! Settings from scene files and back.

use std::path::Path;

use uw_media::Iops;
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
        let (again, read) = saved(&open, &settings, folder.path());
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
    settings.camera.distortion = [0.1, 0.0, 0.001, 0.0, 0.0];
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

#[test]
fn a_mixture_of_types_is_saved_as_its_coefficients() {
    let folder = tempfile::tempdir().expect("folder");
    let (open, mut settings) = small();
    let water = settings.water.as_mut().expect("water");
    water.coefficients = Coefficients::Jerlov {
        scale: 5.5,
        bands: uw_media::Bands::Mean,
    };
    let mixed = water.coefficients.iops().expect("covered");
    let (_, read) = saved(&open, &settings, folder.path());
    let coefficients = read.water.expect("water").coefficients;
    assert_eq!(coefficients, Coefficients::Direct(mixed));
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
