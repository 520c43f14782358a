//! What can be set of an object of the scene: it stays the `[[object]]` table of the scene file.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use toml::Value;
use uw_render::scene::Camera;

use super::settings::rounded;

/// Edge of a board that is added, m.
const BOARD_M: f64 = 1.0;
/// Reflectance of a board that is added.
const BOARD_REFLECTANCE: f64 = 0.5;

/// The name of an object: what it is, and its file.
pub fn name(object: &Value) -> String {
    let file = |path: &str| {
        let name = Path::new(path).file_name().unwrap_or(path.as_ref());
        name.to_string_lossy().into_owned()
    };
    if let Some(path) = object.get("gltf").and_then(Value::as_str) {
        return file(path);
    }
    match Reflectance::of(object) {
        Reflectance::Texture { path, .. } => format!("plane, {}", file(&path)),
        Reflectance::Even(_) => "plane, even".to_owned(),
        Reflectance::Spectrum => "plane, by wavelength".to_owned(),
    }
}

/// A plane of a scene file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Its middle, m.
    pub centre_m: DVec3,
    /// Its axes: to the right as seen from the front, up, towards the front.
    axes: DMat3,
    /// Width and height, m.
    pub size_m: DVec2,
}

/// How a plane stands before a camera, degrees. All are 0 where it faces the camera upright.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// About the camera's vertical: where its front turns to the right.
    pub turn_deg: f64,
    /// Where its front rises.
    pub tilt_deg: f64,
    /// About its front: where its upper edge falls to the right, as seen from the front.
    pub roll_deg: f64,
}

impl Plane {
    /// The plane of an object; `None` where it is another.
    pub fn of(object: &Value) -> Option<Self> {
        let plane = object.get("plane")?;
        let normal = vector(plane.get("normal")?)?.normalize();
        let up = plane.get("up").map_or(Some(DVec3::Z), vector)?;
        let right = up.cross(normal).normalize();
        let [width, height] = numbers(plane.get("size_m")?)?;
        Some(Self {
            centre_m: vector(plane.get("center_m")?)?,
            axes: DMat3::from_cols(right, normal.cross(right), normal),
            size_m: DVec2::new(width, height),
        })
    }

    /// Puts it into an object; what else that has stays.
    pub fn put(&self, object: &mut Value) {
        let fields = [
            ("center_m", self.centre_m),
            ("normal", self.axes.z_axis),
            ("up", self.axes.y_axis),
        ];
        let mut plane = toml::Table::new();
        for (field, value) in fields {
            plane.insert(field.to_owned(), array(value.to_array()));
        }
        plane.insert("size_m".to_owned(), array(self.size_m.to_array()));
        set(object, "plane", plane.into());
    }

    /// Distance from the camera along its axis, m, where that meets the plane.
    pub fn distance_m(&self, camera: &Camera) -> Option<f64> {
        let normal = self.axes.z_axis;
        let distance_m =
            (self.centre_m - camera.position_m).dot(normal) / camera.forward.dot(normal);
        let off = camera.position_m + distance_m * camera.forward - self.centre_m;
        let place = DVec2::new(off.dot(self.axes.x_axis), off.dot(self.axes.y_axis));
        let meets = distance_m > 0.0 && place.abs().cmple(0.5 * self.size_m).all();
        meets.then_some(distance_m)
    }

    /// Moves it along the camera's axis to a distance where that meets it.
    pub fn set_distance(&mut self, camera: &Camera, wanted_m: f64) {
        if let Some(distance_m) = self.distance_m(camera) {
            self.centre_m += (wanted_m - distance_m) * camera.forward;
        }
    }

    /// How it stands before the camera.
    pub fn stand(&self, camera: &Camera) -> Stand {
        let normal = self.axes.z_axis;
        let turn = normal.dot(camera.right).atan2(-normal.dot(camera.forward));
        let tilt = (-normal.dot(camera.down)).clamp(-1.0, 1.0).asin();
        let upright = standing(camera, turn, tilt, 0.0);
        let up = self.axes.y_axis;
        let roll = up.dot(upright.x_axis).atan2(up.dot(upright.y_axis));
        // To a millionth, more than the numbers of a file tell; adding zero makes -0 a zero.
        let degrees = |angle: f64| (angle.to_degrees() * 1e6).round() / 1e6 + 0.0;
        Stand {
            turn_deg: degrees(turn),
            tilt_deg: degrees(tilt),
            roll_deg: degrees(roll),
        }
    }

    /// Turns it about the point where the camera's axis meets it, whose distance stays; about its middle where none does.
    pub fn set_stand(&mut self, camera: &Camera, stand: Stand) {
        let angles = [stand.turn_deg, stand.tilt_deg, stand.roll_deg].map(f64::to_radians);
        let axes = standing(camera, angles[0], angles[1], angles[2]);
        let pivot_m = self.distance_m(camera).map_or(self.centre_m, |distance_m| {
            camera.position_m + distance_m * camera.forward
        });
        let own = self.axes.transpose() * (self.centre_m - pivot_m);
        self.centre_m = pivot_m + axes * own;
        self.axes = axes;
    }
}

