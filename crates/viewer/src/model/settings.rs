//! Everything a person can set about the picture.

use glam::DVec3;
use uw_media::spectral::{Curve, sky_light, sunlight};
use uw_media::{MediaError, Vignetting};
use uw_render::scene::{
    Camera, Encoding, Exposure, Falloff, Lamp, Noise, RenderSettings, Scene, Sensor, Snow,
    Spectral, WaterSurface, WhiteBalance,
};

use super::scene_text::inline;
use super::{CameraSettings, LightSpectrum, ResponseSettings, Water};

/// The settings: what a scene file says.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The water; `None` is air.
    pub water: Option<Water>,
    /// Marine snow in it.
    pub snow: Option<Snow>,
    /// The water surface; `None` when the water fills all space.
    pub surface: Option<Surface>,
    /// The sun.
    pub sun: Option<Sun>,
    /// Relative spectrum of the sun's light.
    pub sun_spectrum: Option<LightSpectrum>,
    /// Sky radiance, W/(m² sr).
    pub sky_radiance: [f64; 3],
    /// Relative spectrum of the sky's light.
    pub sky_spectrum: Option<LightSpectrum>,
    /// The camera.
    pub camera: CameraSettings,
    /// Response of the camera's channels.
    pub response: ResponseSettings,
    /// Whether surfaces have reflectances by wavelength.
    pub spectral_surfaces: bool,
    /// The lamps.
    pub lamps: Vec<LampSettings>,
    /// The `[[object]]` tables of the scene file.
    pub objects: Vec<toml::Value>,
    /// The sensor.
    pub sensor: SensorSettings,
    /// Samples per pixel after which a render is done, unless a target error is set.
    pub samples_per_pixel: u32,
    /// Largest number of scatterings and reflections; 0: unlimited.
    pub max_bounces: u32,
}

/// What daylight in the water hangs on, besides the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct WaterAndSky {
    water: Option<Water>,
    sun: Option<Sun>,
    sky_radiance: [f64; 3],
    spectra: [Option<LightSpectrum>; 2],
    response: ResponseSettings,
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
    /// Relative spectrum of its light.
    pub spectrum: Option<LightSpectrum>,
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
    /// White balance.
    pub white_balance: Balance,
    /// What the channels become after it, row by row.
    pub color_matrix: [[f64; 3]; 3],
    /// What the lens leaves of the light away from the middle.
    pub vignetting: Option<Vignetting>,
}

/// White balance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Balance {
    /// Channels as they are.
    None,
    /// The means of a picture's channels become equal.
    Gray,
    /// White is white under daylight (D65) without water.
    Daylight,
    /// Factors of R, G and B.
    Gains([f64; 3]),
}

