//! Joining a vertex to a lamp or to its mirror image in the water surface.

use glam::DVec3;

use super::{
    bridge::Bridge,
    lamp_walk::Walk,
    order::{MAX_ORDER, OrderLaw},
    score::{Scores, Source, Way},
    spectral::Spectral,
    unfold::{flip, segment_factor},
    veil::Vertex,
};
use crate::{
    integrator::sampling::Draws,
    prepare::{Medium, Prepared, PreparedLamp, Primitive},
};

/// A lamp as paths are joined to it: itself or its mirror image in the water surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) lamp: usize,
    pub(super) mirrored: bool,
    /// Reciprocal of the probability of having chosen between lamp and image.
    pub(super) weight: f64,
}

/// Buffers and tables of one worker.
#[derive(Clone, Debug)]
pub struct LampWorkspace {
    pub(super) law: OrderLaw,
    pub(super) bridge: Bridge,
    pub(super) walk: Vec<Vertex>,
    pub(super) crossings: Vec<f64>,
    pub(super) targets: Vec<Target>,
    /// Number of path vertices made so far, for the statistics.
    pub vertices: u64,
}

impl LampWorkspace {
    /// Buffers for walks in `medium`.
    pub(super) fn new(medium: Option<&Medium>) -> Self {
        let albedo = medium.map_or(0.0, Medium::largest_albedo);
        Self {
            law: OrderLaw::new(albedo),
            bridge: Bridge::default(),
            walk: Vec::new(),
            crossings: Vec::new(),
            targets: Vec::new(),
            vertices: 0,
        }
    }
}

/// Chooses lamp or mirror image for each active lamp, once per walk.
pub(super) fn choose_targets(
    scene: &Prepared,
    active: &[usize],
    draws: &mut Draws,
    targets: &mut Vec<Target>,
) {
    targets.clear();
    for &lamp in active {
        let share = mirror_share(scene, &scene.lamps[lamp]);
        let mirrored = share > 0.0 && draws.uniform() < share;
        let weight = if mirrored {
            1.0 / share
        } else {
            1.0 / (1.0 - share)
        };
        targets.push(Target {
            lamp,
            mirrored,
            weight,
        });
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

/// Draws a lamp point and a bridge to it; `None` when the path would have too many events or cannot be made.
pub(super) fn draw_bridge(
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
    let real = if lamp.radius == 0.0 {
        lamp.position
    } else {
        lamp.sample_point(draws.uniform(), draws.uniform())
    };
    let end = if target.mirrored {
        scene.mirror(real)
    } else {
        real
    };
    let Some(medium) = scene.medium.as_ref().filter(|m| m.scatters()) else {
        return straight(position, end, &mut work.bridge).then_some(end);
    };
    let sigma = medium.by_scattering.sigma[walk.spectral.chosen];
    let order = work.law.sample(sigma * position.distance(end), u)?;
    if order > MAX_ORDER || walk.events + order > max_events {
        return None;
    }
    work.vertices += order as u64;
    work.bridge
        .draw(position, end, order, &medium.phase, medium.c_min, draws)
        .then_some(end)
}

/// The bridge without scattering.
pub(super) fn straight(start: DVec3, end: DVec3, bridge: &mut Bridge) -> bool {
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
pub(super) fn emitted(scene: &Prepared, target: Target, bridge: &Bridge) -> f64 {
    let emission = if target.mirrored {
        flip(bridge.emission)
    } else {
        bridge.emission
    };
    scene.lamps[target.lamp].relative_intensity(emission)
}

/// Area of the target as the bridge's last segment sees it, where a walk can meet it by chance: 0 for points and
/// across the water surface.
pub(super) fn facing_area(
    scene: &Prepared,
    target: Target,
    start: DVec3,
    end: DVec3,
    bridge: &Bridge,
) -> f64 {
    let lamp = &scene.lamps[target.lamp];
    let last = bridge.vertices.last().copied().unwrap_or(start);
    if lamp.radius == 0.0 || !scene.same_side(last, end) {
        return 0.0;
    }
    let emission = if target.mirrored {
        flip(bridge.emission)
    } else {
        bridge.emission
    };
    lamp.facing_area(emission)
}

/// Walks along the bridge; false where it is blocked. Fills the reflectances met per segment.
pub(super) fn cross(
    scene: &Prepared,
    start: DVec3,
    end: DVec3,
    from: Primitive,
    work: &mut LampWorkspace,
) -> bool {
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

/// Integrand over density of a bridge from a surface vertex, per channel and unit intensity:
/// value · (b s)^k/k! · e^(−cs) · s/D³ over the mean of density_j · (q_j(k | D) + `chance`), where `chance` is the
/// density with which the walk itself meets the lamp point straight from the surface (k = 0), times the lamp's area.
pub(super) fn surface_contribution(
    scene: &Prepared,
    spectral: &Spectral,
    chance: f64,
    work: &LampWorkspace,
) -> [f64; 3] {
    let bridge = &work.bridge;
    let (k, s, d) = (bridge.order, bridge.length, bridge.distance);
    let Some(medium) = &scene.medium else {
        return spectral.weight().map(|w| w / (d * d * (1.0 + chance)));
    };
    let geometry = s / (d * d * d);
    if !medium.scatters() {
        let transmittance = medium.transmittance(s);
        let weight = spectral.weight();
        let share = geometry / (1.0 + chance);
        return std::array::from_fn(|i| weight[i] * transmittance[i] * share);
    }
    let strategies = &medium.by_scattering;
    let ln_distance = d.ln();
    // In logarithms: k! and e^(−cs) leave the range of a float where their quotient does not.
    let ln_densities: [f64; 3] = std::array::from_fn(|j| {
        if j >= spectral.count {
            return f64::NEG_INFINITY;
        }
        let (poisson, tail) = work.law.ln_parts(
            k,
            strategies.sigma[j] * d,
            strategies.ln_sigma[j] + ln_distance,
        );
        let larger = poisson.max(tail);
        spectral.density[j].ln() + larger + ((poisson.min(tail) - larger).exp()).ln_1p()
    });
    let largest = ln_densities
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    let mut sum: f64 = ln_densities.iter().map(|l| (l - largest).exp()).sum();
    if chance > 0.0 {
        sum += chance
            * (0..spectral.count)
                .map(|j| spectral.density[j])
                .sum::<f64>()
            * (-largest).exp();
    }
    let scale = geometry * spectral.count as f64 / sum;
    let steps = k as f64;
    let ln_length = s.ln();
    std::array::from_fn(|i| {
        if spectral.value[i] == 0.0 {
            return 0.0;
        }
        let ln_scatterings = if k == 0 {
            0.0
        } else {
            steps * (medium.ln_b[i] + ln_length)
        };
        spectral.value[i] * scale * (ln_scatterings - medium.c[i] * s - largest).exp()
    })
}

pub(super) fn add(
    scene: &Prepared,
    target: Target,
    way: Way,
    factor: f64,
    radiance: [f64; 3],
    scores: &mut Scores,
) {
    let intensity = scene.lamps[target.lamp].intensity;
    let light = std::array::from_fn(|k| factor * intensity[k] * radiance[k]);
    scores.add(Source::Lamp(target.lamp), way, light);
}
