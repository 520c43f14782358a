//! A running `uwguide` that is asked over its wire protocol.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Duration;

use serde_json::{Map, Value, json};
use uw_calib::Profile;
use uw_guidance::objective::{ContrastTerm, DepthTerm};
use uw_guidance::{Objective, Observation};

use super::answer::{Answer, ScoreMap, common_distances, map_candidates};
use crate::ui::toasts::Toasts;

/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(5);
/// Longest line of a reply, as the protocol says.
const MOST_BYTES: u64 = 1 << 20;

/// The daemon as the panel sees it.
#[derive(Debug)]
pub struct Link {
    /// Host and port.
    pub address: String,
    /// What is known about it.
    pub state: String,
    answer: Option<Receiver<Result<(Answer, String), String>>>,
}

impl Default for Link {
    fn default() -> Self {
        Self {
            address: "127.0.0.1:7475".to_owned(),
            state: "not asked yet".to_owned(),
            answer: None,
        }
    }
}

impl Link {
    /// The daemon at this host and port.
    pub fn to(address: String) -> Self {
        Self {
            address,
            ..Self::default()
        }
    }

    /// Whether an answer is waited for.
    pub fn is_waiting(&self) -> bool {
        self.answer.is_some()
    }

    /// Asks for a suggestion and a map of scores; with a profile, in its water. `size_px` are width and height of the picture
    /// that was measured, where they are known.
    pub fn ask(
        &mut self,
        now: Observation,
        size_px: Option<[u32; 2]>,
        profile: Option<Arc<Profile>>,
        objective: Objective,
        wake: impl Fn() + Send + 'static,
    ) {
        let (sender, receiver) = channel();
        let address = self.address.clone();
        let spawned = std::thread::Builder::new()
            .name("uwguide".to_owned())
            .spawn(move || {
                let answer = ask(&address, &now, size_px, profile.as_deref(), &objective)
                    .map_err(|reason| format!("uwguide at {address}: {reason}"));
                // Without a listener the window has closed.
                let _ = sender.send(answer);
                wake();
            });
        match spawned {
            Ok(_) => {
                self.answer = Some(receiver);
                self.state = "asking".to_owned();
            }
            Err(error) => self.state = format!("cannot ask now: {error}"),
        }
    }

    /// The answer, once it is there.
    pub fn poll(&mut self, toasts: &mut Toasts) -> Option<Answer> {
        let received = match self.answer.as_ref()?.try_recv() {
            Ok(received) => received,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err("the question was lost".to_owned()),
        };
        self.answer = None;
        match received {
            Ok((answer, state)) => {
                self.state = state;
                Some(answer)
            }
            Err(message) => {
                toasts.error(format!(
                    "{message}\nStart one with `uwguide --model MODEL.json --profile PROFILE.json`, or use the library."
                ));
                self.state = message;
                None
            }
        }
    }
}

/// A conversation: one line out, one line in.
struct Conversation {
    out: TcpStream,
    back: BufReader<TcpStream>,
}

impl Conversation {
    fn begin(address: &str) -> Result<Self, String> {
        let mut addresses = address
            .to_socket_addrs()
            .map_err(|e| format!("the address must be HOST:PORT, such as 127.0.0.1:7475 ({e})"))?;
        let first = addresses.next().ok_or("the host has no address")?;
        let stream = TcpStream::connect_timeout(&first, PATIENCE).map_err(|e| e.to_string())?;
        let set = stream
            .set_read_timeout(Some(PATIENCE))
            .and_then(|()| stream.set_write_timeout(Some(PATIENCE)))
            .and_then(|()| stream.try_clone());
        let back = BufReader::new(set.map_err(|e| e.to_string())?);
        Ok(Self { out: stream, back })
    }

    fn ask(&mut self, request: &Value) -> Result<Map<String, Value>, String> {
        let line = format!("{request}\n");
        self.out
            .write_all(line.as_bytes())
            .map_err(|e| e.to_string())?;
        let mut reply = String::new();
        let read = (&mut self.back).take(MOST_BYTES).read_line(&mut reply);
        if read.map_err(|e| e.to_string())? == 0 {
            return Err("it closed the connection".to_owned());
        }
        let reply: Value = serde_json::from_str(&reply)
            .map_err(|e| format!("the reply is not JSON ({e}); is it a uwguide?"))?;
        let Value::Object(reply) = reply else {
            return Err("the reply is no object; is it a uwguide?".to_owned());
        };
        if reply.get("ok") == Some(&Value::Bool(true)) {
            return Ok(reply);
        }
        let message = reply.get("error").and_then(|e| e.get("message"));
        Err(message
            .and_then(Value::as_str)
            .unwrap_or("it refused without a reason")
            .to_owned())
    }
}

