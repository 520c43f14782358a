//! Panels drawn below each other.

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use uw_render::image::Frame;

use super::{Curve, Panel};
use crate::guidance::answer::{MAP_SIZE, ScoreMap};
use crate::model::FalseColour;

/// Size of a panel, pixels.
const SIZE: (u32, u32) = (640, 380);
/// Size of captions, and of all other text, pixels.
const CAPTION_PX: u32 = 19;
const TEXT_PX: u32 = 14;

type Chart<'a, B> = ChartContext<'a, B, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Size of all panels together, pixels.
fn size(panels: &[Panel]) -> (u32, u32) {
    (SIZE.0, SIZE.1 * panels.len() as u32)
}

/// The panels as an SVG file's text.
pub fn svg(panels: &[Panel]) -> Result<String, String> {
    let mut text = String::new();
    draw(
        &SVGBackend::with_string(&mut text, size(panels)).into_drawing_area(),
        panels,
    )?;
    Ok(text)
}

/// The panels as pixels.
pub fn bitmap(panels: &[Panel]) -> Result<Frame, String> {
    uw_plot::bitmap(size(panels), |area| draw(area, panels))
}

fn draw<B: DrawingBackend>(area: &DrawingArea<B, Shift>, panels: &[Panel]) -> Result<(), String> {
    uw_plot::use_font()?;
    let text = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
    area.fill(&WHITE).map_err(text)?;
    for (cell, panel) in area.split_evenly((panels.len(), 1)).iter().zip(panels) {
        draw_panel(cell, panel).map_err(text)?;
    }
    area.present().map_err(text)
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let [[left, right], [bottom, top]] = bounds(panel);
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", CAPTION_PX))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(left..right, bottom..top)?;
    let label = |value: &f64| match panel.logarithmic {
        true if (value - value.round()).abs() > 1e-6 => String::new(),
        true => power_of_ten(value.round()),
        false => format!("{}", (value * 1e4).round() / 1e4),
    };
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_labels(9)
        .y_labels(8)
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .x_desc(panel.x_label)
        .y_desc(panel.y_label)
        .label_style(("sans-serif", TEXT_PX))
        .draw()?;
    if let Some(map) = &panel.map {
        draw_map(&mut chart, map)?;
    }
    for curve in &panel.curves {
        draw_curve(&mut chart, curve)?;
    }
    for (name, [x, y], colour) in &panel.marks {
        let dot = |at| {
            EmptyElement::at(at)
                + Circle::new((0, 0), 6, BLACK.filled())
                + Circle::new((0, 0), 5, colour.filled())
        };
        chart
            .draw_series([dot((*x, *y))])?
            .label(*name)
            .legend(|(x, y)| Circle::new((x + 8, y), 5, BLACK.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", TEXT_PX))
        .draw()
}

/// A power of ten as one reads it.
fn power_of_ten(exponent: f64) -> String {
    if (-2.0..=3.0).contains(&exponent) {
        format!("{}", 10_f64.powf(exponent))
    } else {
        format!("1e{exponent}")
    }
}

fn draw_map<B: DrawingBackend>(
    chart: &mut Chart<'_, B>,
    map: &ScoreMap,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let (columns, rows) = MAP_SIZE;
    let (low, high) = map.range();
    let at = |[from, to]: [f64; 2], i: usize, of: usize| from + (to - from) * i as f64 / of as f64;
    let cells = map.scores.iter().enumerate().map(|(i, score)| {
        let (x, y) = (i % columns, i / columns);
        let colour = FalseColour::Viridis.colour(((score - low) / (high - low)) as f32);
        let corner = |dx, dy| {
            (
                at(map.distance_m, x + dx, columns),
                at(map.light_pct, y + dy, rows),
            )
        };
        let style = RGBColor(colour.r(), colour.g(), colour.b()).filled();
        Rectangle::new([corner(0, 0), corner(1, 1)], style)
    });
    chart.draw_series(cells).map(|_| ())
}

fn draw_curve<B: DrawingBackend>(
    chart: &mut Chart<'_, B>,
    curve: &Curve,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let style = curve.colour.stroke_width(2);
    let points = curve.points.iter().map(|[x, y]| (*x, *y));
    let drawn = if curve.dashed {
        chart.draw_series(DashedLineSeries::new(points, 8, 5, style))?
    } else {
        chart.draw_series(LineSeries::new(points, style))?
    };
    drawn
        .label(&curve.name)
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
    Ok(())
}

/// Smallest and largest values along both axes; never the same.
fn bounds(panel: &Panel) -> [[f64; 2]; 2] {
    if let Some(map) = &panel.map {
        return [map.distance_m, map.light_pct];
    }
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for point in panel.curves.iter().flat_map(|c| &c.points) {
        for (bound, value) in bounds.iter_mut().zip(point) {
            *bound = [bound[0].min(*value), bound[1].max(*value)];
        }
    }
    let room = 0.05 * (bounds[1][1] - bounds[1][0]);
    bounds[1][1] += room;
    bounds[1][0] = if panel.logarithmic {
        bounds[1][0] - room
    } else {
        bounds[1][0].min(0.0)
    };
    bounds.map(|[low, high]| {
        if low < high {
            [low, high]
        } else {
            [low - 0.5, low + 0.5]
        }
    })
}
