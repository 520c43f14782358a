//! What menus and keys do: one list for both, and for the help.

use egui::{Button, Context, Key, KeyboardShortcut, Modifiers, RichText, Ui, ViewportCommand};

use crate::app::{FilePurpose, Tab, Viewer};
use crate::model::zoom::Zoom;
use crate::model::{FalseColour, ShownLayer};

/// Something that a menu offers and a key does.
#[derive(Clone, Copy, Debug)]
pub struct Command {
    /// What the menu and the help call it.
    pub name: &'static str,
    /// Its key.
    pub keys: KeyboardShortcut,
    does: Does,
    can: fn(&Viewer) -> bool,
    on: Option<fn(&Viewer) -> bool>,
}

#[derive(Clone, Copy, Debug)]
enum Does {
    Call(fn(&mut Viewer, &Context)),
    Ask(FilePurpose),
}

/// The File menu.
pub const FILE: [Command; 11] = [
    asks(
        "Open scene or glTF...",
        CTRL,
        Key::O,
        FilePurpose::OpenScene,
    ),
    command("Recent and example scenes...", BOTH, Key::O, |app, _| {
        app.gallery_open = true;
    }),
    asks("Save scene as...", CTRL, Key::S, FilePurpose::SaveScene),
    asks(
        "Export picture (PNG, TIFF)...",
        CTRL,
        Key::E,
        FilePurpose::ExportPicture,
    ),
    asks(
        "Export EXR with all layers...",
        BOTH,
        Key::E,
        FilePurpose::ExportExr,
    ),
    asks(
        "Export plots (SVG, PNG)...",
        CTRL,
        Key::D,
        FilePurpose::ExportPlots,
    ),
    asks("Open profile...", CTRL, Key::P, FilePurpose::OpenProfile),
    asks("Save profile...", BOTH, Key::P, FilePurpose::SaveProfile)
        .only_if(|app| app.guidance.profile.is_some()),
    asks("Open recording...", CTRL, Key::R, FilePurpose::OpenRecord),
    asks("Open network...", CTRL, Key::M, FilePurpose::OpenModel),
    command("Quit", CTRL, Key::Q, |_, ctx| {
        ctx.send_viewport_cmd(ViewportCommand::Close);
    }),
];

/// The Edit menu.
pub const EDIT: [Command; 8] = [
    command("Undo", CTRL, Key::Z, |app, _| app.undo()).only_if(|app| app.can_undo_redo().0),
    command("Redo", CTRL, Key::Y, |app, _| app.redo()).only_if(|app| app.can_undo_redo().1),
    command("Copy as command", CTRL, Key::K, Viewer::copy_command),
    command("Copy as scene", CTRL, Key::T, Viewer::copy_scene),
    command("Keep this picture", PLAIN, Key::K, |app, _| {
        app.keep_picture()
    }),
    command(
        "Pin the pixel under the pointer",
        PLAIN,
        Key::P,
        |app, _| app.pin(),
    ),
    command("Remove the last pin", PLAIN, Key::Delete, |app, _| {
        app.inspection.pins.pop();
    })
    .only_if(|app| !app.inspection.pins.is_empty()),
    command("Start the picture anew", PLAIN, Key::Backspace, |app, _| {
        app.reset_picture()
    }),
];

/// The View menu.
pub const VIEW: [Command; 15] = [
    command("Water", PLAIN, Key::F2, |app, _| app.tab = Tab::Water)
        .switch(|app| app.tab == Tab::Water),
    command("Scene", PLAIN, Key::F3, |app, _| app.tab = Tab::Scene)
        .switch(|app| app.tab == Tab::Scene),
    command("Guidance", PLAIN, Key::F4, |app, _| app.tab = Tab::Guidance)
        .switch(|app| app.tab == Tab::Guidance),
    command("Inspect", PLAIN, Key::F5, |app, _| app.tab = Tab::Inspect)
        .switch(|app| app.tab == Tab::Inspect),
    command("Pause", PLAIN, Key::Space, |app, _| {
        app.paused = !app.paused
    })
    .switch(|app| app.paused),
    command("Denoise (biased)", PLAIN, Key::N, |app, _| {
        app.denoised = !app.denoised
    })
    .switch(|app| app.denoised),
    command("Next layer", PLAIN, Key::L, |app, _| turn_layer(app, false)),
    command("Layer before", Modifiers::SHIFT, Key::L, |app, _| {
        turn_layer(app, true)
    }),
    command("Next false colours", PLAIN, Key::V, |app, _| {
        let colours = FalseColour::ALL.map(|(colours, _)| colours);
        app.display.false_colour = next(&colours, app.display.false_colour, false);
    }),
    command("Logarithm of false colours", PLAIN, Key::G, |app, _| {
        app.display.logarithmic = !app.display.logarithmic;
    })
    .switch(|app| app.display.logarithmic),
    command("Mark clipped and black pixels", PLAIN, Key::C, |app, _| {
        app.inspection.marks = !app.inspection.marks;
    })
    .switch(|app| app.inspection.marks),
    command("Compare A | B", PLAIN, Key::B, |app, _| {
        app.inspection.comparison.on = !app.inspection.comparison.on;
    })
    .switch(|app| app.inspection.comparison.on),
    command("All of the picture", PLAIN, Key::Num0, |app, _| {
        app.inspection.zoom = Zoom::default();
    }),
    command("Picture 1:1", PLAIN, Key::Num9, |app, _| {
        if let Some(place) = app.picture_place() {
            let zoom = &mut app.inspection.zoom;
            let at = app.picture.probe().unwrap_or(zoom.middle());
            zoom.to_pixels(&place, at);
        }
    }),
    command("Lamps move with the camera", PLAIN, Key::M, |app, _| {
        app.lamps_follow = !app.lamps_follow;
    })
    .switch(|app| app.lamps_follow),
];

