//! Answers a recorded session again, without sockets and clocks, and compares bit for bit.

use std::collections::HashMap;
use std::sync::Arc;

use base64::Engine as _;
use serde_json::{Value, json};
use thiserror::Error;
use uw_calib::json::{FieldError, Object};
use uw_calib::{Processing, Profile, ProfileError};

use crate::checks::Checks;
use crate::feed::Picture;
use crate::observation::Quality;
use crate::record::{self, Item, Place, RECORD_FORMAT};
use crate::service::{Answered, Basis, Loaded, Moment, Service, Session, Settings};

/// Operations whose replies tell of the process rather than of the vehicle.
const NOT_COMPARED: [&str; 2] = ["health", "auth"];

/// Settings, by section, that a recording of an older program lacks; that did what [`as_recorded`] sets.
const NEWER_SETTINGS: [(&str, &str); 12] = [
    ("checks", "other_depth"),
    ("checks", "depth_margin_m"),
    ("checks", "noise_floor"),
    ("checks", "saturation"),
    ("checks", "max_saturated"),
    ("checks", "other_sun"),
    ("checks", "processing"),
    ("checks", "oblique"),
    ("checks", "max_obliqueness_deg"),
    ("images", "noise"),
    ("images", "mask"),
    ("images", "undistortion"),
];

/// Why a recording cannot be answered again.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// A piece of the recording is no record.
    #[error("{place}: {problem}")]
    Record {
        /// Where it stands.
        place: Place,
        /// What is wrong.
        problem: String,
    },
    /// Model, objective or settings are not those of the recording.
    #[error("{place}: {what} must be that of the recording ({recorded}), got {given}")]
    Other {
        /// Where it stands.
        place: Place,
        /// What differs.
        what: &'static str,
        /// In the recording.
        recorded: String,
        /// Now.
        given: String,
    },
}

/// What came of a replay.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Replies that are the same bit for bit.
    pub same: usize,
    /// Replies that are not compared.
    pub skipped: usize,
    /// Replies that differ: where they stand, the recorded and the new reply.
    pub different: Vec<(Place, String, String)>,
    /// What a full disk or a lost process has cut, and why it is no record.
    pub torn: Vec<(Place, String)>,
}

/// A record that is read.
enum Record {
    Loaded(Value),
    Answer(Box<Answer>),
}

/// Records with their place in the recording and among all uses of the shared state.
type Run = Vec<(Place, u64, Record)>;

struct Answer {
    connection: u64,
    now: Moment,
    elapsed_us: u64,
    /// `None` for a pushed message.
    line: Option<Vec<u8>>,
    reply: String,
}

/// Answers a recording, JSON or MCAP, again with this model or water file and these settings.
///
/// A recording holds one start of the daemon at least; each further start begins anew. Checks that a recording does
/// not name, because an older program made it, are not made.
pub fn replay(
    recording: &[u8],
    basis: &Basis,
    digest: &str,
    settings: &Settings,
) -> Result<Outcome, ReplayError> {
    let settings = Settings {
        token: None,
        ..settings.clone()
    };
    let mut outcome = Outcome::default();
    for run in runs(recording, &mut outcome)? {
        replay_run(run, basis, digest, &settings, &mut outcome)?;
    }
    Ok(outcome)
}

/// Records of each start of the daemon, in the order in which they used the shared state. What is torn is left out,
/// and with a torn start all that was answered after it.
fn runs(recording: &[u8], outcome: &mut Outcome) -> Result<Vec<Run>, ReplayError> {
    let mut runs: Vec<Run> = Vec::new();
    let mut started = false;
    let items = record::read(recording);
    let first = items.first().map_or(Place::Line(1), |(place, _)| *place);
    for (place, item) in items {
        let problem = |problem: String| ReplayError::Record { place, problem };
        let value = match item {
            Item::Record(value) => value,
            Item::Torn {
                problem,
                may_be_start,
            } => {
                outcome.torn.push((place, problem));
                started &= !may_be_start;
                continue;
            }
            Item::Wrong(wrong) => return Err(problem(wrong)),
        };
        let (kind, sequence, record) = read(&value).map_err(|error| problem(error.to_string()))?;
        if kind == "start" {
            runs.push(Vec::new());
            started = true;
        }
        match runs.last_mut().filter(|_| started) {
            Some(run) => run.push((place, sequence, record)),
            None if outcome.torn.is_empty() => {
                return Err(problem("a recording must begin with its start".to_owned()));
            }
            None => outcome.skipped += 1,
        }
    }
    if runs.is_empty() && !outcome.torn.is_empty() {
        let (place, problem) = outcome.torn.swap_remove(0);
        return Err(ReplayError::Record { place, problem });
    }
    if runs.is_empty() {
        return Err(ReplayError::Record {
            place: first,
            problem: "the recording is empty; it must begin with its start".to_owned(),
        });
    }
    for run in &mut runs {
        run.sort_by_key(|&(_, sequence, _)| sequence);
    }
    Ok(runs)
}

