//! Advice by physics, from pictures, through the program.

use std::process::Command;
use std::time::Instant;

use serde_json::{Value, json};

use uw_guidance::card::Sun;

use crate::client::{Client, PATIENCE, without};
use crate::known_water::{NOISE, SIZE_PX, attenuating, water_file, waves, write_picture};
use crate::program::{ANY_PORT, Program, text};

const DISTANCES_M: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
const CONFIG: &str = "[images]\ndirectory = \".\"\n[operations]\nrecord = \"session.ndjson\"\n";

/// A folder with a water file, and the program that predicts by it.
fn program(distances_m: &[f64], noise: [f64; 2], config: &str) -> Program {
    let file = water_file(distances_m, noise).to_json();
    Program::folder()
        .write("water.json", &file)
        .config(&format!("{config}{CONFIG}"))
        .start(&[&ANY_PORT[..], &["--water", "water.json"]].concat())
}

fn ask(client: &mut Client, op: &str, (distance_m, light_pct): (f64, f64), more: Value) -> Value {
    let mut request = without(&["mean", "std"]);
    request["op"] = json!(op);
    request["distance_m"] = json!(distance_m);
    request["light_pct"] = json!(light_pct);
    for (name, value) in more.as_object().unwrap() {
        request[name] = value.clone();
    }
    client.ask(&request)
}

fn image(name: &str) -> Value {
    json!({"image": {"path": name}})
}

fn numbers(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|k| value[k].as_f64().unwrap_or_else(|| panic!("{value}")))
}

#[test]
fn pictures_predict_with_errors_that_hold_and_earlier_ones_tell_the_residual() {
    let mut program = program(&DISTANCES_M, NOISE, "");
    let places = [(1.0, 20.0), (2.0, 80.0), (2.6, 0.0)];
    for (i, place) in places.iter().enumerate() {
        let path = program.path(&format!("{i}.png"));
        write_picture(&path, *place, &waves, NOISE);
    }
    let mut client = program.client();
    let first = ask(&mut client, "suggest_image", places[0], image("0.png"));
    assert_eq!(
        (
            &first["valid"],
            &first["predictor"],
            &first["residual_here"]
        ),
        (&json!(true), &json!("physics"), &Value::Null),
        "{first}"
    );
    let (here, measured) = (numbers(&first["predicted_here"]), numbers(&first["std"]));
    let errors = numbers(&first["predicted_contrast_error"]);
    for k in 0..3 {
        assert!((here[k] - measured[k]).abs() < 0.1, "{first}");
        assert!(errors[k] > 0.0 && errors[k] < 2.0, "{first}");
    }
    // The second is what the first predicts, within its errors.
    let asked = json!({"candidates": [[2.0, 80.0], [1.0, 20.0]]});
    let predicted = ask(&mut client, "predict", places[0], asked);
    let (contrast, error) = (&predicted["contrast"][0], &predicted["contrast_error"][0]);
    let second = ask(&mut client, "suggest_image", places[1], image("1.png"));
    let (contrast, error, std) = (numbers(contrast), numbers(error), numbers(&second["std"]));
    let residual = &second["residual_here"];
    for k in 0..3 {
        let off = contrast[k] - std[k];
        assert!(off.abs() < 3.0 * error[k], "{predicted} {second}");
        assert!(
            (numbers(&residual["contrast"])[k] - off).abs() < 0.011,
            "{second}"
        );
        assert!(
            numbers(&residual["standard_error"])[k] >= error[k],
            "{second}"
        );
    }
    assert_eq!(
        (&second["valid"], &residual["from"]),
        (&json!(true), &json!("picture"))
    );
    assert!(residual["misfit"].as_f64().unwrap() < 1.0, "{second}");
    // Statistics that another program measured are told as well, and a moved vehicle needs no new picture.
    let third = ask(&mut client, "suggest_image", places[2], image("2.png"));
    let own = json!({"mean": third["mean"], "std": third["std"]});
    let told = ask(&mut client, "suggest", places[2], own);
    assert_eq!(told["residual_here"]["from"], "picture", "{told}");
    let moved = ask(&mut client, "suggest", (1.7, 10.0), json!({}));
    assert_eq!(
        (&moved["valid"], &moved["predictor"]),
        (&json!(true), &json!("physics"))
    );
    // The picture belongs to the connection.
    let mut other = Client::to(client.stream.peer_addr().unwrap());
    let stranger = ask(
        &mut other,
        "suggest",
        places[0],
        json!({"mean": [41.0, 88.0, 79.0], "std": [4.1, 7.7, 6.2]}),
    );
    assert_eq!(
        (&stranger["valid"], &stranger["reason"]),
        (&json!(false), &json!("missing_input")),
        "{stranger}"
    );
    let info = other.ask(&json!({"op": "info"}));
    assert_eq!(
        (&info["predictor"], &info["model"]),
        (&json!("physics"), &Value::Null)
    );
    assert_eq!(info["water"]["distance_m"], json!([0.5, 4.0]), "{info}");
    // Subscriptions go on from the same picture.
    client.ask(&json!({"op": "state", "depth_m": 3.0, "distance_m": 2.6, "light_pct": 0.0}));
    client.ask(&json!({"op": "subscribe", "rate_hz": 20.0}));
    let pushed = client.receive();
    assert_eq!(
        (&pushed["valid"], &pushed["predictor"]),
        (&json!(true), &json!("physics")),
        "{pushed}"
    );
    numbers(&pushed["predicted_contrast_error"]);
    drop((client, other));
    assert_eq!(program.end(), Some(0));
    // The recording is answered again from the pictures.
    let replayed = Command::new(env!("CARGO_BIN_EXE_uwguide"))
        .current_dir(program.folder.path())
        .args([
            "replay",
            "session.ndjson",
            "--water",
            "water.json",
            "--config",
            "config.toml",
        ])
        .output()
        .unwrap();
    let said = text(&replayed.stdout);
    assert!(
        replayed.status.success() && said.contains(" 0 different"),
        "{said}"
    );
}

