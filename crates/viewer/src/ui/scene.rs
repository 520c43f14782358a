//! The scene panel: objects, camera, lamps, sensor.

use egui::{DragValue, Ui};
use uw_render::scene::{Encoding, Exposure, Noise};

use super::knobs::{heading, log_slider};
use super::{camera, lamps, objects};
use crate::app::{FilePurpose, Viewer};
use crate::model::{Balance, SensorSettings};

/// Shows the panel.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    file(app, ui);
    objects::show(app, ui);
    camera::show(app, ui);
    lamps::show(app, ui);
    let used = app.frame().map(|f| f.shown.exposure);
    sensor(ui, &mut app.settings.sensor, used);
    heading(ui, "Paths");
    ui.horizontal(|ui| {
        let label = ui.label("most bounces");
        ui.add(DragValue::new(&mut app.settings.max_bounces).range(0..=1000))
            .on_hover_text(
                "Largest number of scatterings and reflections: 1 to 1000, or 0 for no limit",
            )
            .labelled_by(label.id);
        ui.weak("0: no limit, unbiased");
    });
}

fn file(app: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        if ui.button("Open scene or glTF...").clicked() {
            app.ask_file(FilePurpose::OpenScene);
        }
        if ui
            .button("Scenes...")
            .on_hover_text("Recent scenes and examples, with pictures")
            .clicked()
        {
            app.gallery_open = true;
        }
        if ui.button("Save...").clicked() {
            app.ask_file(FilePurpose::SaveScene);
        }
    });
    ui.weak("or drop a file on the window");
    ui.label(format!(
        "{}: objects {}, surfaces {}",
        app.open.title,
        app.open.objects.len(),
        app.open.geometry.len()
    ));
    if let Some((lower, upper)) = app.open.geometry.bounds() {
        let size = upper - lower;
        ui.weak(format!("{:.2} x {:.2} x {:.2} m", size.x, size.y, size.z));
    }
}

fn sensor(ui: &mut Ui, sensor: &mut SensorSettings, used: Option<f64>) {
    heading(ui, "Sensor");
    let mut automatic = matches!(sensor.exposure, Exposure::AutoMean(_));
    ui.checkbox(&mut automatic, "automatic exposure");
    match (automatic, sensor.exposure) {
        (true, Exposure::Fixed(_)) => sensor.exposure = Exposure::AutoMean(0.4),
        // What was in use goes on, so that the picture does not jump.
        (false, Exposure::AutoMean(_)) => sensor.exposure = Exposure::Fixed(used.unwrap_or(1.0)),
        _ => {}
    }
    match &mut sensor.exposure {
        Exposure::Fixed(factor) => {
            log_slider(ui, "exposure", factor, 1e-3..=1e4, "");
        }
        Exposure::AutoMean(mean) => {
            log_slider(ui, "mean signal", mean, 0.01..=1.0, "");
            if let Some(used) = used {
                ui.weak(format!("exposure in use {used:.4}"));
            }
        }
    }
    let mut noisy = sensor.noise.is_some();
    ui.checkbox(&mut noisy, "sensor noise")
        .on_hover_text("Variance of the signal y: a y + b");
    match (noisy, sensor.noise) {
        (true, None) => sensor.noise = Some(Noise { a: 1e-3, b: 1e-5 }),
        (false, Some(_)) => sensor.noise = None,
        _ => {}
    }
    if let Some(noise) = &mut sensor.noise {
        log_slider(ui, "photon noise a", &mut noise.a, 1e-6..=0.05, "");
        log_slider(ui, "read noise b", &mut noise.b, 1e-8..=0.01, "");
    }
    balance(ui, &mut sensor.white_balance);
    ui.horizontal(|ui| {
        ui.label("encoding");
        ui.selectable_value(&mut sensor.encoding, Encoding::Srgb, "sRGB");
        ui.selectable_value(&mut sensor.encoding, Encoding::Linear, "linear");
        if let Encoding::Curve(_) = sensor.encoding {
            let _ = ui.selectable_label(true, "measured curve");
        }
        ui.separator();
        ui.selectable_value(&mut sensor.bits, 8, "8 bits");
        ui.selectable_value(&mut sensor.bits, 16, "16 bits");
    });
}

fn balance(ui: &mut Ui, balance: &mut Balance) {
    ui.horizontal(|ui| {
        ui.label("white balance");
        ui.selectable_value(balance, Balance::None, "none");
        ui.selectable_value(balance, Balance::Gray, "gray")
            .on_hover_text("Makes the means of the channels equal");
        ui.selectable_value(balance, Balance::Daylight, "d65")
            .on_hover_text(
                "White is white under daylight without water, where light goes by wavelength",
            );
        if let Balance::Gains(gains) = balance {
            ui.weak(format!("gains {gains:?}"));
        }
    });
}
