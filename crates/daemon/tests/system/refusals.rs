//! What the daemon refuses to advise on, and what it tells about advice.

use std::sync::Arc;

use serde_json::{Value, json};
use uw_calib::{Profile, Rig};
use uw_guidance::service::{Loaded, Session, Settings};
use uw_guidance::{Checks, Model, Service, Strictness};

use crate::client::{suggest, with};
use crate::support::{Numbers, echo_model, profile};

fn water() -> Profile {
    profile(&mut Numbers::new(3))
}

/// A session of a daemon whose model states all about itself.
fn session_with(profile: Profile, checks: Checks) -> Session {
    session_of(&echo_model(-2.0, 0.02), profile, checks)
}

fn session_of(model: &Value, profile: Profile, checks: Checks) -> Session {
    let loaded = Loaded {
        basis: Model::from_json(model).unwrap().into(),
        model_name: "echo".to_owned(),
        model_digest: String::new(),
        profile: Some(Arc::new(profile)),
    };
    let settings = Settings {
        checks,
        ..Settings::default()
    };
    Session::new(Arc::new(Service::with_settings(loaded, settings)))
}

fn session() -> Session {
    session_with(water(), Checks::default())
}

fn ask(session: &mut Session, request: &Value) -> Value {
    serde_json::from_str(&session.reply(request.to_string().as_bytes())).unwrap()
}

/// Asserts that a request is understood and answered with "hold"; the message.
fn held(reply: &Value, reason: &str) -> String {
    assert_eq!(
        (&reply["ok"], &reply["valid"]),
        (&json!(true), &json!(false)),
        "{reply}"
    );
    assert_eq!(
        (&reply["reason"], &reply["action"]),
        (&json!(reason), &json!("hold")),
        "{reply}"
    );
    assert_eq!(
        (&reply["delta_distance_m"], &reply["delta_light_pct"]),
        (&json!(0.0), &json!(0.0))
    );
    assert_eq!(reply["predicted_contrast"], Value::Null);
    reply["message"].as_str().unwrap().to_owned()
}

#[test]
fn pictures_that_no_working_camera_takes_are_held() {
    let mut session = session();
    let cases = [
        (json!({"mean": [0, 0, 0], "std": [0, 0, 0]}), "black frame"),
        (
            json!({"mean": [255, 255, 255], "std": [0, 0, 0]}),
            "saturated frame",
        ),
        (
            json!({"mean": [90, 90, 90], "std": [0, 0, 0]}),
            "blank frame",
        ),
        (
            json!({"mean": [250, 250, 250], "std": [100, 100, 100]}),
            "got 100",
        ),
    ];
    for (picture, told) in cases {
        let message = held(&ask(&mut session, &with(picture)), "bad_observation");
        assert!(message.contains(told), "{message}");
    }
    assert_eq!(ask(&mut session, &suggest())["valid"], true);
}

#[test]
fn inputs_outside_the_training_are_held_with_value_and_range() {
    let mut session = session();
    // Ranges of the model: distance 0.5 to 3 m, depth 1 to 5 m, means 2 to 180 counts; 5 % beyond are allowed.
    let cases = [
        (json!({"depth_m": 5.9}), "depth must be between 1 and 5 m"),
        (
            json!({"mean": [41, 88, 215]}),
            "mean_b must be between 2 and 180 8-bit counts",
        ),
        (
            json!({"std": [4.1, 45, 6.2]}),
            "std_g must be between 1 and 40 8-bit counts",
        ),
    ];
    for (fields, told) in cases {
        let message = held(&ask(&mut session, &with(fields)), "outside_training");
        assert!(message.starts_with(told), "{message}");
    }
    let mut warned = session_with(
        water(),
        Checks {
            training: Strictness::Warn,
            ..Checks::default()
        },
    );
    let reply = ask(&mut warned, &with(json!({"depth_m": 5.9})));
    assert_eq!(
        (&reply["valid"], &reply["warnings"][0]["reason"]),
        (&json!(true), &json!("outside_training"))
    );
    for inside in [json!({"depth_m": 5.19}), json!({"mean": [41, 88, 185]})] {
        assert_eq!(ask(&mut session, &with(inside))["valid"], true);
    }
    // Old models state no ranges; the daemon says so.
    let mut document = echo_model(-2.0, 0.02);
    for input in document["inputs"].as_array_mut().unwrap() {
        let input = input.as_object_mut().unwrap();
        input.retain(|name, _| name == "name" || name == "unit");
    }
    let model = Model::from_json(&document).unwrap();
    assert!(model.card().warnings()[0].contains("no range of its inputs"));
}

