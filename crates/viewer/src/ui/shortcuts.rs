//! Keys.

use egui::{Context, Key, KeyboardShortcut, Modifiers};
use glam::{DVec2, DVec3};

use crate::app::{FilePurpose, Tab, Viewer};
use crate::model::camera::Motion;
use crate::model::zoom::Zoom;
use crate::model::{FalseColour, ShownLayer};

/// Open a file.
pub const OPEN: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::O);
/// Save the scene.
pub const SAVE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::S);
/// Export the picture.
pub const EXPORT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::E);
/// Undo.
pub const UNDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Z);
/// Redo.
pub const REDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Y);
/// Redo, as on a Mac.
const REDO_TOO: KeyboardShortcut =
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
/// Copy the command that renders the picture.
pub const COPY_COMMAND: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::K);
/// Copy the scene as text.
pub const COPY_SCENE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::T);
/// Quit.
pub const QUIT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Q);

/// Speed of keys, as a share of the distance to what is ahead per second.
const SPEED: f64 = 0.6;
/// How far a key moves the wiper, as a share of what is seen.
const WIPER_STEP: f64 = 0.02;
/// By how much a key zooms.
const ZOOM_STEP: f64 = std::f64::consts::SQRT_2;
/// How far an arrow moves what is zoomed, as a share of its place.
const ARROW_STEP: f64 = 0.1;

/// What the help lists: keys and what they do.
pub const HELP: [(&str, &str); 35] = [
    ("Drag", "Orbit, or turn the view"),
    ("Shift + drag, middle drag", "Shift the view"),
    ("Wheel", "Closer, farther"),
    ("W A S D", "Ahead, left, back, right"),
    ("R F", "Up, down"),
    ("Hover", "Probe: radiance, counts, depth"),
    ("Double click", "Look at this point"),
    ("Right click", "Spectrum of the light of this pixel"),
    ("1 2 3", "Orbit, fly, vehicle"),
    ("Space", "Pause, go on"),
    ("Backspace", "Start the picture anew"),
    ("F2 F3 F4 F5", "Water, scene, guidance, inspect"),
    ("Ctrl + wheel, + -", "Zoom to pixels"),
    ("Ctrl + drag, arrows", "Shift what is zoomed"),
    ("0, 9", "All of the picture, 1:1"),
    ("P, Ctrl + click", "Pin this pixel"),
    ("Delete", "Remove the last pin"),
    ("C", "Mark clipped and black pixels"),
    ("L, Shift + L", "Next layer, layer before"),
    ("V, G", "False colours, logarithm"),
    ("N", "Denoise (biased)"),
    ("K", "Keep this picture"),
    ("B", "Compare A | B"),
    (", .", "Wiper left, right"),
    ("Ctrl + O", "Open a scene or glTF file"),
    ("Ctrl + S", "Save the scene"),
    ("Ctrl + E", "Export the picture"),
    ("Ctrl + K", "Copy as command"),
    ("Ctrl + T", "Copy as scene"),
    ("Ctrl + Z, Ctrl + Y", "Undo, redo"),
    ("Ctrl + plus, minus", "Size of the controls"),
    ("Drop a file", "Open it"),
    ("Tab, Space, arrows", "To each control, press it, change it"),
    ("F1", "This help"),
    ("Ctrl + Q", "Quit"),
];

/// How a shortcut is written.
pub fn text(shortcut: &KeyboardShortcut) -> String {
    shortcut.format(&egui::ModifierNames::NAMES, false)
}

/// Does what the keys say.
pub fn handle(app: &mut Viewer, ctx: &Context) {
    let pressed = |shortcut: &KeyboardShortcut| ctx.input_mut(|i| i.consume_shortcut(shortcut));
    if pressed(&OPEN) {
        app.ask_file(FilePurpose::OpenScene);
    }
    if pressed(&SAVE) {
        app.ask_file(FilePurpose::SaveScene);
    }
    if pressed(&EXPORT) {
        app.ask_file(FilePurpose::ExportPicture);
    }
    if pressed(&REDO_TOO) || pressed(&REDO) {
        app.redo();
    }
    if pressed(&UNDO) {
        app.undo();
    }
    if pressed(&COPY_COMMAND) {
        app.copy_command(ctx);
    }
    if pressed(&COPY_SCENE) {
        app.copy_scene(ctx);
    }
    if pressed(&QUIT) {
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
    }
    let key = |key: Key| ctx.input(|i| i.key_pressed(key) && i.modifiers.is_none());
    if key(Key::Escape) {
        app.placed_cloud = None;
    }
    if key(Key::F1) {
        app.help_open = !app.help_open;
    }
    for (k, tab) in [
        (Key::F2, Tab::Water),
        (Key::F3, Tab::Scene),
        (Key::F4, Tab::Guidance),
        (Key::F5, Tab::Inspect),
    ] {
        if key(k) {
            app.tab = tab;
        }
    }
    if ctx.text_edit_focused() || app.files.is_some() {
        return;
    }
    if key(Key::Space) && ctx.memory(|m| m.focused().is_none()) {
        app.paused = !app.paused;
    }
    if key(Key::Backspace) {
        app.reset_picture();
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
    look(app, ctx);
    inspect(app, ctx);
    fly(app, ctx);
}

/// Chooses what is shown, and how.
fn look(app: &mut Viewer, ctx: &Context) {
    let key = |key: Key| ctx.input(|i| i.key_pressed(key) && i.modifiers.is_none());
    let back = ctx.input(|i| i.key_pressed(Key::L) && i.modifiers.shift_only());
    if key(Key::L) || back {
        let layers = ShownLayer::all(&app.lamp_names());
        let layers: Vec<_> = layers.into_iter().map(|(layer, _)| layer).collect();
        app.display.layer = next(&layers, app.display.layer, back);
    }
    if key(Key::V) {
        let colours = FalseColour::ALL.map(|(colours, _)| colours);
        app.display.false_colour = next(&colours, app.display.false_colour, false);
    }
    if key(Key::G) {
        app.display.logarithmic = !app.display.logarithmic;
    }
    if key(Key::N) {
        app.denoised = !app.denoised;
    }
}

/// What comes after `now`, or before it; the ends meet.
fn next<T: Copy + PartialEq>(all: &[T], now: T, back: bool) -> T {
    let at = all.iter().position(|one| *one == now).unwrap_or(0);
    let step = if back { all.len() - 1 } else { 1 };
    all.get((at + step) % all.len()).copied().unwrap_or(now)
}

/// Looks closely, as the keys say.
fn inspect(app: &mut Viewer, ctx: &Context) {
    let key = |key: Key| ctx.input(|i| i.key_pressed(key) && i.modifiers.is_none());
    if key(Key::K) {
        app.keep_picture();
    }
    if key(Key::P) {
        app.pin();
    }
    let inspection = &mut app.inspection;
    if key(Key::Delete) {
        inspection.pins.pop();
    }
    if key(Key::C) {
        inspection.marks = !inspection.marks;
    }
    let comparison = &mut inspection.comparison;
    if key(Key::B) {
        comparison.on = !comparison.on;
    }
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
    if pressed(Key::Num0) {
        *zoom = Zoom::default();
    }
    if pressed(Key::Num9) {
        zoom.to_pixels(&place, at);
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
