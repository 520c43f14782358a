//! Inversion of a cumulative distribution by a bracketed Newton iteration.

use std::f64::consts::PI;

use super::PhaseFunction;

/// Smallest `x = sin²(θ/2)` that an inverse CDF returns; θ is then 2e-150 rad.
pub const X_FLOOR: f64 = 1e-300;

const MAX_ITERATIONS: usize = 200;

/// What an `x` is looked up by.
#[derive(Clone, Copy, Debug)]
pub(super) enum Share {
    /// `cdf(x)`.
    Below(f64),
    /// `ccdf(x)`.
    Above(f64),
}

/// The `x` with a given share of the light below or above it, found in `ln x` between [`X_FLOOR`] and 1.
///
/// The residual is the logarithm of a CDF up to 1/2 (a power law near `x = 0`, hence nearly a straight
/// line) and otherwise the complement, which keeps its digits near `x = 1`.
/// Newton steps that leave the bracket or shrink too slowly are replaced by bisection.
pub(super) fn invert<P: PhaseFunction + ?Sized>(phase: &P, share: Share) -> f64 {
    let share = match share {
        Share::Below(u) if u > 0.5 => Share::Above(1.0 - u),
        Share::Above(v) if v >= 0.5 => Share::Below(1.0 - v),
        share => share,
    };
    match share {
        Share::Above(v) if v <= 0.0 => return 1.0,
        Share::Above(v) if v >= phase.ccdf(X_FLOOR) => return X_FLOOR,
        Share::Below(u) if u.is_nan() || u <= phase.cdf(X_FLOOR) => return X_FLOOR,
        _ => {}
    }
    let (mut low, mut high) = (X_FLOOR.ln(), 0.0);
    let mut log_x = first_guess(phase, share);
    let mut step_before = high - low;
    for _ in 0..MAX_ITERATIONS {
        let at = residual(phase, share, log_x);
        if at.value < 0.0 {
            low = log_x;
        } else {
            high = log_x;
        }
        let newton = at.value / at.slope;
        if newton.abs() <= 4.0 * f64::EPSILON * log_x.abs() + at.noise / at.slope {
            break;
        }
        let next = log_x - newton;
        let useful = next > low && next < high && newton.abs() < 0.5 * step_before.abs();
        let next = if useful { next } else { 0.5 * (low + high) };
        step_before = next - log_x;
        log_x = next;
        if step_before == 0.0 {
            break;
        }
    }
    into_range(log_x.exp())
}

/// `x` within `[X_FLOOR, 1]`; NaN becomes the floor.
pub(super) fn into_range(x: f64) -> f64 {
    if x >= X_FLOOR { x.min(1.0) } else { X_FLOOR }
}

/// The CDF of an isotropic function in general; on the forward side the power law through a small angle.
fn first_guess<P: PhaseFunction + ?Sized>(phase: &P, share: Share) -> f64 {
    let u = match share {
        Share::Below(u) => u,
        Share::Above(v) => 1.0 - v,
    };
    let anchor: f64 = 1e-6;
    let below = phase.cdf(anchor);
    let exponent = 4.0 * PI * phase.value(anchor) * anchor / below;
    let power_law = anchor.ln() + (u / below).ln() / exponent;
    if power_law.is_finite() && power_law < -1.0 {
        power_law.max(0.999 * X_FLOOR.ln())
    } else {
        u.ln().clamp(0.999 * X_FLOOR.ln(), -1e-9)
    }
}

/// Signed distance to the wanted share.
struct Residual {
    /// Increases with `ln x`; 0 at the wanted place.
    value: f64,
    /// Derivative by `ln x`.
    slope: f64,
    /// Rounding error of `value`.
    noise: f64,
}

fn residual<P: PhaseFunction + ?Sized>(phase: &P, share: Share, log_x: f64) -> Residual {
    let x = log_x.exp();
    let density = 4.0 * PI * phase.value(x) * x;
    match share {
        Share::Below(u) => {
            let below = phase.cdf(x);
            Residual {
                value: (below / u).ln(),
                slope: density / below,
                noise: 4.0 * f64::EPSILON,
            }
        }
        Share::Above(v) => Residual {
            value: v - phase.ccdf(x),
            slope: density,
            noise: 4.0 * f64::EPSILON * v,
        },
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
