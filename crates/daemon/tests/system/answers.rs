//! What answers hold: validity, reasons, ages, beams, the latest state, subscriptions.

use std::sync::Arc;

use serde_json::{Value, json};
use uw_guidance::Service;
use uw_guidance::checks::{Checks, Strictness};
use uw_guidance::service::{Moment, Session, Settings};

use crate::client::{service, service_with, suggest, with, without};
use crate::support::{Numbers, profile};

/// A session whose clocks the test sets.
struct Timed {
    session: Session,
    now: Moment,
}

impl Timed {
    fn new(service: Service) -> Self {
        Self::of(&Arc::new(service))
    }

    fn of(service: &Arc<Service>) -> Self {
        let now = Moment {
            since_start_s: 100.0,
            unix_s: 1_700_000_000.0,
        };
        Self {
            session: Session::new(Arc::clone(service)),
            now,
        }
    }

    fn ask(&mut self, request: &Value) -> Value {
        let pending = self.session.read(request.to_string().as_bytes());
        let line = self.session.answer(pending, self.now).line(0);
        serde_json::from_str(&line).unwrap()
    }

    fn pushed(&mut self) -> Option<Value> {
        let line = self.session.push(self.now)?.line(0);
        Some(serde_json::from_str(&line).unwrap())
    }

    fn later(&mut self, seconds: f64) {
        self.now.since_start_s += seconds;
        self.now.unix_s += seconds;
    }
}

fn state() -> Value {
    let mut state = suggest();
    state["op"] = json!("state");
    state
}

fn assert_hold(reply: &Value, reason: &str) {
    assert_eq!(reply["valid"], false, "{reply}");
    assert_eq!(reply["reason"], reason, "{reply}");
    assert_eq!(reply["action"], "hold", "{reply}");
    if reply["ok"] == true {
        assert_eq!(
            (&reply["delta_distance_m"], &reply["delta_light_pct"]),
            (&json!(0.0), &json!(0.0))
        );
        assert_eq!(reply["predicted_contrast"], Value::Null);
    }
}

#[test]
fn a_valid_answer_tells_gain_action_and_ages() {
    let mut timed = Timed::new(service());
    let reply = timed.ask(&with(json!({"age_s": 0.25})));
    assert_eq!(
        (&reply["valid"], &reply["action"]),
        (&json!(true), &json!("move"))
    );
    let number = |name: &str| reply[name].as_f64().unwrap();
    // All three are rounded to four decimals.
    let gain = number("score") - number("score_here");
    assert!((number("gain") - gain).abs() < 1.6e-4, "{reply}");
    assert!(number("gain") >= 0.0);
    for input in ["depth", "distance", "light", "image"] {
        assert_eq!(reply["age_s"][input], 0.25);
    }
}

#[test]
fn the_latest_state_of_all_connections_fills_what_a_request_leaves_out() {
    let service = Arc::new(service());
    let (mut driver, mut asking) = (Timed::of(&service), Timed::of(&service));
    let expected = asking.ask(&suggest());
    assert_eq!(driver.ask(&state())["ignored"], json!([]));
    let reply = asking.ask(&json!({"op": "suggest"}));
    assert_eq!(reply["distance_m"], expected["distance_m"], "{reply}");
    assert_eq!(reply["score"], expected["score"]);
    driver.later(1.0);
    driver.ask(&json!({"op": "state", "depth_m": 5.0, "age_s": 0.5}));
    asking.later(2.0);
    let reply = asking.ask(&json!({"op": "suggest"}));
    assert_eq!(
        reply["age_s"],
        json!({"depth": 1.5, "distance": 2.0, "light": 2.0, "image": 2.0})
    );
    assert_ne!(reply["score"], expected["score"]);
    // A reading from before the one held changes nothing and is told.
    let late = driver.ask(&json!({"op": "state", "depth_m": 1.0, "age_s": 0.6}));
    assert_eq!(late["ignored"], json!(["depth_m"]));
    assert_eq!(
        asking.ask(&json!({"op": "suggest"}))["score"],
        reply["score"]
    );
}

