//! Clicking through every panel.

use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use egui::{Key, Modifiers};
use egui_kittest::{Harness, kittest::Queryable};
use uw_render::layers::RenderLayer;
use uw_viewer::app::{Options, Tab, Viewer};
use uw_viewer::model::camera::Motion;
use uw_viewer::model::{Coefficients, PhaseModel, ShownLayer};
use uw_viewer::worker::Goal;

use crate::support::{PATIENCE, small};

/// Longest pause between two looks at what is waited for.
const LONGEST_NAP: Duration = Duration::from_millis(60);

/// A viewer of the small scene, laid out.
pub(crate) fn viewer() -> Harness<'static, Viewer> {
    let ctx = egui::Context::default();
    // Little is rendered: these tests look at the panels.
    let options = Options {
        goal: Goal {
            samples_per_pixel: 2,
            target_error: None,
        },
        ..Options::default()
    };
    let viewer = Viewer::new(&ctx, small(), options).expect("a thread");
    let mut harness = Harness::builder()
        .with_size([1280.0, 720.0])
        .build_ui_state(|ui, viewer: &mut Viewer| viewer.show(ui), viewer);
    harness.run_steps(3);
    harness
}

/// Clicks what has this label, also where it has scrolled out of view, and lets the window answer.
pub(crate) fn click(harness: &mut Harness<'_, Viewer>, label: &str) {
    harness.get_by_label(label).click_accesskit();
    harness.run_steps(3);
}

/// Steps until `done`.
pub(crate) fn until(harness: &mut Harness<'_, Viewer>, what: &str, done: impl Fn(&Viewer) -> bool) {
    let start = Instant::now();
    // What is waited for long is left more of the processor.
    let mut nap = Duration::from_millis(2);
    while !done(harness.state()) {
        harness.step();
        assert!(start.elapsed() < PATIENCE, "{what} did not come");
        std::thread::sleep(nap);
        nap = (2 * nap).min(LONGEST_NAP);
    }
}

/// Sets a slider by its accessible value, as a screen reader does.
pub(crate) fn set(harness: &mut Harness<'_, Viewer>, label: &str, value: f64) {
    harness
        .get_by_role_and_label(egui::Role::Slider, label)
        .set_value_accesskit(value);
    harness.run_steps(3);
}

#[test]
fn the_water_panel_sets_the_water() {
    let mut harness = viewer();
    let iops = |h: &Harness<'_, Viewer>| {
        let settings = &h.state().settings;
        let water = settings.water.as_ref().expect("water");
        let response = &settings.response.response;
        water.coefficients.iops(response).expect("covered")
    };
    let before = (iops(&harness), harness.state().generation());
    click(&mut harness, "7C");
    assert!(iops(&harness).a[2] > before.0.a[2]);
    assert!(harness.state().generation() > before.1);
    set(&mut harness, "between types", 6.5);
    let water = harness.state().settings.water.clone().expect("water");
    assert!(
        matches!(water.coefficients, Coefficients::Jerlov { scale, .. } if (scale - 6.5).abs() < 1e-9)
    );
    let mixed = iops(&harness);
    click(&mut harness, "own");
    assert_eq!(
        harness
            .state()
            .settings
            .water
            .clone()
            .expect("water")
            .coefficients,
        Coefficients::Direct(mixed)
    );
    set(&mut harness, "backscatter fraction B", 0.05);
    let water = harness.state().settings.water.clone().expect("water");
    assert!(
        matches!(water.phase, PhaseModel::FournierForand { backscatter_fraction, .. } if (backscatter_fraction - 0.05).abs() < 1e-9),
        "{:?}",
        water.phase
    );
    set(&mut harness, "depth of the camera", 7.0);
    assert_eq!(harness.state().settings.depth_m(), Some(7.0));
    // The lamp goes with the camera.
    assert!((harness.state().settings.lamps[0].position_m.z + 7.0).abs() < 1e-9);
    set(&mut harness, "zenith angle", 50.0);
    assert_eq!(
        harness.state().settings.sun.map(|s| s.zenith_deg),
        Some(50.0)
    );
    click(&mut harness, "sun");
    assert_eq!(harness.state().settings.sun, None);
    click(&mut harness, "there is water");
    assert!(harness.state().settings.water.is_none());
}

