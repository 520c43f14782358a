//! The part of the water panel for water that varies with depth: the plot, a table of its points, and what can be done to
//! them.

use egui::{ComboBox, DragValue, Grid, Slider, Ui};
use uw_media::{Iops, WaterType, spectral::Response};

use super::depth_plot::{self, Grab};
use super::knobs::{list_height, told};
use super::theme::CHANNELS;
use super::water::bands_box;
use crate::model::DepthProfile;
use crate::model::depth_profile::{LARGEST_PER_M, LayerWater, MOST_ENTRIES, place};
use crate::model::water::{neighbours, scale_name};

/// What is said where values are not set by hand.
pub const NOT_SET: &str = "\"Set numbers\" makes values that can be set";
/// Name of values that are set by hand.
const NUMBERS: &str = "numbers";
/// Letters of a water's name beside the number of its point.
const NAME_LENGTH: usize = 9;

/// Which coefficient of a profile is set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quantity {
    /// Scattering b.
    #[default]
    Scattering,
    /// Absorption a.
    Absorption,
}

impl Quantity {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Scattering, Self::Absorption];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scattering => "scattering b",
            Self::Absorption => "absorption a",
        }
    }

    /// Its values, 1/m.
    pub fn of(self, iops: &Iops) -> [f64; 3] {
        match self {
            Self::Scattering => iops.b,
            Self::Absorption => iops.a,
        }
    }

    /// The coefficients with these values of it, 1/m.
    pub fn set(self, iops: Iops, values: [f64; 3]) -> Iops {
        match self {
            Self::Scattering => Iops { b: values, ..iops },
            Self::Absorption => Iops { a: values, ..iops },
        }
    }
}

/// What the panel keeps of a profile between frames.
#[derive(Clone, Debug, Default)]
pub struct ProfileView {
    /// The point that buttons are for.
    pub selected: usize,
    /// What is set.
    pub quantity: Quantity,
    /// The point that is dragged.
    pub(super) grab: Option<Grab>,
}

/// Shows the profile; `camera_depth_m` is marked in the plot.
pub fn show(
    ui: &mut Ui,
    profile: &mut DepthProfile,
    view: &mut ProfileView,
    response: &Response,
    camera_depth_m: Option<f64>,
) {
    let iops = match profile.iops(response) {
        Ok(iops) => iops,
        Err(error) => {
            ui.colored_label(ui.visuals().error_fg_color, error.to_string());
            return;
        }
    };
    view.selected = view.selected.min(iops.len() - 1);
    ui.horizontal(|ui| {
        for quantity in Quantity::ALL {
            ui.selectable_value(&mut view.quantity, quantity, quantity.name())
                .on_hover_text(
                    "Which of the two the points and the table set; the other is dashed",
                );
        }
    });
    depth_plot::show(ui, profile, view, &iops, camera_depth_m);
    view.selected = view.selected.min(profile.entries().len() - 1);
    // The plot may have taken a point away or added one.
    if profile.entries().len() == iops.len() {
        table(ui, profile, view, &iops);
        water_of_point(ui, profile, view.selected, &iops[view.selected]);
        buttons(ui, profile, view);
    } else {
        ui.ctx().request_discard("points of the profile");
    }
    kinds(ui, profile, response);
}

/// A row per point: depth and values.
fn table(ui: &mut Ui, profile: &mut DepthProfile, view: &mut ProfileView, iops: &[Iops]) {
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.x = 5.0;
        Grid::new("profile").striped(true).show(ui, |ui| {
            ui.weak("point");
            ui.weak("depth, m");
            for channel in CHANNELS {
                ui.weak(format!("{channel}, 1/m"));
            }
            ui.end_row();
            for (at, iops) in iops.iter().enumerate() {
                row(ui, profile, view, at, iops);
                ui.end_row();
            }
        });
    });
}

fn row(ui: &mut Ui, profile: &mut DepthProfile, view: &mut ProfileView, at: usize, iops: &Iops) {
    let name = profile.entries()[at].water.name();
    ui.selectable_value(&mut view.selected, at, numbered(at, &name))
        .on_hover_text(format!("{name}\nThe buttons below are for the chosen point").trim_start());
    let (low, high) = profile.depth_range_m(at);
    let mut depth_m = profile.entries()[at].depth_m;
    let knob = DragValue::new(&mut depth_m).range(low..=high).speed(0.02);
    if ui
        .add(knob.max_decimals(3))
        .on_hover_text(format!(
            "Depth below the surface, between its neighbours: {low:.2} to {high:.2} m; both points of a jump move"
        ))
        .changed()
    {
        profile.set_depth(at, depth_m);
        view.selected = at;
    }
    let mut values = view.quantity.of(iops);
    if !profile.entries()[at].water.is_direct() {
        for value in values {
            ui.weak(format!("{value:.4}"))
                .on_hover_text(format!("Near zero range, of {name}; {NOT_SET}"));
        }
        return;
    }
    let before = values;
    for (value, channel) in values.iter_mut().zip(CHANNELS) {
        let speed = 0.01 * value.abs().max(0.02);
        let knob = DragValue::new(value)
            .range(0.0..=LARGEST_PER_M)
            .clamp_existing_to_range(false)
            .speed(speed)
            .max_decimals(4);
        ui.add(knob).on_hover_text(told(
            &format!("{}, {channel}", view.quantity.name()),
            &(0.0..=LARGEST_PER_M),
            "1/m",
        ));
    }
    if values != before {
        profile.set_values(at, view.quantity.set(*iops, values));
        view.selected = at;
    }
}

