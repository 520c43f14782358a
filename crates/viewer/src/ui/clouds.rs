//! The clouds' part of the water panel, and their circles over the picture.

use egui::{CollapsingHeader, Color32, DragValue, Rect, Stroke, Ui, pos2};
use glam::DVec3;

use super::knobs::{channels, heading, position, told};
use crate::app::{Tab, Viewer};
use crate::model::Cloud;
use crate::model::cloud::{MOST_CLOUDS, SIGMA_RANGE_M};

/// Colour of the circles over the picture.
const CIRCLE: Color32 = Color32::from_rgb(255, 200, 60);

/// Shows the clouds.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    let distance_m = app.distance_ahead_m();
    let camera = app.settings.camera.clone();
    let Some(water) = &mut app.settings.water else {
        app.placed_cloud = None;
        return;
    };
    let clouds = &mut water.clouds;
    app.placed_cloud = app.placed_cloud.filter(|i| *i < clouds.len());
    heading(ui, "Clouds");
    let mut removed = None;
    for (i, cloud) in clouds.iter_mut().enumerate() {
        CollapsingHeader::new(format!("cloud {}", i + 1))
            .id_salt(("cloud", i))
            .default_open(i == 0)
            .show(ui, |ui| {
                one(ui, cloud);
                ui.horizontal(|ui| {
                    place(ui, i, &mut app.placed_cloud);
                    let text = format!("Remove cloud {}", i + 1);
                    if ui.button("Remove").on_hover_text(text).clicked() {
                        removed = Some(i);
                    }
                });
            });
    }
    if let Some(i) = removed {
        clouds.remove(i);
        app.placed_cloud = None;
    }
    ui.horizontal(|ui| {
        let add = egui::Button::new("Add a cloud");
        if ui
            .add_enabled(clouds.len() < MOST_CLOUDS, add)
            .on_hover_text("Half way to what is in the middle of the picture")
            .on_disabled_hover_text(format!("There are at most {MOST_CLOUDS} clouds"))
            .clicked()
        {
            clouds.push(Cloud::ahead(&camera, distance_m));
        }
        if !clouds.is_empty() {
            ui.checkbox(&mut app.clouds_shown, "show circles")
                .on_hover_text("In the picture, at one standard deviation from the middle");
        }
    });
}

fn one(ui: &mut Ui, cloud: &mut Cloud) {
    position(ui, "middle", &mut cloud.centre_m);
    ui.horizontal(|ui| {
        let label = ui.label("standard deviation");
        let speed = 0.01 * cloud.sigma_m;
        let knob = DragValue::new(&mut cloud.sigma_m)
            .range(SIGMA_RANGE_M.0..=SIGMA_RANGE_M.1)
            .clamp_existing_to_range(false)
            .speed(speed);
        ui.add(knob.max_decimals(3).suffix(" m"))
            .on_hover_text(format!(
                "σ: at a distance r from the middle the cloud has exp(-r²/2σ²) of its a and b\n{}",
                told(
                    "standard deviation",
                    &(SIGMA_RANGE_M.0..=SIGMA_RANGE_M.1),
                    "m"
                )
            ))
            .labelled_by(label.id);
    });
    let iops = &mut cloud.iops;
    for (name, values, what) in [
        ("a", &mut iops.a, "absorption in the middle"),
        ("b", &mut iops.b, "scattering in the middle"),
    ] {
        channels(ui, name, values, Cloud::LARGEST_PER_M, "1/m").on_hover_text(what);
    }
}

/// The button after which a click in the picture places the cloud.
fn place(ui: &mut Ui, i: usize, placed: &mut Option<usize>) {
    let waits = *placed == Some(i);
    let text = if waits {
        "Click in the picture..."
    } else {
        "Place here..."
    };
    if ui
        .selectable_label(waits, text)
        .on_hover_text(
            "Then click in the picture: the middle goes to the surface that is seen there",
        )
        .clicked()
    {
        *placed = (!waits).then_some(i);
    }
}

/// Puts the cloud that waits for a place to a point of a surface, or says that there is none.
pub fn put(app: &mut Viewer, point: Option<DVec3>) {
    let Some(i) = app.placed_cloud else {
        return;
    };
    let Some(point) = point else {
        app.toasts
            .warn("There is nothing ahead at this place: click on a surface.");
        return;
    };
    let clouds = app.settings.water.as_mut().map(|water| &mut water.clouds);
    if let Some(cloud) = clouds.and_then(|clouds| clouds.get_mut(i)) {
        cloud.centre_m = point;
    }
    app.placed_cloud = None;
}

/// Draws a circle for every cloud over the picture at `rect`, while the water is set.
pub fn circles(app: &Viewer, ui: &Ui, rect: Rect) {
    let Some(water) = &app.settings.water else {
        return;
    };
    if app.tab != Tab::Water || !app.clouds_shown {
        return;
    }
    let camera = app.settings.placed_camera();
    let scale = rect.width() / camera.width as f32;
    let painter = ui.painter_at(rect);
    for (i, cloud) in water.clouds.iter().enumerate() {
        let Some((middle, radius)) = cloud.circle(&camera) else {
            continue;
        };
        let middle = rect.min + scale * egui::vec2(middle.x as f32, middle.y as f32);
        let width = if app.placed_cloud == Some(i) {
            3.0
        } else {
            1.5
        };
        painter.circle_stroke(middle, scale * radius as f32, Stroke::new(width, CIRCLE));
        painter.text(
            pos2(middle.x, middle.y),
            egui::Align2::CENTER_CENTER,
            format!("{}", i + 1),
            egui::FontId::proportional(13.0),
            CIRCLE,
        );
    }
}
