//! The field of daylight that steers walks: it takes longer than a first picture may, so that a thread of its own
//! solves it while coarse pictures are made without, and it is kept for changes that leave daylight as it is.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::time::{Duration, Instant};

use uw_render::{
    prepare::{DaylightField, Geometry, Prepared},
    scene::Scene,
};

use super::Job;
use crate::model::{Settings, Surface, settings::WaterAndSky};

/// Age of a job from which its field is solved: settings that last less, as while a slider is dragged, need none.
const WORTH_IT: Duration = Duration::from_millis(150);
/// How long a wait goes without looking up.
const NAP: Duration = Duration::from_millis(10);

/// What a field of daylight hangs on.
#[derive(Clone, Debug, PartialEq)]
struct Cause {
    water_and_sky: WaterAndSky,
    surface: Option<Surface>,
    camera_height_m: f64,
}

impl Cause {
    fn of(settings: &Settings) -> Self {
        Self {
            water_and_sky: settings.water_and_sky(),
            surface: settings.surface,
            camera_height_m: settings.camera.position_m.z,
        }
    }
}

/// A solved field.
pub struct Known {
    cause: Cause,
    geometry: Arc<Geometry>,
    field: Option<DaylightField>,
}

/// How far the field of a job is.
pub enum Steering {
    /// Not begun.
    Wanted,
    /// A thread solves it.
    Solving(Receiver<Option<DaylightField>>),
    /// The scene has it.
    There,
}

impl Steering {
    /// Steers by the field that is known where it is that of the job.
    pub fn begin(known: Option<&Known>, job: &Job, prepared: &mut Prepared) -> Self {
        let fits = |known: &&Known| {
            known.cause == Cause::of(&job.settings) && Arc::ptr_eq(&known.geometry, &job.geometry)
        };
        match known.filter(fits) {
            Some(known) => {
                prepared.steer(known.field.clone());
                Self::There
            }
            None => Self::Wanted,
        }
    }

    /// Whether the scene has its field.
    pub fn is_there(&self) -> bool {
        matches!(self, Self::There)
    }

    /// Begins to solve once the job is old enough, and takes the field when it is solved.
    pub fn take_up(
        &mut self,
        known: &mut Option<Known>,
        job: &Job,
        scene: &Scene,
        prepared: &mut Prepared,
        asked: Instant,
    ) {
        match self {
            Self::Wanted if asked.elapsed() >= WORTH_IT => *self = solve(job, scene),
            Self::Solving(solved) => match solved.try_recv() {
                Ok(field) => self.accept(known, job, prepared, field),
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => self.accept(known, job, prepared, None),
            },
            Self::Wanted | Self::There => {}
        }
    }

    /// Waits for the field for a moment, and begins to solve it where that has not been done.
    pub fn wait(
        &mut self,
        known: &mut Option<Known>,
        job: &Job,
        scene: &Scene,
        prepared: &mut Prepared,
    ) {
        if let Self::Wanted = self {
            *self = solve(job, scene);
        }
        if let Self::Solving(solved) = self {
            match solved.recv_timeout(NAP) {
                Ok(field) => self.accept(known, job, prepared, field),
                Err(RecvTimeoutError::Timeout) => {}
                // Without a field the picture is right too.
                Err(RecvTimeoutError::Disconnected) => self.accept(known, job, prepared, None),
            }
        }
    }

    fn accept(
        &mut self,
        known: &mut Option<Known>,
        job: &Job,
        prepared: &mut Prepared,
        field: Option<DaylightField>,
    ) {
        prepared.steer(field.clone());
        *known = Some(Known {
            cause: Cause::of(&job.settings),
            geometry: Arc::clone(&job.geometry),
            field,
        });
        *self = Self::There;
    }
}

/// Solves the field of a job on a thread of its own. Where there is none, the channel is closed at once.
fn solve(job: &Job, scene: &Scene) -> Steering {
    let (sender, solved) = channel();
    let (scene, geometry) = (scene.clone(), Arc::clone(&job.geometry));
    // Without the thread the sender is dropped, and the render goes on without a field.
    let _ = std::thread::Builder::new()
        .name("daylight".to_owned())
        .spawn(move || {
            let prepared = Prepared::build_unsteered(&scene, geometry);
            // Without a listener the job was left.
            let _ = sender.send(prepared.solve_daylight(&scene));
        });
    Steering::Solving(solved)
}
