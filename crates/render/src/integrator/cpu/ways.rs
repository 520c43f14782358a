//! The ways in which one path to a lamp can be made, combined by the balance heuristic.
//!
//! A path from the camera (or from a surface) through n volume vertices to a lamp can be made in several ways: the
//! walk makes the first m vertices, a bridge the other k = n − m; or the walk makes all of them and its last
//! direction meets the lamp by chance. Up to common factors the density of way m under strategy j is
//! T_m = σ_j^m e^(−σ_j L_m) q_j(k | D_m) k! D_m³ / (s_m^(k+1) f(θ_m)), where L_m is the length of the walk to vertex
//! m, D_m its distance to the lamp point, s_m the length of the path from it to the lamp and f(θ_m) the density with
//! which the walk would have taken the path's direction there: the phase function, or cosine/π on a surface (m = 0).
//! The contribution is the integrand over the sum of all T_m, whichever way made the path.

use glam::DVec3;

use super::{
    bridge::Bridge,
    lamp_target::LampWorkspace,
    order::{LN_POISSON_SHARE, MAX_ORDER, OrderLaw},
    spectral::Spectral,
};
use crate::prepare::Medium;

/// A vertex of the walk from which bridges were or could have been made, in unfolded space.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Position, m.
    pub position: DVec3,
    /// Length of the walk up to here, m.
    pub length: f64,
    /// Density with which the walk took the direction in which it went on, 1/sr: the phase function, or cosine/π on
    /// a surface; not yet known at the last vertex.
    pub lobe: f64,
    /// Product of the reflectances of the water surface before this vertex.
    pub reflected: f64,
}

/// The vertices of the walk that can be joined to a lamp.
#[derive(Clone, Debug, Default)]
pub struct Trail {
    /// Volume vertices since the camera or since the last surface; in the second case that surface comes first.
    pub vertices: Vec<Vertex>,
    /// Whether the first vertex lies on a surface.
    pub rooted: bool,
    /// Whether volume vertices after the surface are joined to lamps as well.
    pub companions: bool,
    /// Whether bridges from the first vertex, a surface, scatter at least once.
    pub scattered: bool,
}

impl Trail {
    /// Starts at the camera.
    pub fn start(&mut self) {
        self.vertices.clear();
        self.rooted = false;
        self.companions = true;
        self.scattered = false;
    }

    /// Starts at a surface; flags as in the fields.
    pub fn root(&mut self, vertex: Vertex, companions: bool, scattered: bool) {
        self.vertices.clear();
        self.vertices.push(vertex);
        self.rooted = true;
        self.companions = companions;
        self.scattered = scattered;
    }

    /// The walk went on from its last vertex; `lobe` as in [`Vertex::lobe`].
    pub fn leave(&mut self, lobe: f64) {
        if let Some(last) = self.vertices.last_mut() {
            last.lobe = lobe;
        }
    }

    /// Number of volume vertices.
    fn scatterings(&self) -> usize {
        self.vertices.len() - usize::from(self.rooted)
    }
}

/// How a path goes on from the last vertex of the walk.
#[derive(Clone, Copy, Debug)]
pub struct Junction {
    /// Density of the path's direction there, see [`Vertex::lobe`], 1/sr.
    pub lobe: f64,
    /// The lamp point, m, in unfolded space.
    pub lamp: DVec3,
    /// The lamp's area times the cosine at it where a walk can meet the lamp by chance, m²; else 0.
    pub facing: f64,
}

/// What all ways of making one path share.
struct PathToLamp<'a> {
    medium: &'a Medium,
    law: &'a OrderLaw,
    /// Number of strategies.
    count: usize,
    /// Number of volume vertices that the walk has still to make.
    more: f64,
    /// The camera walk's length to its last vertex and from there to the lamp, m.
    last_length: f64,
    remaining: f64,
    /// Logarithm of the camera walk's density under each strategy, which can be far below the range of a float where
    /// another way's factor is as far above it.
    ln_walk_density: [f64; 3],
    /// The same, times the reciprocal of the probability of the bridges that are made from a surface.
    ln_root_density: [f64; 3],
}

/// A way of making the path: from which vertex on a bridge makes it.
#[derive(Clone, Copy)]
struct Way {
    /// Length of the walk up to the vertex, m.
    length: f64,
    /// Square of its distance from the lamp point, m².
    distance2: f64,
    /// Scatterings of the bridge.
    order: usize,
    /// Whether the vertex is the first of a trail that starts at a surface.
    root: bool,
}

