//! How far an observer sees in a water: what divers and white disks tell of it.

use super::WaterSpectrum;
use super::luminous::{eye, seen_nm};
use crate::daylight::kirk_attenuation;

/// Optical depth at which a black target is lost before the water (Davies-Colley 1988).
const BLACK_TARGET: f64 = 4.8;
/// Reflectance of a white disk over π, and the least difference of it that the eye tells, 1/sr (Lee et al. 2015).
const DISK: (f64, f64) = (0.14, 0.013);
/// Attenuation of the light that goes down to the disk and comes back to the eye, over K_d (Lee et al. 2015).
const THERE_AND_BACK: f64 = 2.5;

/// Distance at which a diver loses a large black target in ample daylight, looking horizontally, m: 4.8 / c, c as the eye weighs
/// it (Davies-Colley 1988, Limnol. Oceanogr. 33, 616).
pub fn visibility_m(water: &WaterSpectrum) -> f64 {
    let weighed = |of: &dyn Fn(f64) -> f64| -> f64 { seen_nm().map(|nm| eye(nm) * of(nm)).sum() };
    let c = weighed(&|nm| water.a.at(nm) + water.b.at(nm)) / weighed(&|_| 1.0);
    BLACK_TARGET / c
}

/// Secchi depth, m: ln(0.14 / 0.013) / (2.5 K_d) at the wavelength of which daylight goes deepest (Lee et al. 2015, Remote Sens.
/// Environ. 169, 139; without the reflectance of the water, which is small against that of the disk), K_d by Kirk.
pub fn secchi_depth_m(water: &WaterSpectrum) -> f64 {
    let (disk, least) = DISK;
    let k_d = seen_nm().map(|nm| kirk_attenuation(water.a.at(nm), water.b.at(nm)));
    (disk / least).ln() / (THERE_AND_BACK * k_d.fold(f64::INFINITY, f64::min))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Curve;
    use crate::{WaterType, spectral};

    #[test]
    fn gray_water_is_seen_through_by_its_coefficients() {
        let even = |value| Curve::new(vec![(380.0, value), (720.0, value)]);
        let water = spectral::WaterSpectrum {
            a: even(0.2),
            b: even(0.4),
        };
        assert!((visibility_m(&water) - 8.0).abs() < 1e-9);
        let k_d = (0.04_f64 + 0.256 * 0.08).sqrt();
        let expected = (0.14_f64 / 0.013).ln() / (2.5 * k_d);
        assert!((secchi_depth_m(&water) - expected).abs() < 1e-9);
    }

    /// Zaneveld and Pegau (2003, Opt. Express 11, 2997) measured the sight of a black target: 4.8 / (0.9 c(532 nm) + 0.081).
    #[test]
    fn jerlov_waters_are_seen_through_as_a_transmissometer_says() {
        for water_type in WaterType::ALL {
            let water = WaterSpectrum::jerlov(water_type);
            let c = water.a.at(532.0) + water.b.at(532.0);
            let measured = 4.8 / (0.9 * c + 0.081);
            let ratio = visibility_m(&water) / measured;
            // Within 4 % in all but the three clearest, of which c is least known.
            let allowed = if c < 0.2 { 0.2 } else { 0.04 };
            assert!((ratio - 1.0).abs() < allowed, "{water_type}: {ratio:.3}");
        }
    }

    /// Tyler (1968): 8.69 over the sum of attenuation and diffuse attenuation, both as the eye weighs them. The two
    /// differ by up to 40 %.
    #[test]
    fn disks_are_lost_at_about_the_depth_of_the_older_rule() {
        for water_type in WaterType::ALL {
            let water = WaterSpectrum::jerlov(water_type);
            let (mut k_d, mut all) = (0.0, 0.0);
            for nm in seen_nm() {
                k_d += eye(nm) * kirk_attenuation(water.a.at(nm), water.b.at(nm));
                all += eye(nm);
            }
            let older = 8.69 / (4.8 / visibility_m(&water) + k_d / all);
            let ratio = secchi_depth_m(&water) / older;
            assert!((0.6..1.4).contains(&ratio), "{water_type}: {ratio:.2}");
        }
    }
}
