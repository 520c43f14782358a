//! Rows of knobs that panels share.

use std::ops::RangeInclusive;

use egui::{ComboBox, DragValue, Slider, SliderClamping, Ui};
use egui_plot::{AxisHints, GridInput, GridMark, Plot};
use glam::DVec3;
use uw_media::spectral::ILLUMINANTS;

use super::theme::CHANNELS;
use crate::model::{LightSpectrum, spectra::short_name};

/// What a knob says under the pointer: its name, what it may be, and the unit.
pub fn told(name: &str, range: &RangeInclusive<f64>, unit: &str) -> String {
    let written = |value: f64| match value.abs() {
        small if small > 0.0 && small < 1e-3 => format!("{value:e}"),
        _ => format!("{value}"),
    };
    let space = match unit.starts_with(char::is_alphanumeric) {
        true => " ",
        false => "",
    };
    let [low, high] = [range.start(), range.end()].map(|end| written(*end));
    format!("{name}: {low} to {high}{space}{unit}")
}

/// A slider with its name and unit.
pub fn slider(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: RangeInclusive<f64>,
    unit: &str,
) -> egui::Response {
    told_slider(ui, (name, unit), range, |range| Slider::new(value, range))
}

/// A slider with its name, range and unit.
fn told_slider<'a>(
    ui: &mut Ui,
    (name, unit): (&str, &str),
    range: RangeInclusive<f64>,
    slider: impl FnOnce(RangeInclusive<f64>) -> Slider<'a>,
) -> egui::Response {
    let told = told(name, &range, unit);
    ui.add(slider(range).text(name).suffix(unit))
        .on_hover_text(told)
}

/// How a number is set: in which steps by the slider, and how it is written.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// Smallest and largest value.
    pub range: (f64, f64),
    /// Step of the slider and of the arrow keys on it.
    pub step: f64,
    /// Digits after the point, also of a number that is typed.
    pub decimals: usize,
    /// Unit, with a space before it.
    pub unit: &'static str,
}

impl Steps {
    /// A value as the number beside the slider writes it, within the range.
    pub fn written(&self, value: f64) -> f64 {
        let scale = 10_f64.powi(self.decimals as i32);
        (value.clamp(self.range.0, self.range.1) * scale).round() / scale
    }
}

/// A slider in round steps, with a number beside it that takes every value between them. A value that was set elsewhere
/// stays as it is.
pub fn stepped(ui: &mut Ui, name: &str, value: &mut f64, steps: Steps) -> bool {
    let range = steps.range.0..=steps.range.1;
    let told = told(name, &range, steps.unit);
    ui.horizontal(|ui| {
        let slider = Slider::new(value, range.clone())
            .clamping(SliderClamping::Edits)
            .step_by(steps.step)
            .show_value(false);
        let slider = ui.add(slider).on_hover_text(&told);
        let number = DragValue::new(value)
            .range(range)
            .clamp_existing_to_range(false)
            .speed(0.2 * steps.step)
            .fixed_decimals(steps.decimals)
            .suffix(steps.unit);
        let number = ui.add(number).on_hover_text(&told);
        let label = ui.label(name);
        let changed = slider.changed() || number.changed();
        slider.labelled_by(label.id);
        number.labelled_by(label.id);
        changed
    })
    .inner
}

/// Height of a list of choices, so that all of it is seen where the window has room, points.
pub fn list_height(ui: &Ui) -> f32 {
    (ui.ctx().content_rect().height() - 80.0).max(120.0)
}

/// Shows a knob of a number in other units; the number, where it was changed.
pub fn scaled(value: f64, knob: impl FnOnce(&mut f64) -> egui::Response) -> Option<f64> {
    let mut shown = (value * 1e9).round() / 1e9;
    knob(&mut shown).changed().then_some(shown)
}

/// A slider over powers of ten.
pub fn log_slider(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: RangeInclusive<f64>,
    unit: &str,
) -> egui::Response {
    told_slider(ui, (name, unit), range, |range| {
        Slider::new(value, range).logarithmic(true)
    })
}

/// Three numbers, one per channel; the response is that of the name before them.
pub fn channels(
    ui: &mut Ui,
    name: &str,
    values: &mut [f64; 3],
    most: f64,
    unit: &str,
) -> egui::Response {
    ui.horizontal(|ui| {
        let label = ui.label(name);
        for (value, channel) in values.iter_mut().zip(CHANNELS) {
            let speed = 0.01 * value.abs().max(0.02);
            let knob = DragValue::new(value)
                .range(0.0..=most)
                .clamp_existing_to_range(false)
                .speed(speed);
            ui.add(knob.prefix(format!("{channel} ")).max_decimals(5))
                .on_hover_text(told(&format!("{name}, {channel}"), &(0.0..=most), unit));
        }
        ui.weak(unit);
        label
    })
    .inner
}

