//! Turning and drawing directions without losing small angles.

use glam::DVec3;

use super::circle;

/// sin²(θ/2) of the angle between two unit directions, exact also for tiny angles.
#[inline]
pub fn sin2_half(a: DVec3, b: DVec3) -> f64 {
    (0.25 * (a - b).length_squared()).min(1.0)
}

/// Two unit vectors that complete `axis` to an orthonormal frame (Duff et al. 2017).
#[inline]
pub fn frame(axis: DVec3) -> (DVec3, DVec3) {
    let sign = 1f64.copysign(axis.z);
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    (
        DVec3::new(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x),
        DVec3::new(b, sign + axis.y * axis.y * a, -axis.y),
    )
}

/// `direction` turned by the angle θ with sin²(θ/2) = `x`, at azimuth 2π·`u`; stays a unit vector.
#[inline]
pub fn turn(direction: DVec3, x: f64, u: f64) -> DVec3 {
    let sine = 2.0 * (x * (1.0 - x)).max(0.0).sqrt();
    let (sin_azimuth, cos_azimuth) = circle(u);
    let (t, s) = frame(direction);
    // The change is added as a whole, so that tiny angles survive.
    let turned =
        direction + (sine * cos_azimuth * t + sine * sin_azimuth * s - 2.0 * x * direction);
    // One Newton step keeps the length at 1 over any number of turns.
    turned * (1.5 - 0.5 * turned.length_squared())
}

/// A direction around `normal` with density cos/π.
#[inline]
pub fn cosine_hemisphere(normal: DVec3, u: f64, v: f64) -> DVec3 {
    let r = u.sqrt();
    let (sin, cos) = circle(v);
    let (t, s) = frame(normal);
    (r * cos * t + r * sin * s + (1.0 - u).sqrt() * normal).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Rng;

    #[test]
    fn turning_keeps_tiny_angles_and_unit_length() {
        let mut rng = Rng::new(1, 2, 3, 4);
        let mut d = DVec3::new(0.6, -0.48, 0.64);
        for i in 0..10_000 {
            let x = 10f64.powf(-30.0 * rng.uniform());
            let turned = turn(d, x, rng.uniform());
            let got = sin2_half(d, turned);
            // Directions are rounded to 1e-16, so x below 1e-32 cannot be seen again.
            assert!(
                (got - x).abs() <= 4e-16 * x.sqrt() + 1e-9 * x + 1e-32,
                "{x} {got}"
            );
            assert!((turned.length() - 1.0).abs() < 1e-12, "step {i}");
            d = turned;
        }
    }

    #[test]
    fn turning_by_half_a_circle_reverses() {
        assert!((turn(DVec3::Y, 1.0, 0.3) + DVec3::Y).length() < 1e-15);
        assert!(turn(DVec3::X, 0.5, 0.7).dot(DVec3::X).abs() < 1e-15);
    }

    #[test]
    fn cosine_directions_have_the_right_moments() {
        let mut rng = Rng::new(5, 0, 0, 0);
        let n = 100_000;
        let mean = (0..n)
            .map(|_| cosine_hemisphere(DVec3::Z, rng.uniform(), rng.uniform()).z)
            .sum::<f64>()
            / f64::from(n);
        // Mean cosine 2/3, standard deviation sqrt(1/2 - 4/9).
        assert!((mean - 2.0 / 3.0).abs() < 4.0 * 0.2357 / f64::from(n).sqrt());
    }
}
