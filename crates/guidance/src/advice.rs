//! From an observation to advice: pure functions of their arguments.

use uw_calib::json::FieldError;
use uw_calib::{Profile, ProfileError};

use crate::features::{Candidate, Situation};
use crate::mlp::{Model, Query};
use crate::objective::{Criterion, Objective};
use crate::observation::Observation;
use crate::optimise::{Bounds, Optimum, Ridges, maximise};

/// Share of the distance term's peak below which a place is no start for the search.
const RIDGE_THRESHOLD: f64 = 0.01;

/// Why there is no advice.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// The observation holds an impossible value.
    BadObservation(FieldError),
    /// The observation, or a candidate asked for, is outside the calibrated range.
    OutsideCalibration {
        /// Name of the value, such as `depth_m`.
        field: String,
        /// The value, m.
        value: f64,
        /// Smallest calibrated value, m.
        min: f64,
        /// Largest calibrated value, m.
        max: f64,
    },
    /// The objective's distances and the calibrated ones have nothing in common.
    NoCandidates {
        /// Distances of the objective, m.
        wanted_m: [f64; 2],
        /// Calibrated distances, m.
        calibrated_m: [f64; 2],
    },
    /// The model's predictions are not numbers anywhere.
    NotFinite,
    /// The calibration ends where the best distance lies, inside the objective's bounds: the advice is
    /// valid, and beyond the calibration it might be better.
    Clamped {
        /// The end of the calibrated distances, m.
        at_m: f64,
    },
}

impl Reason {
    /// A short name for programs.
    pub fn name(&self) -> &'static str {
        match self {
            Self::BadObservation(_) => "bad_observation",
            Self::OutsideCalibration { .. } => "outside_calibration",
            Self::NoCandidates { .. } => "no_candidates",
            Self::NotFinite => "not_finite",
            Self::Clamped { .. } => "clamped",
        }
    }
}

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::BadObservation(error) => error.fmt(f),
            Self::OutsideCalibration {
                field,
                value,
                min,
                max,
            } => {
                write!(
                    f,
                    "{field} must be between {min:?} and {max:?} m (calibrated), got {value}"
                )
            }
            Self::NoCandidates {
                wanted_m: [near, far],
                calibrated_m: [min, max],
            } => write!(
                f,
                "objective.distance_m must overlap with the calibrated {min:?} to {max:?} m, got [{near}, {far}]"
            ),
            Self::NotFinite => f.write_str("the model predicts no finite contrast here"),
            Self::Clamped { at_m } => write!(
                f,
                "the best distance lies at the end of the calibrated range, {at_m} m"
            ),
        }
    }
}

/// What the vehicle should do. Without a valid answer it should hold: distance and lamp level are the
/// current ones then.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Why the advice is not valid, or [`Reason::Clamped`] when it is with a limit; else `None`.
    pub reason: Option<Reason>,
    /// Suggested distance to the target, m.
    pub distance_m: f64,
    /// Suggested lamp level, percent.
    pub light_pct: f64,
    /// Suggested minus current distance, m; positive is away from the target.
    pub delta_distance_m: f64,
    /// Suggested minus current lamp level, percent.
    pub delta_light_pct: f64,
    /// Predicted contrast per channel at the suggestion, 8-bit counts.
    pub predicted_contrast: Option<[f64; 3]>,
    /// Score of the suggestion.
    pub score: Option<f64>,
    /// Score of staying as it is.
    pub score_here: Option<f64>,
    /// Candidates evaluated.
    pub evaluations: usize,
}

impl Advice {
    /// Whether the vehicle may follow.
    pub fn valid(&self) -> bool {
        matches!(self.reason, None | Some(Reason::Clamped { .. }))
    }

    /// What the suggestion promises over staying: the difference of the scores.
    pub fn gain(&self) -> Option<f64> {
        Some(self.score? - self.score_here?)
    }

    fn hold(observation: &Observation, reason: Reason) -> Self {
        Self {
            reason: Some(reason),
            distance_m: observation.distance_m,
            light_pct: observation.light_pct,
            delta_distance_m: 0.0,
            delta_light_pct: 0.0,
            predicted_contrast: None,
            score: None,
            score_here: None,
            evaluations: 0,
        }
    }
}

/// The candidates that [`advise`] looks at, in their order, with their scores in single precision: first a grid and the
/// ridges of the distance term, then the steps of the descents.
///
/// # Errors
/// Why there is no advice.
pub fn trace(
    observation: &Observation,
    profile: &Profile,
    model: &Model,
    objective: &Objective,
) -> Result<Vec<(Candidate, f64)>, Reason> {
    let mut steps = Vec::new();
    Question::new(observation, profile, model, objective)?.best(
        profile,
        objective,
        &mut |candidate, score| steps.push((*candidate, score)),
    )?;
    Ok(steps)
}

/// Contrast and score of candidates, in their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Predicted contrast per channel, 8-bit counts.
    pub contrast: Vec<[f64; 3]>,
    /// Scores.
    pub scores: Vec<f64>,
}

