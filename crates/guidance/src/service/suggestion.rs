//! A suggestion with all that belongs to it: validity, reason, what to do, gain, ages, the surface seen.

use serde_json::{Value, json};
use uw_calib::Profile;

use crate::advice::{Advice, By, PhysicalAdvice, Prediction, Reason, advise_by};
use crate::beams::{BeamError, Plane};
use crate::checks::{Checks, Strictness};
use crate::feed::{Ages, MaxAge};
use crate::mlp::Model;
use crate::objective::{Form, Objective, Terms};
use crate::service::album::{Album, Seen};
use crate::service::resolve::{Known, Unknown};
use crate::service::why::why;
use crate::service::{Basis, Loaded, Moment, Settings, fit};
use crate::wire::reply::{
    self, AGE_DECIMALS, COUNTS_DECIMALS, Code, DISTANCE_DECIMALS, Fields, LIGHT_DECIMALS,
    SCORE_DECIMALS, WireError, rounded,
};

/// Why the vehicle should hold although the question was a proper one.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Hold {
    /// Inputs are too old: their names.
    Stale(Vec<&'static str>),
    /// An input was never given.
    Missing(&'static str),
    /// The beams give no distance.
    Beams(BeamError),
    /// There is no profile, picture, profile and model or water file are not of one camera, or the sun is not theirs.
    NotMadeFor(Reason),
    /// The picture that physics predicts from was taken at another depth.
    OtherDepth {
        /// Where it was taken, m.
        taken_m: f64,
        /// Where the vehicle is, m.
        depth_m: f64,
    },
}

impl Hold {
    /// A short name for programs.
    pub fn name(&self) -> &'static str {
        match self {
            Self::NotMadeFor(reason) => reason.name(),
            Self::Stale(_) | Self::OtherDepth { .. } => "stale_input",
            Self::Missing(_) => "missing_input",
            Self::Beams(BeamError::Disagree { .. }) => "beams_disagree",
            Self::Beams(_) => "no_range",
        }
    }

    fn message(&self) -> String {
        match self {
            Self::Stale(names) => format!("too old: {}", names.join(", ")),
            Self::NotMadeFor(reason) => reason.to_string(),
            Self::Missing("image") => {
                "physics predicts from a picture, and none was given on this connection: send suggest_image".to_owned()
            }
            Self::Missing(name) => format!("{name} was never given"),
            Self::OtherDepth { taken_m, depth_m } => format!(
                "the picture was taken {taken_m} m deep, the vehicle is {depth_m} m deep: another daylight; send another picture"
            ),
            Self::Beams(error) => error.to_string(),
        }
    }

    /// The reply's fields: no number but what is known.
    pub fn fields(&self, known: Option<&Known>) -> Fields {
        let mut fields = reply::fields(json!({
            "valid": false,
            "action": "hold",
            "reason": self.name(),
            "message": self.message(),
            "why": self.message(),
            "warnings": [],
            "distance_m": known.map(|k| k.observation.distance_m),
            "light_pct": known.map(|k| k.observation.light_pct),
            "delta_distance_m": 0.0,
            "delta_light_pct": 0.0,
            "predicted_contrast": null,
            "predicted_here": null,
            "residual_here": null,
            "score": null,
            "score_here": null,
            "gain": null,
            "score_terms": null,
            "evaluations": 0,
            "age_s": known.map(|k| ages(&k.ages)),
        }));
        add_plane(&mut fields, known.and_then(|k| k.plane.as_ref()));
        fields
    }
}

/// Whether a question can be asked: everything is known and fresh enough, with a profile where one is needed.
pub(super) fn usable(
    known: &Known,
    (profile, basis): (Option<&Profile>, &Basis),
    objective: &Objective,
    max_age: &MaxAge,
) -> Result<(), Hold> {
    let stale = known.ages.stale(max_age);
    if !stale.is_empty() {
        return Err(Hold::Stale(stale));
    }
    match (profile, basis.needs_profile(objective)) {
        (None, Some(needs)) => Err(Hold::NotMadeFor(Reason::NoProfile(needs))),
        _ => Ok(()),
    }
}

