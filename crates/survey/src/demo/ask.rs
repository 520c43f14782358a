//! A client of the daemon: questions over its socket, from threads of their own.

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
#[derive(Clone, Debug, Deserialize)]
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
    #[serde(default)]
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

/// Asks the daemon at `address` what to do.
pub(super) fn suggest(
    address: SocketAddr,
    observation: &Observation,
) -> Result<Suggestion, DemoError> {
    let reply = ask(address, request("suggest", observation))?;
    if reply["valid"] != json!(true) {
        return Err(DemoError::Daemon(format!("gave no suggestion: {reply}")));
    }
    serde_json::from_value(reply.clone())
        .map_err(|e| DemoError::Daemon(format!("answered {reply}: {e}")))
}

/// Asks the daemon at `address` what it predicts for distances in m and lamp levels in percent.
pub(super) fn predict(
    address: SocketAddr,
    observation: &Observation,
    candidates: &[(f64, f64)],
) -> Result<Vec<Choice>, DemoError> {
    #[derive(Deserialize)]
    struct Predicted {
        contrast: Vec<[f64; 3]>,
        scores: Vec<f64>,
    }
    let mut request = request("predict", observation);
    request["candidates"] = json!(candidates);
    let reply = ask(address, request)?;
    let predicted: Predicted = serde_json::from_value(reply.clone())
        .map_err(|e| DemoError::Daemon(format!("answered {reply}: {e}")))?;
    let found = predicted.contrast.into_iter().zip(predicted.scores);
    let choice = |(&(distance_m, light_pct), (contrast, score))| Choice {
        distance_m,
        light_pct,
        contrast,
        score,
    };
    Ok(candidates.iter().zip(found).map(choice).collect())
}

fn request(op: &str, now: &Observation) -> Value {
    json!({
        "op": op, "id": 1, "depth_m": now.depth_m, "distance_m": now.distance_m,
        "light_pct": now.light_pct, "mean": now.mean, "std": now.std,
    })
}

/// The daemon's reply to a request, which must be a good one.
fn ask(address: SocketAddr, request: Value) -> Result<Value, DemoError> {
    let answer = std::thread::spawn(move || exchange(address, &request))
        .join()
        .map_err(|_| DemoError::Daemon("the asking thread failed".into()))?;
    let line = answer.map_err(|e| DemoError::Daemon(e.to_string()))?;
    let reply: Value = serde_json::from_str(&line)
        .map_err(|e| DemoError::Daemon(format!("answered {line:?}: {e}")))?;
    if reply["ok"] != json!(true) {
        return Err(DemoError::Daemon(format!("refused: {}", line.trim())));
    }
    Ok(reply)
}

fn exchange(address: SocketAddr, request: &Value) -> std::io::Result<String> {
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    writeln!(stream, "{request}")?;
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line)?;
    Ok(line)
}
