//! Where things are: nothing is cut or covered, in small windows too; the keyboard goes where it is wanted.

use egui::{Key, Modifiers, Rect, Role, Vec2, vec2};
use egui_kittest::{
    Harness, Node,
    kittest::{NodeT, Queryable},
};
use uw_render::layers::RenderLayer;
use uw_viewer::app::{Tab, Viewer};
use uw_viewer::model::{OpenScene, ShownLayer};

use crate::panels::{until, viewer};
use crate::support::{profile, recording};

/// A small window, points.
pub(crate) const SMALL: Vec2 = vec2(900.0, 600.0);
/// A window whose picture leaves no room above and below, points.
const LOW: Vec2 = vec2(1280.0, 480.0);
/// How far a rectangle may reach over an edge: rounding to pixels.
const ROUNDING: f32 = 1.5;

/// A viewer in a window of `size`, with a finished picture of a layer.
fn window(size: Vec2, layer: ShownLayer) -> Harness<'static, Viewer> {
    let mut harness = viewer();
    harness.set_size(size);
    harness.state_mut().display.layer = layer;
    harness.run_steps(3);
    until(&mut harness, "the picture", |v| {
        let shows = layer == ShownLayer::Picture;
        v.is_current()
            && v.frame()
                .is_some_and(|f| f.coarseness == 1 && (shows || f.shown.values.is_some()))
    });
    harness.run_steps(3);
    harness
}

/// What a node says.
pub(crate) fn text(node: &Node<'_>) -> String {
    let accesskit = node.accesskit_node();
    accesskit.label().or(accesskit.value()).unwrap_or_default()
}

/// The texts in the window that have `part` in them, with their places.
fn texts(harness: &Harness<'_, Viewer>, part: &str) -> Vec<(String, Rect)> {
    harness
        .query_all_by_label_contains(part)
        .map(|node| (text(&node), node.rect()))
        .collect()
}

/// The pointer over the middle of the picture until the probe tells something; the place of what it tells.
fn probe(harness: &mut Harness<'_, Viewer>) -> Rect {
    let middle = harness.get_by_label("Picture").rect().center();
    harness.hover_at(middle);
    harness.run_steps(3);
    let found = texts(harness, "along the axis");
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].1
}

#[test]
fn labels_and_buttons_are_whole_in_a_small_window() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("operation.jsonl");
    std::fs::write(&path, recording(1.0)).expect("written");
    let mut harness = window(SMALL, ShownLayer::Picture);
    let guidance = &mut harness.state_mut().guidance;
    guidance.profile = Some(std::sync::Arc::new(profile()));
    guidance.open_record(&path).expect("a recording");
    for tab in [Tab::Water, Tab::Scene, Tab::Guidance] {
        is_whole(&mut harness, tab);
    }
    harness.state_mut().tab = Tab::Scene;
    harness.run_steps(3);
    harness.get_by_label("Objects: 1").click_accesskit();
    harness.run_steps(30);
    for scene in ["flat_reef", "hull_inspection"] {
        let path = format!("shipped:scenes/{scene}.toml");
        let (open, settings) = OpenScene::read(path.as_ref()).expect("shipped");
        let state = harness.state_mut();
        (state.open, state.settings.objects) = (open, settings.objects);
        is_whole(&mut harness, Tab::Scene);
    }
}

/// Nothing of a panel reaches over the picture or out of the small window.
pub(crate) fn is_whole(harness: &mut Harness<'_, Viewer>, tab: Tab) {
    let roles = [
        Role::Label,
        Role::Button,
        Role::CheckBox,
        Role::Slider,
        Role::SpinButton,
        Role::ComboBox,
        Role::RadioButton,
    ];
    harness.state_mut().tab = tab;
    harness.run_steps(4);
    let picture = harness.get_by_label("Picture").rect();
    let window = Rect::from_min_size(egui::Pos2::ZERO, SMALL).expand(ROUNDING);
    let mut seen = 0;
    for node in harness.root().children_recursive() {
        if !roles.contains(&node.accesskit_node().role()) {
            continue;
        }
        let rect = node.rect();
        // Bars at the top and bottom have the whole width.
        let in_bar = rect.top() < 26.0 || rect.top() > SMALL.y - 36.0;
        let right = if in_bar {
            window.right()
        } else {
            picture.left()
        };
        if rect.left() > right || picture.contains(rect.center()) {
            continue;
        }
        seen += 1;
        assert!(
            rect.left() >= window.left() && rect.right() <= right + ROUNDING,
            "{tab:?}: {:?} at {rect:?}, beyond {right}",
            text(&node)
        );
    }
    assert!(seen > 20, "{tab:?}: {seen}");
}

