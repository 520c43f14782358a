//! What the tests share.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use uw_viewer::model::{Display, OpenScene, Settings};
use uw_viewer::worker::{Frame, Goal, Job, Place, View, Worker};

/// How long anything may take before a test gives up.
pub(crate) const PATIENCE: Duration = Duration::from_secs(120);

/// A small scene without files: a wall in clear water, one lamp, daylight.
pub(crate) const SCENE: &str = r#"format = "uw-scene/1"
water = { jerlov = "IB" }
surface = { height_m = 0.0 }
sun = { zenith_deg = 30.0, irradiance = [1.0, 1.0, 1.0] }
sky = { radiance = [0.1, 0.1, 0.1] }
camera = { position_m = [0.0, 0.0, -3.0], forward = [1.0, 0.0, 0.0], hfov_deg = 60.0, width = 160, height = 90 }
sensor = { exposure = 4.0 }
[[lamp]]
name = "left"
position_m = [0.0, 0.3, -3.0]
intensity = [1.0, 1.0, 1.0]
[[object]]
plane = { center_m = [1.5, 0.0, -4.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [4.0, 4.0] }
reflectance = [0.5, 0.4, 0.3]
"#;

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
