//! A scene's lamp from the data sheet of a lamp.

use std::f64::consts::PI;

use uw_media::spectral::Curve;

/// Spectrum that is assumed of a lamp of which nothing is said: white light-emitting diodes of 5000 K.
pub const SPECTRUM: &str = "led-5000k";
/// Wavelengths that cameras see, nm: watts of light are those between them.
const SEEN_NM: (u32, u32) = (400, 700);
/// Channels among which the power is shared.
const CHANNELS: f64 = 3.0;

/// A lamp as a vehicle has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampFit {
    /// Intensity on the axis in each channel, W/sr.
    pub intensity_w_per_sr: f64,
    /// Half angle of the cone, degrees, at most 90.
    pub half_angle_deg: f64,
    /// Radiant power of all channels, W.
    pub power_w: f64,
}

/// Lumens per watt of light between 400 and 700 nm with this spectrum; 0 where there is none. The eye's sensitivity is taken as
/// 1.019 exp(-285.4 (λ/µm - 0.559)²), which is off by some percent where it counts.
pub fn efficacy_lm_per_w(spectrum: &Curve) -> f64 {
    let (mut seen, mut all) = (0.0, 0.0);
    for nm in SEEN_NM.0..SEEN_NM.1 {
        let nm = f64::from(nm) + 0.5;
        let light = spectrum.at(nm);
        all += light;
        seen += light * 1.019 * (-285.4 * (1e-3 * nm - 0.559).powi(2)).exp();
    }
    if all > 0.0 { 683.0 * seen / all } else { 0.0 }
}

/// The lamp of `lumen` lm (above 0) with a full beam angle of `beam_angle_deg` in (0, 180], of light with `efficacy_lm_per_w` (above
/// 0, at most 683).
///
/// The intensity falls as I·cos θ inside a cone of half the beam angle and is 0 beyond: a data sheet's beam ends at half of the
/// intensity on the axis, which the cone's edge passes for beams up to 120°. Its power is π I sin²(half angle), of which each of
/// three channels gets a third.
///
/// # Errors
/// A value out of its range, by the option's name.
pub fn lamp(lumen: f64, beam_angle_deg: f64, efficacy_lm_per_w: f64) -> Result<LampFit, String> {
    let ranges = [
        ("--lumen", lumen, 1e9),
        ("--beam-angle-deg", beam_angle_deg, 180.0),
        ("--efficacy-lm-per-w", efficacy_lm_per_w, 683.0),
    ];
    for (option, value, most) in ranges {
        if !(value > 0.0 && value <= most) {
            return Err(format!("{option} must be in (0, {most}], got {value}"));
        }
    }
    let half_angle_deg = 0.5 * beam_angle_deg;
    let power_w = lumen / efficacy_lm_per_w;
    let solid_angle = PI * half_angle_deg.to_radians().sin().powi(2);
    Ok(LampFit {
        intensity_w_per_sr: power_w / CHANNELS / solid_angle,
        half_angle_deg,
        power_w,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_media::spectral::illuminant;
    use uw_render::scene::Falloff;

    #[test]
    fn spectra_have_the_lumens_per_watt_of_their_kind() {
        let line = |nm: f64| Curve::new(vec![(nm - 0.6, 0.0), (nm, 1.0), (nm + 0.6, 0.0)]);
        // The definition of the candela: 683 lm/W at 555 nm. A tenth of that is left at 650 nm (CIE 1924: 0.107).
        assert!((efficacy_lm_per_w(&line(555.5)) / 683.0 - 1.0).abs() < 0.02);
        assert!((efficacy_lm_per_w(&line(650.5)) / 683.0 - 0.107).abs() < 0.02);
        let white = efficacy_lm_per_w(&illuminant(SPECTRUM).expect("a spectrum"));
        let halogen = efficacy_lm_per_w(&illuminant("halogen").expect("a spectrum"));
        assert!((310.0..340.0).contains(&white), "{white}");
        assert!((230.0..260.0).contains(&halogen), "{halogen}");
        assert_eq!(efficacy_lm_per_w(&Curve::new(Vec::new())), 0.0);
    }

    /// The intensity over all directions, as the scene's falloff has it, is the power of the data sheet.
    #[test]
    fn the_scene_s_lamp_has_the_data_sheet_s_power() {
        for beam_angle_deg in [20.0, 90.0, 135.0, 180.0] {
            let fit = lamp(1500.0, beam_angle_deg, 250.0).expect("a lamp");
            assert_eq!(fit.power_w, 6.0);
            let steps = 10_000;
            let step = fit.half_angle_deg.to_radians() / f64::from(steps);
            let ring = |i: i32| {
                let angle = (f64::from(i) + 0.5) * step;
                let relative = Falloff::Cosine.relative(angle.to_degrees());
                2.0 * PI * angle.sin() * step * relative * fit.intensity_w_per_sr
            };
            let power = 3.0 * (0..steps).map(ring).sum::<f64>();
            assert!((power - 6.0).abs() < 1e-6, "{beam_angle_deg}: {power}");
        }
        for (values, words) in [
            ([0.0, 90.0, 250.0], "--lumen must be in"),
            (
                [1.0, 181.0, 250.0],
                "--beam-angle-deg must be in (0, 180], got 181",
            ),
            (
                [1.0, 90.0, f64::NAN],
                "--efficacy-lm-per-w must be in (0, 683], got NaN",
            ),
        ] {
            let told = lamp(values[0], values[1], values[2]).expect_err("refused");
            assert!(told.contains(words), "{told}");
        }
    }
}
