//! The objects' part of the scene panel: what a target is made of and how it stands.

use std::path::PathBuf;

use egui::{CollapsingHeader, ComboBox, DragValue, Ui};
use glam::DVec3;
use toml::Value;
use uw_render::scene::Camera;

use super::knobs::{Steps, VectorKnob, channels, list_height, position, stepped, told, vector};
use crate::app::{FilePurpose, Viewer};
use crate::model::object::{Placement, Plane, Reflectance, Stand, board, name};

/// Distances that the slider reaches.
const DISTANCE: Steps = Steps {
    range: (0.05, 30.0),
    step: 0.05,
    decimals: 3,
    unit: " m",
};
/// Angles of a plane.
const ANGLE: Steps = Steps {
    range: (-180.0, 180.0),
    step: 1.0,
    decimals: 1,
    unit: "°",
};
/// Edges of planes and tiles, m.
const EDGE_M: (f64, f64) = (0.001, 1000.0);
/// Factors by which a glTF object is scaled.
const SCALE: (f64, f64) = (0.001, 1000.0);
/// Angles of a glTF object.
const ROTATION: VectorKnob = VectorKnob {
    speed: 0.5,
    most: 360.0,
    decimals: 1,
    unit: "°",
};

/// What a person asked for besides numbers.
enum Asked {
    Texture(PathBuf),
    File,
    Remove,
    Add,
}

/// Shows the objects.
pub fn show(app: &mut Viewer, ui: &mut Ui) {
    let count = app.settings.objects.len();
    let asked = CollapsingHeader::new(format!("Objects: {count}"))
        .id_salt("objects")
        .show(ui, |ui| objects(app, ui));
    match asked.body_returned.flatten() {
        Some(Asked::Texture(file)) => app.use_file(FilePurpose::OpenTexture, file, ui.ctx()),
        Some(Asked::File) => app.ask_file(FilePurpose::OpenTexture),
        Some(Asked::Remove) => {
            app.settings.objects.remove(app.selected_object);
        }
        Some(Asked::Add) => {
            let camera = app.settings.camera.build();
            let distance_m = 0.5 * app.distance_ahead_m();
            app.selected_object = app.settings.objects.len();
            app.settings.objects.push(board(&camera, distance_m));
        }
        None => {}
    }
}

fn objects(app: &mut Viewer, ui: &mut Ui) -> Option<Asked> {
    let camera = app.settings.camera.build();
    let ahead_m = app.hit_ahead_m();
    let textures = shipped_textures(app);
    let (objects, selected) = (&mut app.settings.objects, &mut app.selected_object);
    *selected = (*selected).min(objects.len().saturating_sub(1));
    choice(ui, objects, selected);
    let is_alone = objects.len() == 1;
    let mut asked = None;
    if let Some(object) = objects.get_mut(*selected) {
        if let Some(plane) = Plane::of(object) {
            place_plane(ui, object, plane, &camera);
            asked = reflectance(ui, object, &textures);
        } else if let Some(placed) = Placement::of(object) {
            let ahead_m = ahead_m.filter(|_| is_alone);
            place_file(ui, object, placed, (&camera, ahead_m));
        }
    }
    ui.horizontal(|ui| {
        let add = ui.button("Add a board");
        if add
            .on_hover_text("A grey board of 1 m x 1 m, half way to what is in the middle")
            .clicked()
        {
            asked = Some(Asked::Add);
        }
        let remove = egui::Button::new("Remove this one");
        let remove = ui.add_enabled(!app.settings.objects.is_empty(), remove);
        if remove.clicked() {
            asked = Some(Asked::Remove);
        }
    });
    asked
}

/// Which object is shown.
fn choice(ui: &mut Ui, objects: &[Value], selected: &mut usize) {
    let named = |(i, object): (usize, &Value)| format!("{}: {}", i + 1, name(object));
    let names: Vec<String> = objects.iter().enumerate().map(named).collect();
    let Some(shown) = names.get(*selected) else {
        return;
    };
    ComboBox::from_label("object")
        .selected_text(shown)
        .height(list_height(ui))
        .truncate()
        .show_ui(ui, |ui| {
            for (i, name) in names.iter().enumerate() {
                ui.selectable_value(selected, i, name);
            }
        });
}

fn place_plane(ui: &mut Ui, object: &mut Value, was: Plane, camera: &Camera) {
    let mut plane = was;
    match plane.distance_m(camera) {
        Some(mut distance_m) => {
            if stepped(ui, "distance", &mut distance_m, DISTANCE) {
                plane.set_distance(camera, distance_m);
            }
        }
        None => {
            ui.weak("not in the middle of the picture");
        }
    }
    let Stand {
        mut turn_deg,
        mut tilt_deg,
        mut roll_deg,
    } = plane.stand(camera);
    let tilts = Steps {
        range: (-90.0, 90.0),
        ..ANGLE
    };
    let turned = stepped(ui, "turned", &mut turn_deg, ANGLE);
    let tilted = stepped(ui, "tilted", &mut tilt_deg, tilts);
    let rolled = stepped(ui, "rolled", &mut roll_deg, ANGLE);
    if turned || tilted || rolled {
        let stand = Stand {
            turn_deg,
            tilt_deg,
            roll_deg,
        };
        plane.set_stand(camera, stand);
    }
    position(ui, "middle", &mut plane.centre_m);
    let mut size_m = plane.size_m.to_array();
    if edges(ui, "size", &mut size_m) {
        plane.size_m = size_m.into();
    }
    if plane != was {
        plane.put(object);
    }
}

