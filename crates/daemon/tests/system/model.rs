//! The network against predictions computed with Keras (see `data/README.md`), and model files that must
//! be refused.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use uw_guidance::features::{ContrastCurves, FeatureValue};
use uw_guidance::{Candidate, Model, Observation, Situation};

/// How closely the tabulated float32 and float64 predictions agree with each other.
const TOLERANCE_COUNTS: f64 = 1e-5;
/// The file prints the float32 weights in 8 or 9 digits, so its numbers differ from them by some 1e-8.
const TOLERANCE_F64_COUNTS: f64 = 1e-6;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../guidance/tests/data")
        .join(name)
}

fn document() -> Value {
    serde_json::from_slice(&std::fs::read(data("mlp_a.json")).unwrap()).unwrap()
}

/// 20 inputs by name, then the predictions in float32 and float64.
type Row = (Vec<(String, f64)>, [f64; 3], [f64; 3]);

fn table() -> Vec<Row> {
    let mut reader = csv::Reader::from_path(data("mlp_a_io.csv")).unwrap();
    let names: Vec<String> = reader
        .headers()
        .unwrap()
        .iter()
        .map(str::to_owned)
        .collect();
    reader
        .records()
        .map(|record| {
            let values: Vec<f64> = record.unwrap().iter().map(|v| v.parse().unwrap()).collect();
            let inputs = names
                .iter()
                .cloned()
                .zip(values.iter().copied())
                .take(20)
                .collect();
            let three = |at: usize| [values[at], values[at + 1], values[at + 2]];
            (inputs, three(20), three(23))
        })
        .collect()
}

fn largest_difference(x: [f64; 3], y: [f64; 3]) -> f64 {
    (0..3).map(|k| (x[k] - y[k]).abs()).fold(0.0, f64::max)
}

#[test]
fn predictions_equal_the_tabulated_ones() {
    let model = Model::read(&data("mlp_a.json")).unwrap();
    let (mut worst_f32, mut worst_f64, mut rows) = (0.0f64, 0.0f64, 0);
    for (inputs, keras, exact) in table() {
        let value = |name: &str| inputs.iter().find(|(n, _)| n == name).unwrap().1;
        let ordered: Vec<f64> = model
            .inputs()
            .iter()
            .map(|input| value(input.name))
            .collect();
        let got = model.forward(&ordered).unwrap();
        worst_f32 = worst_f32.max(largest_difference(got, keras));
        worst_f64 = worst_f64.max(largest_difference(got, exact));
        rows += 1;
    }
    assert_eq!(rows, 500);
    assert!(worst_f32 < TOLERANCE_COUNTS, "against Keras: {worst_f32}");
    assert!(
        worst_f64 < TOLERANCE_F64_COUNTS,
        "against float64: {worst_f64}"
    );
}

#[test]
fn a_query_with_its_cached_first_layer_gives_the_same_predictions() {
    let model = Model::read(&data("mlp_a.json")).unwrap();
    for (inputs, _, exact) in table().into_iter().step_by(17) {
        let value = |name: &str| inputs.iter().find(|(n, _)| n == name).unwrap().1;
        let rgb = |name: &str| ["r", "g", "b"].map(|c| value(&format!("{name}_{c}")));
        let observation = Observation {
            depth_m: value("depth"),
            distance_m: value("distance"),
            light_pct: value("light"),
            mean: rgb("mean"),
            std: rgb("std"),
            quality: None,
        };
        let situation = Situation {
            k_z: rgb("kz"),
            k_c_on: rgb("kc_on"),
            k_c_off: rgb("kc_off"),
            observation,
            curves: ContrastCurves::default(),
        };
        let candidate = Candidate {
            distance_m: observation.distance_m + value("delta_distance"),
            light_pct: observation.light_pct + value("delta_light"),
        };
        let mut query = model.query(&situation);
        // A candidate before must leave nothing behind.
        query.contrast(&Candidate {
            distance_m: 9.0,
            light_pct: 1.0,
        });
        assert!(largest_difference(query.contrast(&candidate), exact) < TOLERANCE_F64_COUNTS);
    }
}