/// The number of a point and what fits beside it of the name of its water.
fn numbered(at: usize, name: &str) -> String {
    format!("{} {}", at + 1, cut(name, NAME_LENGTH))
        .trim_end()
        .to_owned()
}

/// What can be done to the chosen point.
fn buttons(ui: &mut Ui, profile: &mut DepthProfile, view: &mut ProfileView) {
    let at = view.selected;
    let (room, jump) = (profile.has_room(), profile.is_jump(at));
    let full = format!("A profile has at most {MOST_ENTRIES} points");
    ui.horizontal_wrapped(|ui| {
        if ui
            .add_enabled(room, egui::Button::new("Add point"))
            .on_hover_text("Below the chosen one, half way to the next; a double click in the plot adds one there")
            .on_disabled_hover_text(&full)
            .clicked()
            && let Some(new) = profile.insert_below(at)
        {
            view.selected = new;
        }
        if ui
            .add_enabled(room && !jump, egui::Button::new("Make a jump"))
            .on_hover_text("Makes two points of the chosen one, for the water above and below its depth")
            .on_disabled_hover_text(if jump { "The point is part of a jump" } else { &full })
            .clicked()
            && let Some(new) = profile.insert_jump(at)
        {
            view.selected = new;
        }
        if ui
            .add_enabled(profile.entries().len() > 1, egui::Button::new("Remove point"))
            .on_hover_text("The chosen one; a right click on a point in the plot removes that one")
            .on_disabled_hover_text("A profile has at least one point")
            .clicked()
        {
            profile.remove(at);
            view.selected = at.saturating_sub(1);
        }
    });
}

/// What the water of the chosen point is: numbers, or a type.
fn water_of_point(ui: &mut Ui, profile: &mut DepthProfile, at: usize, iops: &Iops) {
    let water = profile.entries()[at].water.clone();
    let name = if water.is_direct() {
        NUMBERS.to_owned()
    } else {
        water.name()
    };
    ComboBox::from_label(format!("water of point {}", at + 1))
        .selected_text(cut(&name, 2 * NAME_LENGTH))
        .height(list_height(ui))
        .show_ui(ui, |ui| {
            let by_wavelength = profile.bands().is_spectral();
            let numbers = egui::Button::selectable(water.is_direct(), NUMBERS);
            if ui
                .add_enabled(!by_wavelength, numbers)
                .on_disabled_hover_text(
                    "All points are known by wavelength or none: see \"Set numbers\"",
                )
                .clicked()
            {
                profile.set_direct(at, *iops);
            }
            for water_type in WaterType::ALL {
                let fits = profile.takes_type(water_type.into());
                let label = egui::Button::selectable(name == water_type.name(), water_type.name());
                if ui.add_enabled(fits, label).clicked() {
                    profile.set_type(at, water_type.into());
                }
            }
        });
    if let LayerWater::Jerlov(water) = water
        && let Some(mut scale) = place(&water)
    {
        let last = (WaterType::ALL.len() - 1) as f64;
        let name = |scale: f64, _| scale_name(scale);
        let slider = Slider::new(&mut scale, 0.0..=last).custom_formatter(name);
        if ui
            .add(slider.text("between types"))
            .on_hover_text("Mixes a and b of neighbouring types, I to 9C, at the chosen point")
            .changed()
        {
            profile.set_type(at, neighbours(scale));
        }
    }
}

/// The beginning of a name that is longer than `most` letters.
fn cut(name: &str, most: usize) -> String {
    let short: String = name.chars().take(most).collect();
    if short.len() < name.len() {
        short + ".."
    } else {
        short
    }
}

/// How points that have no numbers of their own get their values, and how they become numbers.
fn kinds(ui: &mut Ui, profile: &mut DepthProfile, response: &Response) {
    if profile.entries().iter().all(|e| e.water.is_direct()) {
        return;
    }
    let mut bands = *profile.bands();
    bands_box(ui, &mut bands, |bands| profile.takes_bands(bands));
    profile.set_bands(bands);
    if ui
        .button("Set numbers")
        .on_hover_text(
            "Makes of every point what its channels have near zero range, in three bands; values can be dragged then",
        )
        .clicked()
    {
        // Bands that do not cover a point cannot be chosen.
        let _ = profile.to_numbers(response);
    }
}
