//! From a line to a line: what the daemon answers, without any socket.
//!
//! [`Service`] is what all connections share, [`Session`] one connection's view of it. Answers depend on
//! the request, the moment and the shared state alone, so a recorded session can be answered again.

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};
use thiserror::Error;
use uw_calib::vehicle::LevelCurve;
use uw_calib::{Mask, NoiseModel, Profile, ProfileError, Rig, Treatment, Undistortion};

use crate::beams::BeamGeometry;
use crate::checks::Checks;
use crate::feed::{Feed, MaxAge};
use crate::metrics::Metrics;
use crate::mlp::Model;
use crate::model_file::ModelError;
use crate::objective::Objective;
use crate::operations::files::regular;
use crate::physics::{Water, WaterFile, WaterFileError};
use crate::reason::NeedsProfile;
use crate::steering::Steering;

mod album;
mod describe;
mod fit;
mod image;
mod lamps;
mod resolve;
mod session;
mod subscription;
mod suggestion;
mod why;

pub use fit::{other_camera, other_profile};
pub use image::ImagePolicy;
pub use session::{Answered, Pending, Session};
pub use subscription::steering_with;

/// What the daemon answers with, where a request does not say otherwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// The objective.
    pub objective: Objective,
    /// What advice has to pass.
    pub checks: Checks,
    /// How old inputs may be.
    pub max_age: MaxAge,
    /// Hysteresis and rate limits of subscriptions.
    pub steering: Steering,
    /// Directions of the beams of `distances_m`.
    pub beams: BeamGeometry,
    /// Which image files may be read.
    pub images: ImagePolicy,
    /// Where the noise of images is taken from.
    pub noise: NoiseModel,
    /// What is done to images before they are measured: their lens (that of the water file where none is given), mask and undistortion.
    pub treatment: Treatment,
    /// Camera and lamps of the vehicle, as far as they are known: those of model, water file and profile have to be the same.
    pub vehicle: Rig,
    /// Light of the vehicle's lamps by the level that they are set to; `None`: in proportion.
    pub level_curve: Option<LevelCurve>,
    /// The token that each connection has to show first.
    pub token: Option<String>,
    /// Whether replies by a network say so; those by physics always do.
    pub tell_predictor: bool,
}

impl Settings {
    /// Images are those of a camera with a mask, a lens and a port: they are measured as the ideal camera would have taken them, which model, water file and
    /// profile have to be of.
    pub fn photographed(&mut self, mask: Option<Mask>, undistortion: Option<Undistortion>) {
        if let Some(undistortion) = &undistortion {
            let ideal = Rig::of_size(undistortion.ideal_px());
            self.vehicle.width_px = ideal.width_px;
            self.vehicle.height_px = ideal.height_px;
            self.vehicle.hfov_deg = Some(undistortion.hfov_deg());
        }
        self.treatment.mask = mask;
        self.treatment.undistortion = undistortion;
    }
}

/// What contrast is predicted from.
#[derive(Clone, Debug)]
pub enum Basis {
    /// A network.
    Network(Box<Model>),
    /// Physics in a known water.
    Physics(Arc<Water>),
}

impl Basis {
    /// Its name in replies.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Network(_) => "network",
            Self::Physics(_) => "physics",
        }
    }

    /// Why there is no answer without a profile; `None` where none is needed.
    fn needs_profile(&self, objective: &Objective) -> Option<NeedsProfile> {
        NeedsProfile::of(matches!(self, Self::Physics(_)), objective)
    }
}

impl From<Model> for Basis {
    fn from(model: Model) -> Self {
        Self::Network(Box::new(model))
    }
}

/// What can be replaced while the daemon runs.
#[derive(Debug)]
pub struct Loaded {
    /// What contrast is predicted from: a model or a water file.
    pub basis: Basis,
    /// What `info` calls the model, or the water file.
    pub model_name: String,
    /// Tells one such file from another in recordings; empty for a model that is no file.
    pub model_digest: String,
    /// The calibration; connections may bring their own.
    pub profile: Option<Arc<Profile>>,
}

