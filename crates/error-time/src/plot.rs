//! Error against processor time in log-log: a line per scene and backend, other renderers' points beside them.

use std::ops::Range;
use std::path::{Path, PathBuf};

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use uw_render::image::write_frame;

use super::curve::Curve;
use super::peers::PeerPoint;
use uw_plot::{bitmap, use_font};

const SIZE: (u32, u32) = (1100, 640);
/// Width of the chart; the legend stands to its right.
const CHART_WIDTH: u32 = 830;
const FONT: &str = "sans-serif";
/// Relative mean squared errors with a line of their own, and the relative errors that they stand for.
const LEVELS: [(f64, &str); 3] = [(1e-2, "10 %"), (1e-3, "3 %"), (1e-4, "1 %")];
const COLOURS: [RGBColor; 8] = [
    RGBColor(31, 119, 180),
    RGBColor(214, 90, 20),
    RGBColor(44, 140, 60),
    RGBColor(190, 40, 60),
    RGBColor(120, 80, 180),
    RGBColor(130, 90, 60),
    RGBColor(200, 90, 170),
    RGBColor(20, 150, 160),
];
/// Widths of lines and radii of marks, px, of a scene's backends in their order; the last for all others.
const WEIGHTS: [(u32, i32); 3] = [(3, 5), (1, 4), (1, 2)];
const GREY: RGBColor = RGBColor(110, 110, 110);

/// Marks of other renderers, one after the other.
#[derive(Clone, Copy)]
enum Mark {
    Cross,
    Triangle,
    Ring,
}

const MARKS: [Mark; 3] = [Mark::Cross, Mark::Triangle, Mark::Ring];

/// Points of one other renderer on one scene, by time.
struct PeerCurve<'a> {
    scene: &'a str,
    mark: Mark,
    points: Vec<(f64, f64)>,
}

/// Writes the plot as PNG and as SVG; an error comes with the file it concerns.
pub(super) fn write(
    png: &Path,
    svg: &Path,
    curves: &[Curve],
    peers: &[PeerPoint],
) -> Result<(), (PathBuf, String)> {
    let at = |path: &Path| {
        let path = path.to_path_buf();
        move |reason: String| (path, reason)
    };
    use_font().map_err(at(png))?;
    let picture = bitmap(SIZE, |area| draw(area, curves, peers)).map_err(at(png))?;
    write_frame(png, &picture).map_err(|e| at(png)(e.to_string()))?;
    draw(
        &SVGBackend::new(svg, SIZE).into_drawing_area(),
        curves,
        peers,
    )
    .map_err(at(svg))
}

fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    curves: &[Curve],
    peers: &[PeerPoint],
) -> Result<(), String> {
    area.fill(&WHITE).map_err(text)?;
    let renderers = renderers(peers);
    let others = peer_curves(curves, peers, &renderers);
    let (chart, legend) = area.split_horizontally(CHART_WIDTH);
    draw_chart(&chart, curves, &others)?;
    draw_legend(&legend, curves, &renderers)?;
    area.present().map_err(text)
}

fn text<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> String {
    error.to_string()
}

/// Names of the other renderers in the order in which they appear.
fn renderers(peers: &[PeerPoint]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for peer in peers {
        if !names.contains(&peer.renderer.as_str()) {
            names.push(&peer.renderer);
        }
    }
    names
}

/// The other renderers' points on the scenes that have a curve.
fn peer_curves<'a>(
    curves: &'a [Curve],
    peers: &[PeerPoint],
    renderers: &[&str],
) -> Vec<PeerCurve<'a>> {
    let mut found = Vec::new();
    for scene in scenes(curves) {
        for (index, renderer) in renderers.iter().enumerate() {
            let mut points: Vec<(f64, f64)> = peers
                .iter()
                .filter(|p| p.scene == scene && p.renderer == *renderer)
                .map(|p| (p.cpu_s, p.rel_mse))
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mark = MARKS[index % MARKS.len()];
            found.push(PeerCurve {
                scene,
                mark,
                points,
            });
        }
    }
    found
}

/// Names of the scenes, each once.
fn scenes(curves: &[Curve]) -> Vec<&str> {
    let mut names: Vec<&str> = curves.iter().map(|c| c.scene.as_str()).collect();
    names.dedup();
    names
}

/// The colour of a scene.
fn colour(curves: &[Curve], scene: &str) -> RGBColor {
    let index = scenes(curves).iter().position(|name| *name == scene);
    index.map_or(GREY, |index| COLOURS[index % COLOURS.len()])
}

/// Line width and mark radius of `curve`, which tell the backends of one scene apart.
fn weight(curves: &[Curve], curve: &Curve) -> (u32, i32) {
    let of_scene = curves.iter().filter(|c| c.scene == curve.scene);
    let before = of_scene.take_while(|c| c.backend != curve.backend).count();
    WEIGHTS[before.min(WEIGHTS.len() - 1)]
}