/// A target that has more detail away from its middle.
fn framed(x: f64, y: f64) -> f64 {
    let strength = if x.hypot(y) < 0.6 { 1.0 } else { 3.0 };
    0.3 + strength * (waves(x, y) - 0.3)
}

/// What a vehicle saw from afar before it came near tells what its near picture does not show, on its connection alone.
#[test]
fn what_was_seen_on_the_way_predicts_too() {
    let mut program = program(&DISTANCES_M, NOISE, "");
    let places = [(3.0, 0.0), (1.0, 0.0), (2.5, 0.0)];
    for (i, place) in places.iter().enumerate() {
        let path = program.path(&format!("{i}.png"));
        write_picture(&path, *place, &framed, NOISE);
    }
    let farther = json!({"candidates": [[2.5, 0.0]]});
    let mut come = program.client();
    ask(&mut come, "suggest_image", places[0], image("0.png"));
    let come_near = ask(&mut come, "suggest_image", places[1], image("1.png"));
    assert_eq!(come_near["earlier_m"], json!([3.0]), "{come_near}");
    let knowing = ask(&mut come, "predict", places[1], farther.clone());
    let truth = numbers(&ask(&mut come, "suggest_image", places[2], image("2.png"))["std"]);
    let mut other = Client::to(come.stream.peer_addr().unwrap());
    // Twice, so that the second has the first in mind.
    let near = |client: &mut Client| {
        for earlier_m in [json!([]), json!([1.0])] {
            let reply = ask(client, "suggest_image", places[1], image("1.png"));
            assert_eq!(reply["earlier_m"], earlier_m, "{reply}");
        }
    };
    near(&mut other);
    let alone = ask(&mut other, "predict", places[1], farther.clone());
    // What was seen in another file's water is forgotten.
    let mut water: Value =
        serde_json::from_slice(&std::fs::read(program.path("water.json")).unwrap()).unwrap();
    water["made_by"] = json!("another program");
    std::fs::write(program.path("water.json"), water.to_string()).unwrap();
    program.signal("-HUP");
    let deadline = Instant::now() + PATIENCE;
    while come.ask(&json!({"op": "health"}))["reloads"] != 1 {
        assert!(Instant::now() < deadline);
    }
    near(&mut come);
    let forgotten = ask(&mut come, "predict", places[1], farther);
    assert_eq!(forgotten["contrast"], alone["contrast"]);
    for k in 0..3 {
        let off = |reply: &Value| (numbers(&reply["contrast"][0])[k] / truth[k] - 1.0).abs();
        assert!(off(&knowing) < 0.1, "{knowing} {truth:?}");
        assert!(off(&alone) > 0.25, "{alone} {truth:?}");
    }
    drop((come, other));
    assert_eq!(program.end(), Some(0));
}

