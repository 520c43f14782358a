//! Objects of the scene: what they are made of and how they stand is set, and the picture follows.

use std::path::Path;

use egui::{Key, Modifiers};
use egui_kittest::{Harness, kittest::Queryable};
use toml::Value;
use uw_render::scene::{Scene, Setting};
use uw_viewer::app::{Tab, Viewer};
use uw_viewer::model::command::{Wanted, command};
use uw_viewer::model::object::{Placement, Plane, Reflectance};
use uw_viewer::model::{OpenScene, scene_text::scene_text};

use crate::panels::{click, set, until, viewer};
use crate::support::{SCENE, repository};

/// The scene panel with the objects unfolded.
fn panel() -> Harness<'static, Viewer> {
    let mut harness = viewer();
    harness.state_mut().tab = Tab::Scene;
    harness.run_steps(3);
    click(&mut harness, "Objects: 1");
    // The header opens by and by.
    harness.run_steps(30);
    harness
}

/// Distance to what is in the middle of the picture as it is rendered, m.
fn rendered_m(viewer: &Viewer) -> Option<f64> {
    let camera = &viewer.settings.camera;
    let none = uw_render::prepare::Primitive::None;
    let geometry = &viewer.frame()?.geometry;
    let hit = geometry.closest(camera.position_m, camera.forward, f64::INFINITY, none);
    hit.map(|hit| hit.t)
}

fn is_at(viewer: &Viewer, distance_m: f64) -> bool {
    viewer.is_current() && rendered_m(viewer).is_some_and(|m| (m - distance_m).abs() < 1e-6)
}

#[test]
fn a_target_is_moved_and_tilted_before_the_camera() {
    let mut harness = panel();
    set(&mut harness, "distance", 0.8);
    until(&mut harness, "the nearer target", |v| is_at(v, 0.8));
    set(&mut harness, "turned", 40.0);
    set(&mut harness, "tilted", -20.0);
    until(&mut harness, "the tilted target", |v| {
        is_at(v, 0.8) && v.settings.objects == v.open.objects
    });
    let viewer = harness.state();
    let camera = viewer.settings.camera.build();
    let stand = Plane::of(&viewer.open.objects[0])
        .expect("a plane")
        .stand(&camera);
    let expected = [40.0, -20.0, 0.0];
    for (angle, expected) in [stand.turn_deg, stand.tilt_deg, stand.roll_deg]
        .iter()
        .zip(expected)
    {
        assert!((angle - expected).abs() < 1e-4, "{stand:?}");
    }
    // The normal that is rendered is that one.
    let none = uw_render::prepare::Primitive::None;
    let hit = |up_m: f64| {
        let from = camera.position_m - up_m * camera.down;
        let geometry = &viewer.open.geometry;
        geometry
            .closest(from, camera.forward, f64::INFINITY, none)
            .expect("a hit")
            .t
    };
    // n = cos t (sin y right + cos y back) + sin t up: height h above the axis is reached h tan t / cos y nearer or farther.
    let slope = (hit(0.1) - hit(0.0)) / 0.1;
    let expected = (-20_f64).to_radians().tan() / 40_f64.to_radians().cos();
    assert!((slope - expected).abs() < 1e-4, "{slope} {expected}");
    for _ in 0..3 {
        harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        harness.run_steps(3);
    }
    until(&mut harness, "the target as it was", |v| is_at(v, 1.5));
}

#[test]
fn a_target_gets_a_texture_and_a_bad_one_leaves_it() {
    let mut harness = panel();
    harness.get_by_label("surface").click_accesskit();
    harness.run_steps(3);
    click(&mut harness, "gravel");
    until(&mut harness, "the texture", |v| {
        v.settings.objects == v.open.objects && v.is_current()
    });
    let open = harness.state().open.objects.clone();
    let Reflectance::Texture { path, .. } = Reflectance::of(&open[0]) else {
        panic!("no texture: {open:?}");
    };
    assert!(path.ends_with("textures/gravel.png"), "{path}");
    // The texture is in the scene that is saved.
    let text = scene_text(
        &harness.state().open,
        &harness.state().settings,
        Path::new("/"),
    );
    let scene = Scene::parse(&text, Path::new("/"), "saved").expect("valid");
    assert_eq!(scene.textures.len(), 1);
    let missing = Reflectance::Texture {
        path: "no such file.png".to_owned(),
        tile_m: None,
    };
    missing.put(&mut harness.state_mut().settings.objects[0]);
    until(&mut harness, "the old texture", |v| {
        v.settings.objects == open
    });
    let said = &harness.state().toasts.all().last().expect("a message").text;
    assert!(
        said.contains("no such file.png") && said.contains("The objects stay as they were."),
        "{said}"
    );
}

#[test]
fn boards_are_added_and_removed() {
    let mut harness = panel();
    click(&mut harness, "Add a board");
    until(&mut harness, "the board", |v| is_at(v, 0.75));
    let viewer = harness.state();
    assert_eq!(
        (viewer.settings.objects.len(), viewer.selected_object),
        (2, 1)
    );
    harness.get_by_label("Objects: 2");
    click(&mut harness, "Remove this one");
    until(&mut harness, "the wall", |v| is_at(v, 1.5));
    click(&mut harness, "Remove this one");
    until(&mut harness, "nothing", |v| {
        v.is_current() && v.settings.objects.is_empty() && v.open.geometry.is_empty()
    });
    click(&mut harness, "Add a board");
    until(&mut harness, "another board", |v| is_at(v, 1.0));
}

