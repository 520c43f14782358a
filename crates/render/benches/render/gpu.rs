//! Whole small pictures on both backends: samples of pixels per second of wall time, all cores. On the GPU the upload and
//! the driver's compilation, kept between runs, are part of it.

use std::sync::atomic::AtomicBool;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput};
use uw_render::gpu::{self, AdapterChoice, Gpu};
use uw_render::integrator::{self, Plan};
use uw_render::prepare::Prepared;
use uw_render::scene::{Scene, SceneError};

use super::scenes::read;

const SCENES: [&str; 4] = ["s1_clear", "s1_mesh", "s2_turbid", "s3_sun"];
const SAMPLES: u32 = 16;

/// Both backends on every scene; the GPU only where there is an adapter.
pub fn bench(criterion: &mut Criterion) -> Result<(), SceneError> {
    let device = Gpu::open(AdapterChoice::Best).ok();
    let mut group = criterion.benchmark_group("backend");
    group.sample_size(10);
    for name in SCENES {
        let scene = read(name)?;
        bench_picture(&mut group, &format!("cpu/{name}"), &scene, None);
        if device.is_some() {
            bench_picture(&mut group, &format!("gpu/{name}"), &scene, device.as_ref());
        }
    }
    group.finish();
    Ok(())
}

/// A whole picture of `scene` on `device`, or on the processor.
pub fn bench_picture(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    scene: &Scene,
    device: Option<&Gpu>,
) {
    let plan = Plan {
        samples_per_pixel: Some(SAMPLES),
        time_limit: None,
        target_error: None,
        seed: 1,
        threads: None,
        max_bounces: 0,
        dark_lamps: false,
        share_walks: 1,
    };
    let go_on = AtomicBool::new(false);
    let prepared = Prepared::build(scene);
    let pixels = prepared.camera.width * prepared.camera.height;
    group.throughput(Throughput::Elements(u64::from(pixels * SAMPLES)));
    group.bench_function(name, |bencher| {
        bencher.iter(|| match device {
            Some(device) => gpu::render(device, &prepared, &plan, &go_on, &|_| {}),
            None => integrator::render(&prepared, &plan, &go_on, &|_| {}),
        });
    });
}
