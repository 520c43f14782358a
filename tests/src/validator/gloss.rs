//! Glossy surfaces by their definition: microfacets of GGX over a matt base that takes what they leave, and what a metal reflects
//! more than once; albedos as sums over directions.

use std::f64::consts::PI;

use glam::DVec3;
use uw_render::scene::Material;

use super::chance::fresnel;

/// Cosines at which albedos are known, in even steps.
const NODES: usize = 64;
/// Directions of a sum, in height and in azimuth.
const HEIGHTS: usize = 240;
const AZIMUTHS: usize = 160;

/// One channel of a glossy surface in the water or in the air.
pub(super) struct Finish {
    alpha: f64,
    metallic: f64,
    base: f64,
    /// Index of what is before the surface over that of the dielectric.
    ratio: f64,
    dielectric: Albedo,
    mirrors: Albedo,
}

/// Light that facets send on, by the cosine of where they are seen from, and its mean over the hemisphere.
struct Albedo {
    values: Vec<f64>,
    mean: f64,
}

impl Finish {
    /// Of a material that shines, before which is something of refractive index `outside`.
    pub(super) fn new(material: &Material, channel: usize, outside: f64) -> Option<Self> {
        let gloss = material.gloss?;
        assert!(
            gloss.texture.is_none(),
            "textures of gloss are not supported"
        );
        let alpha = gloss.roughness * gloss.roughness;
        let ratio = outside / gloss.index;
        Some(Self {
            alpha,
            metallic: gloss.metallic,
            base: material.reflectance[channel],
            ratio,
            dielectric: Albedo::new(alpha, |cosine| fresnel(cosine, ratio).0),
            mirrors: Albedo::new(alpha, |_| 1.0),
        })
    }

    /// What the surface sends towards `view` of light from `light`, both away from it, times the cosine of the latter, 1/sr.
    pub(super) fn response(&self, normal: DVec3, view: DVec3, light: DVec3) -> f64 {
        let (seen, lit) = (normal.dot(view), normal.dot(light));
        if seen <= 0.0 || lit <= 0.0 {
            return 0.0;
        }
        let incidence = (view + light).normalize().dot(light);
        let reflected = (1.0 - self.metallic) * fresnel(incidence, self.ratio).0
            + self.metallic * metal(self.base, incidence);
        let facets = facets(self.alpha, normal, view, light) * reflected;
        let left = |albedo: &Albedo| {
            (1.0 - albedo.at(seen)) * (1.0 - albedo.at(lit)) / (1.0 - albedo.mean)
        };
        // The mean of Schlick's reflectance over the hemisphere.
        let over_angles = self.base + (1.0 - self.base) / 21.0;
        let mirrors = self.mirrors.mean;
        let more = over_angles * over_angles * mirrors / (1.0 - over_angles * (1.0 - mirrors));
        let matt = (1.0 - self.metallic) * self.base * left(&self.dielectric)
            + self.metallic * more * left(&self.mirrors);
        (facets + matt / PI) * lit
    }
}

fn metal(base: f64, cosine: f64) -> f64 {
    base + (1.0 - base) * (1.0 - cosine).powi(5)
}

/// D G / (4 cos cos) of GGX with masking and shadowing that go by height together (Heitz 2014, equation 99), 1/sr.
fn facets(alpha: f64, normal: DVec3, view: DVec3, light: DVec3) -> f64 {
    let (seen, lit) = (normal.dot(view), normal.dot(light));
    let cosine2 = (view + light).normalize().dot(normal).powi(2);
    let tan2 = (1.0 - cosine2).max(0.0) / cosine2;
    let a2 = alpha * alpha;
    let density = a2 / (PI * cosine2 * cosine2 * (a2 + tan2).powi(2));
    let side = |one: f64, other: f64| one * (a2 + (1.0 - a2) * other * other).sqrt();
    density / (2.0 * (side(lit, seen) + side(seen, lit)))
}

impl Albedo {
    fn new(alpha: f64, fresnel: impl Fn(f64) -> f64) -> Self {
        let node = |i: usize| ((i as f64) / (NODES - 1) as f64).max(1e-3);
        let values: Vec<f64> = (0..NODES)
            .map(|i| sum_over_directions(alpha, node(i), &fresnel))
            .collect();
        let steps = 1000;
        let mut own = Self { values, mean: 0.0 };
        own.mean = (0..steps)
            .map(|i| (f64::from(i) + 0.5) / f64::from(steps))
            .map(|cosine| 2.0 * cosine * own.at(cosine) / f64::from(steps))
            .sum();
        own
    }

    fn at(&self, cosine: f64) -> f64 {
        let place = cosine * (NODES - 1) as f64;
        let i = (place as usize).min(NODES - 2);
        self.values[i] + (place - i as f64) * (self.values[i + 1] - self.values[i])
    }
}

fn sum_over_directions(alpha: f64, cosine: f64, fresnel: &impl Fn(f64) -> f64) -> f64 {
    let view = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let mut sum = 0.0;
    for i in 0..HEIGHTS {
        let lit = (i as f64 + 0.5) / HEIGHTS as f64;
        let sine = (1.0 - lit * lit).sqrt();
        for j in 0..AZIMUTHS {
            // Half of the turn: the other half is its mirror image.
            let azimuth = PI * (j as f64 + 0.5) / AZIMUTHS as f64;
            let light = DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), lit);
            let incidence = (view + light).normalize().dot(light);
            sum += facets(alpha, DVec3::Z, view, light) * fresnel(incidence) * lit;
        }
    }
    sum * 2.0 * PI / (HEIGHTS * AZIMUTHS) as f64
}
