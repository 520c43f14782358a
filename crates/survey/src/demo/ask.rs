//! A client of the daemon: one question over its socket, from a thread of its own.

use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use serde::Deserialize;
use serde_json::json;
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

/// Asks the daemon at `address` what to do.
pub(super) fn suggest(
    address: SocketAddr,
    observation: Observation,
) -> Result<Suggestion, DemoError> {
    let answer = std::thread::spawn(move || exchange(address, &observation))
        .join()
        .map_err(|_| DemoError::Daemon("the asking thread failed".into()))?;
    let line = answer.map_err(|e| DemoError::Daemon(e.to_string()))?;
    let reply: serde_json::Value = serde_json::from_str(&line)
        .map_err(|e| DemoError::Daemon(format!("answered {line:?}: {e}")))?;
    if reply["ok"] != json!(true) || reply["valid"] != json!(true) {
        return Err(DemoError::Daemon(format!(
            "gave no suggestion: {}",
            line.trim()
        )));
    }
    serde_json::from_value(reply).map_err(|e| DemoError::Daemon(format!("answered {line:?}: {e}")))
}

fn exchange(address: SocketAddr, now: &Observation) -> std::io::Result<String> {
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    let request = json!({
        "op": "suggest", "id": 1, "depth_m": now.depth_m, "distance_m": now.distance_m,
        "light_pct": now.light_pct, "mean": now.mean, "std": now.std,
    });
    writeln!(stream, "{request}")?;
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line)?;
    Ok(line)
}
