//! The guidance panel: calibration, state, advice.

use egui::{ComboBox, ProgressBar, Ui};
use uw_guidance::Checks;
use uw_scenery::textures::Pattern;
use uw_twin::routine::{DISTANCES_M, UP_DEPTHS_M};

use super::knobs::{Steps, heading, slider, stepped};
use super::{look, operation, plots};
use crate::app::{FilePurpose, Viewer};
use crate::guidance::{Adviser, VARIES, answer::Answer};

/// Depth of the vehicle.
const DEPTH: Steps = Steps {
    range: (0.5, 6.0),
    step: 0.1,
    decimals: 2,
    unit: " m",
};
/// Distance of the vehicle to the target.
const DISTANCE: Steps = Steps {
    range: (0.5, 3.0),
    step: 0.05,
    decimals: 2,
    unit: " m",
};
/// Level of the vehicle's lamps.
const LAMP: Steps = Steps {
    range: (0.0, 100.0),
    step: 1.0,
    decimals: 0,
    unit: " %",
};

/// Who can be asked, by name.
const ADVISERS: [(Adviser, &str, &str); 3] = [
    (
        Adviser::Physics,
        "Physics",
        "What the water does to the image of the last look at other places; its tables take seconds once per water",
    ),
    (
        Adviser::Network,
        "Network",
        "A network, from the statistics of the image and the calibration",
    ),
    (
        Adviser::Daemon,
        "uwguide",
        "A running daemon, with the same profile",
    ),
];

/// Shows the panel.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    if let Some((what, share)) = app.guidance.progress() {
        // Not animated: on a software adapter every frame takes time from the work itself.
        ui.add(ProgressBar::new(share).text(what));
        if ui.button("Cancel").clicked() {
            app.guidance.cancel();
        }
    }
    if app.settings.water_varies() {
        ui.colored_label(ui.visuals().warn_fg_color, VARIES);
    }
    calibration(app, ui);
    state(app, ui);
    adviser(app, ui);
    objective(app, ui);
    advice(app, ui);
    operation::show(app, ui);
}

/// The first step, folded away once it is done, so that the advice has room; unfolded again where it is to be repeated.
fn calibration(app: &mut Viewer, ui: &mut Ui) {
    let done = app.guidance.profile.is_some() && !app.guidance.is_outdated(&app.settings);
    let id = ui.make_persistent_id("calibration done");
    let was_done: Option<bool> = ui.data_mut(|d| d.get_temp(id));
    ui.data_mut(|d| d.insert_temp(id, done));
    let title = if done && app.guidance.origin.is_none() {
        "1  Calibrated: a profile that was opened"
    } else if done {
        "1  Calibrated in this water"
    } else {
        "1  Calibrate in this water"
    };
    ui.add_space(6.0);
    egui::CollapsingHeader::new(egui::RichText::new(title).strong())
        .id_salt("calibration")
        .open((was_done != Some(done)).then_some(!done))
        .show_unindented(ui, |ui| routine(app, ui));
}

/// Whether the vehicle's camera can take images now.
fn can_look(app: &Viewer) -> bool {
    app.guidance.progress().is_none() && !app.settings.water_varies()
}

/// Why it cannot.
fn why_not(app: &Viewer) -> &'static str {
    if app.settings.water_varies() {
        VARIES
    } else {
        "Something is being done"
    }
}

