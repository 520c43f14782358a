//! The first segment of every path of a sample: from the camera to the first surface, shared by all walks.

use glam::DVec3;

use crate::prepare::{Prepared, Primitive, SurfacePoint};

/// What ends a segment.
#[derive(Clone, Copy, Debug)]
pub enum End {
    /// A scattering after this distance, m.
    Scatter(f64),
    /// A surface at this distance, m.
    Surface(f64, SurfacePoint, Primitive),
    /// The underside of the water surface at this distance, m.
    Boundary(f64),
    /// Nothing: the segment is infinitely long.
    Nothing,
}

impl End {
    /// Distance, m, where it is finite.
    pub fn distance(&self) -> Option<f64> {
        match self {
            Self::Scatter(t) | Self::Surface(t, ..) | Self::Boundary(t) => Some(*t),
            Self::Nothing => None,
        }
    }
}

/// The part of a camera ray that runs through the water (or through space, where there is no water).
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Start, m.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Length to its end, m; may be infinite.
    pub length: f64,
}

/// A camera ray.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// Origin of the ray in space, m.
    pub origin: DVec3,
    /// Unit direction at the camera.
    pub direction: DVec3,
    /// Surface met in the air before the water, with its distance.
    pub in_air: Option<(f64, SurfacePoint, Primitive)>,
    /// Length in the air before the water surface, m; infinite when the ray never gets there; 0 for a camera
    /// in the water.
    pub air_length: f64,
    /// The part in the water.
    pub in_water: Option<Segment>,
    /// Factor of the radiance that comes out of the water: (1 − R)/n² through the surface from the air, else 1.
    pub entry_factor: f64,
    surface: Option<(f64, SurfacePoint, Primitive)>,
    boundary: bool,
}

impl CameraRay {
    /// Follows the ray to the first surface, through the water surface if the camera is in the air.
    pub fn trace(scene: &Prepared, origin: DVec3, direction: DVec3) -> Self {
        let mut ray = Self {
            origin,
            direction,
            in_air: None,
            air_length: 0.0,
            in_water: None,
            entry_factor: 1.0,
            surface: None,
            boundary: false,
        };
        let (mut start, mut towards) = (origin, direction);
        if scene.in_air(origin) {
            let Some(entry) = ray.through_air(scene) else {
                return ray;
            };
            (start, towards) = entry;
        }
        let to_boundary = scene.distance_to_boundary(start, towards);
        ray.surface = scene
            .geometry
            .closest(start, towards, to_boundary, Primitive::None)
            .map(|hit| {
                (
                    hit.t,
                    scene.geometry.surface_point(&hit, towards),
                    hit.primitive,
                )
            });
        ray.boundary = ray.surface.is_none() && to_boundary < f64::INFINITY;
        let length = ray.surface.map_or(to_boundary, |s| s.0);
        ray.in_water = Some(Segment {
            origin: start,
            direction: towards,
            length,
        });
        ray
    }

    /// The way through the air; where and along what the ray enters the water, if it does.
    fn through_air(&mut self, scene: &Prepared) -> Option<(DVec3, DVec3)> {
        let boundary = scene.boundary?;
        let down = -self.direction.z;
        self.air_length = if down > 0.0 {
            (self.origin.z - boundary.height) / down
        } else {
            f64::INFINITY
        };
        self.in_air = scene
            .geometry
            .closest(
                self.origin,
                self.direction,
                self.air_length,
                Primitive::None,
            )
            .map(|hit| {
                (
                    hit.t,
                    scene.geometry.surface_point(&hit, self.direction),
                    hit.primitive,
                )
            });
        if self.in_air.is_some() || down <= 0.0 {
            return None;
        }
        self.entry_factor =
            (1.0 - boundary.external_reflectance(down)) / (boundary.index * boundary.index);
        let mut entry = self.origin + self.air_length * self.direction;
        entry.z = boundary.height;
        Some((entry, boundary.refract_into_water(self.direction)))
    }

    /// Whether the part in the water ends on a surface.
    pub fn ends_on_surface(&self) -> bool {
        self.surface.is_some()
    }

    /// What ends the part in the water.
    pub fn end(&self) -> End {
        match (self.surface, self.in_water) {
            (Some((t, point, primitive)), _) => End::Surface(t, point, primitive),
            (None, Some(s)) if self.boundary => End::Boundary(s.length),
            _ => End::Nothing,
        }
    }
}
