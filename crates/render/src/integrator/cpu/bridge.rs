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
    Draws,
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
        let (sin, cos) = (std::f64::consts::TAU * draws.uniform()).sin_cos();
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
