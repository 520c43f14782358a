//! Lamp light that meets no surface: bridges from every volume vertex, combined by the balance heuristic.
//!
//! A path of n volume vertices can be made in n ways: the camera walk makes the first m, a bridge the other
//! n − m. Up to common factors the density of way m under strategy j is
//! T_m = σ_j^m e^(−σ_j L_m) q_j(k | D_m) k! D_m³ / (s_m^(k+1) p(θ_m)) with k = n − m, where L_m is the length
//! of the camera walk to vertex m, D_m its distance to the lamp point, s_m the length of the path from it to
//! the lamp and p(θ_m) the phase function at it. The contribution is the integrand over the sum of all T_m,
//! whichever way made the path.

use glam::DVec3;

use super::{
    bridge::Bridge,
    order::{LN_POISSON_SHARE, OrderLaw},
    spectral::Spectral,
};
use crate::prepare::Medium;

/// A volume vertex of the camera walk, in unfolded space.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Position, m.
    pub position: DVec3,
    /// Length of the walk up to here, m.
    pub length: f64,
    /// Phase function at the angle by which the walk turned here, 1/sr; not yet known at the last vertex.
    pub phase: f64,
    /// Product of the surface reflectances before this vertex.
    pub reflected: f64,
}

/// What all ways of making one path share.
struct PathToLamp<'a> {
    medium: &'a Medium,
    law: &'a OrderLaw,
    spectral: &'a Spectral,
    /// Number of volume vertices of the whole path.
    total_order: usize,
    /// The camera walk's length to its last vertex and from there to the lamp, m.
    last_length: f64,
    remaining: f64,
    /// Number of vertices of the camera walk.
    walked: usize,
    /// Logarithm of the camera walk's density under each strategy, which can be far below the range of a float where
    /// another way's factor is as far above it.
    ln_walk_density: [f64; 3],
}

impl PathToLamp<'_> {
    /// Sum over the strategies of the density of the way whose camera walk ends at a vertex of `length`,
    /// `distance`² = `distance2` from the lamp, with `order` scatterings after it; relative to e^`shift`.
    #[inline]
    fn density(&self, shift: f64, length: f64, distance2: f64, order: usize, phase: f64) -> f64 {
        let mut sum = 0.0;
        for j in 0..self.spectral.count {
            let (poisson, tail) = self.ln_density(j, length, distance2, order);
            sum += (poisson - shift).exp() + (tail - shift).exp();
        }
        sum * distance2 / phase
    }

    /// The two parts of that density under strategy `j`, in logarithms, without the factor D²/p.
    #[inline]
    fn ln_density(&self, j: usize, length: f64, distance2: f64, order: usize) -> (f64, f64) {
        let distance = distance2.sqrt();
        let ahead = length - self.last_length;
        // No way is shorter than the straight one; rounding must not say so.
        let to_lamp = (self.remaining - ahead).max(distance);
        let ln_to_lamp = to_lamp.ln();
        let steps = (order + 1) as f64;
        let ln_poisson = LN_POISSON_SHARE + steps * (distance.ln() - ln_to_lamp);
        let ln_tail = self.law.ln_tail(order) + distance.ln() - steps * ln_to_lamp;
        let strategies = &self.medium.by_scattering;
        let walked_more = self.total_order as f64 - self.walked as f64;
        let (sigma, ln_sigma) = (strategies.sigma[j], strategies.ln_sigma[j]);
        let ln_walk = self.ln_walk_density[j];
        (
            ln_walk + ln_poisson - sigma * (ahead + distance) + walked_more * ln_sigma,
            ln_walk + ln_tail - sigma * ahead + (walked_more - order as f64) * ln_sigma,
        )
    }

    /// Density of a walk that makes all vertices, the last at `length`, and then meets the lamp by chance;
    /// `facing` is the lamp's area times the cosine at it.
    fn hit_density(&self, shift: f64, length: f64, facing: f64) -> f64 {
        if facing == 0.0 {
            return 0.0;
        }
        let strategies = &self.medium.by_scattering;
        let more = self.total_order as f64 - self.walked as f64;
        let ahead = length - self.last_length;
        let ln = |j: usize| {
            self.ln_walk_density[j] + more * strategies.ln_sigma[j] - strategies.sigma[j] * ahead
        };
        (0..self.spectral.count)
            .map(|j| (ln(j) - shift).exp())
            .sum::<f64>()
            * facing
    }
}

/// Radiance per channel of the path made by `walk` (its last vertex reached along `direction`, with weight
/// `spectral`) and `bridge` to the lamp point `lamp`, for unit intensity; the camera walk ends at the last
/// vertex, where the phase function is `junction`. `crossings` holds, per segment of the bridge, the product of
/// surface reflectances on it; `facing` is the lamp's area times the cosine at it where a walk can meet the lamp
/// by chance, else 0.
pub fn contribution(
    medium: &Medium,
    law: &OrderLaw,
    spectral: &Spectral,
    walk: &[Vertex],
    junction: f64,
    bridge: &Bridge,
    lamp: DVec3,
    crossings: &[f64],
    facing: f64,
) -> [f64; 3] {
    let Some((last, earlier)) = walk.split_last() else {
        return [0.0; 3];
    };
    let order = bridge.order;
    let total_order = walk.len() + order;
    let path = PathToLamp {
        medium,
        law,
        spectral,
        total_order,
        last_length: last.length,
        remaining: bridge.length,
        walked: walk.len(),
        ln_walk_density: spectral.density.map(f64::ln),
    };
    // Relative to the way that made the path: single densities may be out of the range of a float.
    let distance2 = bridge.distance * bridge.distance;
    let shift = (0..spectral.count)
        .map(|j| {
            let (poisson, tail) = path.ln_density(j, last.length, distance2, order);
            poisson.max(tail)
        })
        .fold(f64::NEG_INFINITY, f64::max);
    let mut density = path.density(shift, last.length, distance2, order, junction);
    for (i, v) in earlier.iter().enumerate() {
        let k = total_order - (i + 1);
        if k <= super::order::MAX_ORDER && v.reflected > 0.0 {
            let own = path.density(
                shift,
                v.length,
                v.position.distance_squared(lamp),
                k,
                v.phase,
            );
            density += own * v.reflected / last.reflected;
        }
    }
    let mut length = last.length;
    let mut reflected = 1.0;
    for (i, &position) in bridge.vertices.iter().enumerate() {
        length += bridge.lengths[i];
        reflected *= crossings[i];
        let phase = medium.phase.value(bridge.sin2[i]);
        density += reflected
            * path.density(
                shift,
                length,
                position.distance_squared(lamp),
                order - 1 - i,
                phase,
            );
    }
    density += reflected * path.hit_density(shift, length, facing);
    let all_reflected: f64 = crossings.iter().product();
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
        let vertex = |x: f64, phase: f64| Vertex {
            position: DVec3::X * x,
            length: x,
            phase,
            reflected: 1.0,
        };
        let walk = [vertex(0.01, 0.08), vertex(300.0, 0.0)];
        let bridge = Bridge {
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
        let lamp = DVec3::new(300.0, 10.0, 0.0);
        let law = OrderLaw::new(0.9);
        let light = contribution(
            &medium,
            &law,
            &spectral,
            &walk,
            0.08,
            &bridge,
            lamp,
            &[1.0],
            0.0,
        );
        assert!(
            light[0] > 0.0 && light.iter().all(|l| l.is_finite()),
            "{light:?}"
        );
    }
}
