//! The application: settings, worker and panels, tied together once per frame.

mod copy;
mod files;
mod inspect;
mod lasting;
mod motion;
mod objects;
mod render;

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui_wgpu::RenderState;
use glam::DVec2;

pub use files::FilePurpose;
pub use lasting::theme;

pub use crate::model::lasting::Tab;

use crate::guidance::Guidance;
use crate::model::{
    Display, History, Inspection, OpenScene, Settings, camera::Motion, data_sheet::DataSheet,
    lasting::Lasting, recent::Recent, zoom::Place,
};
use crate::ui::{
    self, depth_profile::ProfileView, files::FileDialog, gallery::Gallery, picture::PictureView,
    toasts::Toasts,
};
use crate::worker::{Frame, Goal, PixelSpectrum, RenderDevice, View, Worker};
use files::Loading;
use objects::Rebuilding;

/// How the viewer starts.
pub struct Options {
    /// Where pictures are rendered.
    pub render_device: RenderDevice,
    /// Seed of all renders.
    pub seed: u64,
    /// When a picture is finished.
    pub goal: Goal,
    /// The files opened last.
    pub recent: Recent,
    /// What was chosen in the run before.
    pub lasting: Lasting,
    /// Folder of textures, models and scenes; none where they are not installed.
    pub assets: Option<PathBuf>,
    /// What draws the window, where it shares its adapter with the renderer.
    pub canvas: Option<RenderState>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            render_device: RenderDevice::default(),
            seed: 1,
            goal: Goal::default(),
            recent: Recent::default(),
            lasting: Lasting::default(),
            assets: uw_assets::assets_dir().ok(),
            canvas: None,
        }
    }
}

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
    /// Whether the picture is shown denoised, which is biased.
    pub denoised: bool,
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
    /// Whether scenes are offered to choose from.
    pub gallery_open: bool,
    /// What the data sheet says whose lamp is set next.
    pub data_sheet: DataSheet,
    /// The object that the scene panel shows.
    pub selected_object: usize,
    /// What the water panel keeps of a profile.
    pub profile_view: ProfileView,
    /// The cloud that goes where the picture is clicked next.
    pub placed_cloud: Option<usize>,
    /// Whether clouds have circles in the picture.
    pub clouds_shown: bool,
    /// What of the picture is looked at closely.
    pub inspection: Inspection,
    /// Advice.
    pub guidance: Guidance,
    /// Messages.
    pub toasts: Toasts,
    pub(crate) files: Option<(FilePurpose, FileDialog)>,
    pub(crate) picture: PictureView,
    pub(crate) pixel: Option<PixelSpectrum>,
    /// The files opened last.
    pub recent: Recent,
    pub(crate) gallery: Gallery,
    lasting: Lasting,
    pub(crate) assets: Option<PathBuf>,
    /// The settings as the file of the open scene has them.
    filed: Settings,
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
    loading: Option<Loading>,
    /// How many scenes were opened.
    pub(crate) opening: u64,
    rebuilding: Option<Rebuilding>,
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
            sensor: settings.sensor(),
            probing: false,
            on_host: false,
            denoised: false,
        };
        let for_worker = ctx.clone();
        let worker = Worker::start(options.render_device, view, options.goal, move || {
            for_worker.request_repaint();
        })?;
        let mut viewer = Self {
            history: History::new(settings.clone()),
            filed: settings.clone(),
            guidance: Guidance::new(options.assets.clone(), ctx.clone()),
            open,
            settings,
            tab: Tab::default(),
            display: Display::default(),
            denoised: false,
            goal: options.goal,
            paused: false,
            motion: Motion::default(),
            lamps_follow: true,
            help_open: false,
            gallery_open: false,
            data_sheet: DataSheet::default(),
            selected_object: 0,
            profile_view: ProfileView::default(),
            placed_cloud: None,
            clouds_shown: true,
            inspection: Inspection::default(),
            toasts: Toasts::default(),
            files: None,
            picture: PictureView::new(options.canvas),
            pixel: None,
            recent: options.recent,
            gallery: Gallery::default(),
            lasting: options.lasting,
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
            opening: 0,
            rebuilding: None,
        };
        for warning in viewer.open.warnings.clone() {
            viewer.toasts.warn(warning);
        }
        viewer.choose_as_before();
        Ok(viewer)
    }

    /// The newest picture.
    pub fn frame(&self) -> Option<&Arc<Frame>> {
        self.frame.as_ref()
    }

    /// Whether the newest picture shows the settings as they are.
    pub fn is_current(&self) -> bool {
        self.submitted.is_some()
            && self.settings.objects == self.open.objects
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
        self.poll_keeping();
        self.poll_loading();
        self.poll_objects(&ctx);
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
            .frame(egui::Frame::new())
            .show(ui, |ui| ui::picture::show(self, ui));
        ui::pixel::show(self, &ctx);
        ui::files::show(self, &ctx);
        ui::gallery::show(self, &ctx);
        ui::help::show(self, &ctx);
        self.toasts.show(&ctx);
        self.submit(&ctx);
        self.keep_choices(&ctx);
    }

    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            for (tab, name) in [
                (Tab::Water, "Water"),
                (Tab::Scene, "Scene"),
                (Tab::Guidance, "Guidance"),
                (Tab::Inspect, "Inspect"),
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
                Tab::Inspect => ui::inspect::show(self, ui),
            });
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

    /// The place for the picture, once it was laid out.
    pub fn picture_place(&self) -> Option<Place> {
        self.picture.place()
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
