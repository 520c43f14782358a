//! The scene file as a whole: from TOML text to a checked scene.

use std::io;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::camera_table::{self, CameraTable};
use super::document::Document;
use super::kind::check_kind;
use super::reader::Table;
use super::setting::Amended;
use super::{
    Camera, Lamp, Scene, SceneError, Setting, WaterSurface, calibration, light, object, phase,
    sections, snow, spectral, variation,
};

/// Value of the `format` field.
const FORMAT: &str = "uw-scene/1";
const FIELDS: [&str; 10] = [
    "format", "water", "surface", "sun", "sky", "camera", "lamp", "object", "sensor", "render",
];

impl Scene {
    /// Reads a scene file and every file it refers to. Paths in it start from its own folder; `shipped:NAME` is a shipped file,
    /// here as in the scene. A camera's calibration (`*.yaml`, `*.xml` of ROS, OpenCV, Kalibr or Metashape) is a scene with that camera alone.
    ///
    /// # Errors
    /// The first thing that is wrong, with file, line and field.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        Self::read_with(path, &[])
    }

    /// The same with `settings` in the place of what the file says.
    ///
    /// # Errors
    /// As [`Scene::read`]; an error in a setting names it.
    pub fn read_with(path: &Path, settings: &[Setting]) -> Result<Self, SceneError> {
        let file = path.display().to_string();
        let unreadable = |source| SceneError::Unreadable {
            file: file.clone(),
            source,
        };
        let bytes = uw_assets::ALL.read(path).map_err(unreadable)?.into_owned();
        check_kind(&file, &bytes)?;
        let text = String::from_utf8(bytes)
            .map_err(|error| unreadable(io::Error::new(io::ErrorKind::InvalidData, error)))?;
        let text = match calibration::is_meant(path) {
            true => scene_of_camera(&text, path)?,
            false => text,
        };
        let base_dir = path.parent().unwrap_or(Path::new(""));
        Self::parse_with(&text, base_dir, &file, settings)
    }

    /// Reads a scene from text. Paths in it start from `base_dir`; error messages call it `name`.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn parse(text: &str, base_dir: &Path, name: &str) -> Result<Self, SceneError> {
        Self::parse_with(text, base_dir, name, &[])
    }

    /// The same with `settings` in the place of what the text says.
    ///
    /// # Errors
    /// As [`Scene::read_with`].
    pub fn parse_with(
        text: &str,
        base_dir: &Path,
        name: &str,
        settings: &[Setting],
    ) -> Result<Self, SceneError> {
        let amended = Amended::new(text, settings);
        let doc = Document {
            file: name,
            text: &amended.text,
            settings_from: text.len(),
            base_dir,
        };
        let parsed = DeTable::parse(text).map_err(|error| syntax_error(&doc, &error))?;
        let mut root = Spanned::new(parsed.span(), DeValue::Table(parsed.into_inner()));
        amended.apply(&mut root)?;
        let none = DeTable::new();
        let table = root.get_ref().as_table().unwrap_or(&none);
        let scene = Table::root(&doc, table, &FIELDS).and_then(|root| {
            root.required("format", "\"uw-scene/1\"")?
                .as_choice(&[(FORMAT, ())])?;
            read_scene(&root)
        });
        scene.map_err(|error| amended.blame(error))
    }
}

/// A scene with nothing but the camera of a calibration, at the origin.
fn scene_of_camera(text: &str, path: &Path) -> Result<String, SceneError> {
    calibration::parse(text).map_err(|reason| SceneError::Calibration {
        file: path.display().to_string(),
        reason,
    })?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = toml::Value::String(name.into_owned());
    Ok(format!(
        "format = {FORMAT:?}\n[camera]\nposition_m = [0.0, 0.0, 0.0]\nforward = [1.0, 0.0, 0.0]\ncalibration = {name}\n"
    ))
}

fn syntax_error(doc: &Document<'_>, error: &toml::de::Error) -> SceneError {
    let span = error.span().unwrap_or(0..0);
    let place = doc.text.get(span.clone()).unwrap_or_default().trim();
    let place = place.lines().next().filter(|place| !place.is_empty());
    let place = place
        .map(|place| format!(" at `{place}`"))
        .unwrap_or_default();
    SceneError::Syntax {
        file: doc.file.to_string(),
        line: doc.line_at(span.start),
        message: error.message().replace('\n', ", ") + &place,
    }
}

