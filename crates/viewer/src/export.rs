//! The plots as an SVG file.

use std::fmt::Write as _;
use std::path::Path;

use uw_render::image::{ImageError, write_atomically};

use crate::guidance::{Guidance, answer::MAP_SIZE};
use crate::model::{Coefficients, FalseColour, Settings, water::spectrum_at};
use crate::ui::{phase_plot, plots};

/// Size of a plot, pixels.
const SIZE: (f64, f64) = (420.0, 280.0);
/// Room for the labels, pixels: left, top, right, bottom.
const MARGIN: [f64; 4] = [60.0, 30.0, 15.0, 45.0];
/// Marks along an axis.
const MARKS: u32 = 5;

/// A curve of a plot.
struct Curve {
    name: String,
    colour: &'static str,
    dashed: bool,
    points: Vec<[f64; 2]>,
}

/// A plot.
struct Panel {
    title: String,
    x_label: &'static str,
    y_label: &'static str,
    /// Axes hold decimal logarithms.
    logarithmic: bool,
    curves: Vec<Curve>,
    background: String,
    bounds: Option<[[f64; 2]; 2]>,
}

/// Colours of the channels.
const CHANNELS: [(&str, &str); 3] = [("R", "#c83228"), ("G", "#1e8c3c"), ("B", "#285ac8")];

/// Writes spectra, phase function and, where they are there, the profile and the objective to `path`.
///
/// # Errors
/// There is nothing to plot, or the file cannot be written.
pub fn plots(settings: &Settings, guidance: &Guidance, path: &Path) -> Result<(), String> {
    let mut panels = Vec::new();
    if let Some(water) = &settings.water {
        if let Coefficients::Jerlov { place, .. } = water.coefficients {
            panels.push(spectra(place));
        }
        if let Ok(phase) = water.phase.phase() {
            panels.push(phase_panel(water.phase.name(), phase_plot::curve(&phase)));
        }
    }
    if let Some(profile) = &guidance.profile {
        panels.extend(profile_panels(profile));
    }
    panels.extend(guidance.answer.as_ref().and_then(objective));
    if panels.is_empty() {
        return Err("there is nothing to plot: no water, no profile".to_owned());
    }
    let text = svg(&panels);
    write_atomically(path, |file| {
        use std::io::Write;
        file.write_all(text.as_bytes())
            .map_err(|source| ImageError::System {
                path: path.to_path_buf(),
                action: "written",
                source,
            })
    })
    .map_err(|e| e.to_string())
}

fn curve(name: &str, colour: &'static str, points: Vec<[f64; 2]>) -> Curve {
    Curve {
        name: name.to_owned(),
        colour,
        dashed: false,
        points,
    }
}

fn panel(title: String, x_label: &'static str, y_label: &'static str, curves: Vec<Curve>) -> Panel {
    Panel {
        title,
        x_label,
        y_label,
        logarithmic: false,
        curves,
        background: String::new(),
        bounds: None,
    }
}

fn spectra(place: f64) -> Panel {
    let rows = spectrum_at(place);
    let curves = vec![
        curve("a", "#000000", rows.iter().map(|r| [r.0, r.1]).collect()),
        curve("b", "#e0a020", rows.iter().map(|r| [r.0, r.2]).collect()),
    ];
    let title = format!("Jerlov {}", crate::model::water::place_name(place));
    panel(title, "wavelength, nm", "1/m", curves)
}

fn phase_panel(name: &str, points: Vec<[f64; 2]>) -> Panel {
    let petzold = Curve {
        dashed: true,
        ..curve("Petzold", "#e0a020", phase_plot::petzold().to_vec())
    };
    let curves = vec![petzold, curve(name, "#000000", points)];
    Panel {
        logarithmic: true,
        ..panel(
            "Phase function".to_owned(),
            "scattering angle, degrees",
            "1/sr",
            curves,
        )
    }
}

fn profile_panels(profile: &uw_calib::Profile) -> [Panel; 3] {
    let [depth, on, off] = plots::curves(profile);
    let of = |samples: plots::Curve| {
        CHANNELS
            .into_iter()
            .enumerate()
            .map(|(k, (name, colour))| {
                curve(
                    name,
                    colour,
                    samples.iter().map(|(x, y)| [*x, y[k]]).collect(),
                )
            })
            .collect::<Vec<_>>()
    };
    [
        panel(
            "K_z".to_owned(),
            "depth, m",
            "share of the light",
            of(depth),
        ),
        panel("K_c, lamps on".to_owned(), "distance, m", "counts", of(on)),
        panel(
            "K_c, lamps off".to_owned(),
            "distance, m",
            "counts",
            of(off),
        ),
    ]
}

