//! Absorption and scattering against wavelength, with the response of the channels, or with their intervals, whose ends can
//! be dragged.

use egui::{Color32, Ui};
use egui_plot::{Line, Plot, PlotPoint, PlotPoints, PlotUi, Span};
use uw_media::{Bands, Interval, spectral::Response};

use super::knobs::{still_plot, x_axis, y_axis};
use super::theme::{CHANNELS, channel_colours};

/// Wavelengths of the tables, nm.
const RANGE_NM: (f64, f64) = (300.0, 700.0);
/// Colour of the curve of b.
const SCATTERING: Color32 = Color32::from_rgb(230, 160, 40);
/// Narrowest interval that a drag makes, nm.
const NARROWEST_NM: f64 = 5.0;
/// Height of the plot, points.
const HEIGHT: f32 = 150.0;
/// How near the pointer must be to an end to take it, points on the screen.
const REACH: f32 = 8.0;

/// The intervals that `bands` averages over; those of the plain mean where it has none.
pub fn intervals(bands: &Bands) -> [Interval; 3] {
    match bands {
        Bands::Intervals(intervals) => *intervals,
        _ => [(600.0, 700.0), (500.0, 600.0), (400.0, 500.0)]
            .map(|(from_nm, to_nm)| Interval { from_nm, to_nm }),
    }
}

/// An end of an interval: its channel, and whether it is the upper one.
type IntervalEnd = (usize, bool);

/// Wavelength, nm, and a and b, 1/m.
type Rows = [(f64, f64, f64)];

fn plot() -> Plot<'static> {
    still_plot("spectra", HEIGHT)
        .include_x(RANGE_NM.0)
        .include_x(RANGE_NM.1)
        .include_y(0.0)
        .set_margin_fraction(egui::vec2(0.035, 0.08))
        .custom_x_axes(vec![x_axis("wavelength, nm")])
        .custom_y_axes(vec![y_axis("1/m")])
}

fn coefficients(plot: &mut PlotUi<'_>, rows: &Rows, ink: Color32) {
    let mut line = |name: &str, of: fn(&(f64, f64, f64)) -> f64, colour: Color32| {
        let points: Vec<_> = rows.iter().map(|row| [row.0, of(row)]).collect();
        let line = Line::new(name, PlotPoints::new(points));
        plot.line(line.color(colour).width(2.0));
    };
    line("absorption a", |row| row.1, ink);
    line("scattering b", |row| row.2, SCATTERING);
}

fn caption(ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.colored_label(ui.visuals().text_color(), "— absorption a");
        ui.colored_label(SCATTERING, "— scattering b");
    });
}

/// Draws what a camera's channels respond to, the highest response as high as `most`.
pub fn responses(plot: &mut PlotUi<'_>, response: &Response, colours: [Color32; 3], most: f64) {
    let nodes = || response.channels.iter().flat_map(|curve| curve.nodes());
    let highest = nodes().fold(0.0_f64, |most, node| most.max(node.1));
    for ((curve, colour), name) in response.channels.iter().zip(colours).zip(CHANNELS) {
        let scaled = |&(nm, value): &(f64, f64)| [nm, value / highest * most];
        let points: Vec<_> = curve.nodes().iter().map(scaled).collect();
        // The edges of a box lie in one column of pixels each, which the plot would take for a band and fill.
        let line = Line::new(name, PlotPoints::new(points)).allow_band(false);
        plot.line(line.color(colour));
    }
}

/// Shows the plot with what the camera's channels respond to, the highest response as high as the highest coefficient.
pub fn with_response(ui: &mut Ui, rows: &Rows, response: &Response) {
    let colours = channel_colours(ui);
    let ink = ui.visuals().text_color();
    let most = rows
        .iter()
        .fold(0.0_f64, |most, row| most.max(row.1).max(row.2));
    plot().show(ui, |plot| {
        responses(plot, response, colours, most);
        coefficients(plot, rows, ink);
    });
    caption(ui);
    ui.weak(format!("coloured: response of {}", response.name));
}