#[test]
fn missing_and_stale_inputs_mean_hold() {
    let mut timed = Timed::new(service());
    let reply = timed.ask(&without(&["light_pct"]));
    assert_hold(&reply, "missing_input");
    assert_eq!(reply["error"]["field"], "light_pct");
    timed.ask(&state());
    timed.later(2.4);
    assert_eq!(timed.ask(&json!({"op": "suggest"}))["valid"], true);
    timed.later(0.2);
    let stale = timed.ask(&json!({"op": "suggest"}));
    assert_hold(&stale, "stale_input");
    assert_eq!(stale["message"], "too old: distance_m");
    assert_eq!(stale["distance_m"], 1.0);
    let own = timed.ask(&with(json!({"age_s": 60.0})));
    assert_hold(&own, "stale_input");
    let fresh = timed.ask(&json!({"op": "suggest", "distance_m": 1.0}));
    assert_eq!(fresh["valid"], true, "{fresh}");
}

#[test]
fn clock_jumps_neither_freshen_nor_spoil_what_is_held() {
    let mut timed = Timed::new(service());
    timed.ask(&state());
    // The clock of the day is set back by a year and later forward by two: ages go on.
    for jump_s in [-3.15e7, 6.3e7] {
        timed.now.unix_s += jump_s;
        timed.later(1.0);
        assert_eq!(timed.ask(&json!({"op": "suggest"}))["valid"], true);
    }
    let old = timed.now.unix_s - 6.3e7;
    let reply = timed.ask(&json!({"op": "state", "depth_m": 5.0, "time_s": old}));
    assert_eq!(reply["ignored"], json!(["depth_m"]), "{reply}");
    let ahead = timed.now.unix_s + 3600.0;
    let reply = timed.ask(&json!({"op": "state", "depth_m": 5.0, "time_s": ahead}));
    assert_eq!(reply["error"]["field"], "time_s", "{reply}");
    timed.later(1.0);
    let just = timed.now.unix_s - 0.5;
    timed.ask(&json!({"op": "state", "depth_m": 2.0, "time_s": just}));
    let reply = timed.ask(&json!({"op": "suggest", "distance_m": 1.0}));
    assert_eq!(reply["age_s"]["depth"], 0.5, "{reply}");
}

#[test]
fn without_a_profile_the_answer_is_to_hold_until_one_is_set() {
    let mut timed = Timed::new(service_with(Settings::default(), false));
    assert_hold(&timed.ask(&suggest()), "no_profile");
    let water: Value = serde_json::from_str(&profile(&mut Numbers::new(3)).to_json()).unwrap();
    let set = timed.ask(&json!({"op": "set_profile", "profile": water}));
    assert_eq!(set["ok"], true);
    assert_eq!(timed.ask(&suggest())["valid"], true);
}

#[test]
fn an_optimum_at_the_end_of_the_calibration_is_told_as_clamped() {
    let mut timed = Timed::new(service());
    // Far off is best when hardly any contrast is needed, and the calibration ends at 3 m.
    let far = json!({"form": "overlap", "half_contrast": 1e-3, "distance_m": [0.5, 6.0]});
    let reply = timed.ask(&with(json!({"objective": far, "depth_m": 0.5})));
    assert_eq!(
        (&reply["valid"], &reply["reason"], &reply["distance_m"]),
        (&json!(true), &json!("clamped"), &json!(3.0)),
        "{reply}"
    );
}

