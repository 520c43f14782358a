//! The picture in the middle: shown, turned, probed.

use std::sync::Arc;

use eframe::egui_wgpu::RenderState;
use egui::{
    Align2, Color32, FontId, PointerButton, Rect, Response, Role, Sense, Ui, Vec2, WidgetInfo,
    pos2, vec2,
};
use glam::{DVec2, DVec3};
use uw_render::image::LayerData;
use uw_render::prepare::Primitive;

use super::canvas::{Canvas, Part};
use super::scale::figure;
use super::seen::Seen;
use super::stills::{Still, Stills};
use super::{clouds, compare, overlay, pins, pixel, theme};
use crate::app::Viewer;
use crate::model::zoom::Place;
use crate::model::{CameraSettings, camera::Motion, histogram, snapshots::Side};
use crate::worker::Frame;

/// Most pixels that are rendered, whatever the size of the window.
const MOST_PIXELS: f64 = 1280.0 * 720.0;
/// Change of the distance per unit of the wheel.
const WHEEL: f64 = 0.002;
/// Nearest that the wheel gets to what is ahead, m.
const NEAREST_M: f64 = 0.05;
/// All of a texture.
const WHOLE: Rect = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));

/// What the picture keeps between frames of the window.
pub struct PictureView {
    canvas: Canvas,
    stills: Stills,
    size_px: Option<DVec2>,
    place: Option<Place>,
    /// Place of the probe in the picture, in [0, 1] from the upper left corner.
    probe: Option<DVec2>,
}

impl PictureView {
    /// A picture that was not laid out yet; `window` is what draws where it shares its adapter with the renderer.
    pub fn new(window: Option<RenderState>) -> Self {
        Self {
            canvas: Canvas::new(window),
            stills: Stills::default(),
            size_px: None,
            place: None,
            probe: None,
        }
    }

    /// Size of the place for the picture, pixels; `None` before it was laid out.
    pub fn size_px(&self) -> Option<DVec2> {
        self.size_px
    }

    /// The place for the picture; `None` before it was laid out.
    pub fn place(&self) -> Option<Place> {
        self.place
    }

