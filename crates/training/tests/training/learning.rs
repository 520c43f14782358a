//! A known function is learnt, the written model says what the network said, and equal commands
//! give equal bytes.

use std::path::Path;

use serde_json::Value;
use uw_training::train::mae_counts;
use uw_training::{
    Comparison, Offsets, Report, Schedule, Settings, SplitBy, Table, Trained, UnseenSet, train,
};

use crate::dataset;

fn table(rows: usize, offsets: Offsets) -> Table {
    let folder = dataset::empty_folder();
    dataset::write(&folder, &dataset::text(rows));
    Table::read(&folder, offsets).expect("a valid table")
}

fn settings(epochs: usize) -> Settings {
    Settings {
        epochs,
        seed: 11,
        ..Settings::default()
    }
}

fn trained(table: &Table, settings: &Settings) -> Trained {
    train(table, settings, |_| {}).expect("training works")
}

fn mean(per_output: [f64; 3]) -> f64 {
    per_output.iter().sum::<f64>() / 3.0
}

/// Error of the best constant answer over the test rows: the median of the training rows.
fn constant_mae_counts(table: &Table, trained: &Trained) -> f64 {
    let median: [f32; 3] = std::array::from_fn(|k| {
        let mut values: Vec<f32> = trained
            .split
            .train
            .iter()
            .map(|&row| table.contrast[row][k])
            .collect();
        values.sort_by(f32::total_cmp);
        values[values.len() / 2]
    });
    let constant = vec![median; trained.split.test.len()];
    mean(mae_counts(&constant, table, &trained.split.test))
}

fn test_mae_counts(table: &Table, trained: &Trained) -> f64 {
    mean(mae_counts(
        &trained.test_predictions,
        table,
        &trained.split.test,
    ))
}

fn model_json(trained: &Trained) -> Value {
    let folder = dataset::empty_folder();
    let path = folder.join("model.json");
    trained.model.write(&path).expect("the folder is writable");
    let left: Vec<_> = std::fs::read_dir(&folder)
        .expect("the folder exists")
        .collect();
    assert_eq!(left.len(), 1, "the model file must be alone in its folder");
    read_json(&path)
}

fn read_json(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).expect("the file was written");
    serde_json::from_str(&text).expect("valid JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("a list")
        .iter()
        .map(|x| x.as_f64().expect("a number"))
        .collect()
}

/// The forward pass as the format describes it, in 64 bits and from the file alone.
fn evaluate(model: &Value, inputs: &[f64]) -> Vec<f64> {
    let mean = numbers(&model["normalisation"]["mean"]);
    let std = numbers(&model["normalisation"]["std"]);
    let mut x: Vec<f64> = (0..mean.len())
        .map(|k| (inputs[k] - mean[k]) / std[k])
        .collect();
    for layer in model["layers"].as_array().expect("a list of layers") {
        let mut y = numbers(&layer["bias"]);
        let kernel = layer["kernel"].as_array().expect("a list of rows");
        assert_eq!(kernel.len(), x.len());
        for (x, row) in x.iter().zip(kernel) {
            for (y, weight) in y.iter_mut().zip(numbers(row)) {
                *y += x * weight;
            }
        }
        match layer["activation"].as_str().expect("a name") {
            "relu" => y.iter_mut().for_each(|y| *y = y.max(0.0)),
            other => assert_eq!(other, "linear"),
        }
        x = y;
    }
    let outputs = model["outputs"].as_array().expect("a list of outputs");
    x.iter()
        .zip(outputs)
        .map(|(y, output)| y * output["scale"].as_f64().expect("a number"))
        .collect()
}

/// 64-bit evaluation of the file against the library's 32-bit predictions on every test row.
/// 32-bit sums of 128 products err by some 1e-7 of their size, so 1e-5 of max(1 count, |y|)
/// leaves room for rounding and for nothing else.
fn assert_file_matches_network(table: &Table, trained: &Trained) {
    let model = model_json(trained);
    for (&row, predicted) in trained.split.test.iter().zip(&trained.test_predictions) {
        let got = evaluate(&model, &table.inputs[row].map(f64::from));
        for (got, predicted) in got.iter().zip(predicted.map(f64::from)) {
            let difference = (got - predicted).abs();
            assert!(
                difference <= 1e-5 * predicted.abs().max(1.0),
                "row {row}: file {got}, network {predicted}"
            );
        }
    }
}

