//! Advice with the objective around it.

use uw_calib::Profile;
use uw_guidance::advice::{Advice, By, Reason, advise_by, predict_by, quick_scores, trace};
use uw_guidance::physics::Present;
use uw_guidance::{Candidate, Checks, Objective, Observation};

/// Columns (distances) and rows (lamp levels) of the map.
pub const MAP_SIZE: (usize, usize) = (60, 41);

/// What an answer of the library hangs on: state, objective, width and height of the picture (pixels) where they are known, and
/// where profile and network, or what physics made of the picture, lie in memory.
pub type Question = (Observation, Objective, Option<[u32; 2]>, [usize; 2]);

/// Scores over distance and lamp level.
#[derive(Clone, Debug, PartialEq)]
pub struct ScoreMap {
    /// Smallest and largest distance, m.
    pub distance_m: [f64; 2],
    /// Smallest and largest lamp level, percent.
    pub light_pct: [f64; 2],
    /// Scores, row by row from the smallest lamp level, each from the smallest distance.
    pub scores: Vec<f64>,
}

/// Advice.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The state it is about.
    pub observation: Observation,
    /// What it hangs on; `None` for a daemon's, which is asked anew by hand.
    pub question: Option<Question>,
    /// Suggested distance, m.
    pub distance_m: f64,
    /// Suggested lamp level, percent.
    pub light_pct: f64,
    /// Whether the vehicle may follow.
    pub valid: bool,
    /// Whether it should move or change its lamps; else it should hold.
    pub moves: bool,
    /// Why not, or with which limit.
    pub reason: Option<String>,
    /// What was found wanting and is allowed.
    pub warnings: Vec<String>,
    /// How far the network's prediction for no change, or that of physics from an earlier picture, misses the picture's contrast, in units of what is
    /// allowed.
    pub misfit: Option<f64>,
    /// Score of the suggestion.
    pub score: Option<f64>,
    /// Score of staying.
    pub score_here: Option<f64>,
    /// Predicted contrast of the suggestion, 8-bit counts; NaN for channels of which physics tells nothing.
    pub predicted: Option<[f64; 3]>,
    /// Predicted contrast of staying, 8-bit counts, likewise.
    pub predicted_here: Option<[f64; 3]>,
    /// Standard errors of both predictions, 8-bit counts, where physics predicts; a network tells none.
    pub errors: [Option<[f64; 3]>; 2],
    /// Distances of the earlier pictures that count, rising, m; none with a network.
    pub earlier_m: Vec<f64>,
    /// Candidates that were looked at.
    pub evaluations: usize,
    /// The candidates with their scores, where they are known.
    pub steps: Vec<(Candidate, f64)>,
    /// Scores all around.
    pub map: Option<ScoreMap>,
}

/// The candidates of the map between these bounds.
pub fn map_candidates(distance_m: [f64; 2], light_pct: [f64; 2]) -> Vec<Candidate> {
    let (columns, rows) = MAP_SIZE;
    let between = |[low, high]: [f64; 2], i: usize, of: usize| {
        (low + (high - low) * i as f64 / (of - 1) as f64).clamp(low, high)
    };
    (0..rows * columns)
        .map(|i| Candidate {
            distance_m: between(distance_m, i % columns, columns),
            light_pct: between(light_pct, i / columns, rows),
        })
        .collect()
}

/// Index of the node below `value` among `of` even ones between `low` and `high`, and the share of the way to the next.
fn cell(value: f64, [low, high]: [f64; 2], of: usize) -> Option<(usize, f64)> {
    let at = (value - low) / (high - low) * (of - 1) as f64;
    if !(0.0..=(of - 1) as f64).contains(&at) {
        return None;
    }
    let below = (at as usize).min(of - 2);
    Some((below, at - below as f64))
}

/// Distances that objective and calibration have in common, and the `tables` of the water where physics predicts, m.
pub fn common_distances(
    profile: &Profile,
    objective: &Objective,
    tables: Option<(f64, f64)>,
) -> Option<[f64; 2]> {
    let (min, max) = profile.distance_range_m();
    let (nearest, farthest) = tables.unwrap_or((min, max));
    let [near, far] = objective.distance_m;
    let both = [near.max(min).max(nearest), far.min(max).min(farthest)];
    (both[0] < both[1]).then_some(both)
}

/// How far a prediction for the present place is off, in units of what is allowed.
fn misfit(advice: &Advice) -> Option<f64> {
    let of_network = advice.residual_here.map(|residual| residual.misfit);
    let of_physics = || Some(advice.physics.as_ref()?.residual?.misfit);
    of_network.or_else(of_physics)
}

/// Counts with NaN for the channels of which `present` tells nothing.
fn told(counts: [f64; 3], present: Option<&Present>) -> [f64; 3] {
    let told = present.map_or([true; 3], Present::told);
    std::array::from_fn(|k| if told[k] { counts[k] } else { f64::NAN })
}

