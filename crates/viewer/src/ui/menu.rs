//! The bar at the top.

use egui::{MenuBar, Panel, ThemePreference, Ui, ViewportCommand};

use crate::app::{FilePurpose, Viewer};
use crate::model::{ShownLayer, lasting::CONTROLS};
use crate::ui::knobs::list_height;
use crate::ui::shortcuts::{self, text};

/// Shows the bar.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    Panel::top("menu").show(ui, |ui| {
        MenuBar::new().ui(ui, |ui| {
            ui.menu_button("File", |ui| file(app, ui));
            ui.menu_button("Edit", |ui| edit(app, ui));
            ui.menu_button("View", |ui| view(app, ui));
            ui.menu_button("Help", |ui| {
                if ui.button("Keys and mouse  F1").clicked() {
                    app.help_open = true;
                }
            });
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

fn file(app: &mut Viewer, ui: &mut Ui) {
    let item = |ui: &mut Ui, name: &str, keys: String| {
        ui.add(egui::Button::new(name).shortcut_text(keys))
            .clicked()
    };
    if item(ui, "Open scene or glTF...", text(&shortcuts::OPEN)) {
        app.ask_file(FilePurpose::OpenScene);
    }
    ui.menu_button("Open recent", |ui| recent(app, ui));
    if item(ui, "Save scene as...", text(&shortcuts::SAVE)) {
        app.ask_file(FilePurpose::SaveScene);
    }
    ui.separator();
    if item(
        ui,
        "Export picture (PNG, TIFF)...",
        text(&shortcuts::EXPORT),
    ) {
        app.ask_file(FilePurpose::ExportPicture);
    }
    if item(ui, "Export EXR with all layers...", String::new()) {
        app.ask_file(FilePurpose::ExportExr);
    }
    if item(ui, "Export plots (SVG, PNG)...", String::new()) {
        app.ask_file(FilePurpose::ExportPlots);
    }
    ui.separator();
    if item(ui, "Quit", text(&shortcuts::QUIT)) {
        ui.ctx().send_viewport_cmd(ViewportCommand::Close);
    }
}

fn recent(app: &mut Viewer, ui: &mut Ui) {
    let paths = app.recent.paths().to_vec();
    if paths.is_empty() {
        ui.weak("Nothing yet");
    }
    for path in paths {
        if ui.button(path.display().to_string()).clicked() {
            app.open_file(&path, &ui.ctx().clone());
        }
    }
}

fn edit(app: &mut Viewer, ui: &mut Ui) {
    let (can_undo, can_redo) = app.can_undo_redo();
    let item = |ui: &mut Ui, enabled: bool, name: &str, keys: String| {
        let button = egui::Button::new(name).shortcut_text(keys);
        ui.add_enabled(enabled, button).clicked()
    };
    if item(ui, can_undo, "Undo", text(&shortcuts::UNDO)) {
        app.undo();
    }
    if item(ui, can_redo, "Redo", text(&shortcuts::REDO)) {
        app.redo();
    }
    ui.separator();
    let ctx = ui.ctx().clone();
    if item(ui, true, "Copy as command", text(&shortcuts::COPY_COMMAND)) {
        app.copy_command(&ctx);
    }
    if item(ui, true, "Copy as scene", text(&shortcuts::COPY_SCENE)) {
        app.copy_scene(&ctx);
    }
}

fn view(app: &mut Viewer, ui: &mut Ui) {
    let mut theme = ui.ctx().options(|o| o.theme_preference);
    for (preference, name) in [
        (ThemePreference::Dark, "Dark"),
        (ThemePreference::Light, "Light"),
        (ThemePreference::System, "As the system"),
    ] {
        ui.radio_value(&mut theme, preference, name);
    }
    ui.ctx().set_theme(theme);
    ui.separator();
    let mut zoom = ui.ctx().zoom_factor();
    ui.add(
        egui::Slider::new(&mut zoom, CONTROLS)
            .text("Size of the controls")
            .step_by(0.1),
    )
    .on_hover_text("Size of the controls: 0.6 to 2.5 times the usual one");
    ui.ctx().set_zoom_factor(zoom);
    ui.checkbox(&mut app.lamps_follow, "Lamps move with the camera");
    ui.checkbox(&mut app.denoised, "Denoise (biased)")
        .on_hover_text(
            "A second half of the samples is rendered, and layers are fitted to what is known of the first surfaces. \
             The error that is told is then the estimated one of the denoised picture.",
        );
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
