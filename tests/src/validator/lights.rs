//! What a walk sees: sky, disk lamps, and the light of sun and point lamps at an event.

use std::f64::consts::PI;

use glam::DVec3;
use uw_render::scene::{Falloff, Lamp};

use super::{
    Ray, Validator,
    chance::{Random, fresnel},
};

impl Validator<'_> {
    /// Radiance of the background, W/(m² sr): the upper hemisphere in the air, everything without a water surface.
    pub(super) fn sky(&self, ray: &Ray) -> f64 {
        if ray.in_air || self.height == f64::INFINITY {
            self.scene.sky_radiance[self.channel]
        } else {
            0.0
        }
    }

    /// Radiance of the disk lamps whose front the ray crosses within `length`, W/(m² sr).
    pub(super) fn disks_crossed(&self, ray: &Ray, length: f64) -> f64 {
        let mut light = 0.0;
        for lamp in self.scene.lamps.iter().filter(|lamp| lamp.radius_m > 0.0) {
            let cosine = -lamp.forward.dot(ray.direction);
            let distance = lamp.forward.dot(ray.origin - lamp.position_m) / cosine;
            let offset = ray.origin + distance * ray.direction - lamp.position_m;
            if cosine > 0.0
                && distance > 0.0
                && distance < length
                && offset.length() <= lamp.radius_m
            {
                light += self.beam(lamp, cosine) / (PI * lamp.radius_m * lamp.radius_m);
            }
        }
        light
    }

    /// Intensity at the lamp's level, W/sr, at an angle from the axis whose cosine is given, without a disk's own
    /// cosine.
    fn beam(&self, lamp: &Lamp, cosine: f64) -> f64 {
        let angle_deg = cosine.clamp(-1.0, 1.0).acos().to_degrees();
        if angle_deg > lamp.half_angle_deg {
            return 0.0;
        }
        let relative = match &lamp.falloff {
            Falloff::Uniform => 1.0,
            Falloff::Cosine => cosine.max(0.0),
            Falloff::Profile(rows) => rows
                .windows(2)
                .find(|w| (w[0].0..=w[1].0).contains(&angle_deg))
                .map_or(0.0, |w| {
                    w[0].1 + (w[1].1 - w[0].1) * (angle_deg - w[0].0) / (w[1].0 - w[0].0)
                }),
        };
        lamp.intensity[self.channel] * lamp.level_pct / 100.0 * relative
    }

    /// Light of the sun and of the point lamps that arrives at the start of `ray` times the `response` to its
    /// direction (1/sr).
    pub(super) fn light_of_points(
        &self,
        ray: &Ray,
        random: &mut Random,
        response: impl Fn(DVec3) -> f64,
    ) -> f64 {
        let mut light = self.sunlight(ray, random, &response);
        for lamp in self.scene.lamps.iter().filter(|lamp| lamp.radius_m == 0.0) {
            let offset = lamp.position_m - ray.origin;
            let range = offset.length();
            let direction = offset / range;
            let irradiance = self.beam(lamp, -lamp.forward.dot(direction))
                * self
                    .medium
                    .transmittance(ray.origin, direction, range, random)
                / (range * range);
            if irradiance > 0.0 && self.nearest(&Ray { direction, ..*ray }, range).is_none() {
                light += irradiance * response(direction);
            }
        }
        light
    }

    /// The sun's part of [`Self::light_of_points`]. Without a surface the sun is infinitely far away through the
    /// water.
    fn sunlight(&self, ray: &Ray, random: &mut Random, response: &impl Fn(DVec3) -> f64) -> f64 {
        let Some(sun) = self.scene.sun else {
            return 0.0;
        };
        let towards_in_air = -sun.travel_direction;
        let in_air = Ray {
            direction: towards_in_air,
            ..*ray
        };
        let irradiance = sun.irradiance[self.channel];
        if ray.in_air || (self.height == f64::INFINITY && self.medium.is_clear()) {
            let clear = self.nearest(&in_air, f64::INFINITY).is_none();
            return if clear {
                irradiance * response(towards_in_air)
            } else {
                0.0
            };
        }
        if self.height == f64::INFINITY {
            return 0.0;
        }
        let (reflectance, cosine) = fresnel(towards_in_air.z, 1.0 / self.index);
        let (x, y) = (towards_in_air.x / self.index, towards_in_air.y / self.index);
        let direction = DVec3::new(x, y, cosine);
        let range = (self.height - ray.origin.z) / cosine;
        let exit = Ray {
            origin: ray.origin + range * direction,
            from: None,
            ..in_air
        };
        let clear = self.nearest(&Ray { direction, ..*ray }, range).is_none()
            && self.nearest(&exit, f64::INFINITY).is_none();
        if !clear {
            return 0.0;
        }
        // What passes a horizontal square metre in the air passes it in the water, but for the reflected share.
        let below = irradiance * (1.0 - reflectance) * towards_in_air.z / cosine;
        below
            * self
                .medium
                .transmittance(ray.origin, direction, range, random)
            * response(direction)
    }
}
