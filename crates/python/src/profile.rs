//! Calibration profiles.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyType;
use uw_calib::{ContrastSample, Profile as CalibrationProfile, ProfileError};

use crate::arrays;
use crate::errors::value_error;

/// Two arrays: places, and values per channel at each.
type Samples<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>);

/// A calibration profile (uw-profile/1): K_z, how daylight falls with depth, and K_c, how contrast falls with distance.
///
/// Made by :func:`uwguide.calibrate`, :meth:`from_file` or :meth:`from_json`; it cannot be changed. Values between its samples are
/// interpolated linearly; outside them a ``ValueError`` is raised.
#[pyclass(frozen, module = "uwguide")]
pub(crate) struct Profile {
    profile: Arc<CalibrationProfile>,
    warnings: Vec<String>,
}

impl Profile {
    /// A profile that came with warnings.
    pub(crate) fn new(profile: CalibrationProfile, warnings: Vec<String>) -> Self {
        Self {
            profile: Arc::new(profile),
            warnings,
        }
    }

    /// What guidance uses of it.
    pub(crate) fn shared(&self) -> Arc<CalibrationProfile> {
        Arc::clone(&self.profile)
    }
}

/// The file that a user means: itself, or by its name a shipped one of `folder`.
///
/// # Errors
/// A bare name of no shipped file.
pub(crate) fn shipped(given: &Path, folder: &str) -> PyResult<PathBuf> {
    uw_assets::SMALL
        .named(given, folder, "json")
        .map_err(value_error)
}

#[pymethods]
impl Profile {
    /// Reads a profile file, or a shipped profile by its name, as in ``"1C"``.
    ///
    /// Raises:
    ///     ValueError: it cannot be read or used; the text names file and field.
    #[classmethod]
    fn from_file(_class: &Bound<'_, PyType>, py: Python<'_>, file: PathBuf) -> PyResult<Self> {
        let file = shipped(&file, "profiles")?;
        let profile = py
            .detach(|| CalibrationProfile::read(&file))
            .map_err(value_error)?;
        let warnings = profile.warnings();
        Ok(Self::new(profile, warnings))
    }

    /// Makes a profile of the JSON text of a profile file.
    #[classmethod]
    fn from_json(_class: &Bound<'_, PyType>, text: &str) -> PyResult<Self> {
        let value = serde_json::from_str(text).map_err(value_error)?;
        let profile = CalibrationProfile::from_json(&value).map_err(value_error)?;
        let warnings = profile.warnings();
        Ok(Self::new(profile, warnings))
    }

    /// The JSON text of its file.
    fn to_json(&self) -> String {
        self.profile.to_json()
    }

    /// Writes its file (JSON, uw-profile/1), whole or not at all.
    fn write(&self, py: Python<'_>, file: PathBuf) -> PyResult<()> {
        py.detach(|| self.profile.write(&file)).map_err(value_error)
    }

    /// K_z at a depth in m within :attr:`depth_range_m`: mean of a picture that looks up over that at the shallowest depth, no unit;
    /// float64 of shape (3,).
    fn k_z<'py>(&self, py: Python<'py>, depth_m: f64) -> PyResult<Bound<'py, PyAny>> {
        triple(py, self.profile.k_z(depth_m))
    }

    /// K_c with the lamps on from a distance in m within :attr:`distance_range_m`, 8-bit counts; float64 of shape (3,).
    fn k_c_on<'py>(&self, py: Python<'py>, distance_m: f64) -> PyResult<Bound<'py, PyAny>> {
        triple(py, self.profile.k_c_on(distance_m))
    }

    /// K_c with the lamps off from a distance in m within :attr:`distance_range_m`, 8-bit counts; float64 of shape (3,).
    fn k_c_off<'py>(&self, py: Python<'py>, distance_m: f64) -> PyResult<Bound<'py, PyAny>> {
        triple(py, self.profile.k_c_off(distance_m))
    }

    /// The samples of K_z: depths in m, shape (N,), and values, no unit, shape (N, 3); float64.
    #[getter]
    fn depth<'py>(&self, py: Python<'py>) -> PyResult<Samples<'py>> {
        samples(py, self.profile.depth().iter().map(|s| (s.depth_m, s.k_z)))
    }

    /// The samples of K_c with the lamps on: distances in m, shape (N,), and values in 8-bit counts, shape (N, 3); float64.
    #[getter]
    fn contrast_on<'py>(&self, py: Python<'py>) -> PyResult<Samples<'py>> {
        samples(py, contrasts(self.profile.contrast_on()))
    }

    /// The samples of K_c with the lamps off: distances in m, shape (N,), and values in 8-bit counts, shape (N, 3); float64.
    #[getter]
    fn contrast_off<'py>(&self, py: Python<'py>) -> PyResult<Samples<'py>> {
        samples(py, contrasts(self.profile.contrast_off()))
    }

    /// Smallest and largest calibrated depth, m.
    #[getter]
    fn depth_range_m(&self) -> (f64, f64) {
        self.profile.depth_range_m()
    }

    /// Smallest and largest distance calibrated with lamps on and off, m.
    #[getter]
    fn distance_range_m(&self) -> (f64, f64) {
        self.profile.distance_range_m()
    }

    /// What should be known of it, a sentence each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    fn __repr__(&self) -> String {
        let ((shallowest, deepest), (nearest, farthest)) =
            (self.depth_range_m(), self.distance_range_m());
        format!(
            "<uwguide.Profile of depths {shallowest} to {deepest} m and distances {nearest} to {farthest} m>"
        )
    }
}

fn triple(py: Python<'_>, value: Result<[f64; 3], ProfileError>) -> PyResult<Bound<'_, PyAny>> {
    arrays::owning(py, value.map_err(value_error)?.to_vec(), [3])
}

fn contrasts(samples: &[ContrastSample]) -> impl Iterator<Item = (f64, [f64; 3])> {
    samples.iter().map(|sample| (sample.distance_m, sample.k_c))
}

fn samples(
    py: Python<'_>,
    samples: impl Iterator<Item = (f64, [f64; 3])>,
) -> PyResult<Samples<'_>> {
    let (places, values): (Vec<f64>, Vec<[f64; 3]>) = samples.unzip();
    let count = places.len();
    let values = arrays::owning(py, values.into_flattened(), [count, 3])?;
    Ok((arrays::owning(py, places, [count])?, values))
}