#[test]
fn undo_takes_back_what_was_set_and_redo_brings_it_again() {
    let mut harness = viewer();
    let first = harness.state().settings.clone();
    click(&mut harness, "9C");
    let second = harness.state().settings.clone();
    assert_ne!(first, second);
    harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    harness.run_steps(3);
    assert_eq!(harness.state().settings, first);
    assert_eq!(harness.state().can_undo_redo(), (false, true));
    harness.key_press_modifiers(Modifiers::COMMAND, Key::Y);
    harness.run_steps(3);
    assert_eq!(harness.state().settings, second);
}

#[test]
fn the_scene_panel_sets_camera_lamps_and_sensor() {
    let mut harness = viewer();
    harness.key_press(Key::F3);
    harness.run_steps(3);
    assert_eq!(harness.state().tab, Tab::Scene);
    click(&mut harness, "Vehicle");
    assert_eq!(harness.state().motion, Motion::Vehicle);
    set(&mut harness, "field of view", 80.0);
    assert!((harness.state().settings.camera.hfov_deg() - 80.0).abs() < 1e-6);
    set(&mut harness, "left level", 30.0);
    assert_eq!(harness.state().settings.lamps[0].level_pct, 30.0);
    click(&mut harness, "Add a lamp");
    assert_eq!(harness.state().settings.lamps.len(), 2);
    assert_eq!(harness.state().settings.lamps[1].name, "lamp1");
    let generation = harness.state().generation();
    until(&mut harness, "a picture", Viewer::is_current);
    click(&mut harness, "sensor noise");
    assert!(harness.state().settings.sensor.noise.is_some());
    assert_eq!(
        harness.state().generation(),
        generation,
        "the sensor needs no new render"
    );
}

#[test]
fn layers_and_the_probe_follow_the_picture() {
    let mut harness = viewer();
    harness.state_mut().display.layer = ShownLayer::Layer(RenderLayer::Depth);
    until(&mut harness, "the depth layer", |v| {
        v.is_current()
            && v.frame()
                .is_some_and(|f| f.coarseness == 1 && f.shown.values.is_some())
    });
    let frame = harness.state().frame().cloned().expect("a frame");
    let text = uw_viewer::ui::picture::probe_text(&frame, glam::DVec2::splat(0.5)).expect("inside");
    assert!(text.contains("depth    1.500 m along the axis"), "{text}");
    assert!(text.contains("layer    1.5"), "{text}");
    assert_eq!(
        uw_viewer::ui::picture::probe_text(&frame, glam::DVec2::new(1.2, 0.5)),
        None
    );
}

#[test]
fn drags_and_keys_move_the_camera() {
    let mut harness = viewer();
    until(&mut harness, "a picture", Viewer::is_current);
    let start = harness.state().settings.camera.clone();
    let middle = harness.get_by_label("Picture").rect().center();
    let ahead = harness.state().settings.camera.position_m + 1.5 * start.forward;
    harness.hover_at(middle);
    harness.step();
    harness.drag_at(middle);
    harness.step();
    harness.hover_at(middle + egui::vec2(60.0, 20.0));
    harness.step();
    harness.drop_at(middle + egui::vec2(60.0, 20.0));
    harness.run_steps(2);
    let orbited = harness.state().settings.camera.clone();
    assert_ne!(orbited.position_m, start.position_m);
    let distance = orbited.position_m.distance(ahead);
    assert!((distance - 1.5).abs() < 1e-6, "{distance}");
    harness.key_down(Key::W);
    harness.run_steps(4);
    harness.key_up(Key::W);
    harness.run_steps(2);
    let flown = &harness.state().settings.camera;
    assert!((flown.position_m - orbited.position_m).dot(orbited.forward) > 0.01);
}

#[test]
fn pause_and_restart_have_buttons() {
    let mut harness = viewer();
    until(&mut harness, "a picture", Viewer::is_current);
    click(&mut harness, "Pause");
    assert!(harness.state().paused);
    click(&mut harness, "Go on");
    assert!(!harness.state().paused);
    let generation = harness.state().generation();
    click(&mut harness, "Restart");
    assert!(harness.state().generation() > generation);
}

