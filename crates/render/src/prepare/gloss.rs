//! Albedos of rough surfaces by the angle of view, from which the kernels know how much light a glossy layer leaves for what
//! is below it, and how much more than once reflected light it sends out. Twin: `shaders/common/gloss.wgsl`.

use std::{f64::consts::PI, sync::OnceLock};

use glam::DVec3;

use crate::scene::{LEAST_ROUGHNESS, Material};

/// Nodes in the cosine of the angle of view, in steps of its square root; twin: `shaders/common/gloss.wgsl`.
const COSINES: usize = 24;
/// Nodes in roughness, from the least to 1; twin: `shaders/common/gloss.wgsl`.
const ROUGHNESSES: usize = 16;
/// Microfacets that each node is a mean of, along each of two numbers.
const FACETS: usize = 24;
/// Cosine of a view along the surface.
const LEAST_COSINE: f64 = 1e-4;
/// Nodes between two cosines for the mean over the hemisphere.
const STEPS: usize = 8;

/// Albedos of rough surfaces of one material: for each roughness those by cosine, then their mean over the hemisphere, weighted
/// with the cosine.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AlbedoTable(pub(crate) Vec<f64>);

impl AlbedoTable {
    /// Of microfacets whose reflectance is `fresnel` of the cosine of incidence.
    fn new(fresnel: impl Fn(f64) -> f64) -> Self {
        let mut values = Vec::with_capacity(ROUGHNESSES * (COSINES + 1));
        for j in 0..ROUGHNESSES {
            let step = j as f64 / (ROUGHNESSES - 1) as f64;
            let roughness = LEAST_ROUGHNESS + step * (1.0 - LEAST_ROUGHNESS);
            let albedos: Vec<f64> = (0..COSINES)
                .map(|i| albedo(node_cosine(i), roughness * roughness, &fresnel))
                .collect();
            let mean = mean_of(&albedos);
            values.extend(albedos);
            values.push(mean);
        }
        Self(values)
    }

    /// Of microfacets that reflect everything.
    fn of_mirrors() -> Self {
        Self::new(|_| 1.0)
    }

    /// Of microfacets of a dielectric whose refractive index is `ratio` times that of what is before it.
    fn of_dielectric(ratio: f64) -> Self {
        Self::new(|cosine| fresnel_reflectance(cosine, ratio))
    }
}

/// The tables of a scene's materials.
#[derive(Clone, Debug)]
pub(crate) struct AlbedoTables {
    /// Of facets that reflect everything.
    pub(crate) mirrors: AlbedoTable,
    /// Of dielectrics by their index over that of the water, and of the air.
    pub(crate) dielectrics: Vec<(f64, AlbedoTable)>,
}

impl AlbedoTables {
    /// Those of `materials` in water of an index and in air; `None` where none of them shines.
    pub(crate) fn build(materials: &[Material], index_of_water: f64) -> Option<Self> {
        static MIRRORS: OnceLock<AlbedoTable> = OnceLock::new();
        let mut dielectrics: Vec<(f64, AlbedoTable)> = Vec::new();
        for gloss in materials.iter().filter_map(|material| material.gloss) {
            for ratio in [gloss.index / index_of_water, gloss.index] {
                if dielectrics.iter().all(|(known, _)| *known != ratio) {
                    dielectrics.push((ratio, AlbedoTable::of_dielectric(ratio)));
                }
            }
        }
        (!dielectrics.is_empty()).then(|| Self {
            mirrors: MIRRORS.get_or_init(AlbedoTable::of_mirrors).clone(),
            dielectrics,
        })
    }
}

fn node_cosine(i: usize) -> f64 {
    let root = i as f64 / (COSINES - 1) as f64;
    (root * root).max(LEAST_COSINE)
}

/// Twice the integral of the cosine times what lies straight between the nodes of `albedos`, in steps of the root of the cosine.
fn mean_of(albedos: &[f64]) -> f64 {
    let steps = (COSINES - 1) * STEPS;
    let sum: f64 = (0..steps)
        .map(|k| {
            let place = (k as f64 + 0.5) / STEPS as f64;
            let (i, part) = (place as usize, place.fract());
            let root = place / (COSINES - 1) as f64;
            let value = albedos[i] + part * (albedos[i + 1] - albedos[i]);
            // The cosine is the root's square: cos d cos = 2 root³ d root.
            value * 4.0 * root.powi(3)
        })
        .sum();
    sum / steps as f64
}

/// Share of unpolarised light that a dielectric reflects whose index is `ratio` times that of what is before it.
fn fresnel_reflectance(cosine: f64, ratio: f64) -> f64 {
    let square = ratio * ratio - 1.0 + cosine * cosine;
    if square <= 0.0 {
        return 1.0;
    }
    let refracted = square.sqrt();
    let s = (cosine - refracted) / (cosine + refracted);
    let p = (ratio * ratio * cosine - refracted) / (ratio * ratio * cosine + refracted);
    0.5 * (s * s + p * p)
}

