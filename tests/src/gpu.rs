//! Where tests render: on the processor, on its vector units, on a graphics adapter.

use std::{
    cell::{LazyCell, RefCell},
    collections::VecDeque,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Mutex, PoisonError, atomic::AtomicBool},
};

use uw_render::{
    backend::Device,
    film::Film,
    gpu::{AdapterChoice, Gpu, GpuError, skipped::skip_test},
    integrator::{Plan, RenderStats},
    irradiance::{DepthIrradiance, IrradianceError, IrradiancePlan, measure},
    prepare::Prepared,
    scene::Scene,
};

/// Tests that one opened adapter serves: it keeps what it has compiled, which half of the time of many tests goes into, but also the
/// memory for that, until it is closed.
const MOST_TESTS: u32 = 48;
/// Opened adapters that wait for a test.
static IDLE: Mutex<Vec<Lent>> = Mutex::new(Vec::new());

thread_local! {
    /// The adapter of a test, which runs on a thread of its own.
    static OWN: LazyCell<Result<Lent, GpuError>> = LazyCell::new(|| {
        let idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner).pop();
        match idle {
            Some(lent) => Ok(lent),
            None => Ok(Lent {
                gpu: Gpu::open(AdapterChoice::Best).inspect_err(skip_test)?,
                tests: 0,
            }),
        }
    });
}

/// Most scenes that a test keeps.
const MOST_SCENES: usize = 64;

thread_local! {
    /// The last scenes of a test by all that they say, so that one is prepared for all backends at once.
    static PREPARED: RefCell<VecDeque<(String, Arc<Prepared>)>> = RefCell::default();
}

/// `scene` for a renderer. Textures do not say all that they are, and meshes say too much: scenes with either are kept by nobody.
pub fn prepared(scene: &Scene) -> Arc<Prepared> {
    let build = || Arc::new(Prepared::build(scene));
    if !scene.textures.is_empty() || !scene.meshes.is_empty() {
        return build();
    }
    let key = format!("{scene:?}");
    PREPARED.with_borrow_mut(|kept| {
        if let Some((_, found)) = kept.iter().find(|(other, _)| *other == key) {
            return found.clone();
        }
        if kept.len() == MOST_SCENES {
            kept.pop_front();
        }
        let built = build();
        kept.push_back((key, built.clone()));
        built
    })
}

/// An opened adapter that is lent to test after test.
struct Lent {
    gpu: Gpu,
    tests: u32,
}

impl Drop for Lent {
    fn drop(&mut self) {
        if self.tests + 1 < MOST_TESTS {
            let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
            idle.push(Self {
                gpu: self.gpu.clone(),
                tests: self.tests + 1,
            });
        }
    }
}

/// The adapter of the test that asks, or `None` where there is none; then it is counted as skipped, once.
///
/// # Panics
/// When `UW_REQUIRE_GPU` is 1 and there is no adapter.
pub fn device() -> Option<Gpu> {
    OWN.with(|own| own.as_ref().ok().map(|lent| lent.gpu.clone()))
}

/// Relative standard error that single precision leaves in a radiance. Numbers carry 6e-8; a term of light comes out within
/// 9e-7 (measured on the Lambertian plane of `system/closed_form.rs`, where nothing is random), sums and tables within some of
/// that.
const ROUNDING_F32: f64 = 1e-5;

/// Where a test renders.
#[derive(Clone, Copy)]
pub enum Backend {
    /// The kernels in double precision on the processor.
    Double,
    /// The kernels on the processor's vector units.
    VectorUnits,
    /// The kernels on the graphics adapter of the test.
    Adapter,
}

/// Both ways of the processor, of which `uw render` takes one where there is no hardware GPU.
pub const PROCESSOR: [Backend; 2] = [Backend::Double, Backend::VectorUnits];

