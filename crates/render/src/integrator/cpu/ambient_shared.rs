//! Daylight walks shared by neighbouring pixels of a row.
//!
//! In water that holds nothing else the light depends on depth and direction only. A walk that was sent on from its
//! first scattering, at a depth z into a direction d', is then as good for every pixel whose ray passes that depth: moved
//! sideways it starts on that ray. So the pixels of a group are techniques that sample the same space of (z, d'), and
//! each walk is worth to pixel i
//!
//!   b e^(−c s_i) p(d_i·d') |dz/ds_i|⁻¹ / Σ_l q_l(z, d'),
//!
//! s_i being where ray i passes z and q_l the density with which pixel l would have drawn the walk: the balance
//! heuristic over pixels (path reuse, Bekaert et al. 2002), and over the strategies of [`super::spectral`] within it.
//! Expectations are exact; the noise of the pixels of a group is no longer independent.

use super::{
    ambient_flight::{Turn, draw_within_water, staying_shares},
    ambient_path::{Tracer, Walk, sky_at_end},
    ambient_window::{Window, light_ahead},
    camera_ray::{CameraRay, End},
    score::Scores,
};
use crate::{
    integrator::sampling::{Draws, directions::sin2_half},
    prepare::{Medium, Prepared, Strategies},
};

/// One pixel's ray into the water, with the numbers that its walks use.
pub(super) struct View {
    pub(super) ray: CameraRay,
    pub(super) draws: Draws,
    /// Index of the pixel's scores.
    pub(super) column: usize,
    /// Factor of what the ray sees.
    pub(super) factor: f64,
}

/// A view after its first segment has been scored.
struct Scored {
    strategies: Strategies,
    /// Expected number of flights drawn.
    flights: f64,
    /// Probability of staying in the water, per strategy: flights are drawn among those that stay.
    staying: [f64; 3],
    length: f64,
    window: Window,
    /// The walk where it scatters first, and the length of its flight.
    flight: Option<(Walk, f64)>,
}

/// What a flight to the depth of another would be: integrand per channel and density per strategy, without their
/// phase functions, both per metre of the other's flight.
#[derive(Clone, Copy, Default)]
struct Flight {
    value: [f64; 3],
    density: [f64; 3],
}

/// Buffers of a worker.
#[derive(Default)]
pub(super) struct SharedWalks {
    scored: Vec<Scored>,
    flights: Vec<Flight>,
    parts: Vec<[f64; 3]>,
    pending: Vec<Walk>,
    found: Scores,
}

/// Whether pixels of `scene` can share their walks: daylight in water that holds nothing, seen from within.
pub(super) fn can_share(scene: &Prepared) -> bool {
    let needs = &scene.needs;
    (needs.sun || needs.sky)
        && needs.scattering
        && needs.boundary
        && !needs.geometry
        && !scene.in_air(scene.camera.position_m)
}

impl SharedWalks {
    /// Traces the walks of `views` in groups of at most `group`, the first one of `first`, and adds ambient light to
    /// `scores`; returns the number of path vertices made.
    pub(super) fn trace(
        &mut self,
        scene: &Prepared,
        max_events: usize,
        views: &mut [View],
        (first, group): (usize, usize),
        scores: &mut [Scores],
    ) -> u64 {
        let Some(medium) = &scene.medium else {
            return 0;
        };
        self.scored.clear();
        let mut vertices = 0;
        for view in views.iter_mut() {
            vertices += self.first_segment(scene, medium, max_events, view, scores);
        }
        let mut start = 0;
        while start < views.len() {
            let end = (start + if start == 0 { first } else { group }).min(views.len());
            for at in start..end {
                if let Some((walk, t)) = self.scored[at].flight.take() {
                    let flight = Shared {
                        scene,
                        medium,
                        max_events,
                        own: at - start,
                        start,
                    };
                    vertices += self.scatter(&flight, walk, t, &mut views[start..end], scores);
                }
            }
            start = end;
        }
        vertices
    }

    /// Scores the view's own segment and draws the flight to its first scattering. What is reflected at the water
    /// surface before that is the pixel's own and followed at once.
    fn first_segment(
        &mut self,
        scene: &Prepared,
        medium: &Medium,
        max_events: usize,
        view: &mut View,
        scores: &mut [Scores],
    ) -> u64 {
        let mut tracer = Tracer {
            scene,
            strategies: medium.by_attenuation,
            max_events,
            draws: &mut view.draws,
            scores: &mut scores[view.column],
            pending: &mut self.pending,
            window: Window::default(),
        };
        let walk = tracer.camera_walk(&view.ray);
        let end = view.ray.end();
        let length = end.distance().unwrap_or(f64::INFINITY);
        let line = tracer.score_sunlight(&walk, length);
        let sky = sky_at_end(scene, &end, walk.direction.z);
        tracer.score(&walk, walk.way(), sky);
        let volume = if max_events > 0 {
            light_ahead(scene, &walk, &end, line)
        } else {
            [0.0; 3]
        };
        let weight = walk.spectral.weight();
        let expected = std::array::from_fn(|k| line[k] + sky[k] + volume[k]);
        tracer.window.set_reference(weight, expected);
        let flights = tracer.window.survival(weight, volume);
        let strategies = medium
            .by_attenuation
            .stretched(scene.stretch, walk.direction.z);
        let mut scored = Scored {
            strategies,
            flights,
            staying: staying_shares(scene, &strategies, &end, walk.direction.z),
            length,
            window: tracer.window,
            flight: None,
        };
        let mut vertices = 1;
        if flights >= 1.0 || tracer.draws.uniform() < flights {
            let mut copy = walk;
            let u = tracer.draws.leading(2);
            match draw_within_water(scene, &strategies, &end, u, &mut copy) {
                End::Scatter(t) => scored.flight = Some((walk, t)),
                End::Boundary(t) => {
                    copy.spectral.scale_all(1.0 / flights);
                    copy.go(t);
                    tracer.leave_boundary(copy);
                    vertices += tracer.run();
                }
                End::Surface(..) | End::Nothing => {}
            }
        }
        self.scored.push(scored);
        vertices
    }

