//! A tiny dataset: its rows, interruption, parts, and independence of the number of threads.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use uw_calib::ImageStats;
use uw_render::image::{ExrImage, LayerData};
use uw_survey::assets::assets_dir;
use uw_survey::dataset::{
    Accuracy, CheckPlan, CheckReport, DatasetConfig, DatasetError, Observer, Progress, RunOptions,
    Shard, TABLE, check, generate, merge,
};
use uw_survey::vehicle::Vehicle;

fn tiny() -> DatasetConfig {
    DatasetConfig {
        textures: vec!["hull_red".into()],
        water_types: vec!["II".into(), "5C-7C@0.5".into()],
        backscatter_fractions: vec![0.0183],
        depths_m: vec![1.0, 3.0],
        distances_m: vec![0.5, 2.0],
        light_pct: vec![0.0, 50.0],
        calibration_depths_m: vec![0.5, 3.0],
        calibration_light_pct: 50.0,
        accuracy: Accuracy {
            least_paths: 256,
            most_paths: 512,
            ..Accuracy::default()
        },
        vehicle: Vehicle {
            width: 120,
            height: 72,
            ..Vehicle::default()
        },
        ..DatasetConfig::default()
    }
}

fn options(threads: usize, shard: Shard) -> RunOptions {
    RunOptions {
        shard,
        threads: Some(threads),
        ..RunOptions::default()
    }
}

fn run(config: &DatasetConfig, folder: &Path, options: &RunOptions) -> usize {
    let observer = Observer {
        progress: &|_| {},
        cancel: &AtomicBool::new(false),
    };
    let assets = assets_dir().expect("assets");
    let summary = generate(config, folder, &assets, options, &observer).expect("a dataset");
    summary.tables.len()
}

/// Every file under a folder with its bytes.
fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path
                    .strip_prefix(folder)
                    .expect("inside")
                    .display()
                    .to_string();
                files.insert(name, std::fs::read(&path).expect("readable"));
            }
        }
    }
    files
}

fn assert_same(one: &Path, other: &Path) {
    let (one, other) = (content(one), content(other));
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other));
    for (name, bytes) in &one {
        assert!(*bytes == other[name], "{name} differs");
    }
}

#[test]
fn every_pair_of_images_at_one_depth_is_a_row_whoever_makes_it() {
    let folder = tempfile::tempdir().expect("folder");
    let whole = folder.path().join("whole");
    assert_eq!(run(&tiny(), &whole, &options(2, Shard::WHOLE)), 2);
    let text = std::fs::read_to_string(whole.join(TABLE)).expect("readable");
    // 2 waters x 2 depths x (2 distances x 2 levels)².
    assert_eq!(text.lines().count(), 1 + 2 * 2 * 16);
    let columns = text.lines().next().expect("header").split(',').count();
    assert!(text.lines().all(|l| l.split(',').count() == columns));

    let (first, second) = (folder.path().join("first"), folder.path().join("second"));
    let shard = |index| options(1, Shard { index, count: 2 });
    assert_eq!(run(&tiny(), &first, &shard(1)), 0, "a part has no table");
    assert_eq!(run(&tiny(), &second, &shard(2)), 0);
    let merged = folder.path().join("merged");
    merge(&tiny(), &merged, &[first, second]).expect("parts of one dataset");
    assert_eq!(run(&tiny(), &merged, &options(1, Shard::WHOLE)), 2);
    assert_same(&whole, &merged);
}

/// The values of a layer in colour.
fn colour<'a>(image: &'a ExrImage, layer: &str) -> &'a [[f32; 3]] {
    match image.layer(layer) {
        Some(LayerData::Colour(values)) => values,
        other => panic!("{layer} is {other:?}"),
    }
}

#[test]
fn kept_images_are_those_of_the_labels_and_travel_with_their_part() {
    let folder = tempfile::tempdir().expect("folder");
    let (whole, merged) = (folder.path().join("whole"), folder.path().join("merged"));
    let keep = |shard| RunOptions {
        keep_images: true,
        ..options(2, shard)
    };
    let mut config = tiny();
    config.accuracy.least_paths = 4096;
    config.accuracy.most_paths = 4096;
    run(&config, &whole, &keep(Shard::WHOLE));
    let parts = [1, 2].map(|index| folder.path().join(format!("part-{index}")));
    for (index, part) in (1..).zip(&parts) {
        run(&config, part, &keep(Shard { index, count: 2 }));
    }
    merge(&config, &merged, &parts).expect("parts of one dataset");
    run(&config, &merged, &options(1, Shard::WHOLE));
    assert_same(&whole, &merged);

    let group = whole.join("images/II_B0.0183/hull_red_tilt0_d2");
    let statistics = std::fs::read_to_string(group.with_extension("csv")).expect("statistics");
    assert_eq!(statistics.lines().count(), 4);
    for line in statistics.lines() {
        let row: Vec<f64> = line.split(',').map(|v| v.parse().expect(line)).collect();
        let picture = group.join(format!("z{}_light{}.png", row[0], row[1]));
        let stats = ImageStats::from_file(&picture).expect("a picture");
        for k in 0..3 {
            let (mean, mean_error) = (row[3 + k], row[9 + k]);
            let mean_off = (stats.mean[k] - mean).abs();
            assert!(mean_off < 0.3 + 3.0 * mean_error, "{line} {stats:?}");
            // The label takes the noise of the paths out, which the picture shows.
            let (contrast, contrast_error) = (row[6 + k], row[12 + k]);
            let contrast_off = (stats.contrast[k] - contrast).abs();
            assert!(
                contrast_off < 0.1 * contrast + 3.0 * contrast_error,
                "{line} {stats:?}"
            );
        }
    }

    let image = ExrImage::read(&group.join("z3.exr")).expect("an image");
    let (ambient, lamps) = (colour(&image, "ambient"), colour(&image, "lamps"));
    let veils = ["ambient.backscatter", "lamps.backscatter"].map(|name| colour(&image, name));
    let mean = |values: &[[f32; 3]], k: usize| values.iter().map(|v| v[k]).sum::<f32>();
    for k in 0..3 {
        for (all, veil) in [ambient, lamps].into_iter().zip(veils) {
            let share = mean(veil, k) / mean(all, k);
            assert!((0.01..0.9).contains(&share), "{k} {share}");
        }
        for (i, sum) in image.picture.data.iter().enumerate() {
            let parts = ambient[i][k] + lamps[i][k];
            assert!((sum[k] - parts).abs() <= 1e-6 * parts.abs(), "{i} {k}");
        }
    }
    match image.layer("depth") {
        Some(LayerData::Scalar(depths)) => {
            assert!(depths.iter().all(|d| (d - 2.0).abs() < 1e-5), "{depths:?}");
        }
        other => panic!("depth is {other:?}"),
    }
}