/// The distance and the lamp level with the best score inside the objective's bounds and the calibration.
pub fn advise(
    observation: &Observation,
    profile: &Profile,
    model: &Model,
    objective: &Objective,
) -> Advice {
    let found = Question::new(observation, profile, model, objective)
        .and_then(|question| question.best(profile, objective, &mut |_, _| {}));
    let (optimum, predicted, score_here) = match found {
        Ok(found) => found,
        Err(reason) => return Advice::hold(observation, reason),
    };
    let distance_m = optimum.candidate.distance_m;
    let (min, max) = profile.distance_range_m();
    let [near, far] = objective.distance_m;
    let clamped = (distance_m == min && near < min) || (distance_m == max && far > max);
    Advice {
        reason: clamped.then_some(Reason::Clamped { at_m: distance_m }),
        distance_m: optimum.candidate.distance_m,
        light_pct: optimum.candidate.light_pct,
        delta_distance_m: optimum.candidate.distance_m - observation.distance_m,
        delta_light_pct: optimum.candidate.light_pct - observation.light_pct,
        predicted_contrast: Some(predicted),
        score: Some(optimum.score),
        score_here: Some(score_here),
        evaluations: optimum.evaluations,
    }
}

/// What the network predicts for given candidates, and their scores.
pub fn predict(
    observation: &Observation,
    candidates: &[Candidate],
    profile: &Profile,
    model: &Model,
    objective: &Objective,
) -> Result<Prediction, Reason> {
    let (min, max) = profile.distance_range_m();
    for (k, candidate) in candidates.iter().enumerate() {
        let value = candidate.distance_m;
        if !(min..=max).contains(&value) {
            let field = format!("candidates[{k}][0]");
            return Err(Reason::OutsideCalibration {
                field,
                value,
                min,
                max,
            });
        }
    }
    let mut question = Question::new(observation, profile, model, objective)?;
    let mut contrast = vec![[0.0; 3]; candidates.len()];
    question.query.contrasts(candidates, &mut contrast);
    let scores = candidates
        .iter()
        .zip(&contrast)
        .map(|(candidate, &contrast)| question.criterion.score(contrast, candidate.distance_m))
        .collect();
    Ok(Prediction { contrast, scores })
}

/// Network and objective, made ready for one observation.
struct Question<'a> {
    query: Query<'a>,
    criterion: Criterion<'a>,
    current: Candidate,
}

impl<'a> Question<'a> {
    fn new(
        observation: &Observation,
        profile: &'a Profile,
        model: &'a Model,
        objective: &'a Objective,
    ) -> Result<Self, Reason> {
        observation.check().map_err(Reason::BadObservation)?;
        let situation = Situation::new(observation, profile).map_err(outside)?;
        Ok(Self {
            query: model.query(&situation),
            criterion: Criterion::new(objective, profile, observation.depth_m, situation.k_z),
            current: Candidate {
                distance_m: observation.distance_m,
                light_pct: observation.light_pct,
            },
        })
    }

    /// The optimum, the contrast predicted there and the score of the current candidate. `watch` sees every candidate
    /// that the search looks at.
    fn best(
        mut self,
        profile: &Profile,
        objective: &Objective,
        watch: &mut dyn FnMut(&Candidate, f64),
    ) -> Result<(Optimum, [f64; 3], f64), Reason> {
        let (min, max) = profile.distance_range_m();
        let [near, far] = objective.distance_m;
        let distance_m = [near.max(min), far.min(max)];
        if distance_m[0] > distance_m[1] {
            return Err(Reason::NoCandidates {
                wanted_m: objective.distance_m,
                calibrated_m: [min, max],
            });
        }
        let bounds = Bounds {
            distance_m,
            light_pct: objective.light_pct,
        };
        let mut peaks = self.criterion.peaks_m(distance_m[0], distance_m[1]);
        peaks.retain(|&d| self.criterion.distance_term(d) > RIDGE_THRESHOLD);
        let ridges = Ridges {
            distances_m: &peaks,
            width_m: self.criterion.width_m(),
            current: self.current,
        };
        let (query, criterion) = (&mut self.query, &self.criterion);
        let quick = |candidate: &Candidate| {
            let score = criterion.score(query.quick_contrast(candidate), candidate.distance_m);
            watch(candidate, score);
            score
        };
        let found = maximise(quick, &bounds, &ridges).ok_or(Reason::NotFinite)?;
        let current = self.current;
        let (predicted, score) = self.exact(&found.candidate);
        let (predicted_here, score_here) = self.exact(&current);
        // What looks best in single precision may be a rounding error worse than staying.
        let stay = score_here > score && bounds.hold(&self.current);
        let (candidate, predicted, score) = if stay {
            (self.current, predicted_here, score_here)
        } else {
            (found.candidate, predicted, score)
        };
        let optimum = Optimum {
            candidate,
            score,
            evaluations: found.evaluations + 2,
        };
        Ok((optimum, predicted, score_here))
    }

    /// Contrast and score in double precision.
    fn exact(&mut self, candidate: &Candidate) -> ([f64; 3], f64) {
        let predicted = self.query.contrast(candidate);
        (
            predicted,
            self.criterion.score(predicted, candidate.distance_m),
        )
    }
}

fn outside(error: ProfileError) -> Reason {
    match error {
        ProfileError::OutsideCalibration {
            what,
            value,
            min,
            max,
        } => Reason::OutsideCalibration {
            field: what.to_owned(),
            value,
            min,
            max,
        },
        other => Reason::BadObservation(FieldError::invalid("profile", "usable", other)),
    }
}