/// An unknown observation as a reply: a fault of the request is an error, a fault of the sensors a hold.
pub(super) fn unknown(unknown: Unknown) -> Result<Fields, WireError> {
    match unknown {
        Unknown::Field(error) => Err(error.into()),
        Unknown::Missing(name) => {
            let message = format!("{name} is missing, and no state with it was given before");
            let error = WireError::new(Code::MissingField, message).at(name);
            Err(error.because(Hold::Missing(name).name()))
        }
        Unknown::Beams(error) => Ok(Hold::Beams(error).fields(None)),
    }
}

/// What a question is answered with.
#[derive(Clone, Copy)]
pub(super) struct Means<'a> {
    pub profile: Option<&'a Profile>,
    pub by: By<'a>,
    pub objective: &'a Objective,
    pub checks: &'a Checks,
}

/// What contrast is predicted from at a moment.
pub(super) struct Predicting<'a> {
    pub loaded: &'a Loaded,
    pub album: &'a Album,
    pub settings: &'a Settings,
    pub now: Moment,
}

/// What a question is answered from: the network, or the picture with which physics does.
pub(super) enum Ground<'a> {
    Network(&'a Model),
    Physics(Seen),
}

impl Ground<'_> {
    pub fn by(&self) -> By<'_> {
        match self {
            Self::Network(model) => By::Network(model),
            Self::Physics(seen) => seen.by(),
        }
    }
}

impl<'a> Predicting<'a> {
    /// What the question is answered from, and warnings where profile and model are not of one camera or the sun is not theirs.
    pub fn ground(
        &self,
        known: &Known,
        profile: Option<&Profile>,
        checks: &Checks,
    ) -> Result<(Ground<'a>, Vec<Reason>), Hold> {
        let (ground, other) = match &self.loaded.basis {
            Basis::Network(model) => {
                let other =
                    profile.and_then(|profile| fit::other_camera(known.size_px, profile, model));
                (Ground::Network(model), other)
            }
            Basis::Physics(water) => {
                // Tables and patches are those of its pictures.
                if let Some(reason) = fit::other_sensor(known.size_px, water) {
                    return Err(Hold::NotMadeFor(reason));
                }
                let digest = &self.loaded.model_digest;
                let seen = self
                    .album
                    .seen(known, digest, &self.settings.max_age, self.now)?;
                let other = profile.and_then(|profile| fit::other_profile(profile, water.file()));
                (Ground::Physics(seen), other)
            }
        };
        let vehicle = &self.settings.vehicle;
        let other = other.or_else(|| fit::other_vehicle(vehicle, &self.loaded.basis, profile));
        let sun = fit::other_sun(known.sun, &self.loaded.basis);
        let plane = known.plane.as_ref();
        let oblique = checks.oblique(plane.and_then(|plane| plane.obliqueness_deg));
        let mut warnings = Vec::new();
        let found = [
            (checks.other_camera, other),
            (checks.other_sun, sun),
            (checks.oblique, oblique),
        ];
        for (strictness, other) in found {
            match (strictness, other) {
                (Strictness::Refuse, Some(reason)) => return Err(Hold::NotMadeFor(reason)),
                (Strictness::Warn, other) => warnings.extend(other),
                _ => {}
            }
        }
        Ok((ground, warnings))
    }

    /// Says in a reply what its numbers are from, where that is to be said.
    pub fn tell(&self, fields: &mut Fields) {
        if self.settings.tell_predictor || matches!(self.loaded.basis, Basis::Physics(_)) {
            fields.insert("predictor".to_owned(), self.loaded.basis.name().into());
        }
    }
}

