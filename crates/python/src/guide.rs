//! Guidance without a daemon: the same answers to the same lines.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use uw_assets::DEFAULT_MODEL;
use uw_guidance::Service;
use uw_guidance::service::{Basis, Loaded, Session, Settings};

use crate::errors::{value_error, warn};
use crate::profile::{Profile, shipped};
use crate::water::Water;

/// Answers requests of the daemon's protocol. ``uwguide.Guide`` is made of it.
#[pyclass(frozen, module = "uwguide._native")]
pub(crate) struct Answers {
    session: Mutex<Session>,
}

#[pymethods]
impl Answers {
    /// Of a model's file or name, or of a water; with a profile.
    #[new]
    #[pyo3(signature = (model, water, profile))]
    fn new(
        py: Python<'_>,
        model: Option<PathBuf>,
        water: Option<&Bound<'_, Water>>,
        profile: Option<&Bound<'_, Profile>>,
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
        let settings = Settings {
            tell_predictor: water.is_some(),
            ..Settings::default()
        };
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