#[test]
fn what_no_number_can_be_had_from_is_held_with_its_reason() {
    let mut program = program(&[0.5, 1.0, 2.0], NOISE, "");
    let place = (1.0, 20.0);
    let write = |name: &str, reflectance: &dyn Fn(f64, f64) -> f64| {
        write_picture(&program.path(name), place, reflectance, NOISE);
    };
    write("good.png", &waves);
    write("grey.png", &|_, _| 0.3);
    write("white.png", &|_, _| 40.0);
    write("lit.png", &|x, y| 5.0 * waves(x, y));
    write("clipped.png", &|x, y| match (90.0 * x).sin() > 0.8 {
        true => 40.0,
        false => waves(x, y),
    });
    write("dark.png", &|_, _| -0.2);
    // Bright spots on a thousandth of a grey card: the quantiles of a patch do not have them.
    write(
        "spots.png",
        &|x, y| match [x, y].map(|at| (at / 0.1).fract().abs() - 0.5) {
            [u, v] if u.hypot(v) < 0.02 => 2.5,
            _ => 0.3,
        },
    );
    let smaller = image::imageops::thumbnail(
        &image::open(program.path("good.png")).unwrap().to_rgb8(),
        SIZE_PX[0] / 2,
        SIZE_PX[1] / 2,
    );
    smaller.save(program.path("smaller.png")).unwrap();
    let black = image::RgbImage::new(SIZE_PX[0], SIZE_PX[1]);
    black.save(program.path("black.png")).unwrap();
    let mut client = program.client();
    for (name, reason) in [
        ("grey.png", "noise_floor"),
        ("dark.png", "bad_observation"),
        ("white.png", "bad_observation"),
        ("lit.png", "other_light"),
        ("clipped.png", "saturated"),
        ("spots.png", "model_misfit"),
        ("smaller.png", "other_camera"),
        ("black.png", "bad_observation"),
    ] {
        let reply = ask(&mut client, "suggest_image", place, image(name));
        let held = (&reply["valid"], &reply["action"], &reply["reason"]);
        assert_eq!(
            held,
            (&json!(false), &json!("hold"), &json!(reason)),
            "{name}: {reply}"
        );
        assert_eq!(reply["predicted_contrast"], Value::Null, "{name}: {reply}");
        assert!(!reply["message"].as_str().unwrap().is_empty());
    }
    for name in ["missing.png", "../good.png", "water.json"] {
        let reply = ask(&mut client, "suggest_image", place, image(name));
        assert_eq!(reply["error"]["code"], "bad_image", "{name}: {reply}");
    }
    // Places where nothing can be.
    for distance_m in [1e-300, 1e-9, 1e9, 1e300] {
        let reply = ask(
            &mut client,
            "suggest_image",
            (distance_m, 20.0),
            image("good.png"),
        );
        assert_eq!(
            reply["error"]["code"], "out_of_range",
            "{distance_m}: {reply}"
        );
    }
    // Beyond the tables, in the profile; and a picture from another depth.
    let far = ask(&mut client, "suggest_image", (2.5, 20.0), image("good.png"));
    assert_eq!(
        (&far["valid"], &far["reason"]),
        (&json!(false), &json!("outside_tables")),
        "{far}"
    );
    assert_eq!(
        ask(&mut client, "suggest_image", place, image("good.png"))["valid"],
        true
    );
    let asked = ask(
        &mut client,
        "predict",
        place,
        json!({"candidates": [[2.5, 20.0]]}),
    );
    assert_eq!(
        asked["error"]["reason"]
            .as_str()
            .or(asked["reason"].as_str()),
        Some("outside_tables"),
        "{asked}"
    );
    let deeper = ask(&mut client, "suggest", place, json!({"depth_m": 4.0}));
    assert_eq!(
        (&deeper["valid"], &deeper["reason"]),
        (&json!(false), &json!("stale_input")),
        "{deeper}"
    );
}

