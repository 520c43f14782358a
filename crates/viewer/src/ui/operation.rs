//! A recorded operation, step by step.

use std::time::Instant;

use egui::{Slider, Ui};
use egui_plot::{Line, LineStyle, PlotPoints, VLine};

use super::advice::triple;
use super::knobs::{heading, still_plot, x_axis, y_axis};
use super::theme::SUGGESTED;
use crate::app::{FilePurpose, Viewer};

/// Shows the operation, or how to open one.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    heading(ui, "Recorded operation");
    ui.horizontal(|ui| {
        if ui
            .button("Open recording...")
            .on_hover_text(
                "What uwguide wrote where `operations.record` of its configuration names a file",
            )
            .clicked()
        {
            app.ask_file(FilePurpose::OpenRecord);
        }
        if app.guidance.operation.is_some() {
            ui.checkbox(&mut app.guidance.camera_follows, "camera follows");
            if ui.button("Close").clicked() {
                app.guidance.operation = None;
            }
        }
    });
    let Some(mut operation) = app.guidance.operation.take() else {
        return;
    };
    let before = operation.at;
    let last = operation.steps.len() - 1;
    ui.horizontal(|ui| {
        if ui.button("Previous").clicked() {
            operation.at = operation.at.saturating_sub(1);
        }
        let does = if operation.is_playing() {
            "Stop"
        } else {
            "Play"
        };
        if ui.button(does).clicked() {
            operation.toggle();
        }
        if ui.button("Next").clicked() {
            operation.at = (operation.at + 1).min(last);
        }
        ui.add(Slider::new(&mut operation.at, 0..=last).text("step"))
            .on_hover_text(format!("step: 0 to {last}"));
    });
    operation.advance(Instant::now());
    if operation.is_playing() {
        ui.ctx().request_repaint_after(operation.pause());
    }
    if let Some(step) = operation.step() {
        let (now, answer) = (step.answer.observation, &step.answer);
        ui.weak(format!(
            "{}, {:.1} s after the start",
            operation.name, step.since_start_s
        ));
        ui.label(format!(
            "{:.2} m deep: {:.2} m away at {:.0} % -> {:.2} m at {:.0} %",
            now.depth_m, now.distance_m, now.light_pct, answer.distance_m, answer.light_pct
        ));
        ui.weak(format!("contrast then {}", triple(now.std)));
    }
    courses(ui, &operation);
    if before != operation.at
        && app.guidance.camera_follows
        && let Some(now) = operation.observation()
    {
        app.go_to(Some(now.depth_m), now.distance_m, now.light_pct);
    }
    app.guidance.operation = Some(operation);
}

/// Distance and lamp level over the steps, as they were and as they were suggested.
fn courses(ui: &mut Ui, operation: &crate::guidance::operation::Operation) {
    let ink = ui.visuals().text_color();
    let at = operation.at as f64;
    let course = |of: &dyn Fn(&crate::guidance::answer::Answer) -> f64| {
        let points = operation.steps.iter().enumerate();
        let points: Vec<_> = points.map(|(i, s)| [i as f64, of(&s.answer)]).collect();
        PlotPoints::from(points)
    };
    let distances = (
        course(&|a| a.observation.distance_m),
        course(&|a| a.distance_m),
    );
    let lights = (
        course(&|a| a.observation.light_pct),
        course(&|a| a.light_pct),
    );
    ui.columns(2, |columns| {
        for ((column, name), (was, suggested)) in columns
            .iter_mut()
            .zip(["distance, m", "lamp, %"])
            .zip([distances, lights])
        {
            still_plot(name, 110.0)
                .custom_x_axes(vec![x_axis("step")])
                .custom_y_axes(vec![y_axis(name)])
                .include_y(0.0)
                .show(column, |plot| {
                    plot.line(Line::new("was", was).color(ink));
                    plot.line(
                        Line::new("suggested", suggested)
                            .color(SUGGESTED)
                            .style(LineStyle::dashed_dense()),
                    );
                    plot.vline(VLine::new("shown", at).color(ink.gamma_multiply(0.5)));
                });
        }
    });
    ui.horizontal(|ui| {
        ui.label("— as it was");
        ui.colored_label(SUGGESTED, "-- suggested");
    });
}
