//! Properties of the protocol: whatever comes in, one reply of the right form goes out.

use std::sync::{Arc, OnceLock};

use proptest::prelude::*;
use serde_json::{Map, Value, json};
use uw_guidance::Service;
use uw_guidance::operations::http::Answers;
use uw_guidance::service::Session;

use crate::client::{service, suggest};

/// A new connection to one service, which is made once.
fn session() -> Session {
    static SERVICE: OnceLock<Arc<Service>> = OnceLock::new();
    Session::new(Arc::clone(SERVICE.get_or_init(|| Arc::new(service()))))
}

/// JSON of every kind, shallow.
fn any_json() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<f64>().prop_map(|x| json!(x)),
        any::<i64>().prop_map(Value::from),
        "[ -~äü\u{1F41F}]{0,12}".prop_map(Value::from),
    ];
    leaf.prop_recursive(3, 24, 5, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..5).prop_map(Value::from),
            prop::collection::hash_map("[a-z_]{0,8}", inner, 0..5)
                .prop_map(|map| Value::Object(map.into_iter().collect::<Map<_, _>>())),
        ]
    })
}

/// Requests as they could be, with fields broken, missing and added.
fn any_request() -> impl Strategy<Value = Value> {
    let ops = [
        "suggest",
        "suggest_image",
        "predict",
        "state",
        "subscribe",
        "unsubscribe",
        "set_profile",
        "info",
        "health",
        "auth",
        "dance",
    ];
    let names = [
        "op",
        "id",
        "depth_m",
        "distance_m",
        "distances_m",
        "light_pct",
        "mean",
        "std",
        "age_s",
        "time_s",
        "objective",
        "candidates",
        "rate_hz",
        "steering",
        "profile",
        "token",
        "image",
    ];
    let change = (
        prop::sample::select(names.to_vec()),
        prop::option::of(any_json()),
    );
    let changes = prop::collection::vec(change, 0..4);
    (prop::sample::select(ops.to_vec()), changes).prop_map(|(op, changes)| {
        let mut request = suggest();
        request["op"] = json!(op);
        for (name, value) in changes {
            match value {
                Some(value) => request[name] = value,
                None => {
                    request.as_object_mut().unwrap().remove(name);
                }
            }
        }
        request
    })
}

/// Asserts what every reply has.
fn check(reply: &str) -> Result<Value, TestCaseError> {
    prop_assert!(!reply.contains('\n'));
    let value: Value = serde_json::from_str(reply)
        .map_err(|error| TestCaseError::fail(format!("{error}: {reply}")))?;
    prop_assert_eq!(&value["format"], "uwguide/1");
    match value["ok"].as_bool() {
        Some(true) => prop_assert!(value.get("error").is_none()),
        Some(false) => {
            prop_assert!(value["error"]["code"].is_string());
            prop_assert!(
                value["error"]["message"]
                    .as_str()
                    .is_some_and(|m| !m.is_empty())
            );
        }
        None => return Err(TestCaseError::fail(format!("no ok: {reply}"))),
    }
    if value["valid"] == false {
        prop_assert_eq!(&value["action"], "hold");
        prop_assert!(value["reason"].is_string());
    }
    Ok(value)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_get_one_reply(line in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut session = session();
        check(&session.reply(&line))?;
    }

    #[test]
    fn any_head_gets_a_whole_reply_of_the_metrics_port(
        first in prop_oneof![Just("GET /metrics HTTP/1.1\r\n"), Just("GET /healthz HTTP/1.0\r\n"), Just("")],
        host in prop_oneof![Just("Host: localhost\r\n"), Just("host:[::1]:9\r\n"), Just("Host: x\r\n"), Just("")],
        rest in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let (_, stopping) = tokio::sync::watch::channel(false);
        let session = session();
        let answers = Answers::new(Arc::clone(session.service()), &[], stopping);
        let head = [first.as_bytes(), host.as_bytes(), &rest].concat();
        let reply = answers.reply(&head);
        let (start, body) = reply.split_once("\r\n\r\n").unwrap();
        let length = format!("Content-Length: {}", body.len());
        prop_assert!(start.lines().any(|line| line == length), "{}", start);
        let is_stranger = host == "Host: x\r\n" && !first.is_empty();
        prop_assert!(!is_stranger || !start.starts_with("HTTP/1.1 200"), "{}", start);
    }

    #[test]
    fn any_json_gets_one_reply_and_the_session_goes_on(values in prop::collection::vec(any_json(), 1..4)) {
        let mut session = session();
        for value in values {
            check(&session.reply(value.to_string().as_bytes()))?;
        }
        prop_assert_eq!(&check(&session.reply(suggest().to_string().as_bytes()))?["valid"], true);
    }

    #[test]
    fn requests_keep_their_id_and_suggestions_their_bounds(requests in prop::collection::vec(any_request(), 1..5)) {
        let mut session = session();
        for request in requests {
            let reply = check(&session.reply(request.to_string().as_bytes()))?;
            let id = &request["id"];
            if id.is_string() || id.is_number() {
                prop_assert_eq!(&reply["id"], id);
            }
            if reply["valid"] == true && request["op"] == "suggest" {
                let light_pct = reply["light_pct"].as_f64().unwrap();
                prop_assert!((0.0..=100.0).contains(&light_pct));
                let distance_m = reply["distance_m"].as_f64().unwrap();
                prop_assert!((0.5..=3.0).contains(&distance_m), "{}", reply);
                prop_assert!(reply["gain"].as_f64().unwrap() >= 0.0 || request.get("objective").is_some());
            }
        }
    }
}
