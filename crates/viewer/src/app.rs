//! The application: settings, worker and panels, tied together once per frame.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Instant;

use glam::{DVec2, DVec3};

use crate::guidance::Guidance;
use crate::model::{
    Display, History, OpenError, OpenScene, Settings, camera::Motion, recent::Recent, scene_text,
};
use crate::ui::{self, files::FileDialog, picture::PictureView, toasts::Toasts};
use crate::worker::{Export, Frame, Goal, Job, News, Place, View, Worker};

/// Which panel is open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tab {
    /// The water.
    #[default]
    Water,
    /// Objects, camera, lamps, sensor.
    Scene,
    /// Calibration and advice.
    Guidance,
}

/// How the viewer starts.
pub struct Options {
    /// Where pictures are rendered.
    pub place: Place,
    /// Seed of all renders.
    pub seed: u64,
    /// When a picture is finished.
    pub goal: Goal,
    /// The files opened last.
    pub recent: Recent,
    /// Folder of textures, models and scenes; none where they are not installed.
    pub assets: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            place: Place::default(),
            seed: 1,
            goal: Goal::default(),
            recent: Recent::default(),
            assets: uw_survey::assets::assets_dir().ok(),
        }
    }
}

/// What is waited for when a file dialog closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilePurpose {
    /// Open a scene or a glTF file.
    OpenScene,
    /// Save the scene.
    SaveScene,
    /// Write the picture as PNG or TIFF.
    ExportPicture,
    /// Write the film with its layers.
    ExportExr,
    /// Write the plots as SVG.
    ExportPlots,
    /// Write the calibration profile.
    SaveProfile,
    /// Read a calibration profile.
    OpenProfile,
    /// Read a recorded operation.
    OpenRecord,
}

type Loaded = Result<(OpenScene, Settings), OpenError>;

/// The viewer.
pub struct Viewer {
    /// What is open.
    pub open: OpenScene,
    /// Everything that can be set.
    pub settings: Settings,
    /// The open panel.
    pub tab: Tab,
    /// Layer and colours.
    pub display: Display,
    /// When a picture is finished.
    pub goal: Goal,
    /// Whether no samples are added.
    pub paused: bool,
    /// How drags and keys move the camera.
    pub motion: Motion,
    /// Whether the lamps move with the camera.
    pub lamps_follow: bool,
    /// Whether the help is shown.
    pub help_open: bool,
    /// Advice.
    pub guidance: Guidance,
    /// Messages.
    pub toasts: Toasts,
    pub(crate) files: Option<(FilePurpose, FileDialog)>,
    pub(crate) picture: PictureView,
    pub(crate) recent: Recent,
    pub(crate) assets: Option<PathBuf>,
    history: History<Settings>,
    worker: Worker,
    frame: Option<Arc<Frame>>,
    generation: u64,
    submitted: Option<Settings>,
    geometry_changed: bool,
    view: Option<View>,
    view_revision: u64,
    sent: (Goal, bool),
    seed: u64,
    loading: Option<(PathBuf, Receiver<Loaded>)>,
}

impl Viewer {
    /// A viewer of `open` whose worker calls `ctx` when there is something new.
    ///
    /// # Errors
    /// The system gives no thread for the worker.
    pub fn new(
        ctx: &egui::Context,
        (open, settings): (OpenScene, Settings),
        options: Options,
    ) -> std::io::Result<Self> {
        let view = View {
            display: Display::default(),
            sensor: settings.sensor,
        };
        let for_worker = ctx.clone();
        let worker = Worker::start(options.place, view, options.goal, move || {
            for_worker.request_repaint();
        })?;
        let mut viewer = Self {
            history: History::new(settings.clone()),
            guidance: Guidance::new(options.assets.clone(), ctx.clone()),
            open,
            settings,
            tab: Tab::default(),
            display: Display::default(),
            goal: options.goal,
            paused: false,
            motion: Motion::default(),
            lamps_follow: true,
            help_open: false,
            toasts: Toasts::default(),
            files: None,
            picture: PictureView::default(),
            recent: options.recent,
            assets: options.assets,
            worker,
            frame: None,
            generation: 0,
            submitted: None,
            geometry_changed: true,
            view: None,
            view_revision: 0,
            sent: (options.goal, false),
            seed: options.seed,
            loading: None,
        };
        for warning in viewer.open.warnings.clone() {
            viewer.toasts.warn(warning);
        }
        Ok(viewer)
    }

    /// The newest picture.
    pub fn frame(&self) -> Option<&Arc<Frame>> {
        self.frame.as_ref()
    }

    /// Whether the newest picture shows the settings as they are.
    pub fn is_current(&self) -> bool {
        self.submitted.is_some()
            && self
                .frame
                .as_ref()
                .is_some_and(|f| f.generation == self.generation)
    }

    /// Number of the settings as they are; it grows with every change.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// Whether a file is being opened.
    pub fn is_loading(&self) -> bool {
        self.loading.is_some()
    }

