//! The renderer against the plain validator, on a corpus of small scenes. What the validator finds is kept in `data/validator.csv`, and
//! found again with fewer walks.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use glam::DVec3;
use uw_media::phase::{FournierForand, HenyeyGreenstein, Phase, PhaseFunction};
use uw_render::{
    film::{Film, FilmLayer},
    prepare::Prepared,
    scene::Sun,
};
use uw_tests::{
    divided,
    gpu::{Backend, everywhere},
    plan,
    reference::{means, write_means},
    same_numbers::Means,
    single_ray::{add_plate, camera, empty, surface, water},
    validator::{
        Estimate, Validator,
        cases::{self, Case},
    },
};

/// Another number here is another set of random numbers on both sides.
const RUN: u64 = 1;
/// Parts of the pixel's edge that kernels are given as pixels.
const PARTS: u32 = 8;
/// Walks of what is kept, and of what is found again, by those of a case.
const KEPT: f64 = 4.0;
const AGAIN: f64 = 1.0 / 16.0;
/// Part of a case's samples on an adapter, whose kernels and pictures take longest: half of what double precision takes.
const ON_ADAPTER: u32 = 16;
/// Largest combined standard error of a comparison, relative to the value.
const SHARPNESS: f64 = 0.02;
/// The same for the median of all comparisons.
const MEDIAN_SHARPNESS: f64 = 0.006;

/// One channel of one scene: mean and standard error on both sides, W/(m² sr).
#[derive(Clone, Copy, Debug)]
struct ChannelComparison {
    case: usize,
    channel: usize,
    rendered: Estimate,
    validated: Estimate,
}

impl ChannelComparison {
    fn error(&self) -> f64 {
        self.rendered
            .standard_error
            .hypot(self.validated.standard_error)
    }

    fn z(&self) -> f64 {
        (self.rendered.mean - self.validated.mean) / self.error()
    }

    /// Combined standard error relative to the value.
    fn relative_error(&self) -> f64 {
        self.error() / self.validated.mean
    }
}

/// The pixel of a case in three channels.
type Pixel = [Estimate; 3];

/// By the validator, with so many times the walks of the case.
fn validated(index: usize, case: &Case, times: f64, run: u64) -> Pixel {
    let walks = (times * case.walks as f64) as u64;
    std::array::from_fn(|channel| {
        // Seeds far apart in the generator's sequence of 2^64.
        let seed =
            ((3 * index + channel + 1) as u64 + 1000 * run).wrapping_mul(0x0123_4567_89ab_cdef);
        Validator::new(&case.scene, channel).pixel((0, 0), case.max_events, walks, seed)
    })
}

/// What the validator found of the corpus.
fn kept(cases: &[Case]) -> Vec<Pixel> {
    let rows = means("validator");
    assert_eq!(rows.len(), cases.len());
    let row = |(case, (name, (mean, error))): (&Case, (String, Means))| {
        assert_eq!(case.name, name);
        [0, 1, 2].map(|k| Estimate {
            mean: mean[k],
            standard_error: error[k],
        })
    };
    cases.iter().zip(rows).map(row).collect()
}

/// For the renderer. A lane makes a pixel, so that the one is given in parts.
fn prepared(_: usize, case: &Case) -> Prepared {
    Prepared::build(&divided(&case.scene, PARTS))
}

fn film(backend: Backend, scene: &Prepared, (index, case): (usize, &Case), samples: u32) -> Film {
    let seed = 100_000 * RUN + 1000 + index as u64;
    let mut plan = plan(samples / (PARTS * PARTS), seed);
    plan.max_bounces = case.max_events;
    plan.threads = Some(1);
    backend.render_prepared(scene, &plan).0
}

/// By the renderer on the vector units.
fn rendered(scene: &Prepared, case: (usize, &Case)) -> Pixel {
    let backend = Backend::VectorUnits;
    let film = film(backend, scene, case, case.1.samples);
    let (mean, variance) = (film.mean(), film.variance_of_mean());
    std::array::from_fn(|k| Estimate {
        mean: mean[k],
        standard_error: variance[k].sqrt().hypot(backend.rounding() * mean[k]),
    })
}