/// Lamps ten times as bright as the file's: a picture without them does not predict the one with them.
#[test]
fn other_lamps_than_the_files_are_told_by_the_second_picture() {
    let mut program = program(&DISTANCES_M, NOISE, "");
    write_picture(&program.path("off.png"), (1.0, 0.0), &waves, NOISE);
    write_picture(&program.path("on.png"), (1.0, 1000.0), &waves, NOISE);
    let mut client = program.client();
    let first = ask(&mut client, "suggest_image", (1.0, 0.0), image("off.png"));
    assert_eq!(first["residual_here"], Value::Null, "{first}");
    let second = ask(&mut client, "suggest_image", (1.0, 100.0), image("on.png"));
    assert_eq!(
        (
            &second["valid"],
            &second["reason"],
            &second["predicted_contrast"]
        ),
        (&json!(false), &json!("model_misfit"), &Value::Null),
        "{second}"
    );
    let misfit = second["residual_here"]["misfit"].as_f64().unwrap();
    assert!(misfit > 1.0, "{second}");
}

#[test]
fn a_sensor_without_noise_is_one() {
    let mut program = program(&DISTANCES_M, [0.0; 2], "");
    write_picture(&program.path("now.png"), (1.0, 20.0), &waves, [0.0; 2]);
    let mut client = program.client();
    let reply = ask(&mut client, "suggest_image", (1.0, 20.0), image("now.png"));
    assert_eq!(reply["valid"], true, "{reply}");
    numbers(&reply["predicted_contrast"]);
}

#[test]
fn the_configuration_says_which_of_two_predicts() {
    let mut program = program(&DISTANCES_M, NOISE, "predictor = \"network\"\n");
    let mut client = program.client();
    let mut request = without(&[]);
    request["op"] = json!("suggest");
    assert_eq!(client.ask(&request)["predictor"], "network");
    let plain = Program::folder().start(&ANY_PORT);
    let mut plain = plain;
    let reply = plain.client().ask(&request);
    assert_eq!(reply.get("predictor"), None, "{reply}");
    assert_eq!(reply.get("predicted_contrast_error"), None, "{reply}");
}

#[test]
fn files_in_the_wrong_place_are_refused_by_name() {
    let folder = Program::folder()
        .write("water.json", &water_file(&DISTANCES_M, NOISE).to_json())
        .write(
            "cut.json",
            &water_file(&DISTANCES_M, NOISE).to_json()[..3000],
        )
        .write(
            "physics.toml",
            "format = \"uwguide-config/1\"\npredictor = \"physics\"\n",
        )
        .write(
            "magic.toml",
            "format = \"uwguide-config/1\"\npredictor = \"magic\"\n",
        )
        .write(
            "file.toml",
            "format = \"uwguide-config/1\"\n[water]\nfile = \"water.json\"\n",
        );
    let run = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_uwguide"))
            .current_dir(folder.folder.path())
            .args(["--profile", "profile.json", "--check-config"])
            .args(arguments)
            .output()
            .unwrap();
        (output.status.code(), text(&output.stderr))
    };
    for (arguments, told) in [
        (
            &["--water", "model.json"][..],
            "this is a model; give it as --model",
        ),
        (
            &["--water", "profile.json"],
            "this is a calibration profile; give it as --profile",
        ),
        (
            &["--model", "water.json"],
            "this is a water file; give it as --water",
        ),
        (&["--water", "cut.json"], "not a usable water file"),
        (&["--water", "missing.json"], "missing.json: cannot be read"),
        (
            &["--model", "model.json", "--config", "physics.toml"],
            "physics needs a water file",
        ),
        (
            &["--config", "magic.toml"],
            "predictor must be \"network\" or \"physics\"",
        ),
    ] {
        let (code, said) = run(arguments);
        assert_eq!(code, Some(2), "{arguments:?}: {said}");
        assert!(said.contains(told), "{arguments:?}: {said}");
    }
    for arguments in [&["--water", "water.json"][..], &["--config", "file.toml"]] {
        let (code, said) = run(arguments);
        assert_eq!(code, Some(0), "{arguments:?}: {said}");
    }
}

