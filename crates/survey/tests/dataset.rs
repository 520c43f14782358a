//! A tiny dataset: its rows, its resumption, and independence of the number of threads.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use uw_survey::assets::assets_dir;
use uw_survey::dataset::{DatasetConfig, DatasetError, Observer, generate};
use uw_survey::vehicle::Vehicle;

fn tiny() -> DatasetConfig {
    DatasetConfig {
        samples_per_half: 1,
        up_samples_per_half: 1,
        textures: vec!["hull_red".into()],
        water_types: vec!["II".into(), "7C".into()],
        backscatter_fractions: vec![0.0183],
        depths_m: vec![1.0, 3.0],
        distances_m: vec![0.5, 2.0],
        light_pct: vec![0.0, 50.0],
        calibration_depths_m: vec![0.5, 3.0],
        vehicle: Vehicle {
            width: 40,
            height: 24,
            ..Vehicle::default()
        },
        ..DatasetConfig::default()
    }
}

fn make(config: &DatasetConfig, folder: &Path, threads: usize) -> String {
    let assets = assets_dir().expect("assets");
    let observer = Observer {
        progress: &|_, _, _| {},
        cancel: &AtomicBool::new(false),
    };
    let summary = generate(config, folder, &assets, Some(threads), &observer).expect("a dataset");
    let text = std::fs::read_to_string(summary.table).expect("readable");
    assert_eq!(text.lines().count(), summary.entries + 1);
    text
}

#[test]
fn every_pair_of_images_at_one_depth_is_a_row_and_interruption_changes_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let whole = make(&tiny(), &folder.path().join("whole"), 2);
    // 2 waters x 2 depths x (2 distances x 2 levels)².
    assert_eq!(whole.lines().count(), 1 + 2 * 2 * 16);
    let columns = whole.lines().next().expect("header").split(',').count();
    assert!(whole.lines().all(|l| l.split(',').count() == columns));

    let stopped = folder.path().join("stopped");
    let cancel = AtomicBool::new(false);
    let progress = |done: usize, _: usize, _: &str| cancel.store(done == 1, Ordering::Relaxed);
    let observer = Observer {
        progress: &progress,
        cancel: &cancel,
    };
    let assets = assets_dir().expect("assets");
    let result = generate(&tiny(), &stopped, &assets, Some(1), &observer);
    assert!(
        matches!(result, Err(DatasetError::Interrupted { done: 1, total: 2 })),
        "{result:?}"
    );
    assert!(!stopped.join("dataset.csv").exists());
    assert_eq!(
        make(&tiny(), &stopped, 1),
        whole,
        "resumed with another number of threads"
    );
}

#[test]
fn a_folder_of_another_configuration_is_refused() {
    let folder = tempfile::tempdir().expect("folder");
    make(
        &DatasetConfig {
            water_types: vec!["II".into()],
            ..tiny()
        },
        folder.path(),
        2,
    );
    let observer = Observer {
        progress: &|_, _, _| {},
        cancel: &AtomicBool::new(false),
    };
    let result = generate(
        &tiny(),
        folder.path(),
        &assets_dir().expect("assets"),
        None,
        &observer,
    );
    assert!(
        matches!(result, Err(DatasetError::OtherConfig { .. })),
        "{result:?}"
    );
}