#[test]
fn absolute_targets_and_another_order_of_inputs_and_outputs_are_read_by_name() {
    let mut moved = document();
    let inputs = moved["inputs"].as_array_mut().unwrap();
    inputs[18]["name"] = json!("target_distance");
    inputs[19]["name"] = json!("target_light");
    for list in [
        "/inputs",
        "/normalisation/mean",
        "/normalisation/std",
        "/layers/0/kernel",
    ] {
        moved
            .pointer_mut(list)
            .unwrap()
            .as_array_mut()
            .unwrap()
            .swap(0, 19);
    }
    moved["outputs"].as_array_mut().unwrap().swap(0, 2);
    moved["outputs"][1]["scale"] = json!(10.0);
    let (moved, original) = (
        Model::from_json(&moved).unwrap(),
        Model::from_json(&document()).unwrap(),
    );
    assert_eq!(moved.inputs()[0].name, "target_light");
    let inputs: Vec<f64> = (0..20).map(|k| 0.3 + 0.1 * f64::from(k)).collect();
    let mut swapped = inputs.clone();
    swapped.swap(0, 19);
    let (got, [r, g, b]) = (
        moved.forward(&swapped).unwrap(),
        original.forward(&inputs).unwrap(),
    );
    assert!(largest_difference(got, [b, 10.0 * g, r]) < 1e-9);
}

#[test]
fn all_eighteen_shared_inputs_are_fixed_within_a_question() {
    let model = Model::from_json(&document()).unwrap();
    let fixed = model
        .inputs()
        .iter()
        .filter(|f| matches!(f.value, FeatureValue::Fixed(_)))
        .count();
    assert_eq!((fixed, model.layer_widths()), (18, vec![128, 128, 3]));
}

#[test]
fn wrong_model_files_are_refused_with_the_field() {
    let cases: [(&str, Value, &str); 21] = [
        (
            "/format",
            json!("keras"),
            "format must be \"uw-mlp\", got \"keras\"",
        ),
        ("/version", json!(2), "version must be 1, got 2"),
        (
            "/inputs/3/name",
            json!("kc_onn_r"),
            "inputs[3].name must be the name of an input (perhaps",
        ),
        (
            "/inputs/3/unit",
            json!("m"),
            "inputs[3].unit must be \"8bit_counts\" (the unit of kc_on_r)",
        ),
        (
            "/inputs/3/name",
            json!("kc_on_g"),
            "inputs[4].name must be an input that is not listed",
        ),
        (
            "/inputs/18",
            json!({"name": "target_distance", "unit": "m"}),
            "got target_distance, delta_light",
        ),
        (
            "/normalisation/std/4",
            json!(0.0),
            "normalisation.std[4] must be > 0 (it divides the input kc_on_g)",
        ),
        (
            "/normalisation/std/4",
            json!(null),
            "normalisation.std[4] must be a finite number, got null",
        ),
        (
            "/normalisation/mean",
            json!([1, 2]),
            "normalisation.mean must be an array of 20 numbers",
        ),
        (
            "/layers/1/kernel/5",
            json!([0.5]),
            "layers[1].kernel[5] must be an array of 128 numbers",
        ),
        (
            "/layers/1/kernel",
            json!([]),
            "layers[1].kernel must be 128 rows",
        ),
        (
            "/layers/1/bias",
            json!([1.0]),
            "layers[1].bias must be an array of 128 numbers",
        ),
        (
            "/layers/0/bias/7",
            json!("NaN"),
            "layers[0].bias[7] must be a finite number",
        ),
        (
            "/layers/0/units",
            json!(64),
            "layers[0].kernel[0] must be an array of 64 numbers",
        ),
        (
            "/layers/0/units",
            json!(0),
            "layers[0].units must be a whole number > 0",
        ),
        (
            "/layers/0/activation",
            json!("selu"),
            "layers[0].activation must be one of relu",
        ),
        (
            "/layers/0/type",
            json!("conv"),
            "layers[0].type must be \"dense\"",
        ),
        ("/layers", json!([]), "layers must be at least one layer"),
        (
            "/outputs/1/name",
            json!("contrast_r"),
            "outputs[1].name must be each of contrast_r",
        ),
        (
            "/outputs/1/unit",
            json!("percent"),
            "outputs[1].unit must be \"8bit_counts\"",
        ),
        (
            "/outputs/1",
            json!({"name": "contrast_g", "unit": "8bit_counts", "scale": 0}),
            "outputs[1].scale must be > 0",
        ),
    ];
    for (pointer, value, expected) in cases {
        let mut wrong = document();
        *wrong.pointer_mut(pointer).unwrap() = value;
        let message = Model::from_json(&wrong).unwrap_err().to_string();
        assert!(message.contains(expected), "{pointer}: {message}");
    }
}

