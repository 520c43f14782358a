//! Lamps many free paths away in water that loses little of what it scatters, against the closed form.
//!
//! In infinite water that scatters isotropically, with lengths in free paths, an isotropic point source of unit power brings the fluence rate
//! (Case and Zweifel 1967, *Linear Transport Theory*, for an albedo below 1)
//!
//! φ(r) = κ² (1 - κ²) e^(-κ r) / (2π r ω (κ² + ω - 1)) + 1/(4π r) ∫ e^(-r/μ) / (μ² N(μ)) dμ over 0 to 1,
//!
//! N(μ) = (1 - ω μ artanh μ)² + (π ω μ/2)², κ the root of ω artanh κ = κ.

use std::f64::consts::PI;

use glam::DVec3;
use uw_media::phase::Phase;
use uw_tests::discrete_ordinates::gauss;
use uw_tests::gpu::{Backend, PROCESSOR, everywhere, prepared};
use uw_tests::measure_prepared;
use uw_tests::single_ray::{camera, empty, point_lamp, water};

/// ∫ f from `lower` to `upper`.
fn integral(lower: f64, upper: f64, nodes: usize, f: impl Fn(f64) -> f64) -> f64 {
    let nodes = gauss(nodes, lower, upper);
    nodes.iter().map(|&(x, weight)| weight * f(x)).sum()
}

/// The decay far away, 1 over the free path.
fn decay(albedo: f64) -> f64 {
    let (mut lower, mut upper) = (1e-9, 1.0 - 1e-15);
    for _ in 0..200 {
        let middle = 0.5f64 * (lower + upper);
        if albedo * middle.atanh() < middle {
            lower = middle;
        } else {
            upper = middle;
        }
    }
    lower
}

/// Fluence rate at `r` free paths from a source of unit power.
fn fluence_rate(r: f64, albedo: f64) -> f64 {
    let k = decay(albedo);
    let k2 = k * k;
    let asymptotic =
        k2 * (1.0 - k2) * (-k * r).exp() / (2.0 * PI * r * albedo * (k2 + albedo - 1.0));
    let transient = integral(0.0, 1.0, 128, |mu| {
        let real = 1.0 - albedo * mu * mu.atanh();
        let norm = real * real + (0.5 * PI * albedo * mu).powi(2);
        (-r / mu).exp() / (mu * mu * norm)
    });
    asymptotic + transient / (4.0 * PI * r)
}

/// Radiance across the way to a lamp of unit intensity that is `distance` free paths away.
fn radiance(distance: f64, albedo: f64) -> f64 {
    integral(0.0, 40.0, 64, |s| {
        albedo * (-s).exp() * fluence_rate(distance.hypot(s), albedo)
    })
}

#[test]
fn the_closed_form_loses_what_the_water_absorbs() {
    for albedo in [0.9, 0.99] {
        let absorbed = |r: f64| (1.0 - albedo) * 4.0 * PI * r * r * fluence_rate(r, albedo);
        let all = integral(0.0, 4.0, 64, absorbed) + integral(4.0, 200.0, 128, absorbed);
        assert!((all - 1.0).abs() < 1e-4, "albedo {albedo}: {all}");
    }
}

/// Against the closed form; `samples` of each of 64 pixels.
fn far_lamp(backend: Backend, distance: f64, albedo: f64, samples: u32) {
    let mut scene = empty(camera(DVec3::ZERO, DVec3::X, 64));
    scene.water = Some(water([1.0 - albedo; 3], [albedo; 3], Phase::Isotropic));
    scene
        .lamps
        .push(point_lamp(DVec3::new(0.0, distance, 0.0), 1.0));
    let (mean, error) = measure_prepared(backend, &prepared(&scene), samples, 0, 7);
    let expected = radiance(distance, albedo);
    let (ratio, width) = (mean[1] / expected, error[1] / expected);
    let z = (ratio - 1.0) / width;
    let what = format!(
        "{distance} free paths, albedo {albedo}: {ratio:.4} ± {width:.4} of the closed form, z {z:.2}"
    );
    println!("{what}");
    assert!(z.abs() < 4.0 && width < 0.1, "{what}");
}

#[test]
fn far_lamps_in_bright_water_are_as_bright_as_the_closed_form_says() {
    everywhere(|backend| {
        for (distance, albedo, samples) in [(5.0, 0.9, 1024), (5.0, 0.99, 512), (10.0, 0.99, 1024)]
        {
            far_lamp(backend, distance, albedo, backend.samples(samples));
        }
    });
}

/// Not on an adapter: drivers that count loops cut the long walks.
#[test]
fn far_lamps_in_water_that_loses_next_to_nothing_are_as_bright_as_the_closed_form_says() {
    for backend in PROCESSOR {
        for distance in [5.0, 20.0] {
            far_lamp(backend, distance, 0.999, 128);
        }
    }
}