/// What of a curve a logarithmic plot can show.
fn points(curve: &Curve) -> Vec<(f64, f64)> {
    curve
        .rungs
        .iter()
        .map(|r| (r.cpu_s, r.rel_mse))
        .filter(|(x, y)| *x > 0.0 && *y > 0.0 && y.is_finite())
        .collect()
}

/// The whole decades around all values; `otherwise` when there are none.
fn decades(values: impl Iterator<Item = f64>, otherwise: Range<f64>) -> Range<f64> {
    let (lowest, highest) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if lowest > highest {
        return otherwise;
    }
    let (from, to) = (lowest.log10().floor(), highest.log10().ceil());
    10f64.powf(from)..10f64.powf(to.max(from + 1.0))
}

fn draw_chart<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    curves: &[Curve],
    others: &[PeerCurve],
) -> Result<(), String> {
    let own = curves.iter().map(points);
    let all: Vec<(f64, f64)> = own
        .chain(others.iter().map(|o| o.points.clone()))
        .flatten()
        .collect();
    let x = decades(all.iter().map(|p| p.0), 1e-1..1e1);
    let y = decades(all.iter().map(|p| p.1), 1e-4..1.0);
    let mut chart = ChartBuilder::on(area)
        .caption("Error against time", (FONT, 22))
        .margin(15)
        .x_label_area_size(45)
        .y_label_area_size(70)
        .build_cartesian_2d(x.clone().log_scale(), y.clone().log_scale())
        .map_err(text)?;
    let label = |value: &f64| format!("{value:e}");
    chart
        .configure_mesh()
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(215, 215, 215))
        .x_desc("processor time without start-up, s")
        .y_desc("relative mean squared error")
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .label_style((FONT, 14))
        .draw()
        .map_err(text)?;
    let levels = LEVELS.into_iter().filter(|(level, _)| y.contains(level));
    for (level, name) in levels {
        let line = [(x.start, level), (x.end, level)];
        let dashes = DashedLineSeries::new(line, 4, 4, GREY.stroke_width(1));
        chart.draw_series(dashes).map_err(text)?;
        let style = (FONT, 13).into_font().color(&GREY);
        let style = style.pos(Pos::new(HPos::Left, VPos::Bottom));
        let label = Text::new(name, (1.1 * x.start, 1.05 * level), style);
        chart.draw_series([label]).map_err(text)?;
    }
    for curve in curves {
        let colour = colour(curves, &curve.scene);
        let (width, radius) = weight(curves, curve);
        let points = points(curve);
        let line = LineSeries::new(points.clone(), colour.stroke_width(width));
        chart.draw_series(line).map_err(text)?;
        let marks = points
            .into_iter()
            .map(|p| Circle::new(p, radius, colour.filled()));
        chart.draw_series(marks).map_err(text)?;
    }
    for other in others {
        let colour = colour(curves, other.scene);
        let line = DashedLineSeries::new(other.points.clone(), 2, 3, colour.stroke_width(1));
        chart.draw_series(line).map_err(text)?;
        let points = other.points.iter().copied();
        let (line, filled) = (colour.stroke_width(2), colour.filled());
        match other.mark {
            Mark::Cross => chart.draw_series(points.map(|p| Cross::new(p, 5, line))),
            Mark::Triangle => chart.draw_series(points.map(|p| TriangleMarker::new(p, 6, filled))),
            Mark::Ring => chart.draw_series(points.map(|p| Circle::new(p, 5, line))),
        }
        .map_err(text)?;
    }
    Ok(())
}

fn draw_legend<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    curves: &[Curve],
    renderers: &[&str],
) -> Result<(), String> {
    const LINE: i32 = 24;
    let write = |name: &str, y: i32| {
        let style = (FONT, 14).into_font().color(&BLACK);
        area.draw(&Text::new(name.to_owned(), (40, y - 7), style))
            .map_err(text)
    };
    let mut y = 70;
    for curve in curves {
        let colour = colour(curves, &curve.scene);
        let (width, radius) = weight(curves, curve);
        let line = PathElement::new([(5, y), (31, y)], colour.stroke_width(width));
        area.draw(&line).map_err(text)?;
        area.draw(&Circle::new((18, y), radius, colour.filled()))
            .map_err(text)?;
        write(&format!("{} ({})", curve.scene, curve.backend), y)?;
        y += LINE;
    }
    for (index, renderer) in renderers.iter().enumerate() {
        let (centre, line) = ((18, y), GREY.stroke_width(2));
        match MARKS[index % MARKS.len()] {
            Mark::Cross => area.draw(&Cross::new(centre, 5, line)),
            Mark::Triangle => area.draw(&TriangleMarker::new(centre, 6, GREY.filled())),
            Mark::Ring => area.draw(&Circle::new(centre, 5, line)),
        }
        .map_err(text)?;
        write(renderer, y)?;
        y += LINE;
    }
    Ok(())
}
