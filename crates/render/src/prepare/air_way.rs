//! The way from a point in the water to a point in the air, by Snell's law. Twin: `shaders/common/air_lamps.wgsl`.

use glam::DVec3;

use super::{Boundary, Prepared, Primitive};

/// Most steps of Newton's method; it converges from below.
const STEPS: usize = 64;

/// A way through the water surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AirWay {
    /// Unit direction at its beginning.
    pub(crate) towards: DVec3,
    /// Length in the water, m.
    pub(crate) wet_m: f64,
    /// Unit direction in the air.
    pub(crate) in_air: DVec3,
    /// Length in the air, m.
    pub(crate) dry_m: f64,
    /// Irradiance across the way, where it begins, of an intensity of 1 W/sr where it ends, 1/m², without absorption.
    pub(crate) spread: f64,
}

impl AirWay {
    /// From a point to a point in the air.
    pub(crate) fn between(boundary: &Boundary, point: DVec3, in_air: DVec3) -> Self {
        let offset = in_air - point;
        let depth = boundary.height - point.z;
        if depth < 0.0 {
            let range = offset.length();
            let towards = offset / range;
            return Self {
                towards,
                wet_m: 0.0,
                in_air: towards,
                dry_m: range,
                spread: 1.0 / (range * range),
            };
        }
        let height = in_air.z - boundary.height;
        let reach = offset.truncate().length();
        let tangent = tangent_in_air(boundary.index, (depth, height), reach);
        let cosine = 1.0 / tangent.hypot(1.0);
        let sine = tangent * cosine;
        let wet_sine = sine / boundary.index;
        // The root of 1 less the square of the sine, without cancellation.
        let grow = (boundary.index - 1.0) * (boundary.index + 1.0);
        let root = (boundary.index * boundary.index + grow * tangent * tangent).sqrt();
        let wet_cosine = root * cosine / boundary.index;
        let (wet, dry) = (depth / wet_cosine, height / cosine);
        let aside = offset.truncate() / reach.max(f64::MIN_POSITIVE);
        let ring = (dry + wet / boundary.index)
            * (dry / cosine + wet * cosine / (boundary.index * wet_cosine * wet_cosine));
        Self {
            towards: (aside * wet_sine).extend(wet_cosine),
            wet_m: wet,
            in_air: (aside * sine).extend(cosine),
            dry_m: dry,
            spread: (1.0 - boundary.external_reflectance(cosine)) / (ring * wet_cosine),
        }
    }

    /// Whether nothing stands on the way from `point`, which lies on `start`.
    pub(crate) fn is_open(&self, scene: &Prepared, point: DVec3, start: Primitive) -> bool {
        // Short of the lamp, which may be set into a surface.
        let dry_m = self.dry_m * (1.0 - 1e-9);
        let geometry = &scene.geometry;
        if self.wet_m == 0.0 {
            return !geometry.occluded(point, self.in_air, dry_m, start);
        }
        let exit = point + self.wet_m * self.towards;
        !geometry.occluded(point, self.towards, self.wet_m, start)
            && !geometry.occluded(exit, self.in_air, dry_m, Primitive::None)
    }
}

/// Tangent of the angle in the air of the way over a horizontal distance.
fn tangent_in_air(index: f64, (depth, height): (f64, f64), reach: f64) -> f64 {
    let (square, grow) = (index * index, (index - 1.0) * (index + 1.0));
    let mut tangent = reach / (height + depth / index);
    if grow > 0.0 {
        tangent = tangent.max((reach - depth / grow.sqrt()) / height);
    }
    for _ in 0..STEPS {
        let root = (square + grow * tangent * tangent).sqrt();
        let missing = reach - tangent * (height + depth / root);
        tangent += missing / (height + depth * square / root.powi(3));
        if missing.abs() < 1e-14 * reach {
            break;
        }
    }
    tangent
}

#[cfg(test)]
mod tests {
    use super::*;

    const WATER: Boundary = Boundary {
        height: 2.0,
        index: 1.34,
    };

    /// Places in the water and in the air: near and far, steep and flat.
    fn places() -> Vec<(DVec3, DVec3)> {
        let heights = [1e-3, 0.1, 2.0, 30.0];
        let depths = [0.0, 1e-3, 0.5, 20.0];
        let reaches = [0.0, 0.01, 1.0, 50.0];
        let of = |h: f64, d: f64| {
            reaches.map(|r| {
                (
                    DVec3::new(0.3, -1.0, 2.0 - d),
                    DVec3::new(0.3, r - 1.0, 2.0 + h),
                )
            })
        };
        heights
            .iter()
            .flat_map(|&h| depths.iter().flat_map(move |&d| of(h, d)))
            .collect()
    }

    #[test]
    fn ways_obey_snells_law_and_meet() {
        for (point, lamp) in places() {
            let way = AirWay::between(&WATER, point, lamp);
            let end = point + way.wet_m * way.towards + way.dry_m * way.in_air;
            let size = 1.0 + (lamp - point).length();
            assert!((end - lamp).length() < 1e-9 * size, "{point} {lamp}: {end}");
            let bend =
                way.towards.truncate().length() * WATER.index - way.in_air.truncate().length();
            assert!(bend.abs() < 1e-12, "{point} {lamp}: {bend}");
        }
    }

    /// A cone of light from the lamp covers an area of the water across it that differences tell.
    #[test]
    fn light_spreads_as_neighbouring_ways_do() {
        const STEP: f64 = 1e-5;
        for (point, lamp) in places() {
            if (lamp - point).length() < 0.01 {
                continue;
            }
            let way = AirWay::between(&WATER, point, lamp);
            let (u, v) = way.towards.any_orthonormal_pair();
            let step = STEP
                * (lamp - point)
                    .length()
                    .min((WATER.height - point.z).max(1e-2));
            // Within the plane through the point across the way, without what would leave the water.
            let moved = |across: DVec3| {
                AirWay::between(&WATER, point + step * across - 2.0 * step * DVec3::Z, lamp).in_air
            };
            let du = (moved(u) - moved(-u)) / (2.0 * step);
            let dv = (moved(v) - moved(-v)) / (2.0 * step);
            let solid_angle = du.cross(dv).length();
            let passed = 1.0 - WATER.external_reflectance(way.in_air.z);
            let off = way.spread / (passed * solid_angle) - 1.0;
            assert!(off.abs() < 2e-3, "{point} {lamp}: {off}");
        }
    }

    #[test]
    fn without_refraction_ways_are_straight() {
        let matched = Boundary {
            height: 2.0,
            index: 1.0,
        };
        for (point, lamp) in places() {
            let way = AirWay::between(&matched, point, lamp);
            let range = (lamp - point).length();
            assert!((way.spread * range * range - 1.0).abs() < 1e-9);
            assert!((way.towards - (lamp - point) / range).length() < 1e-9);
        }
    }
}
