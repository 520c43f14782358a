//! Objects that were changed are read again on a thread of their own; the picture follows.

use std::path::Path;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use uw_render::scene::SceneError;

use super::Viewer;
use crate::background::step_back;
use crate::model::object::Reflectance;
use crate::model::paths::rebased;
use crate::model::rebuilt::Rebuilt;

/// Objects that are being read.
pub(super) type Rebuilding = Receiver<Result<Rebuilt, SceneError>>;

impl Viewer {
    /// Takes objects that were read, and has those read that are set now.
    pub(super) fn poll_objects(&mut self, ctx: &egui::Context) {
        match self.rebuilding.as_ref().map(Receiver::try_recv) {
            None => {}
            Some(Err(TryRecvError::Empty)) => return,
            Some(Err(TryRecvError::Disconnected)) => {
                self.leave_objects("reading the objects failed".to_owned());
            }
            Some(Ok(Ok(rebuilt))) => self.take_rebuilt(rebuilt),
            Some(Ok(Err(error))) => self.leave_objects(error.to_string()),
        }
        if self.settings.objects != self.open.objects {
            self.rebuild(ctx);
        }
    }

    fn rebuild(&mut self, ctx: &egui::Context) {
        let (sender, receiver) = channel();
        let (objects, folder) = (self.settings.objects.clone(), self.open.base_dir.clone());
        let ctx = ctx.clone();
        let spawned = std::thread::Builder::new()
            .name("objects".to_owned())
            .spawn(move || {
                step_back();
                // Without a listener another scene is open.
                let _ = sender.send(Rebuilt::read(objects, &folder));
                ctx.request_repaint();
            });
        match spawned {
            Ok(_) => self.rebuilding = Some(receiver),
            Err(error) => self.leave_objects(format!("cannot read objects now: {error}")),
        }
    }

    fn take_rebuilt(&mut self, rebuilt: Rebuilt) {
        self.rebuilding = None;
        for warning in &rebuilt.warnings {
            if !self.open.warnings.contains(warning) {
                self.toasts.warn(warning.clone());
            }
        }
        rebuilt.tell(&mut self.settings);
        self.open.warnings = rebuilt.warnings;
        self.open.geometry = rebuilt.geometry;
        self.open.objects = rebuilt.objects;
        self.geometry_changed = true;
        self.picture.forget_probe();
    }

    /// The objects stay as they were.
    fn leave_objects(&mut self, reason: String) {
        self.rebuilding = None;
        self.settings.objects = self.open.objects.clone();
        self.toasts
            .error(format!("{reason}\nThe objects stay as they were."));
    }

    /// Gives the object that the scene panel shows a texture.
    pub(super) fn give_texture(&mut self, file: &Path) {
        let folder = &self.open.base_dir;
        let path = rebased(file, Path::new(""), folder);
        if let Some(object) = self.settings.objects.get_mut(self.selected_object) {
            let tile_m = match Reflectance::of(object) {
                Reflectance::Texture { tile_m, .. } => tile_m,
                _ => None,
            };
            let path = path.to_string_lossy().into_owned();
            Reflectance::Texture { path, tile_m }.put(object);
        }
    }
}
