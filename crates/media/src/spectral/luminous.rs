//! How bright the eye finds light.

use super::Curve;

/// Wavelengths that cameras see, nm: watts of light are those between them.
const SEEN_NM: (u32, u32) = (400, 700);
/// Lumens of a watt where the eye is most sensitive (the definition of the candela).
const MOST_LM_PER_W: f64 = 683.0;

/// Lumens per watt of light between 400 and 700 nm with this spectrum; 0 where there is none.
pub fn efficacy_lm_per_w(spectrum: &Curve) -> f64 {
    let (mut seen, mut all) = (0.0, 0.0);
    for (nm, light) in seen_light(spectrum) {
        all += light;
        seen += light * eye(nm);
    }
    if all > 0.0 {
        MOST_LM_PER_W * seen / all
    } else {
        0.0
    }
}

/// Mean of a spectrum between 400 and 700 nm.
pub fn mean_seen(spectrum: &Curve) -> f64 {
    let sum: f64 = seen_light(spectrum).map(|(_, light)| light).sum();
    sum / f64::from(SEEN_NM.1 - SEEN_NM.0)
}

/// Sensitivity of the eye by daylight at a wavelength, nm, relative: 1.019 exp(-285.4 (λ/µm - 0.559)²), which is off by some
/// percent where it counts.
pub(super) fn eye(nm: f64) -> f64 {
    1.019 * (-285.4 * (1e-3 * nm - 0.559).powi(2)).exp()
}

/// The middle of every nm that cameras see, nm.
pub(super) fn seen_nm() -> impl Iterator<Item = f64> {
    (SEEN_NM.0..SEEN_NM.1).map(|nm| f64::from(nm) + 0.5)
}

/// Wavelength, nm, and light in the middle of every nm.
fn seen_light(spectrum: &Curve) -> impl Iterator<Item = (f64, f64)> {
    seen_nm().map(|nm| (nm, spectrum.at(nm)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::illuminant;

    #[test]
    fn spectra_have_the_lumens_per_watt_of_their_kind() {
        let line = |nm: f64| Curve::new(vec![(nm - 0.6, 0.0), (nm, 1.0), (nm + 0.6, 0.0)]);
        // The definition of the candela: 683 lm/W at 555 nm. A tenth of that is left at 650 nm (CIE 1924: 0.107).
        assert!((efficacy_lm_per_w(&line(555.5)) / 683.0 - 1.0).abs() < 0.02);
        assert!((efficacy_lm_per_w(&line(650.5)) / 683.0 - 0.107).abs() < 0.02);
        let white = efficacy_lm_per_w(&illuminant("led-5000k").expect("a spectrum"));
        let halogen = efficacy_lm_per_w(&illuminant("halogen").expect("a spectrum"));
        assert!((310.0..340.0).contains(&white), "{white}");
        assert!((230.0..260.0).contains(&halogen), "{halogen}");
        assert_eq!(efficacy_lm_per_w(&Curve::new(Vec::new())), 0.0);
    }

    #[test]
    fn the_mean_of_a_spectrum_is_that_of_what_cameras_see() {
        let even = Curve::new(vec![(300.0, 2.0), (800.0, 2.0)]);
        let half = Curve::new(vec![(550.0, 2.0), (800.0, 2.0)]);
        assert!((mean_seen(&even) - 2.0).abs() < 1e-12);
        assert!((mean_seen(&half) - 1.0).abs() < 1e-12);
    }
}
