//! What one ray through the picture meets, with the light that comes straight from there: no random numbers, no noise.

use glam::{DVec2, DVec3};
use uw_media::Spectrum;

use crate::prepare::{AirWay, Hit, Prepared, PreparedLamp, Primitive};
use crate::sampling::circle;
use crate::scene::CameraRay;

/// Kinds of what is met: nothing, by way of the water surface or not; surfaces follow.
const OPEN: u32 = 0;
/// Added to the kind of what is seen through the water surface.
const THROUGH_SURFACE: u32 = 1;
/// Added to the kind of what is seen mirrored in it.
const MIRRORED: u32 = 2;
const PARALLELOGRAM: u32 = 1 << 30;
const TRIANGLE: u32 = 2 << 30;

/// What a ray meets first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// Equal for points of one object that are seen in the same way.
    pub(super) kind: u32,
    /// Length of the ray, m; infinite where nothing is met.
    pub(super) range_m: f64,
    /// The point met, as if the ray had gone straight on, m.
    pub(super) apparent: DVec3,
    /// Geometric normal there.
    pub(super) normal: DVec3,
    /// Cosine between it and the way back.
    pub(super) facing: f64,
    /// Shading normal there.
    pub(super) shading_normal: DVec3,
    /// Transmittance of the water up to there.
    pub(super) transmittance: Spectrum,
    /// Reflectance.
    pub(super) reflectance: Spectrum,
    /// Length of the part of the ray on which samples scatter, m: from the eye or the water surface to what comes next; none
    /// where there is no such part.
    pub(super) wet_m: Option<f64>,
    primitive: Primitive,
    /// The point on the primitive, as [`Hit`] has it.
    local: [f64; 2],
    point: DVec3,
    emission: Spectrum,
}

/// Light that comes unscattered from a point on a surface, W/(m² sr), about.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StraightLight {
    /// Of the lamps, and emitted by the surface.
    pub(super) lamps: Spectrum,
    /// Of the sun and the sky.
    pub(super) day: Spectrum,
}

/// What a ray through a pixel tells of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Transmittance of the water before it.
    pub(super) transmittance: Spectrum,
    /// Reflectance.
    pub(super) reflectance: Spectrum,
    /// Shading normal.
    pub(super) shading_normal: DVec3,
}

/// The part of a ray before and after the water surface.
struct Ray {
    origin: DVec3,
    direction: DVec3,
    before_m: f64,
    kind: u32,
}

impl Look {
    /// Along the ray through the image point (`x`, `y`), pixels from the top left corner, and a point of the lens's opening in its radii.
    pub(super) fn through(scene: &Prepared, (x, y): (f64, f64), on_opening: DVec2) -> Self {
        let CameraRay {
            origin_m: eye,
            direction,
        } = scene.camera.ray_from(x, y, on_opening);
        let geometry = &scene.geometry;
        let first = geometry.closest(eye, direction, f64::INFINITY, Primitive::None);
        let straight = Ray {
            origin: eye,
            direction,
            before_m: 0.0,
            kind: OPEN,
        };
        let Some(bent) = bent(
            scene,
            eye,
            direction,
            first.map_or(f64::INFINITY, |hit| hit.t),
        ) else {
            return Self::at(scene, &straight, (eye, direction), first);
        };
        let hit = geometry.closest(bent.origin, bent.direction, f64::INFINITY, Primitive::None);
        Self::at(scene, &bent, (eye, direction), hit)
    }

