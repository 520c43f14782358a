//! The whole way, small: calibrate in a chosen water, ask the daemon over its socket, look at the result.

mod ask;
mod basis;
mod folder;
mod pairs;
mod plot;
mod report;
mod stages;
mod why;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use uw_calib::Profile;
use uw_guidance::daemon::{self, Limits};
use uw_guidance::service::{Basis, ImagePolicy, Loaded, Service, Settings};
use uw_guidance::{Checks, Strictness};
use uw_render::image::ImageError;
use uw_render::integrator::RenderError;

use uw_calib::vehicle::Vehicle;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{EnvironmentError, Target, WaterBody, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::response::CountResponse;
use uw_twin::routine::RoutineError;

pub use ask::{Choice, Suggestion};
use basis::{Predictor, Way};

/// What to demonstrate.
#[derive(Clone, Debug)]
pub struct DemoOptions {
    /// The water.
    pub water: WaterBody,
    /// What the vehicle looks at.
    pub pattern: Pattern,
    /// The vehicle; the demonstration knows no wavelengths, so it may have no spectra.
    pub vehicle: Vehicle,
    /// Model file; `None` for the shipped one where it is of this vehicle, else for a water that is fitted to the calibration's pictures.
    pub model: Option<PathBuf>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Threads; `None` for one per core.
    pub threads: Option<usize>,
}

/// The demonstration cannot be given.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// An input file is missing or wrong.
    #[error("{0}")]
    Input(String),
    /// The water is not valid, or a texture is missing.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// The calibration failed.
    #[error(transparent)]
    Routine(#[from] RoutineError),
    /// A render failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] ImageError),
    /// The water cannot be fitted, or its tables cannot be made.
    #[error("{0}; a model made for this vehicle (--model) needs none")]
    Water(String),
    /// It was interrupted.
    #[error("interrupted")]
    Interrupted,
    /// The daemon did not answer as it should.
    #[error("daemon: {0}")]
    Daemon(String),
    /// Another file or folder cannot be written.
    #[error("{path}: {reason}")]
    Output {
        /// The path.
        path: String,
        /// What is wrong.
        reason: String,
    },
}

/// One place at which the daemon was asked, with what was rendered there.
#[derive(Clone, Debug)]
pub struct Visit {
    /// Depth, m.
    pub depth_m: f64,
    /// Distance before, m.
    pub distance_m: f64,
    /// Lamp level before, percent.
    pub light_pct: f64,
    /// Contrast before, rendered, 8-bit counts.
    pub contrast_before: [f64; 3],
    /// What the daemon suggests.
    pub suggestion: Suggestion,
    /// What is predicted for staying, for the suggested distance with the lamps off and at full, and for the suggestion.
    pub choices: Vec<Choice>,
    /// Contrast after following it, rendered, 8-bit counts.
    pub contrast_after: [f64; 3],
}

/// The daemon with its defaults, but that it warns where it would refuse to advise: a demonstration may go where the
/// model has never been. It reads pictures in `folder`.
fn daemon_of(basis: Basis, model_name: &str, profile: Profile, folder: &Path) -> Service {
    let loaded = Loaded {
        basis,
        model_name: model_name.to_owned(),
        model_digest: String::new(),
        profile: Some(Arc::new(profile)),
    };
    let checks = Checks {
        training: Strictness::Warn,
        misfit: Strictness::Warn,
        ..Checks::default()
    };
    let settings = Settings {
        checks,
        images: ImagePolicy::Under(folder.to_path_buf()),
        ..Settings::default()
    };
    Service::with_settings(loaded, settings)
}

/// Gives the demonstration in `folder` and returns the path of the report. `tell` gets a line per stage. Nothing is rendered
/// and `tell` gets nothing before all options are known to be good.
pub fn run(
    options: &DemoOptions,
    folder: &Path,
    assets: &Path,
    cancel: &AtomicBool,
    tell: &dyn Fn(&str),
) -> Result<PathBuf, DemoError> {
    let start = Instant::now();
    let way = Way::of(options)?;
    let target = Target::read(options.pattern, assets)?;
    options.water.check()?;
    let vehicle = options.vehicle.clone();
    vehicle.check().map_err(DemoError::Input)?;
    if let Some(field) = vehicle.needs_wavelengths() {
        return Err(DemoError::Input(format!(
            "vehicle.{field} counts by wavelength alone, and the demonstration renders in three bands; leave it out"
        )));
    }
    folder::claim(folder)?;
    let pyramid = TexturePyramid::new(&target.texture, f64::from(options.pattern.tile_m()));
    let stage = stages::DemoRenders {
        response: CountResponse::new(&sensor(&vehicle, vehicle.exposure)),
        pyramid,
        vehicle,
        water: options.water,
        target,
        seed: options.seed,
        threads: options.threads,
        folder,
        cancel,
    };
    tell(&format!(
        "1/4 Calibrating in Jerlov {} water, backscatter fraction {}",
        options.water.jerlov, options.water.backscatter_fraction
    ));
    let profile = stage.calibrate()?;
    if matches!(way, Way::Physics) {
        tell(
            "    the shipped model is of another camera or lamps: fitting the water to these pictures instead, about two minutes",
        );
    }
    let down = stage.target.is_bottom();
    let Predictor { basis, name } = way.predictor(options, down, folder, cancel)?;
    let by_physics = matches!(basis, Basis::Physics(_));
    tell(&format!("2/4 Starting uwguide with {name}"));
    let service = daemon_of(basis, &name, profile.clone(), folder);
    let running = daemon::spawn("127.0.0.1:0", service, Limits::default())
        .map_err(|e| DemoError::Daemon(e.to_string()))?;
    tell(&format!(
        "3/4 Visiting {} depths, asking {} over its socket",
        stages::VISITS.len(),
        running.local_addr()
    ));
    let visits = stage.visit(running.local_addr(), by_physics, tell)?;
    running.shutdown();
    tell("4/4 Writing plot and report");
    plot::write(
        &folder.join("contrast.png"),
        &folder.join("contrast.svg"),
        &visits,
    )?;
    report::write(folder, options, &name, &profile, &visits, start.elapsed())
}
