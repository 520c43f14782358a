//! The network's forward pass and a whole suggestion, with the shipped model.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use uw_calib::{ContrastSample, DepthSample, Profile, Source};
use uw_guidance::service::Session;
use uw_guidance::{Candidate, Model, Objective, Observation, Service, Situation, advise};

const MODEL: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../assets/models/default.json"
);
const NOW: Observation = Observation {
    depth_m: 3.0,
    distance_m: 1.0,
    light_pct: 20.0,
    mean: [41.0, 88.0, 79.0],
    std: [4.1, 7.7, 6.2],
    quality: None,
};
const LINE: &[u8] = b"{\"op\": \"suggest\", \"id\": 7, \"depth_m\": 3.0, \"distance_m\": 1.0, \
    \"light_pct\": 20.0, \"mean\": [41.0, 88.0, 79.0], \"std\": [4.1, 7.7, 6.2]}";

/// A water in which light and contrast fall exponentially.
fn profile() -> Profile {
    let steps = |n: u32| (1..=n).map(|k| 0.5 * f64::from(k));
    let contrast = |gain: f64| {
        steps(6)
            .map(|distance_m| ContrastSample {
                distance_m,
                k_c: [0.9f64, 0.5, 0.6].map(|c| gain * 18.0 * (-c * distance_m).exp()),
            })
            .collect()
    };
    let depth = steps(12)
        .map(|depth_m| DepthSample {
            depth_m,
            k_z: [0.6f64, 0.15, 0.25].map(|k| (-k * (depth_m - 0.5)).exp()),
        })
        .collect();
    let source = Source {
        made_by: "benchmark".to_owned(),
        images: 0,
        note: None,
    };
    Profile::new(depth, contrast(1.5), contrast(1.0), source).expect("a usable profile")
}

fn forward(c: &mut Criterion) {
    let model = Model::read(MODEL.as_ref()).expect("the shipped model");
    let profile = profile();
    let situation = Situation::new(&NOW, &profile).expect("inside the profile");
    let mut query = model.query(&situation);
    let candidates: Vec<Candidate> = (0..96)
        .map(|k| Candidate {
            distance_m: 0.5 + 0.025 * f64::from(k),
            light_pct: f64::from(k),
        })
        .collect();
    let mut found = vec![[0.0; 3]; candidates.len()];
    let mut group = c.benchmark_group("forward");
    group.throughput(Throughput::Elements(candidates.len() as u64));
    group.bench_function("one by one, f64", |b| {
        b.iter(|| {
            for candidate in black_box(&candidates) {
                black_box(query.contrast(candidate));
            }
        });
    });
    group.bench_function("one by one, f32", |b| {
        b.iter(|| {
            for candidate in black_box(&candidates) {
                black_box(query.quick_contrast(candidate));
            }
        });
    });
    group.bench_function("batched, f64", |b| {
        b.iter(|| query.contrasts(black_box(&candidates), &mut found));
    });
    group.finish();
}

fn suggestion(c: &mut Criterion) {
    let model = Model::read(MODEL.as_ref()).expect("the shipped model");
    let (profile, objective) = (profile(), Objective::default());
    c.bench_function("advise", |b| {
        b.iter(|| advise(black_box(&NOW), &profile, &model, &objective));
    });
    let service = Service::new(model, "default", profile, objective);
    let mut session = Session::new(Arc::new(service));
    c.bench_function("line to line", |b| {
        b.iter(|| session.reply(black_box(LINE)));
    });
}

criterion_group!(benches, forward, suggestion);
criterion_main!(benches);
