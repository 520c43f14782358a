//! What of the window lasts from one run to the next.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::FalseColour;
use super::camera::Motion;
use super::recent::{keep, state_folder};

/// Sizes of the controls that can be set, against the usual one.
pub const CONTROLS: std::ops::RangeInclusive<f32> = 0.6..=2.5;

/// Which panel is open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tab {
    /// The water.
    #[default]
    Water,
    /// Objects, camera, lamps, sensor.
    Scene,
    /// Calibration and advice.
    Guidance,
    /// Comparison, histogram, zoom, pinned pixels.
    Inspect,
}

/// Dark or light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Brightness {
    /// Dark.
    #[default]
    Dark,
    /// Light.
    Light,
    /// As the system is.
    System,
}

/// What was chosen in the window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Choices {
    /// The open panel.
    pub panel: Tab,
    /// Dark or light.
    pub brightness: Brightness,
    /// Size of the controls, against the usual one.
    pub controls: f32,
    /// Name of the shown layer.
    pub layer: String,
    /// False colours.
    pub false_colour: FalseColour,
    /// Whether they follow the logarithm.
    pub logarithmic: bool,
    /// Whether clipped and black pixels are marked.
    pub marks: bool,
    /// Whether clouds have circles in the picture.
    pub clouds_shown: bool,
    /// Whether the lamps move with the camera.
    pub lamps_follow: bool,
    /// How drags and keys move the camera.
    pub motion: Motion,
    /// The scene that was open.
    pub scene: Option<PathBuf>,
}

impl Default for Choices {
    fn default() -> Self {
        Self {
            panel: Tab::default(),
            brightness: Brightness::default(),
            controls: 1.0,
            layer: String::new(),
            false_colour: FalseColour::default(),
            logarithmic: false,
            marks: false,
            clouds_shown: true,
            lamps_follow: true,
            motion: Motion::default(),
            scene: None,
        }
    }
}

/// The choices, and the file that keeps them.
#[derive(Clone, Debug, Default)]
pub struct Lasting {
    store: Option<PathBuf>,
    choices: Choices,
    note: Option<String>,
}

impl Lasting {
    /// Those of the user, kept beside the list of the files opened last; nowhere without a folder for them.
    pub fn of_user() -> Self {
        let store = state_folder().map(|folder| folder.join("window.json"));
        store.map_or_else(Self::default, Self::stored_in)
    }

    /// Those kept in `store`. A file that cannot be used gives the usual ones and a note.
    pub fn stored_in(store: PathBuf) -> Self {
        let read = match std::fs::read_to_string(&store) {
            Ok(text) => serde_json::from_str(&text).map_err(|error| error.to_string()),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Choices::default()),
            Err(error) => Err(error.to_string()),
        };
        let note = read.as_ref().err().map(|error| {
            let store = store.display();
            format!("{store}: {error}\nThe window is as at first.")
        });
        let mut choices = read.unwrap_or_default();
        choices.controls = choices.controls.clamp(*CONTROLS.start(), *CONTROLS.end());
        Self {
            store: Some(store),
            choices,
            note,
        }
    }

    /// What was chosen in the run before.
    pub fn choices(&self) -> &Choices {
        &self.choices
    }

    /// Whether choices are kept.
    pub fn is_kept(&self) -> bool {
        self.store.is_some()
    }

    /// Why the file could not be used, once.
    pub fn take_note(&mut self) -> Option<String> {
        self.note.take()
    }

    /// Keeps what is chosen now, where it is not what is kept.
    pub fn keep(&mut self, choices: Choices) {
        let Some(store) = self.store.as_ref().filter(|_| choices != self.choices) else {
            return;
        };
        let text = serde_json::to_string_pretty(&choices).unwrap_or_default();
        keep(store, &text);
        self.choices = choices;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_last_and_what_a_file_lacks_is_as_at_first() {
        let folder = tempfile::tempdir().expect("folder");
        let store = folder.path().join("deep/window.json");
        let mut lasting = Lasting::stored_in(store.clone());
        assert_eq!(lasting.choices(), &Choices::default());
        assert_eq!(lasting.take_note(), None);
        let chosen = Choices {
            panel: Tab::Inspect,
            brightness: Brightness::Light,
            controls: 1.3,
            layer: "lamp.left".to_owned(),
            false_colour: FalseColour::Inferno,
            logarithmic: true,
            marks: true,
            clouds_shown: false,
            lamps_follow: false,
            motion: Motion::Vehicle,
            scene: Some("/s/reef.toml".into()),
        };
        lasting.keep(chosen.clone());
        assert_eq!(Lasting::stored_in(store.clone()).choices(), &chosen);
        std::fs::write(&store, r#"{"controls": 1e9, "future": 1}"#).expect("written");
        let expected = Choices {
            controls: 2.5,
            ..Choices::default()
        };
        assert_eq!(Lasting::stored_in(store).choices(), &expected);
    }

    #[test]
    fn a_broken_file_gives_what_is_usual_and_a_note() {
        let folder = tempfile::tempdir().expect("folder");
        let store = folder.path().join("window.json");
        for text in [
            "",
            "{",
            "[1, 2]",
            r#"{"panel": "cellar"}"#,
            r#"{"controls": null}"#,
        ] {
            std::fs::write(&store, text).expect("written");
            let mut lasting = Lasting::stored_in(store.clone());
            assert_eq!(lasting.choices(), &Choices::default(), "{text}");
            let note = lasting.take_note().expect("a note");
            assert!(note.contains("window.json: "), "{note}");
        }
    }
}
