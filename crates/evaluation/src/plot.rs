//! Line plots of one or more panels, as PNG and SVG.

use std::path::Path;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use uw_render::image::write_frame;

use crate::error::EvalError;

/// Width of a plot and height of a panel, pixels.
const WIDTH_PX: u32 = 1000;
const PANEL_PX: u32 = 330;
/// Width of the legend, pixels.
const LEGEND_PX: u32 = 190;
/// Length of the dashes, and of the gaps, of series beyond the last colour, which begin with the first again, pixels.
const DASH_PX: u32 = 4;
/// Colours of series by their position; told apart by most colour-blind readers (Okabe and Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
    RGBColor(0, 0, 0),
];

/// A line; it is interrupted where y is not finite.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y) by increasing x.
    pub points: Vec<(f64, f64)>,
}

/// A panel of lines that share their axes.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Title.
    pub title: String,
    /// What x is, with its unit.
    pub x: String,
    /// What y is, with its unit.
    pub y: String,
    /// The lines.
    pub series: Vec<Series>,
    /// Whether the axes are logarithmic, x and y.
    pub logarithmic: [bool; 2],
}

/// Writes panels below each other as `stem`.png and `stem`.svg; each file appears whole or not at all.
pub fn write(stem: &Path, panels: &[Panel]) -> Result<(), EvalError> {
    let size = (WIDTH_PX, PANEL_PX * panels.len().max(1) as u32);
    uw_plot::use_font().map_err(|e| EvalError::output(stem, e))?;
    let failed = |e: String| EvalError::output(stem, e);
    let picture = uw_plot::bitmap(size, |area| draw(area, panels)).map_err(failed)?;
    let png = stem.with_extension("png");
    write_frame(&png, &picture).map_err(|e| EvalError::output(&png, e))?;
    let partial = stem.with_extension("partial.svg");
    draw(&SVGBackend::new(&partial, size).into_drawing_area(), panels).map_err(failed)?;
    let svg = stem.with_extension("svg");
    std::fs::rename(&partial, &svg).map_err(|e| EvalError::output(&svg, e))
}

fn draw<B: DrawingBackend>(area: &DrawingArea<B, Shift>, panels: &[Panel]) -> Result<(), String> {
    area.fill(&WHITE).map_err(|e| e.to_string())?;
    for (part, panel) in area
        .split_evenly((panels.len().max(1), 1))
        .iter()
        .zip(panels)
    {
        draw_panel(part, panel)?;
    }
    area.present().map_err(|e| e.to_string())
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
) -> Result<(), String> {
    let [x, y] = [range(panel, 0), range(panel, 1)];
    match panel.logarithmic {
        [false, false] => draw_on(area, panel, x.0..x.1, y.0..y.1),
        [false, true] => draw_on(area, panel, x.0..x.1, (y.0..y.1).log_scale()),
        [true, false] => draw_on(area, panel, (x.0..x.1).log_scale(), y.0..y.1),
        [true, true] => draw_on(area, panel, (x.0..x.1).log_scale(), (y.0..y.1).log_scale()),
    }
}

/// Smallest and largest value of an axis with some air; a linear y starts at 0 where nothing is negative.
fn range(panel: &Panel, axis: usize) -> (f64, f64) {
    let logarithmic = panel.logarithmic[axis];
    let values = panel.series.iter().flat_map(|s| &s.points);
    let values = values.map(|&(x, y)| if axis == 0 { x } else { y });
    let usable = values.filter(|v| v.is_finite() && (!logarithmic || *v > 0.0));
    let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    match (low.is_finite(), logarithmic, axis) {
        (false, ..) => (0.1, 1.0),
        (_, true, _) => (low / 1.2, high * 1.2),
        (_, false, 0) => (low, if high > low { high } else { low + 1.0 }),
        (_, false, _) => (low.min(0.0), if high > 0.0 { 1.1 * high } else { 1.0 }),
    }
}

fn draw_on<B, X, Y>(area: &DrawingArea<B, Shift>, panel: &Panel, x: X, y: Y) -> Result<(), String>
where
    B: DrawingBackend,
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let text = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 20))
        .margin(10)
        .margin_right(LEGEND_PX + 10)
        .x_label_area_size(40)
        .y_label_area_size(65)
        .build_cartesian_2d(x, y)
        .map_err(text)?;
    chart
        .configure_mesh()
        .x_desc(&panel.x)
        .y_desc(&panel.y)
        .label_style(("sans-serif", 14))
        .light_line_style(WHITE)
        .draw()
        .map_err(text)?;
    // The first series last, so that it lies on top.
    for (i, series) in panel.series.iter().enumerate().rev() {
        let style = COLOURS[i % COLOURS.len()].stroke_width(2);
        for points in finite_runs(series, panel.logarithmic) {
            if i < COLOURS.len() {
                chart.draw_series(LineSeries::new(points, style))
            } else {
                chart.draw_series(DashedLineSeries::new(points, DASH_PX, DASH_PX, style))
            }
            .map_err(text)?;
        }
    }
    draw_legend(area, panel).map_err(text)
}

/// Names and colours of the series, right of the plot.
fn draw_legend<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let left = (WIDTH_PX - LEGEND_PX) as i32;
    for (i, series) in panel.series.iter().enumerate() {
        let style = COLOURS[i % COLOURS.len()].stroke_width(2);
        let y = 45 + 20 * i as i32;
        let line = [(left, y), (left + 20, y)];
        if i < COLOURS.len() {
            area.draw(&PathElement::new(line, style))?;
        } else {
            area.draw(&DashedPathElement::new(line, DASH_PX, DASH_PX, style))?;
        }
        let name = (series.name.clone(), (left + 26, y - 7));
        area.draw(&Text::new(name.0, name.1, ("sans-serif", 13).into_font()))?;
    }
    Ok(())
}

/// The stretches of a series that can be drawn.
fn finite_runs(series: &Series, [log_x, log_y]: [bool; 2]) -> Vec<Vec<(f64, f64)>> {
    let can = |v: f64, log: bool| v.is_finite() && (!log || v > 0.0);
    series
        .points
        .split(|&(x, y)| !can(x, log_x) || !can(y, log_y))
        .filter(|run| !run.is_empty())
        .map(<[_]>::to_vec)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_is_written_in_both_formats_and_gaps_are_kept() {
        let folder = tempfile::tempdir().expect("folder");
        let series = Series {
            name: "line".into(),
            points: vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (3.0, 4.0)],
        };
        assert_eq!(finite_runs(&series, [false, false]).len(), 2);
        assert_eq!(finite_runs(&series, [true, false]).len(), 1);
        let panel = |logarithmic| Panel {
            title: "title".into(),
            x: "x, m".into(),
            y: "y, m".into(),
            series: vec![series.clone()],
            logarithmic,
        };
        let stem = folder.path().join("plot");
        write(&stem, &[panel([false, false]), panel([true, true])]).expect("written");
        let names = ["plot.png", "plot.svg"];
        assert!(names.iter().all(|n| folder.path().join(n).is_file()));
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 2);
    }
}