/// The Help menu.
pub const HELP: [Command; 1] = [command("Keys and mouse", PLAIN, Key::F1, |app, _| {
    app.help_open = !app.help_open;
})];

const CTRL: Modifiers = Modifiers::COMMAND;
const BOTH: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);
const PLAIN: Modifiers = Modifiers::NONE;
/// Redo, as on a Mac.
const REDO_TOO: KeyboardShortcut = KeyboardShortcut::new(BOTH, Key::Z);

/// All, in the order of the menus.
pub fn all() -> impl Iterator<Item = &'static Command> {
    FILE.iter().chain(&EDIT).chain(&VIEW).chain(&HELP)
}

const fn command(
    name: &'static str,
    modifiers: Modifiers,
    key: Key,
    does: fn(&mut Viewer, &Context),
) -> Command {
    Command {
        name,
        keys: KeyboardShortcut::new(modifiers, key),
        does: Does::Call(does),
        can: |_| true,
        on: None,
    }
}

/// A command that asks for a file.
const fn asks(name: &'static str, modifiers: Modifiers, key: Key, purpose: FilePurpose) -> Command {
    Command {
        does: Does::Ask(purpose),
        ..command(name, modifiers, key, |_, _| ())
    }
}

impl Command {
    /// What can be done under a condition.
    const fn only_if(self, can: fn(&Viewer) -> bool) -> Self {
        Self { can, ..self }
    }

    /// What is on or off.
    const fn switch(self, on: fn(&Viewer) -> bool) -> Self {
        Self {
            on: Some(on),
            ..self
        }
    }

    /// How its key is written.
    pub fn keys_text(&self) -> String {
        self.keys.format(&egui::ModifierNames::NAMES, false)
    }

    /// Its row in a menu.
    pub fn item(&self, app: &mut Viewer, ui: &mut Ui) {
        let is_on = self.on.is_some_and(|on| on(app));
        let keys = RichText::new(self.keys_text());
        let keys = match is_on {
            // As dark letters these are not read on the colour of what is on.
            true => keys.color(ui.visuals().selection.stroke.color),
            false => keys,
        };
        let button = Button::new(self.name).selected(is_on).shortcut_text(keys);
        if ui.add_enabled((self.can)(app), button).clicked() {
            self.run(app, &ui.ctx().clone());
        }
    }

    fn run(&self, app: &mut Viewer, ctx: &Context) {
        match self.does {
            Does::Call(does) => does(app, ctx),
            Does::Ask(purpose) => app.ask_file(purpose),
        }
    }

    /// Whether its key is one that is typed into a text.
    fn is_typed(&self) -> bool {
        let function = [Key::F1, Key::F2, Key::F3, Key::F4, Key::F5];
        !self.keys.modifiers.command && !function.contains(&self.keys.logical_key)
    }
}

/// Does what the keys say. `types`: text is typed, or a dialog is open.
pub fn handle(app: &mut Viewer, ctx: &Context, types: bool) {
    if ctx.input_mut(|i| i.consume_shortcut(&REDO_TOO)) {
        app.redo();
    }
    let has_focus = ctx.memory(|m| m.focused().is_some());
    // A key with Shift is taken for the one without where that comes first.
    let (shifted, plain): (Vec<&Command>, Vec<&Command>) =
        all().partition(|command| command.keys.modifiers.shift);
    for command in shifted.into_iter().chain(plain) {
        // Space presses what has the keyboard.
        let belongs_elsewhere = has_focus && command.keys.logical_key == Key::Space;
        if (command.is_typed() && (types || belongs_elsewhere)) || !(command.can)(app) {
            continue;
        }
        if ctx.input_mut(|i| i.consume_shortcut(&command.keys)) {
            command.run(app, ctx);
        }
    }
}

/// The layer after the one that is shown, or before it.
fn turn_layer(app: &mut Viewer, back: bool) {
    let layers = ShownLayer::all(&app.lamp_names());
    let layers: Vec<_> = layers.into_iter().map(|(layer, _)| layer).collect();
    app.display.layer = next(&layers, app.display.layer, back);
}

/// What comes after `now`, or before it; the ends meet.
fn next<T: Copy + PartialEq>(all: &[T], now: T, back: bool) -> T {
    let at = all.iter().position(|one| *one == now).unwrap_or(0);
    let step = if back { all.len() - 1 } else { 1 };
    all.get((at + step) % all.len()).copied().unwrap_or(now)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_commands_share_a_key_or_a_name() {
        for (i, one) in all().enumerate() {
            for other in all().skip(i + 1) {
                assert_ne!(one.keys, other.keys, "{} {}", one.name, other.name);
                assert_ne!(one.name, other.name);
            }
        }
    }
}
