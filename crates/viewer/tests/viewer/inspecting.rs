//! Looking closely: kept pictures beside each other, counts, zoom, pinned pixels.

use egui::{Event, Key, Modifiers, Pos2, Role, vec2};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use uw_viewer::app::{Tab, Viewer};
use uw_viewer::model::snapshots::{MOST_KEPT, Side};
use uw_viewer::model::{FalseColour, ShownLayer};

use crate::layout::{SMALL, is_whole, text};
use crate::panels::{click, set, until, viewer};

/// A viewer with a whole picture and the panel open.
fn inspecting() -> Harness<'static, Viewer> {
    let mut harness = viewer();
    harness.key_press(Key::F5);
    harness.run_steps(3);
    assert_eq!(harness.state().tab, Tab::Inspect);
    whole(&mut harness);
    harness
}

fn whole(harness: &mut Harness<'_, Viewer>) {
    until(harness, "a whole picture", |v| {
        v.is_current() && v.frame().is_some_and(|f| f.coarseness == 1)
    });
    harness.run_steps(3);
}

fn keep(harness: &mut Harness<'_, Viewer>) {
    let before = harness.state().inspection.snapshots.all().len();
    harness.key_press(Key::K);
    until(harness, "a kept picture", |v| {
        !v.inspection.keeps_next && v.inspection.snapshots.all().len() > before.min(MOST_KEPT - 1)
    });
    harness.run_steps(2);
}

fn picture(harness: &Harness<'_, Viewer>) -> egui::Rect {
    harness.get_by_label("Picture").rect()
}

/// The pointer at a share of the picture's place.
fn point(harness: &mut Harness<'_, Viewer>, x: f32, y: f32) -> Pos2 {
    let rect = picture(harness);
    let at = rect.min + vec2(x, y) * rect.size();
    harness.hover_at(at);
    harness.run_steps(2);
    at
}

fn side(harness: &Harness<'_, Viewer>) -> f64 {
    let viewer = harness.state();
    let place = viewer.picture_place().expect("laid out");
    viewer.inspection.zoom.pixel_side(&place)
}

/// What is kept stays as it was while the live picture changes, and can be set again.
#[test]
fn a_kept_picture_stays_and_its_settings_come_back() {
    let mut harness = inspecting();
    let before = harness.state().settings.clone();
    keep(&mut harness);
    let of_live = |h: &Harness<'_, Viewer>| {
        let frame = h.state().frame().cloned().expect("a frame");
        frame.shown.image().expect("on the host").clone()
    };
    let first = of_live(&harness);
    harness.state_mut().settings.lamps[0].level_pct = 5.0;
    harness.run_steps(3);
    whole(&mut harness);
    let viewer = harness.state();
    let kept = viewer.inspection.snapshots.all().next().expect("kept");
    assert_eq!(*kept.image, first);
    assert_ne!(of_live(&harness), first);
    let start = "1  small.toml, ";
    assert!(kept.name.starts_with(start) && kept.name.ends_with(" UTC"));
    click(&mut harness, "Set");
    assert_eq!(harness.state().settings, before);
}

