//! Random numbers and directions, and the flat interface's odds.

use std::f64::consts::PI;

use glam::DVec3;

/// Reflectance of a flat interface for unpolarised light and the cosine of the refracted direction, for light that
/// arrives at `cosine` > 0 on the side whose refractive index is `ratio` times that of the other.
pub(super) fn fresnel(cosine: f64, ratio: f64) -> (f64, f64) {
    let sine2 = ratio * ratio * (1.0 - cosine * cosine);
    if sine2 >= 1.0 {
        return (1.0, 0.0);
    }
    let refracted = (1.0 - sine2).sqrt();
    let s = (ratio * cosine - refracted) / (ratio * cosine + refracted);
    let p = (ratio * refracted - cosine) / (ratio * refracted + cosine);
    (0.5 * (s * s + p * p), refracted)
}

/// A unit direction whose angle to `axis` has the cosine 1 − `versine`, at a random azimuth.
pub(super) fn around(axis: DVec3, versine: f64, random: &mut Random) -> DVec3 {
    let (u, v) = axis.any_orthonormal_pair();
    let (sin, cos) = (2.0 * PI * random.uniform()).sin_cos();
    let sine = (versine * (2.0 - versine)).max(0.0).sqrt();
    ((1.0 - versine) * axis + sine * (cos * u + sin * v)).normalize()
}

/// Random numbers: SplitMix64 (Steele, Lea and Flood 2014).
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number, in (0, 1).
    pub(super) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * 2f64.powi(-53) + 2f64.powi(-54)
    }
}
