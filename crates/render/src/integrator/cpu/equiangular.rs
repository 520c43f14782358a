//! Distances along a ray that spread evenly over the angle under which they are seen from a lamp (Kulla and Fajardo
//! 2012): next to the lamp, where its light grows like 1/r², they are as dense as that.

use glam::DVec3;

use crate::prepare::Prepared;

use super::{camera_ray::Segment, lamp_target::Target};

/// Largest share of distances that are drawn so.
const SHARE: f64 = 0.75;
/// Density of other draws, by that of this distribution where it is largest, from which none are drawn so.
const DENSE_ENOUGH: f64 = 0.3;

/// The distribution for one ray and one lamp.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Equiangular {
    /// Distance along the ray to the point closest to the lamp, m; may be negative.
    foot: f64,
    /// Distance of that point from the lamp, m, > 0.
    height: f64,
    /// Angle at the lamp from the foot to the start of the ray, and on to its end.
    start: f64,
    span: f64,
    length: f64,
}

impl Equiangular {
    /// For the ray from `origin` along the unit vector `direction` over `length` (m, may be infinite) and a lamp of
    /// `radius` at `centre`, which blunts the distribution.
    pub fn new(origin: DVec3, direction: DVec3, length: f64, centre: DVec3, radius: f64) -> Self {
        let offset = centre - origin;
        let foot = offset.dot(direction);
        let across = (offset - foot * direction).length();
        let height = across.hypot(radius).max(1e-9 * offset.length()).max(1e-300);
        let span = if length == f64::INFINITY {
            height.atan2(-foot)
        } else {
            (height * length).atan2(height * height + foot * (foot - length))
        };
        Self {
            foot,
            height,
            start: (-foot / height).atan(),
            span,
            length,
        }
    }

    /// The distribution for `target` and the share of distances to draw from it, 0 to 0.75, on a ray where others fall with
    /// at most `density` (1/m). Where those are nearly as dense next to the lamp, as in turbid water, they will do.
    pub fn beside(scene: &Prepared, target: Target, ray: &Segment, density: f64) -> (Self, f64) {
        let (centre, radius) = (target.centre(scene), scene.lamps[target.lamp].radius);
        let law = Self::new(ray.origin, ray.direction, ray.length, centre, radius);
        let enough = DENSE_ENOUGH * law.density(law.foot.clamp(0.0, law.length));
        let share = if density < enough {
            SHARE * (1.0 - density / enough)
        } else {
            0.0
        };
        (law, share)
    }

    /// Distance for `u` in (0, 1), m.
    pub fn sample(&self, u: f64) -> f64 {
        let t = self.foot + self.height * (self.start + u * self.span).tan();
        t.clamp(0.0, self.length)
    }

    /// Density at distance `t`, 1/m.
    pub fn density(&self, t: f64) -> f64 {
        let along = t - self.foot;
        self.height / (self.span * (self.height * self.height + along * along))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_follow_the_density_near_and_far_from_the_lamp() {
        for (centre, radius, length) in [
            (DVec3::new(1.0, 1e-4, 0.0), 0.0, 2.0),
            (DVec3::new(1.0, 0.3, 0.2), 0.1, f64::INFINITY),
            (DVec3::new(-5.0, 0.1, 0.0), 0.0, 3.0),
            (DVec3::new(50.0, 0.0, 1.0), 0.0, 3.0),
        ] {
            let law = Equiangular::new(DVec3::ZERO, DVec3::X, length, centre, radius);
            // The density at a sample is the reciprocal of how fast samples move with u.
            for i in 1..1000 {
                let u = f64::from(i) / 1000.0;
                let step = 1e-6;
                let slope = (law.sample(u + step) - law.sample(u - step)) / (2.0 * step);
                let density = law.density(law.sample(u));
                assert!(
                    (slope * density - 1.0).abs() < 1e-4,
                    "{centre} {u}: {slope} {density}"
                );
            }
            assert!(law.sample(1e-12) >= 0.0 && law.sample(1.0 - 1e-12) <= length);
        }
    }
}
