//! Scenes to choose from, with small pictures: those opened last and those that ship.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use egui::load::SizedTexture;
use egui::{Button, Image, Modal, RichText, ScrollArea, TextureHandle, TextureOptions, Ui, vec2};

use super::knobs::heading;
use crate::app::Viewer;
use crate::worker::thumbnails::{SIZE_PX, Thumbnails};

/// Width of the dialog where the window has room, points.
const WIDTH: f32 = 760.0;
/// Room around it, points.
const MARGIN: f32 = 50.0;
/// Size of a picture, points.
const PICTURE: egui::Vec2 = vec2(0.8 * SIZE_PX.0 as f32, 0.8 * SIZE_PX.1 as f32);
/// Width of a scene with its name, points.
const CARD: f32 = PICTURE.x + 16.0;

/// The pictures of the scenes.
#[derive(Default)]
pub struct Gallery {
    thumbnails: Option<Thumbnails>,
    textures: HashMap<PathBuf, TextureHandle>,
}

impl Gallery {
    /// Has all pictures made anew: a file is another one.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// The picture of a file, or what there is in its place.
    fn picture(&mut self, file: &Path, ctx: &egui::Context) -> Shown {
        if let Some(texture) = self.textures.get(file) {
            return Shown::Picture(SizedTexture::from_handle(texture));
        }
        if self.thumbnails.is_none() {
            let waker = ctx.clone();
            match Thumbnails::start(move || waker.request_repaint()) {
                Ok(thumbnails) => self.thumbnails = Some(thumbnails),
                Err(error) => return Shown::Nothing(error.to_string()),
            }
        }
        let image = match self.thumbnails.as_mut().and_then(|all| all.of(file)) {
            None => return Shown::Coming,
            Some(Err(why)) => return Shown::Nothing(why.clone()),
            Some(Ok(image)) => image.clone(),
        };
        let name = file.to_string_lossy();
        let texture = ctx.load_texture(name, image, TextureOptions::LINEAR);
        let shown = SizedTexture::from_handle(&texture);
        self.textures.insert(file.to_path_buf(), texture);
        Shown::Picture(shown)
    }
}

/// What is shown of a scene.
enum Shown {
    Coming,
    Picture(SizedTexture),
    Nothing(String),
}

/// Shows the dialog where it is open.
pub fn show(app: &mut Viewer, ctx: &egui::Context) {
    if !app.gallery_open {
        return;
    }
    let recent = app.recent.paths().to_vec();
    let folder = app.assets.as_ref().map(|assets| assets.join("scenes"));
    let mut examples = folder.map_or_else(Vec::new, |folder| uw_assets::ALL.list(&folder));
    examples.retain(|file| {
        file.extension()
            .is_some_and(|extension| extension == "toml")
    });
    let mut chosen = None;
    let modal = Modal::new(egui::Id::unique("gallery")).show(ctx, |ui| {
        let window = ui.ctx().content_rect().size();
        ui.set_width(WIDTH.min(window.x - MARGIN));
        ui.heading("Scenes");
        ScrollArea::vertical()
            .max_height((window.y - 3.0 * MARGIN).max(MARGIN))
            .auto_shrink([false, true])
            .show(ui, |ui| {
                for (title, files) in [("Opened last", &recent), ("Examples", &examples)] {
                    heading(ui, title);
                    if files.is_empty() {
                        ui.weak("none");
                    }
                    cards(&mut app.gallery, ui, files, &mut chosen);
                }
            });
        ui.add_space(6.0);
        ui.vertical_centered(|ui| ui.button("Close").clicked())
            .inner
    });
    if let Some(file) = &chosen {
        app.open_file(file, ctx);
    }
    if chosen.is_some() || modal.inner || modal.should_close() {
        app.gallery_open = false;
        // What is still waited for is not made while nobody looks.
        app.gallery.thumbnails = None;
    }
}

/// Scenes side by side, as many as there is room for.
fn cards(gallery: &mut Gallery, ui: &mut Ui, files: &[PathBuf], chosen: &mut Option<PathBuf>) {
    ui.horizontal_wrapped(|ui| {
        for file in files {
            let picture = gallery.picture(file, ui.ctx());
            let stem = file.file_stem().unwrap_or(file.as_os_str());
            let clicked = ui
                .allocate_ui(vec2(CARD, PICTURE.y + 40.0), |ui| {
                    ui.vertical(|ui| card(ui, &picture, &stem.to_string_lossy()))
                        .inner
                })
                .inner;
            let told = match picture {
                Shown::Nothing(why) => format!("{}\n{why}", file.display()),
                Shown::Coming | Shown::Picture(_) => file.display().to_string(),
            };
            if clicked.on_hover_text(told).clicked() {
                *chosen = Some(file.clone());
            }
        }
    });
}

/// A scene: its picture with its name below.
fn card(ui: &mut Ui, picture: &Shown, name: &str) -> egui::Response {
    let padding = ui.spacing().button_padding;
    let empty = |sign: &str| {
        let sign = RichText::new(sign).weak();
        Button::new(sign).min_size(PICTURE + 2.0 * padding)
    };
    let button = match picture {
        Shown::Picture(texture) => {
            let image = Image::from_texture(*texture).fit_to_exact_size(PICTURE);
            Button::image(image.alt_text(name))
        }
        Shown::Coming => empty("..."),
        Shown::Nothing(_) => empty("no picture"),
    };
    let shown = ui.add(button);
    let named = ui.add(
        egui::Label::new(name)
            .truncate()
            .selectable(false)
            .sense(egui::Sense::click()),
    );
    shown | named
}
