//! The water panel: an ocean of any kind.

use egui::{Button, Checkbox, ComboBox, Slider, Ui};
use uw_media::phase::PhaseFunction;
use uw_media::spectral::{Response, WaterSpectrum, secchi_depth_m, visibility_m};
use uw_media::{Bands, WaterType};

use super::knobs::{channels, heading, light_spectrum, list_height, log_slider, slider};
use super::scale::figure;
use super::{clouds, depth_profile, phase_plot, snow, spectra};
use crate::app::{FilePurpose, Viewer};
use crate::model::{
    Coefficients, DepthProfile, PhaseModel, Sun, Surface, Water, WaterBands, water,
};

/// Depth of the lower point of a new profile, at least, m.
const FIRST_BOTTOM_M: f64 = 4.0;

/// Shows the panel.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    let mut wet = app.settings.water.is_some();
    ui.checkbox(&mut wet, "there is water")
        .on_hover_text("Off: air");
    match (wet, &app.settings.water) {
        (true, None) => app.settings.water = Some(Water::default()),
        (false, Some(_)) => app.settings.water = None,
        _ => {}
    }
    coefficients(app, ui);
    clouds::show(app, ui);
    snow::show(app, ui);
    if let Some(water) = &mut app.settings.water {
        phase(ui, &mut water.phase);
        slider(
            ui,
            "refractive index",
            &mut water.refractive_index,
            1.0..=1.6,
            "",
        )
        .on_hover_text("Of the water");
    }
    light(app, ui);
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        if ui.button("Open scene...").clicked() {
            app.ask_file(FilePurpose::OpenScene);
        }
        if ui.button("Save scene...").clicked() {
            app.ask_file(FilePurpose::SaveScene);
        }
    });
}

fn coefficients(app: &mut Viewer, ui: &mut Ui) {
    let camera_depth_m = app.settings.depth_m();
    let response = app.settings.response.response.clone();
    let Some(water) = &mut app.settings.water else {
        return;
    };
    heading(ui, "Absorption a and scattering b");
    depth_switch(ui, &mut water.coefficients, &response, camera_depth_m);
    match &mut water.coefficients {
        Coefficients::Profile(profile) => depth_profile::show(
            ui,
            profile,
            &mut app.profile_view,
            &response,
            camera_depth_m,
        ),
        same => everywhere(ui, same, &response),
    }
}

/// Whether the water varies with depth, which needs a surface from which depths are counted.
fn depth_switch(
    ui: &mut Ui,
    coefficients: &mut Coefficients,
    response: &Response,
    camera_depth_m: Option<f64>,
) {
    let was = matches!(coefficients, Coefficients::Profile(_));
    let mut varies = was;
    ui.add_enabled(
        was || camera_depth_m.is_some(),
        Checkbox::new(&mut varies, "varies with depth"),
    )
    .on_hover_text(
        "On: two points of this water, to be moved. Off: the water of the point nearest to the camera's depth, everywhere",
    )
    .on_disabled_hover_text("Depths are counted from the water surface: switch it on below");
    let camera_depth_m = camera_depth_m.unwrap_or(0.0);
    match coefficients {
        Coefficients::Profile(profile) if !varies => {
            *coefficients = profile.nearest(camera_depth_m, response);
        }
        same if varies && !was => {
            let bottom_m = (2.0 * camera_depth_m).ceil().max(FIRST_BOTTOM_M);
            *same = Coefficients::Profile(DepthProfile::of(same, bottom_m));
        }
        _ => {}
    }
}

