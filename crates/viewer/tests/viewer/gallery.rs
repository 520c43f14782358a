//! Scenes to choose from, with small pictures; the commands of the menus and their keys.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use uw_viewer::model::recent::Recent;
use uw_viewer::ui::commands;
use uw_viewer::worker::thumbnails::{SIZE_PX, Thumbnails};

use crate::panels::{click, until, viewer};
use crate::support::{PATIENCE, SCENE, repository};

#[test]
fn small_pictures_are_those_of_their_scenes() {
    let folder = tempfile::tempdir().expect("folder");
    let [dark, light, bad] =
        ["dark.toml", "light.toml", "bad.toml"].map(|name| folder.path().join(name));
    let of = |reflectance: &str| SCENE.replace("reflectance = [0.5, 0.4, 0.3]", reflectance);
    std::fs::write(&dark, of("reflectance = [0.0, 0.0, 0.0]")).expect("written");
    std::fs::write(&light, of("reflectance = [0.9, 0.9, 0.9]")).expect("written");
    std::fs::write(&bad, "format = 7").expect("written");
    let mut thumbnails = Thumbnails::start(|| ()).expect("a thread");
    let start = std::time::Instant::now();
    let mut picture = |file: &std::path::Path| loop {
        if let Some(thumbnail) = thumbnails.of(file) {
            return thumbnail.clone();
        }
        assert!(start.elapsed() < PATIENCE, "no picture came");
        std::thread::sleep(std::time::Duration::from_millis(5));
    };
    let [dark, light] = [&dark, &light].map(|file| picture(file).expect("a picture"));
    assert_eq!(light.size, [SIZE_PX.0 as usize, SIZE_PX.1 as usize]);
    let middle = |image: &egui::ColorImage| image[(80, 45)].g();
    assert!(
        middle(&light) > middle(&dark) + 40,
        "{} {}",
        middle(&light),
        middle(&dark)
    );
    let why = picture(&bad).expect_err("no scene");
    assert!(why.contains("format"), "{why}");
}

#[test]
fn an_example_or_a_recent_scene_is_chosen_by_its_name() {
    let folder = tempfile::tempdir().expect("folder");
    let mine = folder.path().join("my own.toml");
    std::fs::write(&mine, SCENE).expect("written");
    let mut harness = viewer();
    let mut recent = Recent::stored_in(folder.path().join("recent.json"));
    recent.add(&mine);
    harness.state_mut().recent = recent;
    for (name, title) in [("my own", "my own.toml"), ("flat_reef", "flat_reef.toml")] {
        harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::O);
        harness.run_steps(3);
        harness.get_by_label("Examples");
        let named = harness.get_all_by_label(name).next().expect("its card");
        named.click_accesskit();
        harness.run_steps(2);
        assert!(!harness.state().gallery_open);
        until(&mut harness, "the scene", |v| v.open.title == title);
    }
    assert!(repository().join("assets/scenes/flat_reef.toml").is_file());
}

/// Every key of a menu that asks for a file opens a dialog that says for what.
#[test]
fn keys_ask_for_files() {
    let mut harness = viewer();
    let both = Modifiers::COMMAND | Modifiers::SHIFT;
    for (modifiers, key, title) in [
        (Modifiers::COMMAND, Key::E, "Export the picture"),
        (both, Key::E, "Export EXR with all layers"),
        (Modifiers::COMMAND, Key::D, "Export the plots"),
        (Modifiers::COMMAND, Key::P, "Open a calibration profile"),
        (Modifiers::COMMAND, Key::R, "Open a recorded operation"),
        (Modifiers::COMMAND, Key::M, "Open a network"),
    ] {
        harness.key_press_modifiers(modifiers, key);
        harness.run_steps(3);
        harness.get_by_label(title);
        click(&mut harness, "Cancel");
    }
    // There is none yet.
    harness.key_press_modifiers(both, Key::P);
    harness.run_steps(3);
    assert!(
        harness
            .query_by_label("Save the calibration profile")
            .is_none()
    );
    harness.state_mut().guidance.profile = Some(std::sync::Arc::new(crate::support::profile()));
    harness.key_press_modifiers(both, Key::P);
    harness.run_steps(3);
    harness.get_by_label("Save the calibration profile");
}

#[test]
fn the_help_lists_every_command() {
    let mut harness = viewer();
    harness.set_size(egui::vec2(1280.0, 1400.0));
    harness.key_press(Key::F1);
    harness.run_steps(3);
    for command in commands::all() {
        let names = harness.query_all_by_label(command.name).count();
        assert!(names > 0, "{}", command.name);
    }
}
