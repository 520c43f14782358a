//! A dialog to choose a file, inside the window: it works without a desktop and over the network.

use std::path::{Path, PathBuf};

use egui::text::{CCursor, CCursorRange};
use egui::text_edit::TextEditState;
use egui::{Id, Key, Modal, Response, ScrollArea, TextEdit, Ui};

use crate::app::{FilePurpose, Viewer};

/// Most entries of a folder that are listed.
const MOST_ENTRIES: usize = 2000;

/// A dialog that is open.
#[derive(Clone, Debug)]
pub struct FileDialog {
    folder: PathBuf,
    name: String,
    extensions: &'static [&'static str],
    saves: bool,
    /// The name is to have the keyboard.
    wants_keys: bool,
    /// Folders and files of the folder, or why it cannot be listed.
    entries: Result<Vec<Entry>, String>,
}

#[derive(Clone, Debug)]
struct Entry {
    name: String,
    is_folder: bool,
}

/// What became of a dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// It is open still.
    Open,
    /// This file was chosen.
    Chosen(PathBuf),
    /// None was chosen.
    Cancelled,
}

impl FilePurpose {
    fn title(self) -> &'static str {
        match self {
            Self::OpenScene => "Open a scene or glTF file",
            Self::SaveScene => "Save the scene",
            Self::SaveForCommand => "Save the scene first; its command is then copied",
            Self::ExportPicture => "Export the picture",
            Self::ExportExr => "Export EXR with all layers",
            Self::ExportPlots => "Export the plots",
            Self::SaveProfile => "Save the calibration profile",
            Self::OpenProfile => "Open a calibration profile",
            Self::OpenRecord => "Open a recorded operation",
            Self::OpenModel => "Open a network",
            Self::OpenTexture => "Open a texture",
        }
    }

    fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::OpenScene => &["toml", "glb", "gltf"],
            Self::SaveScene | Self::SaveForCommand => &["toml"],
            Self::ExportPicture => &["png", "tif", "tiff"],
            Self::ExportExr => &["exr"],
            Self::ExportPlots => &["svg", "png"],
            Self::SaveProfile | Self::OpenProfile | Self::OpenModel => &["json"],
            Self::OpenTexture => &["png", "jpg", "jpeg", "tif", "tiff"],
            Self::OpenRecord => &["jsonl", "ndjson", "mcap", "json", "log"],
        }
    }

    fn first_name(self) -> &'static str {
        match self {
            Self::OpenScene
            | Self::OpenProfile
            | Self::OpenRecord
            | Self::OpenModel
            | Self::OpenTexture => "",
            Self::SaveScene | Self::SaveForCommand => "scene.toml",
            Self::ExportPicture => "picture.png",
            Self::ExportExr => "picture.exr",
            Self::ExportPlots => "plots.svg",
            Self::SaveProfile => "profile.json",
        }
    }
}

impl Viewer {
    /// Opens the dialog for a purpose.
    pub fn ask_file(&mut self, purpose: FilePurpose) {
        let of_scene = self.open.path.as_deref().and_then(Path::parent);
        // Shipped files that are within the program cannot be browsed.
        let of_scene = of_scene.filter(|folder| uw_assets::shipped_name(folder).is_none());
        let assets = self.assets.as_ref();
        let assets = assets.filter(|folder| uw_assets::shipped_name(folder).is_none());
        let scenes = assets.map(|a| a.join("scenes"));
        let models = assets.map(|a| a.join("models"));
        let saves = !purpose.first_name().is_empty();
        let folder = of_scene
            .map(Path::to_path_buf)
            .filter(|_| !saves)
            .filter(|_| purpose != FilePurpose::OpenModel)
            .or(scenes.filter(|_| purpose == FilePurpose::OpenScene))
            .or(models.filter(|_| purpose == FilePurpose::OpenModel))
            .or_else(|| std::env::current_dir().ok())
            .unwrap_or_default();
        let dialog = FileDialog::new(&folder, purpose.extensions(), purpose.first_name());
        self.files = Some((purpose, dialog));
    }
}

