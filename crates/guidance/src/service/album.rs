//! The pictures of a connection, from which physics predicts.

use std::sync::Arc;

use crate::advice::{By, Physical};
use crate::features::Candidate;
use crate::feed::{Feed, MaxAge, Picture, Reading};
use crate::observation::Observation;
use crate::physics::{Pictures, Present, Residual, Sight, TakenPicture};
use crate::service::Moment;
use crate::service::resolve::Known;
use crate::service::suggestion::Hold;

/// How far the vehicle may sink or rise before its picture says nothing of the daylight any more, m.
const SAME_DAYLIGHT_M: f64 = 0.5;

/// The pictures of a connection, told apart by the digest of the water file that they were made ready with.
#[derive(Debug, Default)]
pub(super) struct Album {
    pictures: Pictures<String>,
    /// Statistics of the latest, and when it was taken.
    statistics: Option<Reading<Picture>>,
}

/// The picture that a question is answered from.
#[derive(Debug)]
pub(super) struct Seen {
    present: Arc<Present>,
    residual: Option<Residual>,
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
    /// Takes a picture, made ready with the water file of its digest, with its statistics.
    pub fn take(&mut self, taken: TakenPicture<String>, statistics: Picture) {
        self.statistics = Some(Reading {
            value: statistics,
            taken_s: taken.taken_s,
        });
        self.pictures.take(taken);
    }

    /// What earlier pictures tell a new one of the water file of this digest, taken at `taken_s`.
    pub fn earlier(&self, digest: &String, taken_s: f64) -> Vec<Sight> {
        self.pictures.earlier(digest, taken_s)
    }

    /// The feed with the statistics of the latest picture, unless it has newer ones.
    pub fn feed(&self, mut feed: Feed) -> Feed {
        if let Some(latest) = self.statistics
            && feed.picture.is_none_or(|fed| fed.taken_s <= latest.taken_s)
        {
            feed.picture = Some(latest);
        }
        feed
    }

    /// The picture for a question, of the water file of this digest, and how far predictions from elsewhere are off.
    pub fn seen(
        &self,
        known: &Known,
        digest: &String,
        max_age: &MaxAge,
        now: Moment,
    ) -> Result<Seen, Hold> {
        let Some(latest) = self.pictures.latest(digest) else {
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
            residual: self.residual(observation, now),
        })
    }

    /// What an earlier picture predicts for the place of the statistics, else what the sights do, less what they have. The pixels of
    /// a picture that another program measured are not known.
    fn residual(&self, observation: &Observation, now: Moment) -> Option<Residual> {
        let measured = observation.std;
        let is_own = |latest: Reading<Picture>| {
            latest.value.std == measured && latest.value.mean == observation.mean
        };
        if self.statistics.is_some_and(is_own) {
            return self.pictures.residual(now.since_start_s);
        }
        let at = Candidate {
            distance_m: observation.distance_m,
            light_pct: observation.light_pct,
        };
        let place = (at, observation.depth_m);
        self.pictures
            .residual_at(place, measured, now.since_start_s)
    }
}
