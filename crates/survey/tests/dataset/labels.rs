//! The rows of the table and the errors that they state.

use std::collections::{BTreeMap, BTreeSet};

use uw_calib::vehicle::Vehicle;
use uw_survey::dataset::{DatasetConfig, ExposureMode, Shard, TABLE};

use super::{options, run, tiny};

#[test]
fn every_pair_of_images_at_one_depth_is_a_row() {
    let folder = tempfile::tempdir().expect("folder");
    run(&tiny(), folder.path(), &options(2, Shard::WHOLE));
    let text = std::fs::read_to_string(folder.path().join(TABLE)).expect("readable");
    let (header, lines) = text.split_once('\n').expect("a header");
    let names: Vec<&str> = header.split(',').collect();
    let rows: Vec<Vec<&str>> = lines.lines().map(|l| l.split(',').collect()).collect();
    // 2 waters x 2 depths x (2 distances x 2 levels)².
    assert_eq!(rows.len(), 2 * 2 * 16);
    assert!(rows.iter().all(|row| row.len() == names.len()));
    let text_of = |row: &[&str], name: &str| -> String {
        let at = names.iter().position(|n| *n == name).expect(name);
        row[at].to_owned()
    };
    let value = |row: &[&str], name: &str| -> f64 { text_of(row, name).parse().expect(name) };
    let triple = |row: &[&str], name: &str| {
        ["r", "g", "b"].map(|channel| text_of(row, &format!("{name}_{channel}")))
    };
    // Light from above turns bluer with depth.
    let colour_at = |depth: f64| {
        let at_depth = rows.iter().find(|row| value(row, "depth") == depth);
        let [red, _, blue] = triple(at_depth.expect("a row"), "kz");
        red.parse::<f64>().expect("red") / blue.parse::<f64>().expect("blue")
    };
    assert!(colour_at(3.0) < 0.9 * colour_at(1.0));
    // The contrast of an image, as its own input and as the output of every change that leads to it.
    let key = |row: &[&str], distance: f64, light: f64| {
        let environment = text_of(row, "environment");
        format!("{environment} {} {distance} {light}", text_of(row, "depth"))
    };
    let mut inputs = BTreeMap::new();
    for row in &rows {
        let here = key(row, value(row, "distance"), value(row, "light"));
        inputs.insert(here, (triple(row, "std"), triple(row, "std_error")));
    }
    assert_eq!(inputs.len(), 2 * 2 * 4);
    let mut pairs = BTreeSet::new();
    for row in &rows {
        let (distance, light) = (value(row, "distance"), value(row, "light"));
        let there = key(
            row,
            distance + value(row, "delta_distance"),
            light + value(row, "delta_light"),
        );
        let outputs = (triple(row, "contrast"), triple(row, "contrast_error"));
        assert_eq!(inputs[&there], outputs, "{row:?}");
        pairs.insert((key(row, distance, light), there));
    }
    assert_eq!(pairs.len(), rows.len());
}

/// In water that scatters forwards, before a texture of much detail: much of the contrast hangs on how walks from the
/// camera spread, which the paths do not know.
#[test]
fn labels_of_other_seeds_differ_as_much_as_their_stated_errors() {
    let folder = tempfile::tempdir().expect("folder");
    let mut config = DatasetConfig {
        textures: vec!["seabed".into()],
        water_types: vec!["III".into()],
        backscatter_fractions: vec![0.005],
        depths_m: vec![3.0],
        distances_m: vec![1.0, 2.0],
        exposure: ExposureMode::Fixed,
        vehicle: Vehicle {
            width: 240,
            height: 144,
            ..Vehicle::default()
        },
        ..tiny()
    };
    config.accuracy.least_paths = 8192;
    config.accuracy.most_paths = 8192;
    // Of every label the values and the stated variances, seed by seed.
    let mut labels: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for seed in 1..=8 {
        config.seed = seed;
        let folder = folder.path().join(seed.to_string());
        run(&config, &folder, &options(2, Shard::WHOLE));
        for distance in ["1", "2"] {
            let name = format!("images/III_B0.005/seabed_tilt0_d{distance}.csv");
            let text = std::fs::read_to_string(folder.join(&name)).expect("statistics");
            for line in text.lines() {
                let row: Vec<f64> = line.split(',').map(|v| v.parse().expect(line)).collect();
                for k in 0..3 {
                    let label = labels.entry(format!("{name} {} {k}", row[1])).or_default();
                    label.push((row[6 + k], row[12 + k].powi(2)));
                }
            }
        }
    }
    assert_eq!(labels.len(), 2 * 2 * 3);
    let (mut seen, mut stated) = (0.0, 0.0);
    for values in labels.values() {
        let n = values.len() as f64;
        let mean = values.iter().map(|v| v.0).sum::<f64>() / n;
        let spread: f64 = values.iter().map(|v| (v.0 - mean).powi(2)).sum();
        // Each label in units of its own value, so that none outweighs the others.
        seen += spread / (n - 1.0) / mean.powi(2);
        stated += values.iter().map(|v| v.1).sum::<f64>() / n / mean.powi(2);
    }
    let ratio = (seen / stated).sqrt();
    assert!((0.7..1.4).contains(&ratio), "{ratio} {labels:?}");
}
