//! What is chosen in the window is there in the next run.

use std::path::Path;

use egui::{Key, Theme};
use egui_kittest::Harness;
use uw_render::layers::RenderLayer;
use uw_viewer::app::{Options, Tab, Viewer};
use uw_viewer::model::camera::Motion;
use uw_viewer::model::lasting::{Brightness, Lasting};
use uw_viewer::model::{FalseColour, ShownLayer};
use uw_viewer::worker::Goal;

use crate::support::small;

/// A viewer that keeps its choices in `store`.
fn run(store: &Path) -> Harness<'static, Viewer> {
    let options = Options {
        goal: Goal {
            samples_per_pixel: 1,
            target_error: None,
        },
        lasting: Lasting::stored_in(store.to_path_buf()),
        ..Options::default()
    };
    let ctx = egui::Context::default();
    let viewer = Viewer::new(&ctx, small(), options).expect("a thread");
    let mut harness =
        Harness::builder().build_ui_state(|ui, viewer: &mut Viewer| viewer.show(ui), viewer);
    harness.run_steps(3);
    harness
}

#[test]
fn panel_layer_overlays_motion_and_scene_last() {
    let folder = tempfile::tempdir().expect("folder");
    let store = folder.path().join("window.json");
    let mut first = run(&store);
    assert_eq!(first.state().tab, Tab::Water);
    for key in [Key::F5, Key::C, Key::Num3] {
        first.key_press(key);
        first.run_steps(2);
    }
    let viewer = first.state_mut();
    viewer.display.layer = ShownLayer::Layer(RenderLayer::Lamp(0));
    viewer.display.false_colour = FalseColour::Viridis;
    viewer.display.logarithmic = true;
    viewer.clouds_shown = false;
    viewer.lamps_follow = false;
    viewer.open.path = Some("scenes/mine.toml".into());
    first.ctx.set_theme(Theme::Light);
    first.ctx.set_zoom_factor(1.5);
    first.run_steps(3);
    let display = first.state().display;
    // It is kept at once: a run that is cut off loses nothing.
    let lasting = Lasting::stored_in(store.clone());
    drop(first);
    let choices = lasting.choices();
    assert_eq!(choices.brightness, Brightness::Light);
    assert_eq!(choices.controls, 1.5);
    let scene = choices.scene.as_ref().expect("a scene");
    assert!(scene.is_absolute() && scene.ends_with("scenes/mine.toml"));
    let second = run(&store);
    let viewer = second.state();
    assert_eq!((viewer.tab, viewer.motion), (Tab::Inspect, Motion::Vehicle));
    assert_eq!(viewer.display, display);
    assert!(viewer.inspection.marks && !viewer.clouds_shown && !viewer.lamps_follow);
    assert_eq!(viewer.toasts.all().len(), 0);
}

#[test]
fn a_broken_file_is_told_and_replaced() {
    let folder = tempfile::tempdir().expect("folder");
    let store = folder.path().join("window.json");
    std::fs::write(&store, "{\"panel\": \"cellar\"}").expect("written");
    let mut harness = run(&store);
    let viewer = harness.state();
    assert_eq!(viewer.tab, Tab::Water);
    assert_eq!(viewer.toasts.all().len(), 1);
    let said = &viewer.toasts.all()[0].text;
    assert!(
        said.contains("window.json: ") && said.contains("cellar"),
        "{said}"
    );
    harness.key_press(Key::F3);
    harness.run_steps(3);
    let mut again = Lasting::stored_in(store);
    assert_eq!(
        (again.choices().panel, again.take_note()),
        (Tab::Scene, None)
    );
}