#[test]
fn the_wiper_is_dragged_and_moved_by_keys_and_sides_are_chosen() {
    let mut harness = inspecting();
    keep(&mut harness);
    assert!(!harness.state().inspection.comparison.on);
    harness.key_press(Key::B);
    harness.run_steps(3);
    let comparison = harness.state().inspection.comparison;
    assert_eq!(comparison.sides, [Side::Kept(1), Side::Live]);
    let camera = harness.state().settings.camera.clone();
    let middle = picture(&harness).center();
    harness.hover_at(middle);
    harness.step();
    harness.drag_at(middle);
    harness.step();
    let quarter = 0.25 * picture(&harness).width();
    harness.hover_at(middle - vec2(quarter, 0.0));
    harness.step();
    harness.drop_at(middle - vec2(quarter, 0.0));
    harness.run_steps(2);
    let wiper = harness.state().inspection.comparison.wiper;
    assert!((wiper - 0.25).abs() < 0.01, "{wiper}");
    // The camera did not turn with it.
    assert_eq!(harness.state().settings.camera, camera);
    harness.key_press(Key::Period);
    harness.run_steps(2);
    assert!((harness.state().inspection.comparison.wiper - wiper - 0.02).abs() < 1e-9);
    // Left of the wiper the probe tells of the kept picture, right of it of the live one.
    point(&mut harness, 0.1, 0.5);
    let probe = text(&harness.get_by_label_contains("counts   "));
    assert!(probe.starts_with("1  small.toml, "), "{probe}");
    assert!(harness.query_by_label_contains("along the axis").is_none());
    point(&mut harness, 0.6, 0.5);
    harness.get_by_label_contains("along the axis");
    // Another side by the list.
    harness.get_by_role_and_label(Role::ComboBox, "B").click();
    harness.run_steps(3);
    let name = harness
        .state()
        .inspection
        .snapshots
        .all()
        .next()
        .expect("kept");
    let name = name.name.clone();
    let item = harness
        .query_all_by_label(&name)
        .find(|node| node.accesskit_node().role() == Role::Button);
    item.expect("in the list").click();
    harness.run_steps(3);
    let sides = harness.state().inspection.comparison.sides;
    assert_eq!(sides, [Side::Kept(1); 2]);
    set(&mut harness, "place of the wiper", 70.0);
    assert!((harness.state().inspection.comparison.wiper - 0.7).abs() < 1e-9);
}

#[test]
fn at_most_eight_pictures_are_kept_and_the_oldest_leaves_with_a_word() {
    let mut harness = inspecting();
    for _ in 0..=MOST_KEPT {
        keep(&mut harness);
    }
    let viewer = harness.state();
    assert_eq!(viewer.inspection.snapshots.all().len(), MOST_KEPT);
    let toasts = viewer.toasts.all().iter();
    let said =
        toasts.filter(|t| t.text.starts_with("1  ") && t.text.ends_with("not kept any more"));
    assert_eq!(said.count(), 1);
    let ids: Vec<u64> = viewer.inspection.snapshots.all().map(|s| s.id).collect();
    assert_eq!(ids, (2..=9).collect::<Vec<_>>());
}

/// A picture that is exposed too far has clipped pixels, and they are counted.
#[test]
fn counts_are_shown_of_the_picture_and_not_of_false_colours() {
    let mut harness = inspecting();
    harness.get_by_label("255, full");
    let exposed = |harness: &mut Harness<'_, Viewer>, factor: f64| {
        harness.state_mut().settings.sensor.exposure = uw_render::scene::Exposure::Fixed(factor);
        harness.run_steps(3);
        let revised = |v: &Viewer| v.frame().is_some_and(|f| f.shown.exposure == factor);
        until(harness, "the exposure", revised);
        harness.run_steps(3);
        harness.query_all_by_label("100.00 %").count()
    };
    assert_eq!(exposed(&mut harness, 1e6), 4);
    assert_eq!(exposed(&mut harness, 4.0), 0);
    click(&mut harness, "mark clipped and black pixels");
    assert!(harness.state().inspection.marks);
    harness.key_press(Key::C);
    harness.run_steps(2);
    assert!(!harness.state().inspection.marks);
    harness.state_mut().display.false_colour = FalseColour::Viridis;
    harness.run_steps(3);
    until(&mut harness, "false colours", |v| {
        v.frame().is_some_and(|f| f.shown.legend.is_some())
    });
    harness.run_steps(3);
    assert!(harness.query_by_label("255, full").is_none());
}

