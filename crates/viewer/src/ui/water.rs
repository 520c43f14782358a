//! The water panel: an ocean of any kind.

use egui::{ComboBox, Slider, Ui};
use uw_media::{Bands, WaterType, phase::PhaseFunction, spectral::Response};

use super::knobs::{channels, heading, light_spectrum, list_height, log_slider, slider};
use super::{phase_plot, spectra};
use crate::app::{FilePurpose, Viewer};
use crate::model::{Coefficients, PhaseModel, Sun, Surface, Water, WaterBands, water};

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
    let response = app.settings.response.response.clone();
    if let Some(water) = &mut app.settings.water {
        coefficients(ui, &mut water.coefficients, &response);
        phase(ui, &mut water.phase);
        slider(
            ui,
            "refractive index of the water",
            &mut water.refractive_index,
            1.0..=1.6,
            "",
        );
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

fn coefficients(ui: &mut Ui, coefficients: &mut Coefficients, response: &Response) {
    heading(ui, "Absorption a and scattering b");
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
            .on_hover_text("Mixes a and b of neighbouring types");
            bands_box(ui, bands);
            match bands {
                WaterBands::Three(bands) => spectra::with_intervals(ui, &rows, bands),
                _ => spectra::with_response(ui, &rows, response),
            }
        }
        Coefficients::OfFile { path, .. } => {
            ui.weak(format!("by wavelength, from {path}"));
            spectra::with_response(ui, &rows, response);
        }
        Coefficients::Direct(_) => {}
    }
    let is_spectral = matches!(coefficients.spectrum(), Ok(Some(_)));
    let mut iops = match before {
        Ok(iops) => iops,
        Err(error) => {
            ui.colored_label(ui.visuals().error_fg_color, error.to_string());
            return;
        }
    };
    if is_spectral {
        ui.weak("Light goes by wavelength. Near zero range the channels have:")
            .on_hover_text("Set one of these, and the water is known in three bands from then on");
    }
    let shown = iops;
    channels(ui, "a", &mut iops.a, 20.0, "1/m");
    channels(ui, "b", &mut iops.b, 20.0, "1/m");
    if iops != shown {
        *coefficients = Coefficients::Direct(iops);
    }
    ui.weak(format!(
        "attenuation c = a + b  {} 1/m",
        triple(iops.c(), 3)
    ));
    ui.weak(format!("albedo b/c  {}", triple(iops.albedo(), 2)));
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
            Coefficients::Direct(_) | Coefficients::OfFile { .. } => (None, WaterBands::default()),
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

fn bands_box(ui: &mut Ui, bands: &mut WaterBands) {
    let intervals = match &*bands {
        WaterBands::Three(bands) => spectra::intervals(bands),
        _ => spectra::intervals(&Bands::Mean),
    };
    let own = Bands::Intervals(intervals);
    let three = |bands| WaterBands::Three(bands);
    ComboBox::from_label("wavelengths to channels")
        .selected_text(match &*bands {
            WaterBands::Three(Bands::Intervals(_)) => "own intervals".to_owned(),
            other => other.to_string(),
        })
        .height(list_height(ui))
        .show_ui(ui, |ui| {
            ui.selectable_value(bands, WaterBands::Spectral, "spectral")
                .on_hover_text("Each sample has a wavelength for each channel: right at any range");
            ui.selectable_value(
                bands,
                WaterBands::SpectralMeasured,
                "spectral-measured (IB II III 1C 3C 5C)",
            );
            let cameras = uw_media::Camera::ALL.map(Bands::Camera);
            for choice in [Bands::Mean, Bands::Measured].into_iter().chain(cameras) {
                ui.selectable_value(bands, three(choice), choice.to_string())
                    .on_hover_text("One coefficient for each channel: right near zero range");
            }
            ui.selectable_value(bands, three(own), "own intervals");
            ui.selectable_value(
                bands,
                three(Bands::PaperPrinted),
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
    ui.checkbox(&mut surface, "water surface");
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