impl PathToLamp<'_> {
    /// Sum over the strategies of the density of `way`, relative to e^`shift`; `lobe` as in [`Vertex::lobe`].
    #[inline]
    fn density(&self, shift: f64, way: Way, lobe: f64) -> f64 {
        self.ln_densities(way)[..self.count]
            .iter()
            .map(|(poisson, tail)| (poisson - shift).exp() + (tail - shift).exp())
            .sum::<f64>()
            * way.distance2
            / lobe
    }

    /// The two parts of that density under each strategy, in logarithms, without the factor D²/f.
    #[inline]
    fn ln_densities(&self, way: Way) -> [(f64, f64); 3] {
        let distance = way.distance2.sqrt();
        let ahead = way.length - self.last_length;
        // No way is shorter than the straight one; rounding must not say so.
        let to_lamp = (self.remaining - ahead).max(distance);
        let (ln_distance, ln_to_lamp) = (distance.ln(), to_lamp.ln());
        let steps = (way.order + 1) as f64;
        let ln_poisson = LN_POISSON_SHARE + steps * (ln_distance - ln_to_lamp);
        let ln_tail = self.law.ln_tail(way.order) + ln_distance - steps * ln_to_lamp;
        let strategies = &self.medium.by_scattering;
        let ln_walk = if way.root {
            &self.ln_root_density
        } else {
            &self.ln_walk_density
        };
        std::array::from_fn(|j| {
            let (sigma, ln_sigma) = (strategies.sigma[j], self.medium.ln_sigma[j]);
            let poisson = ln_poisson - sigma * (ahead + distance) + self.more * ln_sigma;
            let tail = ln_tail - sigma * ahead + (self.more - way.order as f64) * ln_sigma;
            (ln_walk[j] + poisson, ln_walk[j] + tail)
        })
    }

    /// Density of a walk that makes all vertices, the last at `length`, and then meets the lamp by chance;
    /// `facing` is the lamp's area times the cosine at it.
    fn hit_density(&self, shift: f64, length: f64, facing: f64) -> f64 {
        if facing == 0.0 {
            return 0.0;
        }
        let strategies = &self.medium.by_scattering;
        let ahead = length - self.last_length;
        let ln = |j: usize| {
            self.ln_walk_density[j] + self.more * self.medium.ln_sigma[j]
                - strategies.sigma[j] * ahead
        };
        (0..self.count).map(|j| (ln(j) - shift).exp()).sum::<f64>() * facing
    }

    /// Sum of the densities of the bridges that could have been made from earlier vertices of the walk.
    fn earlier_ways(
        &self,
        shift: f64,
        earlier: &[Vertex],
        rooted: bool,
        total_order: usize,
        lamp: DVec3,
    ) -> f64 {
        let first = usize::from(!rooted);
        let mut density = 0.0;
        for (i, v) in earlier.iter().enumerate() {
            let order = total_order - (i + first);
            if order <= MAX_ORDER && v.reflected > 0.0 {
                let way = Way {
                    length: v.length,
                    distance2: v.position.distance_squared(lamp),
                    order,
                    root: rooted && i == 0,
                };
                density += v.reflected * self.density(shift, way, v.lobe);
            }
        }
        density
    }

    /// Sum of the densities of the walk's making some of the bridge's vertices, or all of them and meeting the lamp.
    fn later_ways(
        &self,
        shift: f64,
        bridge: &Bridge,
        crossings: &[f64],
        junction: &Junction,
    ) -> f64 {
        let mut length = self.last_length;
        let mut reflected = 1.0;
        let mut density = 0.0;
        for (i, &position) in bridge.vertices.iter().enumerate() {
            length += bridge.lengths[i];
            reflected *= crossings[i];
            let way = Way {
                length,
                distance2: position.distance_squared(junction.lamp),
                order: bridge.order - 1 - i,
                root: false,
            };
            let lobe = self.medium.phase.value(bridge.sin2[i]);
            density += reflected * self.density(shift, way, lobe);
        }
        density + reflected * self.hit_density(shift, length, junction.facing)
    }
}

/// Radiance per channel, for unit intensity, of the path made by the walk (its weight `spectral`, its vertices
/// `work.trail`) and by the bridge of `work`, whose crossings hold per segment the product of the reflectances of the
/// water surface.
pub fn contribution(
    medium: Option<&Medium>,
    spectral: &Spectral,
    work: &LampWorkspace,
    junction: &Junction,
) -> [f64; 3] {
    match medium.filter(|m| m.scatters()) {
        Some(medium) => scattering(medium, spectral, work, junction),
        None => straight(medium, spectral, work, junction),
    }
}

