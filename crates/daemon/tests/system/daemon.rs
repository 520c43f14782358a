//! The daemon over real sockets on port 0, spoken to in raw bytes.

use std::io::Read;
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use base64::Engine as _;
use serde_json::{Value, json};
use uw_guidance::service::{ImagePolicy, Settings};
use uw_guidance::{Limits, spawn};

use crate::client::{Client, PATIENCE, service_with, start, suggest, with};
use crate::support::{Numbers, profile};

#[test]
fn a_suggestion_holds_what_the_protocol_says_and_beats_staying() {
    let daemon = start(Limits::default());
    let mut client = Client::connect(&daemon);
    let reply = client.ask(&suggest());
    assert_eq!(
        (&reply["id"], &reply["ok"], &reply["valid"]),
        (&json!(7), &json!(true), &json!(true))
    );
    assert_eq!(
        (&reply["format"], &reply["reason"]),
        (&json!("uwguide/1"), &Value::Null)
    );
    let number = |name: &str| {
        reply[name]
            .as_f64()
            .unwrap_or_else(|| panic!("{name}: {reply}"))
    };
    assert!((number("distance_m") - 1.0 - number("delta_distance_m")).abs() < 1e-12);
    assert!((number("light_pct") - 20.0 - number("delta_light_pct")).abs() < 1e-12);
    assert!(number("score") >= number("score_here"));
    assert!(number("evaluations") > 50.0 && number("elapsed_us") < 1e6);
    // The same candidate asked for with `predict` has the contrast and the score that were promised.
    let predicted = client.ask(&with(json!({
        "op": "predict", "candidates": [[reply["distance_m"], reply["light_pct"]], [1.0, 20.0]]})));
    assert_eq!(predicted["contrast"][0], reply["predicted_contrast"]);
    assert_eq!(
        predicted["scores"],
        json!([reply["score"], reply["score_here"]])
    );
}

#[test]
fn bytes_come_in_any_pieces() {
    let daemon = start(Limits::default());
    let mut client = Client::connect(&daemon);
    let text = format!("{}\n", suggest());
    let (first, second) = text.as_bytes().split_at(text.len() / 2);
    client.send(first);
    std::thread::sleep(Duration::from_millis(50));
    client.send(second);
    let expected = client.receive();
    assert_eq!(expected["ok"], true);
    let two = format!(
        "{}\n{{\"op\": \"health\", \"id\": \"h\"}}\n",
        with(json!({"id": 1}))
    );
    client.send(two.as_bytes());
    let (one, two) = (client.receive(), client.receive());
    assert_eq!((&one["id"], &one["score"]), (&json!(1), &expected["score"]));
    assert_eq!((&two["id"], &two["status"]), (&json!("h"), &json!("ok")));
    client.send(b"{\"op\": \"info\", \"id\": 3}");
    client.stream.shutdown(Shutdown::Write).unwrap();
    assert_eq!(
        client.receive()["id"],
        3,
        "a last line without a newline is answered"
    );
    assert_eq!(client.reader.read(&mut [0]).unwrap(), 0);
}

#[test]
fn bad_lines_get_errors_and_the_connection_stays_open() {
    let daemon = start(Limits::default());
    let mut client = Client::connect(&daemon);
    let mut nested = vec![b'['; 100_000];
    nested.push(b'\n');
    let mut long = vec![b'x'; (1 << 20) + 1];
    long.push(b'\n');
    let lines: [(&[u8], &str); 9] = [
        (b"garbage\n", "bad_json"),
        (b"\n", "bad_json"),
        (b"[1, 2]\n", "bad_json"),
        (b"{\"op\": \"suggest\", \"depth_m\": NaN}\n", "bad_json"),
        (b"{\"op\": \"health\"} {\"op\": \"health\"}\n", "bad_json"),
        (b"\xff\xfe\x00\n", "bad_utf8"),
        (&nested, "bad_json"),
        (&long, "line_too_long"),
        (b"{\"op\": \"dance\", \"id\": 5}\n", "unknown_op"),
    ];
    for (line, code) in lines {
        client.send(line);
        let reply = client.receive();
        assert_eq!(reply["ok"], false, "{reply}");
        assert_eq!(reply["error"]["code"], code, "{reply}");
        assert!(!reply["error"]["message"].as_str().unwrap().is_empty());
    }
    assert_eq!(client.ask(&suggest())["ok"], true);
    let health = client.ask(&json!({"op": "health"}));
    assert_eq!(
        (&health["requests"], &health["errors"]),
        (&json!(10), &json!(9))
    );
}

