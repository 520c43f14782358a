//! Advice in the viewer: calibration, looks from the vehicle's camera, the objective around the present state, the
//! daemon, recorded operations.

pub mod answer;
mod asking;
mod camera;
pub mod daemon;
pub mod look;
pub mod operation;
pub mod origin;
pub mod sightings;
pub mod task;
pub mod water;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use uw_calib::Profile;
use uw_calib::vehicle::Vehicle;
use uw_guidance::{Model, Objective, Observation};
use uw_scenery::textures::Pattern;
use uw_twin::routine::TARGET_PATHS;

use crate::model::Settings;
use crate::ui::toasts::Toasts;
use answer::Answer;
pub use camera::VARIES;
use daemon::Link;
pub use look::{Look, Seen};
use operation::Operation;
use origin::Origin;
use sightings::Sightings;
use task::{ContrastErrors, Done, Tables, Task, VehiclePosition};
use water::{KnownWater, MadeFor};

/// Who gives advice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Adviser {
    /// Physics, in the water that is set, from the picture of the last look.
    #[default]
    Physics,
    /// A network, from the statistics of a picture and the calibration.
    Network,
    /// A running `uwguide`.
    Daemon,
}

/// Contrast at the suggestion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// Suggested distance, m, and lamp level, percent.
    pub at: [f64; 2],
    /// Contrast of the render there, 8-bit counts.
    pub rendered: [f64; 3],
    /// Its standard error, 8-bit counts.
    pub error: [f64; 3],
}

/// All about advice.
pub struct Guidance {
    /// The network and where it comes from, or why there is none.
    pub model: Result<(Arc<Model>, String), String>,
    /// The calibration.
    pub profile: Option<Arc<Profile>>,
    /// How well its contrasts are known; `None` of one that was opened, which does not say it.
    pub profile_errors: Option<Arc<ContrastErrors>>,
    /// With what it was made; `None` of one that was opened, which does not say it.
    pub origin: Option<Origin>,
    /// What is wanted.
    pub objective: Objective,
    /// What the vehicle looks at.
    pub pattern: Pattern,
    /// Paths per group of a view of the target.
    pub paths: u32,
    /// Where the vehicle is.
    pub position: VehiclePosition,
    /// Its lamp level, percent.
    pub light_pct: f64,
    /// Its camera, sensor and lamps; it has no spectra of its own.
    pub vehicle: Vehicle,
    /// The newest look from where it is.
    pub look: Option<Arc<Look>>,
    /// Who is asked.
    pub adviser: Adviser,
    /// The daemon.
    pub link: Link,
    /// The newest advice.
    pub answer: Option<Answer>,
    /// The render at the suggestion.
    pub check: Option<Check>,
    /// A recorded operation.
    pub operation: Option<Operation>,
    /// Whether the camera goes where the recorded vehicle was.
    pub camera_follows: bool,
    assets: Option<PathBuf>,
    ctx: egui::Context,
    task: Option<Task>,
    water_known: Option<Settings>,
    /// With what the calibration is made that was begun.
    begun: Option<Origin>,
    /// The water of the newest tables.
    known_water: Option<KnownWater>,
    /// What the tables are made for that were begun.
    tables_for: Option<MadeFor>,
    /// The pictures of the looks, for physics.
    sightings: Sightings,
    /// What was before the camera in them.
    sighted: Pattern,
}

impl Guidance {
    /// With the shipped model; `assets` is the folder of textures.
    pub fn new(assets: Option<PathBuf>, ctx: egui::Context) -> Self {
        Self {
            model: load_model(),
            profile: None,
            profile_errors: None,
            origin: None,
            objective: Objective::default(),
            pattern: Pattern::HullRed,
            paths: TARGET_PATHS,
            position: VehiclePosition {
                depth_m: 3.0,
                distance_m: 1.5,
            },
            light_pct: 20.0,
            look: None,
            adviser: Adviser::default(),
            link: Link::default(),
            answer: None,
            check: None,
            operation: None,
            camera_follows: false,
            assets,
            ctx,
            task: None,
            vehicle: Vehicle::default(),
            water_known: None,
            begun: None,
            known_water: None,
            tables_for: None,
            sightings: Sightings::default(),
            sighted: Pattern::HullRed,
        }
    }

    /// What is being done, in words, and how much of it is done, in [0, 1].
    pub fn progress(&self) -> Option<(String, f32)> {
        self.task.as_ref().map(Task::progress)
    }

    /// Whether physics is reading a picture; what answers is older until then.
    pub fn is_reading(&self) -> bool {
        self.sightings.is_making()
    }

    /// Ends what is being done.
    pub fn cancel(&mut self) {
        self.task = None;
    }

    /// Calibrates in the water of `settings`, then looks from where the vehicle is.
    pub fn calibrate(&mut self, settings: &Settings, toasts: &mut Toasts) {
        self.water_known = Some(settings.clone());
        self.begun = Some(Origin {
            pattern: self.pattern,
            vehicle: self.vehicle.clone(),
        });
        self.start(
            settings,
            task::Work::Calibrate {
                here: self.position,
            },
            toasts,
        );
    }

    /// Looks from where the vehicle is.
    pub fn look(&mut self, settings: &Settings, toasts: &mut Toasts) {
        self.start(
            settings,
            task::Work::Look {
                here: self.position,
            },
            toasts,
        );
    }

    /// Renders the suggestion.
    pub fn check_suggestion(&mut self, settings: &Settings, toasts: &mut Toasts) {
        if let Some(answer) = &self.answer {
            let there = VehiclePosition {
                distance_m: answer.distance_m,
                ..self.position
            };
            let light_pct = answer.light_pct;
            self.start(settings, task::Work::Check { there, light_pct }, toasts);
        }
    }