impl FileDialog {
    /// A dialog in `folder` for files of these extensions; with a name it saves, else it opens.
    pub fn new(folder: &Path, extensions: &'static [&'static str], name: &str) -> Self {
        let mut dialog = Self {
            folder: std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf()),
            name: name.to_owned(),
            extensions,
            saves: !name.is_empty(),
            wants_keys: true,
            entries: Ok(Vec::new()),
        };
        dialog.list();
        dialog
    }

    fn list(&mut self) {
        self.entries = list(&self.folder, self.extensions);
    }

    fn enter(&mut self, folder: PathBuf) {
        self.wants_keys = true;
        self.folder = folder;
        self.list();
    }

    /// The file that the name stands for, with an extension.
    fn file(&self) -> PathBuf {
        let path = self.folder.join(self.name.trim());
        match (path.extension(), self.extensions.first()) {
            (None, Some(extension)) if self.saves => path.with_extension(extension),
            _ => path,
        }
    }

    /// Shows the dialog's contents.
    pub fn show(&mut self, ui: &mut Ui) -> Choice {
        let mut choice = Choice::Open;
        ui.horizontal(|ui| {
            if ui.button("Up").on_hover_text("The folder above").clicked()
                && let Some(parent) = self.folder.parent()
            {
                self.enter(parent.to_path_buf());
            }
            ui.add(
                egui::Label::new(
                    egui::RichText::new(self.folder.display().to_string()).monospace(),
                )
                .truncate(),
            );
        });
        ui.separator();
        ScrollArea::vertical()
            .max_height((ui.ctx().content_rect().height() - 220.0).clamp(80.0, 320.0))
            .auto_shrink([false, false])
            .show(ui, |ui| self.rows(ui, &mut choice));
        ui.separator();
        ui.horizontal(|ui| {
            let label = ui.label("File");
            let edit = TextEdit::singleline(&mut self.name)
                .desired_width(f32::INFINITY)
                .hint_text("a name, or a whole path");
            let response = ui.add(edit).labelled_by(label.id);
            self.give_keys(&response);
            let entered = response.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            if entered {
                self.accept(&mut choice);
            }
        });
        ui.horizontal(|ui| {
            let does = if self.saves { "Save" } else { "Open" };
            if ui.button(does).clicked() {
                self.accept(&mut choice);
            }
            if ui.button("Cancel").clicked() {
                choice = Choice::Cancelled;
            }
            ui.weak(self.extensions.join(", "));
            if self.saves && self.file().is_file() {
                ui.colored_label(ui.visuals().warn_fg_color, "replaces the file of that name");
            }
        });
        choice
    }

    fn rows(&mut self, ui: &mut Ui, choice: &mut Choice) {
        let entries = match &self.entries {
            Ok(entries) => entries.clone(),
            Err(reason) => {
                ui.colored_label(ui.visuals().error_fg_color, reason);
                return;
            }
        };
        for entry in &entries {
            let text = if entry.is_folder {
                format!("{}/", entry.name)
            } else {
                entry.name.clone()
            };
            let response = ui.selectable_label(entry.name == self.name, text);
            if entry.is_folder {
                if response.clicked() {
                    self.enter(self.folder.join(&entry.name));
                }
            } else if response.clicked() {
                self.name = entry.name.clone();
                self.wants_keys = true;
            }
            if !entry.is_folder && response.double_clicked() {
                self.accept(choice);
            }
        }
        if entries.is_empty() {
            ui.weak(format!("no {} here", self.extensions.join(", ")));
        }
    }

    /// Gives the keyboard to the name where it is to have it, with all but its extension selected: what is typed takes
    /// its place.
    fn give_keys(&mut self, name: &Response) {
        if !self.wants_keys {
            return;
        }
        name.request_focus();
        let stem = Path::new(&self.name).file_stem().unwrap_or_default();
        let end = CCursor::new(stem.to_string_lossy().chars().count());
        let mut state = TextEditState::load(&name.ctx, name.id).unwrap_or_default();
        let selected = CCursorRange::two(CCursor::default(), end);
        state.cursor.set_char_range(Some(selected));
        state.store(&name.ctx, name.id);
        self.wants_keys = !name.has_focus();
    }

    fn accept(&mut self, choice: &mut Choice) {
        let file = self.file();
        if file.is_dir() {
            self.name = String::new();
            self.enter(file);
        } else if !self.name.trim().is_empty() {
            *choice = Choice::Chosen(file);
        }
    }
}

/// Folders, then files of these extensions, by name.
fn list(folder: &Path, extensions: &[&str]) -> Result<Vec<Entry>, String> {
    let listed = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let wanted = |name: &str| {
        let extension = Path::new(name).extension().and_then(|e| e.to_str());
        extension.is_some_and(|e| extensions.contains(&e.to_ascii_lowercase().as_str()))
    };
    let mut entries: Vec<Entry> = listed
        .flatten()
        .filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            let is_folder = entry.path().is_dir();
            let shown = !name.starts_with('.') && (is_folder || wanted(&name));
            shown.then_some(Entry { name, is_folder })
        })
        .take(MOST_ENTRIES)
        .collect();
    entries.sort_by_key(|e| (!e.is_folder, e.name.to_lowercase()));
    Ok(entries)
}

/// Shows the dialog that is open.
pub fn show(app: &mut Viewer, ctx: &egui::Context) {
    let Some((purpose, mut dialog)) = app.files.take() else {
        return;
    };
    let modal = Modal::new(Id::unique("files")).show(ctx, |ui| {
        ui.set_width(560.0);
        ui.heading(purpose.title());
        dialog.show(ui)
    });
    match modal.inner {
        Choice::Chosen(path) => app.use_file(purpose, path, ctx),
        Choice::Cancelled => {}
        Choice::Open if modal.should_close() => {}
        Choice::Open => app.files = Some((purpose, dialog)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_lists_its_folders_and_the_files_that_fit() {
        let folder = tempfile::tempdir().expect("folder");
        for name in ["b.toml", "a.GLB", "no.txt", ".hidden.toml"] {
            std::fs::write(folder.path().join(name), "").expect("written");
        }
        std::fs::create_dir(folder.path().join("z")).expect("made");
        let listed = list(folder.path(), &["toml", "glb"]).expect("listed");
        let names: Vec<_> = listed.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names, ["z", "a.GLB", "b.toml"]);
        let missing = list(&folder.path().join("none"), &["toml"]).expect_err("missing");
        assert!(missing.contains("none"), "{missing}");
    }

    #[test]
    fn a_saved_name_gets_its_extension_and_a_folder_is_entered() {
        let folder = tempfile::tempdir().expect("folder");
        std::fs::create_dir(folder.path().join("sub")).expect("made");
        let mut dialog = FileDialog::new(folder.path(), &["toml"], "mine");
        assert_eq!(dialog.file(), dialog.folder.join("mine.toml"));
        dialog.name = "sub".to_owned();
        let mut choice = Choice::Open;
        dialog.saves = false;
        dialog.accept(&mut choice);
        assert_eq!(choice, Choice::Open);
        assert!(dialog.folder.ends_with("sub"));
    }
}
