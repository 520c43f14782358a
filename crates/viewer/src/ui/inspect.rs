//! The panel for looking closely: compared pictures, histogram, zoom, pinned pixels.

use std::sync::Arc;

use egui::{ComboBox, Grid, Id, Label, RichText, Ui};
use egui_plot::{Line, PlotPoints};

use super::knobs::{heading, list_height, slider, still_plot, x_axis, y_axis};
use super::theme::{CHANNELS, channel_colours};
use super::{compare::side_name, pins};
use crate::app::Viewer;
use crate::model::histogram::{BLACK, CLIPPED, Histogram};
use crate::model::snapshots::{MOST_KEPT, Side};
use crate::worker::Frame;

/// Shows the panel.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    heading(ui, "Compare");
    kept(app, ui);
    comparison(app, ui);
    heading(ui, "Histogram");
    histogram(app, ui);
    heading(ui, "Zoom");
    zoom(app, ui);
    heading(ui, "Pinned pixels");
    pins::list(app, ui);
}

/// The pictures that were kept.
fn kept(app: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let keep = ui.button("Keep this picture");
        if keep
            .on_hover_text(format!(
                "K: keeps it as it is, with what is set. At most {MOST_KEPT}; then the oldest leaves"
            ))
            .clicked()
        {
            app.keep_picture();
        }
        if app.inspection.keeps_next {
            ui.weak("once it is whole");
        }
    });
    let (mut removed, mut wanted) = (None, None);
    for kept in app.inspection.snapshots.all() {
        ui.horizontal(|ui| {
            let remove = ui.small_button("x");
            if remove
                .on_hover_text(format!("Remove picture {}", kept.id))
                .clicked()
            {
                removed = Some(kept.id);
            }
            let same_scene = kept.is_of(app.opening);
            let set = egui::Button::new("Set").small();
            if ui
                .add_enabled(same_scene, set)
                .on_hover_text(format!("Sets everything as in picture {}", kept.id))
                .on_disabled_hover_text("Another scene is open")
                .clicked()
            {
                wanted = Some(kept.settings.clone());
            }
            ui.add(Label::new(&kept.name).truncate());
        });
    }
    if let Some(id) = removed {
        let inspection = &mut app.inspection;
        inspection.snapshots.remove(id);
        let snapshots = &inspection.snapshots;
        inspection.comparison.follow(snapshots, Side::Live);
    }
    if let Some(settings) = wanted {
        app.settings = settings;
    }
}

/// Which two pictures are shown.
fn comparison(app: &mut Viewer, ui: &mut Ui) {
    let inspection = &mut app.inspection;
    let (snapshots, comparison) = (&inspection.snapshots, &mut inspection.comparison);
    ui.checkbox(&mut comparison.on, "A | B with a wiper")
        .on_hover_text("B: shows two pictures, with a wiper between them that can be dragged");
    if !comparison.on {
        return;
    }
    let choices: Vec<Side> = [Side::Live]
        .into_iter()
        .chain(snapshots.all().map(|kept| Side::Kept(kept.id)))
        .collect();
    for (side, name) in comparison.sides.iter_mut().zip(["A", "B"]) {
        ui.horizontal(|ui| {
            let label = ui.label(name);
            ComboBox::from_id_salt(("side", name))
                .selected_text(side_name(snapshots, *side))
                .width(ui.available_width() - 8.0)
                .truncate()
                .height(list_height(ui))
                .show_ui(ui, |ui| {
                    for choice in &choices {
                        ui.selectable_value(side, *choice, side_name(snapshots, *choice));
                    }
                })
                .response
                .labelled_by(label.id);
        });
    }
    let mut percent = 100.0 * comparison.wiper;
    if slider(ui, "place of the wiper", &mut percent, 0.0..=100.0, " %").changed() {
        comparison.wiper = percent / 100.0;
    }
}

