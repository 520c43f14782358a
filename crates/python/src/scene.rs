//! Scenes.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use uw_render::prepare::Prepared;
use uw_render::scene::{Scene as RenderScene, Setting};

use crate::errors::{value_error, warn};
use crate::from_python::{scene_text, value_text};
use crate::numbers::whole;

/// How errors call a scene that was no file.
const DICT: &str = "dict";

/// Most pixels of a side.
const MOST_PIXELS: u32 = 16_384;

/// Width and height that are asked for.
type Size<'a, 'py> = (Option<&'a Bound<'py, PyAny>>, Option<&'a Bound<'py, PyAny>>);

/// A scene, complete and checked: water, lamps, sun, camera, objects, sensor.
///
/// Made by :meth:`from_file` or :meth:`from_dict`; it cannot be changed. The format is uw-scene/1 of docs/interfaces.md: SI units,
/// angles in degrees, colour triples R, G, B.
#[pyclass(frozen, module = "uwguide")]
pub(crate) struct Scene {
    scene: Arc<RenderScene>,
    /// Made at the first render.
    prepared: OnceLock<Prepared>,
}

impl Scene {
    pub(crate) fn scene(&self) -> &RenderScene {
        &self.scene
    }

    /// The scene as the renderer reads it. To be called without the interpreter's lock, as it may wait for another thread.
    pub(crate) fn prepared(&self) -> &Prepared {
        self.prepared.get_or_init(|| Prepared::build(&self.scene))
    }

    fn of(py: Python<'_>, mut scene: RenderScene, (width, height): Size<'_, '_>) -> PyResult<Self> {
        let side = |name, given: Option<&Bound<'_, PyAny>>| {
            given
                .map(|given| whole(name, given, 1..=MOST_PIXELS))
                .transpose()
        };
        let (width, height) = (side("width", width)?, side("height", height)?);
        let resized = scene.camera.resized(width, height);
        scene.camera =
            resized.map_err(|error| value_error(format_args!("width, height: {error}")))?;
        warn(py, 1, &scene.warnings)?;
        Ok(Self {
            scene: Arc::new(scene),
            prepared: OnceLock::new(),
        })
    }
}

#[pymethods]
impl Scene {
    /// Reads a scene file (TOML, uw-scene/1), or a shipped scene by its name, as in ``"flat_hull"``.
    ///
    /// Args:
    ///     file: path of the file, or name of a shipped scene. Paths in the file start from its folder; ``shipped:NAME`` is a
    ///         file that ships with the package.
    ///     settings: values in the place of those of the file, ``{"water.jerlov": "3C", "lamp.left.level_pct": 50}``: keys are
    ///         paths of fields, elements go by their number from 0, lamps also by their name.
    ///     width: pixels in the place of the file's, 1 to 16384; alone it keeps the proportions. The horizontal field of view
    ///         stays.
    ///     height: pixels, likewise.
    ///
    /// Raises:
    ///     ValueError: the first thing that is wrong, with file, line, field, and what would be right.
    #[classmethod]
    #[pyo3(signature = (file, *, settings = None, width = None, height = None))]
    fn from_file(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        file: PathBuf,
        settings: Option<&Bound<'_, PyDict>>,
        width: Option<&Bound<'_, PyAny>>,
        height: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let file = uw_assets::ALL.named(&file, "scenes", "toml");
        let file = file.map_err(value_error)?;
        let settings = settings.map_or(Ok(Vec::new()), read_settings)?;
        let scene = py.detach(|| RenderScene::read_with(&file, &settings));
        Self::of(py, scene.map_err(value_error)?, (width, height))
    }

    /// Makes a scene of a dictionary with the tables and fields of a scene file.
    ///
    /// Args:
    ///     scene: ``{"format": "uw-scene/1", "water": {"jerlov": "3C"}, "camera": {..}, "lamp": [{..}], ..}``; ``format`` may be
    ///         left out. Values are numbers, texts, lists, dictionaries, arrays of numpy, or paths.
    ///     base_dir: folder from which paths in it start; the working directory where it is left out.
    ///     width: pixels in the place of the dictionary's, 1 to 16384; alone it keeps the proportions.
    ///     height: pixels, likewise.
    ///
    /// Raises:
    ///     ValueError: the first thing that is wrong, with field, and what would be right.
    #[classmethod]
    #[pyo3(signature = (scene, *, base_dir = None, width = None, height = None))]
    fn from_dict(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        scene: &Bound<'_, PyDict>,
        base_dir: Option<PathBuf>,
        width: Option<&Bound<'_, PyAny>>,
        height: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let scene = scene.copy()?;
        if !scene.contains("format")? {
            scene.set_item("format", "uw-scene/1")?;
        }
        let text = scene_text(&scene)?;
        let base_dir = base_dir.unwrap_or_default();
        let read = py.detach(|| RenderScene::parse(&text, &base_dir, DICT));
        let read = read.map_err(|error| value_error(without_line(&error.to_string())))?;
        Self::of(py, read, (width, height))
    }

    /// Width of its pictures, pixels.
    #[getter]
    fn width(&self) -> u32 {
        self.scene.camera.width
    }

    /// Height of its pictures, pixels.
    #[getter]
    fn height(&self) -> u32 {
        self.scene.camera.height
    }

    /// Names of the lamps, in order; ``lamp.NAME`` are their layers.
    #[getter]
    fn lamps(&self) -> Vec<String> {
        self.scene.lamps.iter().map(|l| l.name.clone()).collect()
    }

    /// What was read but cannot be honoured, a sentence each; each has also been a ``UserWarning``.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.scene.warnings.clone()
    }

    fn __repr__(&self) -> String {
        format!(
            "<uwguide.Scene of {} x {} pixels, lamps: {}>",
            self.width(),
            self.height(),
            match self.lamps() {
                none if none.is_empty() => "none".to_owned(),
                names => names.join(", "),
            }
        )
    }
}

/// Settings from a dictionary of paths and values.
fn read_settings(settings: &Bound<'_, PyDict>) -> PyResult<Vec<Setting>> {
    let one = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key = key.str()?.to_string();
        let value = value_text(&value, &key)?;
        let setting = format!("{key}={value}").parse::<Setting>();
        setting.map_err(|error| value_error(format_args!("--set {key}={value}: {error}")))
    };
    settings.iter().map(one).collect()
}

/// The text of an error in a dictionary, which has no lines.
fn without_line(text: &str) -> String {
    let rest = text
        .strip_prefix(DICT)
        .and_then(|rest| rest.strip_prefix(':'));
    match rest.and_then(|rest| rest.split_once(": ")) {
        Some((line, told)) if line.bytes().all(|b| b.is_ascii_digit()) => format!("{DICT}: {told}"),
        _ => text.to_owned(),
    }
}