#[test]
fn the_calibration_counts_among_the_inputs() {
    let mut document = echo_model(-2.0, 0.02);
    let kz = document["inputs"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .find(|input| input["name"] == "kz_r")
        .unwrap();
    kz["min"] = json!(0.9);
    let mut session = session_of(&document, water(), Checks::default());
    let message = held(&ask(&mut session, &suggest()), "outside_training");
    assert!(
        message.starts_with("kz_r must be between 0.9 and 1"),
        "{message}"
    );
}

#[test]
fn only_places_of_the_training_are_suggested() {
    let mut document = echo_model(-2.0, 0.02);
    for input in document["inputs"].as_array_mut().unwrap() {
        match input["name"].as_str().unwrap() {
            "distance" => input["min"] = json!(0.8),
            "light" => input["max"] = json!(60.0),
            _ => {}
        }
    }
    let mut session = session_of(&document, water(), Checks::default());
    // Contrast alone counts: nearest and brightest would be best.
    let objective = json!({"lambda_d": 0});
    let reply = ask(&mut session, &with(json!({"objective": objective})));
    assert_eq!(
        (&reply["distance_m"], &reply["light_pct"], &reply["reason"]),
        (&json!(0.8), &json!(60.0), &json!("clamped")),
        "{reply}"
    );
    let mut predict = with(json!({"op": "predict", "candidates": [[1.0, 30.0]]}));
    assert_eq!(ask(&mut session, &predict)["valid"], true);
    predict["candidates"] = json!([[1.0, 30.0], [1.0, 90.0]]);
    let reply = ask(&mut session, &predict);
    assert_eq!(
        (&reply["valid"], &reply["reason"], &reply["action"]),
        (&json!(false), &json!("outside_training"), &json!("hold")),
        "{reply}"
    );
    assert!(
        reply["message"]
            .as_str()
            .unwrap()
            .starts_with("candidates[1][1]")
    );
    assert_eq!(reply["contrast"].as_array().unwrap().len(), 2);
}

#[test]
fn a_picture_of_another_size_is_told_from_the_models() {
    let mut strict = session();
    let small = with(json!({"width": 240, "height": 135}));
    let message = held(&ask(&mut strict, &small), "other_camera");
    assert!(
        message.contains("1280 x 720 pixels") && message.contains("got 240 x 135"),
        "{message}"
    );
    let fitting = with(json!({"width": 1280, "height": 720}));
    assert_eq!(ask(&mut strict, &fitting)["valid"], true);
    // A size fed with the state counts as well.
    let state = with(json!({"op": "state", "width": 240, "height": 135}));
    assert_eq!(ask(&mut strict, &state)["ok"], true);
    held(&ask(&mut strict, &json!({"op": "suggest"})), "other_camera");
    // A size belongs to statistics, and is whole.
    for fields in [json!({"width": 240}), json!({"width": 1.5, "height": 2})] {
        assert_eq!(ask(&mut strict, &with(fields))["ok"], false);
    }
    let lone = json!({"op": "state", "depth_m": 3.0, "width": 240, "height": 135});
    assert_eq!(ask(&mut strict, &lone)["error"]["field"], "width");

    let warn = Checks {
        other_camera: Strictness::Warn,
        ..Checks::default()
    };
    let reply = ask(&mut session_with(water(), warn), &small);
    assert_eq!(reply["valid"], true, "{reply}");
    assert_eq!(reply["warnings"][0]["reason"], "other_camera");
}

#[test]
fn an_image_is_measured_with_its_size() {
    use base64::Engine as _;
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../calib/tests/data/s2_turbid.png"
    );
    let grid = uw_calib::PatchGrid::from_file(path.as_ref()).unwrap();
    let bytes = std::fs::read(path).unwrap();
    let base64 = base64::engine::general_purpose::STANDARD.encode(bytes);
    let mut request = with(json!({"op": "suggest_image", "image": {"base64_png": base64}}));
    let fields = request.as_object_mut().unwrap();
    fields.retain(|name, _| name != "mean" && name != "std");
    assert_eq!((grid.width, grid.height), (1280, 720));
    assert_eq!(ask(&mut session(), &request)["valid"], true);
    let mut document = echo_model(-2.0, 0.02);
    document["camera"] = json!({"width_px": 640, "height_px": 360});
    let mut other = session_of(&document, water(), Checks::default());
    let reply = ask(&mut other, &request);
    held(&reply, "other_camera");
    assert_eq!(
        (&reply["width"], &reply["height"]),
        (&json!(grid.width), &json!(grid.height))
    );
}

