//! The pictures that a vehicle took on its way, and what they tell of each other.

use std::sync::Arc;

use super::brightness::Brightness;
use super::earlier::Earlier;
use super::present::{Present, Residual};
use super::target::Sight;
use crate::features::Candidate;

/// How old a picture may be that a prediction for another place is compared from, s.
const COMPARED_S: f64 = 60.0;

/// The latest picture of a vehicle, the latest from another place, and what was seen from all distances. `W` tells the waters apart
/// that the pictures were made ready with: those of another tell nothing.
#[derive(Debug)]
pub struct Pictures<W> {
    latest: Option<TakenPicture<W>>,
    before: Option<TakenPicture<W>>,
    /// What the latter predicts for the mean counts of the former, less what that has.
    brightness: Option<Brightness>,
    /// What was seen from all distances.
    earlier: Earlier,
}

/// A picture made ready.
#[derive(Clone, Debug)]
pub struct TakenPicture<W> {
    /// What it tells.
    pub present: Arc<Present>,
    /// When it was taken, s on any clock that does not go back.
    pub taken_s: f64,
    /// In which water.
    pub water: W,
}

impl<W> Default for Pictures<W> {
    fn default() -> Self {
        Self {
            latest: None,
            before: None,
            brightness: None,
            earlier: Earlier::default(),
        }
    }
}

impl<W> TakenPicture<W> {
    /// Where it was taken, and how deep, m.
    fn place(&self) -> (Candidate, f64) {
        (self.present.here(), self.present.depth_m())
    }

    /// Whether it was taken at another place than this one, under the same daylight.
    fn is_elsewhere(&self, (at, depth_m): (Candidate, f64)) -> bool {
        self.present.is_elsewhere(&at, depth_m)
    }
}

impl<W: PartialEq> Pictures<W> {
    /// Takes a picture; one from another place is kept beside it.
    pub fn take(&mut self, taken: TakenPicture<W>) {
        // Another file's water makes another target of the same picture.
        let is_other = |old: &TakenPicture<W>| old.water != taken.water;
        if self.latest.as_ref().is_some_and(is_other) {
            self.earlier = Earlier::default();
        }
        let place = taken.place();
        if let Some(old) = self.latest.take().filter(|old| old.is_elsewhere(place)) {
            self.before = Some(old);
        }
        let comparable =
            |before: &&TakenPicture<W>| before.water == taken.water && before.is_elsewhere(place);
        let before = self.before.as_ref().filter(comparable);
        self.brightness = before.and_then(|before| before.present.brightness_at(&taken.present));
        self.earlier.keep(&taken.present, taken.taken_s);
        self.latest = Some(taken);
    }

    /// The latest picture in this water.
    pub fn latest(&self, water: &W) -> Option<&TakenPicture<W>> {
        self.latest.as_ref().filter(|taken| taken.water == *water)
    }

    /// What earlier pictures tell a new one in this water, taken at `taken_s`.
    pub fn earlier(&self, water: &W, taken_s: f64) -> Vec<Sight> {
        match self.latest(water) {
            Some(_) => self.earlier.sights(taken_s),
            None => Vec::new(),
        }
    }

    /// What an earlier picture predicts for the latest, else what the sights of its water file do, less what it has.
    pub fn residual(&self, now_s: f64) -> Option<Residual> {
        let latest = self.latest.as_ref()?;
        let measured = latest.present.measured();
        let of_picture = self.residual_at(latest.place(), measured, now_s);
        let of_picture = of_picture.map(|found| found.and(self.brightness));
        of_picture.or_else(|| latest.present.residual_of_sights())
    }

    /// What the latest picture from elsewhere predicts for a place and depth (m), less the contrast that was measured there, 8-bit counts.
    pub fn residual_at(
        &self,
        place: (Candidate, f64),
        measured: [f64; 3],
        now_s: f64,
    ) -> Option<Residual> {
        let water = &self.latest.as_ref()?.water;
        let tells = |taken: &&TakenPicture<W>| {
            taken.water == *water
                && now_s - taken.taken_s <= COMPARED_S
                && taken.is_elsewhere(place)
        };
        let newest_first = [self.latest.as_ref(), self.before.as_ref()];
        let mut telling = newest_first.into_iter().flatten().filter(tells);
        telling.find_map(|taken| taken.present.residual_at(&place.0, measured))
    }
}
