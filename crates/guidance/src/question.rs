//! One question to network or physics and objective: what is known, what is asked, and where the answer may lie.

use uw_calib::Profile;

use crate::advice::{By, Physical, Prediction};
use crate::checks::{Checks, Residual, Strictness};
use crate::features::{Candidate, FeatureValue, Situation, TARGET_PROFILE};
use crate::mlp::{Model, Query};
use crate::objective::{Criterion, Objective, Terms};
use crate::observation::Observation;
use crate::optimise::{Bounds, Ridges, maximise};
use crate::physics::Unknown;
use crate::reason::Reason;

/// Share of the distance term's peak below which a place is no start for the search.
const RIDGE_THRESHOLD: f64 = 0.01;
/// Suggestions lie on whole multiples of these: no vehicle keeps its distance better, no lamp its level.
const DISTANCE_GRID_PER_M: f64 = 100.0;
const LIGHT_GRID_PER_PCT: f64 = 10.0;

/// Network or physics, and objective, made ready for one observation.
pub(crate) struct Question<'a> {
    engine: Engine<'a>,
    criterion: Criterion<'a>,
    profile: Option<&'a Profile>,
    objective: &'a Objective,
    situation: Situation,
    /// What was found wanting and is allowed by the checks.
    pub warnings: Vec<Reason>,
    checks: Checks,
    current: Candidate,
}

/// What predicts contrast, made ready.
#[expect(
    clippy::large_enum_variant,
    reason = "one is made for each question, and lives on the stack"
)]
enum Engine<'a> {
    Network { query: Query<'a>, model: &'a Model },
    Physics(Physical<'a>),
}

/// A candidate with what is predicted for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Judged {
    pub candidate: Candidate,
    /// 8-bit counts.
    pub contrast: [f64; 3],
    /// Its standard error, 8-bit counts, by physics.
    pub error: Option<[f64; 3]>,
    pub score: f64,
    pub terms: Terms,
}

/// What came of a search.
pub(crate) struct Found {
    /// The advice: the best candidate, or the current one where moving is not worth it.
    pub advised: Judged,
    pub here: Judged,
    pub reason: Option<Reason>,
    pub evaluations: usize,
}

impl<'a> Question<'a> {
    pub fn new(
        observation: &Observation,
        profile: Option<&'a Profile>,
        by: By<'a>,
        objective: &'a Objective,
        checks: &Checks,
    ) -> Result<Self, Reason> {
        observation.check().map_err(Reason::BadObservation)?;
        let situation = match (profile, by.needs_profile(objective)) {
            (Some(profile), _) => Situation::new(observation, profile)?,
            (None, None) => Situation::without_profile(observation),
            (None, Some(needs)) => return Err(Reason::NoProfile(needs)),
        };
        let mut warnings = Vec::new();
        for (strictness, reason) in observation
            .quality
            .iter()
            .flat_map(|quality| checks.doubts(quality))
        {
            match strictness {
                Strictness::Refuse => return Err(reason),
                Strictness::Warn | Strictness::Ignore => warnings.push(reason),
            }
        }
        let depth_m = observation.depth_m;
        if let Some(reason) = profile.and_then(|profile| other_depth(depth_m, profile, checks)) {
            match checks.other_depth {
                Strictness::Refuse => return Err(reason),
                Strictness::Warn | Strictness::Ignore => warnings.push(reason),
            }
        }
        let own = match by {
            By::Network(model) => {
                let outside = model.outside(&situation, checks.training_margin);
                outside
                    .map(|reason| (checks.training, reason))
                    .into_iter()
                    .collect()
            }
            By::Physics(physical) => physical.doubts(observation, checks)?,
        };
        for (strictness, reason) in own {
            match strictness {
                Strictness::Refuse => return Err(reason),
                Strictness::Warn => warnings.push(reason),
                Strictness::Ignore => {}
            }
        }
        Ok(Self {
            engine: match by {
                By::Network(model) => Engine::Network {
                    query: model.query(&situation),
                    model,
                },
                By::Physics(physical) => Engine::Physics(physical),
            },
            criterion: Criterion::new(objective, profile, depth_m, situation.k_z),
            profile,
            objective,
            situation,
            warnings,
            checks: *checks,
            current: Candidate {
                distance_m: observation.distance_m,
                light_pct: observation.light_pct,
            },
        })
    }