/// Shows the plot with the intervals of `bands`; drags of their ends change it.
pub fn with_intervals(ui: &mut Ui, rows: &Rows, bands: &mut Bands) {
    let mut spans = intervals(bands);
    let shaded = matches!(
        bands,
        Bands::Mean | Bands::Measured | Bands::PaperPrinted | Bands::Intervals(_)
    );
    let colours = channel_colours(ui);
    let ink = ui.visuals().text_color();
    let taken_id = ui.scope_id().with("taken end");
    let taken: Option<IntervalEnd> = ui.data(|d| d.get_temp(taken_id)).flatten();
    let shown = plot().show(ui, |plot| {
        if shaded {
            for ((span, colour), name) in spans.iter().zip(colours).zip(CHANNELS) {
                plot.span(
                    Span::new(name, span.from_nm..=span.to_nm)
                        .fill(colour.gamma_multiply(0.22))
                        .border_color(colour)
                        .border_width(2.0),
                );
            }
        }
        coefficients(plot, rows, ink);
    });
    caption(ui);
    if !shaded {
        return;
    }
    let response = shown.response.interact(egui::Sense::drag());
    let x_of = |nm: f64| {
        shown
            .transform
            .position_from_point(&PlotPoint::new(nm, 0.0))
            .x
    };
    let nearest = response
        .interact_pointer_pos()
        .or(response.hover_pos())
        .and_then(|at| nearest_end(&spans, at.x, x_of));
    let mut now = taken;
    if response.drag_started() {
        now = nearest;
    }
    if response.drag_stopped() || !response.dragged() && !response.drag_started() {
        now = None;
    }
    if nearest.is_some() || now.is_some() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
    }
    if let (Some(end), Some(at)) = (now, response.interact_pointer_pos()) {
        let nm = shown.transform.value_from_position(at).x.round();
        set_end(&mut spans, end, nm);
        *bands = Bands::Intervals(spans);
    }
    ui.data_mut(|d| d.insert_temp(taken_id, now));
    response.on_hover_text("Drag the ends of the shaded intervals");
}

/// The end nearest to `x` on the screen, within reach.
fn nearest_end(spans: &[Interval; 3], x: f32, x_of: impl Fn(f64) -> f32) -> Option<IntervalEnd> {
    let mut best = None;
    let mut reach = REACH;
    for (channel, span) in spans.iter().enumerate() {
        for (upper, nm) in [(false, span.from_nm), (true, span.to_nm)] {
            // Where two ends touch, the one on the pointer's own side is meant.
            let inner = if upper {
                x_of(nm) - 1.0
            } else {
                x_of(nm) + 1.0
            };
            let distance = (inner - x).abs();
            if distance < reach {
                reach = distance;
                best = Some((channel, upper));
            }
        }
    }
    best
}

/// Moves an end, within the tables and not beyond the other end.
fn set_end(spans: &mut [Interval; 3], (channel, upper): IntervalEnd, nm: f64) {
    let span = &mut spans[channel];
    if upper {
        span.to_nm = nm.clamp(span.from_nm + NARROWEST_NM, RANGE_NM.1);
    } else {
        span.from_nm = nm.clamp(RANGE_NM.0, span.to_nm - NARROWEST_NM);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_found_and_stay_in_order() {
        let mut spans = intervals(&Bands::Mean);
        let x_of = |nm: f64| nm as f32;
        assert_eq!(nearest_end(&spans, 698.0, x_of), Some((0, true)));
        assert_eq!(nearest_end(&spans, 602.0, x_of), Some((0, false)));
        assert_eq!(nearest_end(&spans, 598.0, x_of), Some((1, true)));
        assert_eq!(nearest_end(&spans, 550.0, x_of), None);
        set_end(&mut spans, (0, false), 900.0);
        assert_eq!(spans[0].from_nm, 695.0);
        set_end(&mut spans, (2, false), 10.0);
        assert_eq!(spans[2].from_nm, 300.0);
        set_end(&mut spans, (1, true), 640.0);
        assert!(
            uw_media::channel_iops(uw_media::WaterType::ALL[2], &Bands::Intervals(spans)).is_ok()
        );
    }
}
