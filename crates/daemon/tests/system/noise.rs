//! Pictures that show no more than noise, and clipped ones, through the daemon.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};
use uw_guidance::service::{ImagePolicy, Loaded, Settings};
use uw_guidance::{Checks, Limits, Model, Running, Service, Strictness, spawn};

use crate::client::{Client, with, without};
use crate::support::{Numbers, echo_model, profile};

/// A daemon whose model predicts for no change what the picture has, whatever that is: no misfit tells it noise.
fn daemon(images: &Path, checks: Checks) -> Running {
    let loaded = Loaded {
        basis: Model::from_json(&echo_model(-2.0, 0.02)).unwrap().into(),
        model_name: "echo".to_owned(),
        model_digest: String::new(),
        profile: Some(Arc::new(profile(&mut Numbers::new(3)))),
    };
    let settings = Settings {
        images: ImagePolicy::Under(images.into()),
        checks,
        ..Settings::default()
    };
    let service = Service::with_settings(loaded, settings);
    spawn("127.0.0.1:0", service, Limits::default()).unwrap()
}

/// Writes a picture of the model's camera: `light` of a place, with noise of 8 counts that is clipped at black, as a sensor's is.
fn write(path: &Path, light: impl Fn(f64, f64) -> [f64; 3]) {
    let mut numbers = Numbers::new(11);
    let picture = image::RgbImage::from_fn(1280, 720, |x, y| {
        let counts = light(f64::from(x), f64::from(y)).map(|counts| {
            // The sum of twelve uniform numbers is close to a normal one.
            let normal: f64 = (0..12).map(|_| numbers.between(-0.5, 0.5)).sum();
            (counts + 8.0 * normal).round().clamp(0.0, 255.0) as u8
        });
        image::Rgb(counts)
    });
    picture.save(path).unwrap();
}

fn detail(x: f64, y: f64) -> f64 {
    12.0 * (0.2 * x).sin() * (0.25 * y).cos()
}

fn suggest_image(name: &str) -> Value {
    let mut request = without(&["mean", "std"]);
    request["op"] = json!("suggest_image");
    request["image"] = json!({"path": name});
    request
}

#[test]
fn a_picture_that_is_black_but_for_noise_is_not_answered_with_advice() {
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("black.png"), |_, _| [0.0; 3]);
    let running = daemon(dir.path(), Checks::default());
    let mut client = Client::connect(&running);
    let reply = client.ask(&suggest_image("black.png"));
    assert_eq!(
        (
            &reply["ok"],
            &reply["valid"],
            &reply["action"],
            &reply["reason"]
        ),
        (
            &json!(true),
            &json!(false),
            &json!("hold"),
            &json!("noise_floor")
        ),
        "{reply}"
    );
    let message = reply["message"].as_str().unwrap();
    assert!(
        message.starts_with("the picture shows no more than noise"),
        "{message}"
    );
    for k in 0..3 {
        let number = |field: &str| reply[field][k].as_f64().unwrap();
        assert!(number("std") > 4.0, "{reply}");
        assert!(number("std_corrected") <= number("noise_floor"), "{reply}");
        assert!(number("noise_floor") < 1.0, "{reply}");
    }
    // Its published statistics alone are those of a dark picture with detail: nothing else stops the advice.
    let published = with(json!({"mean": reply["mean"], "std": reply["std"]}));
    assert_eq!(client.ask(&published)["valid"], true);
    // The numbers may also come with the statistics, from a client that measures its pictures itself, or be fed before.
    let quality = json!({"mean": reply["mean"], "std": reply["std"], "std_corrected": reply["std_corrected"],
        "noise_floor": reply["noise_floor"], "saturated": reply["saturated"]});
    assert_eq!(client.ask(&with(quality.clone()))["reason"], "noise_floor");
    let mut state = quality;
    state["op"] = json!("state");
    assert_eq!(client.ask(&state)["ok"], true);
    assert_eq!(
        client.ask(&without(&["mean", "std"]))["reason"],
        "noise_floor"
    );
    let predict = json!({"op": "predict", "depth_m": 3.0, "distance_m": 1.0, "light_pct": 20.0, "candidates": [[1.5, 20.0]]});
    let reply = client.ask(&predict);
    assert_eq!(
        (&reply["valid"], &reply["reason"]),
        (&json!(false), &json!("noise_floor"))
    );
    // Who knows better may say so.
    let lenient = Checks {
        noise_floor: Strictness::Ignore,
        ..Checks::default()
    };
    let running = daemon(dir.path(), lenient);
    let reply = Client::connect(&running).ask(&suggest_image("black.png"));
    assert_eq!(reply["valid"], true, "{reply}");
}

