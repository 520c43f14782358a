//! The bar at the bottom: samples, error, speed, pause, goal.

use egui::{DragValue, Label, Panel, RichText, Ui};

use crate::app::Viewer;
use crate::worker::Activity;

/// Shows the bar.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    Panel::bottom("status").show(ui, |ui| {
        ui.add_space(2.0);
        ui.horizontal(|ui| {
            let label = if app.paused { "Go on" } else { "Pause" };
            if ui.button(label).on_hover_text("Space").clicked() {
                app.paused = !app.paused;
            }
            if ui
                .button("Restart")
                .on_hover_text("Backspace: anew, with other random numbers")
                .clicked()
            {
                app.reset_picture();
            }
            ui.separator();
            goal(app, ui);
            ui.separator();
            figures(app, ui);
        });
        ui.add_space(2.0);
    });
}

fn goal(app: &mut Viewer, ui: &mut Ui) {
    let mut wanted = app.goal.target_error.is_some();
    ui.checkbox(&mut wanted, "Stop at error");
    let mut percent = 100.0 * app.goal.target_error.unwrap_or(0.03);
    let knob = DragValue::new(&mut percent).range(0.1..=100.0).speed(0.1);
    ui.add_enabled(wanted, knob.suffix(" %").max_decimals(1))
        .on_hover_text("Estimated relative error at which the picture is finished: 0.1 to 100 %");
    app.goal.target_error = wanted.then_some(percent / 100.0);
}

fn figures(app: &Viewer, ui: &mut Ui) {
    let Some(frame) = app.frame() else {
        ui.weak("preparing");
        return;
    };
    let state = match frame.activity {
        _ if !app.is_current() => "updating",
        Activity::Refining if frame.coarseness > 1 => "coarse",
        Activity::Refining => "refining",
        Activity::Paused => "paused",
        Activity::Done => "done",
    };
    let kind = match frame.denoised {
        Some(_) => "denoised (biased), estimated ",
        None => "",
    };
    let error = match frame.relative_error {
        Some(error) => format!("{kind}error {:.1} %", 100.0 * error),
        None => "error unknown yet".to_owned(),
    };
    let size = format!("{} x {}", frame.camera.width, frame.camera.height);
    let speed = rate(frame.samples_per_s);
    let figures = format!(
        "{state}   {} samples/px   {error}   {speed}   {size}",
        frame.samples
    );
    ui.add(Label::new(figures).truncate());
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
        let backend = RichText::new(frame.backend.as_ref()).weak();
        ui.add(Label::new(backend).truncate());
    });
}

/// A number of samples per second.
fn rate(samples_per_s: f64) -> String {
    if samples_per_s >= 1e6 {
        format!("{:.2} M samples/s", samples_per_s / 1e6)
    } else {
        format!("{:.0} k samples/s", samples_per_s / 1e3)
    }
}