#[test]
fn the_help_opens_and_closes() {
    let mut harness = viewer();
    assert!(harness.query_by_label("Keys and mouse").is_none());
    harness.key_press(Key::F1);
    harness.run_steps(3);
    // Its title, and itself among the commands.
    assert_eq!(harness.query_all_by_label("Keys and mouse").count(), 2);
    click(&mut harness, "Close");
    assert!(!harness.state().help_open);
}

#[test]
fn a_scene_is_saved_and_opened_through_the_dialog() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("mine.toml");
    let mut harness = viewer();
    click(&mut harness, "5C");
    let settings = harness.state().settings.clone();
    for (key, accept) in [(Key::S, "Save"), (Key::O, "Open")] {
        harness.key_press_modifiers(Modifiers::COMMAND, key);
        harness.run_steps(3);
        let field = harness.get_by_role_and_label(egui::Role::TextInput, "File");
        field.focus();
        harness.run_steps(2);
        harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
        harness
            .get_by_role_and_label(egui::Role::TextInput, "File")
            .type_text(&path.display().to_string());
        harness.run_steps(2);
        click(&mut harness, accept);
        until(&mut harness, "the file", |v| !v.is_loading());
        if key == Key::S {
            assert!(path.is_file());
            click(&mut harness, "III");
            assert_ne!(harness.state().settings, settings);
        }
    }
    assert_eq!(harness.state().settings, settings);
    assert_eq!(harness.state().open.title, "mine.toml");
}

#[test]
fn the_guidance_panel_calibrates_advises_and_goes_there() {
    let mut harness = viewer();
    harness.state_mut().guidance.paths = 256;
    harness.key_press(Key::F4);
    harness.run_steps(3);
    click(&mut harness, "Run the routine");
    assert!(harness.state().guidance.progress().is_some());
    until(&mut harness, "the calibration", |v| {
        v.guidance.progress().is_none() && !v.guidance.is_reading()
    });
    let origin = harness
        .state()
        .guidance
        .origin
        .clone()
        .expect("of a routine");
    assert_eq!(origin.pattern, harness.state().guidance.pattern);
    let guidance = &harness.state().guidance;
    let profile = guidance.profile.clone().expect("a profile");
    assert_eq!(profile.distance_range_m(), (0.5, 3.0));
    let first = profile.depth()[0].k_z;
    let last = profile.depth()[profile.depth().len() - 1].k_z;
    assert!(
        last[0] < 0.5 * first[0],
        "red light falls with depth: {first:?} {last:?}"
    );
    let answer = guidance.answer.clone().expect("advice");
    assert!(answer.valid, "{:?}", answer.reason);
    let best = answer.score.expect("a score");
    assert!(best >= answer.score_here.expect("a score"));
    // The map is of the same objective, its contrasts are within some hundredths of a count: nothing on it is much better than the suggestion.
    let (_, highest) = answer.map.as_ref().expect("a map").range();
    assert!(highest <= best + 2e-3, "{highest} {best}");
    assert!(!answer.steps.is_empty());
    click(&mut harness, "Render it");
    until(&mut harness, "the render", |v| {
        v.guidance.progress().is_none()
    });
    let check = harness.state().guidance.check.expect("rendered");
    assert_eq!(check.at, [answer.distance_m, answer.light_pct]);
    // How near they are is for `physics`; here it is that physics was asked.
    assert!(answer.errors.iter().all(Option::is_some), "{answer:?}");
    let count = |harness: &Harness<'_, Viewer>, text: &str| {
        harness.query_all_by_label_contains(text).count()
    };
    assert_eq!(count(&harness, "±"), 4);
    click(&mut harness, "Network");
    let of_network = harness.state().guidance.answer.clone().expect("advice");
    assert!(
        of_network.errors.iter().all(Option::is_none),
        "{of_network:?}"
    );
    click(&mut harness, "Physics");
    let again = harness.state().guidance.answer.clone().expect("advice");
    assert_eq!(
        [again.distance_m, again.light_pct],
        [answer.distance_m, answer.light_pct]
    );
    click(&mut harness, "Go there");
    let viewer = harness.state();
    assert!((viewer.settings.lamps[0].level_pct - answer.light_pct).abs() < 1e-9);
    let camera = &viewer.settings.camera;
    assert!(
        (1.5 - camera.position_m.x - answer.distance_m).abs() < 1e-6,
        "{}",
        camera.position_m
    );
    // The vehicle's settings are round: centimetres and whole percents.
    let guidance = &viewer.guidance;
    let [centimetres, percents] = [100.0 * guidance.position.distance_m, guidance.light_pct];
    assert!((centimetres - 100.0 * answer.distance_m).abs() <= 0.5 + 1e-6);
    assert!((percents - answer.light_pct).abs() <= 0.5 + 1e-6);
    for value in [centimetres, percents] {
        assert!((value - value.round()).abs() < 1e-6, "{value}");
    }
}

