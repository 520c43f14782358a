//! A tiny dataset: its labels, its images, interruption, parts, and independence of the number of threads.

mod check;
mod damage;
mod images;
mod labels;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use uw_assets::assets_dir;
use uw_calib::vehicle::Vehicle;
use uw_survey::dataset::{
    Accuracy, Counts, DatasetConfig, DatasetError, Observer, RunOptions, Shard, Summary, TABLE,
    generate, merge,
};

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

fn run(config: &DatasetConfig, folder: &Path, options: &RunOptions) -> Summary {
    let observer = Observer {
        progress: &|_| {},
        tell: &|_| {},
        cancel: &AtomicBool::new(false),
    };
    let assets = assets_dir().expect("assets");
    generate(config, folder, &assets, options, &observer).expect("a dataset")
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
fn a_dataset_has_the_same_bytes_whoever_makes_it() {
    let folder = tempfile::tempdir().expect("folder");
    let whole = folder.path().join("whole");
    let made = run(&tiny(), &whole, &options(2, Shard::WHOLE));
    assert_eq!(made.tables.len(), 2);

    let (first, second) = (folder.path().join("first"), folder.path().join("second"));
    let shard = |index| options(1, Shard { index, count: 2 });
    let part = run(&tiny(), &first, &shard(1));
    assert_eq!(part.tables.len(), 0, "a part has no table");
    assert_eq!(run(&tiny(), &second, &shard(2)).tables.len(), 0);
    let merged = folder.path().join("merged");
    merge(&tiny(), &merged, &[first, second], &|_| {}).expect("parts of one dataset");
    let joined = run(&tiny(), &merged, &options(1, Shard::WHOLE));
    assert_eq!((joined.tables.len(), joined.times.renders()), (2, 0));
    assert_same(&whole, &merged);
}

#[test]
fn a_stopped_run_keeps_what_it_has_and_goes_on_from_there() {
    let folder = tempfile::tempdir().expect("folder");
    let (cancel, calls) = (AtomicBool::new(false), AtomicUsize::new(0));
    let progress = |_: &_| {
        if calls.fetch_add(1, Ordering::Relaxed) == 3 {
            cancel.store(true, Ordering::Relaxed);
        }
    };
    let observer = Observer {
        progress: &progress,
        tell: &|_| {},
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
    let kept = content(folder.path()).into_keys();
    let kept = kept.filter(|name| name.ends_with(".sums") && !name.contains("pilot"));
    let (kept, all) = (kept.count(), Counts::of(&tiny()).renders());
    assert!(kept > 0);
    // As if it had been killed in the middle of a group: with renders, but without statistics.
    let group = "images/II_B0.0183/hull_red_tilt0_d0.5.csv";
    std::fs::remove_file(folder.path().join(group)).expect("a finished group");
    let rest = run(&tiny(), folder.path(), &options);
    assert_eq!(rest.times.renders() as usize, all - kept);
    assert_eq!(rest.tables.len(), 2);
}

/// The files under a folder that others are writing to.
fn names(folder: &Path) -> BTreeSet<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .flat_map(|entry| match entry.path() {
            path if path.is_dir() => names(&path),
            path => BTreeSet::from([path]),
        })
        .collect()
}

/// Kills come when one or two more files are being written or have just been, and up to 30 ms later: however fast the
/// machine is and however busy, there is something to lose.
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
        let (more, delay_ms) = (1 + (random >> 40) % 2, (random >> 33) % 31);
        let before = names(&killed);
        let mut process = start.spawn().expect("uw starts");
        while process.try_wait().expect("a process").is_none()
            && (names(&killed).difference(&before).count() as u64) < more
        {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(delay_ms));
        process.kill().expect("killed or done");
        process.wait().expect("ended");
    }
    assert!(start.status().expect("uw runs").success());
    assert_same(&undisturbed, &killed);
}

#[test]
fn a_folder_of_another_configuration_is_refused() {
    for other in [
        DatasetConfig { seed: 2, ..tiny() },
        DatasetConfig {
            bands: "spectral".into(),
            ..tiny()
        },
    ] {
        let folder = tempfile::tempdir().expect("folder");
        let text = other.to_text().expect("text");
        std::fs::write(folder.path().join("config.toml"), text).expect("writable");
        let observer = Observer {
            progress: &|_| {},
            tell: &|_| {},
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
}