#[test]
fn wrong_fields_are_named() {
    let daemon = start(Limits::default());
    let mut client = Client::connect(&daemon);
    let mut missing = suggest();
    missing.as_object_mut().unwrap().remove("distance_m");
    let cases = [
        (missing, "missing_field", "distance_m"),
        (json!({"id": 1}), "missing_field", "op"),
        (with(json!({"depth_m": "3.0"})), "wrong_type", "depth_m"),
        (with(json!({"depth_m": null})), "wrong_type", "depth_m"),
        (with(json!({"mean": [1, 2]})), "wrong_type", "mean"),
        (with(json!({"std": [1, 2, "x"]})), "wrong_type", "std[2]"),
        (with(json!({"deph_m": 3.0})), "unknown_field", "deph_m"),
        (with(json!({"op": 3})), "wrong_type", "op"),
        (with(json!({"id": [1]})), "wrong_type", "id"),
        (with(json!({"depth_m": 40})), "out_of_range", "depth_m"),
        (with(json!({"depth_m": -1})), "out_of_range", "depth_m"),
        (
            with(json!({"distance_m": 3.5})),
            "out_of_range",
            "distance_m",
        ),
        (
            with(json!({"light_pct": 100.5})),
            "out_of_range",
            "light_pct",
        ),
        (
            with(json!({"mean": [1, 2, 256]})),
            "out_of_range",
            "mean[2]",
        ),
        (
            with(json!({"objective": {"lamda_c": 1}})),
            "unknown_field",
            "objective.lamda_c",
        ),
        (
            with(json!({"objective": {"kappa_c": 0}})),
            "out_of_range",
            "objective.kappa_c",
        ),
        (
            with(json!({"objective": {"preset": "x"}})),
            "invalid_value",
            "objective.preset",
        ),
        (
            with(json!({"objective": {"distance_m": [4, 5]}})),
            "out_of_range",
            "objective.distance_m",
        ),
        (
            with(json!({"op": "predict"})),
            "missing_field",
            "candidates",
        ),
        (
            with(json!({"op": "predict", "candidates": []})),
            "out_of_range",
            "candidates",
        ),
        (
            with(json!({"op": "predict", "candidates": [[1, 2], [9, 2]]})),
            "out_of_range",
            "candidates[1][0]",
        ),
        (
            json!({"op": "info", "verbose": true}),
            "unknown_field",
            "verbose",
        ),
        (
            json!({"op": "set_profile", "profile": {"format": "x"}}),
            "invalid_value",
            "profile.format",
        ),
        (json!({"op": "set_profile"}), "missing_field", "profile"),
    ];
    for (request, code, field) in cases {
        let error = client.refused(&request);
        assert_eq!(
            (&error["code"], &error["field"]),
            (&json!(code), &json!(field)),
            "{request} {error}"
        );
    }
    let reply = client.ask(&with(json!({"id": 8, "depth_m": 40})));
    assert_eq!(
        reply["error"]["message"],
        "depth_m must be between 0.5 and 6.0 m (calibrated), got 40"
    );
    assert_eq!((&reply["id"], &reply["valid"]), (&json!(8), &json!(false)));
    assert_eq!(reply["reason"], "outside_calibration");
}

#[test]
fn the_objective_of_a_request_counts() {
    let daemon = start(Limits::default());
    let mut client = Client::connect(&daemon);
    let objective = json!({"preset": "paper", "distance_m": [2.0, 2.25], "light_pct": [5, 6]});
    let reply = client.ask(&with(json!({"objective": objective})));
    let inside = |name: &str, low: f64, high: f64| {
        let value = reply[name].as_f64().unwrap();
        assert!((low..=high).contains(&value), "{name} {value}");
    };
    inside("distance_m", 2.0, 2.25);
    inside("light_pct", 5.0, 6.0);
    assert_ne!(reply["score"], client.ask(&suggest())["score"]);
}

#[test]
fn a_profile_is_set_for_one_connection_only() {
    let daemon = start(Limits::default());
    let (mut one, mut other) = (Client::connect(&daemon), Client::connect(&daemon));
    let mut shallow: Value =
        serde_json::from_str(&profile(&mut Numbers::new(4)).to_json()).unwrap();
    shallow["depth"].as_array_mut().unwrap().truncate(2);
    let reply = one.ask(&json!({"op": "set_profile", "id": 1, "profile": shallow}));
    assert_eq!(reply["profile"]["depth_m"], json!([0.5, 1.0]), "{reply}");
    assert_eq!(one.refused(&suggest())["field"], "depth_m");
    assert_eq!(other.ask(&suggest())["valid"], true);
    assert_eq!(
        other.ask(&json!({"op": "info"}))["profile"]["depth_m"],
        json!([0.5, 6.0])
    );
}

