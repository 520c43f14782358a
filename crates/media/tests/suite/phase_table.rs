//! Accuracy of the renderer's tables against the functions they were made from.

use std::f64::consts::PI;

use uw_media::phase::{DiskTable, Phase, PhaseFunction, PhaseTable, X_MIN, disk_mean};

use crate::models::{Model, every_model};
use crate::statistics::{Rng, integrate};

/// Arguments in (0, 1), dense at both ends.
fn arguments(seed: u64, count: usize, octaves: f64) -> Vec<f64> {
    let mut rng = Rng::new(seed);
    (0..count)
        .map(|i| {
            let small = (-octaves * 2.0_f64.ln() * rng.uniform().powi(2)).exp();
            match i % 3 {
                0 => rng.uniform(),
                1 => small,
                _ => 1.0 - small,
            }
        })
        .filter(|x| *x > 0.0 && *x < 1.0)
        .collect()
}

/// Largest relative error of the value.
fn value_error(phase: &Phase, table: &PhaseTable) -> f64 {
    arguments(3, 10_000, 119.0)
        .into_iter()
        .map(|x| {
            let exact = phase.value(x.max(X_MIN));
            (table.value(x) - exact).abs() / exact.max(1e-2 / (4.0 * PI))
        })
        .fold(0.0, f64::max)
}

/// Largest error of the CDF and largest relative error of the angle above 0.01°.
fn sampling_errors(phase: &Phase, table: &PhaseTable) -> (f64, f64) {
    let above = (0.005_f64.to_radians()).sin().powi(2);
    arguments(4, 10_000, 52.0)
        .into_iter()
        .map(|u| {
            let x = table.sample_x(u);
            let exact = phase.inverse_cdf(u);
            let cdf_error = if exact <= 2.0 * X_MIN {
                0.0
            } else if u < 0.5 {
                (phase.cdf(x) - u).abs()
            } else {
                (phase.ccdf(x) - (1.0 - u)).abs()
            };
            let angle = |x: f64| x.sqrt().asin();
            let angle_error = if exact > above {
                (angle(x) - angle(exact)).abs() / angle(exact)
            } else {
                0.0
            };
            (cdf_error, angle_error)
        })
        .fold((0.0, 0.0), |a, b| (a.0.max(b.0), a.1.max(b.1)))
}

/// The mean over the sun's disk, at angles dense about its rim.
#[test]
fn means_over_a_disk_are_met_within_the_stated_error() {
    let radius = 3.6e-3;
    let mut rng = Rng::new(5);
    for Model { name, phase, .. } in every_model().iter().filter(|m| m.smooth) {
        let table = DiskTable::new(phase, radius);
        let near = (0..4000).map(|_| radius * (12.0 * rng.uniform() - 7.0).exp2());
        let worst = near
            .map(|angle| (0.5 * angle).sin().powi(2))
            .chain(arguments(6, 2000, 119.0))
            .filter(|&x| x < table.far_x())
            .map(|x| {
                let exact = disk_mean(phase, radius, x);
                (table.value(x) - exact).abs() / exact.max(1e-3 / (4.0 * PI))
            })
            .fold(0.0, f64::max);
        // Where nearly all light stays within the disk, its rim is a step.
        let within = phase.cdf((0.5 * radius).sin().powi(2));
        let most = if within > 0.95 { 0.1 } else { 1e-3 };
        assert!(worst < most, "{name}: {worst:.1e}");
    }
}

#[test]
fn smooth_functions_are_met_within_the_stated_errors() {
    for Model {
        name, phase, table, ..
    } in every_model().iter().filter(|m| m.smooth)
    {
        let value = value_error(phase, table);
        let (cdf, angle) = sampling_errors(phase, table);
        assert!(value < 1e-5, "{name}: value off by {value:.2e}");
        assert!(cdf < 1e-6, "{name}: CDF off by {cdf:.2e}");
        assert!(angle < 1e-5, "{name}: angle off by {angle:.2e}");
    }
}

