//! From an observation to advice: pure functions of their arguments.

use uw_calib::Profile;

use crate::checks::{Checks, Residual, Strictness};
use crate::features::Candidate;
use crate::mlp::Model;
use crate::objective::{Objective, Terms};
use crate::observation::Observation;
use crate::physics::{Present, Residual as PhysicalResidual};
use crate::question::Question;
pub use crate::reason::{NeedsProfile, Reason};

/// What predicts contrast.
#[derive(Clone, Copy, Debug)]
pub enum By<'a> {
    /// A network.
    Network(&'a Model),
    /// Physics.
    Physics(Physical<'a>),
}

/// Physics from a picture.
#[derive(Clone, Copy, Debug)]
pub struct Physical<'a> {
    /// The picture.
    pub present: &'a Present,
    /// How far a prediction from elsewhere is from what was measured, where there is one.
    pub residual: Option<PhysicalResidual>,
}

/// What only predictions by physics tell.
#[derive(Clone, Debug, PartialEq)]
pub struct PhysicalAdvice {
    /// Which channels are told; the contrast of others is the picture's everywhere.
    pub told: [bool; 3],
    /// Standard errors of the contrast predicted at the suggestion, 8-bit counts.
    pub error: Option<[f64; 3]>,
    /// Standard errors of the contrast predicted for no change, 8-bit counts.
    pub error_here: Option<[f64; 3]>,
    /// From where the earlier pictures are that count besides the present one, rising, m.
    pub earlier_m: Vec<f64>,
    /// How far a prediction from elsewhere is from what was measured, where there is one.
    pub residual: Option<PhysicalResidual>,
}

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
    /// What predictions by physics tell besides; `None` with a network.
    pub physics: Option<PhysicalAdvice>,
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
            physics: None,
        }
    }
}

/// The candidates that [`advise_by`] looks at, in their order, with their scores as the search sees them: first a grid and the
/// ridges of the distance term, then the steps of the descents. Without a profile as there.
///
/// # Errors
/// Why there is no advice.
pub fn trace<'a>(
    observation: &Observation,
    profile: impl Into<Option<&'a Profile>>,
    by: By<'a>,
    objective: &'a Objective,
) -> Result<Vec<(Candidate, f64)>, Reason> {
    let mut steps = Vec::new();
    let profile = profile.into();
    let mut question = Question::new(observation, profile, by, objective, &Checks::none())?;
    let (here, _) = question.here()?;
    question.best(here, &mut |candidate, score| {
        steps.push((*candidate, score))
    })?;
    Ok(steps)
}

/// Scores of candidates as the search sees them, in their order: by a network in single precision, by physics from the sheet of the picture.
///
/// # Errors
/// Why there are none; of physics also that the water file has no tables of a candidate's distance.
pub fn quick_scores<'a>(
    observation: &Observation,
    candidates: &[Candidate],
    profile: impl Into<Option<&'a Profile>>,
    by: By<'a>,
    objective: &'a Objective,
) -> Result<Vec<f64>, Reason> {
    by.holds(candidates)?;
    let profile = profile.into();
    let mut question = Question::new(observation, profile, by, objective, &Checks::none())?;
    Ok(candidates
        .iter()
        .map(|at| question.quick_score(at))
        .collect())
}

/// Contrast and score of candidates, in their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Predicted contrast per channel, 8-bit counts.
    pub contrast: Vec<[f64; 3]>,
    /// Scores.
    pub scores: Vec<f64>,
    /// Standard errors of the contrast, 8-bit counts; `None` with a network.
    pub errors: Option<Vec<[f64; 3]>>,
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
    advise_by(observation, profile, By::Network(model), objective, checks)
}

