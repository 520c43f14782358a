//! Sunlight scattered once on a straight segment, integrated along it.
//!
//! The phase function between a segment's direction and the sun is constant along the segment, and the
//! attenuation of the sunlight down to the segment and along it is one exponential: the whole segment is
//! scored in closed form. Where something can cast a shadow on it, one point of it is tested.

use glam::DVec3;

use crate::{
    integrator::sampling::{Draws, directions::sin2_half},
    prepare::{Boundary, Medium, Prepared, Primitive, SunBeam},
};

/// Distance, by the coordinates of all surfaces, within which a segment only touches them.
const TOUCHING: f64 = 1e-9;

/// A straight segment in the water.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Start, m.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Length, m; may be infinite when the segment does not lead upwards.
    pub length: f64,
}

/// The sunlit part of the water: what a line's integral is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attenuation {
    /// −ln of the attenuation at the start of the segment.
    pub(crate) start: f64,
    /// Its growth per metre along the segment, 1/m; may be negative.
    pub(crate) rate: f64,
}

impl Attenuation {
    fn new(c: f64, depth: f64, up: f64, sun_up: f64) -> Self {
        Self {
            start: c * depth / sun_up,
            rate: c * (1.0 - up / sun_up),
        }
    }

    /// Integral of the attenuation over the segment, m.
    #[inline]
    pub(crate) fn integral(&self, length: f64) -> f64 {
        if length == f64::INFINITY {
            return (-self.start).exp() / self.rate;
        }
        let x = self.rate * length;
        if x.abs() < 1e-5 {
            return length * (-self.start).exp() * (1.0 - 0.5 * x + x * x / 6.0);
        }
        // Both exponents are <= 0, so neither form can overflow.
        if x > 0.0 {
            (-self.start).exp() * absorbed(x) / self.rate
        } else {
            (-self.start - x).exp() * absorbed(-x) / -self.rate
        }
    }

    /// A point of the segment with density proportional to the attenuation.
    pub(crate) fn sample(&self, length: f64, u: f64) -> f64 {
        if length == f64::INFINITY {
            return -u.ln() / self.rate;
        }
        let x = self.rate * length;
        if x.abs() < 1e-9 {
            return u * length;
        }
        let from_dense_end = -(u * (-x.abs()).exp_m1()).ln_1p() / self.rate.abs();
        if x > 0.0 {
            from_dense_end.min(length)
        } else {
            (length - from_dense_end).max(0.0)
        }
    }

    fn at(&self, t: f64) -> f64 {
        (-self.start - self.rate * t).exp()
    }
}

/// 1 − e^(−x) for x > 0; quicker than `exp_m1` where nothing cancels.
#[inline]
pub(super) fn absorbed(x: f64) -> f64 {
    if x > 0.01 {
        1.0 - (-x).exp()
    } else {
        -(-x).exp_m1()
    }
}

/// Radiance per channel that the sun's light scattered once on `line` sends back to its start, W/(m² sr).
pub fn scattered_sunlight(
    scene: &Prepared,
    medium: &Medium,
    line: &Line,
    draws: &mut Draws,
) -> [f64; 3] {
    let (Some(sun), Some(boundary)) = (&scene.sun, &scene.boundary) else {
        return [0.0; 3];
    };
    let depth = (boundary.height - line.origin.z).max(0.0);
    let attenuation =
        |k: usize| Attenuation::new(medium.c[k], depth, line.direction.z, sun.towards.z);
    let phase = medium.phase.value(sin2_half(line.direction, sun.towards));
    let mut integral = [0.0; 3];
    let mut light = [0.0; 3];
    for k in 0..3 {
        if medium.b[k] > 0.0 {
            integral[k] = attenuation(k).integral(line.length);
            light[k] = medium.b[k] * phase * sun.irradiance[k] * integral[k];
        }
    }
    if !may_be_shadowed(scene, sun, line) {
        return light;
    }
    let lit: Vec3Channels = Vec3Channels::of(&integral);
    if lit.count == 0 {
        return [0.0; 3];
    }
    let channel = lit.channels[((draws.uniform() * lit.count as f64) as usize).min(lit.count - 1)];
    let t = attenuation(channel).sample(line.length, draws.uniform());
    let point = line.origin + t * line.direction;
    if !sun_reaches(scene, sun, boundary, point, Primitive::None) {
        return [0.0; 3];
    }
    let values = [0, 1, 2].map(|k| {
        if integral[k] > 0.0 {
            attenuation(k).at(t)
        } else {
            0.0
        }
    });
    let density: f64 = (0..3)
        .filter(|&k| integral[k] > 0.0)
        .map(|k| values[k] / integral[k])
        .sum::<f64>()
        / lit.count as f64;
    if !(density > 0.0) {
        return [0.0; 3];
    }
    [0, 1, 2].map(|k| medium.b[k] * phase * sun.irradiance[k] * values[k] / density)
}

