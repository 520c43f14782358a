//! What the tests share.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use uw_viewer::model::{Display, OpenScene, Settings};
use uw_viewer::worker::{Frame, Goal, Job, Place, View, Worker};

pub(crate) use crate::common::{PATIENCE, SCENE};

/// The small scene.
pub(crate) fn small() -> (OpenScene, Settings) {
    OpenScene::parse(SCENE, "small.toml".as_ref()).expect("valid")
}

/// The repository's folder.
pub(crate) fn repository() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// A view without noise.
pub(crate) fn view(settings: &Settings) -> View {
    View {
        display: Display::default(),
        sensor: settings.sensor,
        probing: false,
    }
}

/// A worker on the processor.
pub(crate) fn worker(settings: &Settings, goal: Goal) -> Worker {
    Worker::start(Place::default(), view(settings), goal, || {}).expect("a thread")
}

/// A job.
pub(crate) fn job(generation: u64, open: &OpenScene, settings: &Settings) -> Job {
    Job {
        generation,
        settings: settings.clone(),
        geometry: open.geometry.clone(),
        seed: 7,
    }
}

/// Waits for a frame that `fits`.
pub(crate) fn frame(worker: &Worker, fits: impl Fn(&Frame) -> bool) -> std::sync::Arc<Frame> {
    let start = Instant::now();
    loop {
        if let Some(frame) = worker.latest().filter(|f| fits(f)) {
            return frame;
        }
        assert!(worker.is_alive(), "the worker has ended");
        assert!(start.elapsed() < PATIENCE, "no such frame came");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Whether a missing adapter is a failure.
pub(crate) fn must_have_gpu() -> bool {
    std::env::var_os("UW_REQUIRE_GPU").is_some_and(|value| value == "1")
}

/// Whether there is an adapter to draw with. Says so where there is none.
pub(crate) fn has_gpu() -> bool {
    let found = !uw_render::gpu::adapters().is_empty();
    assert!(
        found || !must_have_gpu(),
        "UW_REQUIRE_GPU is set and there is no graphics adapter"
    );
    if !found {
        eprintln!("skipped: no graphics adapter");
    }
    found
}

/// A profile as of turbid water.
pub(crate) fn profile() -> uw_calib::Profile {
    let samples = |top: f64, decay: f64| {
        (1..=6).map(move |i| {
            let at = 0.5 * f64::from(i);
            let value = top * (-decay * at).exp();
            (at, [0.6 * value, 1.5 * value, value])
        })
    };
    let contrast = |top: f64| {
        samples(top, 0.7)
            .map(|(distance_m, k_c)| uw_calib::ContrastSample { distance_m, k_c })
            .collect()
    };
    let depth = samples(1.0, 0.5).map(|(depth_m, k_z)| uw_calib::DepthSample { depth_m, k_z });
    let source = uw_calib::Source {
        made_by: "test".to_owned(),
        images: 0,
        note: None,
    };
    uw_calib::Profile::new(depth.collect(), contrast(24.0), contrast(9.0), source).expect("valid")
}

/// A recording of six suggestions of a daemon, as `uwguide --record` writes it.
pub(crate) fn recording() -> String {
    let start = serde_json::json!({"kind": "start", "format": "uwguide-record/1", "sequence": 0});
    let mut text = format!("{start}\n");
    for i in 0..6_u32 {
        let step = f64::from(i);
        let request = serde_json::json!({
            "op": "suggest", "id": i, "depth_m": 1.0 + 0.3 * step, "distance_m": 1.0 + 0.2 * step,
            "light_pct": 10.0 * step, "mean": [40.0, 80.0, 70.0], "std": [4.0, 8.0, 6.0],
        });
        let reply = serde_json::json!({
            "id": i, "ok": true, "valid": true, "reason": null, "distance_m": 1.2 + 0.15 * step,
            "light_pct": 15.0 + 5.0 * step, "delta_distance_m": 0.2, "delta_light_pct": 15.0,
            "predicted_contrast": [3.0, 7.0, 5.0], "score": 1.2, "score_here": 1.0, "evaluations": 300,
        });
        let record = serde_json::json!({
            "kind": "request", "sequence": i + 1, "connection": 1, "since_start_s": 2.0 * step,
            "unix_s": 0.0, "elapsed_us": 150, "line": request.to_string(), "reply": reply.to_string(),
        });
        text += &format!("{record}\n");
    }
    text
}
