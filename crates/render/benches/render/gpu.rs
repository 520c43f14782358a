//! Whole small pictures on both backends: samples of pixels per second of wall time, all cores. On the GPU the upload and
//! the driver's compilation, kept between runs, are part of it.

use std::sync::atomic::AtomicBool;

use criterion::{Criterion, Throughput};
use uw_render::gpu::{self, AdapterChoice, Gpu};
use uw_render::integrator::{self, Plan};
use uw_render::prepare::Prepared;
use uw_render::scene::SceneError;

use super::scenes::read;

const SCENES: [&str; 4] = ["s1_clear", "s1_mesh", "s2_turbid", "s3_sun"];
const SAMPLES: u32 = 16;

/// Both backends on every scene; the GPU only where there is an adapter.
pub fn bench(criterion: &mut Criterion) -> Result<(), SceneError> {
    let device = Gpu::open(AdapterChoice::Best).ok();
    let plan = Plan {
        samples_per_pixel: Some(SAMPLES),
        time_limit: None,
        target_error: None,
        seed: 1,
        threads: None,
        max_bounces: 0,
        dark_lamps: false,
    };
    let go_on = AtomicBool::new(false);
    let mut group = criterion.benchmark_group("backend");
    group.sample_size(10);
    for name in SCENES {
        let prepared = Prepared::build(&read(name)?);
        let pixels = prepared.camera.width * prepared.camera.height;
        group.throughput(Throughput::Elements(u64::from(pixels * SAMPLES)));
        group.bench_function(format!("cpu/{name}"), |bencher| {
            bencher.iter(|| integrator::render(&prepared, &plan, &go_on, &|_| {}));
        });
        let Some(device) = &device else { continue };
        group.bench_function(format!("gpu/{name}"), |bencher| {
            bencher.iter(|| gpu::render(device, &prepared, &plan, &go_on, &|_| {}));
        });
    }
    group.finish();
    Ok(())
}
