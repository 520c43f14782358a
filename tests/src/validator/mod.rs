//! The plain validator: the radiative transfer equation by analog Monte Carlo, as simple as it can be written.
//!
//! A walk starts at the camera and follows the light backwards, in one channel and in f64. Every choice is drawn
//! with its own physical probability: the free flight with the attenuation coefficient c, scattering against
//! absorption with b / c, the angle from the exact inverse CDF of the phase function, reflection against
//! absorption at a surface with the reflectance, reflection against refraction at the water surface with the
//! Fresnel reflectance. What the walk runs into (sky, emitting surfaces, the front of a disk lamp) is added up.
//! The weight of a walk changes only by n² where it crosses the water surface, and at glossy surfaces, which send walks on with
//! the cosine.
//!
//! Sun and point lamps have no extent, a walk cannot run into them: their light is added at every event, with the
//! phase function or cosine / π as the response. That has a finite variance only for a phase function that is
//! finite straight on, which is demanded.
//!
//! None of the renderer's estimators, intersection code, tables or films is used: what both share is the parsed
//! scene, the camera's pinhole, the texture lookup and the exact phase functions.
//!
//! Conventions are those of the renderer: lamps block no light; events are scatterings in the water and reflections
//! at opaque surfaces, not the crossing of the water surface or the reflection at it; sunlight that the water
//! surface reflects into the air is left out.

pub mod cases;
mod chance;
mod gloss;
mod lights;
mod medium;
mod shapes;

use std::f64::consts::PI;

use glam::DVec3;
use uw_media::phase::PhaseFunction;
use uw_render::scene::Scene;

use chance::{Random, around, fresnel};
use gloss::Finish;
use medium::Medium;
use shapes::{Hit, Patch, patches};

/// Mean radiance of a pixel in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean, W/(m² sr).
    pub mean: f64,
    /// Standard error of the mean, W/(m² sr).
    pub standard_error: f64,
}

/// One channel of a scene.
pub struct Validator<'a> {
    scene: &'a Scene,
    channel: usize,
    medium: Medium,
    /// Height of the water surface, m; infinite where the medium fills all space.
    height: f64,
    /// Refractive index of the water against air; 1 for an index-matched surface.
    index: f64,
    patches: Vec<Patch>,
    /// Of every material how it shines in the water, or in space without any, and in the air.
    finishes: Vec<[Option<Finish>; 2]>,
}

/// A ray in the water (or in space without a surface), or in the air above.
#[derive(Clone, Copy)]
struct Ray {
    origin: DVec3,
    direction: DVec3,
    /// The patch that the ray starts on and therefore cannot meet.
    from: Option<usize>,
    in_air: bool,
}

/// What ends a segment of a walk.
enum End {
    Scattering,
    Surface(Hit),
    WaterSurface,
    Nothing,
}

impl<'a> Validator<'a> {
    /// Prepares `channel` (0, 1, 2) of `scene`.
    ///
    /// # Panics
    /// Where the method would be wrong or its variance infinite: sun or point lamps with a phase function that is
    /// infinite straight on, point lamps under a refracting surface, meshes with vertex normals.
    pub fn new(scene: &'a Scene, channel: usize) -> Self {
        let surface = scene.water.as_ref().and(scene.surface);
        let index = match (&scene.water, surface) {
            (Some(water), Some(surface)) if surface.refractive => water.refractive_index,
            _ => 1.0,
        };
        let points = scene.lamps.iter().any(|lamp| lamp.radius_m == 0.0);
        let straight_on = scene.water.as_ref().map_or(0.0, |w| w.phase.value(0.0));
        assert!(
            straight_on.is_finite() || !(points || scene.sun.is_some()),
            "infinite variance"
        );
        assert!(
            !points || index == 1.0,
            "reflected point lamps are not found"
        );
        let outside = scene
            .water
            .as_ref()
            .map_or(1.0, |water| water.refractive_index);
        let finish = |material| [outside, 1.0].map(|index| Finish::new(material, channel, index));
        Self {
            finishes: scene.materials.iter().map(finish).collect(),
            scene,
            channel,
            medium: Medium::new(scene, channel),
            height: surface.map_or(f64::INFINITY, |s| s.height_m),
            index,
            patches: patches(scene),
        }
    }

    /// Radiance of the pixel (`column`, `row`) from `walks` independent walks of at most `max_events` scatterings
    /// and reflections; 0 for no limit.
    pub fn pixel(
        &self,
        (column, row): (u32, u32),
        max_events: u32,
        walks: u64,
        seed: u64,
    ) -> Estimate {
        let camera = &self.scene.camera;
        let mut random = Random::new(seed);
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..walks {
            let x = f64::from(column) + random.uniform();
            let y = f64::from(row) + random.uniform();
            let ray = Ray {
                origin: camera.position_m,
                direction: camera.direction(x, y),
                from: None,
                in_air: camera.position_m.z > self.height,
            };
            let light = self.walk(ray, max_events, &mut random);
            sum += light;
            squares += light * light;
        }
        let n = walks as f64;
        let mean = sum / n;
        Estimate {
            mean,
            standard_error: ((squares / n - mean * mean) / (n - 1.0)).sqrt(),
        }
    }

