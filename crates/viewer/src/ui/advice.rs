//! The advice of the guidance panel: who is asked, what is wanted, what they say.

use egui::Ui;
use uw_guidance::Checks;

use super::guidance::{DISTANCE, LAMP, can_look};
use super::knobs::{heading, slider};
use super::plots;
use crate::app::{FilePurpose, Viewer};
use crate::guidance::{Adviser, answer::Answer};

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

/// Shows who is asked, what is wanted and what they say.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    adviser(app, ui);
    objective(app, ui);
    advice(app, ui);
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

/// Three values per channel; a dash for one that is not told.
pub fn triple(values: [f64; 3]) -> String {
    let told = |x: f64| match x.is_nan() {
        true => "–".to_owned(),
        false => format!("{x:.1}"),
    };
    values.map(told).join("  ")
}
