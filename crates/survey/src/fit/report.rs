//! The report of a fit: plots of what was measured and fitted, and the same as a table.

use std::f64::consts::TAU;
use std::io::Write;
use std::path::Path;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use uw_render::image::{ImageError, write_atomically, write_frame};

use super::{Fit, FittedDepth, FittedPicture};
use uw_plot::{bitmap, use_font};

const SIZE: (u32, u32) = (1680, 960);
const COLOURS: [RGBColor; 3] = [
    RGBColor(200, 40, 40),
    RGBColor(30, 140, 50),
    RGBColor(40, 80, 200),
];
/// Ends of a logarithmic axis are at least this factor apart.
const LEAST_SPAN: f64 = 2.0;
/// Residuals beyond are drawn at the edge, percent.
const MOST_RESIDUAL_PCT: f64 = 30.0;
/// Standard deviations along an ellipse's axis that hold 90 % of a normal distribution of two numbers: (-2 ln 0.1)^½.
const NINETY: f64 = 2.146;
/// Points of an ellipse.
const POINTS: u32 = 90;

/// The report cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {reason}")]
pub struct ReportError {
    /// The file or folder.
    pub path: String,
    /// What went wrong.
    pub reason: String,
}

/// Which number of a picture a panel shows.
type Of = fn(&FittedPicture) -> [[f64; 2]; 3];

/// Writes `fit.png`, `fit.csv` and, where `depths` has any, `depths.csv` into `folder`, which is made where it is missing.
///
/// # Errors
/// They cannot be written.
pub fn report(fit: &Fit, depths: &[FittedDepth], folder: &Path) -> Result<(), ReportError> {
    let failed = |path: &Path, reason: String| ReportError {
        path: path.display().to_string(),
        reason,
    };
    std::fs::create_dir_all(folder).map_err(|e| failed(folder, e.to_string()))?;
    let png = folder.join("fit.png");
    use_font().map_err(|reason| failed(&png, reason))?;
    let picture = bitmap(SIZE, |area| draw(area, fit, depths)).map_err(|e| failed(&png, e))?;
    write_frame(&png, &picture).map_err(|e| failed(&png, e.to_string()))?;
    let write = |name: &str, rows: String| {
        let csv = folder.join(name);
        write_atomically(&csv, |out| {
            out.write_all(rows.as_bytes())
                .map_err(|source| ImageError::System {
                    path: csv.clone(),
                    action: "written",
                    source,
                })
        })
        .map_err(|e| failed(&csv, e.to_string()))
    };
    write("fit.csv", table(fit))?;
    match depths {
        [] => Ok(()),
        _ => write("depths.csv", table_of_depths(depths)),
    }
}

/// Measured and fitted numbers of each picture.
fn table(fit: &Fit) -> String {
    let mut rows = "distance_m,level,channel,mean,mean_fitted,detail,detail_fitted\n".to_owned();
    for picture in &fit.pictures {
        for (k, channel) in ["r", "g", "b"].into_iter().enumerate() {
            let ([mean, fitted], [detail, of_fit]) = (picture.mean[k], picture.deviation[k]);
            rows += &format!(
                "{},{},{channel},{mean:.6},{fitted:.6},{detail:.6},{of_fit:.6}\n",
                picture.distance_m, picture.level
            );
        }
    }
    rows
}

/// Measured and fitted K_z.
fn table_of_depths(depths: &[FittedDepth]) -> String {
    let mut rows = "depth_m,channel,k_z,k_z_fitted\n".to_owned();
    for at in depths {
        for (channel, [seen, fitted]) in ["r", "g", "b"].into_iter().zip(at.k_z) {
            rows += &format!("{},{channel},{seen:.6},{fitted:.6}\n", at.depth_m);
        }
    }
    rows
}

fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    fit: &Fit,
    depths: &[FittedDepth],
) -> Result<(), String> {
    area.fill(&WHITE).map_err(|e| e.to_string())?;
    let panels = area.split_evenly((2, 3));
    let lit = |picture: &&FittedPicture| picture.level > 0.0;
    let dark = |picture: &&FittedPicture| picture.level <= 0.0;
    let lamps: Vec<_> = fit.pictures.iter().filter(lit).collect();
    let daylight: Vec<_> = fit.pictures.iter().filter(dark).collect();
    let mean: Of = |picture| picture.mean;
    let detail: Of = |picture| picture.deviation;
    decay(&panels[0], "Light of the lamps: mean signal", &lamps, mean)?;
    decay(
        &panels[1],
        "Light of the lamps: detail (K_c on)",
        &lamps,
        detail,
    )?;
    let title = match daylight[..] {
        [] => "Lamps off: no pictures",
        _ => "Lamps off: detail (K_c off)",
    };
    decay(&panels[3], title, &daylight, detail)?;
    residuals(&panels[2], &lamps)?;
    illumination(&panels[4], depths)?;
    ellipses(&panels[5], fit)?;
    area.present().map_err(|e| e.to_string())
}

/// Points measured and lines fitted, by distance.
fn decay<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    title: &str,
    pictures: &[&FittedPicture],
    of: Of,
) -> Result<(), String> {
    let text = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
    // Of each picture per unit of its level, so that levels share a curve.
    let value = |picture: &FittedPicture, k: usize, fitted: usize| {
        let level = if picture.level > 0.0 {
            picture.level
        } else {
            1.0
        };
        of(picture)[k][fitted] / level
    };
    let all = pictures
        .iter()
        .flat_map(|p| (0..3).map(move |k| value(p, k, 0)));
    let (low, high) = span(all);
    let farthest = pictures.iter().map(|p| p.distance_m).fold(1.0, f64::max);
    let mut chart = chart(area, title)
        .build_cartesian_2d(0.0..1.05 * farthest, (low..high).log_scale())
        .map_err(text)?;
    chart
        .configure_mesh()
        .x_desc("distance, m")
        .y_desc("linear signal")
        .x_label_formatter(&|x| format!("{x:.1}"))
        .y_label_formatter(&label)
        .label_style(("sans-serif", 13))
        .draw()
        .map_err(text)?;
    for (k, colour) in COLOURS.into_iter().enumerate() {
        let at = |fitted: usize| {
            let known = pictures.iter().filter(move |p| value(p, k, 0) > 0.0);
            known.map(move |p| (p.distance_m, value(p, k, fitted).clamp(low, high)))
        };
        chart
            .draw_series(LineSeries::new(at(1), colour.stroke_width(2)))
            .map_err(text)?;
        chart
            .draw_series(at(0).map(|point| Circle::new(point, 4, colour.filled())))
            .map_err(text)?;
    }
    Ok(())
}

/// By how much the pictures' lamp light is brighter than fitted (dots), and richer in detail (crosses).
fn residuals<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    pictures: &[&FittedPicture],
) -> Result<(), String> {
    let text = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
    let percent = |[seen, fitted]: [f64; 2]| 100.0 * (seen / fitted - 1.0);
    let at = |of: Of, k: usize| {
        let points = pictures
            .iter()
            .map(move |p| (p.distance_m, percent(of(p)[k])));
        points.filter(|(_, value)| value.is_finite())
    };
    let (mean, detail): (Of, Of) = (|picture| picture.mean, |picture| picture.deviation);
    let all = (0..3).flat_map(|k| at(mean, k).chain(at(detail, k)));
    let most = all.fold(1.0, |most: f64, (_, value)| most.max(value.abs()));
    let most = (1.1 * most).min(MOST_RESIDUAL_PCT);
    let farthest = pictures.iter().map(|p| p.distance_m).fold(1.0, f64::max);
    let mut chart = chart(area, "Residuals: mean (dots), detail (crosses)")
        .build_cartesian_2d(0.0..1.05 * farthest, -most..most)
        .map_err(text)?;
    axes(&mut chart, "distance, m", "seen over fitted, %")?;
    for (k, colour) in COLOURS.into_iter().enumerate() {
        let inside = |(d, value): (f64, f64)| (d, value.clamp(-most, most));
        let means = at(mean, k).map(inside);
        chart
            .draw_series(means.map(|point| Circle::new(point, 4, colour.filled())))
            .map_err(text)?;
        let details = at(detail, k).map(inside);
        chart
            .draw_series(details.map(|point| Cross::new(point, 4, colour.stroke_width(2))))
            .map_err(text)?;
    }
    Ok(())
}

