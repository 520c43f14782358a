//! Advice with the objective around it.

use uw_calib::Profile;
use uw_guidance::{
    Candidate, Model, Objective, Observation,
    advice::{predict, trace},
    advise,
};

/// Columns (distances) and rows (lamp levels) of the map.
pub const MAP_SIZE: (usize, usize) = (60, 41);

/// What an answer of the library hangs on: state, objective, and where profile and network lie in memory.
pub type Question = (Observation, Objective, [usize; 2]);

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
    /// Why not, or with which limit.
    pub reason: Option<String>,
    /// Score of the suggestion.
    pub score: Option<f64>,
    /// Score of staying.
    pub score_here: Option<f64>,
    /// Predicted contrast of the suggestion, 8-bit counts.
    pub predicted: Option<[f64; 3]>,
    /// Predicted contrast of staying, 8-bit counts.
    pub predicted_here: Option<[f64; 3]>,
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

/// Distances that objective and calibration have in common, m.
pub fn common_distances(profile: &Profile, objective: &Objective) -> Option<[f64; 2]> {
    let (min, max) = profile.distance_range_m();
    let [near, far] = objective.distance_m;
    let both = [near.max(min), far.min(max)];
    (both[0] < both[1]).then_some(both)
}

impl Answer {
    /// The library's answer.
    pub fn of_library(
        now: &Observation,
        profile: &Profile,
        model: &Model,
        objective: &Objective,
        question: Question,
    ) -> Self {
        let advice = advise(now, profile, model, objective);
        let map = common_distances(profile, objective).and_then(|distance_m| {
            let candidates = map_candidates(distance_m, objective.light_pct);
            let found = predict(now, &candidates, profile, model, objective).ok()?;
            Some(ScoreMap {
                distance_m,
                light_pct: objective.light_pct,
                scores: found.scores,
            })
        });
        let here = Candidate {
            distance_m: now.distance_m,
            light_pct: now.light_pct,
        };
        let predicted_here = predict(now, &[here], profile, model, objective)
            .ok()
            .and_then(|p| p.contrast.first().copied());
        Self {
            observation: *now,
            question: Some(question),
            distance_m: advice.distance_m,
            light_pct: advice.light_pct,
            valid: advice.valid(),
            reason: advice.reason.as_ref().map(ToString::to_string),
            score: advice.score,
            score_here: advice.score_here,
            predicted: advice.predicted_contrast,
            predicted_here,
            evaluations: advice.evaluations,
            steps: trace(now, profile, model, objective).unwrap_or_default(),
            map,
        }
    }

    /// The way to the best candidate: every step that was better than all before it.
    pub fn ascent(&self) -> Vec<[f64; 2]> {
        let mut best = f64::NEG_INFINITY;
        let mut way = Vec::new();
        for (candidate, score) in &self.steps {
            if *score > best {
                best = *score;
                way.push([candidate.distance_m, candidate.light_pct]);
            }
        }
        way
    }
}

impl ScoreMap {
    /// Smallest and largest finite score; never the same.
    pub fn range(&self) -> (f64, f64) {
        let finite = self.scores.iter().copied().filter(|s| s.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| {
            (low.min(s), high.max(s))
        });
        if low < high { (low, high) } else { (0.0, 1.0) }
    }
}
