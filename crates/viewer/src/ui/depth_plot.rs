//! The plot of a profile of the water: coefficients against depth, downwards, with points that can be dragged.

use egui::{CursorIcon, Pos2, Role, Ui, WidgetInfo};
use egui_plot::{HLine, Line, LineStyle, MarkerShape, PlotPoint, PlotPoints, PlotUi, Points};
use uw_media::Iops;

use super::depth_profile::{NOT_SET, ProfileView, Quantity};
use super::knobs::{still_plot, x_axis, y_axis};
use super::theme::{CHANNELS, channel_colours};
use crate::model::DepthProfile;

/// Height of the plot, points.
const HEIGHT: f32 = 210.0;
/// How near the pointer must be to a point to take it, points on the screen.
const REACH: f32 = 9.0;
/// Radius of a point, and of one that is chosen, points on the screen.
const RADII: [f32; 2] = [3.5, 5.5];
/// Room beyond the largest value and the deepest point, as a share.
const ROOM: f64 = 0.2;
/// Least range of the plot, 1/m and m.
const LEAST: (f64, f64) = (0.02, 2.0);

/// A point that is dragged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grab {
    at: usize,
    channel: usize,
    /// Its coefficients when the drag began, 1/m.
    start: Iops,
    /// Right and lower end of the plot, which stay during a drag, 1/m and m.
    ends: (f64, f64),
}

