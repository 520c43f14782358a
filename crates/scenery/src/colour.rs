//! Linear reflectances and their 8-bit sRGB encoding.

use std::sync::LazyLock;

pub use uw_media::encoding::srgb_to_linear;

/// Reflectance in R, G, B, linear, 0..1.
pub type Reflectance = [f32; 3];

/// Reflectances of wet natural and painted surfaces stay inside this range; every texture does too.
pub const REFLECTANCE_RANGE: [f32; 2] = [0.03, 0.7];

/// `from` where `t` is 0, `to` where it is 1; `t` is clamped to [0, 1].
pub fn mix(from: Reflectance, to: Reflectance, t: f32) -> Reflectance {
    let t = t.clamp(0.0, 1.0);
    std::array::from_fn(|k| from[k] + (to[k] - from[k]) * t)
}

/// All channels times `factor`.
pub fn scale(reflectance: Reflectance, factor: f32) -> Reflectance {
    reflectance.map(|v| v * factor)
}

/// Kept inside [`REFLECTANCE_RANGE`].
pub fn plausible(reflectance: Reflectance) -> Reflectance {
    reflectance.map(|v| v.clamp(REFLECTANCE_RANGE[0], REFLECTANCE_RANGE[1]))
}

/// The linear values at which the rounded 8-bit code steps up.
static CODE_STEPS: LazyLock<[f32; 255]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear((i as f64 + 0.5) / 255.0) as f32));

/// 8-bit sRGB code of a linear value; values outside [0, 1] are clipped.
pub fn srgb_code(linear: f32) -> u8 {
    // At most 255 steps lie below any value.
    CODE_STEPS.partition_point(|&step| step <= linear) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_decoding_and_encoding() {
        for code in 0..=255_u8 {
            assert_eq!(
                srgb_code(srgb_to_linear(f64::from(code) / 255.0) as f32),
                code
            );
        }
        assert_eq!((srgb_code(-1.0), srgb_code(2.0)), (0, 255));
        // 18 % grey is code 118 in IEC 61966-2-1.
        assert_eq!(srgb_code(0.18), 118);
    }
}