#[test]
fn a_profile_of_another_camera_is_told_when_it_is_set_and_asked() {
    let other = water().with_rig(Rig {
        width_px: Some(1280.0),
        height_px: Some(720.0),
        hfov_deg: Some(80.0),
        ..Rig::default()
    });
    let mut session = session();
    let document: Value = serde_json::from_str(&other.to_json()).unwrap();
    let set = ask(
        &mut session,
        &json!({"op": "set_profile", "profile": document}),
    );
    assert_eq!(set["profile"]["camera"]["hfov_deg"], 80.0, "{set}");
    let warned = set["warnings"][0].as_str().unwrap();
    assert!(
        warned.contains("camera.hfov_deg is 60 of the model and 80"),
        "{warned}"
    );
    held(&ask(&mut session, &suggest()), "other_camera");
}

#[test]
fn replies_tell_residuals_terms_and_why_in_numbers_that_mean_something() {
    let reply = ask(&mut session(), &suggest());
    assert_eq!(
        (&reply["valid"], &reply["action"]),
        (&json!(true), &json!("move"))
    );
    assert_eq!(
        reply["residual_here"],
        json!({"contrast": [0.0, 0.0, 0.0], "misfit": 0.0})
    );
    assert_eq!(reply["predicted_here"], json!([4.1, 7.7, 6.2]));
    let number = |value: &Value| value.as_f64().unwrap();
    let terms = &reply["score_terms"]["suggested"];
    let sum = number(&terms["contrast"]) + number(&terms["distance"]);
    // Each is rounded to four decimals.
    assert!((sum - number(&reply["score"])).abs() < 1.6e-4, "{reply}");
    let why = reply["why"].as_str().unwrap();
    assert!(
        why.starts_with("go ") && why.contains("the score rises by"),
        "{why}"
    );
    let decimals = |value: &Value| {
        let text = value.to_string();
        text.split_once('.')
            .map_or(0, |(_, decimals)| decimals.len())
    };
    for (value, most) in [
        (&reply["distance_m"], 2),
        (&reply["delta_distance_m"], 2),
        (&reply["light_pct"], 1),
        (&reply["delta_light_pct"], 1),
        (&reply["predicted_contrast"][0], 2),
        (&reply["score"], 4),
        (&reply["gain"], 4),
    ] {
        assert!(decimals(value) <= most, "{value} in {reply}");
    }
}

#[test]
fn a_gain_that_is_not_worth_a_move_is_held_and_valid() {
    let mut session = session();
    let first = ask(&mut session, &suggest());
    assert_eq!(first["action"], "move", "{first}");
    let there = with(json!({"distance_m": first["distance_m"], "light_pct": first["light_pct"]}));
    let reply = ask(&mut session, &there);
    assert_eq!(
        (&reply["valid"], &reply["action"], &reply["reason"]),
        (&json!(true), &json!("hold"), &json!("small_gain")),
        "{reply}"
    );
    assert_eq!(
        (&reply["gain"], &reply["delta_distance_m"]),
        (&json!(0.0), &json!(0.0))
    );
    assert_eq!(reply["distance_m"], first["distance_m"]);
}

#[test]
fn info_tells_camera_training_and_what_is_wanting() {
    let info = ask(&mut session(), &json!({"op": "info"}));
    let model = &info["model"];
    assert_eq!(model["camera"]["width_px"], 1280, "{info}");
    assert_eq!(model["training"]["textures"], json!(["hull_red"]));
    assert_eq!(model["trained_range"].as_array().unwrap().len(), 20);
    assert_eq!(
        (&model["sensor"], &info["profile"]["camera"]),
        (&Value::Null, &Value::Null)
    );
    assert_eq!(info["settings"]["checks"]["misfit"], "refuse");
    assert_eq!(info["warnings"], json!([]));
    let mut document: Value = serde_json::from_str(&water().to_json()).unwrap();
    for list in ["contrast_on", "contrast_off"] {
        document[list].as_array_mut().unwrap().truncate(1);
    }
    let one = Profile::from_json(&document).unwrap();
    let info = ask(
        &mut session_with(one, Checks::default()),
        &json!({"op": "info"}),
    );
    let warned = info["warnings"][0].as_str().unwrap();
    assert!(warned.contains("one distance only (0.5 m)"), "{warned}");
}
