//! The scene that is open: its objects, ready to be rendered, and what its file says about them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use uw_media::WaterType;
use uw_media::spectral::JerlovWater;
use uw_render::{
    prepare::Geometry,
    scene::{Layer, Scene, SceneError},
};

use super::depth_profile::{DepthProfile, Entry, LayerWater, place, pure};
use super::settings::rounded;
use super::{
    CameraSettings, Cloud, Coefficients, LampSettings, LightSpectrum, PhaseModel, ResponseSettings,
    SensorSettings, Settings, Sun, Surface, Water, WaterBands,
};

/// A scene cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The file is no scene, or something in it is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The extension says nothing that can be opened.
    #[error("{}: must be a scene (.toml) or a glTF file (.glb, .gltf)", path.display())]
    UnknownKind {
        /// The file.
        path: PathBuf,
    },
    /// The water has layers that `water.profile` does not tell of.
    #[error("{}: layers of the water that water.profile does not hold are not shown here", path.display())]
    Layers {
        /// The file.
        path: PathBuf,
    },
    /// The file name cannot be written into a scene.
    #[error("{}: the name must be valid UTF-8", path.display())]
    Name {
        /// The file.
        path: PathBuf,
    },
}

/// What is open besides the settings.
#[derive(Clone, Debug)]
pub struct OpenScene {
    /// Its file; `None` for one that was never saved.
    pub path: Option<PathBuf>,
    /// Name for the title.
    pub title: String,
    /// Folder from which the paths of `objects` start.
    pub base_dir: PathBuf,
    /// The `[[object]]` tables that the surfaces are those of.
    pub objects: Vec<toml::Value>,
    /// The surfaces.
    pub geometry: Arc<Geometry>,
    /// What the file holds and the renderer cannot honour.
    pub warnings: Vec<String>,
}

/// Size of the picture of a scene that names none, pixels.
const DEFAULT_SIZE: (u32, u32) = (1280, 720);
/// Scene shown when there is nothing else: a grey wall in clear water.
const FALLBACK: &str = r#"format = "uw-scene/1"
water = { jerlov = "IB" }
surface = { height_m = 0.0 }
sun = { zenith_deg = 30.0, irradiance = [1.0, 1.0, 1.0] }
sky = { radiance = [0.1, 0.1, 0.1] }
camera = { position_m = [0.0, 0.0, -3.0], forward = [1.0, 0.0, 0.0], hfov_deg = 60.0, width = 1280, height = 720 }
sensor = { exposure = { auto_mean = 0.4 } }
[[lamp]]
name = "left"
position_m = [0.0, 0.3, -3.0]
intensity = [1.0, 1.0, 1.0]
[[object]]
plane = { center_m = [1.5, 0.0, -4.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [4.0, 4.0] }
reflectance = [0.5, 0.4, 0.3]
"#;

impl OpenScene {
    /// Opens a scene file or a glTF file, a shipped one (`shipped:scenes/..`) too.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn read(path: &Path) -> Result<(Self, Settings), OpenError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        match extension.to_ascii_lowercase().as_str() {
            "toml" => {
                let name = path.display().to_string();
                let text = uw_assets::ALL
                    .read_to_string(path)
                    .map_err(|source| SceneError::Unreadable { file: name, source })?;
                Self::parse(&text, path)
            }
            "glb" | "gltf" => Self::of_gltf(path),
            _ => Err(OpenError::UnknownKind {
                path: path.to_path_buf(),
            }),
        }
    }

    /// The scene that is shown when there is no file.
    ///
    /// # Errors
    /// None in practice: its text is part of the program and tested.
    pub fn fallback() -> Result<(Self, Settings), OpenError> {
        let (mut open, settings) = Self::parse(FALLBACK, Path::new("untitled.toml"))?;
        open.path = None;
        Ok((open, settings))
    }

    /// A scene from the text of the file `path`.
    ///
    /// # Errors
    /// What is wrong with the text or a file it refers to.
    pub fn parse(text: &str, path: &Path) -> Result<(Self, Settings), OpenError> {
        let base_dir = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let scene = Scene::parse(text, &base_dir, &path.display().to_string())?;
        // What the scene's reader has taken, this reads as well.
        let raw: toml::Table = toml::from_str(text).unwrap_or_default();
        let mut settings = settings(&scene, &raw, &base_dir);
        let layers = |water: &uw_render::scene::Water| water.variation.layers.len();
        let kept = |water: &Water| match &water.coefficients {
            Coefficients::Profile(profile) => profile.entries().len(),
            _ => 1,
        };
        if scene.water.as_ref().map_or(0, layers) > settings.water.as_ref().map_or(0, kept) {
            return Err(OpenError::Layers {
                path: path.to_path_buf(),
            });
        }
        if let Some(toml::Value::Array(objects)) = raw.get("object") {
            settings.objects = objects.clone();
        }
        let open = Self {
            path: Some(path.to_path_buf()),
            title: title(path),
            base_dir,
            objects: settings.objects.clone(),
            geometry: Arc::new(Geometry::build(&scene)),
            warnings: scene.warnings,
        };
        Ok((open, settings))
    }

    /// A scene around a glTF file: clear water, seen from outside where the file has no camera.
    fn of_gltf(path: &Path) -> Result<(Self, Settings), OpenError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let name = path.file_name().and_then(|n| n.to_str());
        let name = name.ok_or_else(|| OpenError::Name {
            path: path.to_path_buf(),
        })?;
        let name = toml::Value::String(name.to_owned());
        let (width, height) = DEFAULT_SIZE;
        let text = |camera: &str| {
            format!(
                "format = \"uw-scene/1\"\nwater = {{ jerlov = \"I\" }}\nsensor = {{ exposure = {{ auto_mean = 0.4 }} }}\n\
                 camera = {{ {camera} width = {width}, height = {height} }}\n[[object]]\ngltf = {name}\n"
            )
        };
        let scene_path = folder.join("from glTF.toml");
        let own_view = Self::parse(&text(""), &scene_path);
        let (mut open, settings) = match own_view {
            Err(OpenError::Scene(SceneError::MissingField { .. })) => {
                let view =
                    "position_m = [0.0, 0.0, 0.0], forward = [1.0, 0.0, 0.0], hfov_deg = 60.0,";
                let (open, mut settings) = Self::parse(&text(view), &scene_path)?;
                frame_all(&open, &mut settings);
                (open, settings)
            }
            other => other?,
        };
        open.path = None;
        open.title = title(path);
        Ok((open, settings))
    }
}

