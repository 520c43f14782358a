//! Attenuation along a ray through homogeneous water.

/// Optical depth c·range, no unit, of attenuation `c`, 1/m, over `range_m`; 0 for `c = 0` over any range.
#[inline]
pub fn optical_depth(c: f64, range_m: f64) -> f64 {
    if c == 0.0 { 0.0 } else { c * range_m }
}

/// Share of the radiance, in [0, 1], that neither is absorbed nor scattered over `range_m`, exp(-c·range).
#[inline]
pub fn transmittance(c: f64, range_m: f64) -> f64 {
    (-optical_depth(c, range_m)).exp()
}

/// Distance to the next event, m, for `u` uniform in [0, 1); infinite for `c = 0`.
/// Its density is [`free_path_density`], the chance to go farther than r is the transmittance over r.
#[inline]
pub fn free_path_m(c: f64, u: f64) -> f64 {
    if c == 0.0 {
        f64::INFINITY
    } else {
        -(-u).ln_1p() / c
    }
}

/// Density of [`free_path_m`] at `range_m`, 1/m: c·exp(-c·range).
#[inline]
pub fn free_path_density(c: f64, range_m: f64) -> f64 {
    c * transmittance(c, range_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_free_path_inverts_the_transmittance() {
        for c in [1e-3, 0.45, 5.5] {
            for u in [0.0, 1e-12, 0.3, 0.999] {
                let range_m = free_path_m(c, u);
                let beyond = transmittance(c, range_m);
                assert!((1.0 - beyond - u).abs() < 1e-15, "c {c}, u {u}");
            }
            // -ln(1 - u) of a tiny u keeps its digits.
            assert!((free_path_m(c, 1e-20) * c / 1e-20 - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn the_density_is_the_slope_of_the_transmittance() {
        let (c, range_m, step) = (0.7, 2.0, 1e-5);
        let slope =
            (transmittance(c, range_m - step) - transmittance(c, range_m + step)) / (2.0 * step);
        assert!((free_path_density(c, range_m) / slope - 1.0).abs() < 1e-8);
    }

    #[test]
    fn vacuum_attenuates_nothing_at_any_distance() {
        assert_eq!(transmittance(0.0, f64::INFINITY), 1.0);
        assert_eq!(free_path_m(0.0, 0.0), f64::INFINITY);
        assert_eq!(transmittance(0.3, f64::INFINITY), 0.0);
    }
}
