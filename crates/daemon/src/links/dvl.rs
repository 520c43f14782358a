//! A Water Linked A50 or A125: newline-delimited JSON over TCP.
//!
//! Its reports hold the range along each of four beams, which become `distances_m` of a state. Without bottom lock
//! (`velocity_valid` false) single beams go on saying that they are valid, with old or wrong ranges: such a report counts
//! only when three beams or more agree, and one beam alone never counts. A report that does not count feeds nothing, so
//! that the distance gets stale and the answer "hold". Field names: Water Linked's description of the TCP protocol
//! (`json_v1` to `json_v3`).

use std::io;
use std::time::Duration;

use serde_json::{Value, json};
use tokio::io::BufReader;
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::{Backoff, Feeder, Pauses};
use uw_guidance::beams;
use uw_guidance::wire::frame::{Frame, Lines};

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
    pub pauses: Pauses,
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
    let mut backoff = Backoff::new("dvl", config.pauses);
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
/// a report without bottom lock whose beams do not agree, or a line cut in half.
pub fn state(line: &[u8], distance: DvlDistance) -> Option<Value> {
    let report: Value = serde_json::from_slice(line).ok()?;
    let locked = report.get("velocity_valid").and_then(Value::as_bool) == Some(true);
    match distance {
        DvlDistance::Altitude => {
            let altitude_m = report.get("altitude")?.as_f64().filter(is_range)?;
            locked.then(|| json!({"op": "state", "distance_m": altitude_m}))
        }
        DvlDistance::Beams => {
            let ranges = ranges(&report)?;
            let usable = match ranges.iter().flatten().count() {
                0 | 1 => false,
                2 => locked,
                _ => locked || agree(&ranges),
            };
            usable.then(|| json!({"op": "state", "distances_m": ranges}))
        }
    }
}

fn is_range(range_m: &f64) -> bool {
    *range_m > 0.0
}

/// The ranges of the beams in their order, m; `None` for a beam that is not valid.
fn ranges(report: &Value) -> Option<Vec<Option<f64>>> {
    let mut beams: Vec<(u64, Option<f64>)> = report
        .get("transducers")?
        .as_array()?
        .iter()
        .zip(0..)
        .map(|(beam, index)| {
            let valid = beam.get("beam_valid").and_then(Value::as_bool) == Some(true);
            let range_m = beam.get("distance").and_then(Value::as_f64);
            let number = beam.get("id").and_then(Value::as_u64).unwrap_or(index);
            (number, range_m.filter(is_range).filter(|_| valid))
        })
        .collect();
    beams.sort_by_key(|&(number, _)| number);
    Some(beams.into_iter().map(|(_, range)| range).collect())
}

/// Whether the ranges lie close to each other, as those of a surface ahead do: all beams are tilted alike.
fn agree(ranges_m: &[Option<f64>]) -> bool {
    beams::agree(ranges_m.iter().flatten().copied())
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

    /// A report with these ranges, `None` for a beam that says it is not valid.
    fn report(locked: bool, altitude_m: f64, ranges_m: [Option<f64>; 4]) -> String {
        let beams: Vec<Value> = (0..4)
            .map(|id| {
                json!({"id": id, "velocity": 0.0, "distance": ranges_m[id].unwrap_or(-1.0),
                       "rssi": -30.1, "nsd": -88.2, "beam_valid": ranges_m[id].is_some()})
            })
            .collect();
        json!({"time": 91.2, "vx": 0.0, "vy": 0.0, "vz": 0.0, "fom": 2.0, "altitude": altitude_m,
               "velocity_valid": locked, "status": 0, "format": "json_v1", "transducers": beams})
        .to_string()
    }

    #[test]
    fn without_bottom_lock_only_agreeing_beams_count_and_never_one_alone() {
        let one = [None, None, Some(0.42), None];
        let two = [Some(1.2), None, Some(1.3), None];
        let apart = [Some(0.4), Some(1.3), Some(2.9), None];
        let three = [Some(1.2), Some(1.3), None, Some(1.25)];
        let told = |locked, ranges| {
            let line = report(locked, if locked { 1.1 } else { -1.0 }, ranges);
            state(line.as_bytes(), DvlDistance::Beams).is_some()
        };
        assert_eq!(
            [one, two, apart, three].map(|ranges| told(false, ranges)),
            [false, false, false, true]
        );
        // With it two are enough; whether they lie on a plane is asked later.
        assert_eq!(
            [one, two, apart, three].map(|ranges| told(true, ranges)),
            [false, true, true, true]
        );
        // The altitude is the instrument's own answer: it counts with bottom lock only.
        for (locked, altitude_m, counts) in
            [(true, 1.1, true), (false, 1.1, false), (true, -1.0, false)]
        {
            let line = report(locked, altitude_m, three);
            assert_eq!(
                state(line.as_bytes(), DvlDistance::Altitude).is_some(),
                counts
            );
        }
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