/// The objective as coloured squares with the suggestion.
fn objective(answer: &crate::guidance::answer::Answer) -> Option<Panel> {
    let map = answer.map.as_ref()?;
    let (columns, rows) = MAP_SIZE;
    let (low, high) = map.range();
    let [left, top, right, bottom] = MARGIN;
    let cell = (
        (SIZE.0 - left - right) / columns as f64,
        (SIZE.1 - top - bottom) / rows as f64,
    );
    let mut background = String::new();
    for (i, score) in map.scores.iter().enumerate() {
        let colour = FalseColour::Viridis.colour(((score - low) / (high - low)) as f32);
        let x = left + cell.0 * (i % columns) as f64;
        let y = SIZE.1 - bottom - cell.1 * (i / columns + 1) as f64;
        // Writing to a string cannot fail; so throughout.
        let _ = write!(
            background,
            "<rect x='{x:.2}' y='{y:.2}' width='{:.2}' height='{:.2}' fill='#{:02x}{:02x}{:02x}'/>",
            cell.0 + 0.3,
            cell.1 + 0.3,
            colour.r(),
            colour.g(),
            colour.b()
        );
    }
    let way = curve("search", "#ff50a0", answer.ascent());
    let mut panel = panel("Objective".to_owned(), "distance, m", "lamp, %", vec![way]);
    panel.background = background;
    panel.bounds = Some([map.distance_m, map.light_pct]);
    Some(panel)
}

fn svg(panels: &[Panel]) -> String {
    let height = SIZE.1 * panels.len() as f64;
    let mut text = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='{}' height='{height}' font-family='sans-serif' \
         font-size='11'>\n<rect width='100%' height='100%' fill='white'/>\n",
        SIZE.0
    );
    for (i, panel) in panels.iter().enumerate() {
        let _ = writeln!(text, "<g transform='translate(0 {})'>", SIZE.1 * i as f64);
        draw(&mut text, panel);
        text.push_str("</g>\n");
    }
    text.push_str("</svg>\n");
    text
}

/// Smallest and largest values along both axes; never the same.
fn bounds(panel: &Panel) -> [[f64; 2]; 2] {
    if let Some(bounds) = panel.bounds {
        return bounds;
    }
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for point in panel.curves.iter().flat_map(|c| &c.points) {
        for (bound, value) in bounds.iter_mut().zip(point) {
            *bound = [bound[0].min(*value), bound[1].max(*value)];
        }
    }
    if !panel.logarithmic {
        bounds[1][0] = bounds[1][0].min(0.0);
    }
    bounds.map(|[low, high]| {
        if low < high {
            [low, high]
        } else {
            [low - 0.5, low + 0.5]
        }
    })
}

fn draw(text: &mut String, panel: &Panel) {
    let [left, top, right, bottom] = MARGIN;
    let (x_end, y_end) = (SIZE.0 - right, SIZE.1 - bottom);
    let [xs, ys] = bounds(panel);
    let x_of = |x: f64| left + (x - xs[0]) / (xs[1] - xs[0]) * (x_end - left);
    let y_of = |y: f64| y_end - (y - ys[0]) / (ys[1] - ys[0]) * (y_end - top);
    let number = |value: f64| match panel.logarithmic {
        true => format!("{:.3e}", 10_f64.powf(value)),
        false => format!("{:.4}", value)
            .trim_end_matches('0')
            .trim_end_matches('.')
            .to_owned(),
    };
    text.push_str(&panel.background);
    let _ = writeln!(
        text,
        "<text x='{left}' y='18' font-size='13'>{}</text>\n<rect x='{left}' y='{top}' width='{}' height='{}' fill='none' stroke='black'/>",
        panel.title,
        x_end - left,
        y_end - top
    );
    for i in 0..=MARKS {
        let t = f64::from(i) / f64::from(MARKS);
        let (x, y) = (xs[0] + t * (xs[1] - xs[0]), ys[0] + t * (ys[1] - ys[0]));
        let _ = write!(
            text,
            "<text x='{:.1}' y='{:.1}' text-anchor='middle'>{}</text><text x='{:.1}' y='{:.1}' text-anchor='end'>{}</text>",
            x_of(x),
            y_end + 15.0,
            number(x),
            left - 5.0,
            y_of(y) + 4.0,
            number(y)
        );
    }
    let _ = writeln!(
        text,
        "<text x='{:.1}' y='{:.1}' text-anchor='middle'>{}</text><text x='{left}' y='{:.1}' text-anchor='end'>{}</text>",
        0.5 * (left + x_end),
        y_end + 33.0,
        panel.x_label,
        top - 8.0,
        panel.y_label
    );
    for (i, curve) in panel.curves.iter().enumerate() {
        let points: Vec<_> = curve
            .points
            .iter()
            .map(|[x, y]| format!("{:.2},{:.2}", x_of(*x), y_of(*y)))
            .collect();
        let dash = if curve.dashed {
            " stroke-dasharray='6 4'"
        } else {
            ""
        };
        let _ = writeln!(
            text,
            "<polyline points='{}' fill='none' stroke='{}' stroke-width='1.8'{dash}/>\
             <text x='{:.1}' y='{:.1}' text-anchor='end' fill='{}'>{}</text>",
            points.join(" "),
            curve.colour,
            x_end - 6.0,
            top + 15.0 + 14.0 * i as f64,
            curve.colour,
            curve.name
        );
    }
}
