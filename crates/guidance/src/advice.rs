//! From an observation to advice: pure functions of their arguments.

use uw_calib::Profile;

use crate::checks::{Checks, Residual, Strictness};
use crate::features::Candidate;
use crate::mlp::Model;
use crate::objective::{Objective, Terms};
use crate::observation::Observation;
use crate::question::Question;
pub use crate::reason::Reason;

/// What the vehicle should do. Without a valid answer it should hold: distance and lamp level are the
/// current ones then.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Why the advice is not valid, or [`Reason::Clamped`] or [`Reason::SmallGain`] when it is; else `None`.
    pub reason: Option<Reason>,
    /// What was found wanting and is allowed by the checks.
    pub warnings: Vec<Reason>,
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
    /// Predicted contrast per channel for no change, 8-bit counts.
    pub predicted_here: Option<[f64; 3]>,
    /// The same less the contrast of the picture: how well the model fits here.
    pub residual_here: Option<Residual>,
    /// Score of the suggestion.
    pub score: Option<f64>,
    /// Score of staying as it is.
    pub score_here: Option<f64>,
    /// What the score of the suggestion is made of.
    pub terms: Option<Terms>,
    /// What the score of staying is made of.
    pub terms_here: Option<Terms>,
    /// Candidates evaluated.
    pub evaluations: usize,
}

impl Advice {
    /// Whether the vehicle may follow.
    pub fn valid(&self) -> bool {
        self.reason.as_ref().is_none_or(Reason::is_valid)
    }

    /// Whether the vehicle should go anywhere or change its lamps; else it should hold.
    pub fn moves(&self) -> bool {
        matches!(self.reason, None | Some(Reason::Clamped { .. }))
    }

    /// What the suggestion promises over staying: the difference of the scores.
    pub fn gain(&self) -> Option<f64> {
        Some(self.score? - self.score_here?)
    }

    /// Advice to stay without any number but the observation's own.
    pub(crate) fn hold(observation: &Observation, reason: Reason) -> Self {
        let (predicted_here, residual_here) = match &reason {
            Reason::ModelMisfit {
                residual,
                predicted,
                ..
            } => (Some(*predicted), Some(*residual)),
            _ => (None, None),
        };
        Self {
            reason: Some(reason),
            warnings: Vec::new(),
            distance_m: observation.distance_m,
            light_pct: observation.light_pct,
            delta_distance_m: 0.0,
            delta_light_pct: 0.0,
            predicted_contrast: None,
            predicted_here,
            residual_here,
            score: None,
            score_here: None,
            terms: None,
            terms_here: None,
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
    let mut question = Question::new(observation, profile, model, objective, &Checks::none())?;
    let (here, _) = question.here()?;
    question.best(here, &mut |candidate, score| {
        steps.push((*candidate, score))
    })?;
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

/// The distance and the lamp level with the best score inside the objective's bounds and the calibration: the bare
/// search, without asking whether the model knows the place. A vehicle should follow [`advise_checked`].
pub fn advise(
    observation: &Observation,
    profile: &Profile,
    model: &Model,
    objective: &Objective,
) -> Advice {
    advise_checked(observation, profile, model, objective, &Checks::none())
}

/// The same, if it passes the checks; else the advice is to hold, with the reason.
pub fn advise_checked(
    observation: &Observation,
    profile: &Profile,
    model: &Model,
    objective: &Objective,
    checks: &Checks,
) -> Advice {
    let answer = || {
        let mut question = Question::new(observation, profile, model, objective, checks)?;
        let (here, residual) = question.here()?;
        let found = question.best(here, &mut |_, _| {})?;
        Ok((found, residual, question.warnings))
    };
    let (found, residual, warnings) = match answer() {
        Ok(found) => found,
        Err(reason) => return Advice::hold(observation, reason),
    };
    let (advised, here) = (found.advised, found.here);
    Advice {
        reason: found.reason,
        warnings,
        distance_m: advised.candidate.distance_m,
        light_pct: advised.candidate.light_pct,
        delta_distance_m: advised.candidate.distance_m - observation.distance_m,
        delta_light_pct: advised.candidate.light_pct - observation.light_pct,
        predicted_contrast: Some(advised.contrast),
        predicted_here: Some(here.contrast),
        residual_here: Some(residual),
        score: Some(advised.score),
        score_here: Some(here.score),
        terms: Some(advised.terms),
        terms_here: Some(here.terms),
        evaluations: found.evaluations,
    }
}

/// What the network predicts for given candidates, and their scores, without asking whether it knows them; see
/// [`doubt`].
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
    let mut question = Question::new(observation, profile, model, objective, &Checks::none())?;
    let (contrast, scores) = question.predict(candidates);
    Ok(Prediction { contrast, scores })
}

/// Why predictions for these candidates are not to be relied on, if there is a reason.
pub fn doubt(
    observation: &Observation,
    candidates: &[Candidate],
    profile: &Profile,
    model: &Model,
    objective: &Objective,
    checks: &Checks,
) -> Option<Reason> {
    let fits = Question::new(observation, profile, model, objective, checks)
        .and_then(|mut question| question.here().map(|_| ()));
    if let Err(reason) = fits {
        return Some(reason);
    }
    let current = Candidate {
        distance_m: observation.distance_m,
        light_pct: observation.light_pct,
    };
    match checks.training {
        Strictness::Refuse => {
            model.outside_candidates(&current, candidates, checks.training_margin)
        }
        Strictness::Warn | Strictness::Ignore => None,
    }
}