    fn at(scene: &Prepared, ray: &Ray, (eye, sight): (DVec3, DVec3), hit: Option<Hit>) -> Self {
        let length_m = hit.as_ref().map_or(f64::INFINITY, |hit| hit.t);
        let wet_m = match (scene.in_air(eye), ray.kind == OPEN) {
            (true, true) => None,
            (false, false) => Some(ray.before_m),
            _ => Some(length_m),
        };
        let Some(hit) = hit else {
            return Self {
                kind: ray.kind,
                range_m: f64::INFINITY,
                apparent: eye + sight,
                normal: -sight,
                facing: 1.0,
                shading_normal: DVec3::ZERO,
                transmittance: [0.0; 3],
                reflectance: [0.0; 3],
                wet_m,
                primitive: Primitive::None,
                local: [0.0; 2],
                point: eye,
                emission: [0.0; 3],
            };
        };
        let surface = scene.geometry.surface_point(&hit, ray.direction);
        let object = match hit.primitive {
            Primitive::Quad(index) => PARALLELOGRAM | (index << 2),
            _ => TRIANGLE | ((surface.material as u32) << 2),
        };
        let range_m = ray.before_m + hit.t;
        let point = ray.origin + hit.t * ray.direction;
        let wet = |from: DVec3, along: DVec3, length_m: f64| {
            let middle = from + 0.5 * length_m * along;
            if length_m == 0.0 || scene.in_air(middle) {
                [1.0; 3]
            } else {
                scene.transmittance(&scene.way(from, along, length_m))
            }
        };
        let before = wet(eye, sight, ray.before_m);
        let after = wet(ray.origin, ray.direction, hit.t);
        Self {
            kind: ray.kind | object,
            range_m,
            apparent: eye + range_m * sight,
            normal: surface.normal,
            facing: -surface.normal.dot(ray.direction),
            shading_normal: surface.shading_normal,
            transmittance: std::array::from_fn(|k| before[k] * after[k]),
            reflectance: reflectance(scene, surface.reflectance, surface.material),
            wet_m,
            primitive: hit.primitive,
            local: hit.local,
            point,
            emission: surface.emission,
        }
    }

    /// Whether another look meets the same primitive in the same way.
    pub(super) fn is_beside(&self, other: &Self) -> bool {
        self.primitive == other.primitive && self.kind == other.kind
    }

    /// The point that is met, m.
    pub(super) fn point(&self) -> DVec3 {
        self.point
    }

    /// The material that is met and the place in its textures; none where that says too little.
    pub(super) fn place_in_texture(&self, scene: &Prepared) -> Option<(usize, DVec2)> {
        scene.geometry.place_in_texture(self.primitive, self.local)
    }

    /// What tells of a surface.
    pub(super) fn seen(&self) -> Seen {
        Seen {
            transmittance: self.transmittance,
            reflectance: self.reflectance,
            shading_normal: self.shading_normal,
        }
    }

    /// What is met a little beside, at `point` of the same primitive.
    pub(super) fn moved(&self, point: DVec3, seen: &Seen, emission: Spectrum) -> Self {
        Self {
            shading_normal: seen.shading_normal,
            transmittance: seen.transmittance,
            reflectance: seen.reflectance,
            point,
            emission,
            ..*self
        }
    }

    /// Light that comes straight to the eye: as the sun, an even sky and the points `disk` of the lamps' disks, two numbers in
    /// [0, 1) by area and turn, would light the point through water that scatters nothing back.
    pub(super) fn straight_light(&self, scene: &Prepared, disk: (f64, f64)) -> StraightLight {
        if self.primitive == Primitive::None {
            return StraightLight::default();
        }
        let mut light = StraightLight {
            lamps: std::array::from_fn(|k| self.emission[k] * self.transmittance[k]),
            day: [0.0; 3],
        };
        for lamp in 0..scene.lamps.len() {
            let irradiance = self.of_lamp(scene, lamp, disk);
            self.reflect(irradiance, &mut light.lamps);
        }
        let sun = self.of_sun(scene);
        let sky = self.of_sky(scene);
        self.reflect(std::array::from_fn(|k| sun[k] + sky[k]), &mut light.day);
        light
    }

    fn reflect(&self, irradiance: Spectrum, sum: &mut Spectrum) {
        for k in 0..3 {
            let left = self.reflectance[k] / std::f64::consts::PI * self.transmittance[k];
            sum[k] += left * irradiance[k];
        }
    }

    fn of_lamp(&self, scene: &Prepared, index: usize, (area, turn): (f64, f64)) -> Spectrum {
        let lamp = &scene.lamps[index];
        let (sine, cosine) = circle(turn);
        let aside = cosine * lamp.tangent.0 + sine * lamp.tangent.1;
        let source = lamp.position + lamp.radius * area.sqrt() * aside;
        if let Some(boundary) = scene.boundary.filter(|_| lamp.in_air) {
            return self.of_lamp_in_air(
                scene,
                lamp,
                &AirWay::between(&boundary, self.point, source),
            );
        }
        let offset = source - self.point;
        let distance_m = offset.length();
        let towards = offset / distance_m;
        let cosine = self.shading_normal.dot(towards);
        let strength = lamp.level * lamp.relative_intensity(-towards);
        if !(cosine > 0.0 && strength > 0.0 && self.normal.dot(towards) > 0.0) {
            return [0.0; 3];
        }
        let geometry = &scene.geometry;
        // Short of the lamp, which may be set into a surface.
        if geometry.occluded(
            self.point,
            towards,
            distance_m * (1.0 - 1e-9),
            self.primitive,
        ) {
            return [0.0; 3];
        }
        let left = scene.transmittance(&scene.way(self.point, towards, distance_m));
        let factor = strength * cosine / (distance_m * distance_m);
        std::array::from_fn(|k| factor * lamp.intensity[k] * left[k])
    }

