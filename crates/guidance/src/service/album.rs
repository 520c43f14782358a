//! The pictures of a connection, from which physics predicts.

use std::sync::Arc;

use crate::advice::{By, Physical};
use crate::features::Candidate;
use crate::feed::{Feed, MaxAge, Picture, Reading};
use crate::observation::Observation;
use crate::physics::{Brightness, Earlier, Present, Residual, Sight};
use crate::service::Moment;
use crate::service::resolve::Known;
use crate::service::suggestion::Hold;

/// How far the vehicle may sink or rise before its picture says nothing of the daylight any more, m.
const SAME_DAYLIGHT_M: f64 = 0.5;
/// How old a picture may be that a prediction for the present place is compared from, s.
const EARLIER_S: f64 = 60.0;

/// The latest picture of a connection, and the latest from another place.
#[derive(Debug, Default)]
pub(super) struct Album {
    latest: Option<Taken>,
    before: Option<Taken>,
    /// What the latter predicts for the mean counts of the former, less what that has.
    brightness: Option<Brightness>,
    /// What was seen from all distances.
    earlier: Earlier,
}

/// A picture made ready.
#[derive(Clone, Debug)]
pub(super) struct Taken {
    pub present: Arc<Present>,
    /// Its statistics.
    pub picture: Picture,
    /// When it was taken, s since the start.
    pub taken_s: f64,
    /// Of the water file.
    pub digest: String,
}

/// The picture that a question is answered from.
#[derive(Debug)]
pub(super) struct Seen {
    present: Arc<Present>,
    residual: Option<Residual>,
}

impl Taken {
    /// Whether it was taken at another place than `other`, under the same daylight.
    fn is_elsewhere_of(&self, other: &Self) -> bool {
        let (here, depth_m) = (other.present.here(), other.present.depth_m());
        self.present.is_elsewhere(&here, depth_m)
    }
}

impl Seen {
    pub fn by(&self) -> By<'_> {
        By::Physics(Physical {
            present: &self.present,
            residual: self.residual,
        })
    }
}

impl Album {
    /// Takes a picture; one from another place is kept beside it.
    pub fn take(&mut self, taken: Taken) {
        // Another file's water makes another target of the same picture.
        if self
            .latest
            .as_ref()
            .is_some_and(|old| old.digest != taken.digest)
        {
            self.earlier = Earlier::default();
        }
        if let Some(old) = self.latest.take().filter(|old| old.is_elsewhere_of(&taken)) {
            self.before = Some(old);
        }
        let comparable =
            |before: &&Taken| before.digest == taken.digest && before.is_elsewhere_of(&taken);
        let before = self.before.as_ref().filter(comparable);
        self.brightness = before.and_then(|before| before.present.brightness_at(&taken.present));
        self.earlier.keep(&taken.present, taken.taken_s);
        self.latest = Some(taken);
    }

    /// What earlier pictures tell a new one of the water file of this digest, taken at `taken_s`.
    pub fn earlier(&self, digest: &str, taken_s: f64) -> Vec<Sight> {
        match &self.latest {
            Some(latest) if latest.digest == digest => self.earlier.sights(taken_s),
            _ => Vec::new(),
        }
    }

    /// The feed with the statistics of the latest picture, unless it has newer ones.
    pub fn feed(&self, mut feed: Feed) -> Feed {
        if let Some(taken) = &self.latest
            && feed.picture.is_none_or(|fed| fed.taken_s <= taken.taken_s)
        {
            feed.picture = Some(Reading {
                value: taken.picture,
                taken_s: taken.taken_s,
            });
        }
        feed
    }

    /// The picture for a question, of the water file of this digest, and how far predictions from elsewhere are off.
    pub fn seen(
        &self,
        known: &Known,
        digest: &str,
        max_age: &MaxAge,
        now: Moment,
    ) -> Result<Seen, Hold> {
        let of_water = |taken: &&Taken| taken.digest == digest;
        let Some(latest) = self.latest.as_ref().filter(of_water) else {
            return Err(Hold::Missing("image"));
        };
        if now.since_start_s - latest.taken_s > max_age.image_s {
            return Err(Hold::Stale(vec!["image"]));
        }
        let observation = &known.observation;
        let taken_m = latest.present.depth_m();
        if (taken_m - observation.depth_m).abs() > SAME_DAYLIGHT_M {
            return Err(Hold::OtherDepth {
                taken_m,
                depth_m: observation.depth_m,
            });
        }
        Ok(Seen {
            present: Arc::clone(&latest.present),
            residual: self.residual(latest, observation, digest, now),
        })
    }

    /// What an earlier picture predicts for the place of the statistics, else what the sights do, less what they have.
    fn residual(
        &self,
        latest: &Taken,
        observation: &Observation,
        digest: &str,
        now: Moment,
    ) -> Option<Residual> {
        let measured = observation.std;
        let is_own = latest.picture.std == measured && latest.picture.mean == observation.mean;
        let (place, depth_m) = match is_own {
            true => (latest.present.here(), latest.present.depth_m()),
            false => (
                Candidate {
                    distance_m: observation.distance_m,
                    light_pct: observation.light_pct,
                },
                observation.depth_m,
            ),
        };
        let tells = |taken: &&Taken| {
            taken.digest == digest
                && now.since_start_s - taken.taken_s <= EARLIER_S
                && taken.present.is_elsewhere(&place, depth_m)
        };
        let earlier = [Some(latest), self.before.as_ref()];
        let of_pictures = earlier
            .into_iter()
            .flatten()
            .filter(tells)
            .find_map(|taken| taken.present.residual_at(&place, measured))
            // The pixels of a picture that another program measured are not known.
            .map(|found| found.and(self.brightness.filter(|_| is_own)));
        of_pictures.or_else(|| match is_own {
            true => latest.present.residual_of_sights(),
            false => None,
        })
    }
}