#[test]
fn beams_are_combined_and_the_obliqueness_is_told() {
    let mut timed = Timed::new(service());
    let mut request = without(&["distance_m"]);
    let range = 1.0 / 22.5f64.to_radians().cos();
    request["distances_m"] = json!([range, range, range, range]);
    let reply = timed.ask(&request);
    assert_eq!(reply["beams"]["used"], 4, "{reply}");
    assert!(reply["beams"]["obliqueness_deg"].as_f64().unwrap() < 1e-9);
    let plain = timed.ask(&suggest());
    let close = |name: &str, within: f64| {
        let (x, y) = (reply[name].as_f64().unwrap(), plain[name].as_f64().unwrap());
        assert!((x - y).abs() < within, "{name}: {x} {y}");
    };
    close("score", 1e-6);
    request["distances_m"] = json!([null, null, null, null]);
    assert_hold(&timed.ask(&request), "no_range");
    request["distances_m"] = json!([1.0, 1.0, 5.0, 1.0]);
    assert_hold(&timed.ask(&request), "beams_disagree");
    for (distances, field) in [
        (json!([1.0, 1.0]), "distances_m"),
        (json!([1.0, -1.0, 1.0, 1.0]), "distances_m[1]"),
        (json!([1.0, "x", 1.0, 1.0]), "distances_m[1]"),
        (json!([]), "distances_m"),
    ] {
        request["distances_m"] = distances;
        assert_eq!(timed.ask(&request)["error"]["field"], field);
    }
}

/// Ranges of the beams to a target a metre ahead whose normal is so far from the axis.
fn oblique_ranges(info: &Value, angle_deg: f64) -> Vec<f64> {
    let beams = &info["settings"]["beams"];
    let tilt = beams["tilt_deg"].as_f64().unwrap().to_radians();
    let azimuths = beams["azimuths_deg"].as_array().unwrap().iter();
    let slope = angle_deg.to_radians().tan();
    azimuths
        .map(|azimuth| {
            let azimuth = azimuth.as_f64().unwrap().to_radians();
            1.0 / (tilt.cos() - slope * tilt.sin() * azimuth.cos())
        })
        .collect()
}

#[test]
fn a_target_that_is_seen_obliquely_is_told_or_refused() {
    let told = |reply: &Value| {
        let warnings = reply["warnings"].as_array().cloned().unwrap_or_default();
        warnings
            .iter()
            .any(|warning| warning["reason"] == "oblique")
    };
    let mut timed = Timed::new(service());
    let info = timed.ask(&json!({"op": "info"}));
    let mut request = without(&["distance_m"]);
    for (angle_deg, is_told) in [(0.0, false), (30.0, false), (40.0, true), (60.0, true)] {
        request["distances_m"] = json!(oblique_ranges(&info, angle_deg));
        let reply = timed.ask(&request);
        let found = reply["beams"]["obliqueness_deg"].as_f64().unwrap();
        assert!((found - angle_deg).abs() < 0.06, "{reply}");
        assert_eq!(
            (told(&reply), &reply["valid"]),
            (is_told, &json!(true)),
            "{reply}"
        );
    }
    let settings = Settings {
        checks: Checks {
            oblique: Strictness::Refuse,
            max_obliqueness_deg: 50.0,
            ..Checks::default()
        },
        ..Settings::default()
    };
    let mut timed = Timed::new(service_with(settings, true));
    let reply = timed.ask(&request);
    assert_hold(&reply, "oblique");
    let words = "seen 60 degrees from its normal, where predictions are for targets that are seen square on and 50 degrees are allowed";
    assert!(
        reply["message"].as_str().unwrap().contains(words),
        "{reply}"
    );
    request["distances_m"] = json!(oblique_ranges(&info, 40.0));
    assert!(!told(&timed.ask(&request)));
}