/// The wheel with Ctrl zooms about the pointer and leaves the camera alone; without, it moves the camera as before.
#[test]
fn zoom_goes_about_the_pointer_and_the_camera_stays() {
    let mut harness = inspecting();
    let camera = harness.state().settings.camera.clone();
    let fit = side(&harness);
    point(&mut harness, 0.25, 0.75);
    harness.event(Event::Zoom(4.0));
    harness.run_steps(3);
    assert!((side(&harness) - 4.0 * fit).abs() < 1e-6);
    let probed = |h: &Harness<'_, Viewer>| {
        let node = h.get_by_label_contains("along the axis");
        text(&node)
            .split("pixel ")
            .nth(1)
            .unwrap_or_default()
            .to_owned()
    };
    let under = probed(&harness);
    harness.event(Event::Zoom(1.5));
    harness.run_steps(3);
    assert_eq!(probed(&harness), under);
    harness.key_press(Key::ArrowLeft);
    harness.run_steps(3);
    assert_ne!(probed(&harness), under);
    harness.key_press(Key::Num9);
    harness.run_steps(2);
    assert!((side(&harness) - 1.0).abs() < 1e-6);
    harness.key_press(Key::Num0);
    harness.run_steps(2);
    assert_eq!(side(&harness), fit);
    for (key, expected) in [(Key::Plus, 2.0_f64.sqrt() * fit), (Key::Minus, fit)] {
        harness.key_press(key);
        harness.run_steps(2);
        assert!((side(&harness) - expected).abs() < 1e-6, "{key:?}");
    }
    assert_eq!(harness.state().settings.camera, camera);
    harness.event(Event::MouseWheel {
        source: egui::MouseWheelSource::Wheel,
        unit: egui::MouseWheelUnit::Point,
        delta: vec2(0.0, 50.0),
        phase: egui::TouchPhase::Move,
        modifiers: Modifiers::NONE,
    });
    harness.run_steps(4);
    assert_ne!(harness.state().settings.camera, camera);
    assert_eq!(side(&harness), fit);
}

#[test]
fn pins_follow_the_live_picture_and_are_removed_one_by_one() {
    let mut harness = inspecting();
    for x in [0.3, 0.6] {
        point(&mut harness, x, 0.5);
        harness.key_press(Key::P);
        harness.run_steps(2);
    }
    harness.remove_cursor();
    harness.run_steps(2);
    let first = |h: &Harness<'_, Viewer>| {
        let node = h.query_all_by_label_contains("1: ").next().expect("a pin");
        text(&node)
    };
    let before = first(&harness);
    harness.state_mut().settings.sensor.exposure = uw_render::scene::Exposure::Fixed(1e6);
    harness.run_steps(3);
    until(&mut harness, "the exposure", |v| {
        v.frame().is_some_and(|f| f.shown.exposure == 1e6)
    });
    harness.run_steps(3);
    assert_ne!(before, "1: 255 255 255");
    assert_eq!(first(&harness), "1: 255 255 255");
    assert_eq!(
        harness
            .query_all_by_label_contains("255 255 255 counts")
            .count(),
        2
    );
    let second = harness.state().inspection.pins[1];
    harness.get_by_role_and_label(Role::Button, "Remove all pins");
    harness
        .query_all_by_label("x")
        .next()
        .expect("a button")
        .click();
    harness.run_steps(2);
    assert_eq!(harness.state().inspection.pins, [second]);
    harness.key_press(Key::Delete);
    harness.run_steps(2);
    assert_eq!(harness.state().inspection.pins, []);
}

/// Nothing of the panel is cut in a small window, with pictures kept and pixels pinned.
#[test]
fn the_panel_is_whole_in_a_small_window() {
    let mut harness = inspecting();
    harness.set_size(SMALL);
    harness.run_steps(3);
    whole(&mut harness);
    keep(&mut harness);
    point(&mut harness, 0.5, 0.5);
    harness.key_press(Key::P);
    harness.key_press(Key::B);
    harness.run_steps(3);
    harness.remove_cursor();
    harness.run_steps(2);
    is_whole(&mut harness, Tab::Inspect);
}

#[test]
fn layers_and_colours_have_keys() {
    let mut harness = viewer();
    let all = ShownLayer::all(&["left".to_owned()]);
    let mut seen = Vec::new();
    for _ in &all {
        harness.key_press(Key::L);
        harness.run_steps(2);
        seen.push(harness.state().display.layer);
    }
    // Once around: all of them, the picture last.
    let mut expected: Vec<_> = all.iter().map(|(layer, _)| *layer).collect();
    expected.rotate_left(1);
    assert_eq!(seen, expected);
    harness.key_press_modifiers(Modifiers::SHIFT, Key::L);
    harness.run_steps(2);
    assert_eq!(harness.state().display.layer, expected[expected.len() - 2]);
    for key in [Key::V, Key::G, Key::N] {
        harness.key_press(key);
        harness.run_steps(2);
    }
    let viewer = harness.state();
    assert_eq!(viewer.display.false_colour, FalseColour::Viridis);
    assert!(viewer.display.logarithmic && viewer.denoised);
}
