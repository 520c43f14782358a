//! Irradiance sensors.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use uw_render::irradiance::{DepthIrradiance, IrradiancePlan, measure};

use crate::arrays;
use crate::errors::value_error;
use crate::interrupt::interruptible;
use crate::numbers;
use crate::render::backend;
use crate::scene::Scene;

/// Most directions per depth and hemisphere.
const MOST_SAMPLES: u32 = 1 << 30;

/// Measures; returns arrays by quantity. See ``uwguide.irradiance``.
#[pyfunction]
#[pyo3(signature = (scene, depths_m, *, samples, seed, backend, adapter, threads))]
#[expect(
    clippy::too_many_arguments,
    reason = "the keywords of uwguide.irradiance"
)]
pub(crate) fn irradiance<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    depths_m: Vec<f64>,
    samples: &Bound<'py, PyAny>,
    seed: &Bound<'py, PyAny>,
    backend: &str,
    adapter: Option<&str>,
    threads: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let scene = scene.get();
    let backend = self::backend(backend)?;
    let plan = IrradiancePlan {
        depths_m,
        samples: numbers::whole("samples", samples, 2..=MOST_SAMPLES)?,
        seed: numbers::seed(seed)?,
        threads: numbers::threads(threads)?,
        max_bounces: scene.scene().render.max_bounces,
    };
    let measured = interruptible(py, plan.threads, |cancel| {
        let device = backend.open(adapter).map_err(|error| error.to_string())?;
        measure(&device, scene.prepared(), &plan, cancel, &|_| ())
            .map_err(|error| error.to_string())
    })?;
    tables(py, &measured.map_err(value_error)?)
}

/// Depths, and for each quantity its values and standard errors, depths × 3.
fn tables<'py>(py: Python<'py>, rows: &[DepthIrradiance]) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let depths_m: Vec<f64> = rows.iter().map(|row| row.depth_m).collect();
    all.set_item("depth_m", arrays::owning(py, depths_m, [rows.len()])?)?;
    let Some(names) = rows
        .first()
        .map(|row| row.quantities().map(|(name, _)| name))
    else {
        return Ok(all);
    };
    for (at, name) in names.into_iter().enumerate() {
        let estimates = || rows.iter().map(|row| row.quantities()[at].1);
        let values: Vec<f64> = estimates().flat_map(|estimate| estimate.value).collect();
        let errors: Vec<f64> = estimates()
            .flat_map(|estimate| estimate.standard_error)
            .collect();
        let shape = [rows.len(), 3];
        all.set_item(name, arrays::owning(py, values, shape)?)?;
        let errors = arrays::owning(py, errors, shape)?;
        all.set_item(format!("{name}_standard_error"), errors)?;
    }
    Ok(all)
}
