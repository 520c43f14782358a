//! The lamps' part of the scene panel.

use egui::{CollapsingHeader, Ui};
use uw_render::scene::Falloff;

use super::knobs::{channels, direction, heading, light_spectrum, position, slider};
use crate::app::Viewer;
use crate::model::{LampSettings, open_scene::lamp_beside};

/// Shows the lamps.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    heading(ui, "Lamps");
    all_levels(&mut app.settings.lamps, ui);
    let mut removed = None;
    for (i, lamp) in app.settings.lamps.iter_mut().enumerate() {
        let title = if lamp.of_gltf {
            format!("{} (of the glTF file)", lamp.name)
        } else {
            lamp.name.clone()
        };
        CollapsingHeader::new(title)
            .id_salt(("lamp", i))
            .default_open(i == 0)
            .show(ui, |ui| {
                one(ui, lamp);
                if !lamp.of_gltf
                    && ui
                        .button("Remove")
                        .on_hover_text(format!("Remove {}", lamp.name))
                        .clicked()
                {
                    removed = Some(i);
                }
            });
    }
    if let Some(i) = removed {
        app.settings.lamps.remove(i);
    }
    if ui.button("Add a lamp").clicked() {
        let lamp = lamp_beside(&app.settings);
        app.settings.lamps.push(lamp);
    }
    let dry = app.settings.lamps_in_air();
    if !dry.is_empty() {
        let text = format!("above the water, left out: {}", dry.join(", "));
        ui.colored_label(ui.visuals().warn_fg_color, text);
    }
}

/// One level for all lamps.
fn all_levels(lamps: &mut [LampSettings], ui: &mut Ui) {
    let Some(first) = lamps.first() else {
        ui.weak("none");
        return;
    };
    if lamps.len() < 2 {
        return;
    }
    let mut level_pct = first.level_pct;
    if slider(ui, "level of all", &mut level_pct, 0.0..=100.0, " %").changed() {
        for lamp in lamps {
            lamp.level_pct = level_pct;
        }
    }
}

fn one(ui: &mut Ui, lamp: &mut LampSettings) {
    slider(
        ui,
        &format!("{} level", lamp.name),
        &mut lamp.level_pct,
        0.0..=100.0,
        " %",
    );
    position(ui, "position", &mut lamp.position_m);
    direction(ui, "shines", &mut lamp.forward);
    slider(
        ui,
        "half angle of the beam",
        &mut lamp.half_angle_deg,
        1.0..=180.0,
        "°",
    );
    channels(ui, "intensity", &mut lamp.intensity, 1e5, "W/sr");
    if !lamp.of_gltf {
        light_spectrum(ui, "spectrum", &mut lamp.spectrum, false);
    }
    let mut radius_mm = 1000.0 * lamp.radius_m;
    if slider(ui, "radius (0: point)", &mut radius_mm, 0.0..=200.0, " mm").changed() {
        lamp.radius_m = radius_mm / 1000.0;
    }
    ui.horizontal(|ui| {
        ui.label("beam");
        match (&lamp.beam_file, &lamp.falloff) {
            (Some(file), _) => {
                ui.weak(file);
            }
            (None, Falloff::Profile(_)) => {
                ui.weak("a profile");
            }
            (None, _) => {
                ui.selectable_value(&mut lamp.falloff, Falloff::Uniform, "uniform");
                ui.selectable_value(&mut lamp.falloff, Falloff::Cosine, "cosine");
            }
        }
    });
}
