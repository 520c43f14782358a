//! The help over everything.

use crate::app::Viewer;
use crate::ui::shortcuts::HELP;

/// Shows the help where it is open.
pub fn show(app: &mut Viewer, ctx: &egui::Context) {
    if !app.help_open {
        return;
    }
    let modal = egui::Modal::new(egui::Id::unique("help")).show(ctx, |ui| {
        ui.set_width(430.0);
        ui.heading("Keys and mouse");
        ui.add_space(6.0);
        egui::Grid::new("keys")
            .num_columns(2)
            .striped(true)
            .show(ui, |ui| {
                for (keys, what) in HELP {
                    ui.monospace(keys);
                    ui.label(what);
                    ui.end_row();
                }
            });
        ui.add_space(6.0);
        ui.label("Every number can be dragged, or clicked and typed.");
        ui.vertical_centered(|ui| ui.button("Close").clicked())
            .inner
    });
    if modal.inner || modal.should_close() {
        app.help_open = false;
    }
}