fn read_scene(root: &Table<'_>) -> Result<Scene, SceneError> {
    let wavelengths = spectral::read(root)?;
    let water = phase::read_water(root, wavelengths.spectral.as_ref())?;
    let (snow, snow_warnings) = snow::read(root)?;
    let surface = sections::read_surface(root)?;
    let sun = light::read_sun(root)?;
    let sky_radiance = light::read_sky(root)?;
    let camera = camera_table::read(root)?;
    let (mut lamps, lamp_warnings) = light::read_lamps(root, &wavelengths.response)?;
    let mut objects = object::read_objects(root)?;
    wavelengths.mean_reflectances(&mut objects.materials);
    let sensor = sections::read_sensor(root, wavelengths.spectral.as_ref())?;
    let render = sections::read_render(root)?;
    let camera = choose_camera(root, camera, objects.gltf.camera)?;
    let camera = camera_table::with_opening(root, camera, surface.as_ref())?;
    camera_table::check_port(root, &camera, (water.is_some(), snow.is_some()))?;
    let mut warnings = objects.gltf.warnings;
    if let (Some(_), Some(surface)) = (&water, &surface) {
        refuse_lamps_across(root, &lamps, surface)?;
    }
    light::append_named(&mut lamps, objects.gltf.lamps);
    warnings.extend(wavelengths.warnings);
    warnings.extend(lamp_warnings);
    let eye_z_m = camera.position_m.z;
    warnings.extend(variation::below_known(root, surface.as_ref(), eye_z_m)?);
    warnings.extend(snow_warnings);
    if snow.is_some() && surface.is_some_and(|s| camera.position_m.z > s.height_m) {
        warnings
            .push("the camera is above the water surface, from where no snow is seen".to_owned());
    }
    if camera.port.is_some() && surface.is_some_and(|s| camera.position_m.z > s.height_m) {
        warnings.push("the camera is above the water surface: its port looks into air".to_owned());
    }
    let spectral = wavelengths.spectral;
    if let Some(spectral) = &spectral {
        warnings.extend(spectral.dark_channels(&lamps));
    }
    let mut scene = Scene {
        water,
        snow,
        surface,
        sun,
        sky_radiance,
        camera,
        spectral,
        lamps,
        quads: objects.quads,
        meshes: objects.gltf.meshes,
        materials: objects.materials,
        textures: objects.textures,
        sensor,
        render,
        warnings,
    };
    scene.camera = scene.placed_camera();
    Ok(scene)
}

/// The disk of a lamp is in the water or above it.
fn refuse_lamps_across(
    root: &Table<'_>,
    lamps: &[Lamp],
    surface: &WaterSurface,
) -> Result<(), SceneError> {
    for (i, (element, lamp)) in root.elements("lamp")?.iter().zip(lamps).enumerate() {
        let upright = lamp.forward.truncate().length() * lamp.radius_m;
        if lamp.position_m.z > surface.height_m && lamp.position_m.z - upright < surface.height_m {
            return Err(SceneError::InvalidValue {
                file: root.doc.file.to_string(),
                line: element.line(),
                field: format!("lamp {} position_m[2]", i + 1),
                expected: format!(
                    "at least {} or at most surface.height_m = {}: a disk above the water does not reach into it",
                    surface.height_m + upright,
                    surface.height_m
                ),
                got: lamp.position_m.z.to_string(),
            });
        }
    }
    Ok(())
}

/// The camera of the scene file; where that is silent the first perspective camera of its glTF files,
/// with the image size of the scene file or 1280 pixels of width.
fn choose_camera(
    root: &Table<'_>,
    own: Option<CameraTable>,
    gltf: Option<super::gltf_light::GltfCamera>,
) -> Result<Camera, SceneError> {
    match (own, gltf) {
        (Some(CameraTable::Complete(camera)), _) => Ok(*camera),
        (Some(CameraTable::SizeOnly { width, height }), Some(gltf)) => {
            Ok(gltf.with_size(width, height))
        }
        (None, Some(gltf)) => Ok(gltf.with_own_size()),
        (Some(CameraTable::SizeOnly { .. }), None) => Err(SceneError::MissingField {
            file: root.doc.file.to_string(),
            line: root.required("camera", "")?.line(),
            within: "camera".to_string(),
            field: "position_m".to_string(),
            expected: "three numbers in m, or a glTF object that holds a camera".to_string(),
        }),
        (None, None) => {
            Err(root.missing("camera", "a table, or a glTF object that holds a camera"))
        }
    }
}
