//! Daylight and emitting surfaces: a camera walk that scores sun and sky along every segment.
//!
//! The sun is scored in closed form along each segment ([`super::sun_line`]), the sky in expectation where a
//! segment leads to the water surface. A segment that ends on a surface goes on twice, to the surface and in
//! the water before it; how many copies of each go on is decided by how much light they can still bring
//! ([`super::ambient_window`]). No path escapes through the surface, because what escapes has been scored.

use glam::DVec3;

use super::{
    ambient_flight::{draw_within, draw_within_water},
    ambient_window::{Window, light_ahead, light_on_surface},
    camera_ray::{CameraRay, End},
    score::{Scores, Source, Way},
    spectral::Spectral,
    sun_line::{Line, scattered_sunlight},
    unfold::flip,
};
use crate::{
    integrator::sampling::Draws,
    prepare::{Prepared, Primitive, Strategies, SurfacePoint},
};

/// A walk about to go along its direction.
#[derive(Clone, Copy, Debug)]
pub struct Walk {
    pub(crate) origin: DVec3,
    pub(crate) direction: DVec3,
    pub(crate) from: Primitive,
    pub(crate) in_air: bool,
    pub(crate) scattered: bool,
    pub(crate) met_surface: bool,
    /// Whether the next choices take the leading random numbers.
    pub(crate) leading: bool,
    pub(crate) events: usize,
    pub(crate) spectral: Spectral,
}

impl Walk {
    pub(super) fn way(&self) -> Way {
        Way::of(self.met_surface, self.scattered)
    }

    pub(super) fn go(&mut self, t: f64) {
        self.origin += t * self.direction;
    }

    /// Two random numbers for a direction.
    pub(super) fn direction_numbers(&self, draws: &mut Draws) -> (f64, f64) {
        if self.leading {
            (draws.leading(3), draws.leading(4))
        } else {
            (draws.uniform(), draws.uniform())
        }
    }
}

/// All walks of one sample: what they share, and those that still have to go on.
pub(super) struct Tracer<'a> {
    pub(super) scene: &'a Prepared,
    pub(super) strategies: Strategies,
    pub(super) max_events: usize,
    pub(super) draws: &'a mut Draws,
    pub(super) scores: &'a mut Scores,
    pub(super) pending: &'a mut Vec<Walk>,
    pub(super) window: Window,
}

/// Traces the walks of one sample from `ray` and adds ambient light to `scores`; returns the number of path
/// vertices made. `pending` is a buffer.
pub fn trace(
    scene: &Prepared,
    ray: &CameraRay,
    max_events: usize,
    draws: &mut Draws,
    pending: &mut Vec<Walk>,
    scores: &mut Scores,
) -> u64 {
    let strategies = scene
        .medium
        .as_ref()
        .map(|m| m.by_attenuation)
        .unwrap_or_default();
    pending.clear();
    let mut tracer = Tracer {
        scene,
        strategies,
        max_events,
        draws,
        scores,
        pending,
        window: Window::default(),
    };
    let walk = tracer.camera_walk(ray);
    if walk.in_air {
        tracer.air_segment(walk);
    } else {
        tracer.water_segment(walk, ray.end());
    }
    1 + tracer.run()
}

/// The end of the segment if nothing scattered on it.
fn full_segment(scene: &Prepared, walk: &Walk) -> End {
    let to_boundary = scene.distance_to_boundary(walk.origin, walk.direction);
    match scene
        .geometry
        .closest(walk.origin, walk.direction, to_boundary, walk.from)
    {
        Some(hit) => End::Surface(
            hit.t,
            scene.geometry.surface_point(&hit, walk.direction),
            hit.primitive,
        ),
        None if to_boundary < f64::INFINITY => End::Boundary(to_boundary),
        None => End::Nothing,
    }
}

