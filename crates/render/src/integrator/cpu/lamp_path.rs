//! Light of the lamps: a camera walk whose vertices are joined to the lamps by bridges.
//!
//! The last surface vertex before the lamp decides who counts a path: every surface hit of the walk makes a
//! bridge; volume vertices do so only before the first surface hit (the veil).

use glam::DVec3;

use super::{
    LATE_SURVIVAL, SURE_EVENTS,
    bridge::Bridge,
    camera_ray::{CameraRay, End},
    order::{MAX_ORDER, OrderLaw},
    score::{Scores, Source, Way},
    spectral::Spectral,
    unfold::{flip, segment_factor},
    veil::{self, Vertex},
};
use crate::{
    integrator::sampling::{
        Draws,
        directions::{cosine_hemisphere, turn},
    },
    prepare::{Medium, Prepared, PreparedLamp, Primitive, SurfacePoint},
};

/// Volume vertices before which a walk that has met no surface is never ended by roulette.
const SURE_VERTICES: usize = 12;

/// How the first segment of a walk ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FirstSegment {
    /// As the free flight falls.
    Free,
    /// Unscattered at the end of the camera ray, for certain.
    Through,
    /// In a scattering before the end of the camera ray, for certain.
    Scattered,
}

/// A lamp as paths are joined to it: itself or its mirror image in the water surface.
#[derive(Clone, Copy, Debug)]
struct Target {
    lamp: usize,
    mirrored: bool,
    /// Reciprocal of the probability of having chosen between lamp and image.
    weight: f64,
}

/// Buffers and tables of one worker.
#[derive(Clone, Debug, Default)]
pub struct LampWorkspace {
    law: OrderLaw,
    bridge: Bridge,
    walk: Vec<Vertex>,
    crossings: Vec<f64>,
    targets: Vec<Target>,
    /// Number of path vertices made so far, for the statistics.
    pub vertices: u64,
}

/// The state of a walk, in real space; `mirrored` tells whether it has reflected an odd number of times.
struct Walk {
    origin: DVec3,
    direction: DVec3,
    from: Primitive,
    mirrored: bool,
    /// Length since the water was entered, m.
    length: f64,
    /// Product of the surface reflectances met so far.
    reflected: f64,
    scatterings: usize,
    events: usize,
    met_surface: bool,
    spectral: Spectral,
}

/// Traces one walk from `ray` and adds the light of the lamps in `active` to `scores`. `max_events` limits
/// scatterings and reflections.
pub fn trace(
    scene: &Prepared,
    active: &[usize],
    ray: &CameraRay,
    first: FirstSegment,
    max_events: usize,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    let Some(start) = ray.in_water else { return };
    let strategies = scene.medium.as_ref().map(|m| m.by_scattering).unwrap_or_else(no_strategies);
    let mut spectral = Spectral::start(&strategies, draws.uniform());
    spectral.scale_all(ray.entry_factor);
    let mut walk = Walk {
        origin: start.origin,
        direction: start.direction,
        from: Primitive::None,
        mirrored: false,
        length: 0.0,
        reflected: 1.0,
        scatterings: 0,
        events: 0,
        met_surface: false,
        spectral,
    };
    work.walk.clear();
    choose_targets(scene, active, draws, &mut work.targets);
    let mut segment = Some(first);
    while walk.events < max_events {
        let end = match segment.take() {
            Some(kind) => first_end(scene, ray, kind, &mut walk, draws),
            None => next_end(scene, &mut walk, draws.uniform()),
        };
        work.vertices += 1;
        let alive = match end {
            End::Scatter(t) => scatter(scene, t, max_events, &mut walk, draws, work, scores),
            End::Surface(t, point, primitive) => {
                walk.origin += t * walk.direction;
                walk.from = primitive;
                meet_surface(scene, &point, max_events, &mut walk, draws, work, scores)
            }
            End::Boundary(t) => reflect_at_boundary(scene, t, &mut walk, draws),
            End::Nothing => false,
        };
        if !alive || !survives(scene, active, &mut walk, draws) {
            return;
        }
    }
}

fn no_strategies() -> crate::prepare::Strategies {
    crate::prepare::Strategies::new([0.0; 3], [false; 3])
}

/// Chooses lamp or mirror image for each active lamp, once per walk.
fn choose_targets(scene: &Prepared, active: &[usize], draws: &mut Draws, targets: &mut Vec<Target>) {
    targets.clear();
    for &lamp in active {
        let share = mirror_share(scene, &scene.lamps[lamp]);
        let mirrored = share > 0.0 && draws.uniform() < share;
        let weight = if mirrored { 1.0 / share } else { 1.0 / (1.0 - share) };
        targets.push(Target { lamp, mirrored, weight });
    }
}

