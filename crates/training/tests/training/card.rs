//! The model file says where the network can be trusted.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use uw_training::{Offsets, Settings, Table, train};

use crate::dataset;

/// As `uw dataset` writes it, what is read of it.
fn manifest(width: u32, textures: &[&str]) -> Value {
    json!({
        "format": "uw-dataset-manifest/1", "exposure_m2_sr_per_w": 8.61,
        "config": {
            "textures": textures, "water_types": ["IA", "3C"],
            "vehicle": {"width": width, "height": 720, "hfov_deg": 60.0, "lamp_offset_m": 0.3, "lamp_intensity": 0.4,
                        "lamp_half_angle_deg": 50.0, "noise_a": 2e-4, "noise_b": 1e-6, "sun_zenith_deg": 30.0},
        },
    })
}

fn write_json(path: &Path, value: &Value) {
    std::fs::write(path, value.to_string()).expect("the test's folder is writable");
}

fn read_json(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).expect("the file was written");
    serde_json::from_str(&text).expect("valid JSON")
}

/// A table whose last rows change nothing.
fn table_with_rows_here(rows: usize) -> String {
    let text = dataset::text(rows);
    let names: Vec<&str> = dataset::HEADER.split(',').collect();
    let place = |name: &str| {
        names
            .iter()
            .position(|&n| n == name)
            .expect("a known column")
    };
    let mut lines: Vec<String> = Vec::new();
    for (row, line) in text.lines().enumerate() {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if row > rows / 2 {
            for (change, target, here) in [
                ("delta_distance", "target_distance", "distance"),
                ("delta_light", "target_light", "light"),
            ] {
                fields[place(change)] = "0".to_owned();
                fields[place(target)] = fields[place(here)].clone();
            }
        }
        lines.push(fields.join(","));
    }
    lines.join("\n") + "\n"
}

fn uwtrain(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_uwtrain"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the program starts");
    let told = String::from_utf8(output.stderr).expect("UTF-8");
    (output.status.code(), told)
}

#[test]
fn ranges_are_those_of_the_training_rows() {
    let folder = dataset::empty_folder();
    let path = dataset::write(&folder, &dataset::text(200));
    let table = Table::read(&path, Offsets::Delta).expect("a valid table");
    let settings = Settings {
        epochs: 1,
        hidden: 4,
        ..Settings::default()
    };
    let trained = train(&table, &settings, |_| {}).expect("training works");
    let written = folder.join("model.json");
    trained.model.write(&written).expect("writable");
    let model = read_json(&written);
    let inputs = model["inputs"].as_array().expect("a list");
    let at = inputs
        .iter()
        .position(|input| input["name"] == "distance")
        .expect("an input");
    let values = trained.split.train.iter().map(|&row| table.inputs[row][at]);
    let (least, most) = values.fold((f32::MAX, f32::MIN), |(a, b), x| (a.min(x), b.max(x)));
    let told = |name: &str| inputs[at][name].as_f64().expect("a number") as f32;
    assert_eq!((told("min"), told("max")), (least, most));
    assert!(inputs.iter().all(|input| input["max"].is_number()));
    assert_eq!(model["training"]["rows"], trained.split.train.len());
    // No row stays where it is, and there is no manifest.
    assert_eq!(model["training"]["residual_here"], Value::Null);
    assert_eq!(model.get("camera"), None);
}

#[test]
fn a_model_is_described_by_its_dataset_and_keeps_its_weights() {
    let folder = dataset::empty_folder();
    dataset::write(&folder, &table_with_rows_here(200));
    let train = ["dataset.csv", "--epochs", "1", "--hidden", "4", "-o"];
    let (code, told) = uwtrain(&folder, &[&train[..], &["model.json"]].concat());
    assert_eq!(code, Some(0), "{told}");
    assert!(told.contains("no manifest beside dataset.csv"), "{told}");
    let first = read_json(&folder.join("model.json"));

    // As an older version wrote it: nothing but the network.
    let mut bare = first.clone();
    let fields = bare.as_object_mut().expect("an object");
    fields.retain(|name, _| !["training", "camera", "sensor", "lamps"].contains(&name.as_str()));
    for input in bare["inputs"].as_array_mut().expect("a list") {
        let input = input.as_object_mut().expect("an object");
        input.retain(|name, _| name == "name" || name == "unit");
    }
    write_json(&folder.join("bare.json"), &bare);
    write_json(
        &folder.join("manifest.json"),
        &manifest(1280, &["hull_red"]),
    );
    let describe = ["dataset.csv", "--describe", "bare.json", "-o", "told.json"];
    let (code, told) = uwtrain(&folder, &describe);
    assert_eq!(code, Some(0), "{told}");
    let described = read_json(&folder.join("told.json"));
    for part in ["normalisation", "layers", "outputs"] {
        assert_eq!(described[part], first[part], "{part}");
    }
    assert_eq!(
        described["camera"],
        json!({"width_px": 1280, "height_px": 720, "hfov_deg": 60.0})
    );
    assert_eq!(described["sensor"]["exposure_m2_sr_per_w"], 8.61);
    assert_eq!(described["lamps"]["count"], 2);
    let training = &described["training"];
    assert_eq!(
        (&training["rows"], &training["textures"]),
        (&json!(200), &json!(["hull_red"]))
    );
    assert_eq!(
        training["sun"],
        json!({"zenith_deg": 30.0, "azimuth_deg": 0.0})
    );
    // The pictures have a contrast of 5 counts in every channel, of which the network knows nothing yet.
    let normal = |name: &str| training["residual_here"][name].as_f64().expect("a number");
    assert!(0.0 < normal("median") && normal("median") <= normal("p99"));
}

#[test]
fn manifests_of_other_cameras_are_refused_and_textures_join() {
    let folder = dataset::empty_folder();
    dataset::write(&folder, &dataset::text(40));
    write_json(&folder.join("a.json"), &manifest(1280, &["hull_red"]));
    write_json(
        &folder.join("b.json"),
        &manifest(1280, &["hull_red", "gravel"]),
    );
    write_json(&folder.join("c.json"), &manifest(240, &["hull_red"]));
    let train = [
        "dataset.csv",
        "--epochs",
        "1",
        "--hidden",
        "4",
        "-o",
        "m.json",
        "--manifest",
        "a.json",
    ];
    let (code, told) = uwtrain(&folder, &[&train[..], &["--manifest", "b.json"]].concat());
    assert_eq!(code, Some(0), "{told}");
    let model = read_json(&folder.join("m.json"));
    assert_eq!(model["training"]["textures"], json!(["hull_red", "gravel"]));
    let (code, told) = uwtrain(&folder, &[&train[..], &["--manifest", "c.json"]].concat());
    assert_eq!(code, Some(2), "{told}");
    assert!(
        told.contains("c.json") && told.contains("camera.width_px 1280 against 240"),
        "{told}"
    );
    let (code, told) = uwtrain(&folder, &[&train[..], &["--manifest", "no.json"]].concat());
    assert_eq!(code, Some(2), "{told}");
    assert!(told.contains("no.json"), "{told}");
}