    /// What is predicted for staying, and by a network how far that is from the picture. A residual beyond the limit is an error or
    /// a warning, as the checks say.
    pub fn here(&mut self) -> Result<(Judged, Option<Residual>), Reason> {
        let current = self.current;
        let here = self.exact(&current);
        let Engine::Network { model, .. } = &self.engine else {
            return match here.score.is_finite() {
                true => Ok((here, None)),
                false => Err(Reason::NotFinite),
            };
        };
        let measured = self.situation.observation.std;
        let residual = Residual::new(here.contrast, measured);
        let strictness = self.checks.misfit_of(model);
        if strictness == Strictness::Ignore || residual.misfit <= self.checks.max_misfit {
            return Ok((here, Some(residual)));
        }
        if !residual.misfit.is_finite() {
            return Err(Reason::NotFinite);
        }
        let reason = Reason::ModelMisfit {
            residual,
            predicted: here.contrast,
            measured,
            limit: self.checks.max_misfit,
        };
        match strictness {
            Strictness::Refuse => Err(reason),
            Strictness::Warn | Strictness::Ignore => {
                self.warnings.push(reason);
                Ok((here, Some(residual)))
            }
        }
    }

    /// The best candidate against staying. `watch` sees every candidate that the search looks at.
    pub fn best(
        &mut self,
        here: Judged,
        watch: &mut dyn FnMut(&Candidate, f64),
    ) -> Result<Found, Reason> {
        let allowed = self.allowed()?;
        let bounds = self.known(allowed)?;
        let mut peaks = self
            .criterion
            .peaks_m(bounds.distance_m[0], bounds.distance_m[1]);
        peaks.retain(|&d| self.criterion.distance_term(d) > RIDGE_THRESHOLD);
        let ridges = Ridges {
            distances_m: &peaks,
            width_m: self.criterion.width_m(),
            current: self.current,
        };
        let known = self.curve_limits(&bounds);
        let (engine, criterion, situation) = (&mut self.engine, &self.criterion, &self.situation);
        let quick = |candidate: &Candidate| {
            let score = if known.iter().all(|limit| limit.holds(situation, candidate)) {
                criterion.score(engine.quick_contrast(candidate), candidate.distance_m)
            } else {
                f64::NAN
            };
            watch(candidate, score);
            score
        };
        let found = maximise(quick, &bounds, &ridges).ok_or(Reason::NotFinite)?;
        let advised = self.exact(&self.presentable(found.candidate, &bounds));
        let mut result = Found {
            advised,
            here,
            reason: self.clamped(found.candidate.distance_m, &bounds),
            evaluations: found.evaluations + 2,
        };
        let gain = advised.score - here.score;
        if allowed.hold(&self.current) && (gain < 0.0 || gain <= self.checks.min_gain) {
            // What looks best in single precision may also be a rounding error worse than staying.
            result.advised = here;
            if self.checks.min_gain >= 0.0 {
                result.reason = Some(Reason::SmallGain {
                    distance_m: advised.candidate.distance_m,
                    light_pct: advised.candidate.light_pct,
                    gain,
                    min_gain: self.checks.min_gain,
                });
            } else {
                result.reason = self.clamped(here.candidate.distance_m, &bounds);
            }
        }
        Ok(result)
    }

    /// Contrasts of candidates in double precision, and their scores.
    pub fn predict(&mut self, candidates: &[Candidate]) -> Prediction {
        let mut contrast = vec![[0.0; 3]; candidates.len()];
        let mut errors = None;
        match &mut self.engine {
            Engine::Network { query, .. } => query.contrasts(candidates, &mut contrast),
            Engine::Physics(physical) => {
                let found = candidates.iter().map(|at| physical.present.contrast(at));
                let found: Vec<_> = found.collect();
                contrast = found.iter().map(|found| found.counts).collect();
                errors = Some(found.iter().map(|found| found.error_counts).collect());
            }
        }
        let scores = candidates
            .iter()
            .zip(&contrast)
            .map(|(candidate, &contrast)| self.criterion.score(contrast, candidate.distance_m))
            .collect();
        Prediction {
            contrast,
            scores,
            errors,
        }
    }

    /// The score of a candidate as the search sees it.
    pub fn quick_score(&mut self, candidate: &Candidate) -> f64 {
        let contrast = self.engine.quick_contrast(candidate);
        self.criterion.score(contrast, candidate.distance_m)
    }

    /// The objective's bounds inside the calibration, where there is one.
    fn allowed(&self) -> Result<Bounds, Reason> {
        let [near, far] = self.objective.distance_m;
        let (min, max) = self.profile.map_or((near, far), Profile::distance_range_m);
        let distance_m = [near.max(min), far.min(max)];
        if distance_m[0] > distance_m[1] {
            return Err(Reason::NoCandidates {
                wanted_m: self.objective.distance_m,
                calibrated_m: [min, max],
            });
        }
        Ok(Bounds {
            distance_m,
            light_pct: self.objective.light_pct,
        })
    }