#[test]
fn the_probe_and_the_scale_of_colours_lie_beside_each_other() {
    for size in [SMALL, LOW] {
        let mut harness = window(size, ShownLayer::Layer(RenderLayer::Depth));
        let probe = probe(&mut harness);
        let ends: Vec<_> = texts(&harness, " m")
            .into_iter()
            .filter(|(text, _)| text.trim_end_matches(" m").parse::<f64>().is_ok())
            .collect();
        assert_eq!(ends.len(), 2, "{ends:?}");
        let picture = harness.get_by_label("Picture").rect();
        for (text, rect) in &ends {
            assert!(
                !rect.intersects(probe),
                "{size:?}: {text} {rect:?} {probe:?}"
            );
            assert!(
                picture.expand(ROUNDING).contains_rect(*rect),
                "{text} {rect:?}"
            );
        }
        let window = Rect::from_min_size(egui::Pos2::ZERO, size);
        assert!(window.contains_rect(probe), "{probe:?}");
        assert!(probe.left() >= picture.left() && probe.right() <= picture.right() + ROUNDING);
        // It covers nothing of the picture where there is room below it.
        if size == SMALL {
            assert!(probe.top() >= picture.bottom(), "{probe:?} {picture:?}");
        }
    }
}

#[test]
fn depths_are_told_in_metres() {
    let mut harness = window(LOW, ShownLayer::Layer(RenderLayer::Depth));
    probe(&mut harness);
    // The wall is 1.5 m away in the middle; the scale spans a tenth of that to both sides.
    for end in ["1.35 m", "1.65 m"] {
        assert_eq!(texts(&harness, end).len(), 1, "{end}");
    }
    let told = texts(&harness, "layer    1.500 m");
    assert_eq!(told.len(), 1);
    assert!(
        !told[0].0.contains("e0") && !told[0].0.contains("e-"),
        "{told:?}"
    );
}

#[test]
fn the_probe_leaves_with_the_pointer() {
    let mut harness = window(SMALL, ShownLayer::Picture);
    probe(&mut harness);
    harness.hover_at(egui::pos2(40.0, 300.0));
    harness.run_steps(3);
    assert_eq!(texts(&harness, "along the axis"), []);
    probe(&mut harness);
    harness.remove_cursor();
    harness.run_steps(3);
    assert_eq!(texts(&harness, "along the axis"), []);
}

#[test]
fn every_layer_of_the_menu_can_be_clicked() {
    let mut harness = window(SMALL, ShownLayer::Picture);
    let layers = ShownLayer::all(&["left".to_owned()]);
    for (layer, name) in layers {
        harness
            .get_by_role_and_label(Role::ComboBox, "Layer")
            .click();
        harness.run_steps(3);
        // By pointer: what lies outside of the list does not hear it.
        let item = harness
            .query_all_by_label(&name)
            .find(|node| node.accesskit_node().role() != Role::ComboBox);
        item.expect("in the list").click();
        harness.run_steps(3);
        assert_eq!(harness.state().display.layer, layer, "{name}");
    }
}

#[test]
fn the_file_dialog_takes_what_is_typed_at_once() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("typed.toml");
    let mut harness = viewer();
    harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
    harness.run_steps(4);
    let name = |harness: &Harness<'_, Viewer>| {
        let field = harness.get_by_role_and_label(Role::TextInput, "File");
        assert!(field.is_focused());
        field.value().unwrap_or_default()
    };
    assert_eq!(name(&harness), "scene.toml");
    // What is typed takes the place of the name, and leaves the extension.
    harness.event(egui::Event::Text("typed".to_owned()));
    harness.run_steps(2);
    assert_eq!(name(&harness), "typed.toml");
    harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    harness.event(egui::Event::Text(path.display().to_string()));
    harness.key_press(Key::Enter);
    harness.run_steps(4);
    assert!(path.is_file());
    harness.key_press_modifiers(Modifiers::COMMAND, Key::O);
    harness.run_steps(4);
    assert_eq!(name(&harness), "");
    // A folder is entered, and the name keeps the keyboard.
    harness.event(egui::Event::Text(folder.path().display().to_string()));
    harness.key_press(Key::Enter);
    harness.run_steps(4);
    assert_eq!(name(&harness), "");
    // The title names it too.
    harness
        .get_by_role_and_label(Role::Button, "typed.toml")
        .click_accesskit();
    harness.run_steps(3);
    harness.run_steps(2);
    assert_eq!(name(&harness), "typed.toml");
    harness.key_press(Key::Enter);
    harness.run_steps(2);
    until(&mut harness, "the file", |v| !v.is_loading());
    harness.run_steps(2);
    assert_eq!(harness.state().open.title, "typed.toml");
    harness.key_press_modifiers(Modifiers::COMMAND, Key::O);
    harness.run_steps(4);
    harness.key_press(Key::Escape);
    harness.run_steps(3);
    assert!(
        harness
            .query_by_role_and_label(Role::TextInput, "File")
            .is_none()
    );
}
