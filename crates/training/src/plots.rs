//! Stage 7: the learning curve, and predicted against true contrast.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use crate::columns::OUTPUTS;
use crate::train::Epoch;
use crate::{Error, Table, Trained};

const SIZE: (u32, u32) = (900, 600);
const CHANNELS: [(&str, RGBColor); OUTPUTS] = [
    ("red", RGBColor(200, 40, 40)),
    ("green", RGBColor(30, 140, 60)),
    ("blue", RGBColor(40, 80, 190)),
];
/// Most points of the scatter plot.
const MOST_POINTS: usize = 4000;

/// Writes the learning curve as PNG: mean absolute error per epoch, training and test rows.
///
/// # Errors
/// When the folder or the disk refuses.
pub fn learning_curve(path: &Path, curve: &[Epoch]) -> Result<(), Error> {
    draw(path, |area| {
        let errors = |e: &Epoch| [e.train_mae_counts, e.test_mae_counts];
        let all = || curve.iter().flat_map(errors);
        let (low, high) = (all().fold(f64::MAX, f64::min), all().fold(0.0, f64::max));
        let last = curve.len().max(2) as f64;
        let mut chart = ChartBuilder::on(area)
            .caption("Learning curve", ("sans-serif", 24))
            .margin(15)
            .x_label_area_size(45)
            .y_label_area_size(70)
            .build_cartesian_2d(
                1.0..last,
                (0.8 * low.max(1e-6)..1.25 * high.max(2e-6)).log_scale(),
            )
            .map_err(text)?;
        chart
            .configure_mesh()
            .x_desc("epoch")
            .y_desc("mean absolute error, 8-bit counts")
            .label_style(("sans-serif", 15))
            .draw()
            .map_err(text)?;
        let series = [
            ("training rows", RGBColor(120, 120, 120)),
            ("test rows", RGBColor(30, 110, 180)),
        ];
        for (k, (name, colour)) in series.into_iter().enumerate() {
            let points = curve.iter().map(|e| (e.epoch as f64, errors(e)[k]));
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))
                .map_err(text)?
                .label(name)
                .legend(move |(x, y)| {
                    Rectangle::new([(x, y - 5), (x + 12, y + 5)], colour.filled())
                });
        }
        legend(&mut chart)
    })
}

/// Writes predicted against true contrast of the test rows as PNG.
///
/// # Errors
/// When the folder or the disk refuses.
pub fn predicted_against_true(path: &Path, table: &Table, trained: &Trained) -> Result<(), Error> {
    draw(path, |area| {
        let test = &trained.split.test;
        let step = (test.len() / MOST_POINTS).max(1);
        let pairs: Vec<([f32; OUTPUTS], [f32; OUTPUTS])> = test
            .iter()
            .zip(&trained.test_predictions)
            .step_by(step)
            .map(|(&row, predicted)| (table.contrast[row], *predicted))
            .collect();
        let highest = pairs
            .iter()
            .flat_map(|(t, p)| t.iter().chain(p))
            .copied()
            .fold(1.0, f32::max);
        let top = 1.05 * f64::from(highest);
        let mut chart = ChartBuilder::on(area)
            .caption("Contrast of test rows", ("sans-serif", 24))
            .margin(15)
            .x_label_area_size(45)
            .y_label_area_size(70)
            .build_cartesian_2d(0.0..top, 0.0..top)
            .map_err(text)?;
        chart
            .configure_mesh()
            .x_desc("true, 8-bit counts")
            .y_desc("predicted, 8-bit counts")
            .label_style(("sans-serif", 15))
            .draw()
            .map_err(text)?;
        chart
            .draw_series(LineSeries::new([(0.0, 0.0), (top, top)], BLACK.mix(0.4)))
            .map_err(text)?;
        for (k, (name, colour)) in CHANNELS.into_iter().enumerate() {
            let points = pairs
                .iter()
                .map(|(t, p)| (f64::from(t[k]), f64::from(p[k])));
            chart
                .draw_series(points.map(|at| Circle::new(at, 1, colour.mix(0.5).filled())))
                .map_err(text)?
                .label(name)
                .legend(move |(x, y)| {
                    Rectangle::new([(x, y - 5), (x + 12, y + 5)], colour.filled())
                });
        }
        legend(&mut chart)
    })
}

type Area<'a> = DrawingArea<BitMapBackend<'a>, plotters::coord::Shift>;

/// Draws a picture beside `path` and renames it into place.
fn draw(path: &Path, draw: impl FnOnce(&Area<'_>) -> Result<(), String>) -> Result<(), Error> {
    let failed = |reason: String| Error::Write {
        path: path.to_path_buf(),
        source: std::io::Error::other(reason),
    };
    register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular())
        .map_err(|_| failed("the embedded font cannot be read".to_owned()))?;
    let mut name = std::ffi::OsString::from(format!("part-{}-", std::process::id()));
    name.push(path.file_name().unwrap_or_default());
    let unfinished = path.with_file_name(name);
    let drawn = {
        let area = BitMapBackend::new(&unfinished, SIZE).into_drawing_area();
        area.fill(&WHITE)
            .map_err(text)
            .and_then(|()| draw(&area))
            .and_then(|()| area.present().map_err(text))
    };
    let renamed =
        drawn.and_then(|()| std::fs::rename(&unfinished, path).map_err(|e| e.to_string()));
    renamed.map_err(|reason| {
        // The file may not exist; the first error is the one to tell.
        let _ = std::fs::remove_file(&unfinished);
        failed(reason)
    })
}

fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}

fn legend<'a, B: DrawingBackend + 'a, X: Ranged, Y: Ranged>(
    chart: &mut ChartContext<'a, B, Cartesian2d<X, Y>>,
) -> Result<(), String> {
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.9))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 15))
        .draw()
        .map_err(text)
}
