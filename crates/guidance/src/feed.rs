//! The latest state of the vehicle, fed piece by piece from several sources.
//!
//! Every reading carries the time at which it was taken, in s since the daemon's start on a clock that
//! never jumps. A reading older than the one held is ignored, so that a driver that resends its backlog
//! changes nothing.

use crate::beams::Plane;
use crate::observation::Quality;

/// A value and when it was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading<T> {
    /// The value.
    pub value: T,
    /// When it was taken, s since the start of the daemon; negative before it.
    pub taken_s: f64,
}

/// A distance and, where it comes from several beams, the plane they see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Distance along the optical axis, m.
    pub distance_m: f64,
    /// The plane through the beams' ends.
    pub plane: Option<Plane>,
}

/// Statistics of the current image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picture {
    /// Mean per channel, 8-bit counts.
    pub mean: [f64; 3],
    /// Contrast per channel, 8-bit counts.
    pub std: [f64; 3],
    /// Width and height, pixels, where they are known.
    pub size_px: Option<[u32; 2]>,
    /// Contrast without noise, noise floor and clipped pixels, where they are known.
    pub quality: Option<Quality>,
}

/// The pieces of a state that a message brings; the others stay as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Update {
    /// Depth, m.
    pub depth_m: Option<f64>,
    /// Distance.
    pub range: Option<Range>,
    /// Lamp level, percent.
    pub light_pct: Option<f64>,
    /// Image statistics.
    pub picture: Option<Picture>,
}

/// The latest of each piece.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Feed {
    /// Depth, m.
    pub depth_m: Option<Reading<f64>>,
    /// Distance.
    pub range: Option<Reading<Range>>,
    /// Lamp level, percent.
    pub light_pct: Option<Reading<f64>>,
    /// Image statistics.
    pub picture: Option<Reading<Picture>>,
}

impl Feed {
    /// Takes what is newer than what is held; the names of what was ignored because it is older.
    pub fn apply(&mut self, update: &Update, taken_s: f64) -> Vec<&'static str> {
        let mut ignored = Vec::new();
        let mut told = |name, taken: bool| {
            if !taken {
                ignored.push(name);
            }
        };
        told("depth_m", take(&mut self.depth_m, update.depth_m, taken_s));
        told("distance_m", take(&mut self.range, update.range, taken_s));
        told(
            "light_pct",
            take(&mut self.light_pct, update.light_pct, taken_s),
        );
        told("mean", take(&mut self.picture, update.picture, taken_s));
        ignored
    }
}

/// False when there is a value and it is older than the one held.
fn take<T>(held: &mut Option<Reading<T>>, value: Option<T>, taken_s: f64) -> bool {
    let Some(value) = value else { return true };
    let newer = held.as_ref().is_none_or(|old| taken_s >= old.taken_s);
    if newer {
        *held = Some(Reading { value, taken_s });
    }
    newer
}

/// How old a reading may be before the vehicle should hold, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxAge {
    /// Depth changes slowly.
    pub depth_s: f64,
    /// Distance decides over collisions.
    pub distance_s: f64,
    /// Lamp level.
    pub light_s: f64,
    /// Image statistics.
    pub image_s: f64,
}

impl Default for MaxAge {
    /// Five periods of the slowest usual source (a DVL at 2 Hz, a camera and telemetry at 1 Hz).
    fn default() -> Self {
        Self {
            depth_s: 5.0,
            distance_s: 2.5,
            light_s: 5.0,
            image_s: 5.0,
        }
    }
}

/// How old the inputs of an answer are, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ages {
    /// Depth.
    pub depth_s: f64,
    /// Distance.
    pub distance_s: f64,
    /// Lamp level.
    pub light_s: f64,
    /// Image statistics.
    pub image_s: f64,
}

impl Ages {
    /// Names of the inputs that are older than allowed.
    pub fn stale(&self, max: &MaxAge) -> Vec<&'static str> {
        let all = [
            ("depth_m", self.depth_s, max.depth_s),
            ("distance_m", self.distance_s, max.distance_s),
            ("light_pct", self.light_s, max.light_s),
            ("mean", self.image_s, max.image_s),
        ];
        all.into_iter()
            .filter(|&(_, age_s, max_s)| age_s > max_s)
            .map(|(name, _, _)| name)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn older_readings_are_ignored_and_named() {
        let mut feed = Feed::default();
        let depth = |depth_m| Update {
            depth_m: Some(depth_m),
            ..Update::default()
        };
        assert!(feed.apply(&depth(1.0), 10.0).is_empty());
        assert_eq!(feed.apply(&depth(2.0), 9.0), ["depth_m"]);
        assert_eq!(feed.depth_m.unwrap().value, 1.0);
        assert!(feed.apply(&depth(3.0), 10.0).is_empty());
        assert_eq!(feed.depth_m.unwrap().value, 3.0);
        assert_eq!(feed.light_pct, None);
    }

    #[test]
    fn each_age_has_its_own_limit() {
        let max = MaxAge::default();
        let ages = Ages {
            depth_s: 4.0,
            distance_s: 4.0,
            light_s: 5.0,
            image_s: 5.1,
        };
        assert_eq!(ages.stale(&max), ["distance_m", "mean"]);
    }
}
