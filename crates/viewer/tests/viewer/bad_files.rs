//! Files that cannot be used: a message, and everything stays as it was.

use std::path::PathBuf;

use egui_kittest::Harness;
use uw_viewer::app::{Options, Viewer};
use uw_viewer::model::OpenScene;

use crate::support::{repository, small};

fn bad_scenes() -> Vec<PathBuf> {
    let folder = repository().join("crates/render/tests/bad");
    let entries = std::fs::read_dir(folder).expect("there").flatten();
    let paths = entries.map(|e| e.path());
    paths
        .filter(|p| {
            p.extension()
                .is_some_and(|e| e == "toml" || e == "gltf" || e == "glb")
        })
        .collect()
}

#[test]
fn every_bad_scene_is_refused_with_a_reason() {
    let paths = bad_scenes();
    assert!(paths.len() > 60);
    for path in paths {
        let is_scene = path.extension().is_some_and(|e| e == "toml");
        match OpenScene::read(&path) {
            Err(error) => {
                let name = path
                    .file_stem()
                    .unwrap_or_default()
                    .to_string_lossy()
                    .into_owned();
                assert!(error.to_string().contains(&name), "{error}");
            }
            // A glTF file may be bad as a part of its scene alone.
            Ok(_) => assert!(!is_scene, "{}", path.display()),
        }
    }
}

fn viewer() -> Harness<'static, Viewer> {
    let opened = small();
    Harness::builder()
        .with_size([1280.0, 720.0])
        .build_ui_state(
            |ui, viewer: &mut Viewer| viewer.show(ui),
            Viewer::new(&egui::Context::default(), opened, Options::default()).expect("a thread"),
        )
}

fn wait(harness: &mut Harness<'_, Viewer>) {
    let start = std::time::Instant::now();
    while harness.state().is_loading() {
        harness.step();
        assert!(start.elapsed() < crate::support::PATIENCE);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

#[test]
fn a_bad_file_leaves_the_scene_and_says_why() {
    let folder = tempfile::tempdir().expect("folder");
    let text = folder.path().join("notes.txt");
    std::fs::write(&text, "hello").expect("written");
    let garbage = folder.path().join("garbage.glb");
    std::fs::write(&garbage, [7_u8; 100]).expect("written");
    let bad = repository().join("crates/render/tests/bad");
    let cases = [
        (bad.join("unknown_jerlov.toml"), "jerlov"),
        (bad.join("gltf_truncated.glb"), "gltf_truncated.glb"),
        (garbage, "garbage.glb"),
        (text, "must be a scene (.toml) or a glTF file (.glb, .gltf)"),
        (folder.path().join("none.toml"), "none.toml"),
        (folder.path().to_path_buf(), "must be a scene"),
    ];
    let mut harness = viewer();
    harness.step();
    let (settings, title) = (
        harness.state().settings.clone(),
        harness.state().open.title.clone(),
    );
    for (path, expected) in cases {
        let ctx = harness.ctx.clone();
        harness.state_mut().open_file(&path, &ctx);
        wait(&mut harness);
        let viewer = harness.state();
        let said = viewer
            .toasts
            .all()
            .last()
            .map(|t| t.text.clone())
            .unwrap_or_default();
        assert!(said.contains(expected), "{}: {said}", path.display());
        assert!(said.contains("The scene stays as it was"));
        assert_eq!((&viewer.settings, &viewer.open.title), (&settings, &title));
    }
    let good = repository().join("assets/scenes/clear_lamp.toml");
    let ctx = harness.ctx.clone();
    harness.state_mut().open_file(&good, &ctx);
    wait(&mut harness);
    assert_eq!(harness.state().open.title, "clear_lamp.toml");
    assert_ne!(harness.state().settings, settings);
}

#[test]
fn bad_profiles_models_and_records_leave_what_is_there() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("bad.json");
    std::fs::write(
        &path,
        r#"{"format": "uw-profile/1", "unit": "8-bit counts"}"#,
    )
    .expect("written");
    let mut harness = viewer();
    let guidance = &mut harness.state_mut().guidance;
    assert!(guidance.model.is_ok());
    let refused = guidance.open_profile(&path).expect_err("no samples");
    assert!(refused.contains("bad.json"), "{refused}");
    assert!(guidance.profile.is_none());
    let refused = guidance.open_record(&path).expect_err("no record");
    assert!(refused.contains("bad.json: line 1"), "{refused}");
    assert!(guidance.operation.is_none());
    let (before, name) = guidance.model.clone().expect("shipped");
    let model = folder.path().join("wrong_model.json");
    std::fs::write(&model, r#"{"format": "uw-mlp/1", "layers": []}"#).expect("written");
    for wrong in [&model, &path, &folder.path().join("none.json")] {
        let refused = guidance.open_model(wrong).expect_err("no network");
        let file = wrong.file_name().unwrap_or_default().to_string_lossy();
        assert!(refused.contains(file.as_ref()), "{refused}");
        let (now, called) = guidance.model.clone().expect("the one before");
        assert!(std::sync::Arc::ptr_eq(&now, &before) && called == name);
    }
    let other = repository().join("assets/models/small_camera.json");
    guidance.open_model(&other).expect("a network that ships");
    let refused = guidance.save_profile(&path).expect_err("none yet");
    assert!(refused.contains("calibrate first"), "{refused}");
}
