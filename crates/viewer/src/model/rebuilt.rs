//! Objects that were changed, ready to be rendered.

use std::path::Path;
use std::sync::Arc;

use toml::Value;
use uw_render::prepare::Geometry;
use uw_render::scene::{Lamp, Scene, SceneError};

use super::scene_text::object_text;
use super::{LampSettings, Settings};

/// A scene around objects, whose camera nobody sees.
const HEAD: &str = "format = \"uw-scene/1\"\n\
    camera = { position_m = [0.0, 0.0, 0.0], forward = [1.0, 0.0, 0.0], hfov_deg = 60.0, width = 16, height = 16 }\n";
/// What errors call it.
const NAME: &str = "objects as they are set";

/// What objects bring with them.
#[derive(Clone, Debug)]
pub struct Rebuilt {
    /// The objects.
    pub objects: Vec<Value>,
    /// Their surfaces.
    pub geometry: Arc<Geometry>,
    /// What their files hold and the renderer cannot honour.
    pub warnings: Vec<String>,
    /// Lamps of their glTF files.
    lamps: Vec<Lamp>,
    /// Whether some have reflectances by wavelength.
    by_wavelength: bool,
}

impl Rebuilt {
    /// Reads objects whose files start from `folder`.
    ///
    /// # Errors
    /// What is wrong with an object or its files.
    pub fn read(objects: Vec<Value>, folder: &Path) -> Result<Self, SceneError> {
        let tables: String = objects.iter().map(object_text).collect();
        let scene = Scene::parse(&format!("{HEAD}{tables}"), folder, NAME)?;
        Ok(Self {
            objects,
            geometry: Arc::new(Geometry::build(&scene)),
            by_wavelength: scene.materials.iter().any(|m| m.spectrum.is_some()),
            lamps: scene.lamps,
            warnings: scene.warnings,
        })
    }

    /// Puts into the settings what they hold of these objects: lamps of glTF files go where these are placed now, and keep
    /// what else was set. They are told by their order where they are as many as before, else by their names, which a scene
    /// numbers where they are taken.
    pub fn tell(&self, settings: &mut Settings) {
        settings.spectral_surfaces = self.by_wavelength;
        let known: Vec<usize> = (0..settings.lamps.len())
            .filter(|&i| settings.lamps[i].of_gltf)
            .collect();
        if known.len() == self.lamps.len() {
            for (i, lamp) in known.into_iter().zip(&self.lamps) {
                let own = &mut settings.lamps[i];
                (own.position_m, own.forward) = (lamp.position_m, lamp.forward);
            }
            return;
        }
        let (known, own) = settings.lamps.drain(..).partition(|lamp| lamp.of_gltf);
        settings.lamps = own;
        for lamp in &self.lamps {
            let told = self::told(lamp, &known, settings);
            settings.lamps.push(told);
        }
    }
}

/// A lamp of a glTF file as it is set, or as its file has it where it was not known.
fn told(lamp: &Lamp, known: &[LampSettings], settings: &Settings) -> LampSettings {
    let placed = LampSettings {
        of_gltf: true,
        ..LampSettings::from(lamp)
    };
    let same = known.iter().find(|known| known.name == lamp.name);
    let mut told = same.map_or(placed.clone(), |known| LampSettings {
        position_m: placed.position_m,
        forward: placed.forward,
        ..known.clone()
    });
    if settings.lamps.iter().any(|other| other.name == told.name) {
        told.name = settings.free_lamp_name();
    }
    told
}