fn read(value: &Value) -> Result<(String, u64, Record), FieldError> {
    let object = Object::new(value, "")?;
    let whole = |name: &str| -> Result<u64, FieldError> {
        let value = object.required(name)?;
        value
            .as_u64()
            .ok_or_else(|| FieldError::wrong_type(name, "a whole number", value))
    };
    let kind = object.text("kind")?.to_owned();
    let record = match kind.as_str() {
        "start" | "reload" => {
            let format = object.text("format")?;
            if format != RECORD_FORMAT {
                let expected = format!("{RECORD_FORMAT:?}");
                return Err(FieldError::invalid("format", expected, format));
            }
            Record::Loaded(value.clone())
        }
        "request" | "push" => Record::Answer(Box::new(Answer {
            connection: whole("connection")?,
            now: Moment {
                since_start_s: object.number("since_start_s")?,
                unix_s: object.number("unix_s")?,
            },
            elapsed_us: whole("elapsed_us")?,
            line: read_line(&object)?,
            reply: object.text("reply")?.to_owned(),
        })),
        other => {
            let expected = "start, reload, request or push";
            return Err(FieldError::invalid("kind", expected, format!("{other:?}")));
        }
    };
    Ok((kind, whole("sequence")?, record))
}

fn read_line(object: &Object) -> Result<Option<Vec<u8>>, FieldError> {
    if object.get("line").is_some() {
        return Ok(Some(object.text("line")?.as_bytes().to_vec()));
    }
    if object.get("line_base64").is_none() {
        return Ok(None);
    }
    base64::engine::general_purpose::STANDARD
        .decode(object.text("line_base64")?)
        .map(Some)
        .map_err(|error| FieldError::invalid("line_base64", "base64", error))
}

fn replay_run(
    run: Run,
    basis: &Basis,
    digest: &str,
    settings: &Settings,
    outcome: &mut Outcome,
) -> Result<(), ReplayError> {
    let mut service: Option<Arc<Service>> = None;
    let mut sessions: HashMap<u64, Session> = HashMap::new();
    for (place, _, record) in run {
        match (record, &service) {
            (Record::Loaded(value), None) => {
                let loaded = load(place, &value, basis, digest)?;
                let settings = as_recorded(settings, &value["settings"]);
                let begun = Service::with_settings(loaded, settings);
                same_settings(place, &value, &begun)?;
                service = Some(Arc::new(begun));
            }
            (Record::Loaded(value), Some(service)) => {
                service.replace(load(place, &value, basis, digest)?);
            }
            (Record::Answer(answer), Some(service)) => {
                let session = sessions
                    .entry(answer.connection)
                    .or_insert_with(|| Session::new(Arc::clone(service)));
                compare(place, session, &answer, outcome);
            }
            (Record::Answer(_), None) => {
                let problem = "an answer before the start".to_owned();
                return Err(ReplayError::Record { place, problem });
            }
        }
    }
    Ok(())
}

fn compare(place: Place, session: &mut Session, answer: &Answer, outcome: &mut Outcome) {
    let reply: Value = serde_json::from_str(&answer.reply).unwrap_or(Value::Null);
    if reply["error"]["code"] == "unauthorised" {
        outcome.skipped += 1;
        return;
    }
    let answered = match &answer.line {
        None => session.push(answer.now),
        Some(request) => {
            let mut pending = session.read(request);
            if NOT_COMPARED.contains(&pending.op()) {
                outcome.skipped += 1;
                return;
            }
            if let ("suggest_image", Some(picture)) = (pending.op(), picture(&reply)) {
                pending = pending.with_picture(picture);
            }
            Some(session.answer(pending, answer.now))
        }
    };
    // Physics looks at the pixels again, which a file that has gone does not have.
    let lost = |answered: &Answered| answered.fault() == Some("bad_image");
    if answered.as_ref().is_some_and(lost) && reply["error"]["code"] != "bad_image" {
        outcome.skipped += 1;
        return;
    }
    let new = answered.map_or_else(String::new, |answered| answered.line(answer.elapsed_us));
    if new == answer.reply || is_same_of_older(reply, &new) {
        outcome.same += 1;
    } else {
        outcome.different.push((place, answer.reply.clone(), new));
    }
}

