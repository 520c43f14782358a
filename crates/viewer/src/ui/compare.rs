//! Two pictures beside each other, with a wiper between them.

use egui::{Align2, Color32, CursorIcon, Rect, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use glam::DVec2;

use super::{overlay, picture, seen::Seen};
use crate::app::Viewer;
use crate::model::histogram::counts;
use crate::model::snapshots::{Side, Snapshots};
use crate::worker::Frame;

/// Width in which the wiper can be taken, points.
const GRIP: f32 = 14.0;
/// From the upper edge of the picture to the names of its sides, below notes, points.
const NAMES: f32 = 36.0;

/// Shows both sides and the wiper.
pub fn show(app: &mut Viewer, ui: &Ui, seen: &Seen, frame: &Frame) {
    let visible = seen.visible;
    let sides = app.inspection.comparison.sides;
    let x = wiper(app, ui, visible);
    for (side, clip) in sides.into_iter().zip(halves(visible, x)) {
        picture::one(app, ui, seen, frame, (side, clip));
    }
    let painter = ui.painter();
    for (width, colour) in [(3.0, Color32::BLACK), (1.0, Color32::WHITE)] {
        painter.vline(x, visible.y_range(), Stroke::new(width, colour));
    }
}

/// Shows the names of both sides beside the wiper, left of what is `taken`.
pub fn names(app: &Viewer, ui: &Ui, visible: Rect, taken: Option<Rect>) {
    let comparison = &app.inspection.comparison;
    let x = place(visible, comparison.wiper);
    let right = taken.map_or(visible.right(), |taken| taken.left());
    let ends = [
        ("A", Align2::RIGHT_TOP, x - visible.left()),
        ("B", Align2::LEFT_TOP, right - x),
    ];
    for ((name, anchor, room), side) in ends.into_iter().zip(comparison.sides) {
        let off = if name == "A" { -GRIP } else { GRIP };
        let at = pos2(x + 0.5 * off, visible.top() + NAMES);
        let text = format!("{name}  {}", side_name(&app.inspection.snapshots, side));
        overlay::label(ui, name, (at, anchor), room - GRIP, &text);
    }
}

/// The name of a side.
pub fn side_name(snapshots: &Snapshots, side: Side) -> &str {
    let kept = snapshots.of(side);
    kept.map_or("the live picture", |kept| kept.name.as_str())
}

/// What is known of a kept picture at a place of it, where one is on that side of the wiper.
pub fn probe_text(app: &Viewer, seen: &Seen, pointer: egui::Pos2) -> Option<String> {
    let comparison = &app.inspection.comparison;
    let is_right = pointer.x > place(seen.visible, comparison.wiper);
    let side = comparison.sides[usize::from(is_right)];
    let kept = app.inspection.snapshots.of(side)?;
    let [width, height] = kept.image.size;
    let rect = seen.other(vec2(width as f32, height as f32));
    let share = (pointer - rect.min) / rect.size();
    let at = DVec2::new(f64::from(share.x), f64::from(share.y));
    if !((0.0..1.0).contains(&at.x) && (0.0..1.0).contains(&at.y)) {
        return Some(format!("{}\nnothing here", kept.name));
    }
    let (column, row) = (
        (at.x * width as f64) as usize,
        (at.y * height as f64) as usize,
    );
    let [r, g, b] = counts(*kept.image.pixels.get(row * width + column)?);
    Some(format!(
        "{}\ncounts   {r} {g} {b}   pixel {column}, {row} of {width} x {height}",
        kept.name
    ))
}

/// The wiper as a handle that can be dragged; where it is, points.
fn wiper(app: &mut Viewer, ui: &Ui, visible: Rect) -> f32 {
    let wiper = &mut app.inspection.comparison.wiper;
    let grip = vec2(GRIP, visible.height());
    let handle = Rect::from_center_size(pos2(place(visible, *wiper), visible.center().y), grip);
    let response = ui.interact(handle, ui.scope_id().with("wiper"), Sense::drag());
    let response = response.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal);
    if let Some(at) = response
        .interact_pointer_pos()
        .filter(|_| response.dragged())
    {
        let share = (at.x - visible.left()) / visible.width();
        *wiper = f64::from(share).clamp(0.0, 1.0);
    }
    response.widget_info(|| WidgetInfo::slider(true, *wiper, "Wiper"));
    place(visible, *wiper)
}

fn place(visible: Rect, wiper: f64) -> f32 {
    visible.left() + wiper as f32 * visible.width()
}

/// What is left and right of `x`.
fn halves(visible: Rect, x: f32) -> [Rect; 2] {
    [
        Rect::from_min_max(visible.min, pos2(x, visible.bottom())),
        Rect::from_min_max(pos2(x, visible.top()), visible.max),
    ]
}
