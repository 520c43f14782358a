//! Keys that no menu has: they move the camera, the wiper and what is zoomed.

use egui::{Context, Key};
use glam::{DVec2, DVec3};

use super::commands;
use crate::app::Viewer;
use crate::model::camera::Motion;

/// Speed of keys, as a share of the distance to what is ahead per second.
const SPEED: f64 = 0.6;
/// How far a key moves the wiper, as a share of what is seen.
const WIPER_STEP: f64 = 0.02;
/// By how much a key zooms.
const ZOOM_STEP: f64 = std::f64::consts::SQRT_2;
/// How far an arrow moves what is zoomed, as a share of its place.
const ARROW_STEP: f64 = 0.1;

/// What the help lists besides the commands of the menus: keys and mouse, and what they do.
pub const HELP: [(&str, &str); 18] = [
    ("Drag", "Orbit, or turn the view"),
    ("Shift+drag, middle drag", "Shift the view"),
    ("Wheel", "Closer, farther"),
    ("W A S D", "Ahead, left, back, right"),
    ("R F", "Up, down"),
    ("Hover", "Probe: radiance, counts, depth"),
    ("Double click", "Look at this point"),
    ("Right click", "Spectrum of the light of this pixel"),
    ("1 2 3", "Orbit, fly, vehicle"),
    ("Ctrl+wheel, + -", "Zoom to pixels"),
    ("Ctrl+drag, arrows", "Shift what is zoomed"),
    ("Ctrl+click", "Pin this pixel"),
    (", .", "Wiper left, right"),
    ("Esc", "Leave a dialog, or a cloud's place"),
    ("Ctrl+plus, minus", "Size of the controls"),
    ("Drop a file", "Open it"),
    ("Tab, Space, arrows", "To each control, press it, change it"),
    ("Ctrl+Shift+Z", "Redo"),
];

/// Does what the keys say.
pub fn handle(app: &mut Viewer, ctx: &Context) {
    let types = ctx.text_edit_focused() || app.files.is_some() || app.gallery_open;
    commands::handle(app, ctx, types);
    let key = |key: Key| ctx.input(|i| i.key_pressed(key) && i.modifiers.is_none());
    if key(Key::Escape) {
        app.placed_cloud = None;
    }
    if types {
        return;
    }
    for (k, motion) in [
        (Key::Num1, Motion::Orbit),
        (Key::Num2, Motion::Fly),
        (Key::Num3, Motion::Vehicle),
    ] {
        if key(k) {
            app.motion = motion;
        }
    }
    inspect(app, ctx);
    fly(app, ctx);
}

/// Looks closely, as the keys say.
fn inspect(app: &mut Viewer, ctx: &Context) {
    let key = |key: Key| ctx.input(|i| i.key_pressed(key) && i.modifiers.is_none());
    let comparison = &mut app.inspection.comparison;
    for (k, step) in [(Key::Comma, -WIPER_STEP), (Key::Period, WIPER_STEP)] {
        if key(k) {
            comparison.wiper = (comparison.wiper + step).clamp(0.0, 1.0);
        }
    }
    zoom(app, ctx);
}

/// Zooms about the pointer, or about the middle of what is seen.
fn zoom(app: &mut Viewer, ctx: &Context) {
    let Some(place) = app.picture.place() else {
        return;
    };
    let probe = app.picture.probe();
    let zoom = &mut app.inspection.zoom;
    let at = probe.unwrap_or(zoom.middle());
    // On many keyboards plus needs Shift.
    let pressed = |key: Key| {
        ctx.input(|i| i.key_pressed(key) && (i.modifiers.is_none() || i.modifiers.shift_only()))
    };
    if pressed(Key::Plus) || pressed(Key::Equals) {
        zoom.by(&place, at, ZOOM_STEP);
    }
    if pressed(Key::Minus) {
        zoom.by(&place, at, 1.0 / ZOOM_STEP);
    }
    // Arrows belong to what has the keyboard.
    if zoom.is_fit() || ctx.memory(|m| m.focused().is_some()) {
        return;
    }
    for (key, direction) in [
        (Key::ArrowLeft, DVec2::X),
        (Key::ArrowRight, -DVec2::X),
        (Key::ArrowUp, DVec2::Y),
        (Key::ArrowDown, -DVec2::Y),
    ] {
        if pressed(key) {
            zoom.shift(&place, ARROW_STEP * direction * place.room);
        }
    }
}

/// Moves the camera while keys are down.
fn fly(app: &mut Viewer, ctx: &Context) {
    let (step, seconds) = ctx.input(|i| {
        let axis = |plus, minus| {
            let down = |key| f64::from(u8::from(i.key_down(key)));
            down(plus) - down(minus)
        };
        let step = DVec3::new(
            axis(Key::D, Key::A),
            axis(Key::R, Key::F),
            axis(Key::W, Key::S),
        );
        let free = i.modifiers.is_none() || i.modifiers.shift_only();
        let step = if free { step } else { DVec3::ZERO };
        (step, f64::from(i.stable_dt).min(0.1))
    });
    if step == DVec3::ZERO {
        return;
    }
    let reach = app.distance_ahead_m().clamp(0.2, 20.0);
    let motion = app.motion;
    app.move_camera(|camera| camera.step(motion, step * SPEED * reach * seconds));
    ctx.request_repaint();
}