/// A glTF file with a lamp and nothing else.
const LAMP: &str = r#"{
    "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_lights_punctual"],
    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "name": "left", "intensity": 3.0}]}},
    "nodes": [{"name": "glow", "translation": [0.2, 0.0, 0.0], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
    "scenes": [{"nodes": [0]}], "scene": 0
}"#;

/// The lamps of a file go with it and keep what was set of them, also where another has their name; they leave with it and come back.
#[test]
fn lamps_of_a_gltf_object_follow_it() {
    let folder = tempfile::tempdir().expect("folder");
    std::fs::write(folder.path().join("glow.gltf"), LAMP).expect("written");
    let text = format!("{SCENE}[[object]]\ngltf = \"glow.gltf\"\n");
    let (open, settings) = OpenScene::parse(&text, &folder.path().join("s.toml")).expect("valid");
    let mut harness = viewer();
    harness.state_mut().open = open;
    harness.state_mut().settings = settings;
    harness.run_steps(3);
    let lamps = |v: &Viewer| v.settings.lamps.clone();
    let [own, of_file] = lamps(harness.state()).try_into().expect("two lamps");
    assert!(
        of_file.of_gltf && (of_file.position_m.x - 0.2).abs() < 1e-9,
        "{of_file:?}"
    );
    let state = harness.state_mut();
    state.settings.lamps[1].level_pct = 30.0;
    let object = &mut state.settings.objects[1];
    let mut placed = Placement::of(object).expect("a glTF object");
    placed.translation_m.z = -2.0;
    placed.put(object);
    until(&mut harness, "the moved lamp", |v| {
        lamps(v)[1].position_m.z == -2.0 && v.is_current()
    });
    assert_eq!(lamps(harness.state())[1].level_pct, 30.0);
    assert_eq!(lamps(harness.state())[1].name, "left_2");
    let objects = harness.state().settings.objects.clone();
    harness.state_mut().settings.objects.pop();
    until(&mut harness, "one lamp", |v| lamps(v) == [own.clone()]);
    harness.state_mut().settings.objects = objects;
    until(&mut harness, "the lamp again", |v| {
        let lamps = lamps(v);
        lamps.len() == 2 && lamps[1].of_gltf && lamps[1].name != own.name
    });
    assert_eq!(lamps(harness.state())[1].position_m.z, -2.0);
}

/// A file of objects goes where it is put.
#[test]
fn a_gltf_object_is_placed() {
    let path = repository().join("assets/scenes/hull_inspection.toml");
    let (open, settings) = OpenScene::read(&path).expect("valid");
    let mut harness = viewer();
    harness.state_mut().open = open;
    harness.state_mut().settings = settings;
    harness.state_mut().tab = Tab::Scene;
    harness.run_steps(3);
    let bounds = |v: &Viewer| v.open.geometry.bounds().expect("a hull");
    let (lower, upper) = bounds(harness.state());
    let object = &mut harness.state_mut().settings.objects[0];
    let mut placed = Placement::of(object).expect("a glTF object");
    placed.translation_m += glam::DVec3::new(0.5, 0.0, 0.0);
    placed.put(object);
    until(&mut harness, "the moved hull", |v| {
        (bounds(v).0.x - lower.x - 0.5).abs() < 1e-6 && v.is_current()
    });
    let object = &mut harness.state_mut().settings.objects[0];
    placed.scale *= 2.0;
    placed.put(object);
    until(&mut harness, "the larger hull", |v| {
        let size = bounds(v).1 - bounds(v).0;
        (size - 2.0 * (upper - lower)).length() < 1e-6
    });
}

/// What is set of objects is in the command that is copied.
#[test]
fn the_command_renders_the_objects_that_are_set() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("mine.toml");
    std::fs::write(&path, SCENE).expect("written");
    let (open, filed) = OpenScene::read(&path).expect("valid");
    let wanted = Wanted {
        samples: 4,
        size_px: (160, 90),
        seed: 1,
        layer: None,
        denoised: false,
    };
    let mut settings = filed.clone();
    let camera = settings.camera.build();
    let mut plane = Plane::of(&settings.objects[0]).expect("a plane");
    plane.set_distance(&camera, 0.9);
    plane.put(&mut settings.objects[0]);
    Reflectance::Even([0.1, 0.2, 0.3]).put(&mut settings.objects[0]);
    let text = command(&open, (&filed, &settings), &wanted).expect("can be said");
    let options = text.split(" --set ").skip(1);
    let options: Vec<Setting> = options
        .map(|option| option.trim_matches('\'').parse().expect("valid"))
        .collect();
    assert_eq!(options.len(), 2, "{text}");
    let scene = Scene::read_with(&path, &options).expect("read");
    assert!((scene.quads[0].centre_m.x - 0.9).abs() < 1e-9, "{text}");
    assert_eq!(scene.materials[0].reflectance, [0.1, 0.2, 0.3]);
    settings.objects.push(Value::Table(toml::Table::new()));
    let more = command(&open, (&filed, &settings), &wanted).expect_err("cannot be said");
    assert_eq!(more, "objects were added or removed");
}
