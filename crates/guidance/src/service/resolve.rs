//! What is known at a moment: the request's values, and the feed's where the request has none.

use uw_calib::json::FieldError;

use crate::beams::{BeamError, BeamGeometry, Plane, combine};
use crate::feed::{Ages, Feed, Range, Reading, Update};
use crate::observation::Observation;
use crate::service::Moment;
use crate::wire::inputs::{Distance, Inputs, Stamp, SunSeen};

/// How far ahead of the daemon's clock a time stamp may be, s: clocks on one vehicle agree better.
const MAX_AHEAD_S: f64 = 1.0;

/// A complete observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Known {
    pub observation: Observation,
    pub ages: Ages,
    /// The surface, where the distance comes from several beams.
    pub plane: Option<Plane>,
    /// Width and height of the picture, pixels, where they are known.
    pub size_px: Option<[u32; 2]>,
    /// The sun, as far as the request tells it.
    pub sun: SunSeen,
}

/// Why there is no complete observation.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Unknown {
    /// Neither the request nor the feed has this input.
    Missing(&'static str),
    /// The beams give no distance.
    Beams(BeamError),
    /// A field of the request cannot be used.
    Field(FieldError),
}

/// How long ago the values of a message were taken, s.
pub(super) fn age_s(stamp: Stamp, now: Moment) -> Result<f64, FieldError> {
    match stamp {
        Stamp::Now => Ok(0.0),
        Stamp::Age(age_s) => Ok(age_s),
        Stamp::Time(time_s) => {
            let age_s = now.unix_s - time_s;
            if age_s >= -MAX_AHEAD_S {
                return Ok(age_s.max(0.0));
            }
            let expected = format!(
                "at most {MAX_AHEAD_S} s ahead of the daemon's clock ({:.3})",
                now.unix_s
            );
            Err(FieldError::out_of_range("time_s", expected, time_s))
        }
    }
}

/// The request's values as an update of the feed.
pub(super) fn update(inputs: &Inputs, geometry: &BeamGeometry) -> Result<Update, Unknown> {
    let range = inputs
        .distance
        .as_ref()
        .map(|distance| range(distance, geometry))
        .transpose()?;
    Ok(Update {
        depth_m: inputs.depth_m,
        range,
        light_pct: inputs.light_pct,
        picture: inputs.picture,
    })
}

fn range(distance: &Distance, geometry: &BeamGeometry) -> Result<Range, Unknown> {
    match distance {
        Distance::Axis(distance_m) => Ok(Range {
            distance_m: *distance_m,
            plane: None,
        }),
        Distance::Beams(ranges_m) => match combine(ranges_m, geometry) {
            Ok(plane) => Ok(Range {
                distance_m: plane.distance_m,
                plane: Some(plane),
            }),
            Err(BeamError::Count { expected, got }) => {
                let expected = format!("a list of {expected} (one for each beam)");
                Err(Unknown::Field(FieldError::out_of_range(
                    "distances_m",
                    expected,
                    got,
                )))
            }
            Err(error) => Err(Unknown::Beams(error)),
        },
    }
}

/// The distance alone, m, where the request or the feed has it.
pub(super) fn distance_m(inputs: &Inputs, feed: &Feed, geometry: &BeamGeometry) -> Option<f64> {
    let own = update(inputs, geometry).ok()?.range;
    let range = own.or(feed.range.map(|reading| reading.value))?;
    Some(range.distance_m)
}

/// The observation and how old its parts are.
pub(super) fn resolve(
    inputs: &Inputs,
    feed: &Feed,
    now: Moment,
    geometry: &BeamGeometry,
) -> Result<Known, Unknown> {
    let own_age_s = age_s(inputs.stamp, now).map_err(Unknown::Field)?;
    let own = update(inputs, geometry)?;
    let (depth_m, depth_s) = latest("depth_m", own.depth_m, own_age_s, feed.depth_m, now)?;
    let (range, distance_s) = latest("distance_m", own.range, own_age_s, feed.range, now)?;
    let (light_pct, light_s) = latest("light_pct", own.light_pct, own_age_s, feed.light_pct, now)?;
    let (picture, image_s) = latest("mean", own.picture, own_age_s, feed.picture, now)?;
    Ok(Known {
        observation: Observation {
            depth_m,
            distance_m: range.distance_m,
            light_pct,
            mean: picture.mean,
            std: picture.std,
            quality: picture.quality,
        },
        ages: Ages {
            depth_s,
            distance_s,
            light_s,
            image_s,
        },
        plane: range.plane,
        size_px: picture.size_px,
        sun: inputs.sun,
    })
}

/// The request's own value, else the one fed, with its age in s.
fn latest<T: Copy>(
    name: &'static str,
    own: Option<T>,
    own_age_s: f64,
    fed: Option<Reading<T>>,
    now: Moment,
) -> Result<(T, f64), Unknown> {
    match (own, fed) {
        (Some(value), _) => Ok((value, own_age_s)),
        (None, Some(reading)) => {
            let age_s = (now.since_start_s - reading.taken_s).max(0.0);
            Ok((reading.value, age_s))
        }
        (None, None) => Err(Unknown::Missing(name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Moment = Moment {
        since_start_s: 100.0,
        unix_s: 1.7e9,
    };

    #[test]
    fn the_request_goes_before_the_feed_and_both_have_their_ages() {
        let inputs = Inputs {
            depth_m: Some(3.0),
            stamp: Stamp::Age(0.5),
            ..Inputs::default()
        };
        let mut feed = Feed::default();
        let fed = Update {
            depth_m: Some(9.0),
            range: Some(Range {
                distance_m: 1.5,
                plane: None,
            }),
            light_pct: Some(20.0),
            picture: Some(crate::feed::Picture {
                mean: [40.0; 3],
                std: [4.0; 3],
                size_px: None,
                quality: None,
            }),
        };
        feed.apply(&fed, 98.0);
        let known = resolve(&inputs, &feed, NOW, &BeamGeometry::default()).unwrap();
        assert_eq!(known.observation.depth_m, 3.0);
        assert_eq!(known.observation.distance_m, 1.5);
        assert_eq!((known.ages.depth_s, known.ages.distance_s), (0.5, 2.0));
        feed.light_pct = None;
        let missing = resolve(&inputs, &feed, NOW, &BeamGeometry::default());
        assert_eq!(missing, Err(Unknown::Missing("light_pct")));
    }

    #[test]
    fn time_stamps_become_ages_and_the_future_is_refused() {
        assert_eq!(age_s(Stamp::Time(1.7e9 - 3.0), NOW), Ok(3.0));
        assert_eq!(age_s(Stamp::Time(1.7e9 + 0.5), NOW), Ok(0.0));
        assert_eq!(
            age_s(Stamp::Time(1.7e9 + 60.0), NOW).unwrap_err().field,
            "time_s"
        );
    }
}
