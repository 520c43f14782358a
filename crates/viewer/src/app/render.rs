//! What goes to the worker and what comes from it.

use std::sync::Arc;
use std::time::Instant;

use super::Viewer;
use crate::model::Settings;
use crate::ui;
use crate::worker::{Job, News, View};

impl Viewer {
    /// Takes what the worker has brought.
    pub(super) fn poll(&mut self) {
        while let Some(news) = self.worker.news() {
            match news {
                News::Failed {
                    generation,
                    message,
                } if generation == self.generation || generation == 0 => {
                    self.toasts.error(message);
                }
                News::Failed { .. } => {}
                News::FellBack { message } => self
                    .toasts
                    .error(format!("{message}; the processor renders instead")),
                News::Exported(path) => self.toasts.info(format!("Wrote {}", path.display())),
                News::NotExported(message) => self.toasts.error(message),
            }
        }
        let latest = self.worker.latest();
        if latest.as_ref().map(|f| f.serial) != self.frame.as_ref().map(|f| f.serial) {
            self.frame = latest;
        }
    }

    /// Sends the settings to the worker where they have changed.
    pub(super) fn submit(&mut self, ctx: &egui::Context) {
        self.history.note(&self.settings, Instant::now());
        let view = View {
            display: self.display,
            sensor: self.settings.sensor(),
            probing: self.picture.probe().is_some() || !self.inspection.pins.is_empty(),
            on_host: self.needs_pixels(),
            denoised: self.denoised,
        };
        if self.view.as_ref() != Some(&view) {
            self.view_revision = self.worker.set_view(view.clone());
            self.view = Some(view);
        }
        // Scenes to choose from cover the picture, and their own are waited for.
        let paused = self.paused || self.gallery_open;
        let sent = (self.goal, paused);
        if sent != self.sent {
            self.worker.set_goal(self.goal);
            self.worker.set_paused(paused);
            self.sent = sent;
        }
        let Some(limit) = self.picture.size_px() else {
            // The window has not been laid out yet.
            ctx.request_repaint();
            return;
        };
        let mut settings = self.settings.clone();
        let (width, height) = ui::picture::render_size(&settings.camera, limit);
        settings.camera = settings.camera.resized(width, height);
        let same = |old: &Settings| {
            !self.geometry_changed && old.camera == settings.camera && old.same_light(&settings)
        };
        if self.submitted.as_ref().is_some_and(same) {
            return;
        }
        self.generation += 1;
        self.geometry_changed = false;
        self.worker.submit(Job {
            generation: self.generation,
            settings: settings.clone(),
            geometry: Arc::clone(&self.open.geometry),
            seed: self.seed,
        });
        self.submitted = Some(settings);
    }

    /// Starts the picture anew with other random numbers.
    pub fn reset_picture(&mut self) {
        self.seed = self.seed.wrapping_add(1);
        self.submitted = None;
    }
}