impl SensorSettings {
    /// What a scene file says; `white_balance` is the file's own word, where it has one.
    pub fn read(sensor: &Sensor, white_balance: Option<&str>) -> Self {
        Self {
            exposure: sensor.exposure,
            encoding: sensor.encoding,
            bits: sensor.bits,
            noise: sensor.noise,
            white_balance: match (white_balance, sensor.white_balance) {
                (Some("d65"), _) => Balance::Daylight,
                (_, WhiteBalance::None) => Balance::None,
                (_, WhiteBalance::Gray) => Balance::Gray,
                (_, WhiteBalance::Gains(gains)) => Balance::Gains(gains),
            },
            color_matrix: sensor.color_matrix,
            vignetting: sensor.vignetting,
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
            spectrum: None,
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
            spectrum: self.spectrum.as_ref().map(LightSpectrum::curve),
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

    /// Whether the water differs from place to place.
    pub fn water_varies(&self) -> bool {
        self.water.as_ref().is_some_and(Water::varies)
    }

    /// The scene without objects, for [`uw_render::prepare::Prepared::build_with`].
    ///
    /// # Errors
    /// A parameter of the water outside its range.
    pub fn scene(&self) -> Result<Scene, MediaError> {
        let water = self.water.as_ref();
        Ok(Scene {
            water: water
                .map(|w| w.build(&self.response.response))
                .transpose()?,
            surface: self.surface.map(|s| WaterSurface {
                height_m: s.height_m,
                refractive: s.refractive,
            }),
            sun: self.sun.as_ref().map(Sun::build),
            sky_radiance: self.sky_radiance,
            camera: self.placed_camera(),
            snow: self.snow_in_view(),
            spectral: self.spectral()?,
            lamps: self.lit_lamps().map(LampSettings::build).collect(),
            quads: Vec::new(),
            meshes: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            sensor: Some(self.sensor()),
            render: RenderSettings {
                samples_per_pixel: self.samples_per_pixel,
                max_bounces: self.max_bounces,
            },
            warnings: Vec::new(),
        })
    }

    /// The camera, its port in what the scene has there.
    pub fn placed_camera(&self) -> Camera {
        let water_index = self.water.as_ref().map(|water| water.refractive_index);
        let surface_m = self.surface.map(|surface| surface.height_m);
        self.camera.build().placed(water_index, surface_m)
    }

    /// Marine snow where there is water that holds it and a camera that shows it.
    pub fn snow_in_view(&self) -> Option<Snow> {
        let shown = self.water.is_some() && self.camera.build().shows_flakes();
        self.snow.filter(|_| shown)
    }

    /// The scene by wavelength; `None` where the three channels are all there is, as scene files have it.
    fn spectral(&self) -> Result<Option<Spectral>, MediaError> {
        let water = match &self.water {
            Some(water) => water.coefficients.spectrum()?,
            None => None,
        };
        let lights = self.lamps.iter().map(|lamp| &lamp.spectrum);
        let mut lights = lights.chain([&self.sun_spectrum, &self.sky_spectrum]);
        let is_said = self.spectral_surfaces
            || self.response.entry.is_some()
            || lights.any(|spectrum| spectrum.is_some());
        if water.is_none() && (self.water.is_some() || !is_said) {
            return Ok(None);
        }
        let zenith_deg = self.sun.map_or(0.0, |sun| sun.zenith_deg);
        let of = |light: &Option<LightSpectrum>, clear: fn(f64) -> Curve| {
            let curve = |light: &LightSpectrum| light.curve_or(|| clear(zenith_deg));
            light.as_ref().map(curve)
        };
        Ok(Some(Spectral {
            water,
            response: self.response.response.clone(),
            sun: of(&self.sun_spectrum, sunlight),
            sky: of(&self.sky_spectrum, sky_light),
            lights: self.named_lights(),
        }))
    }

    /// Which light has which spectrum, in the words of scene files.
    fn named_lights(&self) -> Vec<String> {
        let name = |of: &str, light: &Option<LightSpectrum>| {
            let light = light.as_ref()?;
            Some(format!("{of}spectrum {}", inline(&light.entry)))
        };
        let sun_and_sky = [
            name("sun.", &self.sun_spectrum),
            name("sky.", &self.sky_spectrum),
        ];
        let lamps = self.lamps.iter().zip(1..);
        let lamps = lamps.map(|(lamp, i)| name(&format!("lamp {i} "), &lamp.spectrum));
        sun_and_sky.into_iter().chain(lamps).flatten().collect()
    }

    /// The sensor as the renderer takes it.
    pub fn sensor(&self) -> Sensor {
        let sensor = &self.sensor;
        Sensor {
            exposure: sensor.exposure,
            encoding: sensor.encoding,
            bits: sensor.bits,
            noise: sensor.noise,
            white_balance: match sensor.white_balance {
                Balance::None => WhiteBalance::None,
                Balance::Gray => WhiteBalance::Gray,
                Balance::Gains(gains) => WhiteBalance::Gains(gains),
                Balance::Daylight => match self.spectral() {
                    Ok(Some(spectral)) => spectral
                        .daylight_gains()
                        .map_or(WhiteBalance::None, WhiteBalance::Gains),
                    _ => WhiteBalance::None,
                },
            },
            color_matrix: sensor.color_matrix,
            vignetting: sensor.vignetting,
        }
    }

    /// What daylight in the water hangs on, besides the surface's height.
    pub fn water_and_sky(&self) -> WaterAndSky {
        WaterAndSky {
            water: self.water.clone(),
            sun: self.sun,
            sky_radiance: self.sky_radiance,
            spectra: [self.sun_spectrum.clone(), self.sky_spectrum.clone()],
            response: self.response.clone(),
        }
    }

    /// The lamps that can be rendered: not those above the surface whose disk reaches into the water.
    fn lit_lamps(&self) -> impl Iterator<Item = &LampSettings> {
        let surface = self.surface.filter(|_| self.water.is_some());
        self.lamps.iter().filter(move |lamp| {
            let upright_m = lamp.forward.truncate().length() * lamp.radius_m;
            surface.is_none_or(|surface| {
                let above_m = lamp.position_m.z - surface.height_m;
                above_m <= 0.0 || above_m >= upright_m
            })
        })
    }

    /// Names of lamps that are left out because they are partly in the air.
    pub fn lamps_across_surface(&self) -> Vec<&str> {
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

    /// Whether a render of these settings gives the same radiance as one of `other` before the same surfaces: the sensor
    /// and the end of the render do not count.
    pub fn same_light(&self, other: &Self) -> bool {
        let bare = |s: &Self| Self {
            sensor: self.sensor,
            samples_per_pixel: 0,
            objects: Vec::new(),
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
