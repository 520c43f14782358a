//! Angles and what is a function of them: quadrature, Legendre functions, moments of phase functions.

use std::f64::consts::PI;

use uw_media::phase::PhaseFunction;

/// A node of a quadrature with its weight.
pub type Node = (f64, f64);

/// Gauss-Legendre nodes on [`from`, `to`], increasing.
pub fn gauss(n: usize, from: f64, to: f64) -> Vec<Node> {
    let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
    let node = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        // Newton from this start converges quadratically.
        for _ in 0..8 {
            let (mut last, mut value) = (0.0, 1.0);
            for l in 0..n {
                let l = l as f64;
                (last, value) = (value, ((2.0 * l + 1.0) * x * value - l * last) / (l + 1.0));
            }
            slope = n as f64 * (last - x * value) / (1.0 - x * x);
            x -= value / slope;
        }
        (
            centre - half * x,
            half * 2.0 / ((1.0 - x * x) * slope * slope),
        )
    };
    (0..n).map(node).collect()
}

/// Associated Legendre functions of order `m` and degrees m..`degrees` at `mu`, times sqrt((l − m)!/(l + m)!):
/// then p_m(μ, μ') = Σ (2l + 1) χ_l P_l(μ) P_l(μ').
pub fn legendre(m: usize, degrees: usize, mu: f64) -> Vec<f64> {
    let order = m as f64;
    let sine2 = (1.0 - mu) * (1.0 + mu);
    let start: f64 = (1..=m)
        .map(|k| ((2 * k - 1) as f64 / (2 * k) as f64 * sine2).sqrt())
        .product();
    let (mut last, mut value) = (0.0, start);
    let mut values = Vec::with_capacity(degrees.saturating_sub(m));
    for l in m..degrees {
        values.push(value);
        let l = l as f64;
        let norm = |l: f64| (l * l - order * order).sqrt();
        let next = ((2.0 * l + 1.0) * mu * value - norm(l) * last) / norm(l + 1.0);
        (last, value) = (value, next);
    }
    values
}

/// Legendre moments χ_l = 2π ∫ p P_l d(cosθ) of a phase function for l < `count`; χ_0 is 1.
pub fn moments(phase: &dyn PhaseFunction, count: usize) -> Vec<f64> {
    const NODES: usize = 6;
    // Logarithmic steps through the forward peak, then steps that resolve P_256.
    let smallest = 1e-18f64.ln();
    let joint = 0.5f64.to_radians();
    let steps = 700;
    let at = |i: usize| (smallest + (joint.ln() - smallest) * i as f64 / steps as f64).exp();
    let peak = (0..steps).map(|i| (at(i), at(i + 1)));
    let wide = (1..360).map(|i| (joint * f64::from(i), joint * f64::from(i + 1)));
    let mut moments = vec![0.0; count];
    for (from, to) in peak.chain(wide) {
        for (theta, weight) in gauss(NODES, from, to) {
            let x = (0.5 * theta).sin().powi(2);
            let share = 2.0 * PI * phase.value(x) * theta.sin() * weight;
            for (moment, p) in moments.iter_mut().zip(legendre(0, count, 1.0 - 2.0 * x)) {
                *moment += share * p;
            }
        }
    }
    let total = moments[0];
    assert!(
        (total - 1.0).abs() < 1e-5,
        "the phase function integrates to {total}"
    );
    moments.iter().map(|moment| moment / total).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_media::phase::HenyeyGreenstein;

    #[test]
    fn moments_of_henyey_greenstein_are_powers() {
        let phase = HenyeyGreenstein::new(0.9).expect("valid");
        for (l, moment) in moments(&phase, 65).iter().enumerate() {
            assert!(
                (moment - 0.9f64.powi(l as i32)).abs() < 1e-9,
                "{l}: {moment}"
            );
        }
    }

    /// The addition theorem: Σ_m (2 − δ) cos(mφ) P_lm(μ) P_lm(μ') = P_l(cosine of the angle between).
    #[test]
    fn legendre_functions_fulfil_the_addition_theorem() {
        let (mu, other, azimuth) = (0.3f64, -0.8f64, 1.1f64);
        let cosine = mu * other + ((1.0 - mu * mu) * (1.0 - other * other)).sqrt() * azimuth.cos();
        let degrees = 9;
        for l in 0..degrees {
            let sum: f64 = (0..=l)
                .map(|m| {
                    let twice = if m == 0 { 1.0 } else { 2.0 };
                    let at = |mu| legendre(m, degrees, mu)[l - m];
                    twice * (m as f64 * azimuth).cos() * at(mu) * at(other)
                })
                .sum();
            let expected = legendre(0, degrees, cosine)[l];
            assert!((sum - expected).abs() < 1e-12, "{l}: {sum} {expected}");
        }
    }

    #[test]
    fn gauss_nodes_integrate_polynomials_exactly() {
        for degree in 0..12 {
            let sum: f64 = gauss(6, 0.2, 1.0)
                .iter()
                .map(|(x, w)| w * x.powi(degree))
                .sum();
            let exact = (1.0 - 0.2f64.powi(degree + 1)) / f64::from(degree + 1);
            assert!((sum - exact).abs() < 1e-14, "{degree}");
        }
    }
}
