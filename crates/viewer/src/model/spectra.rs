//! Spectra of lights and the camera's response, as scene files name them.

use std::path::Path;

use toml::Value;
use uw_assets::joined;
use uw_media::spectral::{Curve, Response, illuminant, read_columns};

/// The word for the clear sky's own spectra, which follow the sun.
const CLEAR_SKY: &str = "clear-sky";

/// The relative spectrum of a light.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSpectrum {
    /// What a scene file says: a name, or a table with a file.
    pub entry: Value,
    /// The spectrum; `None` for the clear sky's, which hangs on the sun.
    curve: Option<Curve>,
}

impl LightSpectrum {
    /// The spectrum of a name, one of [`uw_media::spectral::ILLUMINANTS`] or the clear sky; `None` for others.
    pub fn named(name: &str) -> Option<Self> {
        let curve = match name {
            CLEAR_SKY => None,
            name => Some(illuminant(name).ok()?),
        };
        Some(Self {
            entry: Value::from(name),
            curve,
        })
    }

    /// What a scene file in `folder` says, which has been read before.
    pub fn read(entry: &Value, folder: &Path) -> Option<Self> {
        if let Some(name) = entry.as_str() {
            return Self::named(name);
        }
        let text = read_file(&joined(folder, entry.get("file")?.as_str()?))?;
        let [curve] = read_columns(&text, ["relative"], None).ok()?;
        Some(Self {
            entry: entry.clone(),
            curve: Some(curve),
        })
    }

    /// The spectrum; flat where it is the clear sky's.
    pub fn curve(&self) -> Curve {
        self.curve_or(|| Curve::new(vec![(0.0, 1.0), (1e6, 1.0)]))
    }

    /// The spectrum, where it is the clear sky's what `clear` gives.
    pub fn curve_or(&self, clear: impl FnOnce() -> Curve) -> Curve {
        self.curve.clone().unwrap_or_else(clear)
    }
}

/// The text of a file, a shipped one too.
fn read_file(path: &Path) -> Option<String> {
    uw_assets::ALL.read_to_string(path).ok()
}

/// The response of the camera's channels.
#[derive(Clone, Debug, PartialEq)]
pub struct ResponseSettings {
    /// What a scene file says; `None` for three boxes.
    pub entry: Option<Value>,
    /// The response.
    pub response: Response,
}

impl Default for ResponseSettings {
    fn default() -> Self {
        Self {
            entry: None,
            response: Response::boxes(),
        }
    }
}

impl ResponseSettings {
    /// The response of a name, one of [`uw_media::spectral::RESPONSES`]; `None` for others.
    pub fn named(name: &str) -> Option<Self> {
        Some(Self {
            response: Response::named(name).ok()?,
            entry: Some(Value::from(name)),
        })
    }

    /// What a scene file in `folder` says, which has been read before.
    pub fn read(entry: &Value, folder: &Path) -> Option<Self> {
        if let Some(name) = entry.as_str() {
            return Self::named(name);
        }
        let path = joined(folder, entry.get("file")?.as_str()?);
        let name = path.file_name()?.to_string_lossy().into_owned();
        let text = read_file(&path)?;
        Some(Self {
            entry: Some(entry.clone()),
            response: Response::parse(&text, &name).ok()?,
        })
    }
}

/// A short name of what a scene file says.
pub fn short_name(entry: &Value) -> &str {
    let file = || entry.get("file").and_then(Value::as_str);
    entry.as_str().or_else(file).unwrap_or_default()
}
