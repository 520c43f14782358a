//! Stage 2: the scene as flat tables for the integrators.

mod bvh;
mod daylight;
mod geometry;
mod lamps;
mod medium;
mod needs;

use glam::DVec3;

pub use daylight::{Boundary, SunBeam};
pub use geometry::{Geometry, Hit, Primitive, SurfacePoint};
pub use lamps::PreparedLamp;
pub use medium::{Medium, Strategies};
pub use needs::Needs;

use crate::scene::{Camera, Scene};

/// Everything an integrator reads.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The camera.
    pub camera: Camera,
    /// The water; `None` in air or in perfectly clear water.
    pub medium: Option<Medium>,
    /// The water surface; `None` when the medium fills all space.
    pub boundary: Option<Boundary>,
    /// Surfaces.
    pub geometry: Geometry,
    /// Lamps in scene order.
    pub lamps: Vec<PreparedLamp>,
    /// Names of the lamps.
    pub lamp_names: Vec<String>,
    /// The sun, where its light can arrive.
    pub sun: Option<SunBeam>,
    /// Sky radiance, W/(m² sr).
    pub sky: [f64; 3],
    /// What the scene makes use of.
    pub needs: Needs,
}

impl Prepared {
    /// Flattens `scene`.
    pub fn build(scene: &Scene) -> Self {
        let medium = scene.water.as_ref().and_then(Medium::build);
        let boundary = Boundary::build(scene);
        let geometry = Geometry::build(scene);
        let lamps: Vec<_> = scene.lamps.iter().map(PreparedLamp::build).collect();
        // Without a surface the sun would be infinitely far away through the water.
        let lit = boundary.is_some() || medium.is_none();
        let sun = SunBeam::build(scene, boundary.as_ref()).filter(|_| lit);
        let needs = Needs::analyse(
            medium.as_ref(),
            boundary.as_ref(),
            &geometry,
            &lamps,
            sun.as_ref(),
            scene,
        );
        Self {
            camera: scene.camera.clone(),
            medium,
            boundary,
            geometry,
            lamps,
            lamp_names: scene.lamps.iter().map(|l| l.name.clone()).collect(),
            sun,
            sky: scene.sky_radiance,
            needs,
        }
    }

    /// Whether `point` lies in the air above a water surface.
    #[inline]
    pub fn in_air(&self, point: DVec3) -> bool {
        self.boundary.is_some_and(|b| point.z > b.height)
    }

    /// Distance along `direction` from a point in the water to the surface; infinite when there is none ahead.
    #[inline]
    pub fn distance_to_boundary(&self, origin: DVec3, direction: DVec3) -> f64 {
        match self.boundary {
            Some(b) if direction.z > 0.0 => ((b.height - origin.z) / direction.z).max(0.0),
            _ => f64::INFINITY,
        }
    }

    /// `point` mirrored at the water surface.
    #[inline]
    pub fn mirror(&self, point: DVec3) -> DVec3 {
        let height = self.boundary.map_or(0.0, |b| b.height);
        DVec3::new(point.x, point.y, 2.0 * height - point.z)
    }
}
