//! The graphics adapter that tests share.

use std::{
    env,
    sync::{LazyLock, atomic::AtomicBool},
};

use uw_render::{
    film::Film,
    gpu::{self, AdapterChoice, Gpu, GpuError},
    integrator::{Plan, RenderStats},
    prepare::Prepared,
    scene::Scene,
};

static SHARED: LazyLock<Result<Gpu, GpuError>> = LazyLock::new(|| Gpu::open(AdapterChoice::Best));

/// The adapter, or `None` where there is none and `UW_REQUIRE_GPU` does not ask for one; then the test says that it was
/// skipped.
///
/// # Panics
/// When `UW_REQUIRE_GPU` is 1 and there is no adapter.
pub fn device() -> Option<&'static Gpu> {
    match &*SHARED {
        Ok(gpu) => Some(gpu),
        Err(error) if env::var("UW_REQUIRE_GPU").is_ok_and(|v| v == "1") => {
            panic!("UW_REQUIRE_GPU is set, but {error}")
        }
        Err(_) => None,
    }
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