#[test]
fn a_channel_without_detail_and_a_clipped_one_are_told() {
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("good.png"), |x, y| {
        [60.0 + detail(x, y); 3]
    });
    write(&dir.path().join("no_red.png"), |x, y| {
        [0.0, 60.0 + detail(x, y), 60.0 + detail(x, y)]
    });
    write(&dir.path().join("glare.png"), |x, y| {
        let blue = if x < 64.0 { 400.0 } else { 60.0 + detail(x, y) };
        [60.0 + detail(x, y), 60.0 + detail(x, y), blue]
    });
    let running = daemon(dir.path(), Checks::default());
    let mut client = Client::connect(&running);
    let mut told = |name: &str| {
        let reply = client.ask(&suggest_image(name));
        assert_eq!(reply["valid"], true, "{reply}");
        let warnings = reply["warnings"].as_array().unwrap().clone();
        (reply, warnings)
    };
    let (reply, warnings) = told("good.png");
    assert!(warnings.is_empty(), "{reply}");
    // 12 sin cos deviates by 6; with noise of 8 counts the published contrast is 10.
    assert!(
        (reply["std"][0].as_f64().unwrap() - 10.0).abs() < 0.2,
        "{reply}"
    );
    assert!(
        (reply["std_corrected"][0].as_f64().unwrap() - 6.0).abs() < 0.2,
        "{reply}"
    );
    let (_, warnings) = told("no_red.png");
    assert_eq!(warnings.len(), 1);
    assert_eq!(warnings[0]["reason"], "noise_floor");
    let message = warnings[0]["message"].as_str().unwrap();
    assert!(
        message.starts_with("R of the picture shows no more than noise"),
        "{message}"
    );
    let (reply, warnings) = told("glare.png");
    assert_eq!(reply["saturated"][2], json!(0.05));
    assert_eq!(warnings.len(), 1);
    assert_eq!(warnings[0]["reason"], "saturated");
    let message = warnings[0]["message"].as_str().unwrap();
    assert!(
        message.starts_with("0.0 0.0 5.0 % of the pixels") && message.contains("1 % is allowed"),
        "{message}"
    );
    let strict = Checks {
        noise_floor: Strictness::Refuse,
        saturation: Strictness::Refuse,
        ..Checks::default()
    };
    let running = daemon(dir.path(), strict);
    let mut client = Client::connect(&running);
    for (name, reason) in [("no_red.png", "noise_floor"), ("glare.png", "saturated")] {
        let reply = client.ask(&suggest_image(name));
        assert_eq!(
            (&reply["valid"], &reply["reason"]),
            (&json!(false), &json!(reason))
        );
    }
    assert_eq!(client.ask(&suggest_image("good.png"))["valid"], true);
}

#[test]
fn numbers_of_noise_come_all_and_in_range() {
    let dir = tempfile::tempdir().unwrap();
    let running = daemon(dir.path(), Checks::default());
    let mut client = Client::connect(&running);
    let good =
        json!({"std_corrected": [4, 7, 6], "noise_floor": [0.3, 0.3, 0.3], "saturated": [0, 0, 0]});
    assert_eq!(client.ask(&with(good.clone()))["valid"], true);
    for (name, value, field) in [
        ("std_corrected", json!([300, 1, 1]), "std_corrected[0]"),
        ("noise_floor", json!([0.3, -1, 0.3]), "noise_floor[1]"),
        ("saturated", json!([0, 0, 2]), "saturated[2]"),
        ("saturated", Value::Null, "saturated"),
    ] {
        let mut wrong = good.clone();
        wrong[name] = value.clone();
        if value.is_null() {
            wrong.as_object_mut().unwrap().remove(name);
        }
        assert_eq!(client.refused(&with(wrong))["field"], field);
    }
    let mut alone = without(&["mean", "std"]);
    alone["noise_floor"] = json!([0.3, 0.3, 0.3]);
    assert_eq!(client.refused(&alone)["field"], "noise_floor");
    let info = client.ask(&json!({"op": "info"}));
    assert_eq!(info["settings"]["images"]["noise"], "picture");
    assert_eq!(info["settings"]["checks"]["noise_floor"], "warn");
}

/// A recording holds no pictures: what was measured in them is taken from the replies.
#[cfg(unix)]
#[test]
fn a_recording_of_pictures_of_noise_is_answered_the_same_again() {
    use crate::files::replay;
    use crate::program::{ANY_PORT, Program};

    let program = Program::folder();
    let images = program.path("images");
    std::fs::create_dir(&images).unwrap();
    write(&images.join("black.png"), |_, _| [0.0; 3]);
    write(&images.join("glare.png"), |x, y| {
        [if x < 64.0 { 400.0 } else { 60.0 + detail(x, y) }; 3]
    });
    let config =
        format!("[images]\ndirectory = {images:?}\n[operations]\nrecord = \"session.ndjson\"\n");
    let mut program = program.config(&config).start(&ANY_PORT);
    let mut client = program.client();
    let reply = client.ask(&suggest_image("black.png"));
    assert_eq!(reply["reason"], "noise_floor");
    let reply = client.ask(&suggest_image("glare.png"));
    assert_eq!(reply["warnings"][0]["reason"], "saturated");
    assert_eq!(program.end(), Some(0));
    let (code, said, _) = replay(&program, "session.ndjson");
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.starts_with("2 replies the same, 0 different"),
        "{said}"
    );
}

