//! What the tests share.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use uw_calib::Profile;
use uw_guidance::advice::predict;
use uw_guidance::{Candidate, Model, Objective, Observation};
use uw_viewer::model::{Display, OpenScene, Settings};
use uw_viewer::worker::{Frame, Goal, Job, RenderDevice, View, Worker};

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
        sensor: settings.sensor(),
        probing: false,
        on_host: false,
        denoised: false,
    }
}

/// A worker on the processor.
pub(crate) fn worker(settings: &Settings, goal: Goal) -> Worker {
    Worker::start(RenderDevice::default(), view(settings), goal, || {}).expect("a thread")
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

/// A profile that ships, of water III.
pub(crate) fn profile() -> Profile {
    Profile::read(&repository().join("assets/profiles/III.json")).expect("shipped")
}

/// The model that ships.
pub(crate) fn model() -> Model {
    Model::read(uw_assets::DEFAULT_MODEL.as_ref()).expect("shipped")
}

/// A state whose picture has the contrast that `model` predicts for no change.
pub(crate) fn fitting(depth_m: f64, distance_m: f64, light_pct: f64, model: &Model) -> Observation {
    let mut now = Observation {
        depth_m,
        distance_m,
        light_pct,
        mean: [40.0, 80.0, 70.0],
        std: [4.0, 8.0, 6.0],
        quality: None,
    };
    let here = [Candidate {
        distance_m,
        light_pct,
    }];
    for _ in 0..200 {
        let predicted = predict(&now, &here, &profile(), model, &Objective::default());
        let predicted = predicted.expect("calibrated").contrast[0];
        now.std = std::array::from_fn(|k| 0.5 * (now.std[k] + predicted[k]));
    }
    now
}

/// A recording of six suggestions of a daemon, as it writes them, for states that the shipped model knows; their pictures
/// have the contrast that it predicts times `share`.
pub(crate) fn recording(share: f64) -> String {
    let start = serde_json::json!({"kind": "start", "format": "uwguide-record/1", "sequence": 0});
    let mut text = format!("{start}\n");
    let model = model();
    for i in 0..6_u32 {
        let step = f64::from(i);
        let now = fitting(1.0 + 0.3 * step, 1.0 + 0.2 * step, 10.0 * step, &model);
        let request = serde_json::json!({
            "op": "suggest", "id": i, "depth_m": now.depth_m, "distance_m": now.distance_m,
            "light_pct": now.light_pct, "mean": now.mean, "std": now.std.map(|std| share * std),
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
