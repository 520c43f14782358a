//! Everything a person can set about the picture.

use glam::DVec3;
use uw_media::MediaError;
use uw_render::scene::{
    Encoding, Exposure, Falloff, Lamp, Noise, RenderSettings, Scene, Sensor, WaterSurface,
};

use super::{CameraSettings, Water};

/// The settings: what a scene file says, without the objects.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The water; `None` is air.
    pub water: Option<Water>,
    /// The water surface; `None` when the water fills all space.
    pub surface: Option<Surface>,
    /// The sun.
    pub sun: Option<Sun>,
    /// Sky radiance, W/(m² sr).
    pub sky_radiance: [f64; 3],
    /// The camera.
    pub camera: CameraSettings,
    /// The lamps.
    pub lamps: Vec<LampSettings>,
    /// The sensor.
    pub sensor: SensorSettings,
    /// Samples per pixel after which a render is done, unless a target error is set.
    pub samples_per_pixel: u32,
    /// Largest number of scatterings and reflections; 0: unlimited.
    pub max_bounces: u32,
}

/// The water surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Height, m.
    pub height_m: f64,
    /// Whether it bends and reflects light.
    pub refractive: bool,
}

/// The sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Zenith angle in air, degrees, in [0, 90).
    pub zenith_deg: f64,
    /// Azimuth towards which its light travels, degrees from +x to +y.
    pub azimuth_deg: f64,
    /// Irradiance on a plane perpendicular to the beam, W/m².
    pub irradiance: [f64; 3],
}

/// A lamp.
#[derive(Clone, Debug, PartialEq)]
pub struct LampSettings {
    /// Unique name.
    pub name: String,
    /// Centre, m.
    pub position_m: DVec3,
    /// Unit direction of the axis.
    pub forward: DVec3,
    /// Intensity on the axis at 100 %, W/sr.
    pub intensity: [f64; 3],
    /// Level, percent.
    pub level_pct: f64,
    /// Half angle of the cone, degrees, in (0, 180].
    pub half_angle_deg: f64,
    /// Relative intensity against the angle.
    pub falloff: Falloff,
    /// The file of a beam profile, as the scene file names it.
    pub beam_file: Option<String>,
    /// Radius of the disk, m; 0 for a point.
    pub radius_m: f64,
    /// Whether it comes from a glTF file: it is not written to scene files, which read it from there.
    pub of_gltf: bool,
}

/// The sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSettings {
    /// Exposure.
    pub exposure: Exposure,
    /// Encoding.
    pub encoding: Encoding,
    /// Bits per channel, 8 or 16.
    pub bits: u32,
    /// Noise, where it is on.
    pub noise: Option<Noise>,
}

impl From<Sensor> for SensorSettings {
    fn from(sensor: Sensor) -> Self {
        Self {
            exposure: sensor.exposure,
            encoding: sensor.encoding,
            bits: sensor.bits,
            noise: sensor.noise,
        }
    }
}

impl SensorSettings {
    /// The sensor as the renderer takes it.
    pub fn build(&self) -> Sensor {
        Sensor {
            exposure: self.exposure,
            encoding: self.encoding,
            bits: self.bits,
            noise: self.noise,
            white_balance: uw_render::scene::WhiteBalance::None,
        }
    }
}

impl From<&Lamp> for LampSettings {
    fn from(lamp: &Lamp) -> Self {
        Self {
            name: lamp.name.clone(),
            position_m: lamp.position_m,
            forward: lamp.forward,
            intensity: lamp.intensity,
            level_pct: lamp.level_pct,
            half_angle_deg: lamp.half_angle_deg,
            falloff: lamp.falloff.clone(),
            beam_file: None,
            radius_m: lamp.radius_m,
            of_gltf: false,
        }
    }
}

impl LampSettings {
    fn build(&self) -> Lamp {
        Lamp {
            name: self.name.clone(),
            position_m: self.position_m,
            forward: self.forward,
            intensity: self.intensity,
            spectrum: None,
            level_pct: self.level_pct,
            half_angle_deg: self.half_angle_deg,
            falloff: self.falloff.clone(),
            radius_m: self.radius_m,
        }
    }
}