/// The recording as a program wrote it that knew nothing of noise and other depths.
#[cfg(unix)]
fn as_older(recording: &str) -> String {
    let settings = |value: &mut Value| {
        let sections = value["settings"].as_object_mut().unwrap();
        sections.remove("images");
        let checks = sections["checks"].as_object_mut().unwrap();
        let newer = [
            "other_depth",
            "depth_margin_m",
            "noise_floor",
            "saturation",
            "max_saturated",
            "other_sun",
            "oblique",
            "max_obliqueness_deg",
            "processing",
        ];
        assert!(newer.iter().all(|name| checks.remove(*name).is_some()));
    };
    let mut older = String::new();
    for line in recording.lines() {
        let mut record: Value = serde_json::from_str(line).unwrap();
        if record["kind"] == "start" {
            settings(&mut record);
        } else {
            let mut reply: Value = serde_json::from_str(record["reply"].as_str().unwrap()).unwrap();
            if reply.get("settings").is_some() {
                settings(&mut reply);
            }
            let measured = ["std_corrected", "noise_floor", "saturated"];
            let fields = reply.as_object_mut().unwrap();
            fields.retain(|name, _| !measured.contains(&name.as_str()));
            if let Some(message) = reply.pointer_mut("/error/message") {
                let known = message.as_str().unwrap();
                *message = known
                    .replace("std_corrected, noise_floor, saturated, ", "")
                    .into();
            }
            record["reply"] = reply.to_string().into();
        }
        older += &format!("{record}\n");
    }
    older
}

/// What an older program did not check is not checked when its recording is answered again.
#[cfg(unix)]
#[test]
fn a_recording_of_an_older_program_is_answered_the_same_again() {
    use crate::files::replay;
    use crate::program::{ANY_PORT, Program};

    let program = Program::folder();
    profile(&mut Numbers::new(3))
        .with_contrast_depth([0.5, 1.0])
        .unwrap()
        .write(&program.path("profile.json"))
        .unwrap();
    let images = program.path("images");
    std::fs::create_dir(&images).unwrap();
    write(&images.join("black.png"), |_, _| [0.0; 3]);
    let config = format!(
        "[checks]\nother_depth = \"ignore\"\nnoise_floor = \"ignore\"\nsaturation = \"ignore\"\n\
         [images]\ndirectory = {images:?}\n[operations]\nrecord = \"session.ndjson\"\n"
    );
    let mut program = program.config(&config).start(&ANY_PORT);
    let mut client = program.client();
    let noise = json!({"std_corrected": [0.1, 0.1, 0.1], "noise_floor": [0.3, 0.3, 0.3], "saturated": [0.5, 0.5, 0.5]});
    for request in [
        suggest_image("black.png"),
        with(json!({"depth_m": 3.0})),
        with(noise),
    ] {
        let reply = client.ask(&request);
        assert_eq!(reply["valid"], true, "{reply}");
        assert_eq!(reply["warnings"], json!([]), "{reply}");
    }
    assert_eq!(client.ask(&json!({"op": "info"}))["ok"], true);
    let unknown = client.refused(&with(json!({"colour": "red"})));
    assert_eq!(unknown["field"], "colour");
    assert_eq!(program.end(), Some(0));
    let recording = std::fs::read_to_string(program.path("session.ndjson")).unwrap();
    let older = as_older(&recording);
    std::fs::write(program.path("older.ndjson"), &older).unwrap();
    let (code, said, told) = replay(&program, "older.ndjson");
    assert_eq!(code, Some(0), "{said}{told}");
    assert!(
        said.starts_with("5 replies the same, 0 different"),
        "{said}"
    );
    // What that program knew has to be as it was.
    for (from, to, expected) in [
        ("\"misfit\":\"refuse\"", "\"misfit\":\"warn\"", Some(2)),
        ("\"misfit\":\"refuse\",", "", Some(2)),
        ("\\\"misfit\\\":\\\"refuse\\\",", "", Some(1)),
    ] {
        let other = older.replacen(from, to, 1);
        assert_ne!(other, older, "{from}");
        std::fs::write(program.path("other.ndjson"), other).unwrap();
        let (code, said, told) = replay(&program, "other.ndjson");
        assert_eq!(code, expected, "{from}: {said}{told}");
    }
}
