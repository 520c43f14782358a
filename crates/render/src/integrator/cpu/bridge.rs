//! Similarity bridges: a walk with k scatterings, scaled and turned so that it joins two given points.
//!
//! The shape of the walk (its angles and the ratios of its lengths) is drawn from the phase function; the
//! similarity that makes it fit costs a Jacobian in which every phase value and every 1/r² cancels. For
//! given k the integrand over the density is I (b s)^k/k! e^(−cs) s/D³, with D the distance of the two points
//! and s the length of the fitted walk (derivation: docs/transport.md).

use glam::DVec3;
use uw_media::phase::PhaseTable;

use super::order::MAX_ORDER;
use crate::integrator::sampling::{
    Draws, circle,
    directions::{frame, turn},
};

/// Walks longer than the straight way by this optical depth carry less than e^-60 of it and are dropped.
const MAX_EXCESS_DEPTH: f64 = 60.0;

/// A walk from a start through `order` scattering vertices to an end; the buffers are used again and again.
#[derive(Clone, Debug, Default)]
pub struct Bridge {
    /// Number of scatterings k.
    pub order: usize,
    /// Straight distance D, m.
    pub distance: f64,
    /// Length s of the walk, m.
    pub length: f64,
    /// Unit direction in which the walk leaves its start.
    pub first: DVec3,
    /// Unit direction from the end back along the last segment: the lamp's direction of emission.
    pub emission: DVec3,
    /// The k scattering vertices, m.
    pub vertices: Vec<DVec3>,
    /// The k + 1 segment lengths, m.
    pub lengths: Vec<f64>,
    /// sin²(θ/2) of the k scattering angles.
    pub sin2: Vec<f64>,
}

impl Bridge {
    /// Draws a walk of `order` scatterings from `start` to `end`. False when the points coincide or the walk
    /// cannot be fitted or carries nothing; its contribution is then zero.
    pub fn draw(
        &mut self,
        start: DVec3,
        end: DVec3,
        order: usize,
        phase: &PhaseTable,
        c_min: f64,
        draws: &mut Draws,
    ) -> bool {
        debug_assert!(order <= MAX_ORDER);
        let offset = end - start;
        let distance = offset.length();
        if !(distance > 0.0) {
            return false;
        }
        let axis = offset / distance;
        self.order = order;
        self.distance = distance;
        self.vertices.clear();
        self.lengths.clear();
        self.sin2.clear();
        if order == 0 {
            self.length = distance;
            self.first = axis;
            self.emission = -axis;
            self.lengths.push(distance);
            return true;
        }
        let (reach, last, total) = self.draw_shape(order, phase, draws);
        let extent = reach.length();
        if !(extent > 1e-12 * total) {
            return false;
        }
        let scale = distance / extent;
        self.length = total * scale;
        if (self.length - distance) * c_min > MAX_EXCESS_DEPTH {
            return false;
        }
        self.fit(start, axis, reach / extent, last, scale, draws);
        true
    }

    /// Turns the bridge about the straight way by that of four quarter turns which `u` picks in proportion to `worth`, of
    /// its directions at the start and of emission. Returns the factor of what it then brings, the mean worth over its
    /// own: by resampling (Talbot et al. 2005) as right on the average as the one roll it was drawn with. `None` where
    /// all four are worth nothing.
    pub fn choose_roll(
        &mut self,
        start: DVec3,
        axis: DVec3,
        u: f64,
        worth: impl Fn(DVec3, DVec3) -> f64,
    ) -> Option<f64> {
        let worths: [f64; 4] = std::array::from_fn(|turns| {
            let turned = |d: DVec3| quarters_about(d, axis, turns);
            worth(turned(self.first), turned(self.emission))
        });
        let sum: f64 = worths.iter().sum();
        let mut left = u * sum;
        let turns = worths.iter().position(|w| {
            left -= w;
            left < 0.0
        })?;
        self.first = quarters_about(self.first, axis, turns);
        self.emission = quarters_about(self.emission, axis, turns);
        if turns > 0 {
            for v in &mut self.vertices {
                *v = start + quarters_about(*v - start, axis, turns);
            }
        }
        Some(0.25 * sum / worths[turns])
    }

