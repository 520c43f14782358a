//! Water files.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyType;
use uw_guidance::physics::{Water as KnownWater, WaterFile};
use uw_render::image::write_bytes;

use crate::errors::value_error;

/// A water file (uw-water/1): water, sensor, and what the water does to pictures, for predictions by physics.
///
/// Made by :func:`uwguide.fit` or :meth:`from_file`; it cannot be changed.
#[pyclass(frozen, module = "uwguide")]
pub(crate) struct Water {
    text: String,
    water: Arc<KnownWater>,
    warnings: Vec<String>,
}

impl Water {
    /// A water that came with warnings, as its file has it.
    pub(crate) fn new(file: &WaterFile, warnings: Vec<String>) -> PyResult<Self> {
        let text = file.to_json();
        // The file has fewer digits: what is asked now is what will be asked of the file.
        let file = serde_json::from_str(&text).map_err(value_error)?;
        Ok(Self {
            text,
            water: Arc::new(KnownWater::new(file)),
            warnings,
        })
    }

    /// What guidance uses of it.
    pub(crate) fn shared(&self) -> Arc<KnownWater> {
        Arc::clone(&self.water)
    }
}

#[pymethods]
impl Water {
    /// Reads a water file, as of ``uw fit`` and ``uw water-tables``.
    ///
    /// Raises:
    ///     ValueError: it cannot be read or used; the text names file and field.
    #[classmethod]
    fn from_file(_class: &Bound<'_, PyType>, py: Python<'_>, file: PathBuf) -> PyResult<Self> {
        let file = py.detach(|| WaterFile::read(&file)).map_err(value_error)?;
        Self::new(&file, Vec::new())
    }

    /// The JSON text of its file.
    fn to_json(&self) -> &str {
        &self.text
    }

    /// Writes its file (JSON, uw-water/1), whole or not at all.
    fn write(&self, py: Python<'_>, file: PathBuf) -> PyResult<()> {
        let written = py.detach(|| write_bytes(&file, self.text.as_bytes()));
        written.map_err(value_error)
    }

    /// Absorption per channel (R, G, B), 1/m.
    #[getter]
    fn a_per_m(&self) -> [f64; 3] {
        self.water.file().water.a_per_m
    }

    /// Scattering per channel (R, G, B), 1/m.
    #[getter]
    fn b_per_m(&self) -> [f64; 3] {
        self.water.file().water.b_per_m
    }

    /// Share of the scattered light that is turned by more than 90 degrees, in [0, 1].
    #[getter]
    fn backscatter_fraction(&self) -> f64 {
        self.water.file().water.backscatter_fraction
    }

    /// Names of fitted numbers that the pictures do not tell; empty where nothing was fitted.
    #[getter]
    fn not_identified(&self) -> Vec<String> {
        let fit = self.water.file().fit.as_ref();
        fit.map(|fit| fit.not_identified.clone())
            .unwrap_or_default()
    }

    /// What should be known of it, a sentence each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    fn __repr__(&self) -> String {
        format!(
            "<uwguide.Water of a {:.3?} and b {:.3?} per m>",
            self.a_per_m(),
            self.b_per_m()
        )
    }
}
