//! A Doppler log that loses the bottom, with all that its stream holds: see `tests/data/README.md`.

use std::sync::Arc;

use serde_json::{Value, json};
use uw_daemon::links::dvl::{DvlDistance, state};
use uw_guidance::service::{Moment, Session};

use crate::client::{service, without};

const STREAM: &str = include_str!("../../../guidance/tests/data/dvl_json_v1.ndjson");
/// Reports come at 5 Hz.
const PERIOD_S: f64 = 0.2;

/// What came of one line of the stream.
struct Step {
    locked: Option<bool>,
    fed: bool,
    reply: Value,
}

/// Feeds the stream and asks for advice after every line.
fn run(distance: DvlDistance) -> Vec<Step> {
    let mut session = Session::new(Arc::new(service()));
    let mut now = Moment {
        since_start_s: 100.0,
        unix_s: 1.7e9,
    };
    let mut steps = Vec::new();
    for line in STREAM.lines() {
        let mut ask = |request: &Value| -> Value {
            let pending = session.read(request.to_string().as_bytes());
            serde_json::from_str(&session.answer(pending, now).line(0)).unwrap()
        };
        let told = state(line.as_bytes(), distance);
        if let Some(state) = &told {
            assert_eq!(ask(state)["ok"], true, "{line}");
        }
        let reply = ask(&without(&["distance_m"]));
        let report: Option<Value> = serde_json::from_str(line).ok();
        steps.push(Step {
            locked: report.and_then(|report| report["velocity_valid"].as_bool()),
            fed: told.is_some(),
            reply,
        });
        now.since_start_s += PERIOD_S;
        now.unix_s += PERIOD_S;
    }
    steps
}

#[test]
fn without_bottom_lock_single_beams_feed_nothing_and_the_answer_is_to_hold() {
    let steps = run(DvlDistance::Beams);
    let count = |locked: bool, fed: bool| {
        let of = |step: &&Step| step.locked == Some(locked) && step.fed == fed;
        steps.iter().filter(of).count()
    };
    // All with lock; without it the three whose beams agree.
    assert_eq!(count(true, false), 0);
    assert_eq!(count(false, true), 3);
    assert!(count(false, false) >= 40, "{}", count(false, false));
    // Half a second after the distance is too old, every answer without lock is to hold.
    let lost = steps
        .iter()
        .position(|step| step.locked == Some(false))
        .unwrap();
    let old = lost + ((2.5 + 0.5) / PERIOD_S) as usize;
    let again = steps
        .iter()
        .rposition(|step| step.locked == Some(false))
        .unwrap()
        - 2;
    for step in &steps[old..again] {
        assert_eq!(
            (&step.reply["valid"], &step.reply["reason"]),
            (&json!(false), &json!("stale_input")),
            "{}",
            step.reply
        );
    }
    // No range of a stale beam is ever taken for the distance.
    for step in &steps {
        let distance_m = step.reply["beams"]["distance_m"].as_f64();
        assert!(
            distance_m.is_none_or(|d| (1.0..1.5).contains(&d)),
            "{}",
            step.reply
        );
    }
    assert_eq!(steps.last().unwrap().reply["valid"], true);
}

#[test]
fn the_altitude_counts_with_bottom_lock_only() {
    let steps = run(DvlDistance::Altitude);
    assert!(
        steps
            .iter()
            .all(|step| step.fed == (step.locked == Some(true)))
    );
}