impl Answer {
    /// The library's answer; `other` is why profile and predictor are not of one camera, if so.
    pub fn of_library(
        now: &Observation,
        profile: &Profile,
        by: By,
        objective: &Objective,
        question: Question,
        other: Option<Reason>,
    ) -> Self {
        let advice = advise_by(now, profile, by, objective, &Checks::default());
        let present = match by {
            By::Network(_) => None,
            By::Physics(physics) => Some(physics.present),
        };
        let tables = present.map(|present| present.water().tables.distance_range_m());
        let map = common_distances(profile, objective, tables).and_then(|distance_m| {
            let candidates = map_candidates(distance_m, objective.light_pct);
            Some(ScoreMap {
                distance_m,
                light_pct: objective.light_pct,
                scores: quick_scores(now, &candidates, profile, by, objective).ok()?,
            })
        });
        let here = Candidate {
            distance_m: now.distance_m,
            light_pct: now.light_pct,
        };
        let staying = predict_by(now, &[here], profile, by, objective).ok();
        Self {
            observation: *now,
            question: Some(question),
            distance_m: advice.distance_m,
            light_pct: advice.light_pct,
            valid: advice.valid() && other.is_none(),
            moves: advice.moves() && other.is_none(),
            reason: other
                .as_ref()
                .or(advice.reason.as_ref())
                .map(ToString::to_string),
            warnings: advice.warnings.iter().map(ToString::to_string).collect(),
            misfit: misfit(&advice),
            score: advice.score,
            score_here: advice.score_here,
            predicted: advice
                .predicted_contrast
                .map(|counts| told(counts, present)),
            predicted_here: staying
                .as_ref()
                .and_then(|p| Some(told(*p.contrast.first()?, present))),
            errors: [
                advice.physics.as_ref().and_then(|physics| physics.error),
                staying.and_then(|p| p.errors?.first().copied()),
            ],
            earlier_m: advice
                .physics
                .map_or_else(Vec::new, |physics| physics.earlier_m),
            evaluations: advice.evaluations,
            steps: trace(now, profile, by, objective).unwrap_or_default(),
            map,
        }
    }

    /// The way to the best candidate: from the best of those that are looked at first, all over the map, every step
    /// that was better than all before it.
    pub fn ascent(&self) -> Vec<[f64; 2]> {
        let mut best: Option<(Candidate, f64)> = None;
        let mut way = Vec::new();
        let mut descends = false;
        for &(candidate, score) in &self.steps {
            // The first descent begins at the best that is known, which is looked at again.
            descends |= best.is_some_and(|(known, _)| known == candidate);
            if best.is_none_or(|(_, highest)| score > highest) {
                best = Some((candidate, score));
                if !descends {
                    way.clear();
                }
                way.push([candidate.distance_m, candidate.light_pct]);
            }
        }
        way
    }
}

impl ScoreMap {
    /// The score at a distance in m and a lamp level in percent, from its neighbours; `None` outside the map.
    pub fn at(&self, distance_m: f64, light_pct: f64) -> Option<f64> {
        let (columns, rows) = MAP_SIZE;
        let (column, across) = cell(distance_m, self.distance_m, columns)?;
        let (row, up) = cell(light_pct, self.light_pct, rows)?;
        let score = |row: usize, column: usize| self.scores.get(row * columns + column).copied();
        let along = |row: usize| {
            let (left, right) = (score(row, column)?, score(row, column + 1)?);
            Some(left + across * (right - left))
        };
        let (below, above) = (along(row)?, along(row + 1)?);
        let value = below + up * (above - below);
        value.is_finite().then_some(value)
    }

    /// Smallest and largest finite score; never the same.
    pub fn range(&self) -> (f64, f64) {
        let finite = self.scores.iter().copied().filter(|s| s.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| {
            (low.min(s), high.max(s))
        });
        if low < high { (low, high) } else { (0.0, 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_tells_scores_between_its_nodes_and_none_outside() {
        let (distance_m, light_pct) = ([0.5, 3.0], [0.0, 100.0]);
        let plane = |distance_m: f64, light_pct: f64| 2.0 - 0.4 * distance_m + 0.003 * light_pct;
        let map = ScoreMap {
            distance_m,
            light_pct,
            scores: map_candidates(distance_m, light_pct)
                .iter()
                .map(|c| plane(c.distance_m, c.light_pct))
                .collect(),
        };
        for (distance_m, light_pct) in [(0.5, 0.0), (3.0, 100.0), (1.234, 56.7)] {
            let score = map.at(distance_m, light_pct).expect("inside");
            assert!((score - plane(distance_m, light_pct)).abs() < 1e-9);
        }
        for (distance_m, light_pct) in [(0.49, 50.0), (3.01, 50.0), (1.0, -1.0), (1.0, 101.0)] {
            assert_eq!(map.at(distance_m, light_pct), None);
        }
    }
}