/// Water that is the same at every depth.
fn everywhere(ui: &mut Ui, coefficients: &mut Coefficients, response: &Response) {
    types(ui, coefficients, response);
    let before = coefficients.iops(response);
    let rows = coefficients.rows();
    match coefficients {
        Coefficients::Jerlov { scale, bands } => {
            let last = (WaterType::ALL.len() - 1) as f64;
            let name = |scale: f64, _| water::scale_name(scale);
            ui.add(
                Slider::new(scale, 0.0..=last)
                    .text("between types")
                    .custom_formatter(name),
            )
            .on_hover_text("Mixes a and b of neighbouring types, I to 9C");
            bands_box(ui, bands, |_| true);
            match bands {
                WaterBands::Three(bands) => spectra::with_intervals(ui, &rows, bands),
                _ => spectra::with_response(ui, &rows, response),
            }
        }
        Coefficients::OfFile { path, .. } => {
            ui.weak(format!("by wavelength, from {path}"));
            spectra::with_response(ui, &rows, response);
        }
        Coefficients::Direct(_) | Coefficients::Profile(_) => {}
    }
    let spectrum = coefficients.spectrum().ok().flatten();
    let mut iops = match before {
        Ok(iops) => iops,
        Err(error) => {
            ui.colored_label(ui.visuals().error_fg_color, error.to_string());
            return;
        }
    };
    if spectrum.is_some() {
        ui.weak("Light goes by wavelength. Near zero range the channels have:")
            .on_hover_text("Set one of these, and the water is known in three bands from then on");
    }
    let shown = iops;
    channels(ui, "a", &mut iops.a, 20.0, "1/m");
    channels(ui, "b", &mut iops.b, 20.0, "1/m");
    if iops != shown {
        *coefficients = Coefficients::Direct(iops);
    }
    let attenuation = ui.weak(format!(
        "attenuation c = a + b  {} 1/m",
        triple(iops.c(), 3)
    ));
    if let Some(water) = &spectrum {
        attenuation.on_hover_text(sight(water));
    }
    ui.weak(format!("albedo b/c  {}", triple(iops.albedo(), 2)));
}

/// How far people see in a water.
fn sight(water: &WaterSpectrum) -> String {
    format!(
        "By daylight a diver sees {} m far in it, and a Secchi disk is lost at {} m",
        figure(visibility_m(water), 2),
        figure(secchi_depth_m(water), 2)
    )
}

fn triple(values: [f64; 3], digits: usize) -> String {
    values.map(|x| format!("{x:.digits$}")).join("  ")
}

/// A button per type, and one for coefficients of one's own.
fn types(ui: &mut Ui, coefficients: &mut Coefficients, response: &Response) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        let (scale, bands) = match coefficients {
            Coefficients::Jerlov { scale, bands } => (Some(*scale), *bands),
            _ => (None, WaterBands::default()),
        };
        for (i, water_type) in WaterType::ALL.into_iter().enumerate() {
            let chosen = scale == Some(i as f64);
            if ui.selectable_label(chosen, water_type.name()).clicked() {
                *coefficients = Coefficients::Jerlov {
                    scale: i as f64,
                    bands,
                };
            }
        }
        let own = matches!(coefficients, Coefficients::Direct(_));
        if ui
            .selectable_label(own, "own")
            .on_hover_text("Set a and b of three bands below")
            .clicked()
            && let Ok(iops) = coefficients.iops(response)
        {
            *coefficients = Coefficients::Direct(iops);
        }
    });
}

/// How wavelengths become channels; what does not fit cannot be chosen.
pub(super) fn bands_box(ui: &mut Ui, bands: &mut WaterBands, fits: impl Fn(&WaterBands) -> bool) {
    let intervals = match &*bands {
        WaterBands::Three(bands) => spectra::intervals(bands),
        _ => spectra::intervals(&Bands::Mean),
    };
    let own = Bands::Intervals(intervals);
    ComboBox::from_label("wavelengths to channels")
        .selected_text(match &*bands {
            WaterBands::Three(Bands::Intervals(_)) => "own intervals".to_owned(),
            other => other.to_string(),
        })
        .height(list_height(ui))
        .show_ui(ui, |ui| {
            let mut choice = |choice: WaterBands, name: &str| {
                let button = Button::selectable(*bands == choice, name);
                let response = ui
                    .add_enabled(fits(&choice), button)
                    .on_disabled_hover_text("Not every point of the profile can be had with it");
                if response.clicked() {
                    *bands = choice;
                }
                response
            };
            choice(WaterBands::Spectral, "spectral")
                .on_hover_text("Each sample has a wavelength for each channel: right at any range");
            choice(
                WaterBands::SpectralMeasured,
                "spectral-measured (IB II III 1C 3C 5C)",
            );
            let cameras = uw_media::Camera::ALL.map(Bands::Camera);
            for three in [Bands::Mean, Bands::Measured].into_iter().chain(cameras) {
                choice(WaterBands::Three(three), &three.to_string())
                    .on_hover_text("One coefficient for each channel: right near zero range");
            }
            choice(WaterBands::Three(own), "own intervals");
            choice(
                WaterBands::Three(Bands::PaperPrinted),
                "paper-printed (misprints)",
            );
        });
}

