//! The guidance panel: calibration, state, then advice.

use egui::{ComboBox, ProgressBar, Ui};
use uw_scenery::textures::Pattern;
use uw_twin::routine::{DISTANCES_M, UP_DEPTHS_M};

use super::advice::{self, triple};
use super::knobs::{Steps, heading, stepped};
use super::{look, operation, plots};
use crate::app::{FilePurpose, Viewer};
use crate::guidance::VARIES;

/// Depth of the vehicle.
const DEPTH: Steps = Steps {
    range: (0.5, 6.0),
    step: 0.1,
    decimals: 2,
    unit: " m",
};
/// Distance of the vehicle to the target.
pub(super) const DISTANCE: Steps = Steps {
    range: (0.5, 3.0),
    step: 0.05,
    decimals: 2,
    unit: " m",
};
/// Level of the vehicle's lamps.
pub(super) const LAMP: Steps = Steps {
    range: (0.0, 100.0),
    step: 1.0,
    decimals: 0,
    unit: " %",
};

/// Shows the panel.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    if let Some((what, share)) = app.guidance.progress() {
        // Not animated: on a software adapter every frame takes time from the work itself.
        ui.add(ProgressBar::new(share).text(what));
        if ui.button("Cancel").clicked() {
            app.guidance.cancel();
        }
    }
    if app.settings.water_varies() {
        ui.colored_label(ui.visuals().warn_fg_color, VARIES);
    }
    calibration(app, ui);
    state(app, ui);
    advice::show(app, ui);
    operation::show(app, ui);
}

/// The first step, folded away once it is done, so that the advice has room; unfolded again where it is to be repeated.
fn calibration(app: &mut Viewer, ui: &mut Ui) {
    let done = app.guidance.profile.is_some() && !app.guidance.is_outdated(&app.settings);
    let id = ui.make_persistent_id("calibration done");
    let was_done: Option<bool> = ui.data_mut(|d| d.get_temp(id));
    ui.data_mut(|d| d.insert_temp(id, done));
    let title = if done && app.guidance.origin.is_none() {
        "1  Calibrated: a profile that was opened"
    } else if done {
        "1  Calibrated in this water"
    } else {
        "1  Calibrate in this water"
    };
    ui.add_space(6.0);
    egui::CollapsingHeader::new(egui::RichText::new(title).strong())
        .id_salt("calibration")
        .open((was_done != Some(done)).then_some(!done))
        .show_unindented(ui, |ui| routine(app, ui));
}

/// Whether the vehicle's camera can take images now.
pub(super) fn can_look(app: &Viewer) -> bool {
    app.guidance.progress().is_none() && !app.settings.water_varies()
}

/// Why it cannot.
fn why_not(app: &Viewer) -> &'static str {
    if app.settings.water_varies() {
        VARIES
    } else {
        "Something is being done"
    }
}

fn routine(app: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ComboBox::from_label("target")
            .selected_text(app.guidance.pattern.name())
            .show_ui(ui, |ui| {
                for pattern in Pattern::ALL {
                    ui.selectable_value(&mut app.guidance.pattern, pattern, pattern.name());
                }
            });
    });
    ui.horizontal(|ui| {
        let idle = can_look(app);
        let run = egui::Button::new("Run the routine");
        let text = format!(
            "{} images looking up, {} of the target with lamps off and on",
            UP_DEPTHS_M.len(),
            DISTANCES_M.len()
        );
        let run = ui.add_enabled(idle, run).on_hover_text(text);
        if run.on_disabled_hover_text(why_not(app)).clicked() {
            let settings = app.settings.clone();
            app.guidance.calibrate(&settings, &mut app.toasts);
        }
        if ui.button("Open profile...").clicked() {
            app.ask_file(FilePurpose::OpenProfile);
        }
        let known = app.guidance.profile.is_some();
        if ui
            .add_enabled(known, egui::Button::new("Save..."))
            .clicked()
        {
            app.ask_file(FilePurpose::SaveProfile);
        }
    });
    if app.guidance.is_outdated(&app.settings) {
        ui.colored_label(
            ui.visuals().warn_fg_color,
            "the water has changed since: run the routine again",
        );
    }
    match app.guidance.profile.clone() {
        Some(profile) => {
            origin(app, ui);
            plots::profile(ui, &profile, app.guidance.profile_errors.as_deref());
        }
        None => {
            ui.weak("K_z: how light falls with depth. K_c: how contrast falls with distance.");
        }
    }
}

/// With which target and lamps the profile was made, and what of the open scene does not fit them.
fn origin(app: &Viewer, ui: &mut Ui) {
    let Some(origin) = &app.guidance.origin else {
        ui.weak("opened: it does not say with which target and lamps it was made");
        return;
    };
    ui.weak(origin.told());
    let misfits = origin.misfits(app.guidance.pattern, &app.settings, &app.open.objects);
    if misfits.is_empty() {
        ui.weak("the open scene has such a target and such lamps");
    }
    for misfit in misfits {
        ui.colored_label(ui.visuals().warn_fg_color, misfit);
    }
}

fn state(app: &mut Viewer, ui: &mut Ui) {
    heading(ui, "2  Where the vehicle is");
    let guidance = &mut app.guidance;
    let mut changed = stepped(ui, "depth", &mut guidance.position.depth_m, DEPTH);
    changed |= stepped(
        ui,
        "distance to the target",
        &mut guidance.position.distance_m,
        DISTANCE,
    );
    changed |= stepped(ui, "lamp level", &mut guidance.light_pct, LAMP);
    if changed {
        // A state set by hand takes the place of a recorded one.
        guidance.operation = None;
    }
    ui.horizontal(|ui| {
        if ui.button("Take the camera's place").clicked() {
            let distance_m = DISTANCE.written(app.distance_ahead_m());
            let depth_m = app.settings.depth_m().map(|m| DEPTH.written(m));
            let lamp = app.settings.lamps.first();
            let light_pct = lamp.map(|lamp| LAMP.written(lamp.level_pct));
            let guidance = &mut app.guidance;
            guidance.position.distance_m = distance_m;
            guidance.position.depth_m = depth_m.unwrap_or(guidance.position.depth_m);
            guidance.light_pct = light_pct.unwrap_or(guidance.light_pct);
        }
        if ui
            .add_enabled(can_look(app), egui::Button::new("Look"))
            .on_hover_text(
                "Renders what the vehicle's camera sees here, for the statistics of its image",
            )
            .on_disabled_hover_text(why_not(app))
            .clicked()
        {
            let settings = app.settings.clone();
            app.guidance.look(&settings, &mut app.toasts);
        }
    });
    let guidance = &app.guidance;
    match (guidance.observation(), &guidance.look) {
        (Some(now), Some(seen)) => {
            ui.horizontal(|ui| {
                look::show(ui, seen, guidance.light_pct);
                ui.vertical(|ui| {
                    for (name, values) in [("mean", now.mean), ("contrast", now.std)] {
                        ui.weak(format!("{name}, counts"));
                        ui.weak(triple(values));
                    }
                });
            });
        }
        _ => {
            ui.weak("press Look: advice is about an image");
        }
    }
}