fn routine(app: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ComboBox::from_label("target")
            .selected_text(app.guidance.pattern.name())
            .show_ui(ui, |ui| {
                for pattern in Pattern::ALL {
                    ui.selectable_value(&mut app.guidance.pattern, pattern, pattern.name());
                }
            });
    });
    ui.horizontal(|ui| {
        let idle = can_look(app);
        let run = egui::Button::new("Run the routine");
        let text = format!(
            "{} images looking up, {} of the target with lamps off and on",
            UP_DEPTHS_M.len(),
            DISTANCES_M.len()
        );
        let run = ui.add_enabled(idle, run).on_hover_text(text);
        if run.on_disabled_hover_text(why_not(app)).clicked() {
            let settings = app.settings.clone();
            app.guidance.calibrate(&settings, &mut app.toasts);
        }
        if ui.button("Open profile...").clicked() {
            app.ask_file(FilePurpose::OpenProfile);
        }
        let known = app.guidance.profile.is_some();
        if ui
            .add_enabled(known, egui::Button::new("Save..."))
            .clicked()
        {
            app.ask_file(FilePurpose::SaveProfile);
        }
    });
    if app.guidance.is_outdated(&app.settings) {
        ui.colored_label(
            ui.visuals().warn_fg_color,
            "the water has changed since: run the routine again",
        );
    }
    match app.guidance.profile.clone() {
        Some(profile) => {
            origin(app, ui);
            plots::profile(ui, &profile, app.guidance.profile_errors.as_deref());
        }
        None => {
            ui.weak("K_z: how light falls with depth. K_c: how contrast falls with distance.");
        }
    }
}

/// With which target and lamps the profile was made, and what of the open scene does not fit them.
fn origin(app: &Viewer, ui: &mut Ui) {
    let Some(origin) = &app.guidance.origin else {
        ui.weak("opened: it does not say with which target and lamps it was made");
        return;
    };
    ui.weak(origin.told());
    let misfits = origin.misfits(app.guidance.pattern, &app.settings, &app.open.objects);
    if misfits.is_empty() {
        ui.weak("the open scene has such a target and such lamps");
    }
    for misfit in misfits {
        ui.colored_label(ui.visuals().warn_fg_color, misfit);
    }
}

fn state(app: &mut Viewer, ui: &mut Ui) {
    heading(ui, "2  Where the vehicle is");
    let guidance = &mut app.guidance;
    let mut changed = stepped(ui, "depth", &mut guidance.position.depth_m, DEPTH);
    changed |= stepped(
        ui,
        "distance to the target",
        &mut guidance.position.distance_m,
        DISTANCE,
    );
    changed |= stepped(ui, "lamp level", &mut guidance.light_pct, LAMP);
    if changed {
        // A state set by hand takes the place of a recorded one.
        guidance.operation = None;
    }
    ui.horizontal(|ui| {
        if ui.button("Take the camera's place").clicked() {
            let distance_m = DISTANCE.written(app.distance_ahead_m());
            let depth_m = app.settings.depth_m().map(|m| DEPTH.written(m));
            let lamp = app.settings.lamps.first();
            let light_pct = lamp.map(|lamp| LAMP.written(lamp.level_pct));
            let guidance = &mut app.guidance;
            guidance.position.distance_m = distance_m;
            guidance.position.depth_m = depth_m.unwrap_or(guidance.position.depth_m);
            guidance.light_pct = light_pct.unwrap_or(guidance.light_pct);
        }
        if ui
            .add_enabled(can_look(app), egui::Button::new("Look"))
            .on_hover_text(
                "Renders what the vehicle's camera sees here, for the statistics of its image",
            )
            .on_disabled_hover_text(why_not(app))
            .clicked()
        {
            let settings = app.settings.clone();
            app.guidance.look(&settings, &mut app.toasts);
        }
    });
    let guidance = &app.guidance;
    match (guidance.observation(), &guidance.look) {
        (Some(now), Some(seen)) => {
            ui.horizontal(|ui| {
                look::show(ui, seen, guidance.light_pct);
                ui.vertical(|ui| {
                    for (name, values) in [("mean", now.mean), ("contrast", now.std)] {
                        ui.weak(format!("{name}, counts"));
                        ui.weak(triple(values));
                    }
                });
            });
        }
        _ => {
            ui.weak("press Look: advice is about an image");
        }
    }
}

/// Three values per channel; a dash for one that is not told.
pub fn triple(values: [f64; 3]) -> String {
    let told = |x: f64| match x.is_nan() {
        true => "–".to_owned(),
        false => format!("{x:.1}"),
    };
    values.map(told).join("  ")
}

