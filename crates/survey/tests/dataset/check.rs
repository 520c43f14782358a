//! Labels against plain renders, as `--check` does it.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use uw_assets::assets_dir;
use uw_survey::dataset::{
    CheckPlan, CheckReport, DatasetConfig, DatasetError, Observer, Progress, Shard, check,
};

use super::{options, run, tiny};

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
            tell: &|_| {},
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

/// Gives the changed bytes of a render a checksum that fits, as a method that is wrong would.
fn reseal(folder: &Path, path: &Path, bytes: &mut [u8]) {
    let name = path.strip_prefix(folder).expect("inside").display();
    let (sealed, sum) = bytes.split_last_chunk_mut::<4>().expect("a checksum");
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(format!("{name}\0").as_bytes());
    hasher.update(sealed);
    *sum = hasher.finalize().to_le_bytes();
}

/// Makes the light of all renders of targets `factor` times brighter.
fn brighten(renders: &Path, factor: f64) {
    for file in std::fs::read_dir(renders).expect("renders") {
        let path = file.expect("a render").path();
        if path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .starts_with("up_")
        {
            continue;
        }
        let mut bytes = std::fs::read(&path).expect("readable");
        // Format and header take 32 bytes.
        for value in bytes[32..].as_chunks_mut::<8>().0 {
            *value = (factor * f64::from_le_bytes(*value)).to_le_bytes();
        }
        let folder = renders.ancestors().nth(2).expect("the folder");
        reseal(folder, &path, &mut bytes);
        std::fs::write(&path, bytes).expect("writable");
    }
}

#[test]
fn a_check_finds_wrong_labels_and_does_not_believe_them() {
    let folder = tempfile::tempdir().expect("folder");
    let mut config = DatasetConfig {
        water_types: vec!["II".into()],
        ..tiny()
    };
    config.accuracy.least_paths = 4096;
    config.accuracy.most_paths = 4096;
    run(&config, folder.path(), &options(2, Shard::WHOLE));
    let assets = assets_dir().expect("assets");
    let plan = CheckPlan {
        entries: 2,
        samples_per_pixel: 128,
        pixels_per_patch: 8,
    };
    let report = || {
        let observer = Observer {
            progress: &|_| {},
            tell: &|_| {},
            cancel: &AtomicBool::new(false),
        };
        check(&config, folder.path(), &assets, &plan, Some(2), &observer).expect("a report")
    };
    let right = report();
    std::fs::remove_dir_all(folder.path().join("check")).expect("entries");
    assert_eq!(right.wrong(), [""; 0]);
    brighten(&folder.path().join("renders/II_B0.0183"), 2.0);
    std::fs::remove_dir_all(folder.path().join("images")).expect("tables of images");
    run(&config, folder.path(), &options(2, Shard::WHOLE));
    let wrong = report();
    for (right, wrong) in right.entries.iter().zip(&wrong.entries) {
        for k in 0..3 {
            let error = right.error[k].hypot(wrong.error[k]);
            let off = right.label[k] - right.render[k];
            assert!(off.abs() < 0.2 + 4.0 * error, "{right:?}");
            let moved = wrong.render[k] - right.render[k];
            assert!(moved.abs() < 0.2 + 4.0 * error, "{right:?} {wrong:?}");
        }
    }
    assert!(wrong.mean > right.mean + 0.3, "{right:?} {wrong:?}");
}
