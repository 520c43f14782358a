//! The camera's part of the scene panel.

use egui::{ComboBox, DragValue, Ui};
use uw_media::spectral::RESPONSES;
use uw_render::scene::{Lens, PortShape};

use super::knobs::{direction, heading, list_height, log_slider, position, scaled, slider};
use crate::app::Viewer;
use crate::model::{
    ResponseSettings,
    camera::{CameraSettings, Motion},
    spectra::short_name,
};

/// Millimetres in a metre.
const MM_PER_M: f64 = 1e3;

/// Shows the camera.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    heading(ui, "Camera");
    ui.horizontal(|ui| {
        for (motion, name) in Motion::ALL {
            ui.selectable_value(&mut app.motion, motion, name);
        }
        ui.checkbox(&mut app.lamps_follow, "lamps follow");
    });
    let mut camera = app.settings.camera.clone();
    position(ui, "position", &mut camera.position_m);
    let mut forward = camera.forward;
    if direction(ui, "looks at", &mut forward) {
        let target = camera.position_m + forward;
        camera.look_at(target);
    }
    if camera != app.settings.camera {
        app.move_camera(|c| *c = camera);
    }
    let camera = &mut app.settings.camera;
    let mut hfov_deg = camera.hfov_deg();
    if slider(ui, "field of view", &mut hfov_deg, 10.0..=140.0, "°").changed() {
        camera.set_hfov_deg(hfov_deg);
    }
    ui.horizontal(|ui| {
        let (mut width, mut height) = (camera.width, camera.height);
        ui.label("image");
        ui.add(DragValue::new(&mut width).range(16..=8192).suffix(" px"))
            .on_hover_text("Image width: 16 to 8192 px");
        ui.label("x");
        ui.add(DragValue::new(&mut height).range(16..=8192).suffix(" px"))
            .on_hover_text("Image height: 16 to 8192 px");
        if (width, height) != (camera.width, camera.height) {
            // The lens stays: pixels stay square, the field of view stays across the width.
            let hfov_deg = camera.hfov_deg();
            let ideal = camera.is_ideal();
            *camera = camera.resized(width, height);
            if ideal {
                camera.set_hfov_deg(hfov_deg);
            }
        }
        ui.weak("proportions; saved with the scene");
    });
    opening(ui, camera);
    response(ui, &mut app.settings.response);
    let camera = &app.settings.camera;
    match camera.lens {
        Lens::Perspective(_) if camera.lens.is_ideal() => {}
        Lens::Perspective(_) => {
            ui.weak(format!("distortion {:?}", camera.lens.coefficients()));
        }
        Lens::Fisheye(k) => {
            ui.weak(format!("fisheye {k:?}"));
        }
    }
    if let Some(port) = &camera.port {
        ui.weak(match port.shape {
            PortShape::Flat { .. } => "behind a flat port",
            PortShape::Dome { .. } => "behind a dome port",
        });
    }
    ui.weak(format!(
        "{:.2} m to what is in the middle",
        app.distance_ahead_m()
    ));
}

/// The opening of the lens, and what is in focus.
fn opening(ui: &mut Ui, camera: &mut CameraSettings) {
    let aperture = scaled(MM_PER_M * camera.aperture_m, |mm| {
        slider(ui, "aperture", mm, 0.0..=50.0, " mm")
            .on_hover_text("Diameter of the lens's opening; 0: a pinhole, all is sharp")
    });
    if let Some(mm) = aperture {
        camera.aperture_m = mm / MM_PER_M;
    }
    if camera.aperture_m > 0.0 {
        log_slider(ui, "in focus at", &mut camera.focus_m, 0.05..=20.0, " m");
    }
}

/// What the channels see of each wavelength.
fn response(ui: &mut Ui, response: &mut ResponseSettings) {
    const BOXES: &str = "boxes";
    let chosen = response.entry.as_ref().map_or(BOXES, short_name).to_owned();
    ComboBox::from_label("response")
        .selected_text(&chosen)
        .height(list_height(ui))
        .show_ui(ui, |ui| {
            for known in RESPONSES.split_whitespace() {
                let name = match known {
                    BOXES => "boxes (600-700, 500-600, 400-500 nm)",
                    camera => camera,
                };
                if ui.selectable_label(chosen == known, name).clicked() {
                    *response = match known {
                        BOXES => ResponseSettings::default(),
                        camera => ResponseSettings::named(camera).unwrap_or_default(),
                    };
                }
            }
        })
        .response
        .on_hover_text(
            "What the camera's channels see of each wavelength; counts in water by wavelength",
        );
}