fn adviser(app: &mut Viewer, ui: &mut Ui) {
    heading(ui, "3  Advice");
    let guidance = &mut app.guidance;
    let before = guidance.adviser;
    ui.horizontal_wrapped(|ui| {
        for (adviser, name, tells) in ADVISERS {
            ui.selectable_value(&mut guidance.adviser, adviser, name)
                .on_hover_text(tells);
        }
    });
    if guidance.adviser != before {
        // It is the other's.
        guidance.answer = None;
    }
    match app.guidance.adviser {
        Adviser::Physics => physics(app, ui),
        Adviser::Network => network(app, ui),
        Adviser::Daemon => daemon(app, ui),
    }
}

/// What is wanted.
fn objective(app: &mut Viewer, ui: &mut Ui) {
    let guidance = &mut app.guidance;
    ui.collapsing("Objective", |ui| {
        let o = &mut guidance.objective;
        ui.horizontal(|ui| {
            if ui.button("release").clicked() {
                *o = uw_guidance::Objective::release();
            }
            if ui.button("paper").clicked() {
                *o = uw_guidance::Objective::paper();
            }
        });
        slider(ui, "weight of contrast", &mut o.lambda_c, 0.0..=3.0, "");
        slider(ui, "weight of distance", &mut o.lambda_d, 0.0..=3.0, "");
        slider(
            ui,
            "kappa b (preferred distance)",
            &mut o.kappa_b,
            0.5..=8.0,
            "",
        );
        slider(ui, "kappa c (narrowness)", &mut o.kappa_c, 0.2..=5.0, "");
    });
}

/// What physics predicts from, or what it lacks.
fn physics(app: &mut Viewer, ui: &mut Ui) {
    let guidance = &app.guidance;
    if guidance.operation.is_some() {
        ui.weak("a recording has no pictures: the network answers");
        return network(app, ui);
    }
    ui.weak(match (guidance.has_tables(), &guidance.profile) {
        (Some(false), _) => "press Look: tables of this water are made first".to_owned(),
        (Some(true), Some(_)) => "from the image, in the water that is set".to_owned(),
        (Some(true), None) => "calibrate: the objective needs a profile".to_owned(),
        (None, _) => "from an image, in the water that is set".to_owned(),
    });
    let earlier_m = app.guidance.answer.as_ref().map(|answer| &answer.earlier_m);
    if let Some(earlier_m) = earlier_m.filter(|earlier_m| !earlier_m.is_empty()) {
        let from: Vec<String> = earlier_m.iter().map(|m| format!("{m:.2}")).collect();
        ui.weak(format!("images from {} m count too", from.join(", ")));
    }
}

fn network(app: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        match &app.guidance.model {
            Ok((_, name)) => ui.weak(format!("network {name}")),
            Err(error) => ui.colored_label(ui.visuals().error_fg_color, error),
        };
        if ui.small_button("Open network...").clicked() {
            app.ask_file(FilePurpose::OpenModel);
        }
    });
}

fn daemon(app: &mut Viewer, ui: &mut Ui) {
    let guidance = &mut app.guidance;
    ui.horizontal_wrapped(|ui| {
        ui.add(egui::TextEdit::singleline(&mut guidance.link.address).desired_width(120.0))
            .on_hover_text("Host and port of a running uwguide");
        let idle = !guidance.link.is_waiting();
        if ui.add_enabled(idle, egui::Button::new("Ask")).clicked() {
            guidance.ask_daemon(&mut app.toasts);
        }
    });
    ui.weak(&app.guidance.link.state);
}

fn advice(app: &mut Viewer, ui: &mut Ui) {
    let Some(answer) = app.guidance.answer.clone() else {
        ui.weak("calibrate and look, and the advice appears here");
        return;
    };
    if app.settings.water_varies() && app.guidance.operation.is_none() {
        ui.weak("none: the image it would be about is of other water");
        return;
    }
    verdict(ui, &answer);
    if let (Some(score), Some(here)) = (answer.score, answer.score_here) {
        ui.weak(format!(
            "score {score:.3}, here {here:.3}, {} candidates",
            answer.evaluations
        ));
    }
    follow(app, ui, &answer);
    plots::map(ui, &answer);
    contrasts(app, ui, &answer);
}

