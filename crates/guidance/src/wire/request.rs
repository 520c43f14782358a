//! From a line to a request.

use serde_json::Value;
use uw_calib::Profile;
use uw_calib::ProfileError;
use uw_calib::json::{FieldError, Object, array, numbers};

use crate::features::Candidate;
use crate::wire::inputs::{self, Inputs};
use crate::wire::reply::{Code, WireError};

/// Most candidates of one `predict`, so that its reply stays below the line limit too.
pub const MAX_CANDIDATES: usize = 4096;
/// Fastest and slowest rate of a subscription, Hz.
pub const SUBSCRIPTION_RATES_HZ: [f64; 2] = [0.01, 100.0];

/// Names of all operations.
pub const OPS: [&str; 10] = [
    "suggest",
    "suggest_image",
    "predict",
    "state",
    "subscribe",
    "unsubscribe",
    "set_profile",
    "info",
    "health",
    "auth",
];

/// A request: the number or string the client gave it, and what it asks.
#[derive(Debug)]
pub struct Request {
    /// Repeated in the reply; null where the client gave none.
    pub id: Value,
    /// What is asked, or what is wrong with the line.
    pub op: Result<Op, WireError>,
}

/// What is asked. An objective is kept as it was sent: it lies over the one configured at the moment of
/// answering.
#[derive(Clone, Debug)]
pub enum Op {
    /// The best candidate.
    Suggest {
        /// What the vehicle says about its state.
        inputs: Inputs,
        /// Fields over the configured objective.
        objective: Option<Value>,
    },
    /// The best candidate, with the statistics taken from an image.
    SuggestImage {
        /// What the vehicle says about its state, without image statistics.
        inputs: Inputs,
        /// The image.
        image: ImageSource,
        /// Fields over the configured objective.
        objective: Option<Value>,
    },
    /// Contrast and score of given candidates.
    Predict {
        /// What the vehicle says about its state.
        inputs: Inputs,
        /// The candidates.
        candidates: Vec<Candidate>,
        /// Fields over the configured objective.
        objective: Option<Value>,
    },
    /// News of the vehicle's state, for all connections.
    State(Inputs),
    /// Suggestions from the latest state, from now on.
    Subscribe {
        /// How often, Hz.
        rate_hz: f64,
        /// Fields over the configured objective.
        objective: Option<Value>,
        /// Fields over the configured steering.
        steering: Option<Value>,
    },
    /// The end of the subscription.
    Unsubscribe,
    /// Another profile for this connection.
    SetProfile(Box<Profile>),
    /// Model, profile and objective in use.
    Info,
    /// Whether and how long the daemon runs.
    Health,
    /// The token that opens a guarded daemon.
    Auth(String),
}

impl Op {
    /// Its name on the wire.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Suggest { .. } => "suggest",
            Self::SuggestImage { .. } => "suggest_image",
            Self::Predict { .. } => "predict",
            Self::State(_) => "state",
            Self::Subscribe { .. } => "subscribe",
            Self::Unsubscribe => "unsubscribe",
            Self::SetProfile(_) => "set_profile",
            Self::Info => "info",
            Self::Health => "health",
            Self::Auth(_) => "auth",
        }
    }
}

/// Where the image of `suggest_image` is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ImageSource {
    /// A file on the daemon's machine.
    Path(String),
    /// The bytes of an image file in base64.
    Base64(String),
}

impl Request {
    /// Reads a line.
    pub fn parse(line: &[u8]) -> Self {
        let failed = |error| Self {
            id: Value::Null,
            op: Err(error),
        };
        let text = match std::str::from_utf8(line) {
            Ok(text) => text,
            Err(error) => {
                let message = format!("the line must be UTF-8: {error}");
                return failed(WireError::new(Code::BadUtf8, message));
            }
        };
        let value: Value = match serde_json::from_str(text) {
            Ok(value) => value,
            Err(error) => {
                let message = format!("the line must be one JSON object: {error}");
                return failed(WireError::new(Code::BadJson, message));
            }
        };
        let object = match Object::new(&value, "") {
            Ok(object) => object,
            Err(_) => {
                let message = "the line must be one JSON object, got another JSON value";
                return failed(WireError::new(Code::BadJson, message));
            }
        };
        match read_id(&object) {
            Ok(id) => Self {
                id,
                op: read_op(&object),
            },
            Err(error) => failed(error.into()),
        }
    }
}

fn read_id(object: &Object) -> Result<Value, FieldError> {
    match object.get("id") {
        None => Ok(Value::Null),
        Some(id @ (Value::Null | Value::Number(_) | Value::String(_))) => Ok(id.clone()),
        Some(other) => Err(FieldError::wrong_type("id", "a number or a string", other)),
    }
}

