//! From a line to a request.

use serde_json::Value;
use uw_calib::Profile;
use uw_calib::ProfileError;
use uw_calib::json::{FieldError, Object, array, numbers};

use crate::features::Candidate;
use crate::objective::Objective;
use crate::observation::Observation;
use crate::wire::reply::{Code, WireError};

/// Most candidates of one `predict`, so that its reply stays below the line limit too.
pub const MAX_CANDIDATES: usize = 4096;

const OPS: [&str; 6] = [
    "suggest",
    "suggest_image",
    "predict",
    "set_profile",
    "info",
    "health",
];
const STATE: [&str; 3] = ["depth_m", "distance_m", "light_pct"];

/// A request: the number or string the client gave it, and what it asks.
#[derive(Debug)]
pub struct Request {
    /// Repeated in the reply; null where the client gave none.
    pub id: Value,
    /// What is asked, or what is wrong with the line.
    pub op: Result<Op, WireError>,
}

/// What is asked.
#[derive(Clone, Debug)]
pub enum Op {
    /// The best candidate.
    Suggest {
        /// What the vehicle knows.
        observation: Observation,
        /// The objective, request fields over the configured ones.
        objective: Objective,
    },
    /// The best candidate, with the statistics taken from an image.
    SuggestImage {
        /// Depth, distance and lamp level; the statistics are still to be measured.
        state: State,
        /// The image.
        image: ImageSource,
        /// The objective.
        objective: Objective,
    },
    /// Contrast and score of given candidates.
    Predict {
        /// What the vehicle knows.
        observation: Observation,
        /// The candidates.
        candidates: Vec<Candidate>,
        /// The objective.
        objective: Objective,
    },
    /// Another profile for this connection.
    SetProfile(Box<Profile>),
    /// Model, profile and objective in use.
    Info,
    /// Whether and how long the daemon runs.
    Health,
}

/// Depth, distance and lamp level without image statistics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Depth, m.
    pub depth_m: f64,
    /// Distance, m.
    pub distance_m: f64,
    /// Lamp level, percent.
    pub light_pct: f64,
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
    /// Reads a line; `objective` holds where the request does not say otherwise.
    pub fn parse(line: &[u8], objective: &Objective) -> Self {
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
                op: read_op(&object, objective),
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

fn read_op(object: &Object, default: &Objective) -> Result<Op, WireError> {
    let op = object.text("op")?;
    let only = |fields: &[&str]| {
        let known: Vec<&str> = ["op", "id"].iter().chain(fields).copied().collect();
        object.only(&known)
    };
    match op {
        "suggest" => {
            only(&[&STATE[..], &["mean", "std", "objective"]].concat())?;
            let observation = read_observation(object)?;
            Ok(Op::Suggest {
                observation,
                objective: read_objective(object, default)?,
            })
        }
        "suggest_image" => {
            only(&[&STATE[..], &["image", "objective"]].concat())?;
            let (state, image) = (read_state(object)?, read_image(object)?);
            Ok(Op::SuggestImage {
                state,
                image,
                objective: read_objective(object, default)?,
            })
        }
        "predict" => {
            only(&[&STATE[..], &["mean", "std", "candidates", "objective"]].concat())?;
            let observation = read_observation(object)?;
            let candidates = read_candidates(object)?;
            let objective = read_objective(object, default)?;
            Ok(Op::Predict {
                observation,
                candidates,
                objective,
            })
        }
        "set_profile" => {
            only(&["profile"])?;
            Ok(Op::SetProfile(Box::new(read_profile(object)?)))
        }
        "info" => only(&[]).map(|()| Op::Info).map_err(WireError::from),
        "health" => only(&[]).map(|()| Op::Health).map_err(WireError::from),
        other => {
            let op: String = other.chars().take(40).collect();
            let message = format!("op must be one of {}, got {op:?}", OPS.join(", "));
            Err(WireError::new(Code::UnknownOp, message).at("op"))
        }
    }
}

fn read_state(object: &Object) -> Result<State, FieldError> {
    Ok(State {
        depth_m: object.number("depth_m")?,
        distance_m: object.number("distance_m")?,
        light_pct: object.number("light_pct")?,
    })
}

fn read_observation(object: &Object) -> Result<Observation, FieldError> {
    let State {
        depth_m,
        distance_m,
        light_pct,
    } = read_state(object)?;
    Ok(Observation {
        depth_m,
        distance_m,
        light_pct,
        mean: object.numbers("mean")?,
        std: object.numbers("std")?,
    })
}

fn read_objective(object: &Object, default: &Objective) -> Result<Objective, FieldError> {
    match object.get("objective") {
        None => Ok(*default),
        Some(_) => default.with(&object.object("objective")?),
    }
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
