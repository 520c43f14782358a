//! Water as numbers: phase functions of every model, exact and as tables, and free paths.
//!
//! Rates are calls per second. Arguments are a fixed set, drawn from the model itself: a call meets the angles, and the
//! mispredicted branches, that a path tracer gives it.

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput};
use uw_media::phase::{
    Draine, FournierForand, HenyeyGreenstein, Mixture, Phase, PhaseFunction, PhaseTable, Rayleigh,
    Tabulated,
};
use uw_media::transmittance::{free_path_m, transmittance};
use uw_media::{Bands, MediaError, channel_iops};

/// Arguments per iteration.
const CALLS: u32 = 1024;

fn main() -> Result<(), MediaError> {
    let mut criterion = Criterion::default()
        .sample_size(30)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1000))
        .configure_from_args();
    for phase in models()? {
        bench_phase(&mut criterion, &phase);
    }
    bench_paths(&mut criterion)?;
    criterion.final_summary();
    Ok(())
}

fn models() -> Result<Vec<Phase>, MediaError> {
    let particles = Phase::FournierForand(FournierForand::new(1.10, 0.0183)?);
    let water = Phase::Rayleigh(Rayleigh::new(0.039)?);
    Ok(vec![
        particles.clone(),
        Phase::HenyeyGreenstein(HenyeyGreenstein::new(0.924)?),
        water.clone(),
        Phase::Isotropic,
        Phase::Draine(Draine::new(0.9, 0.5)?),
        Phase::Tabulated(Tabulated::petzold()),
        Phase::Mixture(Mixture::new(vec![(0.95, particles), (0.05, water)])?),
    ])
}

/// Numbers spread evenly over (0, 1) in an order without pattern: the golden ratio's multiples.
fn shares() -> Vec<f64> {
    (0..CALLS)
        .map(|i| (0.618_033_988_749_894_9 * (f64::from(i) + 0.5)).fract())
        .collect()
}

/// One call for each argument.
fn bench_calls(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    arguments: &[f64],
    call: impl Fn(f64) -> f64,
) {
    group.throughput(Throughput::Elements(arguments.len() as u64));
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            let arguments = black_box(arguments).iter();
            arguments.map(|&x| call(x)).sum::<f64>()
        });
    });
}

fn bench_phase(criterion: &mut Criterion, phase: &Phase) {
    let table = PhaseTable::new(phase);
    let shares = shares();
    let angles: Vec<f64> = shares.iter().map(|&u| table.sample_x(u)).collect();
    let mut group = criterion.benchmark_group(format!("phase/{}", phase.name()));
    bench_calls(&mut group, "value", &angles, |x| phase.value(x));
    bench_calls(&mut group, "cdf", &angles, |x| phase.cdf(x));
    bench_calls(&mut group, "inverse cdf", &shares, |u| phase.inverse_cdf(u));
    bench_calls(&mut group, "table value", &angles, |x| table.value(x));
    bench_calls(&mut group, "table sample", &shares, |u| table.sample_x(u));
    group.throughput(Throughput::Elements(1));
    group.bench_function("table build", |bencher| {
        bencher.iter(|| PhaseTable::new(black_box(phase)));
    });
    group.finish();
}

fn bench_paths(criterion: &mut Criterion) -> Result<(), MediaError> {
    let c = channel_iops("3C".parse()?, &Bands::Mean)?.c()[1];
    let shares = shares();
    let ranges_m: Vec<f64> = shares.iter().map(|&u| free_path_m(c, u)).collect();
    let mut group = criterion.benchmark_group("path");
    bench_calls(&mut group, "free path", &shares, |u| free_path_m(c, u));
    bench_calls(&mut group, "transmittance", &ranges_m, |range_m| {
        transmittance(c, range_m)
    });
    group.finish();
    Ok(())
}
