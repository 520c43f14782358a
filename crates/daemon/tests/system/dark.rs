//! A vehicle in the dark: at night, or deeper than daylight reaches, with no profile, by physics and lamps alone.

use serde_json::{Value, json};

use crate::client::without;
use crate::known_water::{NOISE, dark, waves, write_picture};
use crate::program::{ANY_PORT, Program, get, text};

const DISTANCES_M: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
const HERE_M: f64 = 1.0;
const NEAR_M: f64 = 0.7;

/// The program without a profile, in a folder with pictures from [`HERE_M`] and [`NEAR_M`] with the lamps at 100 %.
fn program(config: &str) -> Program {
    let folder = Program::folder().write("water.json", &dark(&DISTANCES_M, NOISE).to_json());
    for (name, distance_m) in [("here.png", HERE_M), ("near.png", NEAR_M)] {
        write_picture(&folder.path(name), (distance_m, 100.0), &waves, NOISE);
    }
    folder
        .config(&format!("{config}[images]\ndirectory = \".\"\n"))
        .start(&[&ANY_PORT[..], &["--water", "water.json", "--no-profile"]].concat())
}

/// What the picture asks 400 m deep.
fn suggest_image(more: Value) -> Value {
    let mut request = without(&["mean", "std"]);
    request["op"] = json!("suggest_image");
    request["image"] = json!({"path": "here.png"});
    (request["distance_m"], request["light_pct"]) = (json!(HERE_M), json!(100.0));
    request["depth_m"] = json!(400.0);
    for (name, value) in more.as_object().unwrap() {
        request[name] = value.clone();
    }
    request
}

#[test]
fn advice_in_the_dark_needs_no_profile() {
    let mut program =
        program("[objective]\npreset = \"tracking\"\n[operations]\nmetrics = \"127.0.0.1:0\"\n");
    let checked = program.output(&["--water", "water.json", "--no-profile", "--check-config"]);
    assert_eq!(text(&checked.stderr), "");
    let port = program.told("uwguide metrics on ");
    let mut client = program.client();
    assert_eq!(get(&port, "/readyz").0, "HTTP/1.1 200 OK");
    let told = client.ask(&suggest_image(json!({})));
    assert_eq!(
        (&told["valid"], &told["predictor"]),
        (&json!(true), &json!("physics")),
        "{told}"
    );
    assert!(
        told["score_terms"]["suggested"]["overlap"]
            .as_f64()
            .unwrap()
            > 0.0,
        "{told}"
    );
    // Another depth is no other daylight.
    let [lit, unlit] = [[NEAR_M, 100.0], [NEAR_M, 0.0]];
    let asked = json!({"op": "predict", "candidates": [lit, unlit], "distance_m": HERE_M, "light_pct": 100.0, "depth_m": 400.2});
    let predicted = client.ask(&asked);
    assert_eq!(predicted["valid"], true, "{predicted}");
    let near = json!({"image": {"path": "near.png"}, "distance_m": NEAR_M});
    let near = client.ask(&suggest_image(near));
    assert_eq!(near["valid"], true, "{near}");
    for k in 0..3 {
        let [lit, unlit, error, seen] = [
            &predicted["contrast"][0][k],
            &predicted["contrast"][1][k],
            &predicted["contrast_error"][0][k],
            &near["std"][k],
        ]
        .map(|number| number.as_f64().unwrap());
        assert!((lit - seen).abs() < 3.0 * error, "{predicted} {near}");
        // Without lamps nothing is left but the noise of a black picture.
        assert!((1.5..2.5).contains(&unlit) && lit > unlit, "{predicted}");
    }
    let state = json!({"op": "state", "depth_m": 400.0, "distance_m": HERE_M, "light_pct": 100.0});
    assert_eq!(client.ask(&state)["ok"], true);
    let begun = client.ask(&json!({"op": "subscribe", "id": "s", "rate_hz": 10.0}));
    assert_eq!(begun["ok"], true, "{begun}");
    let pushed = client.receive();
    assert_eq!(
        (&pushed["push"], &pushed["valid"]),
        (&json!(true), &json!(true)),
        "{pushed}"
    );
    client.ask(&json!({"op": "unsubscribe"}));
    let info = client.ask(&json!({"op": "info"}));
    assert_eq!(
        (&info["profile"], &info["water"]["depth_m"]),
        (&Value::Null, &Value::Null)
    );
    assert_eq!(program.end(), Some(0));
}

#[test]
fn an_objective_that_needs_a_profile_says_so_in_the_dark() {
    let mut program = program("[operations]\nmetrics = \"127.0.0.1:0\"\n");
    let checked = program.output(&["--water", "water.json", "--no-profile", "--check-config"]);
    let said = text(&checked.stderr);
    assert!(said.contains("K_z and K_c: send set_profile"), "{said}");
    let with_one = program.output(&["--water", "water.json", "--check-config"]);
    let said = text(&with_one.stderr);
    assert!(said.contains("has no daylight"), "{said}");
    let port = program.told("uwguide metrics on ");
    let mut client = program.client();
    assert_eq!(get(&port, "/readyz").0, "HTTP/1.1 503 Service Unavailable");
    let held = client.ask(&suggest_image(json!({})));
    assert_eq!(
        (&held["valid"], &held["reason"]),
        (&json!(false), &json!("no_profile")),
        "{held}"
    );
    assert!(
        held["message"].as_str().unwrap().contains("\"tracking\""),
        "{held}"
    );
    let tracking = json!({"objective": {"preset": "tracking"}});
    let told = client.ask(&suggest_image(tracking.clone()));
    assert_eq!(told["valid"], true, "{told}");
    // Light with the lamps off is none that the water file knows.
    write_picture(&program.path("day.png"), (HERE_M, 0.0), &waves, NOISE);
    let mut by_day = suggest_image(tracking);
    (by_day["image"], by_day["light_pct"]) = (json!({"path": "day.png"}), json!(0.0));
    let held = client.ask(&by_day);
    assert_eq!(
        (&held["valid"], &held["reason"]),
        (&json!(false), &json!("other_light")),
        "{held}"
    );
    assert_eq!(program.end(), Some(0));
}
