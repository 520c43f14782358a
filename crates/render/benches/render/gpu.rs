//! Whole small pictures on all backends: paths per second of wall time, all cores. On the GPU the upload and
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
/// Samples per pixel.
pub const SAMPLES: u32 = 16;
static GO_ON: AtomicBool = AtomicBool::new(false);

/// All backends on every scene; the GPU only where there is an adapter.
pub fn bench(criterion: &mut Criterion) -> Result<(), SceneError> {
    let device = Gpu::open(AdapterChoice::Best).ok();
    let mut group = criterion.benchmark_group("backend");
    group.sample_size(10);
    for name in SCENES {
        let scene = read(name)?;
        // All backends make the same paths.
        let plan = plan();
        let counted = integrator::render(&Prepared::build(&scene), &plan, &GO_ON, &|_| {});
        let paths = counted.map_or(0, |(_, stats)| stats.paths);
        group.throughput(Throughput::Elements(paths));
        bench_picture(&mut group, &format!("cpu/{name}"), &scene, Backend::Double);
        bench_picture(
            &mut group,
            &format!("cpu-simd/{name}"),
            &scene,
            Backend::Lanes,
        );
        if let Some(device) = &device {
            bench_picture(
                &mut group,
                &format!("gpu/{name}"),
                &scene,
                Backend::Adapter(device),
            );
        }
    }
    group.finish();
    Ok(())
}

fn plan() -> Plan {
    Plan {
        samples_per_pixel: Some(SAMPLES),
        ..Plan::new(1)
    }
}

/// Where a picture is rendered.
#[derive(Clone, Copy)]
pub enum Backend<'a> {
    Double,
    Lanes,
    Adapter(&'a Gpu),
}

/// A whole picture of `scene`; what is counted in it is the group's matter.
pub fn bench_picture(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    scene: &Scene,
    backend: Backend<'_>,
) {
    let (plan, prepared) = (plan(), Prepared::build(scene));
    group.bench_function(name, |bencher| {
        bencher.iter(|| match backend {
            Backend::Adapter(device) => gpu::render(device, &prepared, &plan, &GO_ON, &|_| {}),
            Backend::Lanes => integrator::render_lanes(&prepared, &plan, &GO_ON, &|_| {}),
            Backend::Double => integrator::render(&prepared, &plan, &GO_ON, &|_| {}),
        });
    });
}