/// The advice for what is known.
pub(super) fn suggest(
    known: &Known,
    predicting: &Predicting,
    profile: Option<&Profile>,
    (objective, checks): (&Objective, &Checks),
) -> Result<Fields, WireError> {
    let mut fields = match predicting.ground(known, profile, checks) {
        Err(hold) => hold.fields(Some(known)),
        Ok((ground, other)) => {
            let means = Means {
                profile,
                by: ground.by(),
                objective,
                checks,
            };
            of_advice(&advise_known(known, &means, other), known, objective)?
        }
    };
    predicting.tell(&mut fields);
    Ok(fields)
}

/// The advice for what is known, with warnings of before.
pub(super) fn advise_known(known: &Known, means: &Means, warnings: Vec<Reason>) -> Advice {
    let mut advice = advise_by(
        &known.observation,
        means.profile,
        means.by,
        means.objective,
        means.checks,
    );
    advice.warnings.extend(warnings);
    advice
}

/// Advice as reply fields. An answer that holds no number for a lack of calibration is an error.
pub(super) fn of_advice(
    advice: &Advice,
    known: &Known,
    objective: &Objective,
) -> Result<Fields, WireError> {
    if let Some(reason @ (Reason::OutsideCalibration { .. } | Reason::NoCandidates { .. })) =
        &advice.reason
    {
        return Err(reason.clone().into());
    }
    let (distance_m, light_pct) = match advice.moves() {
        true => (
            rounded(advice.distance_m, DISTANCE_DECIMALS),
            rounded(advice.light_pct, LIGHT_DECIMALS),
        ),
        // The vehicle's own, as it gave them.
        false => (advice.distance_m, advice.light_pct),
    };
    let mut fields = reply::fields(json!({
        "valid": advice.valid(),
        "action": if advice.moves() { "move" } else { "hold" },
        "reason": advice.reason.as_ref().map(Reason::name),
        "message": advice.reason.as_ref().map(Reason::to_string),
        "why": why(advice, objective),
        "warnings": advice.warnings.iter().map(warning).collect::<Vec<_>>(),
        "distance_m": distance_m,
        "light_pct": light_pct,
        "delta_distance_m": rounded(advice.delta_distance_m, DISTANCE_DECIMALS),
        "delta_light_pct": rounded(advice.delta_light_pct, LIGHT_DECIMALS),
        "predicted_contrast": advice.predicted_contrast.map(counts),
        "predicted_here": advice.predicted_here.map(counts),
        "residual_here": advice.residual_here.map(|residual| json!({
            "contrast": counts(residual.counts),
            "misfit": rounded(residual.misfit, COUNTS_DECIMALS),
        })),
        "score": advice.score.map(score),
        "score_here": advice.score_here.map(score),
        "gain": advice.gain().map(score),
        "score_terms": terms(advice, objective),
        "evaluations": advice.evaluations,
        "age_s": ages(&known.ages),
    }));
    if let Some(physics) = &advice.physics {
        fields.extend(physical(advice, physics));
    }
    add_plane(&mut fields, known.plane.as_ref());
    Ok(fields)
}

/// What advice by physics tells besides or in another way: channels that are not told are null.
fn physical(advice: &Advice, physics: &PhysicalAdvice) -> Fields {
    let told = |counts: Option<[f64; 3]>| counts.map(|counts| told(counts, physics.told));
    reply::fields(json!({
        "predicted_contrast": told(advice.predicted_contrast),
        "predicted_contrast_error": told(physics.error),
        "predicted_here": told(advice.predicted_here),
        "predicted_here_error": told(physics.error_here),
        "earlier_m": physics.earlier_m.iter().map(|&m| rounded(m, DISTANCE_DECIMALS)).collect::<Vec<_>>(),
        "residual_here": physics.residual.map(|residual| json!({
            "contrast": residual.counts.map(some_counts),
            "standard_error": counts(residual.error_counts),
            "mean": residual.brightness.map(|mean| mean.counts.map(some_counts)),
            "mean_standard_error": residual.brightness.map(|mean| counts(mean.error_counts)),
            "same_part": residual.brightness.map(|mean| mean.same_part),
            "misfit": rounded(residual.misfit, COUNTS_DECIMALS),
            "from": residual.from.name(),
        })),
    }))
}