/// The spectrum of a light: even over each channel, one that has a name, or the file's own. `sky`: also that of the clear sky.
pub fn light_spectrum(ui: &mut Ui, name: &str, spectrum: &mut Option<LightSpectrum>, sky: bool) {
    const EVEN: &str = "even in each channel";
    let chosen = spectrum
        .as_ref()
        .map_or(EVEN, |s| short_name(&s.entry))
        .to_owned();
    ComboBox::from_label(name)
        .selected_text(&chosen)
        .height(list_height(ui))
        .show_ui(ui, |ui| {
            if ui.selectable_label(chosen == EVEN, EVEN).clicked() {
                *spectrum = None;
            }
            let clear = sky.then_some("clear-sky");
            for known in clear.into_iter().chain(ILLUMINANTS.split_whitespace()) {
                if ui.selectable_label(chosen == known, known).clicked() {
                    *spectrum = LightSpectrum::named(known);
                }
            }
        })
        .response
        .on_hover_text("Counts in water by wavelength; the brightness of each channel stays");
}

/// A point in the world.
pub fn position(ui: &mut Ui, name: &str, value: &mut DVec3) {
    vector(
        ui,
        name,
        value,
        VectorKnob {
            speed: 0.02,
            most: 1e4,
            decimals: 3,
            unit: "m",
        },
    );
}

/// How the three numbers of a vector are set and written.
#[derive(Clone, Copy, Debug)]
pub struct VectorKnob {
    /// Change per point of a drag.
    pub speed: f64,
    /// Largest size of a number that is set by hand.
    pub most: f64,
    /// Decimals.
    pub decimals: usize,
    /// Unit.
    pub unit: &'static str,
}

/// Three numbers, one per axis.
pub fn vector(ui: &mut Ui, name: &str, value: &mut DVec3, knob: VectorKnob) {
    ui.horizontal(|ui| {
        ui.label(name);
        for (value, axis) in [
            (&mut value.x, "x"),
            (&mut value.y, "y"),
            (&mut value.z, "z"),
        ] {
            let number = DragValue::new(value)
                .speed(knob.speed)
                .range(-knob.most..=knob.most)
                .clamp_existing_to_range(false);
            ui.add(
                number
                    .prefix(format!("{axis} "))
                    .max_decimals(knob.decimals),
            )
            .on_hover_text(told(
                &format!("{name}, {axis}"),
                &(-knob.most..=knob.most),
                knob.unit,
            ));
        }
        ui.weak(knob.unit);
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
            let told = told(&format!("{name}, {what}"), &range, "°");
            let knob = DragValue::new(angle).speed(0.5).range(range).suffix("°");
            changed |= ui
                .add(knob.prefix(format!("{what} ")).max_decimals(1))
                .on_hover_text(told)
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

/// A small plot that does not move: a few marks at round numbers along both axes.
pub fn still_plot(id: &'static str, height: f32) -> Plot<'static> {
    Plot::new(id)
        .height(height)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .x_grid_spacer(|input: GridInput| round_marks(input.bounds, 7.0))
        .y_grid_spacer(|input: GridInput| round_marks(input.bounds, 5.0))
        .grid_spacing(egui::Rangef::new(4.0, 20.0))
}

/// About half of `most` to `most` marks between the bounds, at multiples of 1, 2 or 5 times a power of ten.
fn round_marks((from, to): (f64, f64), most: f64) -> Vec<GridMark> {
    let rough = (to - from) / most;
    let power = 10_f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|f| f * power >= rough);
    let step = factor.unwrap_or(10.0) * power;
    if !(step > 0.0 && step.is_finite()) {
        return Vec::new();
    }
    let (first, last) = ((from / step).ceil() as i64, (to / step).floor() as i64);
    (first..=last.min(first + 10))
        .map(|i| GridMark {
            value: i as f64 * step,
            step_size: step,
        })
        .collect()
}

/// A mark as one reads it.
fn number(mark: GridMark, _: &RangeInclusive<f64>) -> String {
    format!("{}", (mark.value * 1e6).round() / 1e6)
}

/// The y axis of a small plot, with labels close together.
pub fn y_axis(label: &str) -> AxisHints<'static> {
    AxisHints::new_y()
        .label(label)
        .label_spacing(egui::Rangef::new(8.0, 12.0))
        .min_thickness(36.0)
        .formatter(number)
}

/// The x axis of a small plot, with labels close together.
pub fn x_axis(label: &str) -> AxisHints<'static> {
    AxisHints::new_x()
        .label(label)
        .label_spacing(egui::Rangef::new(14.0, 24.0))
        .formatter(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knobs_tell_their_range_and_unit() {
        assert_eq!(told("depth", &(0.1..=40.0), " m"), "depth: 0.1 to 40 m");
        assert_eq!(told("a, R", &(0.0..=20.0), "1/m"), "a, R: 0 to 20 1/m");
        assert_eq!(told("b", &(1e-8..=0.01), ""), "b: 1e-8 to 0.01");
        assert_eq!(told("zenith", &(0.0..=89.0), "°"), "zenith: 0 to 89°");
    }

    #[test]
    fn marks_are_few_and_round() {
        let values =
            |bounds| -> Vec<f64> { round_marks(bounds, 7.0).iter().map(|m| m.value).collect() };
        assert_eq!(values((0.5, 3.0)), [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]);
        assert_eq!(values((0.0, 100.0)), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(values((300.0, 700.0)), [300.0, 400.0, 500.0, 600.0, 700.0]);
        for bounds in [
            (0.0, 1e-3),
            (-0.02, 0.61),
            (0.0, 37.0),
            (2.0, 2.0),
            (0.0, f64::NAN),
        ] {
            assert!(round_marks(bounds, 7.0).len() <= 8, "{bounds:?}");
        }
    }
}