fn read_op(object: &Object) -> Result<Op, WireError> {
    let op = object.text("op")?;
    let only = |fields: &[&str]| {
        let known: Vec<&str> = ["op", "id"].iter().chain(fields).copied().collect();
        object.only(&known)
    };
    let state_and = |more: &[&'static str]| [&inputs::FIELDS[..], more].concat();
    match op {
        "suggest" => {
            only(&state_and(&["objective"]))?;
            Ok(Op::Suggest {
                inputs: Inputs::read(object)?,
                objective: overrides(object, "objective")?,
            })
        }
        "suggest_image" => {
            let mut known = state_and(&["image", "objective"]);
            let measured = [&["mean", "std"], &inputs::PICTURE_FIELDS[..]].concat();
            known.retain(|name| !measured.contains(name));
            only(&known)?;
            Ok(Op::SuggestImage {
                inputs: Inputs::read(object)?,
                image: read_image(object)?,
                objective: overrides(object, "objective")?,
            })
        }
        "predict" => {
            only(&state_and(&["candidates", "objective"]))?;
            Ok(Op::Predict {
                inputs: Inputs::read(object)?,
                candidates: read_candidates(object)?,
                objective: overrides(object, "objective")?,
            })
        }
        "state" => {
            only(&inputs::FIELDS)?;
            let inputs = Inputs::read(object)?;
            if inputs.is_empty() {
                let what = "state: one of depth_m, distance_m, distances_m, light_pct, level_pct, mean and std";
                return Err(FieldError::missing(what).into());
            }
            Ok(Op::State(inputs))
        }
        "subscribe" => {
            only(&["rate_hz", "objective", "steering"])?;
            Ok(Op::Subscribe {
                rate_hz: read_rate(object)?,
                objective: overrides(object, "objective")?,
                steering: overrides(object, "steering")?,
            })
        }
        "unsubscribe" => Ok(only(&[]).map(|()| Op::Unsubscribe)?),
        "set_profile" => {
            only(&["profile"])?;
            Ok(Op::SetProfile(Box::new(read_profile(object)?)))
        }
        "info" => Ok(only(&[]).map(|()| Op::Info)?),
        "health" => Ok(only(&[]).map(|()| Op::Health)?),
        "auth" => {
            only(&["token"])?;
            Ok(Op::Auth(object.text("token")?.to_owned()))
        }
        other => {
            let op: String = other.chars().take(40).collect();
            let message = format!("op must be one of {}, got {op:?}", OPS.join(", "));
            Err(WireError::new(Code::UnknownOp, message).at("op"))
        }
    }
}

/// An object of fields over configured ones; what they mean is checked when they are used.
fn overrides(object: &Object, name: &str) -> Result<Option<Value>, FieldError> {
    match object.get(name) {
        None => Ok(None),
        Some(value) => object.object(name).map(|_| Some(value.clone())),
    }
}

fn read_rate(object: &Object) -> Result<f64, FieldError> {
    let rate_hz = object.number("rate_hz")?;
    let [slowest, fastest] = SUBSCRIPTION_RATES_HZ;
    if (slowest..=fastest).contains(&rate_hz) {
        return Ok(rate_hz);
    }
    let expected = format!("from {slowest} to {fastest} Hz");
    Err(FieldError::out_of_range("rate_hz", expected, rate_hz))
}

fn read_image(object: &Object) -> Result<ImageSource, FieldError> {
    let image = object.object("image")?;
    image.only(&["path", "base64_png"])?;
    match (image.get("path"), image.get("base64_png")) {
        (Some(_), None) => Ok(ImageSource::Path(image.text("path")?.to_owned())),
        (None, Some(_)) => Ok(ImageSource::Base64(image.text("base64_png")?.to_owned())),
        (Some(_), Some(_)) => Err(FieldError::invalid(
            "image",
            "either path or base64_png",
            "both",
        )),
        (None, None) => Err(FieldError::invalid(
            "image",
            "either path or base64_png",
            "neither",
        )),
    }
}

fn read_candidates(object: &Object) -> Result<Vec<Candidate>, FieldError> {
    let items = array(object.required("candidates")?, "candidates")?;
    if items.is_empty() || items.len() > MAX_CANDIDATES {
        let expected = format!("1 to {MAX_CANDIDATES} pairs [distance_m, light_pct]");
        return Err(FieldError::out_of_range(
            "candidates",
            expected,
            items.len(),
        ));
    }
    let mut candidates = Vec::with_capacity(items.len());
    for (k, item) in items.iter().enumerate() {
        let path = format!("candidates[{k}]");
        let [distance_m, light_pct] = numbers(item, &path)?;
        if !(0.0..=100.0).contains(&light_pct) {
            let expected = "from 0 to 100 percent";
            return Err(FieldError::out_of_range(
                format!("{path}[1]"),
                expected,
                light_pct,
            ));
        }
        candidates.push(Candidate {
            distance_m,
            light_pct,
        });
    }
    Ok(candidates)
}

fn read_profile(object: &Object) -> Result<Profile, WireError> {
    Profile::from_json(object.required("profile")?).map_err(|error| match error {
        ProfileError::Field(field) => field.within("profile").into(),
        other => WireError::new(Code::InvalidValue, other.to_string()).at("profile"),
    })
}
