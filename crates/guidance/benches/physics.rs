//! Physics: what a picture costs when it arrives, and a suggestion after it.

use std::hint::black_box;
use std::sync::Arc;

use base64::Engine as _;
use criterion::{Criterion, criterion_group, criterion_main};
use uw_calib::picture::Counts;
use uw_calib::{ContrastSample, DepthSample, Encoding, ImageStats, Profile, Source};
use uw_guidance::advice::{By, Physical, advise_by};
use uw_guidance::physics::file::{SensorNumbers, WATER_FORMAT, WaterFile, WaterNumbers};
use uw_guidance::physics::water::{Field, SourceTables, ViewTables, WaterTables};
use uw_guidance::physics::{Present, Sight, Water};
use uw_guidance::service::{Basis, Loaded, Session, Settings};
use uw_guidance::{Candidate, Checks, Objective, Observation, Service};

const DEPTH_M: f64 = 3.0;
const HERE: Candidate = Candidate {
    distance_m: 1.0,
    light_pct: 20.0,
};
const PATCHES: usize = 60;

/// Tables as large as those that `uw water-tables` writes, of a water that attenuates.
fn water(width_px: usize, height_px: usize) -> Arc<Water> {
    let field = |value: f64| -> Field {
        let of_patch = |i: usize| value * (1.0 - 0.004 * (i % 10) as f64);
        std::array::from_fn(|_| (0..PATCHES).map(of_patch).collect())
    };
    let source = |light: f64, distance_m: f64| SourceTables {
        veil: field(0.02 * distance_m),
        light: field(light),
        straight: field((-0.5 * distance_m).exp()),
        scattered: field(0.1 * (-0.3 * distance_m).exp()),
        transfer: std::array::from_fn(|_| (0..13).map(|i| 1.0 - 0.07 * f64::from(i)).collect()),
    };
    let views = (0..12).map(|i| {
        let distance_m = 0.5 * 6f64.powf(f64::from(i) / 11.0);
        ViewTables {
            distance_m,
            lamps: source(0.3 / (distance_m * distance_m), distance_m),
            daylight: [0.5, 0.3, 0.2]
                .map(|light| source(light, distance_m))
                .to_vec(),
        }
    });
    Arc::new(Water::new(WaterFile {
        format: WATER_FORMAT.to_owned(),
        made_by: "benchmark".to_owned(),
        water: WaterNumbers {
            a_per_m: [0.2; 3],
            b_per_m: [0.3; 3],
            backscatter_fraction: 0.02,
        },
        sensor: SensorNumbers {
            width_px,
            height_px,
            encoding: Encoding::Srgb,
            exposure_m2_sr_per_w: 1.0,
            noise_a: 2e-4,
            noise_b: 1e-6,
            vignetting: None,
        },
        tables: WaterTables {
            half_view: [0.577, 0.577 * height_px as f64 / width_px as f64],
            frequencies_per_m: (0..13).map(|i| 2f64.powi(i)).collect(),
            sun: None,
            depths_m: vec![1.0, 3.0, 5.0],
            views: views.collect(),
        },
        sights: Vec::new(),
        fit: None,
    }))
}

/// A picture with detail of many sizes.
fn picture(width: usize, height: usize) -> Counts {
    let pixel = |i: usize| {
        let (x, y) = ((i % width) as f64, (i / width) as f64);
        let waves =
            [3.0, 7.0, 19.0, 47.0, 130.0].map(|length| (x / length).sin() * (y / length).cos());
        let counts = (95.0 + 6.0 * waves.iter().sum::<f64>()).round();
        [counts, counts + 10.0, counts + 5.0]
    };
    Counts::stored(width, height, (0..width * height).map(pixel).collect())
}

/// Water in which light and contrast fall exponentially.
fn profile() -> Profile {
    let contrast = |gain: f64| {
        let sample = |distance_m: f64| ContrastSample {
            distance_m,
            k_c: [0.9f64, 0.5, 0.6].map(|c| gain * 18.0 * (-c * distance_m).exp()),
        };
        (1..=6).map(|k| sample(0.5 * f64::from(k))).collect()
    };
    let depth = |depth_m: f64| DepthSample {
        depth_m,
        k_z: [0.6f64, 0.15, 0.25].map(|k| (-k * (depth_m - 0.5)).exp()),
    };
    let depths = (1..=12).map(|k| depth(0.5 * f64::from(k))).collect();
    let source = Source {
        made_by: "benchmark".to_owned(),
        images: 0,
        note: None,
    };
    Profile::new(depths, contrast(1.5), contrast(1.0), source).expect("a usable profile")
}