    /// The light found by one walk, W/(m² sr).
    fn walk(&self, mut ray: Ray, max_events: u32, random: &mut Random) -> f64 {
        let (mut light, mut weight, mut events) = (0.0, 1.0, 0);
        loop {
            let (end, length) = self.segment(&ray, random);
            light += weight * self.disks_crossed(&ray, length);
            if length < f64::INFINITY {
                ray.origin += length * ray.direction;
            }
            // Probability of going on after an event, the normal of the surface if it was one, and how that shines.
            let (survival, normal, finish) = match end {
                End::Nothing => return light + weight * self.sky(&ray),
                End::WaterSurface => {
                    weight *= self.meet_water_surface(&mut ray, random);
                    continue;
                }
                End::Scattering => {
                    ray.from = None;
                    let here = self.medium.at(ray.origin);
                    (here.b / here.c, None, None)
                }
                End::Surface(hit) => {
                    let patch = &self.patches[hit.patch];
                    light += weight * self.scene.materials[patch.material].emission[self.channel];
                    ray.from = Some(hit.patch);
                    let facing = -patch.normal * patch.normal.dot(ray.direction).signum();
                    let finish = self.finishes[patch.material][usize::from(ray.in_air)].as_ref();
                    let survival = match finish {
                        Some(_) => 1.0,
                        None => patch.reflectance(self.scene, &hit)[self.channel],
                    };
                    (survival, Some(facing), finish)
                }
            };
            if (max_events > 0 && events == max_events) || random.uniform() >= survival {
                return light;
            }
            events += 1;
            let before = ray.direction;
            let response = |towards| match (normal, finish) {
                (Some(normal), Some(finish)) => finish.response(normal, -before, towards),
                (Some(normal), None) => normal.dot(towards).max(0.0) / PI,
                (None, _) => self.phase(before, towards),
            };
            light += weight * self.light_of_points(&ray, random, response);
            ray.direction = match normal {
                Some(normal) => around(normal, 1.0 - random.uniform().sqrt(), random),
                None => around(before, 2.0 * self.draw_x(random), random),
            };
            if let (Some(normal), Some(_)) = (normal, finish) {
                weight *= response(ray.direction) * PI / normal.dot(ray.direction).max(1e-300);
            }
        }
    }

    /// What the ray meets first, and how far away, m.
    fn segment(&self, ray: &Ray, random: &mut Random) -> (End, f64) {
        let flight = if ray.in_air {
            f64::INFINITY
        } else {
            self.medium.flight(ray.origin, ray.direction, random)
        };
        let rise = self.height - ray.origin.z;
        let to_water_surface = if ray.direction.z != 0.0 && (ray.direction.z < 0.0) == ray.in_air {
            (rise / ray.direction.z).max(0.0)
        } else {
            f64::INFINITY
        };
        if let Some(hit) = self.nearest(ray, flight.min(to_water_surface)) {
            let distance = hit.distance;
            (End::Surface(hit), distance)
        } else if flight < to_water_surface {
            (End::Scattering, flight)
        } else if to_water_surface < f64::INFINITY {
            (End::WaterSurface, to_water_surface)
        } else {
            (End::Nothing, f64::INFINITY)
        }
    }

    /// The nearest patch closer than `limit`, m.
    fn nearest(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for (i, patch) in self.patches.iter().enumerate() {
            let limit = nearest.as_ref().map_or(limit, |hit| hit.distance);
            if ray.from != Some(i)
                && let Some(hit) = patch.meet(i, ray.origin, ray.direction, limit)
            {
                nearest = Some(hit);
            }
        }
        nearest
    }

    /// Reflects or refracts the ray at the water surface; returns the factor on its weight, because radiance over
    /// n² is kept.
    fn meet_water_surface(&self, ray: &mut Ray, random: &mut Random) -> f64 {
        ray.origin.z = self.height;
        ray.from = None;
        let ratio = if ray.in_air {
            1.0 / self.index
        } else {
            self.index
        };
        let (reflectance, cosine) = fresnel(ray.direction.z.abs(), ratio);
        if random.uniform() < reflectance {
            ray.direction.z = -ray.direction.z;
            return 1.0;
        }
        let vertical = cosine.copysign(ray.direction.z);
        ray.direction = DVec3::new(ratio * ray.direction.x, ratio * ray.direction.y, vertical);
        ray.in_air = !ray.in_air;
        ratio * ratio
    }

    /// Phase function between two unit directions of travel, 1/sr.
    fn phase(&self, before: DVec3, after: DVec3) -> f64 {
        let x = 0.25 * (before - after).length_squared();
        self.scene.water.as_ref().map_or(0.0, |w| w.phase.value(x))
    }

    /// sin²(θ/2) of a scattering angle θ drawn from the phase function.
    fn draw_x(&self, random: &mut Random) -> f64 {
        let u = random.uniform();
        self.scene
            .water
            .as_ref()
            .map_or(0.0, |w| w.phase.inverse_cdf(u))
    }
}