/// The same, by network or physics. By physics an objective of the form [`Form::Overlap`](crate::objective::Form::Overlap) needs no profile.
pub fn advise_by<'a>(
    observation: &Observation,
    profile: impl Into<Option<&'a Profile>>,
    by: By<'a>,
    objective: &'a Objective,
    checks: &Checks,
) -> Advice {
    let profile = profile.into();
    let answer = || {
        let mut question = Question::new(observation, profile, by, objective, checks)?;
        let (here, residual) = question.here()?;
        let found = question.best(here, &mut |_, _| {})?;
        Ok((found, residual, question.warnings))
    };
    let (found, residual, warnings) = match answer() {
        Ok(found) => found,
        Err(reason) => {
            return Advice {
                physics: by.advice(None),
                ..Advice::hold(observation, reason)
            };
        }
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
        residual_here: residual,
        score: Some(advised.score),
        score_here: Some(here.score),
        terms: Some(advised.terms),
        terms_here: Some(here.terms),
        evaluations: found.evaluations,
        physics: by.advice(advised.error.zip(here.error)),
    }
}

impl By<'_> {
    /// Why there is no answer without a profile; `None` where none is needed.
    pub(crate) fn needs_profile(&self, objective: &Objective) -> Option<NeedsProfile> {
        NeedsProfile::of(matches!(self, Self::Physics(_)), objective)
    }

    /// Refuses candidates of which physics has no tables: beyond them there are no numbers.
    fn holds(&self, candidates: &[Candidate]) -> Result<(), Reason> {
        let Self::Physics(Physical { present, .. }) = self else {
            return Ok(());
        };
        let (min, max) = present.water().tables.distance_range_m();
        let outside = |candidate: &Candidate| !(min..=max).contains(&candidate.distance_m);
        match candidates.iter().position(outside) {
            None => Ok(()),
            Some(k) => Err(Reason::OutsideTables {
                field: format!("candidates[{k}][0]"),
                value: candidates[k].distance_m,
                range_m: [min, max],
            }),
        }
    }

    /// What physics tells besides, with the standard errors at the suggestion and here.
    fn advice(&self, errors: Option<([f64; 3], [f64; 3])>) -> Option<PhysicalAdvice> {
        match self {
            Self::Network(_) => None,
            Self::Physics(Physical { present, residual }) => Some(PhysicalAdvice {
                told: present.told(),
                error: errors.map(|errors| errors.0),
                error_here: errors.map(|errors| errors.1),
                earlier_m: present.earlier_m(),
                residual: *residual,
            }),
        }
    }
}

/// What a network predicts for given candidates, and their scores, without asking whether it knows them; see [`doubt_by`].
pub fn predict(
    observation: &Observation,
    candidates: &[Candidate],
    profile: &Profile,
    model: &Model,
    objective: &Objective,
) -> Result<Prediction, Reason> {
    predict_by(
        observation,
        candidates,
        profile,
        By::Network(model),
        objective,
    )
}

/// The same, by network or physics.
pub fn predict_by<'a>(
    observation: &Observation,
    candidates: &[Candidate],
    profile: impl Into<Option<&'a Profile>>,
    by: By<'a>,
    objective: &'a Objective,
) -> Result<Prediction, Reason> {
    let profile = profile.into();
    let calibrated_m = profile.map(Profile::distance_range_m);
    for (k, candidate) in candidates.iter().enumerate() {
        let value = candidate.distance_m;
        if let Some((min, max)) = calibrated_m.filter(|(min, max)| !(*min..=*max).contains(&value))
        {
            let field = format!("candidates[{k}][0]");
            return Err(Reason::OutsideCalibration {
                field,
                value,
                min,
                max,
            });
        }
    }
    by.holds(candidates)?;
    let mut question = Question::new(observation, profile, by, objective, &Checks::none())?;
    Ok(question.predict(candidates))
}

/// Why predictions for these candidates are not to be relied on, if there is a reason.
pub fn doubt_by<'a>(
    observation: &Observation,
    candidates: &[Candidate],
    profile: impl Into<Option<&'a Profile>>,
    by: By<'a>,
    objective: &'a Objective,
    checks: &Checks,
) -> Option<Reason> {
    let fits = Question::new(observation, profile.into(), by, objective, checks)
        .and_then(|mut question| question.here().map(|_| ()));
    if let Err(reason) = fits {
        return Some(reason);
    }
    let current = Candidate {
        distance_m: observation.distance_m,
        light_pct: observation.light_pct,
    };
    match (by, checks.training) {
        (By::Network(model), Strictness::Refuse) => {
            model.outside_candidates(&current, candidates, checks.training_margin)
        }
        _ => None,
    }
}