/// Attenuation that is wrong by 35 % over 1.5 m: the contrast of the second picture does not tell, its mean does.
#[test]
fn a_water_that_attenuates_by_a_third_more_is_told_by_the_mean_of_the_second_picture() {
    let places = [(0.6, 20.0), (2.1, 20.0)];
    for (times, is_right) in [(1.0, true), (1.35, false), (0.65, false)] {
        let file = attenuating(times, &DISTANCES_M, NOISE).to_json();
        let mut program = Program::folder()
            .write("water.json", &file)
            .config(CONFIG)
            .start(&[&ANY_PORT[..], &["--water", "water.json"]].concat());
        let address = program.client().stream.peer_addr().unwrap();
        for seed in 0..4 {
            // Another part of the target each time, and a vehicle that drifts on its way.
            let (x, y) = (1.7 * f64::from(seed), 0.9 * f64::from(seed));
            let mut client = Client::to(address);
            let mut second = Value::Null;
            for (i, (place, drift)) in places.into_iter().zip([0.0, 0.05]).enumerate() {
                let name = format!("{times}-{seed}-{i}.png");
                let moved = |u: f64, v: f64| waves(u + x + drift, v + y - drift);
                write_picture(&program.path(&name), place, &moved, NOISE);
                second = ask(&mut client, "suggest_image", place, image(&name));
            }
            let residual = &second["residual_here"];
            assert_eq!(residual["same_part"], true, "{times}: {second}");
            let reason = second["reason"].as_str();
            match is_right {
                true => assert_eq!(second["valid"], true, "{times}: {second}"),
                false => assert_eq!(reason, Some("model_misfit"), "{times}: {second}"),
            }
            // Which the contrast alone would not have told.
            let [off, error] = ["contrast", "standard_error"].map(|name| numbers(&residual[name]));
            assert!((0..3).all(|k| off[k].abs() < 3.0 * error[k]), "{second}");
        }
    }
}

/// A picture that a camera compressed, and one without the noise of its sensor: warnings, or refused where that is asked.
#[test]
fn pictures_that_were_compressed_or_denoised_are_told() {
    let place = (1.0, 20.0);
    for (config, is_valid) in [("", true), ("[checks]\nprocessing = \"refuse\"\n", false)] {
        let mut program = program(&DISTANCES_M, NOISE, config);
        let write = |name: &str, noise| write_picture(&program.path(name), place, &waves, noise);
        write("raw.png", NOISE);
        write("smooth.png", [0.0; 2]);
        let raw = image::open(program.path("raw.png")).unwrap();
        raw.save(program.path("raw.jpg")).unwrap();
        let mut client = program.client();
        for (name, told) in [
            ("raw.png", &[][..]),
            ("raw.jpg", &["compressed", "denoised"]),
            ("smooth.png", &["denoised"]),
        ] {
            let reply = ask(&mut client, "suggest_image", place, image(name));
            if is_valid || told.is_empty() {
                let warnings = reply["warnings"].as_array().unwrap();
                let names: Vec<_> = warnings
                    .iter()
                    .map(|w| w["reason"].as_str().unwrap())
                    .collect();
                assert_eq!(
                    (&reply["valid"], &names[..]),
                    (&json!(true), told),
                    "{reply}"
                );
            } else {
                let held = (&reply["valid"], &reply["reason"]);
                assert_eq!(held, (&json!(false), &json!(told[0])), "{name}: {reply}");
            }
        }
    }
}