/// What the vehicle should do, in bold only where it may follow; else that it should hold, and why.
fn verdict(ui: &mut Ui, answer: &Answer) {
    let now = answer.observation;
    if answer.moves {
        ui.strong(format!(
            "go to {:.2} m ({:+.2} m), lamps to {:.0} % ({:+.0} %)",
            answer.distance_m,
            answer.distance_m - now.distance_m,
            answer.light_pct,
            answer.light_pct - now.light_pct
        ));
    } else if answer.valid {
        ui.strong("hold: staying is as good");
    } else {
        ui.colored_label(
            ui.visuals().error_fg_color,
            "hold: there is no advice for this place",
        );
    }
    for text in answer.reason.iter().chain(&answer.warnings) {
        ui.colored_label(ui.visuals().warn_fg_color, text);
    }
}

/// What can be done with a suggestion.
fn follow(app: &mut Viewer, ui: &mut Ui, answer: &Answer) {
    let now = answer.observation;
    ui.horizontal(|ui| {
        let go = egui::Button::new("Go there");
        if ui
            .add_enabled(answer.moves, go)
            .on_hover_text("Moves the camera and sets the lamps; the vehicle's place follows")
            .clicked()
        {
            app.go_to(Some(now.depth_m), answer.distance_m, answer.light_pct);
            if app.guidance.operation.is_none() {
                app.guidance.position.distance_m = DISTANCE.written(answer.distance_m);
                app.guidance.light_pct = LAMP.written(answer.light_pct);
                let settings = app.settings.clone();
                app.guidance.look(&settings, &mut app.toasts);
            }
        }
        if ui
            .add_enabled(
                can_look(app) && answer.moves,
                egui::Button::new("Render it"),
            )
            .on_hover_text("Renders the suggestion and compares its contrast with the prediction")
            .clicked()
        {
            let settings = app.settings.clone();
            app.guidance.check_suggestion(&settings, &mut app.toasts);
        }
    });
}

/// Predicted against rendered contrast, here and at the suggestion.
fn contrasts(app: &Viewer, ui: &mut Ui, answer: &Answer) {
    let check = app.guidance.check.filter(|check| {
        let [distance_m, light_pct] = check.at;
        (distance_m - answer.distance_m).abs() < 0.005 && (light_pct - answer.light_pct).abs() < 0.5
    });
    let cell = |ui: &mut Ui, values: Option<[f64; 3]>, error: Option<[f64; 3]>| {
        let known = values.map_or("not known".to_owned(), triple);
        match error.filter(|_| values.is_some()) {
            Some(error) => ui
                .label(format!("{known}\n± {}", triple(error)))
                .on_hover_text("± standard error, counts"),
            None => ui.label(known),
        };
    };
    let is_own = app.guidance.operation.is_none();
    let seen = app.guidance.seen().filter(|_| is_own);
    let [of_suggestion, of_here] = answer.errors;
    egui::Grid::new("contrasts")
        .num_columns(3)
        .striped(true)
        .show(ui, |ui| {
            ui.weak("contrast, counts (R G B)");
            ui.weak("predicted");
            ui.weak("rendered");
            ui.end_row();
            ui.label("here");
            cell(ui, answer.predicted_here, of_here);
            let error = seen.map(|seen| seen.errors.contrast);
            cell(ui, Some(answer.observation.std), error);
            ui.end_row();
            if let Some(misfit) = answer.misfit {
                ui.label("misfit here");
                ui.label(format!("{misfit:.1}"))
                    .on_hover_text("How far a prediction for here misses the image: 1 is 0.5 counts and 10 % of the network's for no change, three standard errors of that of physics from an earlier image");
                ui.weak(format!("at most {:.1}", Checks::default().max_misfit));
                ui.end_row();
            }
            ui.label("suggestion");
            cell(ui, answer.predicted, of_suggestion);
            cell(ui, check.map(|c| c.rendered), check.map(|c| c.error));
            ui.end_row();
        });
}