fn some_counts(counts: Option<f64>) -> Option<f64> {
    counts.map(|counts| rounded(counts, COUNTS_DECIMALS))
}

/// Counts, rounded; null for channels that are not told.
pub(super) fn told(counts: [f64; 3], told: [bool; 3]) -> [Option<f64>; 3] {
    std::array::from_fn(|k| told[k].then(|| rounded(counts[k], COUNTS_DECIMALS)))
}

fn warning(reason: &Reason) -> Value {
    json!({"reason": reason.name(), "message": reason.to_string()})
}

/// What the scores are made of: the terms of a sum, or the factors of a product.
fn terms(advice: &Advice, objective: &Objective) -> Value {
    let names = match objective.form {
        Form::Sum => ["contrast", "distance"],
        Form::Overlap => ["visibility", "overlap"],
    };
    let told = |terms: Option<Terms>| {
        terms.map(|terms| json!({names[0]: score(terms.contrast), names[1]: score(terms.distance)}))
    };
    match (told(advice.terms), told(advice.terms_here)) {
        (Some(suggested), Some(here)) => json!({"suggested": suggested, "here": here}),
        _ => Value::Null,
    }
}

pub(super) fn counts(contrast: [f64; 3]) -> [f64; 3] {
    contrast.map(|value| rounded(value, COUNTS_DECIMALS))
}

pub(super) fn score(score: f64) -> f64 {
    rounded(score, SCORE_DECIMALS)
}

/// A prediction as reply fields; not valid where there is a doubt about it.
pub(super) fn prediction(
    prediction: &Prediction,
    doubt: Option<&Reason>,
    known: &Known,
    by: By,
) -> Fields {
    let mut fields = reply::fields(json!({
        "valid": doubt.is_none(),
        "reason": doubt.map(Reason::name),
        "contrast": prediction.contrast.iter().map(|&c| counts(c)).collect::<Vec<_>>(),
        "scores": prediction.scores.iter().map(|&s| score(s)).collect::<Vec<_>>(),
        "age_s": ages(&known.ages),
    }));
    if let Some(doubt) = doubt {
        fields.insert("action".to_owned(), "hold".into());
        fields.insert("message".to_owned(), doubt.to_string().into());
    }
    if let (By::Physics(physical), Some(errors)) = (by, &prediction.errors) {
        let channels = physical.present.told();
        let of = |rows: &[[f64; 3]]| -> Vec<_> {
            rows.iter().map(|&counts| told(counts, channels)).collect()
        };
        fields.extend(reply::fields(json!({
            "contrast": of(&prediction.contrast),
            "contrast_error": of(errors),
        })));
    }
    add_plane(&mut fields, known.plane.as_ref());
    fields
}

pub(super) fn ages(ages: &Ages) -> Value {
    let age = |age_s: f64| rounded(age_s, AGE_DECIMALS);
    json!({
        "depth": age(ages.depth_s),
        "distance": age(ages.distance_s),
        "light": age(ages.light_s),
        "image": age(ages.image_s),
    })
}

fn add_plane(fields: &mut Fields, plane: Option<&Plane>) {
    if let Some(plane) = plane {
        fields.insert("beams".to_owned(), describe_plane(plane));
    }
}

pub(super) fn describe_plane(plane: &Plane) -> Value {
    let millimetres = |length_m: f64| rounded(length_m, DISTANCE_DECIMALS + 1);
    json!({
        "distance_m": millimetres(plane.distance_m),
        "obliqueness_deg": plane.obliqueness_deg.map(|angle| rounded(angle, 1)),
        "residual_m": plane.residual_m.map(millimetres),
        "used": plane.beams,
    })
}
