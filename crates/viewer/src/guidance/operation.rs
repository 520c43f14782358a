//! A recorded operation: the file that `uwguide` writes where `operations.record` names it, and `uwguide replay` answers again.

use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Map, Value};
use uw_guidance::Observation;
use uw_guidance::record::{self, Item, Place, RECORD_FORMAT};

use super::answer::Answer;
use super::daemon::{read_suggestion, triple};

/// Time between steps while it plays.
const STEP_TIME: Duration = Duration::from_millis(700);
/// Largest recording that is read, bytes.
const MOST_BYTES: u64 = 256 << 20;

/// A recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum OperationError {
    /// The system refused.
    #[error("{path}: cannot be read: {source}")]
    Unreadable {
        /// The file.
        path: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// It is larger than a recording can sensibly be.
    #[error("{path}: must be at most {MOST_BYTES} bytes, got {bytes}")]
    TooLarge {
        /// The file.
        path: String,
        /// Its size.
        bytes: u64,
    },
    /// A piece of it is no record.
    #[error("{path}: {place}: {problem}")]
    Record {
        /// The file.
        path: String,
        /// Where it stands.
        place: Place,
        /// What is wrong.
        problem: String,
    },
    /// There is no suggestion in it.
    #[error(
        "{path}: holds no suggestion with its state; record one: `operations.record` in the configuration of uwguide"
    )]
    Empty {
        /// The file.
        path: String,
    },
}

/// A suggestion with the state it was given for.
#[derive(Clone, Debug)]
pub struct Step {
    /// Time since the daemon started, s.
    pub since_start_s: f64,
    /// State and suggestion.
    pub answer: Answer,
}

/// A recorded operation.
#[derive(Clone, Debug)]
pub struct Operation {
    /// Name of the file.
    pub name: String,
    /// The suggestions.
    pub steps: Vec<Step>,
    /// The one that is shown.
    pub at: usize,
    playing: Option<Instant>,
}

impl Operation {
    /// Reads a recording.
    ///
    /// # Errors
    /// What is wrong, with its line.
    pub fn read(path: &Path) -> Result<Self, OperationError> {
        let name = path.display().to_string();
        let unreadable = |source| OperationError::Unreadable {
            path: name.clone(),
            source,
        };
        let bytes = std::fs::metadata(path).map_err(unreadable)?.len();
        if bytes > MOST_BYTES {
            return Err(OperationError::TooLarge { path: name, bytes });
        }
        let recording = std::fs::read(path).map_err(unreadable)?;
        let steps = steps(&recording, &name)?;
        Ok(Self {
            name: path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            steps,
            at: 0,
            playing: None,
        })
    }

    /// The step that is shown.
    pub fn step(&self) -> Option<&Step> {
        self.steps.get(self.at)
    }

    /// What the vehicle knew at the step that is shown.
    pub fn observation(&self) -> Option<Observation> {
        self.step().map(|s| s.answer.observation)
    }

    /// Whether it plays.
    pub fn is_playing(&self) -> bool {
        self.playing.is_some()
    }

    /// Plays from where it is, from the beginning at the end, or stops.
    pub fn toggle(&mut self) {
        self.playing = match self.playing {
            Some(_) => None,
            None => {
                if self.at + 1 >= self.steps.len() {
                    self.at = 0;
                }
                Some(Instant::now())
            }
        };
    }

    /// Goes on to the next step when it is time; whether it did.
    pub fn advance(&mut self, now: Instant) -> bool {
        let due = self.playing.is_some_and(|since| now - since >= STEP_TIME);
        if !due {
            return false;
        }
        if self.at + 1 < self.steps.len() {
            self.at += 1;
            self.playing = Some(now);
        } else {
            self.playing = None;
        }
        true
    }

    /// Time until the next step.
    pub fn pause(&self) -> Duration {
        STEP_TIME
    }
}

/// The suggestions of a recording in their order.
fn steps(recording: &[u8], name: &str) -> Result<Vec<Step>, OperationError> {
    let mut steps = Vec::new();
    // The newest value of each field of the state, over all connections.
    let mut state: Map<String, Value> = Map::new();
    for (index, (place, item)) in record::read(recording).into_iter().enumerate() {
        let problem = |problem: String| OperationError::Record {
            path: name.to_owned(),
            place,
            problem,
        };
        let record = match item {
            Item::Record(record) => record,
            // What a full disk has cut costs itself alone.
            Item::Torn { .. } if index > 0 => continue,
            Item::Torn { problem: wrong, .. } | Item::Wrong(wrong) => return Err(problem(wrong)),
        };
        let kind = record.get("kind").and_then(Value::as_str).unwrap_or("");
        match kind {
            "start" | "reload" => {
                let format = record.get("format").and_then(Value::as_str);
                if format != Some(RECORD_FORMAT) {
                    let got = format.unwrap_or("none");
                    let expected = format!("format must be {RECORD_FORMAT:?}, got {got:?}");
                    return Err(problem(expected));
                }
            }
            "request" | "push" if index > 0 => {
                note_state(&record, &mut state);
                steps.extend(step(&record, &state));
            }
            "request" | "push" => {
                return Err(problem("a recording must begin with its start".to_owned()));
            }
            other => {
                let expected = "kind must be start, reload, request or push";
                return Err(problem(format!("{expected}, got {other:?}")));
            }
        }
    }
    if steps.is_empty() {
        return Err(OperationError::Empty {
            path: name.to_owned(),
        });
    }
    Ok(steps)
}