/// The statistics that the daemon measured then.
fn picture(reply: &Value) -> Option<Picture> {
    let reply = Object::new(reply, "").ok()?;
    let side = |name: &str| reply.get(name)?.as_u64()?.try_into().ok();
    Some(Picture {
        mean: reply.numbers("mean").ok()?,
        std: reply.numbers("std").ok()?,
        size_px: side("width").zip(side("height")).map(|(w, h)| [w, h]),
        quality: quality(&reply),
    })
}

/// None in replies of older programs.
fn quality(reply: &Object) -> Option<Quality> {
    let told = |name: &str| reply.get(name);
    Some(Quality {
        std_corrected: reply.numbers("std_corrected").ok()?,
        noise_floor: reply.numbers("noise_floor").ok()?,
        saturated: reply.numbers("saturated").ok()?,
        processing: Processing {
            jpeg_quality: told("jpeg_quality").and_then(|value| value.as_u64()?.try_into().ok()),
            noise_share: std::array::from_fn(|k| told("noise_share")?.get(k)?.as_f64()),
            // Asked by physics alone, which looks at the picture again.
            unknown_exposure: false,
        },
    })
}

fn load(place: Place, value: &Value, basis: &Basis, digest: &str) -> Result<Loaded, ReplayError> {
    let recorded = value["model_digest"].as_str().unwrap_or_default();
    if recorded != digest {
        return Err(ReplayError::Other {
            place,
            what: "the model or water file",
            recorded: format!("{} {recorded}", value["model"]),
            given: digest.to_owned(),
        });
    }
    let profile = match &value["profile"] {
        Value::Null => None,
        profile => Some(Profile::from_json(profile).map_err(|error: ProfileError| {
            ReplayError::Record {
                place,
                problem: error.to_string(),
            }
        })?),
    };
    Ok(Loaded {
        basis: basis.clone(),
        model_name: value["model"].as_str().unwrap_or_default().to_owned(),
        model_digest: digest.to_owned(),
        profile: profile.map(Arc::new),
    })
}

fn same_settings(place: Place, value: &Value, service: &Service) -> Result<(), ReplayError> {
    let given = service.describe(&service.loaded());
    for what in ["objective", "settings"] {
        if with_newer(value[what].clone(), &given[what]) != given[what] {
            return Err(ReplayError::Other {
                place,
                what,
                recorded: value[what].to_string(),
                given: given[what].to_string(),
            });
        }
    }
    Ok(())
}

/// The settings without the checks that the recorded ones do not name.
fn as_recorded(settings: &Settings, recorded: &Value) -> Settings {
    let mut settings = settings.clone();
    let (checks, none) = (&mut settings.checks, Checks::none());
    let lacks = |name: &str| recorded["checks"].get(name).is_none();
    if lacks("other_depth") {
        checks.other_depth = none.other_depth;
    }
    if lacks("noise_floor") {
        checks.noise_floor = none.noise_floor;
    }
    if lacks("other_sun") {
        checks.other_sun = none.other_sun;
    }
    if lacks("oblique") {
        checks.oblique = none.oblique;
    }
    if lacks("processing") {
        checks.processing = none.processing;
    }
    if lacks("saturation") {
        checks.saturation = none.saturation;
    }
    settings
}

/// Recorded settings with those of the given ones that an older program did not have.
fn with_newer(mut recorded: Value, given: &Value) -> Value {
    for (section, name) in NEWER_SETTINGS {
        let Some(value) = given[section].get(name) else {
            continue;
        };
        let Some(sections) = recorded.as_object_mut() else {
            break;
        };
        let fields = sections.entry(section).or_insert_with(|| json!({}));
        if let Some(fields) = fields.as_object_mut() {
            fields.entry(name).or_insert_with(|| value.clone());
        }
    }
    recorded
}

/// Whether a reply differs from the recorded one in nothing but what an older program did not know: settings in `info`,
/// and fields of requests, which the message about an unknown one lists.
fn is_same_of_older(mut recorded: Value, new: &str) -> bool {
    let Ok(new) = serde_json::from_str::<Value>(new) else {
        return false;
    };
    if let Some(settings) = recorded.get_mut("settings") {
        *settings = with_newer(settings.take(), &new["settings"]);
    } else if recorded["error"]["code"] == "unknown_field" {
        recorded["error"]["message"] = new["error"]["message"].clone();
    } else {
        return false;
    }
    recorded == new
}
