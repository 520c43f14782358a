//! A scene's lamp from the data sheet of a lamp.

use std::f64::consts::PI;

/// Luminous efficacy of the radiation of white light-emitting diodes between 400 and 700 nm that is assumed, lm/W.
pub const EFFICACY_LM_PER_W: f64 = 250.0;
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
}
