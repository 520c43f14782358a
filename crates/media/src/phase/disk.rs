//! Light from a disk in place of a point at infinity: the mean of a phase function over the directions of the disk.
//!
//! A phase function of the sea rises without bound towards small angles, and light of a point source with it; a disk's is finite.

use super::PhaseFunction;

/// Beyond this many radii the phase function itself is the mean, to a few 1e-4 of itself or less.
pub(super) const FAR: f64 = 40.0;
/// Below this many radii the mean is that at the disk's middle.
const NEAR: f64 = 1e-3;
/// Rings into which the disk is cut.
const RINGS: u32 = 32;

/// The mean of `phase`, 1/sr, over a disk of `radius_rad` (half its apparent width, below 0.1) whose middle is at `x` = sin²(θ/2) from
/// straight on. The disk is as bright everywhere.
pub fn disk_mean(phase: &impl PhaseFunction, radius_rad: f64, x: f64) -> f64 {
    let angle = 2.0 * x.clamp(0.0, 1.0).sqrt().asin();
    if !(radius_rad > 0.0) || angle > FAR * radius_rad {
        return phase.value(x);
    }
    let half = |angle: f64| (0.5 * angle).sin().powi(2);
    let solid_angle = 4.0 * std::f64::consts::PI * half(radius_rad);
    let angle = if angle < NEAR * radius_rad {
        0.0
    } else {
        angle
    };
    // Rings around straight on: those wholly within the disk, and those that it shares.
    let (inner, outer) = ((radius_rad - angle).max(0.0), radius_rad + angle);
    let whole = phase.cdf(half(inner));
    if angle == 0.0 {
        return whole / solid_angle;
    }
    let from = (radius_rad - angle).abs();
    let at = |i: f64| {
        // Close together at both ends, where the shares bend.
        let turn = std::f64::consts::PI * i / f64::from(RINGS);
        0.5 * (from + outer) - 0.5 * (outer - from) * turn.cos()
    };
    let mut below = phase.cdf(half(from));
    let mut shared = 0.0;
    for i in 0..RINGS {
        let middle = at(f64::from(i) + 0.5);
        // Haversines: hav(radius) = hav(middle - angle) + sin(middle) sin(angle) hav(azimuth).
        let rest = half(radius_rad) - half(middle - angle);
        let azimuth = (rest / (middle.sin() * angle.sin())).clamp(0.0, 1.0);
        let share = 2.0 * azimuth.sqrt().asin() / std::f64::consts::PI;
        let above = phase.cdf(half(at(f64::from(i) + 1.0)));
        shared += share * (above - below);
        below = above;
    }
    (whole + shared) / solid_angle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phase::{FournierForand, HenyeyGreenstein, Isotropic};

    const RADIUS: f64 = 4.65e-3;

    fn x_of(angle: f64) -> f64 {
        (0.5 * angle).sin().powi(2)
    }

    /// Straightforward means over points of the disk, at angles where the function is smooth on it.
    #[test]
    fn the_mean_is_that_over_points_of_the_disk() {
        let sea = FournierForand::new(1.10, 0.0183).expect("a phase function");
        let smooth = HenyeyGreenstein::new(0.9).expect("a phase function");
        for radii in [1.5, 3.0, 10.0, 30.0] {
            let angle = radii * RADIUS;
            let plain = |phase: &dyn Fn(f64) -> f64| {
                let n = 600;
                let mut sum = 0.0;
                for i in 0..n {
                    let r = RADIUS * ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
                    for j in 0..n {
                        let turn = std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(n);
                        let off = x_of(angle) * r.cos() + 0.5 * (1.0 - r.cos())
                            - 0.5 * angle.sin() * r.sin() * turn.cos();
                        sum += phase(off);
                    }
                }
                sum / f64::from(n * n)
            };
            for (got, want) in [
                (
                    disk_mean(&sea, RADIUS, x_of(angle)),
                    plain(&|x| sea.value(x)),
                ),
                (
                    disk_mean(&smooth, RADIUS, x_of(angle)),
                    plain(&|x| smooth.value(x)),
                ),
            ] {
                assert!(
                    (got / want - 1.0).abs() < 1e-3,
                    "{radii} radii: {got} {want}"
                );
            }
        }
    }

    /// The mean over the sphere of the mean is that of the function: nothing is lost or added.
    #[test]
    fn the_light_is_kept() {
        let sea = FournierForand::new(1.15, 0.005).expect("a phase function");
        // ∫ 2π sinθ dθ in steps of the logarithm of θ, from where the mean is constant on.
        let least = 1e-4 * RADIUS;
        let steps = 4000;
        let rate = (std::f64::consts::PI / least).ln() / f64::from(steps);
        let mut sum = disk_mean(&sea, RADIUS, 0.0) * 4.0 * std::f64::consts::PI * x_of(least);
        for i in 0..steps {
            let edge = |i: f64| least * (rate * i).exp();
            let part = x_of(edge(f64::from(i) + 1.0)) - x_of(edge(f64::from(i)));
            let middle = edge(f64::from(i) + 0.5);
            sum += 4.0 * std::f64::consts::PI * part * disk_mean(&sea, RADIUS, x_of(middle));
        }
        assert!((sum - 1.0).abs() < 2e-3, "{sum}");
    }

    #[test]
    fn the_peak_is_finite_and_points_and_even_functions_are_themselves() {
        let sea = FournierForand::new(1.10, 0.0183).expect("a phase function");
        let peak = disk_mean(&sea, RADIUS, 0.0);
        let want = sea.cdf(x_of(RADIUS)) / (4.0 * std::f64::consts::PI * x_of(RADIUS));
        assert!((peak / want - 1.0).abs() < 1e-12 && peak < sea.value(x_of(1e-3 * RADIUS)));
        assert_eq!(disk_mean(&sea, 0.0, 0.3), sea.value(0.3));
        for radii in [0.0, 0.3, 0.999, 1.0, 1.001, 5.0] {
            let got = disk_mean(&Isotropic, RADIUS, x_of(radii * RADIUS));
            assert!(
                (got * 4.0 * std::f64::consts::PI - 1.0).abs() < 2e-3,
                "{radii}: {got}"
            );
        }
    }
}