/// Shows the plot; what is done in it changes the profile and the view. `iops` are the coefficients of the points.
pub fn show(
    ui: &mut Ui,
    profile: &mut DepthProfile,
    view: &mut ProfileView,
    iops: &[Iops],
    camera_depth_m: Option<f64>,
) {
    view.grab = view.grab.filter(|grab| grab.at < iops.len());
    let ends = view
        .grab
        .map_or_else(|| ends(profile, iops, camera_depth_m), |grab| grab.ends);
    let colours = channel_colours(ui);
    let ink = ui.visuals().text_color();
    let depths: Vec<f64> = profile
        .entries()
        .iter()
        .map(|entry| entry.depth_m)
        .collect();
    let (quantity, selected) = (view.quantity, view.selected);
    let direct: Vec<bool> = profile
        .entries()
        .iter()
        .map(|e| e.water.is_direct())
        .collect();
    let shown = still_plot("depths", HEIGHT)
        .include_x(0.0)
        .include_x(ends.0)
        .include_y(0.0)
        .include_y(ends.1)
        .invert_y(true)
        .show_x(false)
        .show_y(false)
        .set_margin_fraction(egui::vec2(0.03, 0.05))
        .custom_x_axes(vec![x_axis("1/m")])
        .custom_y_axes(vec![y_axis("depth, m")])
        .show(ui, |plot| {
            if let Some(depth_m) = camera_depth_m {
                let line = HLine::new("camera", depth_m).allow_hover(false);
                plot.hline(
                    line.color(ink.gamma_multiply(0.35))
                        .style(LineStyle::dashed_dense()),
                );
            }
            for (channel, colour) in colours.into_iter().enumerate() {
                for own in Quantity::ALL {
                    let values: Vec<f64> = iops.iter().map(|i| own.of(i)[channel]).collect();
                    let line = course(CHANNELS[channel], &depths, &values, ends.1).color(colour);
                    plot.line(if own == quantity {
                        line.width(2.0)
                    } else {
                        line.width(1.0).style(LineStyle::dashed_loose())
                    });
                }
                for at in 0..depths.len() {
                    let place = [quantity.of(&iops[at])[channel], depths[at]];
                    mark(plot, place, direct[at], at == selected, colour);
                }
            }
        });
    let response = shown.response.interact(egui::Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Profile of the water"));
    let on_screen = |at: usize, channel: usize| {
        let value = quantity.of(&iops[at])[channel];
        shown
            .transform
            .position_from_point(&PlotPoint::new(value, depths[at]))
    };
    let nearest = |pointer: Pos2| nearest(pointer, iops.len(), selected, &on_screen);
    let value_at = |pointer: Pos2| shown.transform.value_from_position(pointer);
    let hovered = response.hover_pos().and_then(nearest);
    if response.drag_started() {
        let pressed = ui.input(|i| i.pointer.press_origin());
        view.grab = pressed.and_then(nearest).map(|(at, channel)| Grab {
            at,
            channel,
            start: iops[at],
            ends,
        });
    }
    if let (Some(grab), Some(pointer)) = (view.grab, response.interact_pointer_pos()) {
        let together = ui.input(|i| i.modifiers.shift);
        drag(profile, quantity, grab, value_at(pointer), together);
        view.selected = grab.at;
    }
    if !response.dragged() {
        view.grab = None;
    }
    if hovered.is_some() || view.grab.is_some() {
        ui.ctx().set_cursor_icon(CursorIcon::Grab);
    }
    if let Some(pointer) = response.interact_pointer_pos() {
        match nearest(pointer) {
            Some((at, _)) if response.secondary_clicked() => profile.remove(at),
            Some((at, _)) if response.clicked() => view.selected = at,
            None if response.double_clicked() => {
                let depth_m = rounded(value_at(pointer).y, ends.1);
                view.selected = profile.insert(depth_m).unwrap_or(view.selected);
            }
            _ => {}
        }
    }
    response.on_hover_text_at_pointer(help(profile, hovered));
    ui.weak("— set here   -- the other   ··· depth of the camera");
}

/// What the plot says under the pointer.
fn help(profile: &DepthProfile, hovered: Option<(usize, usize)>) -> String {
    let Some((at, _)) = hovered else {
        return "Double click: a point here\nDrag a point: depth and value".to_owned();
    };
    let entry = &profile.entries()[at.min(profile.entries().len() - 1)];
    let does = if entry.water.is_direct() {
        "Drag: depth and value of this channel\nShift + drag: all channels in proportion".to_owned()
    } else {
        format!(
            "Drag: depth. Its values are those of {}; {NOT_SET}",
            entry.water.name()
        )
    };
    format!(
        "Point {} at {:.3} m\n{does}\nRight click: remove it",
        at + 1,
        entry.depth_m
    )
}

/// Right and lower end of the plot, 1/m and m.
fn ends(profile: &DepthProfile, iops: &[Iops], camera_depth_m: Option<f64>) -> (f64, f64) {
    let values = iops.iter().flat_map(|i| i.a.into_iter().chain(i.b));
    let depths = profile.entries().iter().map(|entry| entry.depth_m);
    let most = values.fold(LEAST.0, f64::max);
    let deepest = depths.chain(camera_depth_m).fold(LEAST.1, f64::max);
    ((1.0 + ROOM) * most, (1.0 + ROOM) * deepest)
}

/// The line through the points, the same above the first and below the last.
fn course(name: &str, depths_m: &[f64], values: &[f64], deepest_m: f64) -> Line<'static> {
    let points = values.iter().zip(depths_m).map(|(v, d)| [*v, *d]);
    let first = values.first().map(|v| [*v, 0.0]);
    let last = values.last().map(|v| [*v, deepest_m]);
    let points: Vec<_> = first.into_iter().chain(points).chain(last).collect();
    Line::new(name, PlotPoints::from(points))
        .allow_hover(false)
        .allow_band(false)
}

/// A point: a disk where its value is set by hand, else a diamond.
fn mark(plot: &mut PlotUi<'_>, place: [f64; 2], direct: bool, chosen: bool, colour: egui::Color32) {
    let shape = if direct {
        MarkerShape::Circle
    } else {
        MarkerShape::Diamond
    };
    plot.points(
        Points::new("", PlotPoints::from(vec![place]))
            .shape(shape)
            .radius(RADII[usize::from(chosen)])
            .color(colour)
            .allow_hover(false),
    );
}