/// Albedo of GGX microfacets with the height-correlated masking of Smith (Heitz 2014), seen at `cosine`: the mean over the visible
/// facets (Heitz 2018) of their reflectance times what leaves unmasked.
fn albedo(cosine: f64, alpha: f64, fresnel: &impl Fn(f64) -> f64) -> f64 {
    let view = [(1.0 - cosine * cosine).sqrt(), 0.0, cosine];
    let lambda = |cosine: f64| {
        let tan2 = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
        0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
    };
    let own = lambda(cosine);
    let mut sum = 0.0;
    for i in 0..FACETS {
        for j in 0..FACETS {
            let at = |k: usize| (k as f64 + 0.5) / FACETS as f64;
            // Steps shrink towards the rim of the facets that are seen, where these turn steep all at once.
            let (s, weight) = (at(i), 2.0 * (1.0 - at(i)));
            let facet = visible_facet(view, alpha, s * (2.0 - s), at(j));
            let along = (0..3).map(|k| view[k] * facet[k]).sum::<f64>();
            let up = 2.0 * along * facet[2] - cosine;
            if up > 0.0 {
                sum += weight * fresnel(along.min(1.0)) * (1.0 + own) / (1.0 + own + lambda(up));
            }
        }
    }
    sum / (FACETS * FACETS) as f64
}

/// Normal of a visible facet, in a frame whose third axis is the surface's normal (Heitz 2018).
fn visible_facet([x, y, z]: [f64; 3], alpha: f64, u: f64, v: f64) -> [f64; 3] {
    let stretched = DVec3::new(alpha * x, alpha * y, z).normalize();
    let across = DVec3::new(-stretched.y, stretched.x, 0.0);
    let first = across.try_normalize().unwrap_or(DVec3::X);
    let second = stretched.cross(first);
    let (sine, cosine) = (2.0 * PI * v).sin_cos();
    let (p, q) = (u.sqrt() * cosine, u.sqrt() * sine);
    let part = 0.5 * (1.0 + stretched.z);
    let q = (1.0 - part) * (1.0 - p * p).max(0.0).sqrt() + part * q;
    let rest = (1.0 - p * p - q * q).max(0.0).sqrt();
    let facet = p * first + q * second + rest * stretched;
    DVec3::new(alpha * facet.x, alpha * facet.y, facet.z.max(0.0))
        .normalize()
        .to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Albedo by the definition: an integral over the directions that light leaves in, of D G₂ F / (4 cos).
    fn by_directions(cosine: f64, alpha: f64) -> f64 {
        let n = 600;
        let view = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        let lambda = |c: f64| 0.5 * ((1.0 + alpha * alpha * (1.0 / (c * c) - 1.0)).sqrt() - 1.0);
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let up = (i as f64 + 0.5) / n as f64;
                let (sine, turn) = ((1.0 - up * up).sqrt(), PI * (j as f64 + 0.5) / n as f64);
                let out = DVec3::new(sine * turn.cos(), sine * turn.sin(), up);
                let half = (view + out).normalize();
                let c2 = half.z * half.z;
                let d = alpha * alpha / (PI * (c2 * (alpha * alpha - 1.0) + 1.0).powi(2));
                sum += d / (1.0 + lambda(cosine) + lambda(up)) / (4.0 * cosine);
            }
        }
        sum * 2.0 * PI / (n * n) as f64
    }

    #[test]
    fn albedos_are_integrals_over_directions() {
        for (cosine, roughness) in [(1.0, 0.5), (0.8, 0.7), (0.3, 1.0), (0.6, 0.35)] {
            let alpha = roughness * roughness;
            let (got, expected) = (
                albedo(cosine, alpha, &|_| 1.0),
                by_directions(cosine, alpha),
            );
            assert!(
                (got - expected).abs() < 7e-4,
                "{cosine}, {roughness}: {got} {expected}"
            );
        }
    }

    #[test]
    fn smooth_surfaces_reflect_as_their_facets_do() {
        let water_over_glass = AlbedoTable::of_dielectric(1.5 / 1.34);
        let normal = water_over_glass.0[COSINES - 1];
        assert!((normal - 0.003_18).abs() < 2e-5, "{normal}");
        let mirrors = AlbedoTable::of_mirrors();
        assert!(mirrors.0[COSINES - 1] > 0.9999, "{:?}", mirrors.0);
        // The roughest send on less than half of what they are lit with from all around.
        let rough = mirrors.0[mirrors.0.len() - 1];
        assert!((0.40..0.42).contains(&rough), "{rough}");
    }
}
