//! Objects that were changed, ready to be rendered.

use std::path::Path;
use std::sync::Arc;

use toml::Value;
use uw_render::prepare::Geometry;
use uw_render::scene::{Lamp, Scene, SceneError};

use super::Settings;
use super::scene_text::object_text;

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
    /// what else was set.
    pub fn tell(&self, settings: &mut Settings) {
        settings.spectral_surfaces = self.by_wavelength;
        settings.lamps.retain_mut(|known| {
            let same = self.lamps.iter().find(|lamp| lamp.name == known.name);
            let lamp = same.filter(|_| known.of_gltf);
            if let Some(lamp) = lamp {
                (known.position_m, known.forward) = (lamp.position_m, lamp.forward);
            }
            !known.of_gltf || lamp.is_some()
        });
    }
}
