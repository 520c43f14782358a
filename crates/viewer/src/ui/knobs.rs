//! Rows of knobs that panels share.

use egui::{DragValue, Slider, Ui};
use egui_plot::AxisHints;
use glam::DVec3;

use super::theme::CHANNELS;

/// A slider with its name and unit.
pub fn slider(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: std::ops::RangeInclusive<f64>,
    unit: &str,
) -> egui::Response {
    ui.add(Slider::new(value, range).text(name).suffix(unit))
}

/// A slider over powers of ten.
pub fn log_slider(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: std::ops::RangeInclusive<f64>,
    unit: &str,
) -> egui::Response {
    let slider = Slider::new(value, range).text(name).suffix(unit);
    ui.add(slider.logarithmic(true))
}

/// Three numbers, one per channel.
pub fn channels(ui: &mut Ui, name: &str, values: &mut [f64; 3], most: f64, unit: &str) {
    ui.horizontal(|ui| {
        ui.label(name);
        for (value, channel) in values.iter_mut().zip(CHANNELS) {
            let speed = 0.01 * value.abs().max(0.02);
            let knob = DragValue::new(value).range(0.0..=most).speed(speed);
            ui.add(knob.prefix(format!("{channel} ")).max_decimals(5))
                .on_hover_text(format!("{name}, {channel}, {unit}"));
        }
        ui.weak(unit);
    });
}

/// A point in the world.
pub fn position(ui: &mut Ui, name: &str, value: &mut DVec3) {
    ui.horizontal(|ui| {
        ui.label(name);
        for (value, axis) in [
            (&mut value.x, "x"),
            (&mut value.y, "y"),
            (&mut value.z, "z"),
        ] {
            let knob = DragValue::new(value).speed(0.02).range(-1e4..=1e4);
            ui.add(knob.prefix(format!("{axis} ")).max_decimals(3))
                .on_hover_text(format!("{name}, {axis}, m"));
        }
        ui.weak("m");
    });
}

/// A direction as heading and elevation.
pub fn direction(ui: &mut Ui, name: &str, value: &mut DVec3) -> bool {
    let mut heading_deg = value.y.atan2(value.x).to_degrees();
    let mut elevation_deg = value.z.clamp(-1.0, 1.0).asin().to_degrees();
    let mut changed = false;
    ui.horizontal(|ui| {
        ui.label(name);
        for (angle, what, range) in [
            (&mut heading_deg, "heading", -180.0..=180.0),
            (&mut elevation_deg, "elevation", -90.0..=90.0),
        ] {
            let knob = DragValue::new(angle).speed(0.5).range(range).suffix("°");
            changed |= ui
                .add(knob.prefix(format!("{what} ")).max_decimals(1))
                .on_hover_text(format!("{name}, {what}"))
                .changed();
        }
    });
    if changed {
        let (h, e) = (heading_deg.to_radians(), elevation_deg.to_radians());
        *value = DVec3::new(e.cos() * h.cos(), e.cos() * h.sin(), e.sin());
    }
    changed
}

/// A heading over a group of knobs.
pub fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(6.0);
    ui.label(egui::RichText::new(text).strong());
}

/// The y axis of a small plot, with labels close together.
pub fn y_axis(label: &str) -> AxisHints<'static> {
    AxisHints::new_y()
        .label(label)
        .label_spacing(egui::Rangef::new(10.0, 18.0))
        .min_thickness(36.0)
}

/// The x axis of a small plot, with labels close together.
pub fn x_axis(label: &str) -> AxisHints<'static> {
    AxisHints::new_x()
        .label(label)
        .label_spacing(egui::Rangef::new(20.0, 36.0))
}