fn histogram(app: &mut Viewer, ui: &mut Ui) {
    ui.checkbox(&mut app.inspection.marks, "mark clipped and black pixels")
        .on_hover_text("C: marks them in the picture; false colours have no such marks");
    ui.horizontal(|ui| {
        ui.colored_label(CLIPPED, "a channel is full");
        ui.colored_label(BLACK, "all channels are zero");
    });
    let Some(frame) = app.frame().filter(|frame| frame.shown.legend.is_none()) else {
        ui.weak("none of false colours");
        return;
    };
    let Some(found) = counted(ui, frame) else {
        ui.weak("the picture comes from the adapter");
        return;
    };
    plot(ui, &found);
    shares(ui, &found);
}

/// The histogram of a picture, counted once.
fn counted(ui: &Ui, frame: &Frame) -> Option<Arc<Histogram>> {
    type Kept = (u64, Arc<Histogram>);
    let id = Id::unique("histogram");
    let kept: Option<Kept> = ui.data(|d| d.get_temp(id));
    if let Some((serial, found)) = kept
        && serial == frame.serial
    {
        return Some(found);
    }
    let found = Arc::new(Histogram::of(frame.shown.image()?));
    ui.data_mut(|d| d.insert_temp::<Kept>(id, (frame.serial, Arc::clone(&found))));
    Some(found)
}

fn plot(ui: &mut Ui, found: &Histogram) {
    let colours = channel_colours(ui);
    still_plot("histogram", 120.0)
        .include_x(0.0)
        .include_x(255.0)
        .include_y(0.0)
        .custom_x_axes(vec![x_axis("counts")])
        .custom_y_axes(vec![y_axis("log10(1 + n)")])
        .show(ui, |plot| {
            for ((bins, colour), name) in found.bins.iter().zip(colours).zip(CHANNELS) {
                let points = bins.iter().enumerate();
                let points = points.map(|(x, n)| [x as f64, (1.0 + f64::from(*n)).log10()]);
                let line = Line::new(name, PlotPoints::new(points.collect()));
                plot.line(line.color(colour));
            }
        });
}

/// How much of the picture is full and black, by channel and by pixel.
fn shares(ui: &mut Ui, found: &Histogram) {
    Grid::new("shares").num_columns(5).show(ui, |ui| {
        ui.label("");
        for (name, colour) in CHANNELS.into_iter().zip(channel_colours(ui)) {
            ui.label(RichText::new(name).color(colour));
        }
        ui.weak("pixels");
        ui.end_row();
        for (name, count, pixels) in [
            ("255, full", 255, found.clipped),
            ("0, black", 0, found.black),
        ] {
            ui.label(name);
            for bins in &found.bins {
                ui.monospace(percent(found.share(bins[count])));
            }
            ui.monospace(percent(found.share(pixels)));
            ui.end_row();
        }
    });
}

/// A share that is not nothing never reads as nothing.
fn percent(share: f64) -> String {
    match 100.0 * share {
        0.0 => "0 %".to_owned(),
        percent if percent < 0.01 => "<0.01 %".to_owned(),
        percent => format!("{percent:.2} %"),
    }
}

fn zoom(app: &mut Viewer, ui: &mut Ui) {
    let Some(place) = app.picture.place() else {
        return;
    };
    let zoom = &mut app.inspection.zoom;
    ui.horizontal(|ui| {
        let middle = glam::DVec2::splat(0.5);
        if ui.button("Fit").on_hover_text("0").clicked() {
            *zoom = Default::default();
        }
        if ui
            .button("1:1")
            .on_hover_text("9: a pixel of the picture is one of the screen")
            .clicked()
        {
            zoom.to_pixels(&place, middle);
        }
        for (name, change, keys) in [("-", 0.5, "-"), ("+", 2.0, "+")] {
            if ui.button(name).on_hover_text(keys).clicked() {
                zoom.by(&place, zoom.middle(), change);
            }
        }
        ui.label(format!("{:.3} px per pixel", zoom.pixel_side(&place)));
    });
    ui.weak("Ctrl+wheel, Ctrl+drag, arrows");
}
