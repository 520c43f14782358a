//! Files: opened on threads of their own, written at once.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use super::Viewer;
use crate::model::open_scene::title;
use crate::model::{History, OpenError, OpenScene, Settings, scene_text};
use crate::worker::Export;

/// What is waited for when a file dialog closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilePurpose {
    /// Open a scene or a glTF file.
    OpenScene,
    /// Save the scene.
    SaveScene,
    /// Save the scene and copy the command that renders it.
    SaveForCommand,
    /// Write the picture as PNG or TIFF.
    ExportPicture,
    /// Write the film with its layers.
    ExportExr,
    /// Write the plots as SVG or PNG.
    ExportPlots,
    /// Write the calibration profile.
    SaveProfile,
    /// Read a calibration profile.
    OpenProfile,
    /// Read a recorded operation.
    OpenRecord,
    /// Read a network.
    OpenModel,
    /// Give the object that the scene panel shows a texture.
    OpenTexture,
}

type Loaded = Result<(OpenScene, Settings), OpenError>;
/// A file that is being read.
pub(super) type Loading = (PathBuf, Receiver<Loaded>);

impl Viewer {
    /// Takes what a loader has brought.
    pub(super) fn poll_loading(&mut self) {
        if let Some((path, loader)) = &self.loading {
            match loader.try_recv() {
                Ok(loaded) => {
                    let path = path.clone();
                    self.loading = None;
                    self.take_loaded(&path, loaded);
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => {
                    let message = format!("{}: reading it failed", path.display());
                    self.loading = None;
                    self.toasts.error(message);
                }
            }
        }
    }

    /// Opens a file on a thread of its own; a bad one leaves everything as it is.
    pub fn open_file(&mut self, path: &Path, ctx: &egui::Context) {
        let (sender, receiver) = channel();
        let (file, ctx) = (path.to_path_buf(), ctx.clone());
        let spawned = std::thread::Builder::new()
            .name("load".to_owned())
            .spawn(move || {
                // Without a listener the window has closed or another file is wanted.
                let _ = sender.send(OpenScene::read(&file));
                ctx.request_repaint();
            });
        match spawned {
            Ok(_) => self.loading = Some((path.to_path_buf(), receiver)),
            Err(error) => self
                .toasts
                .error(format!("cannot read a file now: {error}")),
        }
    }

    fn take_loaded(&mut self, path: &Path, loaded: Loaded) {
        match loaded {
            Ok((open, settings)) => {
                for warning in &open.warnings {
                    self.toasts.warn(warning.clone());
                }
                self.recent.add(path);
                self.open = open;
                self.opening += 1;
                self.rebuilding = None;
                self.selected_object = 0;
                self.history = History::new(settings.clone());
                self.filed = settings.clone();
                self.settings = settings;
                self.geometry_changed = true;
                self.picture.forget_probe();
                self.inspection.forget_places();
                self.pixel = None;
                self.profile_view.selected = 0;
                self.placed_cloud = None;
            }
            Err(error) => self
                .toasts
                .error(format!("{error}\nThe scene stays as it was.")),
        }
    }

    /// Opens a file that was dropped on the window.
    pub(super) fn take_dropped(&mut self, ctx: &egui::Context) {
        let dropped = ctx.input(|i| i.raw.dropped_files.first().map(|f| f.path().to_path_buf()));
        if let Some(path) = dropped {
            let extension = path.extension().and_then(|e| e.to_str());
            let purpose = match extension {
                Some("json") => FilePurpose::OpenProfile,
                Some("jsonl" | "ndjson" | "mcap") => FilePurpose::OpenRecord,
                _ => FilePurpose::OpenScene,
            };
            self.use_file(purpose, path, ctx);
        }
    }

    /// Does what a file was chosen for.
    pub(crate) fn use_file(&mut self, purpose: FilePurpose, path: PathBuf, ctx: &egui::Context) {
        match purpose {
            FilePurpose::OpenScene => self.open_file(&path, ctx),
            FilePurpose::SaveScene => {
                self.save_scene(&path);
            }
            FilePurpose::SaveForCommand => {
                if self.save_scene(&path) {
                    self.copy_command(ctx);
                }
            }
            FilePurpose::ExportPicture => self.export(Export::Photograph {
                path,
                seed: self.seed,
            }),
            FilePurpose::ExportExr => self.export(Export::Exr { path, layers: None }),
            FilePurpose::ExportPlots => {
                let written = crate::export::plots(&self.settings, &self.guidance, &path);
                self.tell(written.map(|()| format!("Wrote the plots {}", path.display())));
            }
            FilePurpose::SaveProfile => {
                let saved = self.guidance.save_profile(&path);
                self.tell(saved.map(|()| format!("Saved {}", path.display())));
            }
            FilePurpose::OpenProfile => {
                let opened = self.guidance.open_profile(&path);
                self.tell(opened.map(|()| format!("Opened {}", path.display())));
            }
            FilePurpose::OpenRecord => {
                let opened = self.guidance.open_record(&path);
                self.tell(opened.map(|steps| format!("{steps} steps in {}", path.display())));
            }
            FilePurpose::OpenTexture => self.give_texture(&path),
            FilePurpose::OpenModel => {
                let opened = self.guidance.open_model(&path);
                self.tell(opened.map(|()| format!("Opened {}", path.display())));
            }
        }
    }

    fn tell(&mut self, result: Result<String, String>) {
        match result {
            Ok(message) => self.toasts.info(message),
            Err(message) => self.toasts.error(message),
        }
    }

    /// Asks the worker for a file.
    pub fn export(&mut self, export: Export) {
        self.worker.export(export);
    }

    /// Saves the scene, whose file it then is; whether that worked.
    fn save_scene(&mut self, path: &Path) -> bool {
        match scene_text::save(&self.open, &self.settings, path) {
            Ok(()) => {
                self.recent.add(path);
                self.open.path = Some(path.to_path_buf());
                self.open.title = title(path);
                self.gallery.forget();
                self.filed = self.settings.clone();
                self.toasts.info(format!("Saved {}", path.display()));
                true
            }
            Err(error) => {
                self.toasts.error(error.to_string());
                false
            }
        }
    }
}