    fn of_lamp_in_air(&self, scene: &Prepared, lamp: &PreparedLamp, way: &AirWay) -> Spectrum {
        let cosine = self.shading_normal.dot(way.towards);
        let strength = lamp.level * lamp.relative_intensity(-way.in_air) * way.spread;
        let is_lit = cosine > 0.0 && strength > 0.0 && self.normal.dot(way.towards) > 0.0;
        if !is_lit || !way.is_open(scene, self.point, self.primitive) {
            return [0.0; 3];
        }
        let left = scene.transmittance(&scene.way(self.point, way.towards, way.wet_m));
        std::array::from_fn(|k| strength * cosine * lamp.intensity[k] * left[k])
    }

    fn of_sun(&self, scene: &Prepared) -> Spectrum {
        let Some(sun) = &scene.sun else {
            return [0.0; 3];
        };
        let dry = scene.boundary.is_none() || scene.in_air(self.point);
        let (towards, full) = if dry {
            (sun.towards_in_air, sun.irradiance_in_air)
        } else {
            (sun.towards, sun.irradiance)
        };
        let cosine = self.shading_normal.dot(towards);
        let reach = match dry {
            true => f64::INFINITY,
            false => scene.depth(self.point) / towards.z,
        };
        let is_lit = cosine > 0.0 && self.normal.dot(towards) > 0.0;
        if !is_lit
            || scene
                .geometry
                .occluded(self.point, towards, reach, self.primitive)
        {
            return [0.0; 3];
        }
        let left = match dry {
            true => [1.0; 3],
            false => scene.transmittance(&scene.way(self.point, towards, reach)),
        };
        std::array::from_fn(|k| cosine * full[k] * left[k])
    }

    fn of_sky(&self, scene: &Prepared) -> Spectrum {
        if scene.sky == [0.0; 3] {
            return [0.0; 3];
        }
        let seen = 0.5 * (1.0 + self.shading_normal.z);
        let depth_m = scene.depth(self.point);
        let left = scene.transmittance(&scene.way(self.point, DVec3::Z, depth_m));
        std::array::from_fn(|k| seen * std::f64::consts::PI * scene.sky[k] * left[k])
    }
}

/// Reflectance of the channels of a surface of a material that is mixed of `rgb`.
pub(super) fn reflectance(scene: &Prepared, rgb: Spectrum, material: usize) -> Spectrum {
    match &scene.spectrum {
        Some(spectrum) => spectrum.reflectance(rgb, material),
        None => rgb,
    }
}

/// The ray after the water surface, where it comes to it before `reach_m`.
fn bent(scene: &Prepared, eye: DVec3, direction: DVec3, reach_m: f64) -> Option<Ray> {
    let boundary = scene.boundary?;
    let above_m = eye.z - boundary.height;
    let before_m = -above_m / direction.z;
    if !(before_m > 0.0 && before_m < reach_m) {
        return None;
    }
    let mut origin = eye + before_m * direction;
    origin.z = boundary.height;
    let (direction, kind) = if above_m > 0.0 {
        (boundary.refract_into_water(direction), THROUGH_SURFACE)
    } else {
        let (x, y) = (direction.x * boundary.index, direction.y * boundary.index);
        let square = 1.0 - x * x - y * y;
        if square > 0.0 {
            (DVec3::new(x, y, square.sqrt()), THROUGH_SURFACE)
        } else {
            let mirrored = DVec3::new(direction.x, direction.y, -direction.z);
            (mirrored, MIRRORED)
        }
    };
    Some(Ray {
        origin,
        direction,
        before_m,
        kind,
    })
}
