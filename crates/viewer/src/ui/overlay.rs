//! What lies over the picture or next to it: the scale of false colours, the probe, notes.

use std::sync::Arc;

use egui::text::{LayoutJob, TextWrapping};
use egui::{
    Align2, Color32, FontId, Galley, Pos2, Rect, Role, Sense, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use super::scale;
use crate::model::display::Legend;

/// Room between a text and the edges of its ground, points.
const PADDING: f32 = 5.0;
/// Room between what is shown and the edges of the picture, points.
const MARGIN: f32 = 8.0;
/// Width of the scale of false colours, and most height of it, points.
const SCALE: Vec2 = vec2(14.0, 200.0);
/// Least width of a text before it breaks into another line, points.
const LEAST_WIDTH: f32 = 80.0;
/// Least width of a label, points; a narrower one says nothing.
const LEAST_LABEL: f32 = 24.0;
/// The letters.
const FONT: FontId = FontId::monospace(12.0);

/// Shows the scale of false colours at the upper right of the picture; the place that it takes.
pub fn legend(ui: &Ui, picture: Rect, legend: &Legend) -> Rect {
    let ends = scale::ends(f64::from(legend.low), f64::from(legend.high));
    let logarithmic = if legend.logarithmic { " (log)" } else { "" };
    let [low, high] = ends.map(|end| format!("{end} {}", legend.unit).trim_end().to_owned());
    let texts = [format!("{high}{logarithmic}"), low];
    let galleys = texts.map(|text| laid_out(ui, &text, f32::INFINITY));
    let line = galleys[0].size().y + 2.0 * PADDING;
    let height = (picture.height() - 2.0 * MARGIN - line).clamp(20.0, SCALE.y);
    let top = pos2(picture.right() - 2.0 * MARGIN - SCALE.x, picture.top());
    let bar = Rect::from_min_size(top + vec2(0.0, MARGIN + 0.5 * line), vec2(SCALE.x, height));
    ui.painter()
        .rect_filled(bar.expand(1.0), 0.0, Color32::BLACK);
    scale::paint(ui.painter(), bar, legend.colours);
    let mut taken = bar.expand(1.0);
    let ends = [("high", bar.top()), ("low", bar.bottom())];
    for ((name, y), galley) in ends.into_iter().zip(galleys) {
        let at = pos2(bar.left() - MARGIN, y);
        taken |= shown(ui, name, at, Align2::RIGHT_CENTER, galley);
    }
    taken
}

/// Shows a note at the upper left of the picture, left of what is `taken`.
pub fn note(ui: &Ui, picture: Rect, taken: Option<Rect>, text: &str) {
    let galley = laid_out(ui, text, width_beside(picture, taken));
    let at = picture.left_top() + Vec2::splat(MARGIN);
    shown(ui, "note", at, Align2::LEFT_TOP, galley);
}

/// Shows what the probe tells: below the picture where `area` has room there, else at its lower left, left of what is
/// `taken`.
pub fn probe(ui: &Ui, area: Rect, picture: Rect, taken: Option<Rect>, text: &str) {
    let below = laid_out(ui, text, width_beside(picture, None));
    let room = area.bottom() - picture.bottom() - MARGIN;
    if below.size().y + 2.0 * PADDING <= room {
        let at = picture.left_bottom() + vec2(MARGIN, 0.5 * MARGIN);
        shown(ui, "probe", at, Align2::LEFT_TOP, below);
    } else {
        let galley = laid_out(ui, text, width_beside(picture, taken));
        let at = picture.left_bottom() + vec2(MARGIN, -MARGIN);
        shown(ui, "probe", at, Align2::LEFT_BOTTOM, galley);
    }
}

/// Shows a line of text with a corner at a place, cut where there is no room for all of it, and nothing where there is none.
pub fn label(ui: &Ui, name: &str, (at, anchor): (Pos2, Align2), room: f32, text: &str) {
    let width = room - 2.0 * PADDING;
    if width < LEAST_LABEL {
        return;
    }
    let mut job = LayoutJob::simple_singleline(text.to_owned(), FONT, Color32::WHITE);
    job.wrap = TextWrapping::truncate_at_width(width);
    let galley = ui.painter().layout_job(job);
    shown(ui, name, at, anchor, galley);
}

/// Width of the longest line that fits between the left edge of the picture and what is `taken`, points.
fn width_beside(picture: Rect, taken: Option<Rect>) -> f32 {
    let right = taken.map_or(picture.right(), |taken| taken.left());
    (right - picture.left() - 2.0 * (MARGIN + PADDING)).max(LEAST_WIDTH)
}

fn laid_out(ui: &Ui, text: &str, width: f32) -> Arc<Galley> {
    ui.painter()
        .layout(text.to_owned(), FONT, Color32::WHITE, width)
}

/// Paints a text on a dark ground, and tells it to those who cannot see it; the place that it takes.
fn shown(ui: &Ui, name: &str, at: Pos2, anchor: Align2, galley: Arc<Galley>) -> Rect {
    let size = galley.size() + Vec2::splat(2.0 * PADDING);
    let rect = anchor.anchor_size(at, size);
    let response = ui.interact(rect, ui.scope_id().with(name), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, galley.text()));
    let painter = ui.painter();
    painter.rect_filled(rect, 4.0, Color32::from_black_alpha(170));
    painter.galley(rect.min + Vec2::splat(PADDING), galley, Color32::WHITE);
    rect
}
