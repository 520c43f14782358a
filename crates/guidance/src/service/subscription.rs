//! Suggestions at a chosen rate from the latest state, steered so that the vehicle does not hunt.

use serde_json::{Value, json};
use uw_calib::Profile;
use uw_calib::json::{FieldError, Object};

use crate::advice::{Advice, By, PhysicalAdvice, Prediction, Reason, predict_by};
use crate::checks::Checks;
use crate::features::Candidate;
use crate::objective::Objective;
use crate::service::album::Album;
use crate::service::resolve::{Known, resolve};
use crate::service::suggestion::{self, Hold, Means, Predicting, usable};
use crate::service::{Basis, Moment, Settings, Snapshot};
use crate::steering::{Command, Course, Steering};
use crate::wire::inputs::Inputs;
use crate::wire::reply::{
    self, Code, DISTANCE_DECIMALS, Fields, LIGHT_DECIMALS, WireError, rounded,
};

/// One connection's subscription.
#[derive(Clone, Debug)]
pub(super) struct Subscription {
    /// Id of the request that began it, repeated in every message.
    pub id: Value,
    period_s: f64,
    objective: Objective,
    steering: Steering,
    course: Course,
    next_s: f64,
    sent: u64,
}

impl Subscription {
    pub fn new(
        id: Value,
        rate_hz: f64,
        objective: Objective,
        steering: Steering,
        now: Moment,
    ) -> Self {
        let period_s = 1.0 / rate_hz;
        Self {
            id,
            period_s,
            objective,
            steering,
            course: Course::default(),
            next_s: now.since_start_s + period_s,
            sent: 0,
        }
    }

    /// When the next message is due, s since the start.
    pub fn next_s(&self) -> f64 {
        self.next_s
    }

    /// The message that is due; the time of the next keeps the rhythm, and those missed are left out.
    pub fn push(
        &mut self,
        seen: (&Snapshot, &Album),
        own: Option<&Profile>,
        settings: &Settings,
        now: Moment,
    ) -> Result<Fields, WireError> {
        let missed = ((now.since_start_s - self.next_s) / self.period_s).floor();
        self.next_s += self.period_s * (missed.max(0.0) + 1.0);
        self.sent += 1;
        let answer = self.suggestion(seen, own, settings, now);
        let mut fields = match answer {
            Ok(fields) => fields,
            Err(error) => {
                self.course.reset();
                return Err(error);
            }
        };
        if fields.get("valid") == Some(&Value::Bool(false)) {
            self.course.reset();
        }
        fields.insert("push".to_owned(), true.into());
        fields.insert("sequence".to_owned(), self.sent.into());
        Ok(fields)
    }

    fn suggestion(
        &mut self,
        (snapshot, album): (&Snapshot, &Album),
        own: Option<&Profile>,
        settings: &Settings,
        now: Moment,
    ) -> Result<Fields, WireError> {
        let feed = match &snapshot.loaded.basis {
            Basis::Network(_) => snapshot.feed,
            Basis::Physics(_) => album.feed(snapshot.feed),
        };
        let known = match resolve(&Inputs::default(), &feed, now, &settings.beams) {
            Ok(known) => known,
            Err(super::resolve::Unknown::Missing(name)) => {
                return Ok(Hold::Missing(name).fields(None));
            }
            Err(other) => return suggestion::unknown(other),
        };
        let profile = own.or(snapshot.loaded.profile.as_deref());
        let from = (profile, &snapshot.loaded.basis);
        if let Err(hold) = usable(&known, from, &self.objective, &settings.max_age) {
            return Ok(hold.fields(Some(&known)));
        }
        // The course has a least gain of its own, and limits how commands go on.
        let checks = Checks {
            min_gain: f64::NEG_INFINITY,
            round: false,
            ..settings.checks
        };
        let predicting = Predicting {
            loaded: &snapshot.loaded,
            album,
            settings,
            now,
        };
        let (ground, other) = match predicting.ground(&known, profile, &checks) {
            Ok(ground) => ground,
            Err(hold) => {
                let mut fields = hold.fields(Some(&known));
                predicting.tell(&mut fields);
                return Ok(fields);
            }
        };
        let objective = self.objective;
        let means = Means {
            profile,
            by: ground.by(),
            objective: &objective,
            checks: &checks,
        };
        let mut advice = suggestion::advise_known(&known, &means, other);
        if self.course.target().is_none() {
            stay_for_little(&mut advice, &known, &means, self.steering.min_gain);
        }
        let mut fields = suggestion::of_advice(&advice, &known, &self.objective)?;
        if let (Some(score), Some(score_here)) = (advice.score, advice.score_here) {
            let steered = self.steer(&known, &means, (&advice, score), now)?;
            fields.extend(steered.fields(&known, &means, score_here));
        }
        predicting.tell(&mut fields);
        Ok(fields)
    }