#[test]
fn the_routine_without_daylight_says_what_to_do_and_can_be_cancelled() {
    let mut harness = viewer();
    harness.key_press(Key::F4);
    harness.run_steps(3);
    click(&mut harness, "Run the routine");
    click(&mut harness, "Cancel");
    assert!(harness.state().guidance.progress().is_none());
    harness.state_mut().settings.sun = None;
    harness.state_mut().settings.sky_radiance = [0.0; 3];
    click(&mut harness, "Run the routine");
    until(&mut harness, "the answer", |v| {
        v.guidance.progress().is_none()
    });
    let viewer = harness.state();
    assert!(viewer.guidance.profile.is_none());
    let said = &viewer.toasts.all().last().expect("a message").text;
    assert!(said.contains("needs daylight: switch on the sun"), "{said}");
}

#[test]
fn a_daemon_gives_the_same_advice_as_the_library() {
    use uw_guidance::{Checks, Limits, Objective, Service, advise_checked};
    let (model, profile) = (crate::support::model(), crate::support::profile());
    let now = crate::support::fitting(1.0, 1.0, 0.0, &model);
    let objective = Objective::default();
    let expected = advise_checked(&now, &profile, &model, &objective, &Checks::default());
    assert!(expected.moves(), "{:?}", expected.reason);
    let service = Service::new(model, "default", profile.clone(), objective);
    let running = uw_guidance::spawn("127.0.0.1:0", service, Limits::default()).expect("a port");
    let address = running.local_addr().to_string();
    let mut link = uw_viewer::guidance::daemon::Link::to(address);
    let (sender, woken) = channel();
    let size_px = Some([1280, 720]);
    link.ask(
        now,
        size_px,
        Some(std::sync::Arc::new(profile)),
        objective,
        move || {
            let _ = sender.send(());
        },
    );
    woken.recv_timeout(PATIENCE).expect("an answer");
    let mut toasts = uw_viewer::ui::toasts::Toasts::default();
    let answer = link.poll(&mut toasts);
    assert!(toasts.all().is_empty(), "{:?}", toasts.all());
    let answer = answer.expect("advice");
    assert_eq!(
        (answer.distance_m, answer.light_pct),
        (expected.distance_m, expected.light_pct)
    );
    assert!(answer.valid && answer.moves);
    // Replies are rounded to hundredths of a count.
    let predicted = answer.predicted.expect("predicted");
    for (told, exact) in predicted
        .iter()
        .zip(expected.predicted_contrast.expect("predicted"))
    {
        assert!((told - exact).abs() < 0.006, "{told} {exact}");
    }
    // A picture of another size gets none.
    let (sender, woken) = channel();
    link.ask(now, Some([240, 135]), None, objective, move || {
        let _ = sender.send(());
    });
    woken.recv_timeout(PATIENCE).expect("an answer");
    let refused = link.poll(&mut toasts).expect("an answer");
    assert!(!refused.valid && !refused.moves);
    let reason = refused.reason.unwrap_or_default();
    assert!(reason.contains("1280 x 720 pixels"), "{reason}");
    let map = answer.map.expect("a map");
    assert_eq!(map.scores.len(), 60 * 41);
    drop(running);
    link.ask(now, size_px, None, objective, || {});
    let start = Instant::now();
    while link.is_waiting() && start.elapsed() < PATIENCE {
        assert!(link.poll(&mut toasts).is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    let said = &toasts.all().last().expect("a message").text;
    assert!(said.contains("uwguide --model"), "{said}");
}

#[test]
fn a_recorded_operation_is_played_and_the_camera_follows() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("operation.jsonl");
    std::fs::write(&path, crate::support::recording(1.0)).expect("written");
    let mut harness = viewer();
    harness.state_mut().guidance.profile = Some(std::sync::Arc::new(crate::support::profile()));
    harness.key_press(Key::F4);
    harness.run_steps(3);
    let steps = harness.state_mut().guidance.open_record(&path);
    assert_eq!(steps, Ok(6));
    harness.run_steps(3);
    click(&mut harness, "camera follows");
    click(&mut harness, "Next");
    let viewer = harness.state();
    let operation = viewer.guidance.operation.as_ref().expect("open");
    assert_eq!(operation.at, 1);
    // The second state: 1.3 m deep, 1.2 m from the wall at x = 1.5 m, lamps at 10 %.
    let camera = &viewer.settings.camera;
    assert!(
        (camera.position_m.z + 1.3).abs() < 1e-9,
        "{}",
        camera.position_m
    );
    assert!(
        (camera.position_m.x - 0.3).abs() < 1e-6,
        "{}",
        camera.position_m
    );
    assert_eq!(viewer.settings.lamps[0].level_pct, 10.0);
    let answer = viewer
        .guidance
        .answer
        .as_ref()
        .expect("advice for the recorded state");
    assert_eq!(answer.observation.distance_m, 1.2);
    click(&mut harness, "Play");
    until(&mut harness, "the end", |v| {
        v.guidance.operation.as_ref().is_some_and(|o| o.at == 5)
    });
}

#[test]
fn a_right_click_shows_the_spectrum_of_a_pixel() {
    let mut harness = viewer();
    until(&mut harness, "a picture", |v| v.frame().is_some());
    harness.run_steps(3);
    let middle = harness.get_by_label("Picture").rect().center();
    harness.hover_at(middle);
    harness.run_steps(2);
    harness.get_by_label("Picture").click_secondary();
    harness.run_steps(3);
    let start = Instant::now();
    while harness
        .query_by_label_contains("in bands of 10 nm")
        .is_none()
    {
        harness.step();
        assert!(start.elapsed() < PATIENCE, "no spectrum came");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(
        harness
            .query_by_label_contains("Light of pixel 80, 45")
            .is_some()
    );
    // Of other settings it is told to be old.
    assert!(
        harness
            .query_by_label_contains("of earlier settings")
            .is_none()
    );
    harness.state_mut().settings.sky_radiance = [0.7; 3];
    harness.run_steps(2);
    assert!(
        harness
            .query_by_label_contains("of earlier settings")
            .is_some()
    );
}

#[test]
fn a_lamp_is_set_from_a_data_sheet() {
    let mut harness = viewer();
    harness.key_press(Key::F3);
    harness.run_steps(3);
    click(&mut harness, "From a data sheet");
    // The header opens by and by.
    harness.run_steps(30);
    set(&mut harness, "luminous flux", 3000.0);
    set(&mut harness, "colour temperature", 2700.0);
    set(&mut harness, "beam angle", 90.0);
    click(&mut harness, "Set the lamp so");
    let lamp = &harness.state().settings.lamps[0];
    assert_eq!(lamp.half_angle_deg, 45.0);
    let [r, g, b] = lamp.intensity;
    assert!(r > g && g > 2.0 * b, "{:?}", lamp.intensity);
    // 3000 lm at 326 lm/W over the solid angle of a cosine up to 45°, π/2 sr.
    let watts = (r + g + b) * std::f64::consts::FRAC_PI_2;
    assert!((watts / (3000.0 / 326.0) - 1.0).abs() < 0.02, "{watts}");
}