fn ask(
    address: &str,
    now: &Observation,
    size_px: Option<[u32; 2]>,
    profile: Option<&Profile>,
    objective: &Objective,
) -> Result<(Answer, String), String> {
    let mut talk = Conversation::begin(address)?;
    if let Some(profile) = profile {
        let profile: Value = serde_json::from_str(&profile.to_json()).map_err(|e| e.to_string())?;
        talk.ask(&json!({"op": "set_profile", "id": 1, "profile": profile}))?;
    }
    let info = talk.ask(&json!({"op": "info", "id": 2}))?;
    let contrast = match objective.contrast {
        ContrastTerm::Sum => "sum",
        ContrastTerm::Mean => "mean",
    };
    let depth_term = match objective.depth_term {
        DepthTerm::Z => "z",
        DepthTerm::OnePlusHalfZ => "1+z/2",
    };
    let request = |op: &str, id: u32| {
        json!({
            "op": op, "id": id, "depth_m": now.depth_m, "distance_m": now.distance_m,
            "light_pct": now.light_pct, "mean": now.mean, "std": now.std,
            "objective": {
                "lambda_c": objective.lambda_c, "lambda_d": objective.lambda_d,
                "kappa_b": objective.kappa_b, "kappa_c": objective.kappa_c,
                "contrast": contrast, "contrast_scale": objective.contrast_scale,
                "depth_term": depth_term,
                "distance_m": objective.distance_m, "light_pct": objective.light_pct,
            },
        })
    };
    let mut suggest = request("suggest", 3);
    if let Some([width, height]) = size_px {
        suggest["width"] = width.into();
        suggest["height"] = height.into();
    }
    let reply = talk.ask(&suggest)?;
    let mut answer = read_suggestion(now, &reply)?;
    if let Some(distance_m) = profile.and_then(|p| common_distances(p, objective, None)) {
        let mut map = request("predict", 4);
        let mut candidates: Vec<[f64; 2]> = map_candidates(distance_m, objective.light_pct)
            .iter()
            .map(|c| [c.distance_m, c.light_pct])
            .collect();
        candidates.push([now.distance_m, now.light_pct]);
        map["candidates"] = json!(candidates);
        let reply = talk.ask(&map)?;
        let mut scores = numbers(&reply, "scores")?;
        scores.pop();
        let last = |field: &str| reply.get(field)?.as_array()?.last().and_then(triple);
        answer.predicted_here = last("contrast");
        answer.errors[1] = last("contrast_error");
        answer.map = Some(ScoreMap {
            distance_m,
            light_pct: objective.light_pct,
            scores,
        });
    }
    let by = |kind: &str| {
        let named = info.get(kind).filter(|value| !value.is_null())?;
        Some(format!("{kind} {}", summary(named)))
    };
    let by = by("model").or_else(|| by("water")).unwrap_or_default();
    Ok((answer, format!("answered; {by}")))
}

/// The name in what `info` says about model or water.
fn summary(model: &Value) -> String {
    let name = ["file", "path", "name", "digest", "sha256"]
        .iter()
        .find_map(|field| model.get(field)?.as_str());
    name.or(model.as_str()).unwrap_or("unnamed").to_owned()
}

/// An answer from the reply to `suggest`, or from a recorded one.
pub(super) fn read_suggestion(
    now: &Observation,
    reply: &Map<String, Value>,
) -> Result<Answer, String> {
    let number = |field: &str| reply.get(field).and_then(Value::as_f64);
    let needed = |field: &str| number(field).ok_or_else(|| format!("the reply has no {field}"));
    let whole = |field: &str| reply.get(field).and_then(Value::as_u64).unwrap_or(0);
    let words = |value: Option<&Value>| value.and_then(Value::as_str).map(str::to_owned);
    let warnings = reply.get("warnings").and_then(Value::as_array).into_iter();
    let valid = reply.get("valid").and_then(Value::as_bool).unwrap_or(false);
    Ok(Answer {
        observation: *now,
        question: None,
        distance_m: needed("distance_m")?,
        light_pct: needed("light_pct")?,
        valid,
        moves: words(reply.get("action")).map_or(valid, |action| action == "move"),
        reason: words(reply.get("reason")).map(|name| words(reply.get("message")).unwrap_or(name)),
        warnings: warnings
            .flatten()
            .filter_map(|w| words(w.get("message")))
            .collect(),
        misfit: reply
            .get("residual_here")
            .and_then(|r| r.get("misfit")?.as_f64()),
        score: number("score"),
        score_here: number("score_here"),
        predicted: reply.get("predicted_contrast").and_then(told),
        predicted_here: reply.get("predicted_here").and_then(told),
        errors: ["predicted_contrast_error", "predicted_here_error"]
            .map(|field| reply.get(field).and_then(told)),
        earlier_m: numbers(reply, "earlier_m").unwrap_or_default(),
        evaluations: whole("evaluations") as usize,
        steps: Vec::new(),
        map: None,
    })
}

pub(super) fn triple(value: &Value) -> Option<[f64; 3]> {
    let values: Vec<f64> = value.as_array()?.iter().filter_map(Value::as_f64).collect();
    values.try_into().ok()
}

/// Counts of the channels, NaN where physics tells nothing.
fn told(value: &Value) -> Option<[f64; 3]> {
    let channel = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let values: Vec<f64> = value.as_array()?.iter().map(channel).collect();
    values.try_into().ok()
}

fn numbers(reply: &Map<String, Value>, field: &str) -> Result<Vec<f64>, String> {
    let values = reply.get(field).and_then(Value::as_array);
    let values = values.ok_or_else(|| format!("the reply has no {field}"))?;
    // A score that is no number comes as null.
    Ok(values
        .iter()
        .map(|v| v.as_f64().unwrap_or(f64::NAN))
        .collect())
}