    /// Of these bounds what the model was trained on, or what the water file has tables of.
    fn known(&self, allowed: Bounds) -> Result<Bounds, Reason> {
        let model = match &self.engine {
            Engine::Physics(physical) => return physical.tabulated(allowed),
            Engine::Network { .. } if self.checks.training != Strictness::Refuse => {
                return Ok(allowed);
            }
            Engine::Network { model, .. } => model,
        };
        let common = |name, unit, [low, high]: [f64; 2], trained: Option<[f64; 2]>| {
            let Some(trained) = trained else {
                return Ok([low, high]);
            };
            let both = [low.max(trained[0]), high.min(trained[1])];
            if both[0] <= both[1] {
                return Ok(both);
            }
            Err(Reason::OutsideTraining {
                input: format!("objective.{name}"),
                unit,
                value: if low > trained[1] { low } else { high },
                trained,
                margin: 0.0,
            })
        };
        let (distance_m, light_pct) = model.trained_candidates(&self.current);
        Ok(Bounds {
            distance_m: common("distance_m", "m", allowed.distance_m, distance_m)?,
            light_pct: common("light_pct", "percent", allowed.light_pct, light_pct)?,
        })
    }

    /// Inputs that follow the calibration to the candidate's distance and leave the trained range somewhere between the
    /// bounds. Between samples the curves are straight, so that their ends tell.
    fn curve_limits(&self, bounds: &Bounds) -> Vec<CurveLimit> {
        let (model, profile) = match (&self.engine, self.profile) {
            (Engine::Network { model, .. }, Some(profile))
                if self.checks.training == Strictness::Refuse =>
            {
                (model, profile)
            }
            _ => return Vec::new(),
        };
        let [near, far] = bounds.distance_m;
        let samples = profile.contrast_on().iter();
        let mut corners: Vec<f64> = samples
            .chain(profile.contrast_off())
            .map(|sample| sample.distance_m)
            .filter(|distance_m| (near..=far).contains(distance_m))
            .collect();
        corners.extend([near, far]);
        let inputs = model.inputs().iter().enumerate();
        inputs
            .filter(|(_, input)| TARGET_PROFILE.contains(&input.name))
            .filter_map(|(k, input)| match input.value {
                FeatureValue::Varying(value) => {
                    let range = model.widened(k, self.checks.training_margin)?;
                    Some(CurveLimit { value, range })
                }
                FeatureValue::Fixed(_) => None,
            })
            .filter(|limit| {
                let at = |&distance_m: &f64| Candidate {
                    distance_m,
                    light_pct: bounds.light_pct[0],
                };
                !corners
                    .iter()
                    .all(|corner| limit.holds(&self.situation, &at(corner)))
            })
            .collect()
    }

    /// The candidate on the grid of what can be kept, inside the bounds; the current one as it is.
    fn presentable(&self, candidate: Candidate, bounds: &Bounds) -> Candidate {
        if !self.checks.round || candidate == self.current {
            return candidate;
        }
        Candidate {
            distance_m: on_grid(candidate.distance_m, DISTANCE_GRID_PER_M, bounds.distance_m),
            light_pct: on_grid(candidate.light_pct, LIGHT_GRID_PER_PCT, bounds.light_pct),
        }
    }

    /// Whether the best distance lies where calibration or training end, and the objective would go on.
    fn clamped(&self, distance_m: f64, bounds: &Bounds) -> Option<Reason> {
        let [near, far] = self.objective.distance_m;
        let [min, max] = bounds.distance_m;
        let clamped = (distance_m == min && near < min) || (distance_m == max && far > max);
        clamped.then_some(Reason::Clamped { at_m: distance_m })
    }

    /// Contrast and score in double precision.
    fn exact(&mut self, candidate: &Candidate) -> Judged {
        let (contrast, error) = match &mut self.engine {
            Engine::Network { query, .. } => (query.contrast(candidate), None),
            Engine::Physics(physical) => {
                let found = physical.present.contrast(candidate);
                (found.counts, Some(found.error_counts))
            }
        };
        let distance_m = candidate.distance_m;
        Judged {
            candidate: *candidate,
            contrast,
            error,
            score: self.criterion.score(contrast, distance_m),
            terms: self.criterion.terms(contrast, distance_m),
        }
    }
}

impl Engine<'_> {
    /// Contrast in single precision, or by physics from the sheet of the picture.
    fn quick_contrast(&mut self, candidate: &Candidate) -> [f64; 3] {
        match self {
            Self::Network { query, .. } => query.quick_contrast(candidate),
            Self::Physics(physical) => physical.present.quick_contrast(candidate),
        }
    }
}