fn phase(ui: &mut Ui, model: &mut PhaseModel) {
    heading(ui, "Phase function");
    ComboBox::from_label("model")
        .selected_text(model.name())
        .height(list_height(ui))
        .show_ui(ui, |ui| {
            for choice in PhaseModel::CHOICES {
                if ui
                    .selectable_label(choice.name() == model.name(), choice.name())
                    .clicked()
                    && choice.name() != model.name()
                {
                    *model = choice;
                }
            }
        });
    match model {
        PhaseModel::FournierForand {
            n,
            backscatter_fraction,
        } => {
            log_slider(
                ui,
                "backscatter fraction B",
                backscatter_fraction,
                5e-4..=0.4,
                "",
            );
            slider(ui, "particle index n", n, 1.01..=1.33, "");
        }
        PhaseModel::HenyeyGreenstein { g } => {
            slider(ui, "mean cosine g", g, -0.99..=0.99, "");
        }
        PhaseModel::Rayleigh { depolarisation } => {
            slider(ui, "depolarisation", depolarisation, 0.0..=1.0, "");
        }
        PhaseModel::Draine { g, alpha } => {
            slider(ui, "g", g, -0.99..=0.99, "");
            slider(ui, "alpha", alpha, 0.0..=50.0, "");
        }
        PhaseModel::Petzold | PhaseModel::Isotropic | PhaseModel::OfFile { .. } => {}
    }
    match model.phase() {
        Ok(phase) => {
            ui.weak(format!(
                "backscatter fraction {:.4}   mean cosine {:.4}",
                phase.backscatter_fraction(),
                phase.mean_cosine()
            ));
            phase_plot::show(ui, model.name(), &phase);
        }
        Err(error) => {
            ui.colored_label(ui.visuals().error_fg_color, error.to_string());
        }
    }
}

/// Depth, sun and sky.
fn light(app: &mut Viewer, ui: &mut Ui) {
    heading(ui, "Depth, sun and sky");
    let settings = &mut app.settings;
    let mut surface = settings.surface.is_some();
    let water = settings.water.as_ref().map(|water| &water.coefficients);
    let is_needed = surface && matches!(water, Some(Coefficients::Profile(_)));
    ui.add_enabled(!is_needed, Checkbox::new(&mut surface, "water surface"))
        .on_disabled_hover_text("The depths of the water's profile are counted from it");
    match (surface, settings.surface) {
        (true, None) => {
            settings.surface = Some(Surface {
                height_m: settings.camera.position_m.z + 3.0,
                refractive: true,
            });
        }
        (false, Some(_)) => settings.surface = None,
        _ => {}
    }
    if let (Some(surface), Some(depth_m)) = (settings.surface, settings.depth_m()) {
        let mut depth = depth_m;
        if slider(ui, "depth of the camera", &mut depth, 0.1..=40.0, " m").changed() {
            app.move_camera(|camera| camera.position_m.z = surface.height_m - depth);
        }
    }
    let settings = &mut app.settings;
    if let Some(surface) = &mut settings.surface {
        ui.checkbox(&mut surface.refractive, "surface bends and reflects light");
    }
    let mut shines = settings.sun.is_some();
    ui.checkbox(&mut shines, "sun");
    match (shines, settings.sun) {
        (true, None) => {
            settings.sun = Some(Sun {
                zenith_deg: 30.0,
                azimuth_deg: 0.0,
                irradiance: [1.0; 3],
            });
        }
        (false, Some(_)) => settings.sun = None,
        _ => {}
    }
    if let Some(sun) = &mut settings.sun {
        slider(ui, "zenith angle", &mut sun.zenith_deg, 0.0..=89.0, "°");
        slider(ui, "azimuth", &mut sun.azimuth_deg, -180.0..=180.0, "°");
        channels(ui, "irradiance", &mut sun.irradiance, 1e4, "W/m²");
        light_spectrum(ui, "spectrum of the sun", &mut settings.sun_spectrum, true);
    }
    channels(ui, "sky", &mut settings.sky_radiance, 1e4, "W/(m² sr)");
    light_spectrum(ui, "spectrum of the sky", &mut settings.sky_spectrum, true);
}