/// Takes the fields of the state from a request.
fn note_state(record: &Value, state: &mut Map<String, Value>) {
    let line = record.get("line").and_then(Value::as_str).unwrap_or("");
    let Ok(Value::Object(request)) = serde_json::from_str(line) else {
        return;
    };
    for field in ["depth_m", "distance_m", "light_pct", "mean", "std"] {
        if let Some(value) = request.get(field) {
            state.insert(field.to_owned(), value.clone());
        }
    }
}

/// The suggestion of a record, where it holds one and the state is known.
fn step(record: &Value, state: &Map<String, Value>) -> Option<Step> {
    let reply = record.get("reply")?.as_str()?;
    let Ok(Value::Object(reply)) = serde_json::from_str(reply) else {
        return None;
    };
    reply.get("delta_distance_m")?;
    let number = |field: &str| state.get(field)?.as_f64();
    let observation = Observation {
        depth_m: number("depth_m")?,
        distance_m: number("distance_m")?,
        light_pct: number("light_pct")?,
        mean: state.get("mean").and_then(triple)?,
        std: state.get("std").and_then(triple)?,
        quality: None,
    };
    Some(Step {
        since_start_s: record.get("since_start_s").and_then(Value::as_f64)?,
        answer: read_suggestion(&observation, &reply).ok()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: &str = r#"{"kind": "start", "format": "uwguide-record/1", "sequence": 0}"#;

    fn request(line: &str, reply: &str) -> String {
        serde_json::json!({
            "kind": "request", "sequence": 1, "connection": 1, "since_start_s": 2.5, "unix_s": 0.0,
            "elapsed_us": 9, "line": line, "reply": reply,
        })
        .to_string()
    }

    const REPLY: &str = r#"{"id":1,"ok":true,"valid":true,"reason":null,"distance_m":1.4,"light_pct":31.0,"delta_distance_m":0.4,"delta_light_pct":11.0,"predicted_contrast":[1,2,3],"score":1.3,"score_here":0.9,"evaluations":96}"#;

    #[test]
    fn suggestions_come_with_their_state_also_where_it_was_told_before() {
        let whole = r#"{"op":"suggest","depth_m":3,"distance_m":1,"light_pct":20,"mean":[1,2,3],"std":[4,5,6]}"#;
        let part = r#"{"op":"suggest","distance_m":1.2}"#;
        let text = [
            START.to_owned(),
            request(r#"{"op":"health"}"#, r#"{"ok":true}"#),
            request(whole, REPLY),
            request(whole, REPLY)[..90].to_owned(),
            request(part, REPLY),
            request("garbage", r#"{"ok":false,"error":{}}"#),
        ]
        .join("\n");
        let steps = steps(text.as_bytes(), "r").expect("read");
        assert_eq!(steps.len(), 2);
        let last = &steps[1].answer;
        assert_eq!(last.observation.distance_m, 1.2);
        assert_eq!(last.observation.std, [4.0, 5.0, 6.0]);
        assert_eq!((last.distance_m, last.light_pct), (1.4, 31.0));
        assert_eq!(last.predicted, Some([1.0, 2.0, 3.0]));
        assert_eq!(steps[1].since_start_s, 2.5);
    }

    #[test]
    fn predictions_of_physics_come_with_their_errors() {
        let line = r#"{"op":"suggest","depth_m":3,"distance_m":1,"light_pct":20,"mean":[1,2,3],"std":[4,5,6]}"#;
        let physics = REPLY.replace(
            "\"score\"",
            r#""predicted_here":[2,3,4],"predicted_contrast_error":[0.1,0.2,0.3],"predicted_here_error":[0.4,0.5,0.6],"score""#,
        );
        let text = [
            START.to_owned(),
            request(line, REPLY),
            request(line, &physics),
        ]
        .join("\n");
        let steps = steps(text.as_bytes(), "r").expect("read");
        assert_eq!(steps[0].answer.errors, [None; 2]);
        let expected = [Some([0.1, 0.2, 0.3]), Some([0.4, 0.5, 0.6])];
        assert_eq!(steps[1].answer.errors, expected);
    }

    #[test]
    fn what_is_no_recording_is_refused_with_its_line() {
        let other = START.replace("record/1", "record/9");
        let empty = format!("{START}\n{}", request(r#"{"op":"health"}"#, "{}"));
        let cases = [
            ("not json".to_owned(), "r: line 1:"),
            (other, "format must be \"uwguide-record/1\""),
            (request("{}", REPLY), "must begin with its start"),
            (
                format!("{START}\n{{\"kind\": \"odd\"}}"),
                "r: line 2: kind must be",
            ),
            (empty, "holds no suggestion"),
            (String::new(), "holds no suggestion"),
        ];
        for (text, expected) in cases {
            let error = steps(text.as_bytes(), "r").expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn it_plays_to_its_end_and_from_the_beginning_again() {
        let line = r#"{"op":"suggest","depth_m":3,"distance_m":1,"light_pct":20,"mean":[1,2,3],"std":[4,5,6]}"#;
        let text = format!(
            "{START}\n{}\n{}",
            request(line, REPLY),
            request(line, REPLY)
        );
        let mut operation = Operation {
            name: String::new(),
            steps: steps(text.as_bytes(), "r").expect("read"),
            at: 0,
            playing: None,
        };
        let later = |n: u32| Instant::now() + n * STEP_TIME;
        assert!(!operation.advance(later(1)));
        operation.toggle();
        assert!(operation.advance(later(2)) && operation.at == 1);
        assert!(operation.advance(later(4)) && !operation.is_playing());
        operation.toggle();
        assert_eq!(operation.at, 0);
    }
}
