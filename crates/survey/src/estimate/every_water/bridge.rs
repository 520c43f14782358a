//! Ways that scatter a given number of times between two given points.

use glam::DVec3;
use uw_media::phase::PhaseTable;
use uw_render::sampling::circle;
use uw_render::sampling::directions::{frame, turn};

use super::super::numbers::Numbers;
use super::super::target_view::TargetView;

/// A way between two points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bridge {
    /// Unit direction in which it starts.
    pub(super) start: DVec3,
    /// Unit direction in which it ends.
    pub(super) end: DVec3,
    /// Its length, m.
    pub(super) length_m: f64,
    /// Distance of the two points, m.
    pub(super) distance_m: f64,
    /// sin²(θ/2) of its largest deflection; 0 where it is straight.
    pub(super) largest: f64,
}

/// Makes bridges in one view and water.
pub(super) struct Bridges<'a> {
    view: &'a TargetView,
    phase: &'a PhaseTable,
    vertices: Vec<DVec3>,
}

impl<'a> Bridges<'a> {
    pub(super) fn new(view: &'a TargetView, phase: &'a PhaseTable) -> Self {
        Self {
            view,
            phase,
            vertices: Vec::new(),
        }
    }

    /// A way from `from` to `to` that scatters `order` times: a random walk whose deflections are those of the phase
    /// function, turned and scaled so that it ends where it must. `None` where the target is in its way.
    ///
    /// A walk of unit total length is scaled by its length s, and its orientation is even but for the roll, so that the
    /// fluence it stands for is b^order e^(-(a+b)s) s^(order+1) / (order! · distance³) per intensity at its start.
    pub(super) fn bridge(
        &mut self,
        (from, to): (DVec3, DVec3),
        order: usize,
        numbers: &mut Numbers,
    ) -> Option<Bridge> {
        let way = to - from;
        let distance_m = way.length();
        let axis = way / distance_m;
        if order == 0 {
            return (distance_m > 0.0).then_some(Bridge {
                start: axis,
                end: axis,
                length_m: distance_m,
                distance_m,
                largest: 0.0,
            });
        }
        let roll = numbers.next();
        let mut direction = DVec3::Z;
        let mut length = numbers.length();
        let mut place = length * direction;
        let mut largest = 0.0_f64;
        self.vertices.clear();
        for _ in 0..order {
            self.vertices.push(place);
            let x = self.phase.sample_x(numbers.next());
            largest = largest.max(x);
            direction = turn(direction, x, numbers.next());
            let flight = numbers.length();
            length += flight;
            place += flight * direction;
        }
        let reach = place.length();
        let scale = distance_m / reach;
        if !scale.is_finite() {
            return None;
        }
        let own = place / reach;
        let (t, s) = frame(own);
        let (right, up) = frame(axis);
        let (sin, cos) = circle(roll);
        let (t_turned, s_turned) = (cos * right + sin * up, cos * up - sin * right);
        let turned = |v: DVec3| v.dot(t) * t_turned + v.dot(s) * s_turned + v.dot(own) * axis;
        // The target's normal as the walk has it.
        let normal = self.view.normal;
        let back = normal.dot(t_turned) * t + normal.dot(s_turned) * s + normal.dot(axis) * own;
        let height_m = self.view.range_m(from, -normal)?;
        let free = |v: &DVec3| height_m + scale * back.dot(*v) > 0.0;
        self.vertices.iter().all(free).then(|| Bridge {
            start: turned(DVec3::Z),
            end: turned(direction),
            length_m: scale * length,
            distance_m,
            largest,
        })
    }
}
