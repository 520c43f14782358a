//! A small operation from its configuration to its report.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_calib::vehicle::Vehicle;
use uw_evaluation::EvalError;
use uw_evaluation::operation::config::OperationConfig;
use uw_evaluation::operation::{self, Observer, report};

fn config() -> OperationConfig {
    let mut config = OperationConfig {
        target: "seabed".into(),
        depths_m: vec![1.0, 3.0],
        distances_m: vec![0.75, 2.0],
        light_pct: vec![0.0, 100.0],
        stations: 3,
        views_per_leg: 2,
        repetitions: 2,
        presets: vec!["release".into()],
        niqe_block_px: 16,
        covered_inliers: 4,
        vehicle: Vehicle {
            width: 96,
            height: 54,
            ..Vehicle::default()
        },
        ..OperationConfig::default()
    };
    config.water.truncate(1);
    config.water[0].held_distance_m = 2.0;
    config.calibration.distances_m = vec![0.75, 2.0];
    config.calibration.depths_m = vec![1.0, 3.0];
    config.calibration.up_samples_per_half = 2;
    config.quality.most_samples = 2;
    config
}

fn assets() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets")
}

fn fly(
    config: &OperationConfig,
    folder: &Path,
    stop: bool,
) -> Result<operation::Operation, EvalError> {
    let cancel = AtomicBool::new(stop);
    let observer = Observer {
        progress: &|_, _| {},
        cancel: &cancel,
    };
    operation::claim(config, folder)?;
    operation::run(config, folder, &assets(), None, &observer)
}

#[test]
fn an_operation_is_flown_reported_and_taken_up_again() {
    let folder = tempfile::tempdir().expect("folder");
    let config = config();
    config.check().expect("valid");
    let stopped = fly(&config, folder.path(), true);
    assert!(matches!(stopped, Err(EvalError::Interrupted)));

    let found = fly(&config, folder.path(), false).expect("flown");
    let water = &found.waters[0];
    // Guidance, NIQE, gradient, two patterns, oracle.
    assert_eq!(water.methods.len(), 6);
    for result in &water.methods {
        assert_eq!(result.flights.len(), 2);
        for (flight, measure) in result.flights.iter().zip(&result.measures) {
            assert_eq!(flight.len(), 4);
            // A pair on each of two legs.
            assert_eq!(flight.iter().filter(|s| s.pair.is_some()).count(), 2);
            assert!((0.0..=1.0).contains(&measure.inlier_ratio));
            // Nothing is better than the best, up to the search's tolerance.
            assert!(
                flight.iter().all(|s| s.regret[0] > -1e-3),
                "{}",
                result.method.name()
            );
        }
    }
    let by_name = |name: &str| {
        let result = water.methods.iter().find(|r| r.method.name() == name);
        &result.expect(name).measures[0]
    };
    assert!(by_name("oracle (release)").regret[0] < 1e-3);
    assert!(by_name("2 m pattern").coverage_m2 > by_name("1 m pattern").coverage_m2);
    assert!(by_name("2 m pattern").features > 20.0);

    report::write(&config, &found, folder.path()).expect("report");
    let text = std::fs::read_to_string(folder.path().join("report.md")).expect("report");
    assert!(text.contains("| 2 m pattern |"), "{text}");
    let rows = std::fs::read_to_string(folder.path().join("steps.csv")).expect("table");
    assert_eq!(rows.lines().count(), 1 + 6 * 2 * 4);

    // The second run finds every view on disk and says the same.
    let again = fly(&config, folder.path(), false).expect("flown again");
    report::write(&config, &again, folder.path()).expect("report");
    let same = std::fs::read_to_string(folder.path().join("steps.csv")).expect("table");
    assert_eq!(rows, same);
    // Renders made again would have taken other times; the sum's order is not fixed.
    assert!((again.cost.render_cpu_s / found.cost.render_cpu_s - 1.0).abs() < 1e-9);
}