impl From<&uw_render::scene::Sun> for Sun {
    fn from(sun: &uw_render::scene::Sun) -> Self {
        let to = sun.travel_direction;
        let azimuth_deg = if to.x == 0.0 && to.y == 0.0 {
            0.0
        } else {
            to.y.atan2(to.x).to_degrees()
        };
        Self {
            // Rounded to what a person would have written.
            zenith_deg: rounded((-to.z).clamp(-1.0, 1.0).acos().to_degrees()),
            azimuth_deg: rounded(azimuth_deg),
            irradiance: sun.irradiance,
        }
    }
}

/// To 1e-9, which takes the errors of angles to directions and back away.
pub(super) fn rounded(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

impl Sun {
    fn build(&self) -> uw_render::scene::Sun {
        let (zenith, azimuth) = (self.zenith_deg.to_radians(), self.azimuth_deg.to_radians());
        let horizontal = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        uw_render::scene::Sun {
            travel_direction: horizontal * zenith.sin() - DVec3::Z * zenith.cos(),
            irradiance: self.irradiance,
        }
    }
}

impl Settings {
    /// Depth of the camera below the surface, m; `None` without a surface. Negative in the air.
    pub fn depth_m(&self) -> Option<f64> {
        self.surface.map(|s| s.height_m - self.camera.position_m.z)
    }

    /// The scene without objects, for [`uw_render::prepare::Prepared::build_with`].
    ///
    /// # Errors
    /// A parameter of the water outside its range.
    pub fn scene(&self) -> Result<Scene, MediaError> {
        Ok(Scene {
            water: self.water.as_ref().map(Water::build).transpose()?,
            surface: self.surface.map(|s| WaterSurface {
                height_m: s.height_m,
                refractive: s.refractive,
            }),
            sun: self.sun.as_ref().map(Sun::build),
            sky_radiance: self.sky_radiance,
            camera: self.camera.build(),
            spectral: None,
            lamps: self.lit_lamps().map(LampSettings::build).collect(),
            quads: Vec::new(),
            meshes: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            sensor: Some(self.sensor.build()),
            render: RenderSettings {
                samples_per_pixel: self.samples_per_pixel,
                max_bounces: self.max_bounces,
            },
            warnings: Vec::new(),
        })
    }

    /// The lamps that can be rendered: below the surface where there is one.
    fn lit_lamps(&self) -> impl Iterator<Item = &LampSettings> {
        let ceiling = match (&self.water, self.surface) {
            (Some(_), Some(surface)) => surface.height_m,
            _ => f64::INFINITY,
        };
        self.lamps
            .iter()
            .filter(move |lamp| lamp.position_m.z <= ceiling)
    }

    /// Names of lamps that are left out because they are in the air above the water.
    pub fn lamps_in_air(&self) -> Vec<&str> {
        let lit: Vec<_> = self.lit_lamps().map(|l| l.name.as_str()).collect();
        let names = self.lamps.iter().map(|l| l.name.as_str());
        names.filter(|name| !lit.contains(name)).collect()
    }

    /// A name for one more lamp.
    pub fn free_lamp_name(&self) -> String {
        let taken = |name: &str| self.lamps.iter().any(|lamp| lamp.name == name);
        (1..)
            .map(|i| format!("lamp{i}"))
            .find(|name| !taken(name))
            .unwrap_or_default()
    }

    /// Whether a render of these settings gives the same radiance as one of `other`: the sensor and the end of the
    /// render do not count.
    pub fn same_light(&self, other: &Self) -> bool {
        let bare = |s: &Self| Self {
            sensor: self.sensor,
            samples_per_pixel: 0,
            ..s.clone()
        };
        bare(self) == bare(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sun_survives_the_way_to_a_direction_and_back() {
        for (zenith_deg, azimuth_deg) in [(0.0, 0.0), (30.0, 0.0), (42.5, -120.25), (89.0, 180.0)] {
            let sun = Sun {
                zenith_deg,
                azimuth_deg,
                irradiance: [1.0, 0.9, 0.8],
            };
            assert_eq!(Sun::from(&sun.build()), sun);
        }
    }
}