impl Tracer<'_> {
    /// A walk about to go along `ray`.
    pub(super) fn camera_walk(&self, ray: &CameraRay) -> Walk {
        Walk {
            origin: ray.origin,
            direction: ray.direction,
            from: Primitive::None,
            in_air: self.scene.in_air(ray.origin),
            scattered: false,
            met_surface: false,
            leading: true,
            events: 0,
            spectral: Spectral::start(&self.strategies, self.draws.leading(6)),
        }
    }

    /// Follows the pending walks, and those that come of them, to their ends; returns the number of path vertices made.
    pub(super) fn run(&mut self) -> u64 {
        let mut vertices = 0;
        while let Some(walk) = self.pending.pop() {
            vertices += 1;
            if walk.in_air {
                self.air_segment(walk);
            } else {
                let end = full_segment(self.scene, &walk);
                self.water_segment(walk, end);
            }
        }
        vertices
    }

    pub(super) fn score(&mut self, walk: &Walk, way: Way, light: [f64; 3]) {
        let weight = walk.spectral.weight();
        self.scores.add(
            Source::Ambient,
            way,
            std::array::from_fn(|k| weight[k] * light[k]),
        );
    }

    /// One segment in the water (or in space without water): scores it and goes on from it.
    fn water_segment(&mut self, walk: Walk, end: End) {
        let scene = self.scene;
        let line = self.score_sunlight(&walk, end.distance().unwrap_or(f64::INFINITY));
        let sky = sky_at_end(scene, &end, walk.direction.z);
        self.score(&walk, walk.way(), sky);
        let may_scatter = scene.needs.scattering && walk.events < self.max_events;
        let volume = if may_scatter || !matches!(end, End::Surface(..)) {
            light_ahead(scene, &walk, &end, line)
        } else {
            [0.0; 3]
        };
        let surface = match &end {
            End::Surface(t, point, _) => light_on_surface(scene, &walk, *t, point),
            _ => [0.0; 3],
        };
        let weight = walk.spectral.weight();
        let expected = std::array::from_fn(|k| line[k] + sky[k] + volume[k] + surface[k]);
        self.window.set_reference(weight, expected);
        if let End::Surface(t, point, primitive) = end {
            self.go_to_surface(walk, t, &point, primitive, surface);
            if may_scatter {
                self.go_into_water(walk, t, volume);
            }
        } else {
            self.go_on(walk, end, volume);
        }
    }

    /// Sunlight scattered once on the segment; returns it.
    pub(super) fn score_sunlight(&mut self, walk: &Walk, length: f64) -> [f64; 3] {
        let Some(medium) = self.scene.medium.as_ref() else {
            return [0.0; 3];
        };
        if walk.events >= self.max_events {
            return [0.0; 3];
        }
        let line = Line {
            origin: walk.origin,
            direction: walk.direction,
            length,
        };
        let light = scattered_sunlight(self.scene, medium, &line, self.draws);
        self.score(walk, Way::of(walk.met_surface, true), light);
        light
    }

    /// Unscattered to the surface at `t`.
    fn go_to_surface(
        &mut self,
        mut walk: Walk,
        t: f64,
        point: &SurfacePoint,
        primitive: Primitive,
        light: [f64; 3],
    ) {
        let survival = self.window.survival(walk.spectral.weight(), light);
        if survival < 1.0 && self.draws.uniform() >= survival {
            return;
        }
        walk.spectral.scale_all(1.0 / survival);
        if let Some(medium) = &self.scene.medium {
            walk.spectral.pass_surely(medium, t);
        }
        walk.go(t);
        walk.from = primitive;
        self.meet_surface(walk, point);
    }

    /// Scattered before the surface at the end of the segment, at `length`.
    fn go_into_water(&mut self, walk: Walk, length: f64, light: [f64; 3]) {
        self.follow(walk, light, |tracer, strategies, u, mut copy| {
            let t = draw_within(tracer.scene, strategies, length, u, &mut copy);
            tracer.scatter(copy, t);
        });
    }

    /// On a segment that ends at the water surface or nowhere.
    fn go_on(&mut self, walk: Walk, end: End, light: [f64; 3]) {
        self.follow(
            walk,
            light,
            |tracer, strategies, u, mut copy| match draw_within_water(
                tracer.scene,
                strategies,
                &end,
                u,
                &mut copy,
            ) {
                End::Scatter(t) if copy.events < tracer.max_events => tracer.scatter(copy, t),
                End::Boundary(t) => {
                    copy.go(t);
                    tracer.leave_boundary(copy);
                }
                _ => {}
            },
        );
    }

    /// As many copies of the walk as `light` is worth, each sent on by `send` with a number for its flight.
    fn follow(
        &mut self,
        mut walk: Walk,
        light: [f64; 3],
        send: impl Fn(&mut Self, &Strategies, f64, Walk),
    ) {
        let copies = self.copies(&mut walk, light);
        let strategies = self
            .strategies
            .stretched(self.scene.stretch, walk.direction.z);
        for _ in 0..copies {
            let u = self.flight_number(&walk);
            send(self, &strategies, u, walk);
            walk.leading = false;
        }
    }

    fn flight_number(&mut self, walk: &Walk) -> f64 {
        if walk.leading {
            self.draws.leading(2)
        } else {
            self.draws.uniform()
        }
    }

    /// How many copies of the walk go on, each with its share of the weight.
    pub(super) fn copies(&mut self, walk: &mut Walk, light: [f64; 3]) -> usize {
        let weight = walk.spectral.weight();
        let (copies, factor) = self.window.copies(weight, light, walk.events, self.draws);
        walk.spectral.scale_all(factor);
        copies
    }

    /// At the underside of the water surface: reflected, or into the air where there is something to see.
    pub(super) fn leave_boundary(&mut self, mut walk: Walk) {
        let Some(boundary) = self.scene.boundary else {
            return;
        };
        walk.origin.z = boundary.height;
        walk.from = Primitive::None;
        walk.leading = false;
        let reflectance = boundary.internal_reflectance(walk.direction.z);
        let escapes_scored = !self.scene.needs.geometry_in_air;
        if escapes_scored || reflectance >= 1.0 || self.draws.uniform() < reflectance {
            walk.direction = flip(walk.direction);
            if reflectance > 0.0 {
                self.pending.push(walk);
            }
            return;
        }
        let Some(direction) = boundary.refract_into_air(walk.direction) else {
            return;
        };
        walk.direction = direction;
        walk.in_air = true;
        walk.spectral.scale_all(boundary.index * boundary.index);
        self.pending.push(walk);
    }

    /// One segment in the air above the water.
    fn air_segment(&mut self, mut walk: Walk) {
        let scene = self.scene;
        let Some(boundary) = scene.boundary else {
            return;
        };
        let down = -walk.direction.z;
        let to_water = if down > 0.0 {
            (walk.origin.z - boundary.height).max(0.0) / down
        } else {
            f64::INFINITY
        };
        let hit = scene
            .geometry
            .closest(walk.origin, walk.direction, to_water, walk.from);
        if let Some(hit) = hit {
            let point = scene.geometry.surface_point(&hit, walk.direction);
            walk.go(hit.t);
            walk.from = hit.primitive;
            walk.leading = false;
            self.meet_surface(walk, &point);
            return;
        }
        if down <= 0.0 {
            self.score(&walk, walk.way(), scene.sky);
            return;
        }
        walk.go(to_water);
        walk.origin.z = boundary.height;
        walk.from = Primitive::None;
        if self.draws.uniform() < boundary.external_reflectance(down) {
            walk.direction = flip(walk.direction);
        } else {
            walk.direction = boundary.refract_into_water(walk.direction);
            walk.in_air = false;
            let index2 = boundary.index * boundary.index;
            walk.spectral.scale_all(1.0 / index2);
        }
        self.pending.push(walk);
    }
}

/// The sky at the end of the segment, attenuated along it. Where something stands in the air, what leaves
/// through the surface is followed instead.
pub(super) fn sky_at_end(scene: &Prepared, end: &End, up: f64) -> [f64; 3] {
    let through = |t: f64, factor: f64| {
        let transmittance = scene
            .medium
            .as_ref()
            .map_or([1.0; 3], |m| m.transmittance(t));
        std::array::from_fn(|k| scene.sky[k] * transmittance[k] * factor)
    };
    match (end, &scene.boundary) {
        (End::Boundary(t), Some(boundary)) if !scene.needs.geometry_in_air => {
            let reflectance = boundary.internal_reflectance(up);
            through(*t, (1.0 - reflectance) * boundary.index * boundary.index)
        }
        (End::Nothing, None) => through(f64::INFINITY, 1.0),
        _ => [0.0; 3],
    }
}