/// The straight bridge and the chance of meeting the lamp.
fn straight(
    medium: Option<&Medium>,
    spectral: &Spectral,
    work: &LampWorkspace,
    junction: &Junction,
) -> [f64; 3] {
    let distance = work.bridge.distance;
    let reflected = work.crossings[0];
    let density = distance * distance / junction.lobe + reflected * junction.facing;
    let transmittance = medium.map_or([1.0; 3], |m| m.transmittance(distance));
    let weight = spectral.weight();
    std::array::from_fn(|k| weight[k] * transmittance[k] * reflected / density)
}

fn scattering(
    medium: &Medium,
    spectral: &Spectral,
    work: &LampWorkspace,
    junction: &Junction,
) -> [f64; 3] {
    let (trail, bridge) = (&work.trail, &work.bridge);
    let Some((last, earlier)) = trail.vertices.split_last() else {
        return [0.0; 3];
    };
    let order = bridge.order;
    let ln_walk_density = spectral.density.map(f64::ln);
    let path = PathToLamp {
        medium,
        law: &work.law,
        count: spectral.count,
        more: order as f64,
        last_length: last.length,
        remaining: bridge.length,
        ln_walk_density,
        ln_root_density: root_density(medium, work, ln_walk_density, junction.lamp),
    };
    let own = Way {
        length: last.length,
        distance2: bridge.distance * bridge.distance,
        order,
        root: trail.rooted && earlier.is_empty(),
    };
    // Relative to the way that made the path: single densities may be out of the range of a float.
    let shift = path.ln_densities(own)[..spectral.count]
        .iter()
        .fold(f64::NEG_INFINITY, |m, (poisson, tail)| {
            m.max(*poisson).max(*tail)
        });
    let mut density = path.density(shift, own, junction.lobe);
    if trail.companions {
        let total_order = trail.scatterings() + order;
        density += path.earlier_ways(shift, earlier, trail.rooted, total_order, junction.lamp)
            / last.reflected
            + path.later_ways(shift, bridge, &work.crossings, junction);
    } else if order == 0 {
        density += work.crossings[0] * path.hit_density(shift, last.length, junction.facing);
    }
    let all_reflected: f64 = work.crossings.iter().product();
    let scale = all_reflected * spectral.count as f64 / density;
    let steps = order as f64;
    std::array::from_fn(|k| {
        if spectral.value[k] == 0.0 {
            return 0.0;
        }
        let ln_b = if order == 0 {
            0.0
        } else {
            steps * medium.ln_b[k]
        };
        spectral.value[k] * scale * (ln_b - medium.c[k] * bridge.length - shift).exp()
    })
}

/// Density of the walk over the probability of the bridges that are made from the trail's first vertex.
fn root_density(
    medium: &Medium,
    work: &LampWorkspace,
    ln_walk_density: [f64; 3],
    lamp: DVec3,
) -> [f64; 3] {
    if !work.trail.scattered {
        return ln_walk_density;
    }
    let distance = work.trail.vertices[0].position.distance(lamp);
    std::array::from_fn(|j| {
        let share = work
            .law
            .scattered_share(medium.by_scattering.sigma[j] * distance);
        ln_walk_density[j] - share.ln()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Water;
    use uw_media::{Iops, phase::Phase};

    /// After 300 m in the clear channel the turbid channel's density is below the range of a float, while what
    /// it would have drawn from the first vertex on is above it.
    #[test]
    fn long_walks_in_coloured_water_give_finite_light() {
        let medium = Medium::build(&Water {
            iops: Iops {
                a: [0.1, 0.6, 0.2],
                b: [0.1, 3.0, 0.5],
            },
            phase: Phase::Isotropic,
            refractive_index: 1.34,
        })
        .expect("it absorbs");
        let vertex = |x: f64, lobe: f64| Vertex {
            position: DVec3::X * x,
            length: x,
            lobe,
            reflected: 1.0,
        };
        let mut work = LampWorkspace::new(Some(&medium));
        work.trail.start();
        work.trail.vertices = vec![vertex(0.01, 0.08), vertex(300.0, 0.0)];
        work.crossings = vec![1.0];
        work.bridge = Bridge {
            distance: 10.0,
            length: 10.0,
            first: DVec3::Y,
            emission: -DVec3::Y,
            lengths: vec![10.0],
            ..Bridge::default()
        };
        let spectral = Spectral {
            value: [1e-14, 0.0, 1e-70],
            density: [1.0, 0.0, 1e-44],
            count: 3,
            chosen: 0,
        };
        let junction = Junction {
            lobe: 0.08,
            lamp: DVec3::new(300.0, 10.0, 0.0),
            facing: 0.0,
        };
        let light = contribution(Some(&medium), &spectral, &work, &junction);
        assert!(
            light[0] > 0.0 && light.iter().all(|l| l.is_finite()),
            "{light:?}"
        );
    }
}
