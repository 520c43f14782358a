//! The help over everything.

use crate::app::Viewer;
use crate::ui::{commands, shortcuts::HELP};

/// Width of the list where the window has room, points.
const WIDTH: f32 = 760.0;
/// Height of a row: as many as there are, they are seen without scrolling where the window has 720 points.
const ROW: f32 = 16.0;
/// Room around it, points.
const MARGIN: f32 = 50.0;

/// Shows the help where it is open.
pub fn show(app: &mut Viewer, ctx: &egui::Context) {
    if !app.help_open {
        return;
    }
    let modal = egui::Modal::new(egui::Id::unique("help")).show(ctx, |ui| {
        let window = ui.ctx().content_rect().size();
        ui.set_width(WIDTH.min(window.x - MARGIN));
        ui.heading("Keys and mouse");
        ui.add_space(6.0);
        egui::ScrollArea::both()
            .max_height((window.y - 3.0 * MARGIN).max(MARGIN))
            .show(ui, keys);
        ui.add_space(6.0);
        ui.label("Every number can be dragged, or clicked and typed.");
        ui.vertical_centered(|ui| ui.button("Close").clicked())
            .inner
    });
    if modal.inner || modal.should_close() {
        app.help_open = false;
    }
}

/// The keys in two columns.
fn keys(ui: &mut egui::Ui) {
    let own = HELP.iter().map(|(keys, what)| ((*keys).to_owned(), *what));
    let of_menus = commands::all().map(|command| (command.keys_text(), command.name));
    let all: Vec<_> = own.chain(of_menus).collect();
    let (left, right) = all.split_at(all.len().div_ceil(2));
    egui::Grid::new("keys")
        .num_columns(4)
        .spacing(egui::vec2(10.0, 1.0))
        .min_row_height(ROW)
        .striped(true)
        .show(ui, |ui| {
            for (i, first) in left.iter().enumerate() {
                for (keys, what) in [Some(first), right.get(i)].into_iter().flatten() {
                    ui.monospace(keys);
                    ui.label(*what);
                }
                ui.end_row();
            }
        });
}