    /// One frame of the window.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        self.poll();
        self.guidance.poll(&mut self.toasts);
        self.take_dropped(&ctx);
        ui::shortcuts::handle(self, &ctx);
        ui::menu::show(self, ui);
        ui::status::show(self, ui);
        egui::Panel::left("panel")
            .default_size(360.0)
            .min_size(300.0)
            .max_size(520.0)
            .resizable(true)
            .show(ui, |ui| self.panel(ui));
        egui::CentralPanel::default()
            .frame(egui::Frame::new().fill(ui::theme::backdrop(ui)))
            .show(ui, |ui| ui::picture::show(self, ui));
        ui::files::show(self, &ctx);
        ui::help::show(self, &ctx);
        self.toasts.show(&ctx);
        self.submit(&ctx);
    }

    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            for (tab, name) in [
                (Tab::Water, "Water"),
                (Tab::Scene, "Scene"),
                (Tab::Guidance, "Guidance"),
            ] {
                ui.selectable_value(&mut self.tab, tab, egui::RichText::new(name).heading());
            }
        });
        ui.separator();
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .id_salt(self.tab as u8)
            .show(ui, |ui| match self.tab {
                Tab::Water => ui::water::show(self, ui),
                Tab::Scene => ui::scene::show(self, ui),
                Tab::Guidance => ui::guidance::show(self, ui),
            });
    }

    /// Takes what the worker and a loader have brought.
    fn poll(&mut self) {
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
                self.history = History::new(settings.clone());
                self.settings = settings;
                self.geometry_changed = true;
                self.picture.forget_probe();
            }
            Err(error) => self
                .toasts
                .error(format!("{error}\nThe scene stays as it was.")),
        }
    }

    fn take_dropped(&mut self, ctx: &egui::Context) {
        let dropped = ctx.input(|i| i.raw.dropped_files.first().map(|f| f.path().to_path_buf()));
        if let Some(path) = dropped {
            self.open_file(&path, ctx);
        }
    }

    /// Does what a file was chosen for.
    pub(crate) fn use_file(&mut self, purpose: FilePurpose, path: PathBuf, ctx: &egui::Context) {
        match purpose {
            FilePurpose::OpenScene => self.open_file(&path, ctx),
            FilePurpose::SaveScene => self.save_scene(&path),
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

    fn save_scene(&mut self, path: &Path) {
        match scene_text::save(&self.open, &self.settings, path) {
            Ok(()) => {
                self.recent.add(path);
                self.toasts.info(format!("Saved {}", path.display()));
            }
            Err(error) => self.toasts.error(error.to_string()),
        }
    }

    /// One step back in the settings.
    pub fn undo(&mut self) {
        if let Some(settings) = self.history.undo() {
            self.settings = settings;
        }
    }

    /// One step forward in the settings.
    pub fn redo(&mut self) {
        if let Some(settings) = self.history.redo() {
            self.settings = settings;
        }
    }

    /// Whether there are steps to undo and to redo.
    pub fn can_undo_redo(&self) -> (bool, bool) {
        (self.history.can_undo(), self.history.can_redo())
    }

    /// Starts the picture anew with other random numbers.
    pub fn reset_picture(&mut self) {
        self.seed = self.seed.wrapping_add(1);
        self.submitted = None;
    }

    /// Moves the camera by `change`, and the lamps with it where they follow.
    pub(crate) fn move_camera(&mut self, change: impl FnOnce(&mut crate::model::CameraSettings)) {
        let before = self.settings.camera.build();
        change(&mut self.settings.camera);
        if !(self.lamps_follow || self.motion == Motion::Vehicle) {
            return;
        }
        let after = self.settings.camera.build();
        let carried = |v: DVec3| {
            let (x, y, z) = (
                v.dot(before.right),
                v.dot(before.down),
                v.dot(before.forward),
            );
            x * after.right + y * after.down + z * after.forward
        };
        for lamp in self.settings.lamps.iter_mut().filter(|l| !l.of_gltf) {
            lamp.position_m = after.position_m + carried(lamp.position_m - before.position_m);
            lamp.forward = carried(lamp.forward).normalize_or(after.forward);
        }
    }

    /// Distance from the camera to what is in the middle of the picture, m; 2 where there is nothing.
    pub(crate) fn distance_ahead_m(&self) -> f64 {
        let camera = &self.settings.camera;
        let hit = self.open.geometry.closest(
            camera.position_m,
            camera.forward,
            f64::INFINITY,
            uw_render::prepare::Primitive::None,
        );
        hit.map_or(2.0, |hit| hit.t)
    }

    /// Sends the settings to the worker where they have changed.
    fn submit(&mut self, ctx: &egui::Context) {
        self.history.note(&self.settings, Instant::now());
        let view = View {
            display: self.display,
            sensor: self.settings.sensor,
        };
        if self.view.as_ref() != Some(&view) {
            self.view_revision = self.worker.set_view(view.clone());
            self.view = Some(view);
        }
        let sent = (self.goal, self.paused);
        if sent != self.sent {
            self.worker.set_goal(self.goal);
            self.worker.set_paused(self.paused);
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

    /// Sets the camera so that what is ahead lies at `distance_m`, and all lamps to `light_pct`.
    pub(crate) fn go_to(&mut self, depth_m: Option<f64>, distance_m: f64, light_pct: f64) {
        let ahead = self.distance_ahead_m();
        let height = self.settings.surface.map(|s| s.height_m);
        self.move_camera(|camera| {
            camera.position_m += (ahead - distance_m) * camera.forward;
            if let (Some(height), Some(depth)) = (height, depth_m) {
                camera.position_m.z = height - depth;
            }
        });
        for lamp in &mut self.settings.lamps {
            lamp.level_pct = light_pct.clamp(0.0, 100.0);
        }
    }

    /// Size of the picture on the screen, pixels, once it is known.
    pub fn picture_size_px(&self) -> Option<DVec2> {
        self.picture.size_px()
    }
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }
}
