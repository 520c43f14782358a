//! Random walks of a given order, turned and scaled so that they end where they must.

use glam::DVec3;
use uw_media::phase::PhaseTable;
use uw_render::sampling::directions::{frame, turn};

use crate::estimate::numbers::Numbers;

/// A walk of k scatterings, in coordinates along and across its way from start to end (`docs/transport.md`).
#[derive(Debug, Default)]
pub(super) struct Bridge {
    /// Vertices from the start (the origin) to the end, k + 2 of them, in lengths of its own: along the way, and two across.
    vertices: Vec<DVec3>,
    /// First and last unit direction in the same coordinates.
    first: DVec3,
    last: DVec3,
    /// Length of the walk over the distance of its ends, >= 1.
    stretch: f64,
    /// Distance of its ends.
    span: f64,
}

/// A bridge's place between two points, but for its roll.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    start: DVec3,
    along: DVec3,
    across: (DVec3, DVec3),
    distance_m: f64,
}

impl Place {
    /// From `start` to `end`, which are apart.
    pub(super) fn new(start: DVec3, end: DVec3) -> Self {
        let distance_m = start.distance(end);
        let along = (end - start) / distance_m;
        Self {
            start,
            along,
            across: frame(along),
            distance_m,
        }
    }

    /// The straight distance, m.
    pub(super) fn distance_m(&self) -> f64 {
        self.distance_m
    }

    fn turned(&self, local: DVec3, (sin, cos): (f64, f64)) -> DVec3 {
        local.x * self.along
            + (local.y * cos - local.z * sin) * self.across.0
            + (local.y * sin + local.z * cos) * self.across.1
    }
}

impl Bridge {
    /// Draws a walk of `order` scatterings; false where it ends at its start.
    pub(super) fn draw(&mut self, order: usize, phase: &PhaseTable, numbers: &mut Numbers) -> bool {
        let (mut direction, mut at, mut length) = (DVec3::Z, DVec3::ZERO, 0.0);
        self.vertices.clear();
        self.vertices.push(at);
        for scattering in 0..=order {
            let flight = -numbers.random().ln();
            at += flight * direction;
            length += flight;
            self.vertices.push(at);
            if scattering < order {
                let x = phase.sample_x(numbers.random());
                direction = turn(direction, x, numbers.random());
            }
        }
        self.span = at.length();
        if !(self.span > 1e-9 * length) {
            return false;
        }
        self.stretch = length / self.span;
        let along = at / self.span;
        let (t, s) = frame(along);
        let local = |v: DVec3| DVec3::new(v.dot(along), v.dot(t), v.dot(s));
        self.vertices.iter_mut().for_each(|v| *v = local(*v));
        (self.first, self.last) = (local(DVec3::Z), local(direction));
        true
    }

    /// The straight way, which scatters nowhere.
    pub(super) fn straight(&mut self) {
        self.vertices.clear();
        self.vertices.extend([DVec3::ZERO, DVec3::X]);
        (self.first, self.last) = (DVec3::X, DVec3::X);
        (self.stretch, self.span) = (1.0, 1.0);
    }

    /// Length over the distance of the ends, >= 1.
    pub(super) fn stretch(&self) -> f64 {
        self.stretch
    }

    /// First direction at `place`, rolled by an angle given by its sine and cosine.
    pub(super) fn start_direction(&self, place: &Place, roll: (f64, f64)) -> DVec3 {
        place.turned(self.first, roll)
    }

    /// Last direction.
    pub(super) fn end_direction(&self, place: &Place, roll: (f64, f64)) -> DVec3 {
        place.turned(self.last, roll)
    }

    /// Vertices between start and end, m.
    pub(super) fn interior(&self, place: &Place, roll: (f64, f64)) -> impl Iterator<Item = DVec3> {
        let (place, scale) = (*place, place.distance_m / self.span);
        let inner = &self.vertices[1..self.vertices.len() - 1];
        inner
            .iter()
            .map(move |v| place.start + scale * place.turned(*v, roll))
    }
}

/// Four rolls a quarter turn apart, the first by `u` of a turn: sines and cosines.
pub(super) fn quarter_turns(u: f64) -> [(f64, f64); 4] {
    let (sin, cos) = (std::f64::consts::TAU * u).sin_cos();
    [(sin, cos), (cos, -sin), (-sin, -cos), (-cos, sin)]
}