#[test]
fn missing_inputs_are_listed_and_unknown_fields_named() {
    let mut wrong = document();
    wrong["inputs"].as_array_mut().unwrap().remove(11);
    let message = Model::from_json(&wrong).unwrap_err().to_string();
    assert_eq!(
        message,
        "inputs must be complete, got 19 inputs without depth"
    );
    let mut wrong = document();
    wrong["normalization"] = json!({});
    let message = Model::from_json(&wrong).unwrap_err().to_string();
    assert_eq!(
        message,
        "unknown field normalization; did you mean normalisation?"
    );
}

#[test]
fn files_with_nan_and_files_that_are_not_there_are_refused_with_their_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("nan.json");
    let text = document()
        .to_string()
        .replacen("\"std\":[", "\"std\":[NaN,", 1);
    std::fs::write(&path, text).unwrap();
    let message = Model::read(&path).unwrap_err().to_string();
    assert!(message.contains("nan.json: not valid JSON"), "{message}");
    let message = Model::read(&dir.path().join("gone.json"))
        .unwrap_err()
        .to_string();
    assert!(message.contains("gone.json: cannot be read"), "{message}");
}

#[test]
fn leaky_relu_takes_its_slope_from_the_layer() {
    let with = |layer: Value| {
        let mut model = document();
        for (field, value) in layer.as_object().unwrap() {
            model["layers"][1][field] = value.clone();
        }
        Model::from_json(&model)
    };
    let inputs = [0.5; 20];
    let default = with(json!({"activation": "leaky_relu"}))
        .unwrap()
        .forward(&inputs)
        .unwrap();
    let given = with(json!({"activation": "leaky_relu", "negative_slope": 0.2})).unwrap();
    let zero = with(json!({"activation": "leaky_relu", "negative_slope": 0})).unwrap();
    let relu = with(json!({})).unwrap().forward(&inputs).unwrap();
    assert_eq!(given.forward(&inputs).unwrap(), default);
    assert_eq!(zero.forward(&inputs).unwrap(), relu);
    assert!(largest_difference(default, relu) > 1e-3);
    assert!(with(json!({"negative_slope": 0.1})).is_err());
}

#[test]
fn the_profile_at_the_candidate_comes_whole_or_not_at_all() {
    let mut document = document();
    let names = uw_guidance::features::TARGET_PROFILE;
    let add = |document: &mut Value, name: &str| {
        let push = |list: &mut Value, item: Value| list.as_array_mut().unwrap().push(item);
        push(
            &mut document["inputs"],
            json!({"name": name, "unit": "8bit_counts"}),
        );
        push(&mut document["normalisation"]["mean"], json!(0.0));
        push(&mut document["normalisation"]["std"], json!(1.0));
        push(&mut document["layers"][0]["kernel"], json!(vec![0.01; 128]));
    };
    for (n, name) in names.iter().enumerate() {
        add(&mut document, name);
        let loaded = Model::from_json(&document);
        assert_eq!(loaded.is_ok(), n + 1 == names.len(), "{n}");
    }
    let model = Model::from_json(&document).unwrap();
    let varying =
        |f: &&&uw_guidance::features::Feature| matches!(f.value, FeatureValue::Varying(_));
    assert_eq!(model.inputs().iter().filter(varying).count(), 8);
}
