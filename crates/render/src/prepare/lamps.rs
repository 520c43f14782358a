//! Lamps as the integrators read them.

use glam::DVec3;
use uw_media::Spectrum;

use super::{Boundary, Medium};
use crate::scene::{Falloff, Lamp};

/// Entries of a falloff table, spaced evenly in the sine of half the angle from the axis.
const FALLOFF_ENTRIES: usize = 2048;
/// Probability of aiming at the mirror image of a lamp right at the surface.
const MIRROR_SHARE: f64 = 0.5;
/// What it falls to, but for absorption, where the way by the surface is much longer than a free path.
const FAR_MIRROR_SHARE: f64 = 0.1;
/// Least share: weights stay finite.
const LEAST_MIRROR_SHARE: f64 = 1e-9;
/// Share of a lamp's light that its beam holds.
const BEAM_SHARE: f64 = 0.95;
/// Half angle of the widest beam that paths are led through, degrees. Beside wider ones too little is dark.
const WIDEST_BEAM_DEG: f64 = 25.0;
/// Half angle of the narrowest, degrees: in single precision what is in a cone and what is drawn there differ by 2e-7 of its cosine, 1e-3 of
/// the solid angle of this one and all of that of one of 0.01°.
const NARROWEST_BEAM_DEG: f64 = 1.0;
/// The cosine of a lamp without such a beam: no direction is within.
const NO_BEAM: f64 = 2.0;
/// Rings of equal solid angle by which it is found: a beam of 1° half angle has 8.
const BEAM_RINGS: usize = 1 << 17;

/// A lamp at 100 %.
#[derive(Clone, Debug)]
pub struct PreparedLamp {
    /// Centre, m.
    pub position: DVec3,
    /// Unit axis.
    pub forward: DVec3,
    /// Radiant intensity on the axis, W/sr per channel.
    pub intensity: Spectrum,
    /// Level as a fraction, 0 to 1.
    pub level: f64,
    /// Radius of the disk, m; 0 for a point.
    pub radius: f64,
    /// Whether it is above a water surface.
    pub in_air: bool,
    /// Probability of aiming at the lamp's mirror image in the water surface; 0 where there is none.
    pub(crate) mirror_share: f64,
    pub(crate) cos_half_angle: f64,
    /// Cosine of the half angle of the cone that holds most of the light; `NO_BEAM` where that is wide or next to nothing.
    pub(crate) beam_cosine: f64,
    pub(crate) tangent: (DVec3, DVec3),
    pub(crate) falloff: Option<Vec<f64>>,
}

impl PreparedLamp {
    /// Prepares `lamp`.
    pub fn build(lamp: &Lamp) -> Self {
        let falloff = match &lamp.falloff {
            Falloff::Uniform => None,
            other => Some(tabulate(|angle| other.relative(angle.to_degrees()))),
        };
        let mut prepared = Self {
            position: lamp.position_m,
            forward: lamp.forward,
            intensity: lamp.intensity,
            level: lamp.level_pct / 100.0,
            radius: lamp.radius_m,
            in_air: false,
            mirror_share: 0.0,
            cos_half_angle: if lamp.half_angle_deg >= 180.0 {
                -1.0
            } else {
                lamp.half_angle_deg.to_radians().cos()
            },
            beam_cosine: NO_BEAM,
            tangent: lamp.forward.any_orthonormal_pair(),
            falloff,
        };
        prepared.beam_cosine = prepared.cosine_of_beam();
        prepared
    }

    /// Whether it is in the water and its light in a narrow beam.
    pub(crate) fn has_beam(&self) -> bool {
        !self.in_air && self.beam_cosine <= 1.0
    }

    /// Cosine of the half angle of the cone about the axis that holds `BEAM_SHARE` of the light; of a lamp that is of one brightness
    /// up to an edge, the edge's.
    fn cosine_of_beam(&self) -> f64 {
        let cosine = if self.falloff.is_none() {
            self.cos_half_angle
        } else {
            self.cosine_that_holds(BEAM_SHARE)
        };
        let [widest, narrowest] =
            [WIDEST_BEAM_DEG, NARROWEST_BEAM_DEG].map(|deg| deg.to_radians().cos());
        if (widest..=narrowest).contains(&cosine) {
            cosine
        } else {
            NO_BEAM
        }
    }