/// The picture as an uncompressed TIFF file.
fn tiff(picture: &Counts) -> Vec<u8> {
    let (width, height) = (picture.width as u32, picture.height as u32);
    let samples: Vec<u8> = picture.pixels.iter().flatten().map(|&c| c as u8).collect();
    let data = 8;
    let bits = data + samples.len() as u32;
    let bits = bits + bits % 2;
    // Tag, type (3: 16 bits, 4: 32 bits), count, value.
    let entries: [[u32; 4]; 9] = [
        [256, 4, 1, width],
        [257, 4, 1, height],
        [258, 3, 3, bits],
        [259, 3, 1, 1],
        [262, 3, 1, 2],
        [273, 4, 1, data],
        [277, 3, 1, 3],
        [278, 4, 1, height],
        [279, 4, 1, samples.len() as u32],
    ];
    let mut file = b"II*\0".to_vec();
    file.extend((bits + 6).to_le_bytes());
    file.extend(&samples);
    file.resize(bits as usize, 0);
    file.extend([8, 0, 8, 0, 8, 0]);
    file.extend((entries.len() as u16).to_le_bytes());
    for [tag, kind, count, value] in entries {
        file.extend((tag as u16).to_le_bytes());
        file.extend((kind as u16).to_le_bytes());
        file.extend(count.to_le_bytes());
        file.extend(value.to_le_bytes());
    }
    file.extend(0u32.to_le_bytes());
    file
}

/// Pictures of a vehicle that has been everywhere.
const SEEN_BEFORE: i32 = 9;

fn arrival(c: &mut Criterion) {
    let mut group = c.benchmark_group("physics");
    group.sample_size(10);
    for (width, height) in [(480, 288), (1280, 720)] {
        let (water, counts) = (water(width, height), picture(width, height));
        let stats = ImageStats::from_counts(width, height, &counts.pixels).expect("a picture");
        let taken = |from: &Candidate, earlier: &[Sight]| {
            let water = Arc::clone(&water);
            Present::new(water, &counts, (from, DEPTH_M), stats.contrast, earlier)
        };
        let seen = (0..SEEN_BEFORE).map(|i| {
            let from = Candidate {
                distance_m: 0.6 * 1.2f64.powi(i),
                ..HERE
            };
            taken(&from, &[]).sight().clone()
        });
        let seen: Vec<Sight> = seen.collect();
        for (earlier, name) in [(&[][..], ""), (&seen, ", others in mind")] {
            let name = format!("a picture of {width} x {height} arrives{name}");
            group.bench_function(name, |b| b.iter(|| taken(black_box(&HERE), earlier)));
        }
    }
    group.finish();
}

fn suggestion(c: &mut Criterion) {
    let (width, height) = (480, 288);
    let (water, counts) = (water(width, height), picture(width, height));
    let stats = ImageStats::from_counts(width, height, &counts.pixels).expect("a picture");
    let now = (&HERE, DEPTH_M);
    let present = Present::new(Arc::clone(&water), &counts, now, stats.contrast, &[]);
    let observation = Observation {
        depth_m: DEPTH_M,
        distance_m: HERE.distance_m,
        light_pct: HERE.light_pct,
        mean: stats.mean,
        std: stats.contrast,
        quality: None,
    };
    let (profile, objective) = (profile(), Objective::default());
    let mut group = c.benchmark_group("physics");
    group.bench_function("a prediction with its error", |b| {
        b.iter(|| present.contrast(black_box(&HERE)));
    });
    group.bench_function("a candidate of a search", |b| {
        b.iter(|| present.quick_contrast(black_box(&HERE)));
    });
    let by = By::Physics(Physical {
        present: &present,
        residual: None,
    });
    group.bench_function("advise", |b| {
        b.iter(|| {
            advise_by(
                black_box(&observation),
                &profile,
                by,
                &objective,
                &Checks::default(),
            )
        });
    });
    let loaded = Loaded {
        basis: Basis::Physics(water),
        model_name: "water".to_owned(),
        model_digest: String::new(),
        profile: Some(Arc::new(profile)),
    };
    let mut session = Session::new(Arc::new(Service::with_settings(
        loaded,
        Settings::default(),
    )));
    let encoded = base64::engine::general_purpose::STANDARD.encode(tiff(&counts));
    let place = "\"depth_m\": 3.0, \"distance_m\": 1.0, \"light_pct\": 20.0";
    let shown = format!(
        "{{\"op\": \"suggest_image\", {place}, \"image\": {{\"base64_png\": \"{encoded}\"}}}}"
    );
    let reply = session.reply(shown.as_bytes());
    assert!(reply.contains("\"valid\":true"), "{reply}");
    let asked = format!("{{\"op\": \"suggest\", {place}}}");
    group.bench_function("line to line, with a picture before", |b| {
        b.iter(|| session.reply(black_box(asked.as_bytes())));
    });
    group.bench_function("line to line, with the picture (480 x 288)", |b| {
        b.iter(|| session.reply(black_box(shown.as_bytes())));
    });
    group.finish();
}

criterion_group!(benches, arrival, suggestion);
criterion_main!(benches);