    /// Scatters `walk` after `t`, follows it along each new direction and divides what it finds among `views`.
    fn scatter(
        &mut self,
        shared: &Shared,
        mut walk: Walk,
        t: f64,
        views: &mut [View],
        scores: &mut [Scores],
    ) -> u64 {
        let scored = &self.scored[shared.start..shared.start + views.len()];
        self.flights.clear();
        self.flights.extend(
            (views.iter().zip(scored).enumerate())
                .map(|(i, (view, scored))| shared.flight(&walk, t, (i, view, scored))),
        );
        let window = scored[shared.own].window;
        let mut vertices = 0;
        let mut tracer = shared.tracer(
            &mut views[shared.own].draws,
            &mut self.found,
            &mut self.pending,
            window,
        );
        let (u, v) = tracer.arrive(&mut walk, t);
        let turns = tracer.first_turns(&walk, u, v);
        for turned in turns.into_iter().flatten() {
            let Some((value, sent)) = self.send(shared, walk, &turned, views) else {
                continue;
            };
            self.found.clear();
            let mut tracer = shared.tracer(
                &mut views[shared.own].draws,
                &mut self.found,
                &mut self.pending,
                window,
            );
            tracer.pending.push(sent);
            vertices += tracer.run();
            let found = &self.found;
            for (part, view) in self.parts.iter().zip(views.iter()) {
                let share = std::array::from_fn(|k| part[k] / value[k].max(f64::MIN_POSITIVE));
                scores[view.column].add_share(found, share);
            }
        }
        vertices
    }

    /// The walk that goes on along `turned` with what it is worth to all views together, which is returned beside it;
    /// `self.parts` holds what it is worth to each.
    fn send(
        &mut self,
        shared: &Shared,
        mut walk: Walk,
        turned: &Turn,
        views: &[View],
    ) -> Option<([f64; 3], Walk)> {
        let phase = |x: f64| shared.medium.phase.value(x);
        let other = turned.other_density(shared.scene, shared.medium);
        let (mut value, mut density) = ([0.0; 3], [0.0; 3]);
        self.parts.clear();
        for (i, (view, flight)) in views.iter().zip(&self.flights).enumerate() {
            let own = turned.from_old.filter(|_| i == shared.own);
            let p = phase(own.unwrap_or_else(|| sin2_half(view.ray.direction, turned.direction)));
            let part = flight.value.map(|f| f * p);
            for k in 0..3 {
                value[k] += part[k];
                density[k] += flight.density[k] * (p + other);
            }
            self.parts.push(part);
        }
        let largest = density[0].max(density[1]).max(density[2]);
        if !(largest > 0.0) {
            return None;
        }
        walk.direction = turned.direction;
        walk.spectral.value = value.map(|x| x / largest);
        walk.spectral.density = density.map(|x| x / largest);
        Some((value, walk))
    }
}

/// What the walks of one view of a group have in common.
struct Shared<'a> {
    scene: &'a Prepared,
    medium: &'a Medium,
    max_events: usize,
    /// Index of the group's first view.
    start: usize,
    /// Index in the group of the view that drew the walk.
    own: usize,
}

impl<'a> Shared<'a> {
    fn tracer<'b>(
        &self,
        draws: &'b mut Draws,
        scores: &'b mut Scores,
        pending: &'b mut Vec<Walk>,
        window: Window,
    ) -> Tracer<'b>
    where
        'a: 'b,
    {
        Tracer {
            scene: self.scene,
            strategies: self.medium.by_attenuation,
            max_events: self.max_events,
            draws,
            scores,
            pending,
            window,
        }
    }

    /// View `i`'s flight to the depth that `walk` reaches after `t`.
    fn flight(&self, walk: &Walk, t: f64, (i, view, scored): (usize, &View, &Scored)) -> Flight {
        // All rays start at the camera; a level one stays at its depth and meets no other.
        let ratio = if i == self.own {
            1.0
        } else {
            walk.direction.z / view.ray.direction.z
        };
        let s = t * ratio;
        if !(s > 0.0 && s < scored.length.min(f64::MAX)) {
            return Flight::default();
        }
        let mut flight = Flight::default();
        for k in 0..3 {
            let passed = (-self.medium.c[k] * s).exp();
            flight.value[k] = self.medium.b[k] * passed * ratio;
            if k < scored.strategies.count {
                let sigma = scored.strategies.sigma[k];
                let drawn = if sigma == self.medium.c[k] {
                    passed
                } else {
                    (-sigma * s).exp()
                };
                flight.density[k] = scored.flights * sigma * drawn * ratio / scored.staying[k];
            }
        }
        flight
    }
}