    fn cosine_that_holds(&self, share: f64) -> f64 {
        // Rings of equal solid angle lie between equal steps of sin² of half the angle.
        let tangent = self.tangent.0;
        let ring = |i: usize| {
            let cosine = 1.0 - 2.0 * (i as f64 + 0.5) / BEAM_RINGS as f64;
            let emission = cosine * self.forward + (1.0 - cosine * cosine).sqrt() * tangent;
            self.relative_intensity(emission)
        };
        let all: f64 = (0..BEAM_RINGS).map(ring).sum();
        let mut held = 0.0;
        let rings = (0..BEAM_RINGS).find(|&i| {
            held += ring(i);
            held >= share * all
        });
        1.0 - 2.0 * rings.map_or(BEAM_RINGS, |i| i + 1) as f64 / BEAM_RINGS as f64
    }

    /// The lamp in water under a surface, or above it, seen from `camera`.
    pub(super) fn beside(
        mut self,
        boundary: Option<&Boundary>,
        medium: Option<&Medium>,
        camera: DVec3,
    ) -> Self {
        self.in_air = boundary.is_some_and(|boundary| self.position.z > boundary.height);
        self.mirror_share = match boundary {
            Some(boundary) if boundary.index != 1.0 && !self.in_air => {
                mirror_share(self.position, boundary, medium, camera)
            }
            _ => 0.0,
        };
        self
    }

    /// Intensity in unit direction `emission`, relative to the axis at 100 %. A disk's own cosine is included.
    #[inline]
    pub fn relative_intensity(&self, emission: DVec3) -> f64 {
        let cosine = self.forward.dot(emission);
        if cosine < self.cos_half_angle {
            return 0.0;
        }
        let disk = if self.radius > 0.0 {
            cosine.max(0.0)
        } else {
            1.0
        };
        match &self.falloff {
            None => disk,
            Some(table) => disk * look_up(table, (0.5 * (1.0 - cosine)).clamp(0.0, 1.0).sqrt()),
        }
    }
}

fn tabulate(relative: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..=FALLOFF_ENTRIES)
        .map(|i| relative(2.0 * (i as f64 / FALLOFF_ENTRIES as f64).asin()))
        .collect()
}

fn look_up(table: &[f64], sin_half: f64) -> f64 {
    let position = sin_half * FALLOFF_ENTRIES as f64;
    let i = (position as usize).min(FALLOFF_ENTRIES - 1);
    let f = position - i as f64;
    table[i] + f * (table[i + 1] - table[i])
}