/// The point, and its channel, within reach of the pointer; of several that are equally near one of the chosen.
fn nearest(
    pointer: Pos2,
    points: usize,
    selected: usize,
    on_screen: &impl Fn(usize, usize) -> Pos2,
) -> Option<(usize, usize)> {
    let all = (0..points).flat_map(|at| (0..3).map(move |channel| (at, channel)));
    let reached = all
        .map(|(at, channel)| (on_screen(at, channel).distance(pointer), at, channel))
        .filter(|(distance, ..)| *distance <= REACH);
    let best = reached.min_by(|x, y| {
        let off_selected = |at: usize| at != selected;
        x.0.total_cmp(&y.0)
            .then(off_selected(x.1).cmp(&off_selected(y.1)))
    });
    best.map(|(_, at, channel)| (at, channel))
}

/// Moves a point to a place of the plot, as far as the plot goes; `together` changes all channels in proportion.
fn drag(profile: &mut DepthProfile, quantity: Quantity, grab: Grab, to: PlotPoint, together: bool) {
    let (most, deepest) = grab.ends;
    profile.set_depth(grab.at, rounded(to.y.clamp(0.0, deepest), deepest));
    let value = rounded(to.x.clamp(0.0, most), most);
    let start = quantity.of(&grab.start);
    let before = start[grab.channel];
    let values = std::array::from_fn(|k| match k == grab.channel {
        true => value,
        false if !together => start[k],
        // Three more digits, so that small values stay in proportion.
        false if before > 0.0 => rounded(start[k] * value / before, 1e-3 * most),
        false => value,
    });
    profile.set_values(grab.at, quantity.set(grab.start, values));
}

/// To a thousandth of the power of ten below `largest`: what a drag sets is no longer than what one would write.
fn rounded(value: f64, largest: f64) -> f64 {
    let scale = 10_f64.powf(3.0 - largest.log10().floor());
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Coefficients;

    fn profile() -> DepthProfile {
        let iops = Iops {
            a: [0.3, 0.1, 0.05],
            b: [0.2, 0.4, 0.0],
        };
        DepthProfile::of(&Coefficients::Direct(iops), 8.0)
    }

    #[test]
    fn a_drag_sets_one_channel_or_all_in_proportion_and_stays_in_the_plot() {
        let grab = Grab {
            at: 1,
            channel: 1,
            start: profile()
                .iops(&uw_media::spectral::Response::boxes())
                .expect("numbers")[1],
            ends: (0.5, 10.0),
        };
        let dragged = |channel, to: [f64; 2], together| {
            let mut profile = profile();
            let grab = Grab { channel, ..grab };
            let to = PlotPoint::new(to[0], to[1]);
            drag(&mut profile, Quantity::Scattering, grab, to, together);
            let iops = profile
                .iops(&uw_media::spectral::Response::boxes())
                .expect("numbers")[1];
            assert_eq!(iops.a, grab.start.a);
            (profile.entries()[1].depth_m, iops.b)
        };
        assert_eq!(dragged(1, [0.3, 6.00004], false), (6.0, [0.2, 0.3, 0.0]));
        assert_eq!(dragged(1, [0.2, 6.0], true), (6.0, [0.1, 0.2, 0.0]));
        assert_eq!(dragged(2, [0.2, 6.0], true), (6.0, [0.2, 0.2, 0.2]));
        assert_eq!(dragged(1, [-1.0, -1.0], false), (1e-3, [0.2, 0.0, 0.0]));
        assert_eq!(dragged(1, [9.0, 99.0], false), (10.0, [0.2, 0.5, 0.0]));
    }

    #[test]
    fn of_points_at_one_place_the_chosen_one_is_taken() {
        let on_screen = |at: usize, channel: usize| {
            egui::pos2(10.0 * channel as f32, if at == 0 { 0.0 } else { 50.0 })
        };
        let at = |x, y, selected| nearest(egui::pos2(x, y), 3, selected, &on_screen);
        assert_eq!(at(12.0, 48.0, 0), Some((1, 1)));
        assert_eq!(at(12.0, 48.0, 2), Some((2, 1)));
        assert_eq!(at(2.0, 1.0, 2), Some((0, 0)));
        assert_eq!(at(2.0, 20.0, 2), None);
    }
}
