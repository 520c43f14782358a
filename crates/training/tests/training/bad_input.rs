//! Every unusable dataset or setting gets an error that names the place, and leaves no file.

use std::path::Path;
use std::process::{Command, Output};

use crate::dataset;

fn uwtrain(folder: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_uwtrain"))
        .current_dir(folder)
        .args(["dataset.csv", "--epochs", "1"])
        .args(if more.contains(&"-o") {
            &[][..]
        } else {
            &["-o", "model.json"]
        })
        .args(more)
        .output()
        .expect("the program starts")
}

/// Runs the program on a table and returns exit code and error text.
fn outcome(table: &str, more: &[&str]) -> (Option<i32>, String) {
    let folder = dataset::empty_folder();
    dataset::write(&folder, table);
    let output = uwtrain(&folder, more);
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .expect("the folder exists")
        .map(|entry| entry.expect("readable").file_name())
        .collect();
    files.sort();
    if output.status.success() {
        let made = [
            "dataset.csv",
            "model.curve.png",
            "model.json",
            "model.report.json",
            "model.report.md",
            "model.scatter.png",
        ];
        assert_eq!(files, made);
    } else {
        assert_eq!(files, ["dataset.csv"], "nothing may be half-written");
    }
    let text = String::from_utf8(output.stderr).expect("UTF-8");
    (output.status.code(), text)
}

fn refused(table: &str, more: &[&str], words: &[&str]) {
    let (code, text) = outcome(table, more);
    assert_eq!(code, Some(2), "{text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}

/// The table with field `column` of data row `row` (from 0) replaced.
fn with_field(table: &str, row: usize, column: &str, value: &str) -> String {
    let at = dataset::HEADER
        .split(',')
        .position(|name| name == column)
        .expect("a known column");
    let mut lines: Vec<String> = table.lines().map(str::to_owned).collect();
    let mut fields: Vec<&str> = lines[row + 1].split(',').collect();
    fields[at] = value;
    lines[row + 1] = fields.join(",");
    lines.join("\n")
}

#[test]
fn a_good_table_is_accepted() {
    let (code, text) = outcome(&dataset::text(40), &[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("epoch   1/1"), "{text}");
}

#[test]
fn missing_and_doubled_columns_are_named() {
    let table = dataset::text(40);
    refused(
        &table.replace("kc_off_g", "kc_of_g"),
        &[],
        &["dataset.csv", "`kc_off_g`", "missing", "kc_of_g"],
    );
    refused(
        &table.replace("contrast_b", "contrast_x"),
        &[],
        &["`contrast_b`", "missing"],
    );
    refused(
        &table.replace("kz_g", "kz_r"),
        &[],
        &["`kz_r`", "more than once"],
    );
    let no_delta = table.replace("delta_light", "change");
    refused(&no_delta, &[], &["`delta_light`", "--inputs target"]);
    assert_eq!(outcome(&no_delta, &["--inputs", "target"]).0, Some(0));
}

#[test]
fn fields_that_are_no_finite_number_are_named_with_their_line() {
    let table = dataset::text(40);
    for value in ["NaN", "inf", "1e39", "abc", ""] {
        let bad = with_field(&table, 6, "std_g", value);
        refused(
            &bad,
            &[],
            &[
                "dataset.csv:8",
                "std_g",
                "finite number",
                &format!("`{value}`"),
            ],
        );
    }
    refused(
        &with_field(&table, 0, "contrast_r", "-inf"),
        &[],
        &["dataset.csv:2", "contrast_r"],
    );
    refused(
        &with_field(&table, 3, "environment", ""),
        &[],
        &["dataset.csv:5", "environment"],
    );
}

#[test]
fn short_and_ragged_tables_are_refused() {
    refused(&dataset::text(9), &[], &["at least 10 rows", "got 9"]);
    refused("", &[], &["dataset.csv", "missing"]);
    let mut ragged = dataset::text(40);
    ragged.push_str("1,2,3\n");
    refused(&ragged, &[], &["dataset.csv", "42"]);
}

#[test]
fn environment_split_needs_environments() {
    let table = dataset::text(40);
    let unnamed = table.replacen("environment", "place", 1);
    assert_eq!(outcome(&unnamed, &[]).0, Some(0));
    refused(
        &unnamed,
        &["--split", "environment"],
        &["`environment`", "split by row"],
    );
    let mut one = table.clone();
    for k in 1..dataset::ENVIRONMENTS {
        one = one.replace(&format!("env{k},"), "env0,");
    }
    refused(&one, &["--split", "environment"], &["at least 2", "got 1"]);
}

#[test]
fn settings_outside_their_range_are_refused() {
    let table = dataset::text(40);
    refused(&table, &["--batch", "0"], &["batch", "at least 1"]);
    refused(
        &table,
        &["--learning-rate", "-1"],
        &["learning-rate", "> 0"],
    );
    refused(
        &table,
        &["--learning-rate", "NaN"],
        &["learning-rate", "finite"],
    );
    refused(
        &table,
        &["--test-fraction", "1"],
        &["test-fraction", "between 0 and 1"],
    );
    refused(&table, &["--split", "colour"], &["colour"]);
}

#[test]
fn unusable_paths_are_refused_before_training() {
    let table = dataset::text(40);
    refused(
        &table,
        &["--report", "dataset.csv"],
        &["dataset.csv", "cannot be made"],
    );
    refused(&table, &["-o", "dataset.csv"], &["it is the dataset"]);
    refused(&table, &["-o", "."], &["it is a folder"]);
    let folder = dataset::empty_folder();
    let output = uwtrain(&folder, &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("cannot read the dataset"));
    dataset::write(&folder, &table);
    let output = Command::new(env!("CARGO_BIN_EXE_uwtrain"))
        .current_dir(&folder)
        .args([".", "-o", "nowhere/model.json", "--epochs", "1"])
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("nowhere does not exist"));
}

/// A step so large that the weights overflow is a failure while running, not a bad argument.
#[test]
fn divergence_is_a_failure_and_writes_nothing() {
    let (code, text) = outcome(&dataset::text(400), &["--learning-rate", "1e30"]);
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("smaller learning rate"), "{text}");
}