#[test]
fn an_image_is_measured_by_path_and_in_base64() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../calib/tests/data");
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../calib/tests/data/s2_turbid.png"
    );
    let settings = Settings {
        images: ImagePolicy::Under(folder.into()),
        ..Settings::default()
    };
    let service = service_with(settings, true);
    let daemon = spawn("127.0.0.1:0", service, Limits::default()).unwrap();
    let mut client = Client::connect(&daemon);
    let stats = uw_calib::ImageStats::from_file(path.as_ref()).unwrap();
    // Told, and used, in hundredths of a count.
    let hundredths = |counts: [f64; 3]| counts.map(|value| (100.0 * value).round() / 100.0);
    let (mean, std) = (hundredths(stats.mean), hundredths(stats.contrast));
    let mut request = with(json!({"op": "suggest_image", "image": {"path": path}}));
    request
        .as_object_mut()
        .unwrap()
        .retain(|name, _| name != "mean" && name != "std");
    let by_path = client.ask(&request);
    assert_eq!(by_path["ok"], true, "{by_path}");
    assert_eq!(
        (&by_path["mean"], &by_path["std"]),
        (&json!(mean), &json!(std))
    );
    let bytes = std::fs::read(path).unwrap();
    request["image"] =
        json!({"base64_png": base64::engine::general_purpose::STANDARD.encode(bytes)});
    assert_eq!(client.ask(&request)["score"], by_path["score"]);
    let measured = with(json!({"mean": mean, "std": std}));
    assert_eq!(client.ask(&measured)["score"], by_path["score"]);
    for (image, field) in [
        (json!({"path": "/dev/zero"}), "image.path"),
        (json!({"path": "/no/such/file.png"}), "image.path"),
        (json!({"base64_png": "%%%"}), "image.base64_png"),
        (json!({"base64_png": "aGVsbG8="}), "image.base64_png"),
    ] {
        request["image"] = image;
        let error = client.refused(&request);
        assert_eq!(
            (&error["code"], &error["field"]),
            (&json!("bad_image"), &json!(field))
        );
    }
    request["image"] = json!({});
    assert_eq!(client.refused(&request)["field"], "image");
}

#[test]
fn connections_are_limited_and_idle_ones_closed() {
    let limits = Limits {
        max_connections: 2,
        idle_time: Duration::from_millis(700),
        ..Limits::default()
    };
    let daemon = start(limits);
    let (mut one, mut two) = (Client::connect(&daemon), Client::connect(&daemon));
    assert_eq!(one.ask(&suggest())["ok"], true);
    assert_eq!(two.ask(&suggest())["ok"], true);
    let mut three = Client::connect(&daemon);
    three.send(b"{\"op\": \"health\"}\n");
    assert_eq!(three.receive()["error"]["code"], "busy");
    assert_eq!(three.reader.read(&mut [0]).unwrap(), 0);
    assert_eq!(one.receive()["error"]["code"], "idle");
    assert_eq!(one.reader.read(&mut [0]).unwrap(), 0);
    drop(two);
    let deadline = Instant::now() + PATIENCE;
    loop {
        let mut again = Client::connect(&daemon);
        if again.ask(&suggest())["ok"] == true {
            break;
        }
        assert!(
            Instant::now() < deadline,
            "a place that became free is not given again"
        );
    }
}

#[test]
fn shutdown_ends_the_daemon_while_clients_are_connected() {
    let daemon = start(Limits::default());
    let address = daemon.local_addr();
    let mut client = Client::connect(&daemon);
    client.send(b"{\"op\": \"heal");
    let started = Instant::now();
    daemon.shutdown();
    assert!(started.elapsed() < Duration::from_secs(10));
    assert!(TcpStream::connect(address).is_err());
}

#[test]
fn answers_come_within_what_guidance_needs() {
    let daemon = start(Limits::default());
    let mut client = Client::connect(&daemon);
    let mut elapsed_us: Vec<u64> = (0..200)
        .map(|k| {
            let depth_m = 0.5 + 0.02 * f64::from(k);
            client.ask(&with(json!({"depth_m": depth_m})))["elapsed_us"]
                .as_u64()
                .unwrap()
        })
        .collect();
    elapsed_us.sort_unstable();
    // Vehicles want an answer within 10 ms; the median leaves out what else the machine is doing.
    assert!(elapsed_us[100] < 10_000, "median {} us", elapsed_us[100]);
}