/// Probability of aiming at the mirror image: smaller the deeper the lamp.
fn mirror_share(scene: &Prepared, lamp: &PreparedLamp) -> f64 {
    match scene.boundary {
        Some(b) if b.index != 1.0 => {
            let detour = 2.0 * (b.height - lamp.position.z);
            let c = scene.medium.as_ref().map_or(0.0, |m| m.c_min);
            (0.5 * (-c * detour).exp()).clamp(0.1, 0.5)
        }
        _ => 0.0,
    }
}

/// The end of the camera ray's first segment in water and its effect on the weights.
fn first_end(scene: &Prepared, ray: &CameraRay, kind: FirstSegment, walk: &mut Walk, draws: &mut Draws) -> End {
    let (Some(medium), Some(start)) = (&scene.medium, ray.in_water) else {
        return ray.end();
    };
    let strategies = &medium.by_scattering;
    match kind {
        FirstSegment::Through => {
            walk.spectral.pass_surely(medium, start.length);
            walk.length += start.length;
            ray.end()
        }
        FirstSegment::Free => {
            let t = flight(scene, walk, draws.leading(2));
            if t < start.length {
                return End::Scatter(t);
            }
            walk.spectral.pass(medium, strategies, start.length);
            walk.length += start.length;
            ray.end()
        }
        FirstSegment::Scattered => {
            let within = strategies.sigma.map(|s| -(-s * start.length).exp_m1());
            let sigma = strategies.sigma[walk.spectral.chosen];
            let t = -(-draws.leading(2) * within[walk.spectral.chosen]).ln_1p() / sigma;
            for j in 0..walk.spectral.count {
                walk.spectral.density[j] /= within[j].max(f64::MIN_POSITIVE);
            }
            End::Scatter(t.min(start.length))
        }
    }
}

/// Length of a free flight drawn with the walk's strategy from `u`; infinite without scattering.
#[inline]
fn flight(scene: &Prepared, walk: &Walk, u: f64) -> f64 {
    match &scene.medium {
        Some(m) if m.scatters() => -u.ln() / m.by_scattering.sigma[walk.spectral.chosen],
        _ => f64::INFINITY,
    }
}

/// Draws a free flight and finds what ends the segment; passes the weights where nothing scattered.
fn next_end(scene: &Prepared, walk: &mut Walk, u: f64) -> End {
    let t = flight(scene, walk, u);
    let to_boundary = scene.distance_to_boundary(walk.origin, walk.direction);
    let end = match scene.geometry.closest(walk.origin, walk.direction, t.min(to_boundary), walk.from) {
        Some(hit) => End::Surface(hit.t, scene.geometry.surface_point(&hit, walk.direction), hit.primitive),
        None if t < to_boundary => return End::Scatter(t),
        None if to_boundary < f64::INFINITY => End::Boundary(to_boundary),
        None => End::Nothing,
    };
    if let (Some(medium), Some(t)) = (&scene.medium, end.distance()) {
        walk.spectral.pass(medium, &medium.by_scattering, t);
        walk.length += t;
    }
    end
}

impl Walk {
    /// A real point or direction in the unfolded space of the walk.
    fn unfolded(&self, scene: &Prepared, point: DVec3) -> DVec3 {
        if self.mirrored { scene.mirror(point) } else { point }
    }

    fn unfolded_direction(&self, direction: DVec3) -> DVec3 {
        if self.mirrored { flip(direction) } else { direction }
    }
}

/// A scattering after `t`: bridges if no surface was met, then a new direction.
fn scatter(
    scene: &Prepared,
    t: f64,
    max_events: usize,
    walk: &mut Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) -> bool {
    let Some(medium) = &scene.medium else { return false };
    walk.origin += t * walk.direction;
    walk.from = Primitive::None;
    walk.length += t;
    walk.scatterings += 1;
    walk.events += 1;
    walk.spectral.scatter(medium, &medium.by_scattering, t);
    let leading = walk.scatterings == 1 && walk.events == 1;
    if !walk.met_surface {
        work.walk.push(Vertex {
            position: walk.unfolded(scene, walk.origin),
            length: walk.length,
            phase: 0.0,
            reflected: walk.reflected,
        });
        join_volume_vertex(scene, medium, max_events, leading, walk, draws, work, scores);
    }
    let (u, v) = if leading { (draws.leading(3), draws.leading(4)) } else { (draws.uniform(), draws.uniform()) };
    let x = medium.phase.sample_x(u);
    if let (false, Some(last)) = (walk.met_surface, work.walk.last_mut()) {
        last.phase = medium.phase.value(x);
    }
    walk.direction = turn(walk.direction, x, v);
    true
}