/// The last error is at most an eighth of the best constant's: a network that learns nothing
/// stays at 1, one that learns only the mean effect of one input stays above a third.
#[test]
fn learns_a_known_function_and_writes_what_it_learnt() {
    let table = table(2000, Offsets::Delta);
    let trained = trained(&table, &settings(12));
    let constant = constant_mae_counts(&table, &trained);
    let got = test_mae_counts(&table, &trained);
    assert!(
        got < constant / 8.0,
        "test MAE {got}, of the best constant {constant}"
    );
    assert_eq!(trained.curve.len(), 12);
    assert!(trained.curve[11].train_mae_counts < trained.curve[0].train_mae_counts / 4.0);
    assert!((trained.curve[11].test_mae_counts - got).abs() < 1e-9);
    assert_file_matches_network(&table, &trained);

    let model = model_json(&trained);
    assert_eq!(model["format"], "uw-mlp");
    assert_eq!(model["version"], 1);
    let inputs = model["inputs"].as_array().expect("a list");
    assert_eq!(inputs.len(), 20);
    assert_eq!(inputs[18]["name"], "delta_distance");
    assert_eq!(inputs[18]["unit"], "m");
    assert_eq!(inputs[19]["unit"], "percent");
    // mean_r is 80 in every row: no spread to divide by.
    assert_eq!(inputs[12]["name"], "mean_r");
    assert_eq!(model["normalisation"]["std"][12], 1.0);
}

#[test]
fn equal_seeds_give_equal_bytes() {
    let table = table(300, Offsets::Target);
    let bytes = |seed| {
        let trained = trained(
            &table,
            &Settings {
                seed,
                ..settings(2)
            },
        );
        serde_json::to_string(&trained.model).expect("plain numbers")
    };
    let first = bytes(5);
    assert_eq!(first, bytes(5));
    assert_ne!(first, bytes(6));
    assert!(first.contains("target_light") && !first.contains("delta_light"));
}

/// Without calibration the network cannot tell the environments apart: the nine inputs have no
/// weight, and the error is at least twice that with them.
#[test]
fn without_calibration_the_profile_has_no_weight() {
    let table = table(2000, Offsets::Delta);
    let with = trained(&table, &settings(6));
    let without = trained(
        &table,
        &Settings {
            calibration: false,
            ..settings(6)
        },
    );
    let kernel = &without.model.layers()[0].kernel;
    assert!(kernel[..9].iter().flatten().all(|&weight| weight == 0.0));
    assert!(
        kernel[9..]
            .iter()
            .all(|row| row.iter().any(|&weight| weight != 0.0))
    );
    assert!(test_mae_counts(&table, &without) > 2.0 * test_mae_counts(&table, &with));
    assert_file_matches_network(&table, &without);
}

#[test]
fn environment_split_keeps_whole_environments_for_the_test() {
    let table = table(400, Offsets::Delta);
    let trained = trained(
        &table,
        &Settings {
            split: SplitBy::Environment,
            test_fraction: 0.25,
            ..settings(1)
        },
    );
    assert_eq!(
        trained.split.test_environments.len(),
        dataset::ENVIRONMENTS / 4
    );
    assert_eq!(trained.split.test.len(), 100);
    let of_row = &table
        .environments
        .as_ref()
        .expect("the column is there")
        .of_row;
    let kept: std::collections::BTreeSet<_> =
        trained.split.test.iter().map(|&row| of_row[row]).collect();
    assert!(
        trained
            .split
            .train
            .iter()
            .all(|&row| !kept.contains(&of_row[row]))
    );
}

