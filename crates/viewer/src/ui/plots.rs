//! Plots of the guidance panel: profiles, and the objective over distance and lamp level.

use std::sync::Arc;

use egui::{
    Color32, ColorImage, PopupAnchor, Response, Role, Sense, TextureHandle, TextureOptions,
    Tooltip, Ui, WidgetInfo,
};
use egui_plot::{Line, LineStyle, MarkerShape, PlotImage, PlotPoint, PlotPoints, Points};
use uw_calib::Profile;

use uw_twin::routine::CONTRAST_LIGHT_PCT;

use super::knobs::{still_plot, x_axis, y_axis};
use super::scale;
use super::theme::{CHANNELS, HERE, SUGGESTED, channel_colours};
use crate::guidance::answer::{Answer, MAP_SIZE, ScoreMap};
use crate::guidance::task::ContrastErrors;
use crate::model::FalseColour;

/// Points of a curve: place and value of each channel.
pub type ChannelCurve = Vec<(f64, [f64; 3])>;

/// The curves of a profile: K_z over depth, K_c over distance with the lamps on and off.
pub fn curves(profile: &Profile) -> [ChannelCurve; 3] {
    let contrast = |samples: &[uw_calib::ContrastSample]| {
        samples.iter().map(|s| (s.distance_m, s.k_c)).collect()
    };
    [
        profile.depth().iter().map(|s| (s.depth_m, s.k_z)).collect(),
        contrast(profile.contrast_on()),
        contrast(profile.contrast_off()),
    ]
}

fn lines(
    plot: &mut egui_plot::PlotUi<'_>,
    curve: &ChannelCurve,
    name: &str,
    colours: [Color32; 3],
    style: LineStyle,
) {
    for (k, (channel, colour)) in CHANNELS.into_iter().zip(colours).enumerate() {
        let points: Vec<_> = curve.iter().map(|(x, y)| [*x, y[k]]).collect();
        plot.line(
            Line::new(format!("{channel}{name}"), PlotPoints::from(points))
                .color(colour)
                .style(style)
                .width(1.8),
        );
    }
}

/// Bars of two standard errors to both sides of the points of a curve.
fn bars(
    plot: &mut egui_plot::PlotUi<'_>,
    curve: &ChannelCurve,
    errors: &ChannelCurve,
    colours: [Color32; 3],
) {
    for (k, colour) in colours.into_iter().enumerate() {
        for ((x, y), (_, error)) in curve.iter().zip(errors) {
            let ends = [-2.0, 2.0].map(|n| [*x, y[k] + n * error[k]]);
            let bar = Line::new("two standard errors", PlotPoints::from(ends.to_vec()));
            plot.line(bar.color(colour).width(1.0));
        }
    }
}

/// Shows a profile, with the standard errors of its contrasts where they are known.
pub fn profile(ui: &mut Ui, profile: &Arc<Profile>, errors: Option<&ContrastErrors>) {
    let [depth, on, off] = curves(profile);
    let colours = channel_colours(ui);
    ui.columns(2, |columns| {
        still_plot("K_z", 120.0)
            .custom_x_axes(vec![x_axis("depth, m")])
            .custom_y_axes(vec![y_axis("K_z")])
            .include_y(0.0)
            .show(&mut columns[0], |plot| {
                lines(plot, &depth, "", colours, LineStyle::Solid);
            });
        still_plot("K_c", 120.0)
            .custom_x_axes(vec![x_axis("distance, m")])
            .custom_y_axes(vec![y_axis("K_c, counts")])
            .include_y(0.0)
            .show(&mut columns[1], |plot| {
                lines(plot, &on, " on", colours, LineStyle::Solid);
                lines(plot, &off, " off", colours, LineStyle::dashed_dense());
                if let Some(errors) = errors {
                    bars(plot, &on, &errors.on, colours);
                    bars(plot, &off, &errors.off, colours);
                }
            });
    });
    ui.weak(format!(
        "K_c: solid with lamps at {CONTRAST_LIGHT_PCT} %, dashed without{}",
        errors.map_or("", |_| "; bars: two standard errors")
    ));
}