    fn start(&mut self, settings: &Settings, work: task::Work, toasts: &mut Toasts) {
        let Some(assets) = self.assets.clone() else {
            toasts.error("the folder of the shipped files was not found: leave out --assets and UWGUIDE_ASSETS, or name one");
            return;
        };
        let tables = self.tables(settings, work);
        let job = task::GuidanceJob {
            work,
            tables,
            settings: settings.clone(),
            pattern: self.pattern,
            paths: self.paths,
            vehicle: self.vehicle.clone(),
            assets,
        };
        let ctx = self.ctx.clone();
        match Task::start(job, move || ctx.request_repaint()) {
            Ok(task) => self.task = Some(task),
            Err(error) => toasts.error(format!("cannot start now: {error}")),
        }
    }

    /// What is to be done about the tables of the water for `work`.
    fn tables(&mut self, settings: &Settings, work: task::Work) -> Tables {
        let is_look = !matches!(work, task::Work::Check { .. });
        if self.adviser != Adviser::Physics || !is_look {
            return Tables::Unasked;
        }
        let made_for = MadeFor::new(settings, &self.vehicle, self.pattern);
        let known = self.known_water.as_ref();
        if let Some(known) = known.filter(|known| known.made_for == made_for) {
            return Tables::Known(Arc::clone(&known.water));
        }
        self.tables_for = Some(made_for);
        Tables::Make
    }

    /// Takes what tasks have brought.
    pub fn poll(&mut self, toasts: &mut Toasts) {
        while let Some(done) = self.task.as_mut().and_then(Task::done) {
            match done {
                Done::Calibrated(calibrated) => {
                    self.profile = Some(calibrated.profile);
                    self.profile_errors = Some(calibrated.errors);
                    self.origin = self.begun.take();
                    toasts.info("Calibrated");
                }
                Done::Tabulated(water) => {
                    let made_for = self.tables_for.take();
                    self.known_water = made_for.map(|made_for| KnownWater { made_for, water });
                }
                Done::Looked(look) => {
                    if self.sighted != self.pattern {
                        self.sightings.forget();
                        self.sighted = self.pattern;
                    }
                    self.look = Some(look);
                }
                Done::Checked(check) => self.check = Some(check),
                Done::Failed(message) => toasts.error(message),
                Done::All => self.task = None,
            }
        }
        if let Some(answer) = self.link.poll(toasts) {
            self.answer = Some(answer);
        }
        match self.adviser {
            Adviser::Physics if self.operation_observation().is_none() => self.ask_physics(),
            Adviser::Physics | Adviser::Network => self.ask_network(),
            Adviser::Daemon => {}
        }
    }

    /// Whether the water has changed since the calibration.
    pub fn is_outdated(&self, settings: &Settings) -> bool {
        let known = self.water_known.as_ref();
        known.is_some_and(|known| known.water_and_sky() != settings.water_and_sky())
    }

    /// The look from where the vehicle is.
    fn look_from_here(&self) -> Option<&Arc<Look>> {
        let look = self.look.as_ref();
        look.filter(|look| look.position == self.position)
    }

    /// What is seen from where the vehicle is; `None` before a look from there.
    pub fn seen(&self) -> Option<Seen> {
        self.look_from_here()?.statistics(self.light_pct)
    }

    /// Whether physics has tables of the water in which the vehicle sees; `None` before a look from where it is.
    pub fn has_tables(&self) -> Option<bool> {
        Some(self.look_from_here()?.water.is_some())
    }

    /// What the vehicle knows now; `None` before a look from where it is.
    pub fn observation(&self) -> Option<Observation> {
        let stats = self.seen()?.stats;
        Some(Observation {
            depth_m: self.position.depth_m,
            distance_m: self.position.distance_m,
            light_pct: self.light_pct,
            mean: stats.mean,
            std: stats.contrast,
            quality: None,
        })
    }

    /// Reads a profile.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn open_profile(&mut self, path: &Path) -> Result<(), String> {
        let profile = Profile::read(path).map_err(|e| e.to_string())?;
        self.profile = Some(Arc::new(profile));
        self.profile_errors = None;
        self.origin = None;
        self.water_known = None;
        Ok(())
    }

    /// Reads a network, which is asked from then on.
    ///
    /// # Errors
    /// What is wrong with the file; the network that is there stays.
    pub fn open_model(&mut self, path: &Path) -> Result<(), String> {
        let model = Model::read(path).map_err(|e| e.to_string())?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        self.model = Ok((Arc::new(model), name.into_owned()));
        self.adviser = Adviser::Network;
        Ok(())
    }

    /// Writes the profile.
    ///
    /// # Errors
    /// There is none, or the file cannot be written.
    pub fn save_profile(&self, path: &Path) -> Result<(), String> {
        let profile = self.profile.as_ref();
        let profile = profile.ok_or("there is no profile yet: calibrate first")?;
        profile.write(path).map_err(|e| e.to_string())
    }

    /// Reads a recorded operation; the number of its steps.
    ///
    /// # Errors
    /// What is wrong with the file; an operation that is open stays open.
    pub fn open_record(&mut self, path: &Path) -> Result<usize, String> {
        let operation = Operation::read(path).map_err(|e| e.to_string())?;
        let steps = operation.steps.len();
        self.operation = Some(operation);
        Ok(steps)
    }
}

/// The model that ships, and its name.
fn load_model() -> Result<(Arc<Model>, String), String> {
    let path = Path::new(uw_assets::DEFAULT_MODEL);
    let model = Model::read(path).map_err(|error| error.to_string())?;
    Ok((
        Arc::new(model),
        uw_assets::shipped_name(path).unwrap_or_default(),
    ))
}