/// Why files cannot be loaded.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The water file.
    #[error(transparent)]
    Water(#[from] WaterFileError),
    /// The profile.
    #[error(transparent)]
    Profile(#[from] ProfileError),
    /// A file is no regular one, or cannot be looked at.
    #[error("{file}: {source}")]
    File {
        /// File name.
        file: String,
        /// What is wrong.
        source: io::Error,
    },
    /// A profile, a model and a water file in place of each other.
    #[error("{file}: this is a {what}; give it as {option}")]
    Swapped {
        /// File name.
        file: String,
        /// What the file is.
        what: &'static str,
        /// Option of the command line that takes it.
        option: &'static str,
    },
}

/// A moment on the two clocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Since the start of the daemon, s, on a clock that never jumps.
    pub since_start_s: f64,
    /// Since 1970 (UTC), s, on a clock that may be set.
    pub unix_s: f64,
}

/// What all connections share: model, profile, settings, the vehicle's state and counters.
#[derive(Debug)]
pub struct Service {
    settings: Settings,
    shared: Mutex<Shared>,
    started: Instant,
    metrics: Metrics,
    reloads: AtomicU64,
    reload_error: Mutex<Option<String>>,
}

#[derive(Debug)]
struct Shared {
    feed: Feed,
    loaded: Arc<Loaded>,
    /// Number of the next use of this state; a recording is put in order by it.
    sequence: u64,
}

/// The shared state at one moment.
#[derive(Debug)]
struct Snapshot {
    sequence: u64,
    feed: Feed,
    loaded: Arc<Loaded>,
}

impl Loaded {
    /// Reads a model file and, where there is one, a profile file.
    pub fn read(model: &Path, profile: Option<&Path>) -> Result<Self, LoadError> {
        Self::read_both(model, profile, |file| {
            let (model, digest) = Model::read_with_digest(file)?;
            Ok((model.into(), digest))
        })
    }

    /// Reads a water file and, where there is one, a profile file.
    pub fn read_water(water: &Path, profile: Option<&Path>) -> Result<Self, LoadError> {
        Self::read_both(water, profile, |file| {
            let (water, digest) = WaterFile::read_with_digest(file)?;
            Ok((Basis::Physics(Arc::new(Water::new(water))), digest))
        })
    }

    fn read_both(
        file: &Path,
        profile: Option<&Path>,
        read: impl Fn(&Path) -> Result<(Basis, String), LoadError>,
    ) -> Result<Self, LoadError> {
        for file in profile.into_iter().chain([file]) {
            openable(file)?;
        }
        let profile = match profile {
            Some(file) => Some(Profile::read(file).map_err(|error| swapped(file, error.into()))?),
            None => None,
        };
        let (basis, digest) = read(file).map_err(|error| swapped(file, error))?;
        Ok(Self {
            basis,
            model_name: file.display().to_string(),
            model_digest: digest,
            profile: profile.map(Arc::new),
        })
    }

    /// Tells the log what may be wrong.
    fn warn(&self, settings: &Settings) {
        let of_objective = self.objective_warning(&settings.objective);
        for warning in self
            .warnings(None, &settings.vehicle)
            .into_iter()
            .chain(of_objective)
        {
            tracing::warn!(model = self.model_name, "{warning}");
        }
    }
}

/// Refuses a file that is there but is no regular one; what reading it would say is left to reading.
fn openable(file: &Path) -> Result<(), LoadError> {
    if uw_assets::shipped_name(file).is_some() {
        return Ok(());
    }
    match regular(file) {
        Err(source) if source.kind() == io::ErrorKind::InvalidInput => Err(LoadError::File {
            file: file.display().to_string(),
            source,
        }),
        _ => Ok(()),
    }
}

/// The error, or a better one where the file is a good one in the wrong place.
fn swapped(file: &Path, error: LoadError) -> LoadError {
    let value = uw_assets::SMALL
        .read(file)
        .ok()
        .and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok())
        .unwrap_or_default();
    let format = value["format"].as_str().unwrap_or_default();
    let [profile, model, water] = [
        format.starts_with("uw-profile/"),
        format == "uw-mlp",
        format.starts_with("uw-water/"),
    ];
    let (what, option) = match &error {
        LoadError::Model(_) | LoadError::Water(_) if profile => {
            ("calibration profile", "--profile")
        }
        LoadError::Profile(_) | LoadError::Water(_) if model => ("model", "--model"),
        LoadError::Profile(_) | LoadError::Model(_) if water => ("water file", "--water"),
        _ => return error,
    };
    LoadError::Swapped {
        file: file.display().to_string(),
        what,
        option,
    }
}