#[test]
fn a_stopped_run_keeps_what_it_has_and_says_so() {
    let folder = tempfile::tempdir().expect("folder");
    let (cancel, calls) = (AtomicBool::new(false), AtomicUsize::new(0));
    let progress = |_: &_| {
        if calls.fetch_add(1, Ordering::Relaxed) == 3 {
            cancel.store(true, Ordering::Relaxed);
        }
    };
    let observer = Observer {
        progress: &progress,
        cancel: &cancel,
    };
    let assets = assets_dir().expect("assets");
    let options = options(1, Shard::WHOLE);
    let result = generate(&tiny(), folder.path(), &assets, &options, &observer);
    assert!(
        matches!(result, Err(DatasetError::Interrupted { done, total: 16 }) if done < 16),
        "{result:?}"
    );
    assert!(!folder.path().join(TABLE).exists());
}

#[test]
fn a_stopped_check_goes_on_with_the_entries_it_has() {
    let folder = tempfile::tempdir().expect("folder");
    let (config, folder) = (tiny(), folder.path());
    run(&config, folder, &options(1, Shard::WHOLE));
    let assets = assets_dir().expect("assets");
    let plan = CheckPlan {
        entries: 3,
        samples_per_pixel: 4,
        pixels_per_patch: 2,
    };
    let check_until = |stop: usize| {
        let (cancel, calls) = (AtomicBool::new(false), AtomicUsize::new(0));
        let progress = |p: &Progress| {
            assert_eq!(p.images_total, 3 * 120);
            if calls.fetch_add(1, Ordering::Relaxed) + 1 == stop {
                cancel.store(true, Ordering::Relaxed);
            }
        };
        let observer = Observer {
            progress: &progress,
            cancel: &cancel,
        };
        let report = check(&config, folder, &assets, &plan, Some(1), &observer);
        (report, calls.into_inner())
    };
    let (stopped, _) = check_until(150);
    assert!(
        matches!(
            stopped,
            Err(DatasetError::Interrupted { done: 1, total: 3 })
        ),
        "{stopped:?}"
    );
    let (report, calls) = check_until(usize::MAX);
    let report = report.expect("a report");
    // One step for the entry that was there, 120 for each of the others.
    assert_eq!(calls, 241);
    let (again, calls) = check_until(usize::MAX);
    assert_eq!(calls, 3);
    let json = |r: &CheckReport| serde_json::to_string(r).expect("numbers");
    assert_eq!(json(&report), json(&again.expect("a report")));
    // An entry that does not fit, of another seed say, is made again.
    let kept = folder.join("check/4spp_2px_1.json");
    let text = std::fs::read_to_string(&kept).expect("kept");
    std::fs::write(&kept, text.replace("\"depth_m\": ", "\"depth_m\": 9")).expect("written");
    let (mended, calls) = check_until(usize::MAX);
    assert_eq!(calls, 122);
    assert_eq!(json(&report), json(&mended.expect("a report")));
}

#[test]
fn twenty_kills_at_random_moments_change_no_byte() {
    let folder = tempfile::tempdir().expect("folder");
    let config = folder.path().join("tiny.toml");
    std::fs::write(&config, tiny().to_text().expect("text")).expect("writable");
    let undisturbed = folder.path().join("undisturbed");
    run(&tiny(), &undisturbed, &options(2, Shard::WHOLE));
    let killed = folder.path().join("killed");
    let mut start = Command::new(env!("CARGO_BIN_EXE_uw"));
    start.arg("dataset").arg(&config).arg("-o").arg(&killed);
    start
        .args(["--quiet", "--threads", "2"])
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let mut random = 12_345_u64;
    for _ in 0..20 {
        // A linear congruential step is random enough for moments.
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let mut process = start.spawn().expect("uw starts");
        std::thread::sleep(Duration::from_millis(10 + (random >> 33) % 700));
        process.kill().expect("killed or done");
        process.wait().expect("ended");
    }
    assert!(start.status().expect("uw runs").success());
    assert_same(&undisturbed, &killed);
}

#[test]
fn a_folder_of_another_configuration_is_refused() {
    let folder = tempfile::tempdir().expect("folder");
    let other = DatasetConfig { seed: 2, ..tiny() };
    std::fs::write(
        folder.path().join("config.toml"),
        other.to_text().expect("text"),
    )
    .expect("writable");
    let observer = Observer {
        progress: &|_| {},
        cancel: &AtomicBool::new(false),
    };
    let assets = assets_dir().expect("assets");
    let options = options(1, Shard::WHOLE);
    let result = generate(&tiny(), folder.path(), &assets, &options, &observer);
    assert!(
        matches!(result, Err(DatasetError::OtherConfig { .. })),
        "{result:?}"
    );
}
