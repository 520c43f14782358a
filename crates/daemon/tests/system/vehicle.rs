//! A vehicle's file given to the program: its noise serves pictures, and what is made for another camera is refused.

use serde_json::json;

use crate::client::{with, without};
use crate::program::{ANY_PORT, Program, text};

/// A vehicle of the test model's camera.
const SAME: &str = "format = \"uw-vehicle/1\"\nhfov_deg = 60.0\nnoise_a = 3e-4\n";
/// Another lens.
const OTHER: &str = "format = \"uw-vehicle/1\"\nhfov_deg = 90.0\n";

fn write_picture(program: &Program) {
    let picture = image::RgbImage::from_fn(1280, 720, |x, y| {
        image::Rgb([(100 + (x / 4 + y / 4) % 40) as u8; 3])
    });
    picture.save(program.path("now.png")).unwrap();
}

#[test]
fn the_vehicles_noise_is_taken_off_pictures() {
    let config = "[images]\ndirectory = \".\"\n[vehicle]\nfile = \"same.toml\"\n";
    let mut program = Program::folder()
        .write("same.toml", SAME)
        .config(config)
        .start(&ANY_PORT);
    write_picture(&program);
    let mut client = program.client();
    let info = client.ask(&json!({"op": "info"}));
    assert_eq!(info["settings"]["images"]["noise"], "sensor", "{info}");
    assert_eq!(info["settings"]["vehicle"]["sensor"]["noise_a"], 3e-4);
    let mut request = without(&["mean", "std"]);
    request["op"] = json!("suggest_image");
    request["image"] = json!({"path": "now.png"});
    let reply = client.ask(&request);
    // The picture is made without noise, which only who knows the sensor can tell.
    assert_eq!(reply["warnings"][0]["reason"], "denoised", "{reply}");
    assert_eq!(program.end(), Some(0));
}

/// The same picture behind a lens that leaves half of the light in the corners: it was brighter than it is stored.
#[test]
fn the_vehicles_vignetting_is_taken_out_of_pictures() {
    let ask = |vehicle: &str| {
        let config = "[images]\ndirectory = \".\"\n[vehicle]\nfile = \"same.toml\"\n";
        let mut program = Program::folder()
            .write("same.toml", vehicle)
            .config(config)
            .start(&ANY_PORT);
        write_picture(&program);
        let mut request = without(&["mean", "std"]);
        request["op"] = json!("suggest_image");
        request["image"] = json!({"path": "now.png"});
        let reply = program.client().ask(&request);
        assert_eq!(program.end(), Some(0));
        [0, 1, 2].map(|k| reply["mean"][k].as_f64().unwrap())
    };
    let plain = ask(SAME);
    let even = ask(&format!("{SAME}vignetting = [-0.5, 0.0, 0.0]\n"));
    for (even, plain) in even.into_iter().zip(plain) {
        // r² is a third on average, so light is 1.19 times as much; counts go as its 2.4th root or so.
        assert!((1.05..1.12).contains(&(even / plain)), "{even} {plain}");
    }
}

#[test]
fn what_is_made_for_another_camera_is_refused_and_told_at_the_start() {
    let program = Program::folder().write("other.toml", OTHER);
    let checked = program.output(&["--vehicle", "other.toml", "--check-config"]);
    let told = text(&checked.stderr);
    let words = "vehicle and model must be of the same camera and lamps: camera.hfov_deg is 90 of the vehicle and 60 of the model";
    assert!(told.contains(words), "{told}");
    let arguments = ["--vehicle", "other.toml", ANY_PORT[0], ANY_PORT[1]];
    let mut program = program.start(&arguments);
    let reply = program.client().ask(&without(&[]));
    assert_eq!(
        (&reply["valid"], &reply["reason"]),
        (&json!(false), &json!("other_camera")),
        "{reply}"
    );
    let message = reply["message"].as_str().unwrap();
    assert!(message.contains(words), "{message}");
}

#[test]
fn a_vehicle_that_cannot_be_used_ends_the_start() {
    let program =
        Program::folder().write("wrong.toml", "format = \"uw-vehicle/1\"\nhfov_deg = -1\n");
    for (vehicle, words) in [
        (
            "wrong.toml",
            "wrong.toml: vehicle.hfov_deg must be in (0, 179], got -1",
        ),
        ("none.toml", "none.toml: cannot be read"),
        (
            "yacht",
            "neither a file (*.toml) nor one of the shipped vehicles (default)",
        ),
    ] {
        let output = program.output(&["--vehicle", vehicle, "--check-config"]);
        assert_eq!(output.status.code(), Some(2), "{vehicle}");
        assert!(
            text(&output.stderr).contains(words),
            "{}",
            text(&output.stderr)
        );
    }
}

/// Lamps whose light is not in proportion to their level: a request may say either, a reply says both.
#[test]
fn levels_of_lamps_become_light_and_back() {
    let curve = "level_curve = [[0, 0], [50, 20], [100, 100]]\n";
    let config = "[vehicle]\nfile = \"curved.toml\"\n";
    let mut program = Program::folder()
        .write("curved.toml", &format!("{SAME}{curve}"))
        .config(config)
        .start(&ANY_PORT);
    let mut client = program.client();
    let info = client.ask(&json!({"op": "info"}));
    let told = &info["settings"]["level_curve"];
    assert_eq!(told, &json!([[0.0, 0.0], [50.0, 20.0], [100.0, 100.0]]));
    let light = client.ask(&with(json!({"light_pct": 20.0})));
    let mut request = without(&["light_pct"]);
    request["level_pct"] = json!(50.0);
    let level = client.ask(&request);
    for field in ["valid", "distance_m", "light_pct", "level_pct", "score"] {
        assert_eq!(light[field], level[field], "{field}");
    }
    let number = |field: &str| light[field].as_f64().unwrap();
    let (suggested, set) = (number("light_pct"), number("level_pct"));
    let expected = match suggested {
        light if light < 20.0 => 2.5 * light,
        light => 50.0 + (light - 20.0) / 1.6,
    };
    assert!((set - expected).abs() < 0.01, "{light}");
    // The state takes levels too, and what is pushed says what to set.
    let mut state = request.clone();
    state["op"] = json!("state");
    assert_eq!(client.ask(&state)["ok"], true);
    client.ask(&json!({"op": "subscribe", "rate_hz": 20}));
    let push = client.receive();
    assert_eq!(push["push"], true, "{push}");
    let (light_pct, level_pct) = (push["light_pct"].as_f64(), push["level_pct"].as_f64());
    assert!(
        light_pct.zip(level_pct).is_some_and(|(l, p)| p > l),
        "{push}"
    );
    assert!(push["target"]["level_pct"].is_number(), "{push}");
    client.ask(&json!({"op": "unsubscribe"}));
    request["light_pct"] = json!(20.0);
    let both = client.ask(&request);
    assert_eq!(both["error"]["field"], "level_pct", "{both}");
    assert_eq!(program.end(), Some(0));
}
