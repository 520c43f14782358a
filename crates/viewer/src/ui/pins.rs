//! Pixels whose values are pinned: marks in the picture, and the list of them.

use egui::{Align2, Color32, Stroke, Ui, vec2};

use super::picture::{pixel_at, three};
use super::{overlay, seen::Seen};
use crate::app::Viewer;
use crate::model::inspection::MOST_PINS;
use crate::worker::Frame;

/// Reach of the cross of a pin, points.
const REACH: f32 = 6.0;

/// Marks the pins in the picture, each with its number and counts.
pub fn marks(app: &Viewer, ui: &Ui, seen: &Seen, frame: &Frame) {
    for (i, at) in app.inspection.pins.iter().enumerate() {
        let place = seen.at(*at);
        if !seen.visible.contains(place) {
            continue;
        }
        let painter = ui.painter_at(seen.visible);
        for (width, colour) in [(3.0, Color32::BLACK), (1.0, Color32::WHITE)] {
            let stroke = Stroke::new(width, colour);
            painter.hline(place.x - REACH..=place.x + REACH, place.y, stroke);
            painter.vline(place.x, place.y - REACH..=place.y + REACH, stroke);
        }
        let text = match pixel_at(frame, *at).and_then(|(_, _, i)| frame.shown.counts(i)) {
            Some([r, g, b]) => format!("{}: {r} {g} {b}", i + 1),
            None => format!("{}", i + 1),
        };
        let room = seen.visible.right() - place.x - 2.0 * REACH;
        let below = place.y < seen.visible.center().y;
        let (dx, anchor_x, room) = match room > 110.0 {
            true => (REACH, egui::Align::Min, room),
            false => (
                -REACH,
                egui::Align::Max,
                place.x - seen.visible.left() - REACH,
            ),
        };
        let (dy, anchor_y) = match below {
            true => (REACH, egui::Align::Min),
            false => (-REACH, egui::Align::Max),
        };
        let name = format!("pin {i}");
        let corner = (place + vec2(dx, dy), Align2([anchor_x, anchor_y]));
        overlay::label(ui, &name, corner, room, &text);
    }
}

/// Lists the pins with all that is known of them.
pub fn list(app: &mut Viewer, ui: &mut Ui) {
    let frame = app.frame().cloned();
    let mut removed = None;
    for (i, at) in app.inspection.pins.iter().enumerate() {
        ui.horizontal(|ui| {
            let text = format!("Remove pin {}", i + 1);
            if ui.small_button("x").on_hover_text(text).clicked() {
                removed = Some(i);
            }
            let values = frame.as_ref().and_then(|frame| values(frame, *at));
            let values = values.unwrap_or_else(|| "not known yet".to_owned());
            let text = egui::RichText::new(format!("{}  {values}", i + 1)).monospace();
            ui.add(egui::Label::new(text).wrap());
        });
    }
    if let Some(i) = removed {
        app.inspection.pins.remove(i);
    }
    match app.inspection.pins.len() {
        0 => {
            ui.weak("P or Ctrl+click pins the pixel under the pointer");
        }
        pins => {
            ui.horizontal(|ui| {
                if ui.button("Remove all pins").clicked() {
                    app.inspection.pins.clear();
                }
                ui.weak(format!("{pins} of at most {MOST_PINS}"));
            });
        }
    }
}

/// Counts and radiance of a pinned pixel.
fn values(frame: &Frame, at: glam::DVec2) -> Option<String> {
    let (column, row, index) = pixel_at(frame, at)?;
    let [r, g, b] = frame.shown.counts(index)?;
    let radiance = three(frame.shown.radiance.get(index)?);
    Some(format!(
        "{r} {g} {b} counts\n   {radiance} W/(m² sr)\n   pixel {column}, {row}"
    ))
}