/// The channels with a positive integral.
struct Vec3Channels {
    channels: [usize; 3],
    count: usize,
}

impl Vec3Channels {
    fn of(integral: &[f64; 3]) -> Self {
        let mut channels = [0; 3];
        let mut count = 0;
        for (k, &value) in integral.iter().enumerate() {
            if value > 0.0 {
                channels[count] = k;
                count += 1;
            }
        }
        Self { channels, count }
    }
}

/// Whether the sun's beam reaches `point` in the water, which lies on `from`.
pub fn sun_reaches(
    scene: &Prepared,
    sun: &SunBeam,
    boundary: &Boundary,
    point: DVec3,
    from: Primitive,
) -> bool {
    let to_surface = (boundary.height - point.z).max(0.0) / sun.towards.z;
    if scene
        .geometry
        .occluded(point, sun.towards, to_surface, from)
    {
        return false;
    }
    if !scene.needs.geometry_in_air {
        return true;
    }
    let mut exit = point + to_surface * sun.towards;
    exit.z = boundary.height;
    !scene
        .geometry
        .occluded(exit, sun.towards_in_air, f64::INFINITY, Primitive::None)
}

/// False only when nothing can lie between the segment and the sun: seen along the sun's direction, the
/// segment and the bounding box of everything are apart.
fn may_be_shadowed(scene: &Prepared, sun: &SunBeam, line: &Line) -> bool {
    let Some((lower, upper)) = scene.geometry.bounds() else {
        return false;
    };
    if scene.needs.geometry_in_air || line.length == f64::INFINITY {
        return true;
    }
    let across = line.direction.cross(sun.towards);
    if across.length_squared() < 1e-12 {
        return true;
    }
    let along = sun.towards.cross(across);
    let end = line.origin + line.length * line.direction;
    let (middle, half_size) = (0.5 * (lower + upper), 0.5 * (upper - lower));
    let rounding = TOUCHING * (middle.length() + half_size.length());
    for axis in [across, along] {
        let (near, far) = (line.origin.dot(axis), end.dot(axis));
        let centre = middle.dot(axis);
        let reach = half_size.dot(axis.abs());
        // A surface that the segment only touches with its end casts no shadow on it.
        let margin = rounding * axis.length();
        if near.max(far) <= centre - reach + margin || near.min(far) >= centre + reach - margin {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integral_and_samples_agree_with_quadrature_in_every_regime() {
        for (c, depth, up, sun_up, length) in [
            (0.3, 5.0, -0.4, 0.8, 20.0),
            (0.3, 5.0, 0.2, 0.8, 25.0),
            (2.0, 5.0, 0.9, 0.5, 5.0),
            (2.0, 5.0, 0.8, 0.8, 6.0),
            (4.0, 30.0, 0.99, 0.3, 30.0),
        ] {
            let a = Attenuation::new(c, depth, up, sun_up);
            let n = 200_000;
            let step = length / f64::from(n);
            let points = || (0..n).map(|i| (f64::from(i) + 0.5) * step);
            let sum: f64 = points().map(|t| a.at(t) * step).sum();
            assert!(
                (a.integral(length) / sum - 1.0).abs() < 1e-4,
                "{c} {up}: {} {sum}",
                a.integral(length)
            );
            let mean: f64 = points().map(|t| t * a.at(t) * step).sum::<f64>() / sum;
            let sampled: f64 = (0..20_000)
                .map(|i| a.sample(length, (f64::from(i) + 0.5) / 2e4))
                .sum::<f64>()
                / 2e4;
            assert!(
                (sampled / mean - 1.0).abs() < 2e-3,
                "{c} {up}: {sampled} {mean}"
            );
        }
    }
}
