//! The graphics adapter that tests share.

use std::sync::{LazyLock, atomic::AtomicBool};

use uw_render::{
    film::Film,
    gpu::{self, AdapterChoice, Gpu, GpuError, skipped::skip_test},
    integrator::{Plan, RenderStats},
    prepare::Prepared,
    scene::Scene,
};

static SHARED: LazyLock<Result<Gpu, GpuError>> = LazyLock::new(|| Gpu::open(AdapterChoice::Best));

/// The adapter, or `None` where there is none; then the test that asks, once, is counted as skipped.
///
/// # Panics
/// When `UW_REQUIRE_GPU` is 1 and there is no adapter.
pub fn device() -> Option<&'static Gpu> {
    SHARED.as_ref().inspect_err(|error| skip_test(error)).ok()
}

/// Renders `scene` to the end on `gpu`.
///
/// # Panics
/// When rendering fails.
pub fn render(gpu: &Gpu, scene: &Scene, plan: &Plan) -> (Film, RenderStats) {
    let prepared = Prepared::build(scene);
    gpu::render(gpu, &prepared, plan, &AtomicBool::new(false), &|_| {})
        .unwrap_or_else(|e| panic!("{e}"))
}
