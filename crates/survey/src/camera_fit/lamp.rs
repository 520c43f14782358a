//! A scene's lamp from the data sheet of a lamp.

use std::f64::consts::PI;

use uw_render::scene::photometry::Photometry;

/// Spectrum that is assumed of a lamp of which nothing is said: white light-emitting diodes of 5000 K.
pub const SPECTRUM: &str = "led-5000k";
/// Channels among which the power is shared.
const CHANNELS: f64 = 3.0;

/// A lamp as a vehicle has it.
#[derive(Clone, Debug, PartialEq)]
pub struct LampFit {
    /// Intensity on the axis in each channel, W/sr.
    pub intensity_w_per_sr: f64,
    /// Half angle of the cone, degrees, at most 90.
    pub half_angle_deg: f64,
    /// Radiant power of all channels, W.
    pub power_w: f64,
    /// Angle, degrees, and relative intensity, where it does not fall with the cosine.
    pub profile: Option<Vec<[f64; 2]>>,
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
    check(&ranges)?;
    let half_angle_deg = 0.5 * beam_angle_deg;
    let power_w = lumen / efficacy_lm_per_w;
    let solid_angle = PI * half_angle_deg.to_radians().sin().powi(2);
    Ok(LampFit {
        intensity_w_per_sr: power_w / CHANNELS / solid_angle,
        half_angle_deg,
        power_w,
        profile: None,
    })
}

/// The lamp of a maker's photometric `file`, whose beam and, where `lumen` does not say, luminous flux it has. Power is that of
/// light with `efficacy_lm_per_w`, of which each of three channels gets a third.
///
/// # Errors
/// A value out of its range, by the option's name.
pub fn lamp_of_file(
    file: &Photometry,
    lumen: Option<f64>,
    efficacy_lm_per_w: f64,
) -> Result<LampFit, String> {
    let of_file = file.lumen(180.0);
    let lumen = lumen.unwrap_or(of_file);
    check(&[
        ("--lumen", lumen, 1e9),
        ("--efficacy-lm-per-w", efficacy_lm_per_w, 683.0),
    ])?;
    let axis = file.beam[0].1;
    let rows = file
        .beam
        .iter()
        .map(|&(angle_deg, cd)| [angle_deg, cd / axis]);
    let mut profile: Vec<[f64; 2]> = rows.collect();
    // One row of darkness ends a beam.
    while let [.., before, last] = profile.as_slice()
        && before[1] == 0.0
        && last[1] == 0.0
    {
        profile.pop();
    }
    let power_w = lumen / efficacy_lm_per_w;
    // The file's candelas over its lumens are what a watt a channel makes on the axis.
    let per_power_sr = axis / of_file;
    Ok(LampFit {
        intensity_w_per_sr: power_w / CHANNELS * per_power_sr,
        half_angle_deg: profile.last().map_or(0.0, |row| row[0]),
        power_w,
        profile: Some(profile),
    })
}

fn check(ranges: &[(&str, f64, f64)]) -> Result<(), String> {
    for &(option, value, most) in ranges {
        if !(value > 0.0 && value <= most) {
            return Err(format!("{option} must be in (0, {most}], got {value}"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_render::scene::Falloff;

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
    #[test]
    fn a_photometric_file_s_lamp_has_its_lumens() {
        let file = Photometry {
            beam: vec![(0.0, 200.0), (30.0, 100.0), (60.0, 0.0), (90.0, 0.0)],
            uneven: 0.0,
        };
        let fit = lamp_of_file(&file, None, 250.0).expect("a lamp");
        let rows = vec![[0.0, 1.0], [30.0, 0.5], [60.0, 0.0]];
        assert_eq!(
            (fit.profile, fit.half_angle_deg),
            (Some(rows.clone()), 60.0)
        );
        assert!((fit.power_w / (file.lumen(180.0) / 250.0) - 1.0).abs() < 1e-12);
        let falloff = Falloff::Profile(rows.iter().map(|row| (row[0], row[1])).collect());
        let power = 3.0 * fit.intensity_w_per_sr * falloff.solid_angle_sr(60.0);
        assert!((power / fit.power_w - 1.0).abs() < 1e-4, "{power}");
        let brighter = lamp_of_file(&file, Some(1000.0), 250.0).expect("a lamp");
        assert_eq!(brighter.power_w, 4.0);
        assert!(lamp_of_file(&file, Some(0.0), 250.0).is_err());
    }
}
