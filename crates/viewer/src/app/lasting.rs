//! What is chosen in the window, from one run to the next.

use egui::{Context, ThemePreference};

use super::Viewer;
use crate::model::ShownLayer;
use crate::model::lasting::{Brightness, Choices};

impl Viewer {
    /// Chooses what was chosen in the run before; the window's own look is the program's business.
    pub(super) fn choose_as_before(&mut self) {
        let note = self.lasting.take_note();
        let choices = self.lasting.choices().clone();
        let layers = ShownLayer::all(&self.lamp_names()).into_iter();
        let mut layers = layers.filter(|(_, name)| *name == choices.layer);
        self.tab = choices.panel;
        self.display.layer = layers
            .next()
            .map_or(ShownLayer::Picture, |(layer, _)| layer);
        self.display.false_colour = choices.false_colour;
        self.display.logarithmic = choices.logarithmic;
        self.inspection.marks = choices.marks;
        self.clouds_shown = choices.clouds_shown;
        self.lamps_follow = choices.lamps_follow;
        self.motion = choices.motion;
        if let Some(note) = note {
            self.toasts.warn(note);
        }
    }

    /// Keeps what is chosen, where it changed.
    pub(super) fn keep_choices(&mut self, ctx: &Context) {
        if self.lasting.is_kept() {
            let choices = self.choices(ctx);
            self.lasting.keep(choices);
        }
    }

    fn choices(&self, ctx: &Context) -> Choices {
        let path = self.open.path.as_ref();
        let whole = path.map(|path| match uw_assets::shipped_name(path) {
            Some(_) => path.clone(),
            None => std::path::absolute(path).unwrap_or_else(|_| path.clone()),
        });
        Choices {
            panel: self.tab,
            brightness: match ctx.options(|options| options.theme_preference) {
                ThemePreference::Dark => Brightness::Dark,
                ThemePreference::Light => Brightness::Light,
                ThemePreference::System => Brightness::System,
            },
            controls: ctx.zoom_factor(),
            layer: self.layer_name(),
            false_colour: self.display.false_colour,
            logarithmic: self.display.logarithmic,
            marks: self.inspection.marks,
            clouds_shown: self.clouds_shown,
            lamps_follow: self.lamps_follow,
            motion: self.motion,
            scene: whole,
        }
    }

    /// The name of the shown layer.
    pub(super) fn layer_name(&self) -> String {
        let names = self.lamp_names();
        match self.display.layer.within(names.len()) {
            ShownLayer::Picture => String::new(),
            ShownLayer::Layer(layer) => layer.name(&names),
        }
    }

    pub(crate) fn lamp_names(&self) -> Vec<String> {
        let lamps = self.settings.lamps.iter();
        lamps.map(|lamp| lamp.name.clone()).collect()
    }
}

/// A theme as the window takes it.
pub fn theme(brightness: Brightness) -> ThemePreference {
    match brightness {
        Brightness::Dark => ThemePreference::Dark,
        Brightness::Light => ThemePreference::Light,
        Brightness::System => ThemePreference::System,
    }
}
