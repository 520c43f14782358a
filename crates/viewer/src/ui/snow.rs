//! Marine snow's part of the water panel.

use egui::{CollapsingHeader, DragValue, Ui};
use uw_render::scene::{Blur, Snow};

use super::knobs::{VectorKnob, heading, log_slider, scaled, slider, told, vector};
use crate::app::Viewer;

/// Millimetres in a metre; litres in a cubic metre.
const THOUSAND: f64 = 1e3;
/// Diameters that are set by hand, mm.
const DIAMETERS_MM: std::ops::RangeInclusive<f64> = 0.01..=50.0;
/// Times that are set by hand, s.
const TIMES_S: std::ops::RangeInclusive<f64> = -1e6..=1e6;
const VELOCITY: VectorKnob = VectorKnob {
    speed: 0.002,
    most: 10.0,
    decimals: 4,
    unit: "m/s",
};

/// Shows the switch, and the knobs where it is on.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    if app.settings.water.is_none() {
        return;
    }
    heading(ui, "Marine snow");
    let mut on = app.settings.snow.is_some();
    ui.checkbox(&mut on, "marine snow").on_hover_text(
        "Specks that the lamps light: a share of their once-scattered light sits in flakes. The mean over seeds is the picture without",
    );
    match (on, app.settings.snow) {
        (true, None) => app.settings.snow = Some(Snow::default()),
        (false, Some(_)) => app.settings.snow = None,
        _ => {}
    }
    if app.settings.snow.is_some() && !app.settings.camera.build().shows_flakes() {
        ui.weak("not seen through a port, nor 90° off the axis and beyond");
    }
    let Some(snow) = &mut app.settings.snow else {
        return;
    };
    cloud(ui, snow);
    CollapsingHeader::new("Lens and shutter of the flakes")
        .id_salt("snow blur")
        .show(ui, |ui| blur(ui, &mut snow.blur))
        .header_response
        .on_hover_text("They blur flakes alone; all else stays sharp");
}

fn cloud(ui: &mut Ui, snow: &mut Snow) {
    slider(
        ui,
        "share of the lamps' light",
        &mut snow.share,
        0.0..=1.0,
        "",
    )
    .on_hover_text("Of what the water scatters once of the lamps' light towards the camera");
    if let Some(per_litre) = scaled(snow.per_m3 / THOUSAND, |per_litre| {
        log_slider(ui, "flakes per litre", per_litre, 0.01..=1000.0, "")
    }) {
        snow.per_m3 = THOUSAND * per_litre;
    }
    slider(ui, "slope of the sizes", &mut snow.slope, 1.0..=5.0, "")
        .on_hover_text("Flakes of a diameter d are as many as d to the power of minus this");
    let [smallest, largest] = &mut snow.diameter_m;
    let most = THOUSAND * *largest;
    if let Some(mm) = scaled(THOUSAND * *smallest, |mm| {
        log_slider(
            ui,
            "smallest diameter",
            mm,
            *DIAMETERS_MM.start()..=most,
            " mm",
        )
    }) {
        *smallest = mm / THOUSAND;
    }
    let least = THOUSAND * *smallest;
    if let Some(mm) = scaled(most, |mm| {
        log_slider(
            ui,
            "largest diameter",
            mm,
            least..=*DIAMETERS_MM.end(),
            " mm",
        )
    }) {
        *largest = mm / THOUSAND;
    }
    vector(ui, "drift", &mut snow.drift_m_s, VELOCITY);
    ui.horizontal(|ui| {
        ui.label("time");
        ui.add(
            DragValue::new(&mut snow.time_s)
                .speed(0.1)
                .range(TIMES_S)
                .suffix(" s"),
        )
        .on_hover_text(format!(
            "For which the flakes have drifted\n{}",
            told("time", &TIMES_S, "s")
        ));
        ui.label("seed");
        ui.add(DragValue::new(&mut snow.seed))
            .on_hover_text("Another seed is another cloud: 0 to 4294967295");
        if ui.button("Another cloud").clicked() {
            snow.seed = snow.seed.wrapping_add(1);
        }
    });
}

fn blur(ui: &mut Ui, blur: &mut Blur) {
    if let Some(ms) = scaled(THOUSAND * blur.exposure_s, |ms| {
        slider(ui, "exposure", ms, 0.0..=200.0, " ms")
            .on_hover_text("For which the shutter is open: flakes become streaks")
    }) {
        blur.exposure_s = ms / THOUSAND;
    }
    vector(ui, "camera's speed", &mut blur.velocity_m_s, VELOCITY);
}
