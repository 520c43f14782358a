//! The bar at the top.

use egui::{MenuBar, Panel, ThemePreference, Ui};

use crate::app::Viewer;
use crate::model::{ShownLayer, lasting::CONTROLS};
use crate::ui::commands::{self, Command};
use crate::ui::knobs::list_height;

/// Shows the bar.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    Panel::top("menu").show(ui, |ui| {
        MenuBar::new().ui(ui, |ui| {
            ui.menu_button("File", |ui| items(app, ui, &commands::FILE));
            ui.menu_button("Edit", |ui| items(app, ui, &commands::EDIT));
            ui.menu_button("View", |ui| {
                items(app, ui, &commands::VIEW);
                ui.separator();
                look(ui);
            });
            ui.menu_button("Help", |ui| items(app, ui, &commands::HELP));
            ui.separator();
            layers(app, ui);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let title = egui::RichText::new(&app.open.title).weak();
                ui.add(egui::Label::new(title).truncate());
                if app.is_loading() {
                    ui.spinner();
                }
            });
        });
    });
}

fn items(app: &mut Viewer, ui: &mut Ui, commands: &[Command]) {
    for command in commands {
        command.item(app, ui);
    }
}

/// Dark or light, and how large.
fn look(ui: &mut Ui) {
    let mut theme = ui.ctx().options(|o| o.theme_preference);
    for (preference, name) in [
        (ThemePreference::Dark, "Dark"),
        (ThemePreference::Light, "Light"),
        (ThemePreference::System, "As the system"),
    ] {
        ui.radio_value(&mut theme, preference, name);
    }
    ui.ctx().set_theme(theme);
    let mut zoom = ui.ctx().zoom_factor();
    ui.add(
        egui::Slider::new(&mut zoom, CONTROLS)
            .text("Size of the controls")
            .step_by(0.1),
    )
    .on_hover_text("Size of the controls: 0.6 to 2.5 times the usual one");
    ui.ctx().set_zoom_factor(zoom);
}

/// Layer and false colours, always at hand.
fn layers(app: &mut Viewer, ui: &mut Ui) {
    let names: Vec<String> = app.settings.lamps.iter().map(|l| l.name.clone()).collect();
    let all = ShownLayer::all(&names);
    let chosen = app.display.layer.within(names.len());
    let name = all
        .iter()
        .find(|(l, _)| *l == chosen)
        .map(|(_, n)| n.as_str());
    let label = ui.label("Layer");
    egui::ComboBox::from_id_salt("layer")
        .selected_text(name.unwrap_or("picture"))
        .height(list_height(ui))
        .show_ui(ui, |ui| {
            for (layer, name) in &all {
                ui.selectable_value(&mut app.display.layer, *layer, name);
            }
        })
        .response
        .labelled_by(label.id);
    let colours = crate::model::FalseColour::ALL;
    let name = colours.iter().find(|(c, _)| *c == app.display.false_colour);
    let label = ui.label("False colour");
    egui::ComboBox::from_id_salt("false colour")
        .selected_text(name.map_or("Off", |(_, n)| n))
        .show_ui(ui, |ui| {
            for (colours, name) in colours {
                ui.selectable_value(&mut app.display.false_colour, colours, name);
            }
        })
        .response
        .labelled_by(label.id);
    ui.checkbox(&mut app.display.logarithmic, "Log");
}
