//! What the guidance panel tells about advice.

use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use uw_viewer::app::{Options, Tab, Viewer};
use uw_viewer::model::OpenScene;
use uw_viewer::worker::Goal;

use crate::panels::{click, set, until, viewer};
use crate::support::{profile, recording, repository};

/// Candidates of the grid that the search looks at first.
const GRID: usize = 17 * 9;

/// The guidance panel with advice for the first state of a recording, whose picture has the contrast that the model predicts
/// times `share`.
fn advised(share: f64) -> Harness<'static, Viewer> {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("operation.jsonl");
    std::fs::write(&path, recording(share)).expect("written");
    let mut harness = viewer();
    let viewer = harness.state_mut();
    viewer.tab = Tab::Guidance;
    viewer.guidance.profile = Some(std::sync::Arc::new(profile()));
    viewer.guidance.open_record(&path).expect("a recording");
    harness.set_size(egui::vec2(900.0, 1100.0));
    harness.run_steps(4);
    harness
}

#[test]
fn the_way_of_the_search_begins_at_the_best_of_the_grid() {
    let harness = advised(1.0);
    let answer = harness.state().guidance.answer.clone().expect("advice");
    let best_of_grid = answer.steps[..GRID]
        .iter()
        .fold(f64::NEG_INFINITY, |best, (_, score)| best.max(*score));
    let way = answer.ascent();
    let scores: Vec<f64> = way
        .iter()
        .map(|at| {
            let same = |c: &uw_guidance::Candidate| [c.distance_m, c.light_pct] == *at;
            let step = answer.steps.iter().find(|(c, _)| same(c));
            step.expect("one of the steps").1
        })
        .collect();
    assert!(scores.iter().all(|s| *s >= best_of_grid), "{way:?}");
    assert!(scores.is_sorted() && way.len() > 1, "{scores:?}");
}

#[test]
fn the_map_tells_its_scale_and_the_score_under_the_pointer() {
    let mut harness = advised(1.0);
    let answer = harness.state().guidance.answer.clone().expect("advice");
    let map = answer.map.expect("a map");
    let (low, high) = map.range();
    for end in [low, high] {
        let three_digits = format!("{end:.2}");
        assert!((0.1..10.0).contains(&end.abs()), "{end}");
        assert!(
            harness.query_all_by_label(&three_digits).count() + usize::from(end < 1.0) > 0,
            "{three_digits}"
        );
    }
    assert_eq!(harness.query_all_by_label_contains("score ").count(), 1);
    let plot = harness.get_by_label("Objective map").rect();
    harness.hover_at(plot.center());
    harness.run_steps(3);
    // The middle of the map, within a margin of the axes.
    let [near, far] = map.distance_m;
    let middle = map.at(0.5 * (near + far), 50.0).expect("inside");
    let told: Vec<String> = harness
        .query_all_by_label_contains("%: score")
        .map(|node| node.value().unwrap_or_default())
        .collect();
    assert_eq!(told.len(), 1, "{told:?}");
    let score = told[0]
        .rsplit(' ')
        .next()
        .and_then(|s| s.parse::<f64>().ok());
    let score = score.expect("a number");
    assert!((score - middle).abs() < 0.02, "{told:?} {middle}");
    harness.remove_cursor();
    harness.run_steps(3);
    assert_eq!(harness.query_all_by_label_contains("%: score").count(), 0);
}

#[test]
fn the_vehicles_settings_step_roundly_and_take_every_number_that_is_typed() {
    let mut harness = viewer();
    harness.state_mut().tab = Tab::Guidance;
    harness.run_steps(3);
    for (name, value) in [
        ("depth", 2.3456),
        ("distance to the target", 1.2345),
        ("lamp level", 41.37),
    ] {
        set(&mut harness, name, value);
    }
    let near = |value: f64, expected: f64| (value - expected).abs() < 1e-9;
    let guidance = &harness.state().guidance;
    assert!(
        near(guidance.position.depth_m, 2.3),
        "{:?}",
        guidance.position
    );
    assert!(
        near(guidance.position.distance_m, 1.25),
        "{:?}",
        guidance.position
    );
    assert!(near(guidance.light_pct, 41.0), "{}", guidance.light_pct);
    // Between the steps of the slider, and left as it is by the panel.
    harness
        .get_by_role_and_label(egui::Role::SpinButton, "distance to the target")
        .set_value_accesskit(1.43);
    harness.run_steps(4);
    assert!(near(harness.state().guidance.position.distance_m, 1.43));
}

#[test]
fn a_place_that_the_model_does_not_know_is_told_instead_of_advice() {
    let told = |share: f64| {
        let harness = advised(share);
        let answer = harness.state().guidance.answer.clone().expect("advice");
        let count = |text: &str| harness.query_all_by_label_contains(text).count();
        let shown = [
            "go to ",
            "hold: there is no advice for this place",
            "the model does not fit here",
        ];
        let goes = !harness
            .get_by_label("Go there")
            .accesskit_node()
            .is_disabled();
        (
            answer.valid,
            goes,
            shown.map(count),
            answer.misfit.expect("known"),
        )
    };
    let (valid, goes, shown, misfit) = told(1.0);
    assert!(valid && goes && misfit < 0.1, "{misfit}");
    assert_eq!(shown, [1, 0, 0]);
    // As where the sun stands behind the target, which training did not know.
    let (valid, goes, shown, misfit) = told(0.65);
    let most = uw_guidance::Checks::default().max_misfit;
    assert!(!valid && !goes && misfit > most, "{misfit}");
    assert_eq!(shown, [0, 1, 1]);
}

#[test]
fn in_the_opening_scene_under_a_sun_that_training_did_not_know_only_the_shipped_default_fits() {
    let ctx = egui::Context::default();
    let path = repository().join("assets/scenes/reef.toml");
    let open = OpenScene::read(&path).expect("shipped");
    let options = Options {
        goal: Goal {
            samples_per_pixel: 1,
            target_error: None,
        },
        ..Options::default()
    };
    let viewer = Viewer::new(&ctx, open, options).expect("a thread");
    let mut harness = Harness::builder()
        .with_size([900.0, 1100.0])
        .build_ui_state(|ui, viewer: &mut Viewer| viewer.show(ui), viewer);
    harness.state_mut().tab = Tab::Guidance;
    harness.state_mut().guidance.paths = 1024;
    harness.run_steps(3);
    let (_, shipped) = harness.state().guidance.model.clone().expect("shipped");
    assert_eq!(shipped, "models/default.json");
    let mut misfit_of = |model: &str| {
        let viewer = harness.state_mut();
        let file = repository().join("assets").join(model);
        viewer.guidance.open_model(&file).expect("shipped");
        viewer.guidance.profile = None;
        viewer.settings.sun.as_mut().expect("a sun").azimuth_deg = 180.0;
        harness.run_steps(3);
        click(&mut harness, "Run the routine");
        until(&mut harness, "the calibration", |v| {
            v.guidance.progress().is_none()
        });
        let guidance = &harness.state().guidance;
        let answer = guidance.answer.clone().expect("an answer");
        (answer.valid, answer.misfit.expect("known"))
    };
    let (valid, misfit) = misfit_of("models/paper.json");
    assert!(!valid && misfit > 1.0, "{misfit}");
    // This one reads at every distance what the calibration under this very sun found.
    let (valid, misfit) = misfit_of(&shipped);
    assert!(valid && misfit < 1.0, "{misfit}");
}