/// Shows the objective over distance and lamp level, with the state, the search and the suggestion.
pub fn map(ui: &mut Ui, answer: &Answer) {
    let texture = answer.map.as_ref().map(|map| (map_texture(ui, map), map));
    let shown = still_plot("objective", 180.0)
        .custom_x_axes(vec![x_axis("distance, m")])
        .custom_y_axes(vec![y_axis("lamp, %")])
        .set_margin_fraction(egui::vec2(0.03, 0.06))
        // The value under the pointer is told below: the plot itself would tell the place of the nearest mark.
        .show_x(false)
        .show_y(false)
        .show(ui, |plot| {
            if let Some((texture, map)) = &texture {
                let [near, far] = map.distance_m;
                let [dim, bright] = map.light_pct;
                let centre = PlotPoint::new(0.5 * (near + far), 0.5 * (dim + bright));
                let size = egui::vec2((far - near) as f32, (bright - dim) as f32);
                plot.image(PlotImage::new("score", texture.id(), centre, size));
            }
            search(plot, answer);
            marks(plot, answer);
        });
    shown
        .response
        .widget_info(|| WidgetInfo::labeled(Role::Image, true, "Objective map"));
    if let Some((_, map)) = &texture {
        score_scale(ui, map);
        if let Some(at) = shown.response.hover_pos() {
            let at = shown.transform.value_from_position(at);
            under_pointer(ui, &shown.response, map, [at.x, at.y]);
        }
    }
    ui.horizontal_wrapped(|ui| {
        ui.weak("cross: here");
        ui.colored_label(SUGGESTED, "diamond: suggestion");
        ui.weak("dots, line: the search");
    });
}

/// The candidates that the search looked at, and its way: faint, because they matter less than what lies beneath.
fn search(plot: &mut egui_plot::PlotUi<'_>, answer: &Answer) {
    let seen: Vec<[f64; 2]> = answer
        .steps
        .iter()
        .map(|(c, _)| [c.distance_m, c.light_pct])
        .collect();
    plot.points(
        Points::new("looked at", PlotPoints::from(seen))
            .radius(1.0)
            .color(Color32::from_white_alpha(70)),
    );
    // Leg by leg: where a line turns back on itself, the joint is drawn as a wedge as long as the line.
    for leg in answer.ascent().windows(2) {
        plot.line(
            Line::new("better and better", PlotPoints::from(leg.to_vec()))
                .color(Color32::from_white_alpha(120))
                .width(1.0),
        );
    }
}

/// The present state and the suggestion, each on a darker one of its kind, so that it is seen on every colour.
fn marks(plot: &mut egui_plot::PlotUi<'_>, answer: &Answer) {
    let now = answer.observation;
    let here = ("here", MarkerShape::Cross, HERE);
    let there = ("suggestion", MarkerShape::Diamond, SUGGESTED);
    for (at, (name, shape, colour)) in [
        ([now.distance_m, now.light_pct], here),
        ([answer.distance_m, answer.light_pct], there),
    ] {
        for (radius, colour) in [(8.5, Color32::BLACK), (7.0, colour)] {
            let mark = Points::new(name, vec![at]).shape(shape);
            plot.points(mark.radius(radius).color(colour));
        }
    }
}

/// The colours of the scores with their ends.
fn score_scale(ui: &mut Ui, map: &ScoreMap) {
    let (low, high) = map.range();
    let [low, high] = scale::ends(low, high);
    ui.horizontal(|ui| {
        ui.weak("score");
        ui.label(low);
        let (bar, _) = ui.allocate_exact_size(egui::vec2(120.0, 10.0), Sense::hover());
        scale::paint(ui.painter(), bar, FalseColour::Viridis);
        ui.label(high);
    });
}

/// Tells distance, lamp level and score at a place of the plot.
fn under_pointer(ui: &Ui, plot: &Response, map: &ScoreMap, [distance_m, light_pct]: [f64; 2]) {
    if let Some(score) = map.at(distance_m, light_pct) {
        let text = format!(
            "{distance_m:.2} m, {light_pct:.0} %: score {}",
            scale::figure(score, 3)
        );
        Tooltip::always_open(
            ui.ctx().clone(),
            plot.layer_id,
            plot.id.with("score"),
            PopupAnchor::Pointer,
        )
        .show(|ui| ui.label(text));
    }
}

/// The scores as a texture, made once per map.
fn map_texture(ui: &Ui, map: &ScoreMap) -> TextureHandle {
    type KeptMap = (ScoreMap, TextureHandle);
    let id = egui::Id::unique("score map");
    let kept: Option<Arc<KeptMap>> = ui.data(|d| d.get_temp(id));
    if let Some(kept) = kept
        && kept.0 == *map
    {
        return kept.1.clone();
    }
    let texture = ui
        .ctx()
        .load_texture("score map", map_image(map), TextureOptions::LINEAR);
    let kept = Arc::new((map.clone(), texture.clone()));
    ui.data_mut(|d| d.insert_temp(id, kept));
    texture
}

/// The scores as a picture, the brightest lamps at the top.
pub fn map_image(map: &ScoreMap) -> ColorImage {
    let (columns, rows) = MAP_SIZE;
    let (low, high) = map.range();
    let pixels = (0..rows * columns).map(|i| {
        let (row, column) = (rows - 1 - i / columns, i % columns);
        let score = map.scores.get(row * columns + column);
        let score = score.copied().unwrap_or(f64::NAN);
        FalseColour::Viridis.colour(((score - low) / (high - low)) as f32)
    });
    ColorImage::new([columns, rows], pixels.collect())
}