/// Bridges from the last volume vertex to every target.
fn join_volume_vertex(
    scene: &Prepared,
    medium: &Medium,
    max_events: usize,
    leading: bool,
    walk: &Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) {
    let position = walk.unfolded(scene, walk.origin);
    let direction = walk.unfolded_direction(walk.direction);
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        let u = if leading && i == 0 { draws.leading(5) } else { draws.uniform() };
        let Some(lamp_point) = draw_bridge(scene, position, target, walk, max_events, u, draws, work) else {
            continue;
        };
        let intensity = emitted(scene, target, &work.bridge);
        if intensity == 0.0 || !cross(scene, position, lamp_point, walk.from, work) {
            continue;
        }
        let veil = veil::contribution(
            medium,
            &work.law,
            &walk.spectral,
            &work.walk,
            direction,
            &work.bridge,
            lamp_point,
            &work.crossings,
        );
        add(scene, target, Way::Backscatter, intensity * target.weight, veil, scores);
    }
}

/// A surface: bridges to every target, then a new direction.
fn meet_surface(
    scene: &Prepared,
    point: &SurfacePoint,
    max_events: usize,
    walk: &mut Walk,
    draws: &mut Draws,
    work: &mut LampWorkspace,
    scores: &mut Scores,
) -> bool {
    let leading = walk.events == 0;
    walk.events += 1;
    walk.met_surface = true;
    walk.spectral.scale(point.reflectance);
    if walk.spectral.value == [0.0; 3] {
        return false;
    }
    let position = walk.unfolded(scene, walk.origin);
    for i in 0..work.targets.len() {
        let target = work.targets[i];
        let u = if leading && i == 0 { draws.leading(5) } else { draws.uniform() };
        let Some(lamp_point) = draw_bridge(scene, position, target, walk, max_events, u, draws, work) else {
            continue;
        };
        let first = walk.unfolded_direction(work.bridge.first);
        let cosine = point.shading_normal.dot(first);
        if cosine <= 0.0 || point.normal.dot(first) <= 0.0 {
            continue;
        }
        let intensity = emitted(scene, target, &work.bridge);
        if intensity == 0.0 || !cross(scene, position, lamp_point, walk.from, work) {
            continue;
        }
        let reflected: f64 = work.crossings.iter().product();
        let factor = intensity * target.weight * reflected * cosine / std::f64::consts::PI;
        let radiance = surface_contribution(scene, &walk.spectral, work);
        let way = Way::of(true, walk.scatterings + work.bridge.order > 0);
        add(scene, target, way, factor, radiance, scores);
    }
    let (u, v) = if leading { (draws.leading(3), draws.leading(4)) } else { (draws.uniform(), draws.uniform()) };
    walk.direction = cosine_hemisphere(point.shading_normal, u, v);
    walk.direction.dot(point.normal) > 0.0
}

/// Integrand over density of a bridge from a surface vertex, per channel and unit intensity:
/// value · (b s)^k/k! · e^(−cs) · s/D³ over the mean of density_j · q_j(k | D).
fn surface_contribution(scene: &Prepared, spectral: &Spectral, work: &LampWorkspace) -> [f64; 3] {
    let bridge = &work.bridge;
    let (k, s, d) = (bridge.order, bridge.length, bridge.distance);
    let Some(medium) = &scene.medium else {
        return spectral.weight().map(|w| w / (d * d));
    };
    let geometry = s / (d * d * d);
    if !medium.scatters() {
        let transmittance = medium.transmittance(s);
        let weight = spectral.weight();
        return std::array::from_fn(|i| weight[i] * transmittance[i] * geometry);
    }
    let strategies = &medium.by_scattering;
    let ln_distance = d.ln();
    let mut density = 0.0;
    for j in 0..spectral.count {
        let (poisson, tail) =
            work.law.ln_parts(k, strategies.sigma[j] * d, strategies.ln_sigma[j] + ln_distance);
        density += spectral.density[j] * (poisson.exp() + tail.exp());
    }
    let scale = geometry * spectral.count as f64 / density;
    let steps = k as f64;
    let ln_length = s.ln();
    std::array::from_fn(|i| {
        if spectral.value[i] == 0.0 {
            return 0.0;
        }
        let ln_scatterings = if k == 0 { 0.0 } else { steps * (medium.ln_b[i] + ln_length) };
        spectral.value[i] * scale * (ln_scatterings - medium.c[i] * s).exp()
    })
}