/// Probability of aiming at the mirror image of a lamp at `position`: the smaller the longer the way by the surface is.
/// Scattering takes light to and from the surface that attenuation would not let through, absorption does not.
fn mirror_share(
    position: DVec3,
    boundary: &Boundary,
    medium: Option<&Medium>,
    camera: DVec3,
) -> f64 {
    let height = boundary.height - position.z;
    let image = position + DVec3::new(0.0, 0.0, 2.0 * height);
    let detour = (camera.distance(image) - camera.distance(position)).max(0.0);
    let (c, a) = medium.map_or((0.0, 0.0), |m| (m.c_min, m.a_min()));
    let least = (FAR_MIRROR_SHARE * (-a * detour).exp()).max(LEAST_MIRROR_SHARE);
    (MIRROR_SHARE * (-c * 2.0 * height).exp()).clamp(least, MIRROR_SHARE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp(falloff: Falloff, half_angle_deg: f64, radius_m: f64) -> PreparedLamp {
        PreparedLamp::build(&Lamp {
            name: "l".into(),
            position_m: DVec3::ZERO,
            forward: DVec3::X,
            intensity: [10.0, 5.0, 1.0],
            spectrum: None,
            level_pct: 50.0,
            half_angle_deg,
            falloff,
            radius_m,
        })
    }

    #[test]
    fn cone_is_hard_and_falloff_follows_the_angle() {
        let at = |l: &PreparedLamp, deg: f64| {
            l.relative_intensity(DVec3::new(
                deg.to_radians().cos(),
                deg.to_radians().sin(),
                0.0,
            ))
        };
        let cone = lamp(Falloff::Uniform, 40.0, 0.0);
        assert_eq!((at(&cone, 39.9), at(&cone, 40.1)), (1.0, 0.0));
        let cosine = lamp(Falloff::Cosine, 180.0, 0.0);
        assert!((at(&cosine, 60.0) - 0.5).abs() < 1e-6);
        let beam = lamp(
            Falloff::Profile(vec![(0.0, 1.0), (30.0, 0.4), (60.0, 0.0)]),
            180.0,
            0.0,
        );
        assert!((at(&beam, 15.0) - 0.7).abs() < 1e-3 && at(&beam, 61.0) == 0.0);
    }

    /// The edge of a beam of one brightness, of one that falls off the cone with nineteen twentieths of its light; none of a wide one or of a thread. Where it falls
    /// as 1 − θ/θ0, the share of the light within θ is 3 (θ/θ0)² − 2 (θ/θ0)³ for small angles: 0.95 at 0.8646.
    #[test]
    fn a_narrow_beam_is_the_cone_that_holds_its_light() {
        let degrees = |l: PreparedLamp| l.beam_cosine.acos().to_degrees();
        let cone = lamp(Falloff::Uniform, 10.0, 0.0);
        assert!(cone.has_beam() && (degrees(cone) - 10.0).abs() < 1e-9);
        let tent = Falloff::Profile(vec![(0.0, 1.0), (10.0, 0.0)]);
        let found = degrees(lamp(tent, 180.0, 0.0));
        assert!((found - 8.646).abs() < 0.05, "{found}");
        for other in [
            lamp(Falloff::Uniform, 0.01, 0.0),
            lamp(Falloff::Uniform, 26.0, 0.0),
            lamp(Falloff::Uniform, 180.0, 0.1),
            lamp(Falloff::Cosine, 50.0, 0.0),
        ] {
            assert!(!other.has_beam());
        }
    }

    /// At the surface half of the paths go to the image, deep in absorbing water next to none; a camera at the surface sees
    /// both equally far, and where nothing absorbs light comes back from any depth.
    #[test]
    fn the_share_of_the_mirror_image_follows_what_absorption_leaves() {
        let boundary = Boundary {
            height: 0.0,
            index: 1.34,
        };
        let medium = |a: f64| {
            let iops = uw_media::Iops {
                a: [a; 3],
                b: [1.0; 3],
            };
            Medium::build(&crate::scene::Water {
                iops,
                phase: uw_media::phase::Phase::Isotropic,
                refractive_index: 1.34,
                variation: crate::scene::Variation::default(),
            })
        };
        let share = |a: f64, depth_m: f64, camera_depth_m: f64| {
            let position = DVec3::new(0.0, 0.0, -depth_m);
            let camera = DVec3::new(0.0, 0.0, -camera_depth_m);
            mirror_share(position, &boundary, medium(a).as_ref(), camera)
        };
        assert_eq!(share(0.2, 0.0, 0.0), MIRROR_SHARE);
        let deep = FAR_MIRROR_SHARE * (-0.2_f64 * 20.0).exp();
        assert!((share(0.2, 10.0, 10.0) / deep - 1.0).abs() < 1e-9);
        assert_eq!(share(0.2, 10.0, 0.0), FAR_MIRROR_SHARE);
        assert!((share(0.0, 10.0, 10.0) / FAR_MIRROR_SHARE - 1.0).abs() < 1e-9);
        assert_eq!(share(0.2, 1000.0, 1000.0), LEAST_MIRROR_SHARE);
    }
}
