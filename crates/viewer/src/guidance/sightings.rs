//! What physics makes of the vehicle's pictures. A picture of full size takes some ten milliseconds, so that is done on a thread of its own.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use uw_guidance::Candidate;
use uw_guidance::advice::{By, Physical};
use uw_guidance::physics::{Pictures, Present, Residual, Sight, TakenPicture, Water};

use super::look::Look;
use crate::background::step_back;

/// The vehicle's pictures, each a second after the one before: a dive in which nothing gets old while the panel is looked at.
#[derive(Debug, Default)]
pub struct Sightings {
    pictures: Pictures<SameWater>,
    taken: u32,
    newest: Option<Wanted>,
    making: Option<(Wanted, Receiver<Present>)>,
}

/// A water, the same where it is at the same place in memory.
#[derive(Clone, Debug)]
struct SameWater(Arc<Water>);

impl PartialEq for SameWater {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// A picture that is asked for: a look and the lamp level, percent.
#[derive(Clone, Debug)]
struct Wanted {
    look: Arc<Look>,
    light_pct: f64,
}

impl Wanted {
    fn is(&self, look: &Arc<Look>, light_pct: f64) -> bool {
        Arc::ptr_eq(&self.look, look) && self.light_pct == light_pct
    }
}

/// What the newest picture tells, and how far a prediction from an earlier one misses it.
#[derive(Clone, Debug)]
pub struct Sighting {
    /// What it tells.
    pub present: Arc<Present>,
    /// What an earlier picture, else the calibration, predicts for it, less what it has.
    pub residual: Option<Residual>,
}

impl Sighting {
    /// For advice.
    pub fn by(&self) -> By<'_> {
        By::Physics(Physical {
            present: &self.present,
            residual: self.residual,
        })
    }
}

impl Sightings {
    /// Forgets all pictures: something else is before the camera.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Whether a picture is being made.
    pub fn is_making(&self) -> bool {
        self.making.is_some()
    }

    /// What the picture of a look at a lamp level tells; `None` until it is made, and of a look without tables of its water. `wake` is called once it is.
    pub fn of(
        &mut self,
        look: &Arc<Look>,
        light_pct: f64,
        wake: impl Fn() + Send + 'static,
    ) -> Option<Sighting> {
        self.take();
        if self
            .newest
            .as_ref()
            .is_some_and(|newest| newest.is(look, light_pct))
        {
            return self.newest_sighting();
        }
        if let (None, Some(water)) = (&self.making, &look.water) {
            let wanted = Wanted {
                look: Arc::clone(look),
                light_pct,
            };
            // Where the system gives no thread it is asked again with the next frame.
            let made = self.make(wanted.clone(), Arc::clone(water), wake).ok()?;
            self.making = Some((wanted, made));
        }
        None
    }

    /// Takes a picture that is made.
    fn take(&mut self) {
        let Some((wanted, made)) = &self.making else {
            return;
        };
        match made.try_recv() {
            Ok(present) => {
                if let Some(water) = &wanted.look.water {
                    self.pictures.take(TakenPicture {
                        present: Arc::new(present),
                        taken_s: f64::from(self.taken),
                        water: SameWater(Arc::clone(water)),
                    });
                    self.newest = Some(wanted.clone());
                    self.taken += 1;
                }
                self.making = None;
            }
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => self.making = None,
        }
    }

    fn newest_sighting(&self) -> Option<Sighting> {
        let water = self.newest.as_ref()?.look.water.as_ref()?;
        let latest = self.pictures.latest(&SameWater(Arc::clone(water)))?;
        Some(Sighting {
            present: Arc::clone(&latest.present),
            residual: self.pictures.residual(latest.taken_s),
        })
    }

    fn make(
        &self,
        wanted: Wanted,
        water: Arc<Water>,
        wake: impl Fn() + Send + 'static,
    ) -> std::io::Result<Receiver<Present>> {
        let (sender, made) = channel();
        let taken = self.taken;
        let earlier = self
            .pictures
            .earlier(&SameWater(Arc::clone(&water)), f64::from(taken));
        std::thread::Builder::new()
            .name("sighting".to_owned())
            .spawn(move || {
                step_back();
                if let Some(present) = present(&wanted, water, taken, &earlier) {
                    // Without a listener nobody wants it any more.
                    let _ = sender.send(present);
                }
                wake();
            })?;
        Ok(made)
    }
}

/// What the picture tells, with noise of its own.
fn present(wanted: &Wanted, water: Arc<Water>, number: u32, earlier: &[Sight]) -> Option<Present> {
    let Wanted { look, light_pct } = wanted;
    let here = Candidate {
        distance_m: look.position.distance_m,
        light_pct: *light_pct,
    };
    let measured = look.statistics(*light_pct)?.stats.contrast;
    let counts = look.film.stored(*light_pct, u64::from(number) + 2);
    let place = (&here, look.position.depth_m);
    Some(Present::new(water, &counts, place, measured, earlier))
}