/// Puts the camera where it sees everything, and a lamp beside it where there is none.
fn frame_all(open: &OpenScene, settings: &mut Settings) {
    if let Some((lower, upper)) = open.geometry.bounds() {
        let middle = 0.5 * (lower + upper);
        let radius = (0.5 * (upper - lower).length()).max(0.1);
        let away = DVec3::new(-1.0, -0.8, 0.5).normalize();
        settings.camera.position_m = middle + 2.2 * radius * away;
        settings.camera.look_at(middle);
    }
    if settings.lamps.is_empty() {
        settings.lamps.push(lamp_beside(settings));
    }
}

/// A lamp half a metre to the left of the camera, of 10 W/sr.
pub fn lamp_beside(settings: &Settings) -> LampSettings {
    let camera = settings.camera.build();
    LampSettings {
        name: settings.free_lamp_name(),
        position_m: camera.position_m - 0.5 * camera.right,
        forward: camera.forward,
        intensity: [10.0; 3],
        spectrum: None,
        level_pct: 100.0,
        half_angle_deg: 50.0,
        falloff: uw_render::scene::Falloff::Cosine,
        beam_file: None,
        radius_m: 0.02,
        of_gltf: false,
    }
}

/// The name of a scene's file, for the title.
pub fn title(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

fn settings(scene: &Scene, raw: &toml::Table, folder: &Path) -> Settings {
    let text = |table: &str, field| raw.get(table)?.get(field)?.as_str();
    let light = |entry: Option<&toml::Value>| LightSpectrum::read(entry?, folder);
    let entry = |table: &str, field| raw.get(table)?.get(field);
    let response = entry("camera", "response").and_then(|e| ResponseSettings::read(e, folder));
    let raw_lamps = match raw.get("lamp") {
        Some(toml::Value::Array(lamps)) => lamps.as_slice(),
        _ => &[],
    };
    let lamp = |(i, lamp): (usize, &uw_render::scene::Lamp)| {
        let beam = raw_lamps.get(i).and_then(|l| l.get("falloff")?.get("file"));
        LampSettings {
            beam_file: beam.and_then(|f| f.as_str()).map(str::to_owned),
            of_gltf: i >= raw_lamps.len(),
            spectrum: light(raw_lamps.get(i).and_then(|l| l.get("spectrum"))),
            ..LampSettings::from(lamp)
        }
    };
    Settings {
        water: scene.water.as_ref().map(|water| Water {
            coefficients: coefficients(scene, water, raw),
            clouds: water.variation.plumes.iter().map(Cloud::from).collect(),
            phase: phase(water, raw),
            refractive_index: water.refractive_index,
        }),
        snow: scene.snow,
        surface: scene.surface.map(|s| Surface {
            height_m: s.height_m,
            refractive: s.refractive,
        }),
        sun: scene.sun.as_ref().map(Sun::from),
        sun_spectrum: light(entry("sun", "spectrum")),
        sky_radiance: scene.sky_radiance,
        sky_spectrum: light(entry("sky", "spectrum")),
        response: response.unwrap_or_default(),
        spectral_surfaces: scene.materials.iter().any(|m| m.spectrum.is_some()),
        camera: CameraSettings::from(&scene.camera),
        lamps: scene.lamps.iter().enumerate().map(lamp).collect(),
        objects: Vec::new(),
        sensor: SensorSettings::read(
            &scene.sensor.unwrap_or_default(),
            text("sensor", "white_balance"),
        ),
        samples_per_pixel: scene.render.samples_per_pixel,
        max_bounces: scene.render.max_bounces,
    }
}

fn coefficients(scene: &Scene, water: &uw_render::scene::Water, raw: &toml::Table) -> Coefficients {
    let field = |name| raw.get("water")?.get(name);
    let text = |name| field(name).and_then(toml::Value::as_str);
    let bands = text("bands").and_then(|name| name.parse().ok());
    let layers = &water.variation.layers;
    let raw_profile = match text("jerlov_profile") {
        Some(name) => name.parse().ok().map(stratified),
        None => field("profile").cloned(),
    };
    if let Some(profile) = raw_profile.and_then(|raw| profile(&raw, layers, bands)) {
        return Coefficients::Profile(profile);
    }
    let spectrum = scene.spectral.as_ref().and_then(|s| s.water.clone());
    if let (Some(path), Some(spectrum)) = (text("spectrum"), spectrum) {
        return Coefficients::OfFile {
            path: path.to_owned(),
            spectrum,
        };
    }
    match field("jerlov").and_then(scale) {
        Some(scale) => Coefficients::Jerlov {
            scale,
            bands: bands.unwrap_or_default(),
        },
        // Without the clouds' share, which `water.iops` has.
        None => Coefficients::Direct(layers.first().map_or(water.iops, |layer| layer.iops)),
    }
}

/// The profile of the entries of a scene file that `layers` were read from.
fn profile(raw: &toml::Value, layers: &[Layer], bands: Option<WaterBands>) -> Option<DepthProfile> {
    let entry = |(raw, layer): (&toml::Value, &Layer)| {
        let text = |field| raw.get(field).and_then(toml::Value::as_str);
        let water = match (text("spectrum"), &layer.spectrum, raw.get("jerlov")) {
            (Some(path), Some(spectrum), _) => LayerWater::OfFile {
                path: path.to_owned(),
                spectrum: spectrum.clone(),
            },
            (_, _, Some(jerlov)) => LayerWater::Jerlov(pure(types(jerlov)?)),
            _ => LayerWater::Direct(layer.iops),
        };
        let depth_m = layer.depth_m;
        Some(Entry { depth_m, water })
    };
    let raw = raw.as_array().filter(|raw| raw.len() == layers.len())?;
    let entries: Option<Vec<_>> = raw.iter().zip(layers).map(entry).collect();
    DepthProfile::new(bands.unwrap_or_default(), entries?)
}

/// The entries that `jerlov_profile` stands for: those of the types of its layers, with jumps between them.
fn stratified(at_surface: WaterType) -> toml::Value {
    let entry = |depth_m: f64, water_type: WaterType| {
        toml::Value::Table(toml::Table::from_iter([
            ("depth_m".to_owned(), depth_m.into()),
            ("jerlov".to_owned(), water_type.name().into()),
        ]))
    };
    let layers = uw_media::depth_profile(at_surface);
    let jumps = layers
        .windows(2)
        .flat_map(|pair| [&pair[0], &pair[1]].map(|own| entry(pair[1].top_m, own.water_type)));
    let first = layers
        .iter()
        .take(1)
        .map(|own| entry(own.top_m, own.water_type));
    toml::Value::Array(first.chain(jumps).collect())
}

/// The place of a water type, or of what lies between two neighbours, along the types. Between types that are no neighbours
/// the place is another water's.
fn scale(jerlov: &toml::Value) -> Option<f64> {
    place(&types(jerlov)?)
}

/// A water type, or what lies between two.
fn types(jerlov: &toml::Value) -> Option<JerlovWater> {
    let one = |name: &toml::Value| name.as_str()?.parse::<WaterType>().ok();
    let Some(between) = jerlov.get("between") else {
        return jerlov.as_str()?.parse().ok();
    };
    let share = jerlov.get("share")?;
    Some(JerlovWater {
        from: one(between.get(0)?)?,
        to: one(between.get(1)?)?,
        share: share.as_float().or(share.as_integer().map(|i| i as f64))?,
    })
}

fn phase(water: &uw_render::scene::Water, raw: &toml::Table) -> PhaseModel {
    use uw_media::phase::{Phase, PhaseFunction};
    match &water.phase {
        Phase::FournierForand(ff) => {
            let written = |field| raw.get("water")?.get("phase")?.get(field)?.as_float();
            PhaseModel::FournierForand {
                n: ff.n(),
                backscatter_fraction: written("backscatter_fraction")
                    .unwrap_or_else(|| rounded(ff.backscatter_fraction())),
            }
        }
        Phase::HenyeyGreenstein(hg) => PhaseModel::HenyeyGreenstein { g: hg.g() },
        Phase::Rayleigh(r) => PhaseModel::Rayleigh {
            depolarisation: r.depolarisation(),
        },
        Phase::Draine(draine) => {
            let (g, alpha) = draine.parameters();
            PhaseModel::Draine { g, alpha }
        }
        Phase::Isotropic => PhaseModel::Isotropic,
        petzold @ Phase::Tabulated(_) if petzold.name() == "petzold" => PhaseModel::Petzold,
        Phase::Tabulated(_) | Phase::Mixture(_) => PhaseModel::OfFile {
            entry: raw
                .get("water")
                .and_then(|w| w.get("phase"))
                .cloned()
                .unwrap_or(toml::Value::Boolean(false)),
            phase: water.phase.clone(),
        },
    }
}