/// Calls `check` for every backend that this machine has: the kernels in double precision, on the vector units and, where there
/// is one, on the adapter. One that fails keeps no other from being checked; without an adapter the test is counted as
/// skipped, once.
///
/// # Panics
/// With the names of the backends where `check` panicked, and as in [`device`].
#[allow(
    clippy::print_stdout,
    reason = "what a test prints belongs to a backend"
)]
pub fn everywhere(check: impl Fn(Backend)) {
    let mut failed = Vec::new();
    for backend in backends() {
        println!("on {}:", backend.name());
        if catch_unwind(AssertUnwindSafe(|| check(backend))).is_err() {
            failed.push(backend.name());
        }
    }
    assert!(failed.is_empty(), "fails on {}", failed.join(" and on "));
}

/// Where kernels run: the processor and, where there is one, the adapter; a test without one is counted as skipped, once.
///
/// # Panics
/// As in [`device`].
pub fn backends() -> Vec<Backend> {
    let adapter = device().map(|_| Backend::Adapter);
    let processor = [Backend::Double, Backend::VectorUnits];
    processor.into_iter().chain(adapter).collect()
}

/// The backends in single precision, which are compared with the others.
///
/// # Panics
/// As in [`device`].
pub fn in_single_precision() -> Vec<Backend> {
    let adapter = device().map(|_| Backend::Adapter);
    std::iter::once(Backend::VectorUnits)
        .chain(adapter)
        .collect()
}

impl Backend {
    /// For messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Double => "double precision",
            Self::VectorUnits => "vector units",
            Self::Adapter => "adapter",
        }
    }

    /// Samples where `samples` are taken on the vector units. All backends run the same kernels, so that one of them tells of an
    /// error of the transport with all samples; the others, both slower (an adapter may be a processor), take as many as tell of
    /// their own: an eighth.
    pub fn samples(self, samples: u32) -> u32 {
        match self {
            Self::VectorUnits => samples,
            Self::Double | Self::Adapter => samples.div_ceil(8),
        }
    }

    /// Standard error of these samples by that on the vector units.
    pub fn noise(self) -> f64 {
        match self {
            Self::VectorUnits => 1.0,
            Self::Double | Self::Adapter => 8f64.sqrt(),
        }
    }

    /// Relative standard error of radiances for their arithmetic, beside that of their samples.
    pub fn rounding(self) -> f64 {
        match self {
            Self::Double => 0.0,
            Self::VectorUnits | Self::Adapter => ROUNDING_F32,
        }
    }

    /// Renders `scene` to the end.
    ///
    /// # Panics
    /// When rendering fails.
    pub fn render(self, scene: &Scene, plan: &Plan) -> (Film, RenderStats) {
        self.render_prepared(&prepared(scene), plan)
    }

    /// The same of a scene that has been prepared, which often takes longer than few samples.
    ///
    /// # Panics
    /// When rendering fails.
    pub fn render_prepared(self, scene: &Prepared, plan: &Plan) -> (Film, RenderStats) {
        let go_on = AtomicBool::new(false);
        let rendered = self.device().render(scene, plan, &go_on, &|_| {});
        rendered.unwrap_or_else(|e| panic!("{e}"))
    }

    /// What irradiance sensors of `scene` measure.
    ///
    /// # Errors
    /// As in [`measure`].
    pub fn irradiances(
        self,
        scene: &Scene,
        plan: &IrradiancePlan,
    ) -> Result<Vec<DepthIrradiance>, IrradianceError> {
        self.irradiances_prepared(&prepared(scene), plan)
    }

    /// The same of a scene that has been prepared.
    ///
    /// # Errors
    /// As in [`measure`].
    pub fn irradiances_prepared(
        self,
        scene: &Prepared,
        plan: &IrradiancePlan,
    ) -> Result<Vec<DepthIrradiance>, IrradianceError> {
        measure(
            &self.device(),
            scene,
            plan,
            &AtomicBool::new(false),
            &|_| {},
        )
    }

    fn device(self) -> Device {
        match self {
            Self::Double => Device::Cpu,
            Self::VectorUnits => Device::CpuSimd,
            Self::Adapter => Device::from(device().expect("asked for before")),
        }
    }
}
