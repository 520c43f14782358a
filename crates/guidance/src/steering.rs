//! From one suggestion to a steady course: hysteresis, dead bands and rate limits, so that a vehicle that
//! follows does not hunt.
//!
//! A new optimum becomes the target only when it promises more than `min_gain` over the target held. The
//! commands go from where the vehicle is towards the target, no faster than the rates allow.

use crate::features::Candidate;

/// How quickly and how readily commands may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// Score by which a new optimum has to beat the target held, >= 0.
    pub min_gain: f64,
    /// Fastest change of the commanded distance, m/s, > 0.
    pub distance_rate_m_per_s: f64,
    /// Fastest change of the commanded lamp level, percent/s, > 0.
    pub light_rate_pct_per_s: f64,
    /// Changes of distance below this are not commanded, m, >= 0.
    pub distance_deadband_m: f64,
    /// Changes of the lamp level below this are not commanded, percent, >= 0.
    pub light_deadband_pct: f64,
}

impl Default for Steering {
    /// Scores are about 1, so 0.02 is 2 %; a tenth of a metre per second is how inspection vehicles creep.
    fn default() -> Self {
        Self {
            min_gain: 0.02,
            distance_rate_m_per_s: 0.1,
            light_rate_pct_per_s: 10.0,
            distance_deadband_m: 0.03,
            light_deadband_pct: 1.0,
        }
    }
}

/// What the vehicle should do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Distance and lamp level to take now.
    pub command: Candidate,
    /// Where the commands lead.
    pub target: Candidate,
    /// Whether a rate limit keeps the command short of the target.
    pub clamped: bool,
    /// Whether nothing is to be done: the target is reached within the dead bands.
    pub hold: bool,
}

/// The course so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Course {
    target: Option<Candidate>,
    last: Option<(f64, Candidate)>,
}

impl Course {
    /// The target held.
    pub fn target(&self) -> Option<Candidate> {
        self.target
    }

    /// Forgets everything, as after an invalid answer: the next command starts where the vehicle is.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// The next command.
    ///
    /// `best` is the optimum with its score, `target_score` the score of the target held (asked for with
    /// [`Course::target`]); a target whose score is no number any more is given up.
    pub fn step(
        &mut self,
        steering: &Steering,
        now_s: f64,
        current: Candidate,
        best: (Candidate, f64),
        target_score: Option<f64>,
    ) -> Command {
        let kept = self.target.zip(target_score).filter(|(_, score)| {
            // A score of NaN compares false and gives the target up.
            best.1 - score <= steering.min_gain
        });
        let target = kept.map_or(best.0, |(target, _)| target);
        self.target = Some(target);
        let (then_s, from) = self.last.unwrap_or((now_s, current));
        let elapsed_s = (now_s - then_s).max(0.0);
        let distance = approach(
            from.distance_m,
            target.distance_m,
            steering.distance_rate_m_per_s * elapsed_s,
            steering.distance_deadband_m,
        );
        let light = approach(
            from.light_pct,
            target.light_pct,
            steering.light_rate_pct_per_s * elapsed_s,
            steering.light_deadband_pct,
        );
        let command = Candidate {
            distance_m: distance.value,
            light_pct: light.value,
        };
        self.last = Some((now_s, command));
        let near = |x: f64, y: f64, band: f64| (x - y).abs() <= band;
        let at_distance = near(
            current.distance_m,
            command.distance_m,
            steering.distance_deadband_m,
        );
        let at_light = near(
            current.light_pct,
            command.light_pct,
            steering.light_deadband_pct,
        );
        let clamped = distance.clamped || light.clamped;
        Command {
            command,
            target,
            clamped,
            hold: !clamped && at_distance && at_light,
        }
    }
}

struct Approached {
    value: f64,
    clamped: bool,
}

/// `from` moved towards `to` by at most `step`; not at all inside the dead band.
fn approach(from: f64, to: f64, step: f64, deadband: f64) -> Approached {
    let wanted = to - from;
    if wanted.abs() <= deadband {
        return Approached {
            value: from,
            clamped: false,
        };
    }
    if wanted.abs() <= step {
        return Approached {
            value: to,
            clamped: false,
        };
    }
    Approached {
        value: from + step.copysign(wanted),
        clamped: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEERING: Steering = Steering {
        min_gain: 0.1,
        distance_rate_m_per_s: 0.1,
        light_rate_pct_per_s: 10.0,
        distance_deadband_m: 0.03,
        light_deadband_pct: 1.0,
    };

    fn at(distance_m: f64, light_pct: f64) -> Candidate {
        Candidate {
            distance_m,
            light_pct,
        }
    }

    #[test]
    fn commands_approach_the_target_at_the_allowed_rates() {
        let mut course = Course::default();
        let (best, mut now) = ((at(2.0, 60.0), 1.0), at(1.0, 50.0));
        let first = course.step(&STEERING, 0.0, now, best, None);
        assert_eq!(
            (first.command, first.clamped, first.hold),
            (now, true, false)
        );
        for second in 1..=20 {
            let target_score = course.target().map(|_| 1.0);
            let next = course.step(&STEERING, f64::from(second), now, best, target_score);
            assert!((next.command.distance_m - now.distance_m).abs() <= 0.1 + 1e-12);
            assert!((next.command.light_pct - now.light_pct).abs() <= 10.0 + 1e-12);
            now = next.command;
        }
        // The end is reached to within the dead band, and then held.
        assert!((now.distance_m - 2.0).abs() <= 0.03 && (now.light_pct - 60.0).abs() <= 1.0);
        let last = course.step(&STEERING, 21.0, now, best, Some(1.0));
        assert!(last.hold && !last.clamped, "{last:?}");
    }

    #[test]
    fn a_slightly_better_optimum_does_not_change_the_target() {
        let mut course = Course::default();
        let here = at(1.0, 50.0);
        course.step(&STEERING, 0.0, here, (at(1.5, 50.0), 1.0), None);
        let kept = course.step(&STEERING, 1.0, here, (at(0.5, 50.0), 1.05), Some(1.0));
        assert_eq!(kept.target, at(1.5, 50.0));
        let changed = course.step(&STEERING, 2.0, here, (at(0.5, 50.0), 1.2), Some(1.0));
        assert_eq!(changed.target, at(0.5, 50.0));
        let lost = course.step(&STEERING, 3.0, here, (at(0.7, 50.0), 1.2), Some(f64::NAN));
        assert_eq!(lost.target, at(0.7, 50.0));
    }

    #[test]
    fn a_clock_that_stands_still_commands_no_jump() {
        let mut course = Course::default();
        let here = at(1.0, 50.0);
        for _ in 0..5 {
            let next = course.step(&STEERING, 3.0, here, (at(2.0, 90.0), 1.0), None);
            assert_eq!(next.command, here);
        }
    }
}