fn place_file(
    ui: &mut Ui,
    object: &mut Value,
    was: Placement,
    (camera, ahead_m): (&Camera, Option<f64>),
) {
    let mut placed = was;
    if let Some(mut distance_m) = ahead_m {
        let before_m = distance_m;
        if stepped(ui, "distance", &mut distance_m, DISTANCE) {
            placed.translation_m += (distance_m - before_m) * camera.forward;
        }
    }
    position(ui, "moved to", &mut placed.translation_m);
    vector(ui, "turned", &mut placed.rotation_deg, ROTATION);
    factors(ui, &mut placed.scale);
    if placed != was {
        placed.put(object);
    }
}

/// Factors along the axes, above zero.
fn factors(ui: &mut Ui, scale: &mut DVec3) {
    ui.horizontal(|ui| {
        ui.label("scaled");
        let factors = [
            ("x", &mut scale.x),
            ("y", &mut scale.y),
            ("z", &mut scale.z),
        ];
        for (axis, factor) in factors {
            let speed = 0.01 * *factor;
            let knob = DragValue::new(factor)
                .range(SCALE.0..=SCALE.1)
                .clamp_existing_to_range(false)
                .speed(speed);
            ui.add(knob.prefix(format!("{axis} ")).max_decimals(3))
                .on_hover_text(told(
                    &format!("scaled, {axis}"),
                    &(SCALE.0..=SCALE.1),
                    "times",
                ));
        }
    });
}

/// Width and height.
fn edges(ui: &mut Ui, name: &str, size_m: &mut [f64; 2]) -> bool {
    ui.horizontal(|ui| {
        ui.label(name);
        let mut changed = false;
        for (edge_m, what) in size_m.iter_mut().zip(["width", "height"]) {
            let speed = 0.01 * *edge_m;
            let knob = DragValue::new(edge_m)
                .range(EDGE_M.0..=EDGE_M.1)
                .clamp_existing_to_range(false)
                .speed(speed);
            changed |= ui
                .add(knob.max_decimals(3).suffix(" m"))
                .on_hover_text(told(
                    &format!("{name}, {what}"),
                    &(EDGE_M.0..=EDGE_M.1),
                    "m",
                ))
                .changed();
        }
        changed
    })
    .inner
}

/// The textures that ship.
fn shipped_textures(app: &Viewer) -> Vec<PathBuf> {
    let folder = app.assets.as_ref().map(|assets| assets.join("textures"));
    let mut files = folder.map_or_else(Vec::new, |folder| uw_assets::ALL.list(&folder));
    files.retain(|file| file.extension().is_some_and(|extension| extension == "png"));
    files
}

/// What a plane reflects.
fn reflectance(ui: &mut Ui, object: &mut Value, textures: &[PathBuf]) -> Option<Asked> {
    let was = Reflectance::of(object);
    let mut now = was.clone();
    let mut asked = None;
    let shown = match &was {
        Reflectance::Even(_) => "even".to_owned(),
        Reflectance::Texture { path, .. } => stem(path.as_ref()),
        Reflectance::Spectrum => "by wavelength".to_owned(),
    };
    ComboBox::from_label("surface")
        .selected_text(shown)
        .height(list_height(ui))
        .truncate()
        .show_ui(ui, |ui| {
            let is_even = matches!(was, Reflectance::Even(_));
            if ui.selectable_label(is_even, "even").clicked() && !is_even {
                now = Reflectance::Even([0.5; 3]);
            }
            for file in textures {
                let is_own = matches!(&was, Reflectance::Texture { path, .. } if stem(path.as_ref()) == stem(file));
                if ui.selectable_label(is_own, stem(file)).clicked() {
                    asked = Some(Asked::Texture(file.clone()));
                }
            }
            if ui.selectable_label(false, "another picture...").clicked() {
                asked = Some(Asked::File);
            }
        })
        .response
        .on_hover_text("What the plane shows: one reflectance, or the picture of a texture");
    match &mut now {
        Reflectance::Even(even) => {
            channels(ui, "reflectance", even, 1.0, "");
        }
        Reflectance::Texture { tile_m, .. } => {
            let whole_m = Plane::of(object).map_or([1.0; 2], |plane| plane.size_m.to_array());
            let mut own_m = tile_m.unwrap_or(whole_m);
            if edges(ui, "tile", &mut own_m) {
                *tile_m = Some(own_m);
            }
        }
        Reflectance::Spectrum => {}
    }
    if now != was {
        now.put(object);
    }
    asked
}

fn stem(file: &std::path::Path) -> String {
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}
