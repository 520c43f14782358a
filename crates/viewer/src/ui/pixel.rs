//! The window that shows the spectrum of the light of a pixel.

use egui::{Ui, Window};
use egui_plot::{Line, PlotPoints};
use glam::DVec2;
use uw_render::ray_spectrum::BandRadiance;

use super::knobs::{still_plot, x_axis, y_axis};
use super::spectra::responses;
use super::theme::channel_colours;
use crate::app::Viewer;
use crate::worker::PixelSpectrum;

/// Size of the plot, points.
const SIZE: egui::Vec2 = egui::vec2(380.0, 200.0);

/// Asks for the spectrum at a place of the picture, in [0, 1] from its upper left corner.
pub fn ask(app: &mut Viewer, ui: &Ui, at: DVec2) {
    let ctx = ui.ctx().clone();
    let wake = move || ctx.request_repaint();
    match PixelSpectrum::start(&app.settings, &app.open.geometry, at, wake) {
        Ok(pixel) => app.pixel = Some(pixel),
        Err(error) => app.toasts.error(format!("cannot start a thread: {error}")),
    }
}

/// Shows the window while there is something to show.
pub fn show(app: &mut Viewer, ctx: &egui::Context) {
    let Some(pixel) = &mut app.pixel else {
        return;
    };
    pixel.poll();
    let mut open = true;
    let title = format!("Light of pixel {}, {}", pixel.pixel.x, pixel.pixel.y);
    let is_old =
        pixel.settings.objects != app.settings.objects || !pixel.settings.same_light(&app.settings);
    // Beside the panel and over the picture's corner, away from its middle.
    let corner = ctx.content_rect().right_top() + egui::vec2(-SIZE.x - 40.0, 40.0);
    Window::new(title)
        .default_pos(corner)
        .id(egui::Id::unique("pixel"))
        .open(&mut open)
        .resizable(false)
        .default_width(SIZE.x)
        .show(ctx, |ui| {
            match &pixel.bands {
                None => {
                    ui.horizontal(|ui| {
                        ui.spinner();
                        ui.label("tracing its ray by wavelength...");
                    });
                }
                Some(Ok(bands)) => plot(ui, pixel, bands),
                Some(Err(message)) => {
                    ui.label(message);
                }
            }
            if is_old {
                ui.weak("of earlier settings; right-click the picture again for these");
            }
        });
    if !open {
        app.pixel = None;
    }
}

fn plot(ui: &mut Ui, pixel: &PixelSpectrum, bands: &[BandRadiance]) {
    let ink = ui.visuals().text_color();
    let colours = channel_colours(ui);
    let response = &pixel.settings.response.response;
    let most = bands
        .iter()
        .fold(0.0_f64, |most, band| most.max(band.radiance));
    still_plot("pixel", SIZE.y)
        .width(SIZE.x)
        .include_y(0.0)
        .custom_x_axes(vec![x_axis("wavelength, nm")])
        .custom_y_axes(vec![y_axis("W/(m² sr)")])
        .show(ui, |plot| {
            responses(plot, response, colours, most);
            for band in bands {
                let (nm, error) = (band.wavelength_nm, band.standard_error);
                let ends = [-error, error].map(|off| [nm, band.radiance + off]);
                let bar = Line::new("± 1 standard error", PlotPoints::new(ends.to_vec()));
                plot.line(bar.color(ink));
            }
            let points = bands.iter().map(|band| [band.wavelength_nm, band.radiance]);
            let line = Line::new("radiance", PlotPoints::new(points.collect()));
            plot.line(line.color(ink).width(2.0));
        });
    ui.weak(format!(
        "in bands of 10 nm, with its standard error; coloured: response of {}",
        response.name
    ));
}