/// K_z measured (points) and in the fitted water (lines), by depth.
fn illumination<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    depths: &[FittedDepth],
) -> Result<(), String> {
    let text = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
    let title = match depths {
        [] => "K_z: no pictures that look up",
        _ => "Looking up: K_z, not fitted to",
    };
    let deepest = depths.iter().map(|at| at.depth_m).fold(1.0, f64::max);
    let values = depths.iter().flat_map(|at| at.k_z).flatten();
    let most = values.fold(1.0, f64::max);
    let mut chart = chart(area, title)
        .build_cartesian_2d(0.0..1.05 * deepest, 0.0..1.05 * most)
        .map_err(text)?;
    axes(&mut chart, "depth, m", "mean counts over the shallowest")?;
    for (k, colour) in COLOURS.into_iter().enumerate() {
        let at = |fitted: usize| depths.iter().map(move |at| (at.depth_m, at.k_z[k][fitted]));
        chart
            .draw_series(LineSeries::new(at(1), colour.stroke_width(2)))
            .map_err(text)?;
        chart
            .draw_series(at(0).map(|point| Circle::new(point, 4, colour.filled())))
            .map_err(text)?;
    }
    Ok(())
}

/// Draws axes with their names and numbers of one decimal.
fn axes<B: DrawingBackend>(
    chart: &mut ChartContext<'_, B, Cartesian2d<RangedCoordf64, RangedCoordf64>>,
    x: &str,
    y: &str,
) -> Result<(), String> {
    chart
        .configure_mesh()
        .x_desc(x)
        .y_desc(y)
        .x_label_formatter(&|x| format!("{x:.1}"))
        .y_label_formatter(&|y| format!("{y:.1}"))
        .label_style(("sans-serif", 13))
        .draw()
        .map_err(|e| e.to_string())
}

/// A panel before its axes.
fn chart<'a, 'b, B: DrawingBackend>(
    area: &'a DrawingArea<B, Shift>,
    title: &str,
) -> ChartBuilder<'a, 'b, B> {
    let mut chart = ChartBuilder::on(area);
    chart
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(70);
    chart
}

/// A number to two digits, as an axis shows it.
fn label(value: &f64) -> String {
    let digits = (1.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Ends of a logarithmic axis around some values.
fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|v| *v > 0.0)
        .fold((f64::MAX, 0f64), |(low, high), v: f64| {
            (low.min(v), high.max(v))
        });
    match high > 0.0 {
        true => (0.8 * low, (1.25 * high).max(LEAST_SPAN * low)),
        false => (0.1, 1.0),
    }
}

/// Absorption and scattering of each channel with the ellipse that holds them with 90 %.
fn ellipses<B: DrawingBackend>(area: &DrawingArea<B, Shift>, fit: &Fit) -> Result<(), String> {
    let text = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
    let curves = [0, 1, 2].map(|k| ellipse(fit, k));
    let all = || curves.iter().flatten();
    let most = |of: fn(&(f64, f64)) -> f64| 1.05 * all().map(of).fold(0.0, f64::max);
    let (a_most, b_most) = (most(|point| point.0), most(|point| point.1));
    let mut chart = chart(area, "Absorption and scattering, 90 %")
        .build_cartesian_2d(0.0..a_most, 0.0..b_most)
        .map_err(text)?;
    chart
        .configure_mesh()
        .x_desc("a, 1/m")
        .y_desc("b, 1/m")
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .label_style(("sans-serif", 13))
        .draw()
        .map_err(text)?;
    for (k, (curve, colour)) in curves.iter().zip(COLOURS).enumerate() {
        chart
            .draw_series(LineSeries::new(
                curve.iter().copied(),
                colour.stroke_width(2),
            ))
            .map_err(text)?;
        let middle = (fit.a_per_m[k].value, fit.b_per_m[k].value);
        chart
            .draw_series([Circle::new(middle, 4, colour.filled())])
            .map_err(text)?;
    }
    Ok(())
}

/// The ellipse of a channel: normal in the logarithms.
fn ellipse(fit: &Fit, k: usize) -> Vec<(f64, f64)> {
    let (a, b) = (&fit.a_per_m[k], &fit.b_per_m[k]);
    let correlation = fit.correlation[k][3 + k].clamp(-1.0, 1.0);
    let apart = (1.0 - correlation * correlation).sqrt();
    (0..=POINTS)
        .map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(POINTS)).sin_cos();
            let of_a = NINETY * a.relative_error * cos;
            let of_b = NINETY * b.relative_error * (correlation * cos + apart * sin);
            (a.value * of_a.exp(), b.value * of_b.exp())
        })
        .collect()
}
