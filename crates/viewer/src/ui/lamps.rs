//! The lamps' part of the scene panel.

use egui::{CollapsingHeader, Ui};
use uw_render::scene::Falloff;

use super::knobs::{channels, direction, heading, light_spectrum, log_slider, position, slider};
use crate::app::Viewer;
use crate::model::{LampSettings, data_sheet::DataSheet, open_scene::lamp_beside};

/// Shows the lamps.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    heading(ui, "Lamps");
    all_levels(&mut app.settings.lamps, ui);
    let (mut removed, mut of_sheet) = (None, None);
    let sheet = &mut app.data_sheet;
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
                if data_sheet(ui, sheet) {
                    of_sheet = Some(i);
                }
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
    if let Some(i) = of_sheet {
        let (settings, folder) = (&mut app.settings, &app.open.base_dir);
        let set = sheet.set(&mut settings.lamps[i], &settings.response, folder);
        if let Err(error) = set {
            app.toasts.error(error.to_string());
        }
    }
    if let Some(i) = removed {
        app.settings.lamps.remove(i);
    }
    if ui.button("Add a lamp").clicked() {
        let lamp = lamp_beside(&app.settings);
        app.settings.lamps.push(lamp);
    }
    let across = app.settings.lamps_across_surface();
    if !across.is_empty() {
        let text = format!("partly above the water, left out: {}", across.join(", "));
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

/// What a maker's data sheet says; whether the lamp is to be set so.
fn data_sheet(ui: &mut Ui, sheet: &mut DataSheet) -> bool {
    let shown = CollapsingHeader::new("From a data sheet")
        .id_salt("data sheet")
        .show(ui, |ui| {
            log_slider(ui, "luminous flux", &mut sheet.flux_lm, 10.0..=1e5, " lm");
            slider(
                ui,
                "colour temperature",
                &mut sheet.temperature_k,
                2000.0..=10_000.0,
                " K",
            );
            slider(
                ui,
                "beam angle",
                &mut sheet.beam_angle_deg,
                2.0..=180.0,
                "°",
            )
            .on_hover_text("From edge to edge, under water: behind a flat window sin(angle / 2) is that in air over 1.34");
            ui.horizontal(|ui| {
                let set = ui.button("Set the lamp so").on_hover_text(
                    "Sets intensity, spectrum and beam. The intensity is then in watts: sun and sky must be, too",
                );
                ui.weak(sheet.spectrum());
                set.clicked()
            })
            .inner
        });
    shown.body_returned.unwrap_or(false)
}
