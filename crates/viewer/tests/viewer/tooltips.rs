//! Every knob says under the pointer what it may be, and in which unit.

use egui::{Pos2, Rect, Role, vec2};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use uw_render::scene::Snow;
use uw_viewer::app::{Tab, Viewer};
use uw_viewer::model::{Coefficients, OpenScene, PhaseModel};

use crate::layout::text;
use crate::panels::viewer;
use crate::support::{profile, recording};
use crate::varying::{NUMBERS, TYPES, opened};

/// A window in which whole panels are seen, points.
const TALL: egui::Vec2 = vec2(1280.0, 2400.0);

/// How often a tooltip is waited for: it takes some frames.
const ATTEMPTS: usize = 8;

/// A viewer in a tall window whose tooltips come at once.
fn tall() -> Harness<'static, Viewer> {
    let mut harness = viewer();
    harness.set_size(TALL);
    harness.ctx.all_styles_mut(|style| {
        style.interaction.tooltip_delay = 0.0;
        style.interaction.show_tooltips_only_when_still = false;
    });
    harness.state_mut().goal.target_error = Some(0.5);
    harness.state_mut().paused = true;
    harness.run_steps(3);
    harness
}

/// The knobs of the window, with their places and roles.
fn knobs(harness: &Harness<'_, Viewer>) -> Vec<(Role, String, Rect)> {
    let roles = [Role::Slider, Role::SpinButton];
    let nodes = harness.root().children_recursive();
    let knobs = nodes.filter(|node| {
        let accesskit = node.accesskit_node();
        roles.contains(&accesskit.role()) && !accesskit.is_disabled()
    });
    knobs
        .map(|node| (node.accesskit_node().role(), text(&node), node.rect()))
        .filter(|(_, name, _)| name != "Wiper")
        .collect()
}

/// The lines of text in the window that tell a range.
fn ranges(harness: &Harness<'_, Viewer>) -> Vec<String> {
    let is_range = |line: &&str| {
        let mut words = line.split(' ').skip_while(|word| *word != "to").skip(1);
        words.next().is_some() && line.contains(" to ")
    };
    let nodes = harness.root().children_recursive();
    let texts = nodes.map(|node| text(&node)).collect::<Vec<_>>();
    let lines = texts.iter().flat_map(|text| text.lines());
    lines.filter(is_range).map(str::to_owned).collect()
}

/// How many knobs there are, each of which tells its range.
fn all_tell(harness: &mut Harness<'_, Viewer>, what: &str) -> usize {
    harness.hover_at(Pos2::new(1270.0, 2390.0));
    harness.run_steps(3);
    let before = ranges(harness).len();
    let count = knobs(harness).len();
    for i in 0..count {
        let told = (0..ATTEMPTS).any(|_| {
            // Rows move when a picture comes that tells more.
            let (_, name, rect) = knobs(harness).swap_remove(i);
            assert!(rect.bottom() < TALL.y, "{what}: {name} is too low");
            harness.hover_at(rect.center());
            harness.run_steps(3);
            ranges(harness).len() > before
        });
        assert!(told, "{what}: {:?} tells no range", knobs(harness)[i]);
    }
    count
}

#[test]
fn knobs_of_the_water_tell_their_range() {
    let mut harness = tall();
    harness.state_mut().settings.snow = Some(Snow::default());
    harness.run_steps(3);
    harness
        .get_by_label("Lens and shutter of the flakes")
        .click_accesskit();
    // The header opens by and by.
    harness.run_steps(30);
    assert!(all_tell(&mut harness, "water") > 35);
    let direct = Coefficients::Direct(uw_media::Iops {
        a: [0.3; 3],
        b: [0.2; 3],
    });
    harness.state_mut().settings.snow = None;
    for phase in PhaseModel::CHOICES {
        let water = harness.state_mut().settings.water.as_mut().expect("water");
        water.coefficients = direct.clone();
        water.phase = phase;
        harness.run_steps(3);
        all_tell(&mut harness, "a phase function");
    }
    for water in [NUMBERS, TYPES] {
        harness.state_mut().settings = opened(water).1;
        harness.run_steps(3);
        assert!(all_tell(&mut harness, "a profile") > 10);
    }
}

#[test]
fn knobs_of_the_other_panels_tell_their_range() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("operation.jsonl");
    std::fs::write(&path, recording(1.0)).expect("written");
    let mut harness = tall();
    let state = harness.state_mut();
    state.tab = Tab::Scene;
    state
        .settings
        .lamps
        .push(uw_viewer::model::open_scene::lamp_beside(&state.settings));
    state.settings.sensor.noise = Some(uw_render::scene::Noise { a: 1e-3, b: 1e-5 });
    harness.run_steps(3);
    harness.get_by_label("From a data sheet").click_accesskit();
    harness.get_by_label("Objects: 1").click_accesskit();
    harness.run_steps(30);
    assert!(all_tell(&mut harness, "scene") > 39);
    let (open, settings) =
        OpenScene::read("shipped:scenes/hull_inspection.toml".as_ref()).expect("shipped");
    let state = harness.state_mut();
    (state.open, state.settings.objects) = (open, settings.objects);
    harness.run_steps(3);
    all_tell(&mut harness, "a glTF object");
    let state = harness.state_mut();
    state.settings.sensor.exposure = uw_render::scene::Exposure::AutoMean(0.4);
    harness.run_steps(3);
    all_tell(&mut harness, "automatic exposure");
    let state = harness.state_mut();
    state.tab = Tab::Inspect;
    state.inspection.comparison.on = true;
    harness.run_steps(3);
    assert!(all_tell(&mut harness, "inspect") > 1);
    let state = harness.state_mut();
    state.tab = Tab::Guidance;
    state.guidance.profile = Some(std::sync::Arc::new(profile()));
    state.guidance.open_record(&path).expect("a recording");
    harness.run_steps(3);
    harness.get_by_label("Objective").click_accesskit();
    harness.run_steps(30);
    assert!(all_tell(&mut harness, "guidance") > 12);
}