/// The axes of a plane that stands so before the camera, angles in radians.
fn standing(camera: &Camera, turn: f64, tilt: f64, roll: f64) -> DMat3 {
    let (right, up, back) = (camera.right, -camera.down, -camera.forward);
    let level = turn.sin() * right + turn.cos() * back;
    let normal = tilt.cos() * level + tilt.sin() * up;
    let upright = tilt.cos() * up - tilt.sin() * level;
    let sideways = upright.cross(normal);
    DMat3::from_cols(
        roll.cos() * sideways - roll.sin() * upright,
        roll.cos() * upright + roll.sin() * sideways,
        normal,
    )
}

/// How a glTF object is placed: scaled, turned about x, y and z in this order, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Where its origin goes, m.
    pub translation_m: DVec3,
    /// Angles about x, y and z, degrees.
    pub rotation_deg: DVec3,
    /// Factors along x, y and z.
    pub scale: DVec3,
}

impl Placement {
    /// The placement of an object; `None` where it is no glTF object.
    pub fn of(object: &Value) -> Option<Self> {
        object.get("gltf")?;
        let given = |field| object.get(field).and_then(vector);
        let scale = object.get("scale");
        let scale = scale.and_then(|scale| number(scale).map(DVec3::splat).or(vector(scale)));
        Some(Self {
            translation_m: given("translation_m").unwrap_or(DVec3::ZERO),
            rotation_deg: given("rotation_deg").unwrap_or(DVec3::ZERO),
            scale: scale.unwrap_or(DVec3::ONE),
        })
    }

    /// Puts it into an object; what is as it is without a word is left out.
    pub fn put(&self, object: &mut Value) {
        let fields = [
            ("translation_m", self.translation_m, DVec3::ZERO),
            ("rotation_deg", self.rotation_deg, DVec3::ZERO),
            ("scale", self.scale, DVec3::ONE),
        ];
        for (field, value, usual) in fields {
            if value != usual {
                set(object, field, array(value.to_array()));
            } else if let Value::Table(table) = object {
                table.remove(field);
            }
        }
    }
}

/// What a plane reflects.
#[derive(Clone, Debug, PartialEq)]
pub enum Reflectance {
    /// The same everywhere.
    Even([f64; 3]),
    /// A texture: its file as the scene file names it, and width and height of a tile, m.
    Texture {
        /// The file.
        path: String,
        /// Width and height of a tile where they are not those of the plane, m.
        tile_m: Option<[f64; 2]>,
    },
    /// A file of reflectances by wavelength, which stays as it is.
    Spectrum,
}

impl Reflectance {
    /// What an object of a plane has.
    pub fn of(object: &Value) -> Self {
        let Some(reflectance) = object.get("reflectance") else {
            return Self::Spectrum;
        };
        if let Some(even) = numbers(reflectance) {
            return Self::Even(even);
        }
        match reflectance.get("texture").and_then(Value::as_str) {
            Some(path) => Self::Texture {
                path: path.to_owned(),
                tile_m: reflectance.get("tile_m").and_then(numbers),
            },
            None => Self::Spectrum,
        }
    }

    /// Puts it into an object; encoding and filter of a texture stay.
    pub fn put(&self, object: &mut Value) {
        match self {
            Self::Even(even) => set(object, "reflectance", array(*even)),
            Self::Texture { path, tile_m } => {
                let known = object.get("reflectance").and_then(Value::as_table);
                let known = known.filter(|known| known.contains_key("texture"));
                let mut texture = known.cloned().unwrap_or_default();
                texture.insert("texture".to_owned(), path.as_str().into());
                match tile_m {
                    Some(tile_m) => texture.insert("tile_m".to_owned(), array(*tile_m)),
                    None => texture.remove("tile_m"),
                };
                set(object, "reflectance", texture.into());
            }
            Self::Spectrum => {}
        }
    }
}

/// A grey board of a metre that faces the camera at a distance.
pub fn board(camera: &Camera, distance_m: f64) -> Value {
    let mut object = Value::Table(toml::Table::new());
    let plane = Plane {
        centre_m: camera.position_m + distance_m * camera.forward,
        axes: standing(camera, 0.0, 0.0, 0.0),
        size_m: DVec2::splat(BOARD_M),
    };
    plane.put(&mut object);
    Reflectance::Even([BOARD_REFLECTANCE; 3]).put(&mut object);
    object
}

fn set(object: &mut Value, field: &str, value: Value) {
    if let Value::Table(table) = object {
        table.insert(field.to_owned(), value);
    }
}

fn number(value: &Value) -> Option<f64> {
    value
        .as_float()
        .or(value.as_integer().map(|whole| whole as f64))
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> = value.as_array()?.iter().map(number).collect();
    all?.try_into().ok()
}

fn vector(value: &Value) -> Option<DVec3> {
    numbers(value).map(DVec3::from_array)
}

/// Numbers without the errors of angles to directions and back.
fn array<const N: usize>(numbers: [f64; N]) -> Value {
    let whole = numbers.map(|number| Value::Float(rounded(number) + 0.0));
    Value::Array(whole.into())
}

#[cfg(test)]
mod tests;