/// Draws a lamp point and a bridge to it; `None` when the path would have too many events or cannot be made.
fn draw_bridge(
    scene: &Prepared,
    position: DVec3,
    target: Target,
    walk: &Walk,
    max_events: usize,
    u: f64,
    draws: &mut Draws,
    work: &mut LampWorkspace,
) -> Option<DVec3> {
    let lamp = &scene.lamps[target.lamp];
    let real = if lamp.radius == 0.0 { lamp.position } else { lamp.sample_point(draws.uniform(), draws.uniform()) };
    let end = if target.mirrored { scene.mirror(real) } else { real };
    let Some(medium) = scene.medium.as_ref().filter(|m| m.scatters()) else {
        return straight(position, end, &mut work.bridge).then_some(end);
    };
    let sigma = medium.by_scattering.sigma[walk.spectral.chosen];
    let order = OrderLaw::sample(sigma * position.distance(end), u)?;
    if order > MAX_ORDER || walk.events + order > max_events {
        return None;
    }
    work.vertices += order as u64;
    work.bridge.draw(position, end, order, &medium.phase, medium.c_min, draws).then_some(end)
}

/// The bridge without scattering.
fn straight(start: DVec3, end: DVec3, bridge: &mut Bridge) -> bool {
    let distance = start.distance(end);
    if !(distance > 0.0) {
        return false;
    }
    bridge.order = 0;
    bridge.distance = distance;
    bridge.length = distance;
    bridge.first = (end - start) / distance;
    bridge.emission = -bridge.first;
    bridge.vertices.clear();
    bridge.lengths.clear();
    bridge.lengths.push(distance);
    bridge.sin2.clear();
    true
}

/// Relative intensity with which the target sends light along the bridge.
fn emitted(scene: &Prepared, target: Target, bridge: &Bridge) -> f64 {
    let emission = if target.mirrored { flip(bridge.emission) } else { bridge.emission };
    scene.lamps[target.lamp].relative_intensity(emission)
}

/// Walks along the bridge; false where it is blocked. Fills the reflectances met per segment.
fn cross(scene: &Prepared, start: DVec3, end: DVec3, from: Primitive, work: &mut LampWorkspace) -> bool {
    work.crossings.clear();
    let mut previous = start;
    let mut primitive = from;
    for i in 0..=work.bridge.order {
        let next = work.bridge.vertices.get(i).copied().unwrap_or(end);
        let factor = segment_factor(scene, previous, next, primitive);
        if factor == 0.0 {
            return false;
        }
        work.crossings.push(factor);
        previous = next;
        primitive = Primitive::None;
    }
    true
}

fn add(scene: &Prepared, target: Target, way: Way, factor: f64, radiance: [f64; 3], scores: &mut Scores) {
    let intensity = scene.lamps[target.lamp].intensity;
    let light = std::array::from_fn(|k| factor * intensity[k] * radiance[k]);
    scores.add(Source::Lamp(target.lamp), way, light);
}

/// The underside of the water surface: reflected with its reflectance as the probability.
fn reflect_at_boundary(scene: &Prepared, t: f64, walk: &mut Walk, draws: &mut Draws) -> bool {
    let Some(boundary) = scene.boundary else { return false };
    let reflectance = boundary.internal_reflectance(walk.direction.z);
    // Lamp light does not come back from the air, so what is transmitted ends here.
    if reflectance < 1.0 && draws.uniform() >= reflectance {
        return false;
    }
    walk.origin += t * walk.direction;
    walk.origin.z = boundary.height;
    walk.direction = flip(walk.direction);
    walk.from = Primitive::None;
    walk.mirrored = !walk.mirrored;
    walk.reflected *= reflectance;
    true
}

/// Russian roulette by what the walk can still bring: after a surface or many scatterings.
fn survives(scene: &Prepared, active: &[usize], walk: &mut Walk, draws: &mut Draws) -> bool {
    if !walk.met_surface && walk.scatterings <= SURE_VERTICES {
        return true;
    }
    let nearest2 = active
        .iter()
        .map(|&i| scene.lamps[i].position.distance_squared(walk.origin))
        .fold(f64::INFINITY, f64::min);
    let c_min = scene.medium.as_ref().map_or(0.0, |m| m.c_min);
    let reach = if walk.met_surface { 1.0 } else { 3.0 };
    let importance = reach * walk.spectral.largest_weight() * (-0.5 * c_min * nearest2.sqrt()).exp() / (1.0 + nearest2);
    let patience = if walk.events > SURE_EVENTS { LATE_SURVIVAL } else { 1.0 };
    let survival = importance.min(patience);
    if survival >= 1.0 {
        return true;
    }
    if !(survival > 0.0) || draws.uniform() >= survival {
        return false;
    }
    walk.spectral.scale_all(1.0 / survival);
    true
}
