//! Sun and sky as seen from inside the water, and the surface they come through.

use glam::DVec3;
use uw_media::Spectrum;
use uw_media::interface::fresnel_reflectance;

use crate::scene::Scene;

/// The flat boundary between water (below) and air.
#[derive(Clone, Copy, Debug)]
pub struct Boundary {
    /// Height, m.
    pub height: f64,
    /// Refractive index of the water against air; 1 for an index-matched surface.
    pub index: f64,
}

impl Boundary {
    /// The boundary of `scene`, when it has water and a surface.
    pub fn build(scene: &Scene) -> Option<Self> {
        let (water, surface) = (scene.water.as_ref()?, scene.surface?);
        let index = if surface.refractive {
            water.refractive_index
        } else {
            1.0
        };
        Some(Self {
            height: surface.height_m,
            index,
        })
    }

    /// Reflectance for light inside the water, `cosine` > 0 against the vertical.
    #[inline]
    pub fn internal_reflectance(&self, cosine: f64) -> f64 {
        if self.index == 1.0 {
            0.0
        } else {
            fresnel_reflectance(cosine, self.index, 1.0)
        }
    }

    /// Reflectance for light in the air, `cosine` > 0 against the vertical.
    #[inline]
    pub fn external_reflectance(&self, cosine: f64) -> f64 {
        if self.index == 1.0 {
            0.0
        } else {
            fresnel_reflectance(cosine, 1.0, self.index)
        }
    }

    /// Direction in the water of light or sight that goes down along `direction` in the air.
    pub fn refract_into_water(&self, direction: DVec3) -> DVec3 {
        let (x, y) = (direction.x / self.index, direction.y / self.index);
        DVec3::new(x, y, -(1.0 - x * x - y * y).max(0.0).sqrt())
    }
}

/// Half the apparent width of the sun, rad: 695,700 km from 149.6 million km.
const SUN_RADIUS_RAD: f64 = 4.650e-3;

/// The sun's beam, parallel but for the width of its disk, inside the water where there is a surface, else in space.
#[derive(Clone, Copy, Debug)]
pub struct SunBeam {
    /// Unit direction towards the sun in the water.
    pub towards: DVec3,
    /// Unit direction towards the sun in the air.
    pub towards_in_air: DVec3,
    /// Irradiance on a plane perpendicular to the beam just below the surface, W/m² per channel.
    pub irradiance: Spectrum,
    /// The same in the air.
    pub irradiance_in_air: Spectrum,
    /// Half the width of its disk in the water, rad: of a round one of the same solid angle.
    pub radius_rad: f64,
}

impl SunBeam {
    /// The beam of the scene's sun, if it shines.
    pub fn build(scene: &Scene, boundary: Option<&Boundary>) -> Option<Self> {
        let sun = scene.sun?;
        if sun.irradiance.iter().all(|&e| e == 0.0) {
            return None;
        }
        let in_air = sun.travel_direction;
        let (travel, factor) = match boundary {
            // Energy through a horizontal plane: E' cos' = E cos (1 - R).
            Some(b) => {
                let travel = b.refract_into_water(in_air);
                (
                    travel,
                    (1.0 - b.external_reflectance(-in_air.z)) * in_air.z / travel.z,
                )
            }
            None => (in_air, 1.0),
        };
        // dω' cos' n² = dω cos.
        let squeezed = match boundary {
            Some(b) => in_air.z / (travel.z * b.index * b.index),
            None => 1.0,
        };
        Some(Self {
            radius_rad: SUN_RADIUS_RAD * squeezed.sqrt(),
            towards: -travel,
            towards_in_air: -in_air,
            irradiance: sun.irradiance.map(|e| e * factor),
            irradiance_in_air: sun.irradiance,
        })
    }
}