impl Service {
    /// A service with an objective and defaults otherwise; `model_name` is what `info` calls the model.
    pub fn new(
        model: Model,
        model_name: impl Into<String>,
        profile: Profile,
        objective: Objective,
    ) -> Self {
        let loaded = Loaded {
            basis: model.into(),
            model_name: model_name.into(),
            model_digest: String::new(),
            profile: Some(Arc::new(profile)),
        };
        let settings = Settings {
            objective,
            ..Settings::default()
        };
        Self::with_settings(loaded, settings)
    }

    /// A service with all settings.
    pub fn with_settings(loaded: Loaded, settings: Settings) -> Self {
        loaded.warn(&settings);
        Self {
            settings,
            shared: Mutex::new(Shared {
                feed: Feed::default(),
                loaded: Arc::new(loaded),
                sequence: 0,
            }),
            started: Instant::now(),
            metrics: Metrics::default(),
            reloads: AtomicU64::new(0),
            reload_error: Mutex::new(None),
        }
    }

    /// What it was told.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Counters of what it does.
    pub fn metrics(&self) -> &Metrics {
        &self.metrics
    }

    /// Now, on both clocks.
    pub fn now(&self) -> Moment {
        let unix = SystemTime::now().duration_since(UNIX_EPOCH);
        Moment {
            since_start_s: self.started.elapsed().as_secs_f64(),
            unix_s: unix.map_or(0.0, |since| since.as_secs_f64()),
        }
    }

    /// Takes another model and profile; requests under way end with the old ones. What is in use now is
    /// returned with its place among the answers.
    pub fn replace(&self, loaded: Loaded) -> (u64, Arc<Loaded>) {
        loaded.warn(&self.settings);
        self.reloads.fetch_add(1, Ordering::Relaxed);
        *self.reload_error() = None;
        let mut shared = self.lock();
        shared.loaded = Arc::new(loaded);
        (shared.next(), Arc::clone(&shared.loaded))
    }

    /// Settings, and model and profile with their names, as a recording keeps them.
    pub fn describe(&self, loaded: &Loaded) -> Value {
        let mut described = json!({
            "model": loaded.model_name,
            "model_digest": loaded.model_digest,
            "profile": loaded.profile.as_ref().and_then(|profile| {
                serde_json::from_str::<Value>(&profile.to_json()).ok()
            }),
            "objective": describe::objective(&self.settings.objective),
            "settings": describe::settings(&self.settings),
        });
        if let Basis::Physics(_) = loaded.basis {
            described["predictor"] = loaded.basis.name().into();
        }
        described
    }

    /// Notes that a reload was refused; what is loaded stays.
    pub fn reload_failed(&self, message: String) {
        self.metrics.reload_failures.count();
        *self.reload_error() = Some(message);
    }

    /// The model and profile in use.
    pub fn loaded(&self) -> Arc<Loaded> {
        Arc::clone(&self.lock().loaded)
    }

    /// Whether a profile is missing that the configured objective needs.
    pub fn lacks_profile(&self) -> bool {
        let loaded = self.loaded();
        let needs = loaded.basis.needs_profile(&self.settings.objective);
        loaded.profile.is_none() && needs.is_some()
    }

    /// The vehicle's latest state.
    pub fn feed(&self) -> Feed {
        self.lock().feed
    }

    /// The state at this moment, after a change of the feed.
    fn snapshot<T>(&self, change: impl FnOnce(&mut Feed) -> T) -> (Snapshot, T) {
        let mut shared = self.lock();
        let told = change(&mut shared.feed);
        let snapshot = Snapshot {
            sequence: shared.next(),
            feed: shared.feed,
            loaded: Arc::clone(&shared.loaded),
        };
        (snapshot, told)
    }

    // Nothing panics while holding these locks; should it, the values are whole all the same.
    fn lock(&self) -> std::sync::MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether all is as it should be; not so when the last reload was refused.
    pub fn is_well(&self) -> bool {
        self.reload_error().is_none()
    }

    fn reloads(&self) -> u64 {
        self.reloads.load(Ordering::Relaxed)
    }

    fn reload_error(&self) -> std::sync::MutexGuard<'_, Option<String>> {
        self.reload_error
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shared {
    fn next(&mut self) -> u64 {
        self.sequence += 1;
        self.sequence
    }
}
