//! `uw predict`.

use std::fs;

use super::support::{Folder, numbers, shipped};

/// A folder with a model as `model.json` and its reference inputs and predictions as text.
fn with_model() -> (Folder, String) {
    let folder = Folder::new();
    let data = shipped("guidance/tests/data");
    fs::copy(data.join("mlp_a.json"), folder.path("model.json")).expect("copied");
    let table = fs::read_to_string(data.join("mlp_a_io.csv")).expect("table");
    (folder, table)
}

fn reversed(table: &str) -> String {
    let line = |line: &str| line.split(',').rev().collect::<Vec<_>>().join(" , ");
    table.lines().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn predictions_are_those_of_the_reference_in_any_order_of_columns() {
    let (folder, table) = with_model();
    folder
        .write("in.csv", &table)
        .write("reversed.csv", reversed(&table));
    folder.good("predict --model model.json in.csv -o out.csv");
    let predictions = folder.text("out.csv");
    assert!(predictions.starts_with("contrast_r,contrast_g,contrast_b\n"));
    let (got, expected) = (numbers(&predictions), numbers(&table));
    assert_eq!((got.len(), expected.len()), (500, 500));
    for (got, expected) in got.iter().zip(&expected) {
        for k in 0..3 {
            // Columns 23.. are the predictions with the float32 weights, in double precision; the model file
            // prints these weights in 8 or 9 digits, which moves predictions by some 1e-7 counts.
            assert!(
                (got[k] - expected[23 + k]).abs() < 1e-6,
                "{got:?} {expected:?}"
            );
        }
    }
    folder.good("predict --model model.json reversed.csv -o again.csv");
    assert_eq!(folder.text("again.csv"), predictions);
}

#[test]
fn tables_that_do_not_fit_the_model_are_refused() {
    let (folder, table) = with_model();
    folder.write("missing.csv", table.replacen("kz_g", "kz_green", 1));
    folder.refused(
        "predict --model model.json missing.csv -o out.csv",
        &["missing.csv:1:", "lacks", "kz_g"],
    );
    folder.write("twice.csv", table.replacen("keras_contrast_r", "light", 1));
    folder.refused(
        "predict --model model.json twice.csv -o out.csv",
        &["twice.csv:1:", "light", "twice"],
    );
    let mut lines: Vec<String> = table.lines().map(str::to_owned).collect();
    lines[3] = lines[3].replacen("1.", "dark", 1);
    folder.write("word.csv", lines.join("\n"));
    folder.refused(
        "predict --model model.json word.csv -o out.csv",
        &["word.csv:4:", "kz_r must be a finite number, got \"dark"],
    );
    lines[3] = lines[3].replacen("dark", "nan", 1);
    folder.write("nan.csv", lines.join("\n"));
    folder.refused(
        "predict --model model.json nan.csv -o out.csv",
        &["nan.csv:4:", "kz_r"],
    );
    lines[3] = "1,2,3".to_owned();
    folder.write("short.csv", lines.join("\n"));
    folder.refused(
        "predict --model model.json short.csv -o out.csv",
        &["short.csv", "line: 4"],
    );
    folder.refused(
        "predict --model model.json none.csv -o out.csv",
        &["none.csv"],
    );
}

#[test]
fn a_model_of_a_wrong_shape_is_refused() {
    let (folder, table) = with_model();
    let model = folder.text("model.json");
    let wrong = model.replacen("\"units\":", "\"units\":1", 1);
    assert_ne!(wrong, model);
    folder.write("in.csv", &table).write("wrong.json", wrong);
    folder.refused(
        "predict --model wrong.json in.csv -o out.csv",
        &["wrong.json", "layers[0]."],
    );
    folder.write("text.json", "not a model");
    folder.refused(
        "predict --model text.json in.csv -o out.csv",
        &["text.json", "JSON"],
    );
}

#[test]
fn a_profile_in_the_place_of_a_model_is_called_one() {
    let (folder, table) = with_model();
    folder.write("in.csv", &table).write(
        "profile.json",
        "{\"format\": \"uw-profile/1\", \"depth\": []}",
    );
    folder.refused(
        "predict --model profile.json in.csv -o out.csv",
        &[
            "profile.json: format must be \"uw-mlp\" (a trained model)",
            "got \"uw-profile/1\" (a calibration profile)",
        ],
    );
}
