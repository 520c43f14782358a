//! The picture in the middle: shown, turned, probed.

use eframe::egui_wgpu::RenderState;
use egui::{
    Align2, Color32, FontId, PointerButton, Rect, Role, Sense, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use glam::{DVec2, DVec3};
use uw_render::image::LayerData;
use uw_render::prepare::Primitive;

use super::canvas::Canvas;
use super::scale::figure;
use super::{clouds, overlay, pixel, theme};
use crate::app::Viewer;
use crate::model::{CameraSettings, camera::Motion};
use crate::worker::Frame;

/// Most pixels that are rendered, whatever the size of the window.
const MOST_PIXELS: f64 = 1280.0 * 720.0;
/// Change of the distance per unit of the wheel.
const WHEEL: f64 = 0.002;
/// Nearest that the wheel gets to what is ahead, m.
const NEAREST_M: f64 = 0.05;

/// What the picture keeps between frames of the window.
pub struct PictureView {
    canvas: Canvas,
    size_px: Option<DVec2>,
    /// Place of the probe in the picture, in [0, 1] from the upper left corner.
    probe: Option<DVec2>,
}

impl PictureView {
    /// A picture that was not laid out yet; `window` is what draws where it shares its adapter with the renderer.
    pub fn new(window: Option<RenderState>) -> Self {
        Self {
            canvas: Canvas::new(window),
            size_px: None,
            probe: None,
        }
    }

    /// Size of the place for the picture, pixels; `None` before it was laid out.
    pub fn size_px(&self) -> Option<DVec2> {
        self.size_px
    }

    /// Whether the probe is somewhere on the picture.
    pub fn is_probing(&self) -> bool {
        self.probe.is_some()
    }

    /// Takes the probe off, for another scene.
    pub fn forget_probe(&mut self) {
        self.probe = None;
    }
}

/// Size of the render of a camera in a place of `limit` pixels.
pub fn render_size(camera: &CameraSettings, limit: DVec2) -> (u32, u32) {
    let own = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let most = (MOST_PIXELS / (own.x * own.y)).sqrt();
    let scale = (limit / own).min_element().min(most);
    let side = |full: f64| (full * scale).round().max(1.0) as u32;
    (side(own.x), side(own.y))
}

/// Shows the picture and what belongs on it.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    let area = ui.available_rect_before_wrap();
    let pixels = area.size() * ui.ctx().pixels_per_point();
    app.picture.size_px = Some(DVec2::new(
        f64::from(pixels.x.floor().max(16.0)),
        f64::from(pixels.y.floor().max(16.0)),
    ));
    let camera = &app.settings.camera;
    let rect = fitted(area, vec2(camera.width as f32, camera.height as f32));
    let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Picture"));
    let backdrop = theme::backdrop(ui);
    let Some(frame) = app.frame().cloned() else {
        ui.painter().rect_filled(area, 0.0, backdrop);
        ui.painter().text(
            area.center(),
            Align2::CENTER_CENTER,
            "Preparing the first picture...",
            FontId::proportional(18.0),
            Color32::GRAY,
        );
        return;
    };
    // The edges of what is filled are blurred and lie under the picture.
    for part in around(area, rect.shrink(1.0)) {
        ui.painter().rect_filled(part, 0.0, backdrop);
    }
    if !app.picture.canvas.draw(ui, rect, &frame) {
        ui.painter().rect_filled(rect, 0.0, backdrop);
    }
    clouds::circles(app, ui, rect);
    let legend = frame.shown.legend.as_ref();
    let taken = legend.map(|legend| overlay::legend(ui, rect, legend));
    if app.placed_cloud.is_some() {
        overlay::note(ui, rect, taken, "click where the cloud goes");
    } else if !app.is_current() {
        overlay::note(ui, rect, taken, "updating: earlier settings");
    } else if frame.denoised.is_some() {
        overlay::note(ui, rect, taken, "denoised (biased)");
    }
    app.picture.probe = response.hover_pos().map(|at| {
        let at = (at - rect.min) / rect.size();
        DVec2::new(f64::from(at.x), f64::from(at.y))
    });
    if let Some(text) = app.picture.probe.and_then(|at| probe_text(&frame, at)) {
        overlay::probe(ui, area, rect, taken, &text);
    }
    navigate(app, ui, &response, &frame);
}

/// The largest rectangle of these proportions in the middle of `place`.
fn fitted(area: Rect, proportions: Vec2) -> Rect {
    let scale = (area.size() / proportions).min_elem();
    Rect::from_center_size(area.center(), proportions * scale)
}

