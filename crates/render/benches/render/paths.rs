//! Samples per second of whole scenes, in double precision and on the vector units, one thread; and the preparation of
//! scenes.

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use uw_render::backend::Device;
use uw_render::prepare::Prepared;
use uw_render::scene::SceneError;

use super::scenes::{bench_samples, read};

const SCENES: [&str; 6] = [
    "s1_clear",
    "s1d_clear_disk",
    "s1_mesh",
    "s2_turbid",
    "s2d_turbid_disk",
    "s3_sun",
];

/// Rates of all scenes.
pub fn bench(criterion: &mut Criterion) -> Result<(), SceneError> {
    for (name, device) in [("cpu", Device::Cpu), ("cpu-simd", Device::CpuSimd)] {
        let mut group = criterion.benchmark_group(format!("samples/{name}"));
        for scene in SCENES {
            bench_samples(&mut group, scene, &read(scene)?, &device);
        }
        group.finish();
    }
    let mut group = criterion.benchmark_group("prepare");
    group.throughput(Throughput::Elements(1)).sample_size(10);
    for name in SCENES {
        let scene = read(name)?;
        group.bench_function(name, |bencher| {
            bencher.iter(|| Prepared::build(black_box(&scene)));
        });
    }
    group.finish();
    Ok(())
}