#[test]
fn tables_and_mixtures_are_met_within_the_stated_errors() {
    for Model {
        name, phase, table, ..
    } in every_model()
    {
        let value = value_error(phase, table);
        let (cdf, angle) = sampling_errors(phase, table);
        assert!(value < 1e-3, "{name}: value off by {value:.2e}");
        assert!(cdf < 1e-4, "{name}: CDF off by {cdf:.2e}");
        // Across a gap in the density the angle jumps, and with it its error.
        assert!(
            name == "table with a gap" || angle < 1e-3,
            "{name}: angle off by {angle:.2e}"
        );
        assert!(
            table.bytes() <= 256 << 10,
            "{name}: {} bytes",
            table.bytes()
        );
    }
}

#[test]
fn moments_of_the_sampled_angle_are_exact() {
    for Model {
        name, phase, table, ..
    } in every_model()
    {
        let mean = |f: &dyn Fn(f64) -> f64| {
            // Both halves of u in the logarithm, where the table is dense.
            let low = integrate(-44.0, 0.5_f64.ln(), 20_000, |v| v.exp() * f(v.exp()));
            let high = integrate(-36.0, 0.5_f64.ln(), 20_000, |v| v.exp() * f(1.0 - v.exp()));
            low + high
        };
        let mean_x = mean(&|u| table.sample_x(u));
        let exact_x = 0.5 * (1.0 - phase.mean_cosine());
        assert!(
            (mean_x / exact_x - 1.0).abs() < 1e-5,
            "{name}: {mean_x} against {exact_x}"
        );
        // E[ln x] of the clamped x is -∫ CDF d(ln x) from ln X_MIN to 0.
        let mean_log = mean(&|u| table.sample_x(u).ln());
        let exact_log = -integrate(X_MIN.ln(), 0.5_f64.ln(), 4000, |v| phase.cdf(v.exp()))
            - integrate(-40.0, 0.5_f64.ln(), 4000, |v| {
                phase.cdf(1.0 - v.exp()) * v.exp() / (1.0 - v.exp())
            });
        assert!(
            (mean_log / exact_log - 1.0).abs() < 1e-5,
            "{name}: mean logarithm {mean_log} against {exact_log}"
        );
    }
}

#[test]
fn the_density_of_the_samples_is_the_tabulated_value() {
    // du/dx of the sampler against 4π p: what a renderer cancels against each other.
    for Model { name, table, .. } in every_model().iter().filter(|m| m.smooth) {
        for u in arguments(5, 2000, 20.0) {
            let step = 1e-3 * u.min(1.0 - u);
            let (x0, x1) = (table.sample_x(u - step), table.sample_x(u + step));
            if x0 <= 4.0 * X_MIN || 1.0 - x1 < 1e-9 {
                continue;
            }
            let integral = integrate(x0.ln(), x1.ln(), 4, |v| {
                4.0 * PI * table.value(v.exp()) * v.exp()
            });
            let ratio = integral / (2.0 * step);
            assert!(
                (ratio - 1.0).abs() < 1e-2,
                "{name}: u {u}: density off by {ratio}"
            );
        }
    }
}

#[test]
fn an_isotropic_table_is_exactly_constant() {
    let table = PhaseTable::new(&Phase::Isotropic);
    for x in [0.0, 1e-30, 0.1, 0.5, 0.999, 1.0] {
        assert_eq!(table.value(x), 0.25 / PI);
    }
}

#[test]
fn arguments_outside_the_range_are_taken_as_its_ends() {
    for Model { name, table, .. } in every_model() {
        assert_eq!(table.value(0.0), table.value(X_MIN), "{name}");
        assert_eq!(table.value(-1.0), table.value(X_MIN), "{name}");
        assert_eq!(table.value(1.0 + 1e-12), table.value(1.0), "{name}");
        for u in [0.0, 1e-300, 1.0 - f64::EPSILON / 2.0, 1.0] {
            let x = table.sample_x(u);
            assert!((X_MIN..=1.0).contains(&x), "{name}: u {u}: x {x}");
        }
    }
}
