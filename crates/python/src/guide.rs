//! Guidance without a daemon: the same answers to the same lines.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use uw_assets::DEFAULT_MODEL;
use uw_calib::Encoding;
use uw_guidance::Service;
use uw_guidance::service::{Basis, Loaded, Session, Settings};
use uw_survey::treatment::{Photographs, ideal_camera};
use uw_survey::undistort::port_distances_m;

use crate::errors::{value_error, warn};
use crate::profile::{Profile, shipped};
use crate::water::Water;

/// Has pictures measured as the ideal camera of model or water would have taken them; what should be known of it, a sentence each.
fn photographed(
    photographs: &Photographs,
    basis: &Basis,
    settings: &mut Settings,
) -> PyResult<Vec<String>> {
    if photographs.camera.is_none() && photographs.mask.is_none() {
        return Ok(Vec::new());
    }
    let (rig, encoding, distances_m) = match basis {
        Basis::Network(model) => (model.card().rig, Encoding::default(), port_distances_m()),
        Basis::Physics(water) => {
            let file = water.file();
            (file.rig(), file.sensor.encoding, file.tables.distances_m())
        }
    };
    let ideal = ideal_camera(&rig);
    let (treatment, warnings) = photographs
        .treatment((ideal.as_ref(), None, encoding), &distances_m)
        .map_err(value_error)?;
    settings.photographed(treatment.mask, treatment.undistortion);
    Ok(warnings)
}

/// Answers requests of the daemon's protocol. ``uwguide.Guide`` is made of it.
#[pyclass(frozen, module = "uwguide._native")]
pub(crate) struct Answers {
    session: Mutex<Session>,
}

#[pymethods]
impl Answers {
    /// Of a model's file or name, or of a water; with a profile, and what is done to pictures.
    #[new]
    #[pyo3(signature = (model, water, profile, *, camera, mask))]
    fn new(
        py: Python<'_>,
        model: Option<PathBuf>,
        water: Option<&Bound<'_, Water>>,
        profile: Option<&Bound<'_, Profile>>,
        camera: Option<PathBuf>,
        mask: Option<PathBuf>,
    ) -> PyResult<Self> {
        let mut loaded = match water {
            Some(water) => Loaded {
                basis: Basis::Physics(water.get().shared()),
                model_name: "water".to_owned(),
                model_digest: String::new(),
                profile: None,
            },
            None => {
                let file = match model {
                    Some(model) => shipped(&model, "models")?,
                    None => DEFAULT_MODEL.into(),
                };
                py.detach(|| Loaded::read(&file, None))
                    .map_err(value_error)?
            }
        };
        loaded.profile = profile.map(|profile| profile.get().shared());
        let mut settings = Settings {
            tell_predictor: water.is_some(),
            ..Settings::default()
        };
        let photographs = Photographs { camera, mask };
        warn(
            py,
            2,
            photographed(&photographs, &loaded.basis, &mut settings)?,
        )?;
        warn(py, 2, loaded.warnings(None, &settings.vehicle))?;
        let service = Arc::new(Service::with_settings(loaded, settings));
        Ok(Self {
            session: Mutex::new(Session::new(service)),
        })
    }

    /// The daemon's reply to a line.
    fn reply(&self, py: Python<'_>, line: &str) -> String {
        // Whoever holds the lock does not wait for the interpreter's.
        py.detach(|| {
            let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
            session.reply(line.as_bytes())
        })
    }
}