/// By another backend: what the vector units find with all samples, and what part by part few samples of the backend are beside
/// theirs with the same random numbers.
fn rendered_beside(backend: Backend, all: &Pixel, scene: &Prepared, case: (usize, &Case)) -> Pixel {
    let samples = match backend {
        Backend::Adapter => case.1.samples / ON_ADAPTER,
        _ => backend.samples(case.1.samples),
    };
    let few = |backend| film(backend, scene, case, samples).layer(FilmLayer::Total);
    let (ours, theirs) = (few(backend), few(Backend::VectorUnits));
    let n = ours.len() as f64;
    std::array::from_fn(|k| {
        let apart = || ours.iter().zip(&theirs).map(|(a, b)| a[k] - b[k]);
        let mean = apart().sum::<f64>() / n;
        let square: f64 = apart().map(|d| (d - mean).powi(2)).sum();
        Estimate {
            mean: all[k].mean + mean,
            standard_error: all[k]
                .standard_error
                .hypot((square / (n * (n - 1.0))).sqrt()),
        }
    })
}

/// Does the same for all cases, on `threads` threads.
fn for_all<T: Send>(
    cases: &[Case],
    threads: usize,
    work: impl Fn(usize, &Case) -> T + Sync,
) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let index = next.fetch_add(1, Ordering::Relaxed)
                    && let Some(case) = cases.get(index)
                {
                    let found = work(index, case);
                    done.lock()
                        .expect("no thread panicked")
                        .push((index, found));
                }
            });
        }
    });
    let mut all = done.into_inner().expect("no thread panicked");
    all.sort_by_key(|&(index, _)| index);
    all.into_iter().map(|(_, found)| found).collect()
}

fn threads() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// All comparisons with what the validator found, channel by channel, at every place.
fn compare_all(cases: &[Case], theirs: &[Pixel]) {
    let scenes = for_all(cases, threads(), prepared);
    let all = for_all(cases, threads(), |index, case| {
        rendered(&scenes[index], (index, case))
    });
    everywhere(|backend| {
        // An adapter works on one picture at a time.
        let threads = match backend {
            Backend::Adapter => 1,
            _ => threads(),
        };
        let ours = match backend {
            Backend::VectorUnits => all.clone(),
            _ => for_all(cases, threads, |index, case| {
                rendered_beside(backend, &all[index], &scenes[index], (index, case))
            }),
        };
        let comparisons = compared(&ours, theirs);
        show(cases, &comparisons);
        assert_agreement(cases, &comparisons, backend.noise());
    });
}

fn compared(ours: &[Pixel], theirs: &[Pixel]) -> Vec<ChannelComparison> {
    let pairs = ours.iter().zip(theirs).enumerate();
    pairs
        .flat_map(|(case, (ours, theirs))| {
            [0, 1, 2].map(|channel| ChannelComparison {
                case,
                channel,
                rendered: ours[channel],
                validated: theirs[channel],
            })
        })
        .collect()
}

fn show(cases: &[Case], all: &[ChannelComparison]) {
    for c in all {
        let percent = |e: Estimate| 100.0 * e.standard_error / e.mean;
        println!(
            "{:50} {} renderer {:9.6} ± {:4.2} %  validator {:9.6} ± {:4.2} %  z {:5.2}",
            cases[c.case].name,
            c.channel,
            c.rendered.mean,
            percent(c.rendered),
            c.validated.mean,
            percent(c.validated),
            c.z()
        );
    }
}

/// z-scores must look standard normal and be sharp enough to mean something; `noise` is what a place allows itself in one scene.
fn assert_agreement(cases: &[Case], all: &[ChannelComparison], noise: f64) {
    let n = all.len() as f64;
    let rms = (all.iter().map(|c| c.z().powi(2)).sum::<f64>() / n).sqrt();
    let mean = all.iter().map(ChannelComparison::z).sum::<f64>() / n;
    let mut errors: Vec<f64> = all.iter().map(ChannelComparison::relative_error).collect();
    errors.sort_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    println!("{n} comparisons: rms z {rms:.3}, mean z {mean:.3}, median error {median:.4}");
    for c in all {
        let name = cases[c.case].name;
        assert!(c.z().abs() < 4.5, "{name}: {c:?}, z {}", c.z());
        assert!(
            c.relative_error() < noise * SHARPNESS,
            "{name}: {c:?} is too noisy"
        );
    }
    assert!(median < MEDIAN_SHARPNESS, "median error {median}");
    // The mean of n scores has a standard deviation of n^-1/2, their rms one of (2n)^-1/2; the channels of a scene
    // share the renderer's error, the smaller one.
    assert!(mean.abs() < 3.0 / n.sqrt(), "mean z {mean}");
    assert!((rms - 1.0).abs() < 4.0 / (2.0 * n).sqrt(), "rms z {rms}");
}

