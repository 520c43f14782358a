//! Where tests render: on the processor, on its vector units, on the graphics adapter that they share.

use std::sync::{LazyLock, atomic::AtomicBool};

use uw_render::{
    film::Film,
    gpu::{self, AdapterChoice, Gpu, GpuError, skipped::skip_test},
    integrator::{self, Plan, RenderStats},
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

/// Where a test renders.
#[derive(Clone, Copy)]
pub enum Place {
    /// The native path tracer.
    Native,
    /// The kernels in double precision.
    Double,
    /// The kernels on the processor's vector units.
    VectorUnits,
    /// The kernels on a graphics adapter.
    Adapter(&'static Gpu),
}

/// Both ways of the processor, of which `uw render` takes one where there is no hardware GPU.
pub const PROCESSOR: [Place; 2] = [Place::Native, Place::VectorUnits];

/// Where kernels run: the processor and, where there is one, the adapter; a test without one is counted as skipped, once.
///
/// # Panics
/// As in [`device`].
pub fn places() -> Vec<Place> {
    let adapter = device().map(Place::Adapter);
    let processor = [Place::Double, Place::VectorUnits];
    processor.into_iter().chain(adapter).collect()
}

impl Place {
    /// For messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Double => "double precision",
            Self::VectorUnits => "vector units",
            Self::Adapter(_) => "adapter",
        }
    }

    /// Renders `scene` to the end.
    ///
    /// # Panics
    /// When rendering fails.
    pub fn render(self, scene: &Scene, plan: &Plan) -> (Film, RenderStats) {
        let (prepared, go_on) = (Prepared::build(scene), AtomicBool::new(false));
        match self {
            Self::Native => integrator::render(&prepared, plan, &go_on, &|_| {}),
            Self::Double => integrator::render_exact(&prepared, plan, &go_on, &|_| {}),
            Self::VectorUnits => integrator::render_lanes(&prepared, plan, &go_on, &|_| {}),
            Self::Adapter(gpu) => gpu::render(gpu, &prepared, plan, &go_on, &|_| {}),
        }
        .unwrap_or_else(|e| panic!("{e}"))
    }
}
