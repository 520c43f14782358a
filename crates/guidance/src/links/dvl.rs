//! A Water Linked A50 or A125: newline-delimited JSON over TCP.
//!
//! Its reports hold the range along each of four beams, which become `distances_m` of a state; a report
//! without a usable beam feeds nothing, so that the distance gets stale and the answer "hold". Field names:
//! Water Linked's description of the TCP protocol (`json_v1` to `json_v3`).

use std::io;
use std::time::Duration;

use serde_json::{Value, json};
use tokio::io::BufReader;
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::{Backoff, Feeder, Patience};
use crate::wire::frame::{Frame, Lines};

/// The slowest report rate is 2 Hz; silence of this long means that the peer is gone.
const SILENCE: Duration = Duration::from_secs(5);
/// How long connecting may take.
const CONNECT_TIME: Duration = Duration::from_secs(5);

/// Where the instrument is and what is taken from it.
#[derive(Clone, Debug, PartialEq)]
pub struct DvlConfig {
    /// Host and port; the instrument's port is 16171.
    pub address: String,
    /// What is taken as distance.
    pub distance: DvlDistance,
    /// Pauses before connecting again.
    pub patience: Patience,
}

/// What is taken as distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DvlDistance {
    /// The ranges along the beams, combined by a plane.
    Beams,
    /// The instrument's own altitude.
    Altitude,
}

/// Feeds the service for ever.
pub async fn run(config: DvlConfig, mut feeder: Feeder) {
    let mut backoff = Backoff::new("dvl", config.patience);
    loop {
        let mut useful = false;
        let ended = listen(&config, &mut feeder, &mut useful).await;
        backoff.wait(ended, useful).await;
    }
}

async fn listen(config: &DvlConfig, feeder: &mut Feeder, useful: &mut bool) -> io::Result<()> {
    let stream = timeout(CONNECT_TIME, TcpStream::connect(&config.address)).await??;
    tracing::info!(address = config.address, "connected to the DVL");
    let mut lines = Lines::new(BufReader::new(stream));
    let mut last = Vec::new();
    loop {
        match timeout(SILENCE, lines.next()).await?? {
            Frame::End => return Ok(()),
            Frame::TooLong | Frame::Foreign(_) => {}
            Frame::Line(line) if line == last => {}
            Frame::Line(line) => {
                if let Some(state) = state(&line, config.distance) {
                    feeder.ask(&state);
                    *useful = true;
                }
                last = line;
            }
        }
    }
}

/// The `state` request of a report; `None` for a line without a usable distance, such as a position report,
/// a report without bottom lock or a line cut in half.
pub fn state(line: &[u8], distance: DvlDistance) -> Option<Value> {
    let report: Value = serde_json::from_slice(line).ok()?;
    let is_range = |range_m: &f64| *range_m > 0.0;
    match distance {
        DvlDistance::Altitude => {
            let altitude_m = report.get("altitude")?.as_f64().filter(is_range)?;
            Some(json!({"op": "state", "distance_m": altitude_m}))
        }
        DvlDistance::Beams => {
            let mut beams: Vec<(u64, Option<f64>)> = report
                .get("transducers")?
                .as_array()?
                .iter()
                .zip(0..)
                .map(|(beam, place)| {
                    let valid = beam.get("beam_valid").and_then(Value::as_bool);
                    let range_m = beam.get("distance").and_then(Value::as_f64);
                    let number = beam.get("id").and_then(Value::as_u64).unwrap_or(place);
                    (
                        number,
                        range_m.filter(is_range).filter(|_| valid == Some(true)),
                    )
                })
                .collect();
            beams.sort_by_key(|&(number, _)| number);
            let ranges: Vec<Option<f64>> = beams.into_iter().map(|(_, range)| range).collect();
            let any = ranges.iter().any(Option::is_some);
            any.then(|| json!({"op": "state", "distances_m": ranges}))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPORT: &str = r#"{"time": 106.3, "vx": -3.7e-05, "vy": 5.1e-05, "vz": 0.0, "fom": 0.0002,
        "altitude": 1.02, "velocity_valid": true, "status": 0, "format": "json_v1", "transducers": [
        {"id": 1, "velocity": 0.0, "distance": 1.2, "beam_valid": true},
        {"id": 0, "velocity": 0.0, "distance": 1.1, "beam_valid": true},
        {"id": 2, "velocity": 0.0, "distance": 1.3, "beam_valid": false},
        {"id": 3, "velocity": 0.0, "distance": -1, "beam_valid": true}]}"#;

    #[test]
    fn beams_come_in_their_order_and_only_valid_ones() {
        let told = state(REPORT.as_bytes(), DvlDistance::Beams).unwrap();
        assert_eq!(told["distances_m"], json!([1.1, 1.2, null, null]));
        let told = state(REPORT.as_bytes(), DvlDistance::Altitude).unwrap();
        assert_eq!(told["distance_m"], 1.02);
    }

    #[test]
    fn reports_without_a_distance_feed_nothing() {
        let lost = REPORT.replace("1.02", "-1").replace("true", "false");
        for distance in [DvlDistance::Beams, DvlDistance::Altitude] {
            for line in [
                lost.as_str(),
                &REPORT[..REPORT.len() / 2],
                r#"{"type": "position_local", "x": 1.0}"#,
                r#"{"altitude": "near", "transducers": 4}"#,
                "[]",
                "",
            ] {
                assert_eq!(state(line.as_bytes(), distance), None, "{line}");
            }
        }
    }
}