    /// Draws the shape from the origin along +z; leaves vertices and lengths unscaled. Returns the end, the
    /// last direction and the total length.
    fn draw_shape(
        &mut self,
        order: usize,
        phase: &PhaseTable,
        draws: &mut Draws,
    ) -> (DVec3, DVec3, f64) {
        let mut position = DVec3::ZERO;
        let mut direction = DVec3::Z;
        let mut total = 0.0;
        for i in 0..=order {
            let length = -draws.uniform().ln();
            total += length;
            position += length * direction;
            self.lengths.push(length);
            if i < order {
                let x = phase.sample_x(draws.uniform());
                self.sin2.push(x);
                self.vertices.push(position);
                // The first azimuth is given by the roll about the axis when the walk is fitted.
                let azimuth = if i == 0 { 0.0 } else { draws.uniform() };
                direction = turn(direction, x, azimuth);
            }
        }
        (position, direction, total)
    }

    /// Scales by `scale` and turns so that the shape's unit axis `reach` becomes `axis`, with a uniform roll.
    fn fit(
        &mut self,
        start: DVec3,
        axis: DVec3,
        reach: DVec3,
        last: DVec3,
        scale: f64,
        draws: &mut Draws,
    ) {
        let (from_u, from_v) = frame(reach);
        let (to_u, to_v) = frame(axis);
        let (sin, cos) = circle(draws.uniform());
        let (roll_u, roll_v) = (cos * to_u + sin * to_v, cos * to_v - sin * to_u);
        let map = |d: DVec3| d.dot(reach) * axis + d.dot(from_u) * roll_u + d.dot(from_v) * roll_v;
        self.first = map(DVec3::Z);
        self.emission = -map(last);
        for v in &mut self.vertices {
            *v = start + scale * map(*v);
        }
        for l in &mut self.lengths {
            *l *= scale;
        }
    }
}

/// `v` turned about the unit vector `axis` by 0 to 3 right angles.
#[inline]
fn quarters_about(v: DVec3, axis: DVec3, turns: usize) -> DVec3 {
    let along = v.dot(axis) * axis;
    match turns {
        0 => v,
        1 => along + axis.cross(v),
        2 => 2.0 * along - v,
        _ => along - axis.cross(v),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{prepare::Medium, scene::Water};
    use uw_media::{Iops, phase::Phase};

    /// A lobe at the start and a beam at the end, narrower than what the roll is chosen by.
    fn light(first: DVec3, emission: DVec3) -> f64 {
        first.y.max(0.0).powi(3) * if emission.z > 0.1 { 1.0 } else { 0.0 }
    }

    #[test]
    fn a_chosen_roll_joins_the_same_points_and_brings_the_same_light() {
        let medium = Medium::build(&Water {
            iops: Iops {
                a: [0.2; 3],
                b: [1.0; 3],
            },
            phase: Phase::Isotropic,
            refractive_index: 1.34,
        })
        .expect("it absorbs");
        let (start, end) = (DVec3::new(0.3, -0.2, 0.1), DVec3::new(1.0, 0.7, -0.5));
        let axis = (end - start).normalize();
        let mut bridge = Bridge::default();
        let mut sums = [0.0; 4];
        for i in 0..40_000 {
            let mut draws = Draws::new(5, i, 0, 0, 0);
            if !bridge.draw(start, end, 2, &medium.phase, medium.c_min, &mut draws) {
                continue;
            }
            let plain = light(bridge.first, bridge.emission);
            let worth = |first: DVec3, emission: DVec3| {
                first.y.max(0.0) * if emission.z > 0.0 { 1.0 } else { 0.0 }
            };
            let chosen = bridge.choose_roll(start, axis, draws.uniform(), worth);
            let chosen = chosen.map_or(0.0, |f| f * light(bridge.first, bridge.emission));
            let landed = bridge.vertices[1] - bridge.lengths[2] * bridge.emission;
            assert!(landed.distance(end) < 1e-9, "{landed}");
            let left = start + bridge.lengths[0] * bridge.first;
            assert!(left.distance(bridge.vertices[0]) < 1e-9, "{left}");
            for (sum, x) in sums
                .iter_mut()
                .zip([plain, plain * plain, chosen, chosen * chosen])
            {
                *sum += x / 40_000.0;
            }
        }
        let variance = |mean: f64, square: f64| (square - mean * mean) / 40_000.0;
        let (plain, chosen) = (variance(sums[0], sums[1]), variance(sums[2], sums[3]));
        let z = (sums[0] - sums[2]) / (plain + chosen).sqrt();
        assert!(z.abs() < 4.0, "{} instead of {}", sums[2], sums[0]);
        assert!(
            chosen < 0.7 * plain,
            "no less variance: {chosen} and {plain}"
        );
    }
}
