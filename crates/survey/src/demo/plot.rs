//! Contrast before, predicted and rendered after, per depth.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;
use uw_render::image::write_frame;

use super::{DemoError, Visit};
use uw_plot::{bitmap, use_font};

const SIZE: (u32, u32) = (900, 480);
const BARS: [(&str, RGBColor); 3] = [
    ("before", RGBColor(150, 150, 150)),
    ("after, predicted", RGBColor(230, 150, 40)),
    ("after, rendered", RGBColor(30, 110, 180)),
];

/// Writes the plot as PNG and SVG.
pub(super) fn write(png: &Path, svg: &Path, visits: &[Visit]) -> Result<(), DemoError> {
    let failed = |path: &Path, reason: String| DemoError::Output {
        path: path.display().to_string(),
        reason,
    };
    use_font().map_err(|reason| failed(png, reason))?;
    let picture = bitmap(SIZE, |area| draw(area, visits)).map_err(|e| failed(png, e))?;
    write_frame(png, &picture)?;
    draw(&SVGBackend::new(svg, SIZE).into_drawing_area(), visits).map_err(|e| failed(svg, e))
}

fn draw<B: DrawingBackend>(area: &DrawingArea<B, Shift>, visits: &[Visit]) -> Result<(), String> {
    let text = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
    area.fill(&WHITE).map_err(text)?;
    let mean = |c: &[f64; 3]| (c[0] + c[1] + c[2]) / 3.0;
    let values = |v: &Visit| {
        [
            mean(&v.contrast_before),
            mean(&v.suggestion.predicted_contrast),
            mean(&v.contrast_after),
        ]
    };
    let top = visits.iter().flat_map(values).fold(1.0, f64::max) * 1.25;
    let mut chart = ChartBuilder::on(area)
        .caption(
            "Contrast before and after the suggestion",
            ("sans-serif", 22),
        )
        .margin(15)
        .x_label_area_size(45)
        .y_label_area_size(60)
        .build_cartesian_2d(0.0..visits.len() as f64, 0.0..top)
        .map_err(text)?;
    let label = |x: &f64| {
        let visit = (x - 0.5).round();
        let on_centre = (x - 0.5 - visit).abs() < 1e-6;
        visits
            .get(visit.max(0.0) as usize)
            .filter(|_| on_centre)
            .map_or_else(String::new, |v| {
                let s = &v.suggestion;
                format!(
                    "{} m deep: {} m, {} % to {:.2} m, {:.0} %",
                    v.depth_m, v.distance_m, v.light_pct, s.distance_m, s.light_pct
                )
            })
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_labels(2 * visits.len() + 1)
        .x_label_formatter(&label)
        .y_desc("mean contrast, 8-bit counts")
        .label_style(("sans-serif", 14))
        .draw()
        .map_err(text)?;
    for (bar, (name, colour)) in BARS.into_iter().enumerate() {
        let rectangles = visits.iter().enumerate().map(|(i, v)| {
            let left = i as f64 + 0.14 + 0.25 * bar as f64;
            Rectangle::new(
                [(left, 0.0), (left + 0.22, values(v)[bar])],
                colour.filled(),
            )
        });
        chart
            .draw_series(rectangles)
            .map_err(text)?
            .label(name)
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 12, y + 5)], colour.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.9))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 14))
        .draw()
        .map_err(text)?;
    area.present().map_err(text)
}