/// What `inner` leaves of `outer`. Only this is filled: where the window is drawn without a GPU, pixels that are drawn twice
/// cost twice.
fn around(outer: Rect, inner: Rect) -> [Rect; 4] {
    [
        Rect::from_min_max(outer.min, pos2(outer.right(), inner.top())),
        Rect::from_min_max(pos2(outer.left(), inner.bottom()), outer.max),
        Rect::from_min_max(
            pos2(outer.left(), inner.top()),
            pos2(inner.left(), inner.bottom()),
        ),
        Rect::from_min_max(inner.right_top(), pos2(outer.right(), inner.bottom())),
    ]
}

/// What is known about a place of the picture, in [0, 1] from its upper left corner.
pub fn probe_text(frame: &Frame, at: DVec2) -> Option<String> {
    let (width, height) = (frame.camera.width, frame.camera.height);
    let point = at * DVec2::new(f64::from(width), f64::from(height));
    let inside = (0.0..1.0).contains(&at.x) && (0.0..1.0).contains(&at.y);
    if !inside {
        return None;
    }
    let (column, row) = (point.x as usize, point.y as usize);
    let index = row * width as usize + column;
    let radiance = frame.shown.radiance.get(index)?;
    let counts = frame.shown.counts(index)?;
    let mut text = format!("radiance {} W/(m² sr)", three(radiance));
    let value = match &frame.shown.values {
        Some(LayerData::Scalar(values)) => values.get(index).map(|v| figure(f64::from(*v), 4)),
        Some(LayerData::Colour(values) | LayerData::Vector(values)) => values.get(index).map(three),
        None => None,
    };
    if let Some(value) = value {
        let unit = frame.shown.legend.map_or("", |legend| legend.unit);
        text += format!("\nlayer    {value} {unit}").trim_end();
    }
    text += &format!(
        "\ncounts   {} {} {}   pixel {column}, {row} of {width} x {height}",
        counts[0], counts[1], counts[2]
    );
    match surface_at(frame, at) {
        Some(point) => {
            let offset = point - frame.camera.position_m;
            text += &format!(
                "\ndepth    {:.3} m along the axis, {:.3} m away\nat       {:.2}, {:.2}, {:.2} m",
                offset.dot(frame.camera.forward),
                offset.length(),
                point.x,
                point.y,
                point.z
            );
        }
        None => text += "\ndepth    nothing ahead",
    }
    Some(text)
}

/// A value per channel or axis.
fn three(values: &[f32; 3]) -> String {
    values.map(|value| figure(f64::from(value), 3)).join(" ")
}

/// The first surface behind a place of the picture, m.
fn surface_at(frame: &Frame, at: DVec2) -> Option<DVec3> {
    let camera = &frame.camera;
    let ray = camera.ray(
        at.x * f64::from(camera.width),
        at.y * f64::from(camera.height),
    );
    let hit =
        frame
            .geometry
            .closest(ray.origin_m, ray.direction, f64::INFINITY, Primitive::None)?;
    Some(ray.origin_m + hit.t * ray.direction)
}

fn navigate(app: &mut Viewer, ui: &Ui, response: &egui::Response, frame: &Frame) {
    let width_px = f64::from(response.rect.width());
    let delta = response.drag_delta();
    let delta = DVec2::new(f64::from(delta.x), f64::from(delta.y));
    if delta != DVec2::ZERO {
        let distance_m = app.distance_ahead_m();
        let shift = ui.input(|i| i.modifiers.shift);
        let pan = shift || response.dragged_by(PointerButton::Middle);
        let motion = app.motion;
        app.move_camera(|camera| match motion {
            _ if pan => camera.pan(delta, width_px, distance_m),
            Motion::Orbit => camera.orbit(delta, width_px, distance_m),
            Motion::Fly | Motion::Vehicle => camera.turn(delta, width_px),
        });
    }
    if response.hovered() {
        let wheel = f64::from(ui.input(|i| i.smooth_scroll_delta().y));
        if wheel != 0.0 {
            let distance_m = app.distance_ahead_m();
            let step = (distance_m * (1.0 - (-WHEEL * wheel).exp())).min(distance_m - NEAREST_M);
            let motion = app.motion;
            app.move_camera(|camera| camera.step(motion, DVec3::new(0.0, 0.0, step)));
        }
    }
    if response.secondary_clicked()
        && let Some(at) = app.picture.probe
    {
        pixel::ask(app, ui, at);
    }
    if app.placed_cloud.is_some() {
        if response.clicked()
            && let Some(at) = app.picture.probe
        {
            clouds::put(app, surface_at(frame, at));
        }
        return;
    }
    if response.double_clicked()
        && let Some(at) = app.picture.probe
        && let Some(target) = surface_at(frame, at)
    {
        app.move_camera(|camera| camera.look_at(target));
    }
}