/// A channel with more than a tenth of its pixels at full scale has no number, the others do; with less all do, with a warning.
#[test]
fn a_channel_that_the_picture_does_not_tell_is_null() {
    let place = (1.0, 20.0);
    let mut program = program(&DISTANCES_M, NOISE, "");
    let mut client = program.client();
    for (every, told) in [(7, [false, true, true]), (19, [true; 3])] {
        write_picture(&program.path("red.png"), place, &waves, NOISE);
        let mut picture = image::open(program.path("red.png")).unwrap().to_rgb8();
        for (x, y, pixel) in picture.enumerate_pixels_mut() {
            if (x + 3 * y) % every == 0 {
                pixel[0] = 255;
            }
        }
        picture.save(program.path("red.png")).unwrap();
        let reply = ask(&mut client, "suggest_image", place, image("red.png"));
        assert_eq!(reply["valid"], true, "{reply}");
        let warned = reply["warnings"].as_array().unwrap();
        assert!(warned.iter().any(|w| w["reason"] == "saturated"), "{reply}");
        let asked = json!({"candidates": [[1.5, 40.0]]});
        let predicted = ask(&mut client, "predict", place, asked);
        for numbers in [
            &reply["predicted_contrast"],
            &reply["predicted_contrast_error"],
            &reply["predicted_here"],
            &predicted["contrast"][0],
            &predicted["contrast_error"][0],
        ] {
            let numbers = [0, 1, 2].map(|k| numbers[k].is_number());
            assert_eq!(numbers, told, "{reply} {predicted}");
        }
    }
}

/// A request that tells another sun than that of the water file's tables: a warning, or refused where that is asked.
#[test]
fn another_sun_than_that_of_the_tables_is_told() {
    let place = (1.0, 20.0);
    let mut file = water_file(&DISTANCES_M, NOISE);
    let known = Sun {
        zenith_deg: 30.0,
        azimuth_deg: 0.0,
    };
    file.tables.sun = Some(known);
    for (config, is_valid) in [("", true), ("[checks]\nother_sun = \"refuse\"\n", false)] {
        let mut program = Program::folder()
            .write("water.json", &file.to_json())
            .config(&format!("{CONFIG}{config}"))
            .start(&[&ANY_PORT[..], &["--water", "water.json"]].concat());
        write_picture(&program.path("now.png"), place, &waves, NOISE);
        let mut client = program.client();
        for (sun, is_known) in [
            (json!({}), true),
            (json!({"sun_zenith_deg": 45.0}), true),
            (json!({"sun_azimuth_deg": -30.0}), true),
            (
                json!({"sun_zenith_deg": 5.0, "sun_azimuth_deg": 180.0}),
                false,
            ),
            (json!({"sun_azimuth_deg": 180.0}), false),
            (json!({"sun_zenith_deg": 60.0}), false),
        ] {
            let mut request = image("now.png");
            let fields = sun.as_object().unwrap().clone();
            request.as_object_mut().unwrap().extend(fields);
            let reply = ask(&mut client, "suggest_image", place, request);
            assert_eq!(reply["valid"], is_known || is_valid, "{sun}: {reply}");
            let told = match is_valid {
                true => &reply["warnings"][0]["reason"],
                false => &reply["reason"],
            };
            assert_eq!(told == "other_sun", !is_known, "{sun}: {reply}");
        }
        let wrong = ask(
            &mut client,
            "suggest",
            place,
            json!({"sun_zenith_deg": 90.0}),
        );
        assert_eq!(wrong["error"]["field"], "sun_zenith_deg", "{wrong}");
    }
}