#[test]
fn a_subscription_pushes_at_its_rate_and_steers_without_jumps() {
    let service = Arc::new(service());
    let (mut driver, mut timed) = (Timed::of(&service), Timed::of(&service));
    let begun = timed.ask(&json!({"op": "subscribe", "id": "s", "rate_hz": 2.0,
                                  "steering": {"distance_rate_m_per_s": 0.2}}));
    assert_eq!(begun["ok"], true, "{begun}");
    assert_eq!(timed.pushed(), None, "nothing is due at once");
    timed.later(0.5);
    assert_hold(&timed.pushed().unwrap(), "missing_input");
    let (mut distance_m, mut light_pct) = (0.6, 20.0);
    let mut sequence = 1;
    for step in 0..40 {
        driver.now = timed.now;
        driver.ask(&with(
            json!({"op": "state", "distance_m": distance_m, "light_pct": light_pct}),
        ));
        timed.later(0.5);
        let push = timed.pushed().unwrap();
        sequence += 1;
        assert_eq!(push["sequence"], sequence);
        assert_eq!((&push["id"], &push["push"]), (&json!("s"), &json!(true)));
        let command = push["distance_m"].as_f64().unwrap();
        assert!(
            (command - distance_m).abs() <= 0.1 + 1e-9,
            "step {step}: {push}"
        );
        distance_m = command;
        light_pct = push["light_pct"].as_f64().unwrap();
        if step == 39 {
            assert_eq!(push["action"], "hold", "the vehicle has arrived: {push}");
        }
    }
    assert_ne!(distance_m, 0.6);
    // Missed messages are left out, the rhythm stays.
    timed.later(1.75);
    driver.now = timed.now;
    driver.ask(&state());
    assert!(timed.pushed().is_some());
    assert!(timed.pushed().is_none());
    timed.later(0.25);
    assert!(timed.pushed().is_some());
    timed.later(60.0);
    assert_hold(&timed.pushed().unwrap(), "stale_input");
    assert_eq!(timed.ask(&json!({"op": "unsubscribe"}))["ok"], true);
    timed.later(10.0);
    assert_eq!(timed.pushed(), None);
    assert_eq!(timed.ask(&json!({"op": "unsubscribe"}))["ok"], false);
}

#[test]
fn unusable_states_and_subscriptions_are_named() {
    let mut timed = Timed::new(service());
    let cases = [
        (
            json!({"op": "state"}),
            "state: one of depth_m, distance_m, distances_m, light_pct, level_pct, mean and std",
        ),
        (json!({"op": "state", "mean": [1, 2, 3]}), "std"),
        (json!({"op": "state", "depth_m": 1, "age_s": -1}), "age_s"),
        (
            json!({"op": "state", "depth_m": 1, "age_s": 1, "time_s": 1}),
            "time_s",
        ),
        (
            json!({"op": "state", "distance_m": 1, "distances_m": [1]}),
            "distances_m",
        ),
        (json!({"op": "subscribe"}), "rate_hz"),
        (json!({"op": "subscribe", "rate_hz": 1000}), "rate_hz"),
        (
            json!({"op": "subscribe", "rate_hz": 1, "objective": {"lambda": 1}}),
            "objective.lambda",
        ),
        (
            json!({"op": "subscribe", "rate_hz": 1, "steering": {"min_gain": -1}}),
            "steering.min_gain",
        ),
        (
            json!({"op": "subscribe", "rate_hz": 1, "steering": 1}),
            "steering",
        ),
    ];
    for (request, field) in cases {
        let reply = timed.ask(&request);
        assert_eq!(reply["error"]["field"], field, "{request} {reply}");
    }
    assert!(timed.session.next_push_s().is_none());
}

#[test]
fn a_token_opens_the_session() {
    let settings = Settings {
        token: Some("open sesame".to_owned()),
        ..Settings::default()
    };
    let mut timed = Timed::new(service_with(settings, true));
    let refused = |reply: Value| assert_eq!(reply["error"]["code"], "unauthorised", "{reply}");
    refused(timed.ask(&suggest()));
    refused(timed.ask(&state()));
    refused(timed.ask(&json!({"op": "auth", "token": "open sesam"})));
    refused(timed.ask(&json!({"op": "health"})));
    assert_eq!(
        timed.ask(&json!({"op": "auth", "token": "open sesame"}))["ok"],
        true
    );
    assert_eq!(timed.ask(&suggest())["valid"], true);
}