    /// Where the probe is on the picture, in [0, 1] from the upper left corner.
    pub fn probe(&self) -> Option<DVec2> {
        self.probe
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
    let seen = seen(app, ui, area);
    let response = ui.interact(
        seen.visible,
        ui.scope_id().with("picture"),
        Sense::click_and_drag(),
    );
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
    pictures(app, ui, &seen, &frame);
    clouds::circles(app, ui, seen.picture);
    let taken = notes(app, ui, &seen, &frame);
    let pointer = response.hover_pos();
    app.picture.probe = pointer.map(|at| seen.share(at));
    let compared = pointer.filter(|_| app.inspection.comparison.on);
    let kept = compared.and_then(|at| compare::probe_text(app, &seen, at));
    let live = || app.picture.probe.and_then(|at| probe_text(&frame, at));
    if let Some(text) = kept.or_else(live) {
        overlay::probe(ui, area, seen.visible, taken, &text);
    }
    navigate(app, ui, &response, (&seen, &frame));
}

/// Where the picture is, which is kept for keys and for the size of renders.
fn seen(app: &mut Viewer, ui: &Ui, area: Rect) -> Seen {
    let pixels = area.size() * ui.ctx().pixels_per_point();
    let size_px = DVec2::new(
        f64::from(pixels.x.floor().max(16.0)),
        f64::from(pixels.y.floor().max(16.0)),
    );
    let camera = &app.settings.camera;
    let proportions = vec2(camera.width as f32, camera.height as f32);
    let (rendered_px, _) = render_size(camera, size_px);
    let fitted_px = (pixels / proportions).min_elem() * proportions.x;
    let pixel_side = f64::from(fitted_px) / f64::from(rendered_px);
    let seen = Seen::new(area, app.inspection.zoom, proportions, pixel_side);
    app.picture.size_px = Some(size_px);
    app.picture.place = Some(seen.place);
    seen
}

/// The picture, or the two that are compared.
fn pictures(app: &mut Viewer, ui: &Ui, seen: &Seen, frame: &Frame) {
    let compares = app.inspection.comparison.on;
    // The edges of what is filled are blurred and lie under the picture. Kept pictures may have other proportions.
    let filled = match compares {
        true => Rect::from_center_size(seen.area.center(), Vec2::ZERO),
        false => seen.visible.shrink(1.0),
    };
    for part in around(seen.area, filled) {
        ui.painter().rect_filled(part, 0.0, theme::backdrop(ui));
    }
    match compares {
        true => compare::show(app, ui, seen, frame),
        false => one(app, ui, seen, frame, (Side::Live, seen.visible)),
    }
    app.picture.stills.forget_unused();
}

/// One picture with its marks, where `clip` is.
pub(super) fn one(
    app: &mut Viewer,
    ui: &Ui,
    seen: &Seen,
    frame: &Frame,
    (side, clip): (Side, Rect),
) {
    let painter = ui.painter_at(clip);
    let inspection = &app.inspection;
    let PictureView { canvas, stills, .. } = &mut app.picture;
    let (image, rect, still) = match inspection.snapshots.of(side) {
        Some(kept) => {
            let [width, height] = kept.image.size;
            let rect = seen.other(vec2(width as f32, height as f32));
            let make = || Arc::clone(&kept.image);
            let texture = stills.texture(ui.ctx(), Still::Kept(kept.id), make);
            painter.image(texture, rect, WHOLE, Color32::WHITE);
            let image = Some(&*kept.image).filter(|_| kept.has_counts);
            (image, rect, Still::MarksOfKept(kept.id))
        }
        None => {
            let part = Part::of(frame, seen.part());
            if !canvas.draw(&painter, seen.visible, part, frame) {
                painter.rect_filled(seen.visible, 0.0, theme::backdrop(ui));
            }
            let is_photograph = frame.shown.legend.is_none();
            let image = frame.shown.image().filter(|_| is_photograph);
            (image, seen.picture, Still::MarksOfLive(frame.serial))
        }
    };
    if let Some(image) = image.filter(|_| inspection.marks) {
        let make = || Arc::new(histogram::marks(image));
        let texture = stills.texture(ui.ctx(), still, make);
        painter.image(texture, rect, WHOLE, Color32::WHITE);
    }
}

/// What is written over the picture; the place of the scale of false colours.
fn notes(app: &Viewer, ui: &Ui, seen: &Seen, frame: &Frame) -> Option<Rect> {
    let legend = frame.shown.legend.as_ref();
    let taken = legend.map(|legend| overlay::legend(ui, seen.visible, legend));
    let note = if app.placed_cloud.is_some() {
        Some("click where the cloud goes")
    } else if !app.is_current() {
        Some("updating: earlier settings")
    } else if frame.denoised.is_some() {
        Some("denoised (biased)")
    } else {
        None
    };
    if let Some(note) = note {
        overlay::note(ui, seen.visible, taken, note);
    }
    if app.inspection.comparison.on {
        compare::names(app, ui, seen.visible, taken);
    }
    pins::marks(app, ui, seen, frame);
    taken
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

/// Column, row and index of the pixel at a place of the picture, in [0, 1] from its upper left corner.
pub(super) fn pixel_at(frame: &Frame, at: DVec2) -> Option<(usize, usize, usize)> {
    let (width, height) = (frame.camera.width, frame.camera.height);
    let inside = (0.0..1.0).contains(&at.x) && (0.0..1.0).contains(&at.y);
    let point = at * DVec2::new(f64::from(width), f64::from(height));
    let (column, row) = (point.x as usize, point.y as usize);
    inside.then_some((column, row, row * width as usize + column))
}

/// What is known about a place of the picture, in [0, 1] from its upper left corner.
pub fn probe_text(frame: &Frame, at: DVec2) -> Option<String> {
    let (width, height) = (frame.camera.width, frame.camera.height);
    let (column, row, index) = pixel_at(frame, at)?;
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
pub(super) fn three(values: &[f32; 3]) -> String {
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

fn navigate(app: &mut Viewer, ui: &Ui, response: &Response, (seen, frame): (&Seen, &Frame)) {
    let control = ui.input(|i| i.modifiers.command);
    let delta = response.drag_delta();
    let delta = DVec2::new(f64::from(delta.x), f64::from(delta.y));
    if delta != DVec2::ZERO && control {
        app.inspection.zoom.shift(&seen.place, delta);
    } else if delta != DVec2::ZERO {
        drag(app, ui, response, delta, f64::from(seen.picture.width()));
    }
    if response.hovered() {
        let (wheel, zoom) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        if let Some(at) = app.picture.probe.filter(|_| zoom != 1.0) {
            app.inspection.zoom.by(&seen.place, at, f64::from(zoom));
        } else if wheel != 0.0 {
            step(app, f64::from(wheel));
        }
    }
    if response.clicked() && control {
        app.pin();
        return;
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

/// Turns or shifts the view by a drag across a picture `width_px` wide.
fn drag(app: &mut Viewer, ui: &Ui, response: &Response, delta: DVec2, width_px: f64) {
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

/// Goes closer or farther by the wheel.
fn step(app: &mut Viewer, wheel: f64) {
    let distance_m = app.distance_ahead_m();
    let step = (distance_m * (1.0 - (-WHEEL * wheel).exp())).min(distance_m - NEAREST_M);
    let motion = app.motion;
    app.move_camera(|camera| camera.step(motion, DVec3::new(0.0, 0.0, step)));
}