    fn steer(
        &mut self,
        known: &Known,
        means: &Means,
        (advice, score): (&Advice, f64),
        now: Moment,
    ) -> Result<Steered, WireError> {
        let predict = |candidate: Candidate, objective: &Objective| {
            let observation = &known.observation;
            predict_by(
                observation,
                &[candidate],
                means.profile,
                means.by,
                objective,
            )
        };
        let best = Candidate {
            distance_m: advice.distance_m,
            light_pct: advice.light_pct,
        };
        let current = Candidate {
            distance_m: known.observation.distance_m,
            light_pct: known.observation.light_pct,
        };
        let target_score = self
            .course
            .target()
            .and_then(|target| predict(target, &self.objective).ok())
            .map(|prediction| prediction.scores[0]);
        let command = self.course.step(
            &self.steering,
            now.since_start_s,
            current,
            (best, score),
            target_score,
        );
        let prediction = predict(command.command, &self.objective)?;
        Ok(Steered {
            command,
            prediction,
        })
    }
}

/// Without a target yet, a place that promises too little over staying becomes none.
fn stay_for_little(advice: &mut Advice, known: &Known, means: &Means, min_gain: f64) {
    let Some(gain) = advice.gain().filter(|gain| *gain <= min_gain) else {
        return;
    };
    let (observation, objective) = (&known.observation, means.objective);
    let inside = |[low, high]: [f64; 2], x: f64| (low..=high).contains(&x);
    let may_stay = inside(objective.distance_m, observation.distance_m)
        && inside(objective.light_pct, observation.light_pct);
    if !may_stay {
        return;
    }
    *advice = Advice {
        reason: Some(Reason::SmallGain {
            distance_m: advice.distance_m,
            light_pct: advice.light_pct,
            gain,
            min_gain,
        }),
        distance_m: observation.distance_m,
        light_pct: observation.light_pct,
        delta_distance_m: 0.0,
        delta_light_pct: 0.0,
        predicted_contrast: advice.predicted_here,
        score: advice.score_here,
        terms: advice.terms_here,
        physics: advice.physics.clone().map(|physics| PhysicalAdvice {
            error: physics.error_here,
            ..physics
        }),
        ..advice.clone()
    };
}

/// A command and what is predicted for it.
struct Steered {
    command: Command,
    prediction: Prediction,
}

impl Steered {
    fn fields(&self, known: &Known, means: &Means, score_here: f64) -> Fields {
        let Command {
            command,
            target,
            clamped,
            hold,
        } = self.command;
        let score = self.prediction.scores[0];
        // Commands go on in steps that may be smaller than what a vehicle keeps.
        let distance = |value_m: f64| rounded(value_m, DISTANCE_DECIMALS + 1);
        let light = |value_pct: f64| rounded(value_pct, LIGHT_DECIMALS + 1);
        let mut fields = reply::fields(json!({
            "action": if hold { "hold" } else { "move" },
            "distance_m": distance(command.distance_m),
            "light_pct": light(command.light_pct),
            "delta_distance_m": distance(command.distance_m - known.observation.distance_m),
            "delta_light_pct": light(command.light_pct - known.observation.light_pct),
            "predicted_contrast": suggestion::counts(self.prediction.contrast[0]),
            "score": suggestion::score(score),
            "gain": suggestion::score(score - score_here),
            "target": {
                "distance_m": distance(target.distance_m),
                "light_pct": light(target.light_pct),
            },
        }));
        if let (By::Physics(physical), Some(errors)) = (means.by, &self.prediction.errors) {
            let channels = physical.present.told();
            fields.extend(reply::fields(json!({
                "predicted_contrast": suggestion::told(self.prediction.contrast[0], channels),
                "predicted_contrast_error": suggestion::told(errors[0], channels),
            })));
        }
        if clamped {
            fields.insert("reason".to_owned(), "clamped".into());
            let message = "a rate limit keeps the command short of the target";
            fields.insert("message".to_owned(), message.into());
        }
        fields
    }
}

/// Steering with the fields of a request over it.
pub fn steering_with(configured: &Steering, overrides: &Object) -> Result<Steering, FieldError> {
    let mut steering = *configured;
    let fields: [(&str, &mut f64, bool); 5] = [
        ("min_gain", &mut steering.min_gain, true),
        (
            "distance_rate_m_per_s",
            &mut steering.distance_rate_m_per_s,
            false,
        ),
        (
            "light_rate_pct_per_s",
            &mut steering.light_rate_pct_per_s,
            false,
        ),
        (
            "distance_deadband_m",
            &mut steering.distance_deadband_m,
            true,
        ),
        ("light_deadband_pct", &mut steering.light_deadband_pct, true),
    ];
    let names: Vec<&str> = fields.iter().map(|field| field.0).collect();
    overrides.only(&names)?;
    for (name, field, zero_allowed) in fields {
        if overrides.get(name).is_none() {
            continue;
        }
        let value = overrides.number(name)?;
        if value < 0.0 || (value == 0.0 && !zero_allowed) {
            let expected = if zero_allowed { ">= 0" } else { "> 0" };
            return Err(FieldError::out_of_range(
                overrides.path_of(name),
                expected,
                value,
            ));
        }
        *field = value;
    }
    Ok(steering)
}

/// The error of a subscription that does not exist.
pub(super) fn none() -> WireError {
    WireError::new(
        Code::InvalidValue,
        "there is no subscription on this connection to end",
    )
    .at("op")
}