/// The figures of the report are those of the network that was written, recomputed here.
#[test]
fn the_report_states_the_errors_of_the_model() {
    let table = table(400, Offsets::Delta);
    let settings = settings(2);
    let trained = trained(&table, &settings);
    let folder = dataset::empty_folder();
    let path = folder.join("model.report.json");
    let report = Report::new(&folder, &table, &settings, &trained);
    report.write(&path).expect("the folder is writable");
    let report = read_json(&path);
    assert_eq!(report["format"], "uw-training-report/1");
    assert_eq!(report["dataset"]["rows"], 400);
    assert_eq!(report["dataset"]["environments"], dataset::ENVIRONMENTS);
    assert_eq!(report["split"]["test_rows"], 80);
    assert_eq!(report["curve"].as_array().expect("a list").len(), 2);

    let model = model_json(&trained);
    let mut sums = [0.0; 3];
    for &row in &trained.split.test {
        let got = evaluate(&model, &table.inputs[row].map(f64::from));
        for k in 0..3 {
            sums[k] += (got[k] - f64::from(table.contrast[row][k])).abs() / 80.0;
        }
    }
    let test = &report["test"];
    let close = |value: &Value, expected: f64| {
        let got = value.as_f64().expect("a number");
        assert!(
            (got - expected).abs() < 1e-5,
            "report {got}, model {expected}"
        );
    };
    close(&test["mae_contrast_r_counts"], sums[0]);
    close(&test["mae_contrast_g_counts"], sums[1]);
    close(&test["mae_contrast_b_counts"], sums[2]);
    close(&test["mae_counts"], mean(sums));
    close(&test["mae_scaled"], mean(sums) / 15.0);
}

#[test]
fn the_comparison_knows_calibration_split_and_unseen_environments() {
    let table = table(1200, Offsets::Delta);
    let settings = settings(3);
    let trained = trained(&table, &settings);
    let unseen = [UnseenSet {
        name: "elsewhere".to_owned(),
        table: table.clone(),
    }];
    let mut runs = Vec::new();
    let comparison = Comparison::make(&table, &settings, &trained, &unseen, |word, epoch, _| {
        if epoch.epoch == 1 {
            runs.push(word.to_owned());
        }
    })
    .expect("training works");
    // The network of the settings is not trained again.
    assert_eq!(
        runs,
        [
            "with calibration, split by environment",
            "without calibration, split by row",
            "without calibration, split by environment"
        ]
    );
    let scaled = test_mae_counts(&table, &trained) / 15.0;
    assert!((comparison.models[0].test_by_row - scaled).abs() < 1e-9);
    // Over the whole table the error is that of its two parts together.
    let (train, test) = (
        trained.split.train.len() as f64,
        trained.split.test.len() as f64,
    );
    let on_train = mean(mae_counts(
        &trained.train_predictions,
        &table,
        &trained.split.train,
    )) / 15.0;
    let whole = (train * on_train + test * scaled) / (train + test);
    assert!((comparison.models[0].unseen[0] - whole).abs() < 1e-5);
    assert!(comparison.to_markdown().contains("| with calibration |"));
}

#[test]
fn the_calibration_ahead_is_read_and_stored_where_asked_for() {
    let text = dataset::text(200);
    let mut lines = text.lines();
    let names = ["target_kc_on_r", "target_kc_on_g", "target_kc_on_b"]
        .into_iter()
        .chain(["target_kc_off_r", "target_kc_off_g", "target_kc_off_b"]);
    let header = lines.next().expect("a header").to_owned();
    let mut wider = names.fold(header, |header, name| header + "," + name) + "\n";
    for (row, line) in lines.enumerate() {
        wider += &format!("{line},{row},2,3,4,5,{}\n", 2 * row);
    }
    let folder = dataset::empty_folder();
    dataset::write(&folder, &wider);
    let table = Table::read(&folder, Offsets::Ahead).expect("a valid table");
    assert_eq!((table.inputs[7][20], table.inputs[7][25]), (7.0, 14.0));
    let trained = trained(&table, &settings(1));
    let model = model_json(&trained);
    assert_eq!(model["inputs"].as_array().expect("a list").len(), 26);
    assert_eq!(
        model["layers"][0]["kernel"]
            .as_array()
            .expect("a list")
            .len(),
        26
    );
    assert_file_matches_network(&table, &trained);
    let without = Table::read(&folder, Offsets::Target).expect("a valid table");
    assert_eq!(without.inputs[7][20], 0.0);
}

#[test]
fn width_and_schedule_are_used() {
    let table = table(600, Offsets::Delta);
    let train_errors = |schedule| {
        let settings = Settings {
            schedule,
            hidden: 32,
            ..settings(2)
        };
        let trained = trained(&table, &settings);
        assert_eq!(trained.model.layers()[1].units, 32);
        let errors = trained.curve.iter().map(|e| e.train_mae_counts);
        errors.collect::<Vec<_>>()
    };
    assert_ne!(
        train_errors(Schedule::Constant),
        train_errors(Schedule::Cosine)
    );
}
