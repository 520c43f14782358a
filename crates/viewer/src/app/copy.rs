//! What goes to the clipboard: the command that renders the picture, and the scene.

use std::path::{Component, Path, PathBuf};

use egui::Context;

use super::{FilePurpose, Viewer};
use crate::model::command::{Wanted, command};
use crate::model::scene_text::scene_text;

impl Viewer {
    /// Copies the command that renders what is set; asks for a file first where options cannot say it.
    pub fn copy_command(&mut self, ctx: &Context) {
        let both = (&self.filed, &self.settings);
        match command(&self.open, both, &self.wanted()) {
            Ok(text) => {
                ctx.copy_text(text);
                self.toasts.info("Copied the command");
            }
            Err(reason) => {
                self.toasts.warn(format!("Save the scene first: {reason}"));
                self.ask_file(FilePurpose::SaveForCommand);
            }
        }
    }

    /// Copies the scene as the text of a scene file, which can lie anywhere.
    pub fn copy_scene(&mut self, ctx: &Context) {
        ctx.copy_text(scene_text(&self.open, &self.settings, &root()));
        self.toasts.info("Copied the scene");
    }

    /// What the picture was asked for, besides its scene.
    fn wanted(&self) -> Wanted {
        let frame = self.frame.as_ref();
        let camera = &self.settings.camera;
        Wanted {
            samples: frame.map_or(1, |frame| frame.samples.max(1)),
            size_px: match self.submitted.as_ref() {
                Some(submitted) => (submitted.camera.width, submitted.camera.height),
                None => (camera.width, camera.height),
            },
            seed: self.seed,
            layer: Some(self.layer_name()).filter(|name| !name.is_empty()),
            denoised: self.denoised,
        }
    }
}

/// The root of the file system, from which paths are whole.
fn root() -> PathBuf {
    let here = std::env::current_dir().unwrap_or_default();
    let is_root = |c: &Component<'_>| matches!(c, Component::Prefix(_) | Component::RootDir);
    let root: PathBuf = here.components().take_while(is_root).collect();
    match root.as_os_str().is_empty() {
        true => Path::new("/").to_path_buf(),
        false => root,
    }
}
