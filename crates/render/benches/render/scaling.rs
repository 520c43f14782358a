//! Whole renders against the number of threads, and samples against the optical depth of the water.

use std::sync::atomic::AtomicBool;

use criterion::{Criterion, Throughput};
use uw_render::backend::Device;
use uw_render::integrator::{self, Plan};
use uw_render::prepare::Prepared;
use uw_render::scene::{Scene, SceneError};

use super::scenes::{bench_samples, read};

/// Optical depths of the green channel between camera and target.
const OPTICAL_DEPTHS: [f64; 3] = [1.0, 4.0, 16.0];
/// Distance of the target of `s2_turbid`, m.
const RANGE_M: f64 = 1.5;

/// The rates, in samples.
pub fn bench(criterion: &mut Criterion) -> Result<(), SceneError> {
    for name in ["s2_turbid", "s3_sun"] {
        threads(criterion, name)?;
    }
    let mut group = criterion.benchmark_group("optical depth");
    for depth in OPTICAL_DEPTHS {
        let mut scene = read("s2_turbid")?;
        scale_water(&mut scene, depth);
        bench_samples(&mut group, &depth.to_string(), &scene, &Device::CpuSimd);
    }
    group.finish();
    Ok(())
}

/// Absorption and scattering scaled together, so that the albedo stays.
fn scale_water(scene: &mut Scene, optical_depth: f64) {
    if let Some(water) = &mut scene.water {
        let factor = optical_depth / (RANGE_M * water.iops.c()[1]);
        water.iops.a = water.iops.a.map(|a| factor * a);
        water.iops.b = water.iops.b.map(|b| factor * b);
    }
}

fn threads(criterion: &mut Criterion, name: &str) -> Result<(), SceneError> {
    const SAMPLES: u32 = 4;
    let mut scene = read(name)?;
    // A quarter of the picture in each direction, the same view.
    let camera = &mut scene.camera;
    camera.width /= 4;
    camera.height /= 4;
    camera.focal_px /= 4.0;
    camera.centre_px /= 4.0;
    let pixels = u64::from(camera.width) * u64::from(camera.height);
    let prepared = Prepared::build(&scene);
    let mut group = criterion.benchmark_group(format!("threads/{name}"));
    group.throughput(Throughput::Elements(pixels * u64::from(SAMPLES)));
    for threads in [1, 2] {
        let plan = Plan {
            samples_per_pixel: Some(SAMPLES),
            threads: Some(threads),
            ..Plan::new(1)
        };
        group.bench_function(threads.to_string(), |bencher| {
            bencher.iter(|| {
                let cancel = AtomicBool::new(false);
                integrator::render(&prepared, &plan, &cancel, &|_| {}).is_ok()
            });
        });
    }
    group.finish();
    Ok(())
}
