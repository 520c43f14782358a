//! What every phase function must fulfil: normalised, consistent, with the right moments.

use std::f64::consts::PI;

use uw_media::phase::{Phase, PhaseFunction, X_FLOOR};

use crate::models::{Model, every_model};
use crate::reference::assert_relative;
use crate::statistics::integrate;

/// ∫ f(x) 4π p dx from [`X_FLOOR`] to 1, in the logarithm at both ends.
fn expectation(phase: &Phase, f: impl Fn(f64) -> f64) -> f64 {
    let forward = |v: f64| {
        let x = v.exp();
        4.0 * PI * phase.value(x) * x * f(x)
    };
    let peak = integrate(X_FLOOR.ln(), -20.0, 3000, forward);
    let below_half = integrate(-20.0, 0.5_f64.ln(), 6000, forward);
    let above_half = integrate(-40.0, 0.5_f64.ln(), 4000, |v| {
        let y = v.exp();
        4.0 * PI * phase.value(1.0 - y) * y * f(1.0 - y)
    });
    peak + below_half + above_half
}

/// Tables have kinks between the nodes of the quadrature.
fn tolerance(phase: &Phase) -> f64 {
    match phase {
        Phase::Tabulated(_) => 1e-5,
        _ => 1e-10,
    }
}

#[test]
fn every_function_is_normalised_and_has_its_moments() {
    for Model { name, phase, .. } in every_model() {
        let tolerance = tolerance(phase);
        // What no float can hold lies below the floor.
        let hidden = phase.cdf(X_FLOOR);
        let total = expectation(phase, |_| 1.0) + hidden;
        assert_relative(total, 1.0, tolerance, &format!("{name}: integral"));
        let mean_x = expectation(phase, |x| x);
        let mean_cosine = 1.0 - 2.0 * mean_x;
        assert!(
            (mean_cosine - phase.mean_cosine()).abs() < tolerance,
            "{name}: mean cosine {} by quadrature, {} stated",
            mean_cosine,
            phase.mean_cosine()
        );
        let backward = integrate(-40.0, 0.5_f64.ln(), 4000, |v| {
            4.0 * PI * phase.value(1.0 - v.exp()) * v.exp()
        });
        assert_relative(
            phase.backscatter_fraction(),
            backward,
            tolerance.max(1e-9),
            &format!("{name}: backscatter fraction"),
        );
    }
}

#[test]
fn the_cdf_is_the_integral_of_the_value() {
    for Model { name, phase, .. } in every_model() {
        for pair in [1e-12, 1e-6, 1e-3, 0.05, 0.3, 0.6, 0.9, 0.999].windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let integral = integrate(f64::ln(from), f64::ln(to), 2000, |v| {
                4.0 * PI * phase.value(v.exp()) * v.exp()
            });
            let difference = if to < 0.5 {
                phase.cdf(to) - phase.cdf(from)
            } else {
                phase.ccdf(from) - phase.ccdf(to)
            };
            // Differences of two shares near 1 lose digits that the integral keeps.
            assert!(
                (difference - integral).abs() <= tolerance(phase) * integral + 1e-14,
                "{name}: {from}..{to}: {difference} against {integral}"
            );
        }
    }
}

#[test]
fn cdf_and_complement_sum_to_one_and_rise() {
    for Model { name, phase, .. } in every_model() {
        let mut before = 0.0;
        for step in 0..=3000 {
            let x = (-690.0 * (1.0 - f64::from(step) / 3000.0).powi(3)).exp();
            let (cdf, ccdf) = (phase.cdf(x), phase.ccdf(x));
            assert!(
                (cdf + ccdf - 1.0).abs() < 1e-13,
                "{name}: x {x}: {cdf} + {ccdf}"
            );
            assert!(cdf >= before - 1e-15, "{name}: CDF falls at {x}");
            before = cdf;
        }
        assert_eq!((phase.cdf(0.0), phase.ccdf(1.0)), (0.0, 0.0), "{name}");
        assert!((phase.cdf(1.0) - 1.0).abs() < 1e-13, "{name}");
    }
}

#[test]
fn the_inverse_undoes_the_cdf() {
    let shares = [
        1e-300,
        1e-30,
        1e-9,
        1e-4,
        0.01,
        0.2,
        0.4999,
        0.5001,
        0.8,
        0.99,
        1.0 - 1e-6,
        1.0 - 1e-12,
    ];
    for Model { name, phase, .. } in every_model() {
        for u in shares {
            let x = phase.inverse_cdf(u);
            assert!((X_FLOOR..=1.0).contains(&x), "{name}: u {u}: x {x}");
            if x == X_FLOOR {
                assert!(
                    phase.cdf(x) >= u * (1.0 - 1e-12),
                    "{name}: u {u} is not that small"
                );
                continue;
            }
            // x itself is rounded.
            let slack = 4.0 * PI * phase.value(x) * 4.0 * f64::EPSILON * x;
            if u < 0.5 {
                let error = (phase.cdf(x) - u).abs();
                assert!(error <= 1e-12 * u + slack, "{name}: u {u}: error {error}");
            } else {
                let error = (phase.ccdf(x) - (1.0 - u)).abs();
                assert!(
                    error <= 1e-12 * (1.0 - u) + slack,
                    "{name}: u {u}: error {error}"
                );
            }
        }
        for u in [0.0, 1.0, -0.5, 1.5, f64::NAN] {
            let x = phase.inverse_cdf(u);
            assert!((X_FLOOR..=1.0).contains(&x), "{name}: u {u}: x {x}");
        }
    }
}

#[test]
fn a_tiny_angle_gives_no_nan() {
    for Model { name, phase, .. } in every_model() {
        for x in [0.0, 5e-324, 1e-310, X_FLOOR, 1e-150] {
            assert!(
                phase.value(x).is_finite() && phase.value(x) >= 0.0,
                "{name}: {x}"
            );
            assert!((0.0..=1.0).contains(&phase.cdf(x)), "{name}: {x}");
            assert!((0.0..=1.0).contains(&phase.ccdf(x)), "{name}: {x}");
        }
    }
}