impl Physical<'_> {
    /// What is wrong with picture and place, and what is done about it.
    ///
    /// # Errors
    /// No channel is told: there is no number.
    fn doubts(
        &self,
        observation: &Observation,
        checks: &Checks,
    ) -> Result<Vec<(Strictness, Reason)>, Reason> {
        let unknown = self.present.unknown();
        if unknown.iter().all(Option::is_some) {
            return Err(Reason::Untold(unknown));
        }
        let tables = &self.present.water().tables;
        let mut doubts = Vec::new();
        let distances_m = tables.distance_range_m();
        let margin_m = checks.training_margin * (distances_m.1 - distances_m.0);
        let of_distance = ("distance_m", observation.distance_m, distances_m, margin_m);
        let of_depth = tables.depth_range_m().map(|depths_m| {
            (
                "depth_m",
                observation.depth_m,
                depths_m,
                checks.depth_margin_m,
            )
        });
        for (field, value, (min, max), margin) in [of_distance].into_iter().chain(of_depth) {
            if !(min - margin..=max + margin).contains(&value) {
                let reason = Reason::OutsideTables {
                    field: field.to_owned(),
                    value,
                    range_m: [min, max],
                };
                doubts.push((checks.training, reason));
            }
        }
        let strictness = unknown.iter().flatten().map(|reason| match reason {
            Unknown::Clipped => checks.saturation,
            Unknown::Noise => checks.noise_floor,
            Unknown::Light => checks.misfit,
        });
        if let Some(strictest) = strictness.reduce(Strictness::stricter) {
            doubts.push((strictest, Reason::Untold(unknown)));
        }
        if let Some(predicted) = self.present.unexplained() {
            let measured = self.present.measured();
            let reason = Reason::Unexplained {
                predicted,
                measured,
            };
            doubts.push((checks.misfit, reason));
        }
        let limit = checks.max_misfit;
        if let Some(residual) = self.residual.filter(|found| !(found.misfit <= limit)) {
            doubts.push((
                checks.misfit,
                Reason::PhysicsMisfit {
                    residual: Box::new(residual),
                    limit,
                },
            ));
        }
        Ok(doubts)
    }

    /// Of these bounds what the water file has tables of.
    fn tabulated(&self, allowed: Bounds) -> Result<Bounds, Reason> {
        let (min, max) = self.present.water().tables.distance_range_m();
        let [low, high] = allowed.distance_m;
        let distance_m = [low.max(min), high.min(max)];
        match distance_m[0] <= distance_m[1] {
            true => Ok(Bounds {
                distance_m,
                ..allowed
            }),
            false => Err(Reason::OutsideTables {
                field: "objective.distance_m".to_owned(),
                value: if low > max { low } else { high },
                range_m: [min, max],
            }),
        }
    }
}

/// Why the contrasts of `profile` may not hold at `depth_m`: they were measured at another depth.
fn other_depth(depth_m: f64, profile: &Profile, checks: &Checks) -> Option<Reason> {
    let beyond_m = profile.beyond_contrast_depth_m(depth_m)?;
    let asked = checks.other_depth != Strictness::Ignore && beyond_m > checks.depth_margin_m;
    let calibrated_m = profile.contrast_depth_m().filter(|_| asked)?;
    Some(Reason::OtherDepth {
        depth_m,
        calibrated_m,
        margin_m: checks.depth_margin_m,
    })
}

/// An input that follows the calibration to the candidate's distance, and its allowed range.
struct CurveLimit {
    value: crate::features::VaryingValue,
    range: [f64; 2],
}

impl CurveLimit {
    fn holds(&self, situation: &Situation, candidate: &Candidate) -> bool {
        let value = (self.value)(situation, candidate);
        (self.range[0]..=self.range[1]).contains(&value)
    }
}

/// The multiple of 1/`per_unit` nearest to `x` inside the bounds; `x` itself where none lies inside.
fn on_grid(x: f64, per_unit: f64, [low, high]: [f64; 2]) -> f64 {
    let steps = (x * per_unit).round();
    [steps, steps - 1.0, steps + 1.0]
        .into_iter()
        .map(|steps| steps / per_unit)
        .find(|value| (low..=high).contains(value))
        .unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_never_leaves_the_bounds() {
        assert_eq!(on_grid(1.4249, 100.0, [0.5, 3.0]), 1.42);
        assert_eq!(on_grid(2.997, 100.0, [0.5, 2.997]), 2.99);
        assert_eq!(on_grid(0.503, 100.0, [0.503, 3.0]), 0.51);
        assert_eq!(on_grid(1.0012, 100.0, [1.001, 1.002]), 1.0012);
    }
}
