//! A suggestion with all that belongs to it: validity, reason, what to do, gain, ages, the surface seen.

use serde_json::{Value, json};
use uw_calib::Profile;

use crate::advice::{Advice, Prediction, Reason, advise};
use crate::beams::{BeamError, Plane};
use crate::feed::{Ages, MaxAge};
use crate::mlp::Model;
use crate::objective::Objective;
use crate::service::resolve::{Known, Unknown};
use crate::wire::reply::{self, Code, Fields, WireError};

/// Why the vehicle should hold although the question was a proper one.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Hold {
    /// Inputs are too old: their names.
    Stale(Vec<&'static str>),
    /// There is no calibration.
    NoProfile,
    /// An input was never given.
    Missing(&'static str),
    /// The beams give no distance.
    Beams(BeamError),
}

impl Hold {
    /// A short name for programs.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Stale(_) => "stale_input",
            Self::NoProfile => "no_profile",
            Self::Missing(_) => "missing_input",
            Self::Beams(BeamError::Disagree { .. }) => "beams_disagree",
            Self::Beams(_) => "no_range",
        }
    }

    fn message(&self) -> String {
        match self {
            Self::Stale(names) => format!("too old: {}", names.join(", ")),
            Self::NoProfile => "no calibration profile is loaded; send set_profile".to_owned(),
            Self::Missing(name) => format!("{name} was never given"),
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
            "distance_m": known.map(|k| k.observation.distance_m),
            "light_pct": known.map(|k| k.observation.light_pct),
            "delta_distance_m": 0.0,
            "delta_light_pct": 0.0,
            "predicted_contrast": null,
            "score": null,
            "score_here": null,
            "gain": null,
            "evaluations": 0,
            "age_s": known.map(|k| ages(&k.ages)),
        }));
        add_plane(&mut fields, known.and_then(|k| k.plane.as_ref()));
        fields
    }
}

/// What can be asked about: everything known, with a profile, and fresh enough.
pub(super) fn usable<'p>(
    known: &Known,
    profile: Option<&'p Profile>,
    max_age: &MaxAge,
) -> Result<&'p Profile, Hold> {
    let stale = known.ages.stale(max_age);
    if !stale.is_empty() {
        return Err(Hold::Stale(stale));
    }
    profile.ok_or(Hold::NoProfile)
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

/// The advice for what is known.
pub(super) fn suggest(
    known: &Known,
    profile: &Profile,
    model: &Model,
    objective: &Objective,
) -> Result<Fields, WireError> {
    let advice = advise(&known.observation, profile, model, objective);
    of_advice(&advice, known)
}

/// Advice as reply fields. An answer that holds no number for a lack of calibration is an error.
pub(super) fn of_advice(advice: &Advice, known: &Known) -> Result<Fields, WireError> {
    match &advice.reason {
        None | Some(Reason::Clamped { .. } | Reason::NotFinite) => {}
        Some(reason) => return Err(reason.clone().into()),
    }
    let valid = advice.valid();
    let mut fields = reply::fields(json!({
        "valid": valid,
        "action": if valid { "move" } else { "hold" },
        "reason": advice.reason.as_ref().map(Reason::name),
        "message": advice.reason.as_ref().map(Reason::to_string),
        "distance_m": advice.distance_m,
        "light_pct": advice.light_pct,
        "delta_distance_m": advice.delta_distance_m,
        "delta_light_pct": advice.delta_light_pct,
        "predicted_contrast": advice.predicted_contrast,
        "score": advice.score,
        "score_here": advice.score_here,
        "gain": advice.gain(),
        "evaluations": advice.evaluations,
        "age_s": ages(&known.ages),
    }));
    add_plane(&mut fields, known.plane.as_ref());
    Ok(fields)
}

/// A prediction as reply fields.
pub(super) fn prediction(prediction: &Prediction, known: &Known) -> Fields {
    let mut fields = reply::fields(json!({
        "valid": true,
        "reason": null,
        "contrast": prediction.contrast,
        "scores": prediction.scores,
        "age_s": ages(&known.ages),
    }));
    add_plane(&mut fields, known.plane.as_ref());
    fields
}

pub(super) fn ages(ages: &Ages) -> Value {
    json!({
        "depth": ages.depth_s,
        "distance": ages.distance_s,
        "light": ages.light_s,
        "image": ages.image_s,
    })
}

fn add_plane(fields: &mut Fields, plane: Option<&Plane>) {
    if let Some(plane) = plane {
        fields.insert("beams".to_owned(), describe_plane(plane));
    }
}

pub(super) fn describe_plane(plane: &Plane) -> Value {
    json!({
        "distance_m": plane.distance_m,
        "obliqueness_deg": plane.obliqueness_deg,
        "residual_m": plane.residual_m,
        "used": plane.beams,
    })
}