#[test]
fn the_renderer_agrees_with_the_plain_validator() {
    let cases = cases::all();
    compare_all(&cases, &kept(&cases));
}

/// Few walks underrate errors, which rare bright ones make.
#[test]
fn what_is_kept_of_the_validator_is_what_it_finds() {
    let cases = cases::all();
    let again = for_all(&cases, threads(), |i, case| {
        validated(i, case, AGAIN, RUN + 1)
    });
    let all = compared(&again, &kept(&cases));
    show(&cases, &all);
    for c in &all {
        let (name, z) = (cases[c.case].name, c.z());
        assert!(z.abs() < 4.5, "{name}: {c:?}, z {z}");
    }
}

#[test]
#[ignore = "makes data/validator.csv, in minutes"]
fn rows_of_the_validator() {
    let cases = cases::all();
    let found = for_all(&cases, threads(), |i, case| validated(i, case, KEPT, RUN));
    let rows = cases.iter().zip(found).map(|(case, pixel)| {
        let means = (pixel.map(|e| e.mean), pixel.map(|e| e.standard_error));
        (case.name, means)
    });
    write_means("validator", rows);
}

/// Every walk in lossless water ends in the sky, whose radiance grows by n² in the water: no noise at all.
#[test]
fn the_validator_keeps_energy_under_a_refracting_surface() {
    let mut scene = empty(camera(
        DVec3::new(0.0, 0.0, -1.0),
        DVec3::new(0.9, 0.1, -0.3),
        1,
    ));
    let phase = FournierForand::new(1.10, 0.0183).expect("valid");
    scene.water = Some(water([0.0; 3], [1.5; 3], Phase::FournierForand(phase)));
    scene.surface = Some(surface(true));
    scene.sky_radiance = [1.0; 3];
    add_plate(
        &mut scene,
        DVec3::new(0.0, 0.0, -2.0),
        DVec3::Z,
        1e6,
        [1.0; 3],
    );
    let found = Validator::new(&scene, 1).pixel((0, 0), 0, 10_000, 1);
    assert!(
        (found.mean / (1.34 * 1.34) - 1.0).abs() < 1e-10,
        "{found:?}"
    );
}

/// An emitting plate behind absorbing water.
#[test]
fn the_validator_sees_emission_through_absorbing_water() {
    let mut scene = empty(camera(DVec3::ZERO, DVec3::X, 1));
    scene.water = Some(water([0.4; 3], [0.0; 3], Phase::Isotropic));
    add_plate(
        &mut scene,
        DVec3::new(2.0, 0.0, 0.0),
        -DVec3::X,
        1.0,
        [0.5; 3],
    );
    scene.materials[0].emission = [3.0; 3];
    let found = Validator::new(&scene, 0).pixel((0, 0), 0, 400_000, 2);
    let expected = 3.0 * (-0.8f64).exp();
    assert!(found.standard_error < 2e-3 * expected);
    let z = (found.mean - expected) / found.standard_error;
    assert!(z.abs() < 4.0, "{found:?}, expected {expected}");
}

/// Sunlight scattered once on a ray that goes down from `depth` for ever: b p E e^(-c depth/μ) / (c (1 + μ_ray/μ)).
#[test]
fn the_validator_scatters_sunlight_once_as_the_closed_form_says() {
    let (a, b, depth) = (0.3, 0.5, 1.2);
    let phase = HenyeyGreenstein::new(0.6).expect("valid");
    let direction = DVec3::new(0.6, 0.0, -0.8);
    let mut scene = empty(camera(DVec3::new(0.0, 0.0, -depth), direction, 1));
    scene.water = Some(water([a; 3], [b; 3], Phase::HenyeyGreenstein(phase)));
    scene.surface = Some(surface(false));
    let travel_direction = DVec3::new(0.0, 0.6, -0.8);
    scene.sun = Some(Sun {
        travel_direction,
        irradiance: [2.0; 3],
    });
    let found = Validator::new(&scene, 2).pixel((0, 0), 1, 400_000, 3);
    let c = a + b;
    let x = 0.25 * (direction + travel_direction).length_squared();
    let expected = b * phase.value(x) * 2.0 * (-c * depth / 0.8).exp() / (c * (1.0 + 0.8 / 0.8));
    assert!(found.standard_error < 4e-3 * expected);
    let z = (found.mean - expected) / found.standard_error;
    assert!(z.abs() < 4.0, "{found:?}, expected {expected}");
}
