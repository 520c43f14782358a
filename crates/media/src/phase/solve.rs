//! Inversion of a cumulative distribution by a bracketed Newton iteration.

use super::PhaseFunction;

/// Smallest `x = sin²(θ/2)` that an inverse CDF returns; θ is then 2e-150 rad.
pub const X_FLOOR: f64 = 1e-300;

const MAX_ITERATIONS: usize = 200;

/// The `x` with `cdf(x) = u`, found in `ln x` between [`X_FLOOR`] and 1.
///
/// The residual is the logarithm of the CDF for `u <= 1/2` (a power law near `x = 0`, hence nearly a
/// straight line) and the complement for larger `u` (keeps its digits near `x = 1`).
/// Newton steps that leave the bracket or shrink too slowly are replaced by bisection.
pub(super) fn inverse_cdf<P: PhaseFunction + ?Sized>(phase: &P, u: f64) -> f64 {
    if u >= 1.0 {
        return 1.0;
    }
    if u.is_nan() || u <= phase.cdf(X_FLOOR) {
        return X_FLOOR;
    }
    let (mut low, mut high) = (X_FLOOR.ln(), 0.0);
    let mut log_x = first_guess(phase, u);
    let mut step_before = high - low;
    for _ in 0..MAX_ITERATIONS {
        let (residual, slope) = residual(phase, u, log_x);
        if residual < 0.0 {
            low = log_x;
        } else {
            high = log_x;
        }
        let newton = residual / slope;
        let useful = newton.is_finite()
            && log_x - newton > low
            && log_x - newton < high
            && newton.abs() < 0.5 * step_before.abs();
        let next = if useful {
            log_x - newton
        } else {
            0.5 * (low + high)
        };
        step_before = next - log_x;
        log_x = next;
        if step_before.abs() <= 4.0 * f64::EPSILON * log_x.abs().max(f64::EPSILON) {
            break;
        }
    }
    log_x.exp().clamp(X_FLOOR, 1.0)
}

/// `x = u` in general; on the forward side the power law through a small angle.
fn first_guess<P: PhaseFunction + ?Sized>(phase: &P, u: f64) -> f64 {
    let anchor: f64 = 1e-6;
    let share = phase.cdf(anchor);
    let exponent = 4.0 * std::f64::consts::PI * phase.value(anchor) * anchor / share;
    let power_law = anchor.ln() + (u / share).ln() / exponent;
    if power_law.is_finite() && power_law < -1.0 {
        power_law.max(0.999 * X_FLOOR.ln())
    } else {
        u.ln().clamp(0.999 * X_FLOOR.ln(), -1e-9)
    }
}

/// Signed distance to the wanted share, increasing in `ln x`, and its slope.
fn residual<P: PhaseFunction + ?Sized>(phase: &P, u: f64, log_x: f64) -> (f64, f64) {
    let x = log_x.exp();
    let density = 4.0 * std::f64::consts::PI * phase.value(x) * x;
    if u <= 0.5 {
        let share = phase.cdf(x);
        ((share / u).ln(), density / share)
    } else {
        ((1.0 - u) - phase.ccdf(x), density)
    }
}

/// Composite Gauss-Legendre rule with four points in each of `panels` equal panels.
pub(super) fn gauss_legendre(
    from: f64,
    to: f64,
    panels: usize,
    integrand: impl Fn(f64) -> f64,
) -> f64 {
    const NODES: [(f64, f64); 2] = [
        (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    ];
    let half = 0.5 * (to - from) / panels as f64;
    let panel = |i: usize| {
        let middle = from + half * (2 * i + 1) as f64;
        NODES
            .iter()
            .map(|(node, weight)| {
                weight * (integrand(middle - half * node) + integrand(middle + half * node))
            })
            .sum::<f64>()
    };
    half * (0..panels).map(panel).sum::<f64>()
}
