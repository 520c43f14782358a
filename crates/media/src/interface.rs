//! The smooth interface between two transparent media: Fresnel, refraction, the n² law.
//!
//! Angles are taken from the normal, `cos_i` on the side of the incident light, in [0, 1]; `n_i` and
//! `n_t` are the refractive indices of the incident and the transmitting side, > 0.

/// Cosine of the refracted direction, in [0, 1]; `None` at total internal reflection.
#[inline]
pub fn refracted_cosine(cos_i: f64, n_i: f64, n_t: f64) -> Option<f64> {
    let normal_t = normal_component(cos_i, n_i, n_t)?;
    Some((normal_t / n_t).min(1.0))
}

/// `n_t cosθ_t`. Snell's law keeps the tangential part of n·direction, so
/// `(n_t cosθ_t)² = (n_i cosθ_i)² + n_t² - n_i²`; the difference of squares is taken as a product.
#[inline]
fn normal_component(cos_i: f64, n_i: f64, n_t: f64) -> Option<f64> {
    let normal_i = n_i * cos_i;
    let square = normal_i * normal_i + (n_t - n_i) * (n_t + n_i);
    (square >= 0.0).then(|| square.sqrt())
}

/// Share of unpolarised light that is reflected, in [0, 1]; 1 at total internal reflection, exactly 0
/// for `n_i = n_t`.
#[inline]
pub fn fresnel_reflectance(cos_i: f64, n_i: f64, n_t: f64) -> f64 {
    let step = (n_t - n_i) * (n_t + n_i);
    if step == 0.0 {
        return 0.0;
    }
    let Some(normal_t) = normal_component(cos_i, n_i, n_t) else {
        return 1.0;
    };
    // r_s = (n_i cosθ_i - n_t cosθ_t)/(n_i cosθ_i + n_t cosθ_t), its numerator freed of cancellation.
    let sum = n_i * cos_i + normal_t;
    let r_s = step / (sum * sum);
    // r_p = -r_s cos(θ_i + θ_t)/cos(θ_i - θ_t), both cosines times n_t.
    let cosines = cos_i * normal_t;
    let sines = n_i * (1.0 - cos_i) * (1.0 + cos_i);
    let r_p = r_s * (cosines - sines) / (cosines + sines);
    (0.5 * (r_s * r_s + r_p * r_p)).min(1.0)
}

/// Angle of incidence in radians beyond which all light is reflected; `None` when `n_i <= n_t`.
pub fn critical_angle_rad(n_i: f64, n_t: f64) -> Option<f64> {
    (n_i > n_t).then(|| (n_t / n_i).asin())
}

/// Factor on radiance that passes the interface, besides the loss by reflection: (n_t/n_i)².
/// Radiance over n² is kept because refraction changes the solid angle.
#[inline]
pub fn radiance_factor(n_i: f64, n_t: f64) -> f64 {
    (n_t / n_i) * (n_t / n_i)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WATER: f64 = 1.34;

    #[test]
    fn normal_incidence_is_the_square_of_the_index_step() {
        let expected = ((WATER - 1.0) / (WATER + 1.0)).powi(2);
        assert!((fresnel_reflectance(1.0, 1.0, WATER) - expected).abs() < 1e-15);
        assert!((fresnel_reflectance(1.0, WATER, 1.0) - expected).abs() < 1e-15);
        assert_eq!(refracted_cosine(1.0, 1.0, WATER), Some(1.0));
    }

    #[test]
    fn follows_the_textbook_form_in_the_angles() {
        for degrees in [5.0_f64, 30.0, 60.0, 85.0] {
            let i = degrees.to_radians();
            let t = (i.sin() / WATER).asin();
            let r_s = (i - t).sin() / (i + t).sin();
            let r_p = (i - t).tan() / (i + t).tan();
            let expected = 0.5 * (r_s * r_s + r_p * r_p);
            let reflectance = fresnel_reflectance(i.cos(), 1.0, WATER);
            assert!((reflectance / expected - 1.0).abs() < 1e-12, "{degrees}°");
            let cos_t = refracted_cosine(i.cos(), 1.0, WATER).unwrap_or(f64::NAN);
            assert!((cos_t - t.cos()).abs() < 1e-14);
            // The way back has the same loss.
            assert!((fresnel_reflectance(cos_t, WATER, 1.0) - reflectance).abs() < 1e-13);
        }
    }

    #[test]
    fn nothing_happens_between_equal_indices() {
        for cos_i in [0.0, 1e-9, 0.3, 1.0] {
            assert_eq!(fresnel_reflectance(cos_i, WATER, WATER), 0.0);
            assert!((refracted_cosine(cos_i, 1.0, 1.0).unwrap_or(2.0) - cos_i).abs() < 1e-15);
        }
        assert_eq!(critical_angle_rad(WATER, WATER), None);
    }

    #[test]
    fn a_tiny_index_step_reflects_its_square() {
        // At normal incidence (Δn / 2n)², far below the rounding of a difference of cosines.
        let reflectance = fresnel_reflectance(1.0, 1.0, 1.0 + 1e-9);
        assert!((reflectance / 2.5e-19 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn everything_is_reflected_at_grazing_and_beyond_the_critical_angle() {
        assert_eq!(fresnel_reflectance(0.0, 1.0, WATER), 1.0);
        let critical = critical_angle_rad(WATER, 1.0).unwrap_or(f64::NAN);
        assert!((critical.to_degrees() - 48.268).abs() < 1e-3);
        assert_eq!(
            fresnel_reflectance((critical + 1e-6).cos(), WATER, 1.0),
            1.0
        );
        assert_eq!(refracted_cosine((critical + 1e-6).cos(), WATER, 1.0), None);
        assert!(fresnel_reflectance((critical - 1e-6).cos(), WATER, 1.0) < 1.0);
        // Near grazing 1 - R falls linearly in the cosine: 4 (n² cosθ_t/n + cosθ_t ..)/2 stays > 0.
        let loss = 1.0 - fresnel_reflectance(1e-6, 1.0, WATER);
        let root = (WATER * WATER - 1.0).sqrt();
        let expected = 2e-6 * (1.0 + WATER * WATER) / root;
        assert!((loss / expected - 1.0).abs() < 1e-4);
    }

    #[test]
    fn brewsters_angle_reflects_only_the_perpendicular_part() {
        let brewster = WATER.atan();
        let r_s = (WATER * WATER - 1.0) / (WATER * WATER + 1.0);
        let reflectance = fresnel_reflectance(brewster.cos(), 1.0, WATER);
        assert!((reflectance - 0.5 * r_s * r_s).abs() < 1e-15);
    }

    #[test]
    fn radiance_over_the_squared_index_is_kept() {
        let there_and_back = radiance_factor(1.0, WATER) * radiance_factor(WATER, 1.0);
        assert!((there_and_back - 1.0).abs() < 1e-15);
        assert!((radiance_factor(1.0, WATER) - WATER * WATER).abs() < 1e-15);
    }
}
