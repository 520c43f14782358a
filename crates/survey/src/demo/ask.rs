//! A client of the daemon: questions over its socket.

use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value, json};
use uw_guidance::Observation;

use super::DemoError;

/// The daemon answers within milliseconds; this is for a machine that is very busy.
const PATIENCE: Duration = Duration::from_secs(20);

/// What the daemon suggests.
#[derive(Clone, Debug)]
pub struct Suggestion {
    /// Distance to go to, m.
    pub distance_m: f64,
    /// Lamp level to set, percent.
    pub light_pct: f64,
    /// Contrast predicted there, 8-bit counts.
    pub predicted_contrast: [f64; 3],
    /// Objective there.
    pub score: f64,
    /// Objective here.
    pub score_here: f64,
    /// What the daemon warns of.
    pub warnings: Vec<Warning>,
    /// Candidates evaluated.
    pub evaluations: u64,
    /// Time the daemon took, microseconds.
    pub elapsed_us: u64,
}

/// Why a suggestion is to be taken with care.
#[derive(Clone, Debug, Deserialize)]
pub struct Warning {
    /// A short name for programs.
    pub reason: String,
    /// In words.
    pub message: String,
}

/// A candidate, and what is predicted for it.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// Distance, m.
    pub distance_m: f64,
    /// Lamp level, percent.
    pub light_pct: f64,
    /// Contrast predicted there, 8-bit counts.
    pub contrast: [f64; 3],
    /// Objective there.
    pub score: f64,
}

/// A reply to `suggest`; physics leaves channels out that a picture does not tell.
#[derive(Deserialize)]
struct Suggested {
    distance_m: f64,
    light_pct: f64,
    predicted_contrast: [Option<f64>; 3],
    score: f64,
    score_here: f64,
    #[serde(default)]
    warnings: Vec<Warning>,
    evaluations: u64,
    elapsed_us: u64,
}

/// A reply to `predict`.
#[derive(Deserialize)]
struct Predicted {
    contrast: Vec<[Option<f64>; 3]>,
    scores: Vec<f64>,
}

/// A connection to the daemon, which keeps the picture that it was shown.
pub(super) struct Connection(BufReader<TcpStream>);

impl Connection {
    /// To the daemon at `address`.
    pub(super) fn to(address: SocketAddr) -> Result<Self, DemoError> {
        let connect = || {
            let stream = TcpStream::connect_timeout(&address, PATIENCE)?;
            stream.set_read_timeout(Some(PATIENCE))?;
            Ok::<_, std::io::Error>(Self(BufReader::new(stream)))
        };
        connect().map_err(|e| DemoError::Daemon(e.to_string()))
    }

    /// Asks what to do, of a `picture` in the daemon's folder where its own numbers are to count.
    pub(super) fn suggest(
        &mut self,
        now: &Observation,
        picture: Option<&str>,
    ) -> Result<Suggestion, DemoError> {
        let request = match picture {
            None => request("suggest", now),
            Some(path) => json!({
                "op": "suggest_image", "id": 1, "depth_m": now.depth_m, "distance_m": now.distance_m,
                "light_pct": now.light_pct, "image": { "path": path },
            }),
        };
        let reply = self.ask(&request)?;
        if reply["valid"] != json!(true) {
            return Err(DemoError::Daemon(format!("gave no suggestion: {reply}")));
        }
        let found: Suggested = read(reply)?;
        Ok(Suggestion {
            distance_m: found.distance_m,
            light_pct: found.light_pct,
            predicted_contrast: or_here(found.predicted_contrast, now),
            score: found.score,
            score_here: found.score_here,
            warnings: found.warnings,
            evaluations: found.evaluations,
            elapsed_us: found.elapsed_us,
        })
    }

    /// Asks what is predicted for distances in m and lamp levels in percent.
    pub(super) fn predict(
        &mut self,
        now: &Observation,
        candidates: &[(f64, f64)],
    ) -> Result<Vec<Choice>, DemoError> {
        let mut request = request("predict", now);
        request["candidates"] = json!(candidates);
        let predicted: Predicted = read(self.ask(&request)?)?;
        let found = predicted.contrast.into_iter().zip(predicted.scores);
        let choice = |(&(distance_m, light_pct), (contrast, score))| Choice {
            distance_m,
            light_pct,
            contrast: or_here(contrast, now),
            score,
        };
        Ok(candidates.iter().zip(found).map(choice).collect())
    }

    /// The daemon's reply to a request, which must be a good one.
    fn ask(&mut self, request: &Value) -> Result<Value, DemoError> {
        let mut exchange = || {
            writeln!(self.0.get_mut(), "{request}")?;
            let mut line = String::new();
            self.0.read_line(&mut line)?;
            Ok::<_, std::io::Error>(line)
        };
        let line = exchange().map_err(|e| DemoError::Daemon(e.to_string()))?;
        let reply: Value = serde_json::from_str(&line)
            .map_err(|e| DemoError::Daemon(format!("answered {line:?}: {e}")))?;
        if reply["ok"] != json!(true) {
            return Err(DemoError::Daemon(format!("refused: {}", line.trim())));
        }
        Ok(reply)
    }
}

fn read<T: serde::de::DeserializeOwned>(reply: Value) -> Result<T, DemoError> {
    let told = reply.to_string();
    serde_json::from_value(reply).map_err(|e| DemoError::Daemon(format!("answered {told}: {e}")))
}

/// What is predicted, and the present contrast of channels that are not told: no place is preferred for them.
fn or_here(contrast: [Option<f64>; 3], now: &Observation) -> [f64; 3] {
    std::array::from_fn(|k| contrast[k].unwrap_or(now.std[k]))
}

fn request(op: &str, now: &Observation) -> Value {
    json!({
        "op": op, "id": 1, "depth_m": now.depth_m, "distance_m": now.distance_m,
        "light_pct": now.light_pct, "mean": now.mean, "std": now.std,
    })
}
