//! The plots as a file: SVG or PNG.

mod draw;

use std::path::Path;

use plotters::style::RGBColor;
use uw_media::{Iops, spectral::Response};
use uw_render::image::{write_bytes, write_frame};

use crate::guidance::{
    Guidance,
    answer::{Answer, ScoreMap},
};
use crate::model::{Coefficients, DepthProfile, Settings, water::scale_name};
use crate::ui::{phase_plot, plots};

/// A curve of a plot.
struct Curve {
    name: String,
    colour: RGBColor,
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
    /// Scores behind the curves, and the ends of the axes with them.
    map: Option<ScoreMap>,
    /// Single points with their names.
    marks: Vec<(&'static str, [f64; 2], RGBColor)>,
}

/// Colours of the channels.
const CHANNELS: [(&str, RGBColor); 3] = [
    ("R", RGBColor(200, 50, 40)),
    ("G", RGBColor(30, 140, 60)),
    ("B", RGBColor(40, 90, 200)),
];
const INK: RGBColor = RGBColor(0, 0, 0);
const AMBER: RGBColor = RGBColor(224, 160, 32);
const PINK: RGBColor = RGBColor(255, 80, 160);
const PALE: RGBColor = RGBColor(190, 190, 190);
const WHITE: RGBColor = RGBColor(255, 255, 255);

/// Writes spectra, phase function and, where they are there, the profile and the objective to `path`, whose extension
/// says in which format.
///
/// # Errors
/// There is nothing to plot, the extension is neither svg nor png, or the file cannot be written.
pub fn plots(settings: &Settings, guidance: &Guidance, path: &Path) -> Result<(), String> {
    let panels = panels(settings, guidance);
    if panels.is_empty() {
        return Err("there is nothing to plot: no water, no profile".to_owned());
    }
    let extension = path.extension().and_then(|e| e.to_str());
    let written = match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("svg") => write_bytes(path, draw::svg(&panels)?.as_bytes()),
        Some("png") => write_frame(path, &draw::bitmap(&panels)?),
        _ => {
            return Err(format!(
                "{}: the extension must be .svg or .png",
                path.display()
            ));
        }
    };
    written.map_err(|e| e.to_string())
}

fn panels(settings: &Settings, guidance: &Guidance) -> Vec<Panel> {
    let mut panels = Vec::new();
    if let Some(water) = &settings.water {
        let rows = water.coefficients.rows();
        if !rows.is_empty() {
            panels.push(spectra(&water.coefficients, &rows));
        }
        if let Coefficients::Profile(profile) = &water.coefficients {
            panels.extend(by_depth(profile, &settings.response.response));
        }
        if let Ok(phase) = water.phase.phase() {
            panels.push(phase_panel(water.phase.name(), phase_plot::curve(&phase)));
        }
    }
    if let Some(profile) = &guidance.profile {
        panels.extend(profile_panels(profile));
    }
    panels.extend(guidance.answer.as_ref().and_then(objective));
    panels
}

fn curve(name: &str, colour: RGBColor, points: Vec<[f64; 2]>) -> Curve {
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
        map: None,
        marks: Vec::new(),
    }
}

fn spectra(water: &Coefficients, rows: &[(f64, f64, f64)]) -> Panel {
    let curves = vec![
        curve("a", INK, rows.iter().map(|r| [r.0, r.1]).collect()),
        curve("b", AMBER, rows.iter().map(|r| [r.0, r.2]).collect()),
    ];
    let title = match water {
        Coefficients::Jerlov { scale, .. } => format!("Jerlov {}", scale_name(*scale)),
        Coefficients::OfFile { path, .. } => path.clone(),
        Coefficients::Direct(_) | Coefficients::Profile(_) => String::new(),
    };
    panel(title, "wavelength, nm", "1/m", curves)
}

/// Absorption and scattering of the channels against depth.
fn by_depth(profile: &DepthProfile, response: &Response) -> Vec<Panel> {
    let Ok(iops) = profile.iops(response) else {
        return Vec::new();
    };
    let depths = profile.entries().iter().map(|entry| entry.depth_m);
    let of = |values: fn(&Iops) -> [f64; 3]| {
        let channel = |(k, (name, colour)): (usize, (&str, RGBColor))| {
            let points = depths.clone().zip(&iops).map(|(d, i)| [d, values(i)[k]]);
            curve(name, colour, points.collect())
        };
        CHANNELS.into_iter().enumerate().map(channel).collect()
    };
    let named = |name: &str, curves| panel(name.to_owned(), "depth, m", "1/m", curves);
    vec![
        named("Absorption a", of(|iops| iops.a)),
        named("Scattering b", of(|iops| iops.b)),
    ]
}

fn phase_panel(name: &str, points: Vec<[f64; 2]>) -> Panel {
    let petzold = Curve {
        dashed: true,
        ..curve("Petzold", AMBER, phase_plot::petzold().to_vec())
    };
    let curves = vec![petzold, curve(name, INK, points)];
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
    let of = |samples: plots::ChannelCurve| {
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

/// The objective with the search, the state and the suggestion.
fn objective(answer: &Answer) -> Option<Panel> {
    let map = answer.map.clone()?;
    let way = curve("search", PALE, answer.ascent());
    let now = answer.observation;
    Some(Panel {
        map: Some(map),
        marks: vec![
            ("here", [now.distance_m, now.light_pct], WHITE),
            ("suggestion", [answer.distance_m, answer.light_pct], PINK),
        ],
        ..panel("Objective".to_owned(), "distance, m", "lamp, %", vec![way])
    })
}
