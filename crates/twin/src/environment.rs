//! A water and a target: the scenes of its views.

mod water;

pub use uw_media::spectral::JerlovWater;
pub use water::{MEAN, WaterBody};
pub use water::{PARTICLE_INDEX, WATER_INDEX};

use std::path::Path;

use glam::{DVec2, DVec3};
use uw_media::MediaError;
use uw_media::spectral::{Curve, WaterBands, sky_light, sunlight};
use uw_render::scene::{
    Camera, Exposure, Falloff, Lamp, Lens, Material, Noise, Quad, RenderSettings, Scene, Sensor,
    Spectral, Sun, Texture, TextureEncoding, TextureFilter, WaterSurface,
};

use uw_calib::vehicle::{Colours, Vehicle};
use uw_scenery::textures::Pattern;

/// Half the edge of a target, m.
const TARGET_HALF_M: f64 = 12.0;
/// How far an upright target goes on below the point the camera looks at, m; at least.
const BELOW_CENTRE_M: f64 = 12.0;

/// What the vehicle looks at.
#[derive(Clone, Debug)]
pub struct Target {
    /// Which of the project's textures.
    pub pattern: Pattern,
    /// Its picture; a tile measures [`Pattern::tile_m`].
    pub texture: Texture,
}

/// Where the vehicle is and looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// At a target at a distance.
    Target {
        /// Depth of the camera, m.
        depth_m: f64,
        /// Distance along the optical axis, m.
        distance_m: f64,
    },
    /// At a target at a distance along an optical axis that is tilted.
    Tilted {
        /// Depth of the camera, m.
        depth_m: f64,
        /// Distance along the optical axis, m.
        distance_m: f64,
        /// Angle of the axis from the target's normal towards the image's lower edge, degrees.
        tilt_deg: f64,
    },
    /// Straight up to the surface.
    Up {
        /// Depth of the camera, m.
        depth_m: f64,
    },
}

/// An environment cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum EnvironmentError {
    /// The water's parameters are wrong.
    #[error(transparent)]
    Water(#[from] MediaError),
    /// A texture cannot be read.
    #[error("{path}: {reason}")]
    Texture {
        /// The file.
        path: String,
        /// What is wrong.
        reason: String,
    },
}

impl Target {
    /// Reads the texture of `pattern` from the folder of assets.
    pub fn read(pattern: Pattern, assets: &Path) -> Result<Self, EnvironmentError> {
        let path = assets
            .join("textures")
            .join(format!("{}.png", pattern.name()));
        let texture = Texture::read(&path, TextureEncoding::Srgb, TextureFilter::Bilinear)
            .map_err(|reason| EnvironmentError::Texture {
                path: path.display().to_string(),
                reason: reason.to_string(),
            })?;
        Ok(Self { pattern, texture })
    }

    /// Whether the target lies on the bottom, seen from above, rather than standing upright.
    pub fn is_bottom(&self) -> bool {
        is_bottom(self.pattern)
    }
}

/// Whether a target of this texture lies on the bottom, seen from above, rather than standing upright.
pub fn is_bottom(pattern: Pattern) -> bool {
    matches!(
        pattern,
        Pattern::Seabed | Pattern::Gravel | Pattern::KelpSediment | Pattern::CoralRock
    )
}

/// The scene of `view` in `water` in three bands; both lamps at 100 %. A view up shows no target.
pub fn scene(
    vehicle: &Vehicle,
    water: &WaterBody,
    target: &Target,
    view: View,
) -> Result<Scene, EnvironmentError> {
    scene_in(vehicle, water, MEAN, target, view)
}

/// The same in `bands`.
pub fn scene_in(
    vehicle: &Vehicle,
    water: &WaterBody,
    bands: WaterBands,
    target: &Target,
    view: View,
) -> Result<Scene, EnvironmentError> {
    let square_on = if target.is_bottom() {
        (-DVec3::Z, DVec3::X)
    } else {
        (DVec3::X, DVec3::Z)
    };
    let (depth_m, (forward, up)) = match view {
        View::Up { depth_m } => (depth_m, (DVec3::Z, DVec3::X)),
        View::Target { depth_m, .. } => (depth_m, square_on),
        View::Tilted {
            depth_m, tilt_deg, ..
        } => (depth_m, tilted(square_on, tilt_deg)),
    };
    let position_m = DVec3::new(0.0, 0.0, -depth_m);
    let camera = camera(vehicle, position_m, forward, up);
    let colours = vehicle.colours()?;
    let zenith = vehicle.sun_zenith_deg.to_radians();
    let mut scene = Scene {
        water: Some(water.water(bands, &colours.response)?),
        surface: Some(WaterSurface {
            height_m: 0.0,
            refractive: true,
        }),
        sun: Some(Sun {
            travel_direction: DVec3::new(zenith.sin(), 0.0, -zenith.cos()),
            irradiance: [vehicle.sun_irradiance; 3],
        }),
        sky_radiance: [vehicle.sky_radiance; 3],
        snow: None,
        spectral: spectral(vehicle, water, bands, &colours)?,
        lamps: lamps(vehicle, &camera, colours.lamps.as_ref()),
        camera,
        quads: Vec::new(),
        meshes: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        sensor: Some(sensor(vehicle, vehicle.exposure)),
        render: RenderSettings {
            samples_per_pixel: 32,
            max_bounces: 0,
        },
        warnings: Vec::new(),
    };
    match view {
        View::Target { distance_m, .. } | View::Tilted { distance_m, .. } => {
            let (inwards, along) = square_on;
            let centre = position_m + distance_m * forward;
            scene.quads.push(quad(target, centre, inwards, along));
            scene.materials.push(Material {
                reflectance: [1.0; 3],
                texture: Some(0),
                ..Material::default()
            });
            scene.textures.push(target.texture.clone());
        }
        View::Up { .. } => scene.lamps.clear(),
    }
    Ok(scene)
}

/// The axes (forward, up) turned by `tilt_deg` towards the image's lower edge.
fn tilted((forward, up): (DVec3, DVec3), tilt_deg: f64) -> (DVec3, DVec3) {
    let (sin, cos) = tilt_deg.to_radians().sin_cos();
    (cos * forward - sin * up, cos * up + sin * forward)
}

/// The vehicle's sensor at a given exposure.
pub fn sensor(vehicle: &Vehicle, exposure: f64) -> Sensor {
    Sensor {
        exposure: Exposure::Fixed(exposure),
        encoding: vehicle.encoding,
        bits: 8,
        noise: Some(Noise {
            a: vehicle.noise_a,
            b: vehicle.noise_b,
        }),
        ..Sensor::default()
    }
}

fn camera(vehicle: &Vehicle, position_m: DVec3, forward: DVec3, up: DVec3) -> Camera {
    let (width, height) = (f64::from(vehicle.width), f64::from(vehicle.height));
    let focal = 0.5 * width / (0.5 * vehicle.hfov_deg.to_radians()).tan();
    Camera {
        position_m,
        forward,
        right: forward.cross(up),
        down: -up,
        width: vehicle.width,
        height: vehicle.height,
        focal_px: DVec2::splat(focal),
        centre_px: 0.5 * DVec2::new(width, height),
        lens: Lens::default(),
        opening: None,
        port: None,
    }
}

/// The scene by wavelength; `None` in three bands.
fn spectral(
    vehicle: &Vehicle,
    water: &WaterBody,
    bands: WaterBands,
    colours: &Colours,
) -> Result<Option<Spectral>, EnvironmentError> {
    let spectrum = bands.spectrum(water.jerlov)?;
    let spectral = spectrum.map(|spectrum| Spectral::of(spectrum, colours.response.clone()));
    let clear = vehicle.daylight_spectrum.is_some();
    let zenith_deg = vehicle.sun_zenith_deg;
    Ok(spectral.map(|spectral| Spectral {
        sun: clear.then(|| sunlight(zenith_deg)),
        sky: clear.then(|| sky_light(zenith_deg)),
        ..spectral
    }))
}

fn lamps(vehicle: &Vehicle, camera: &Camera, spectrum: Option<&Curve>) -> Vec<Lamp> {
    [("left", -1.0), ("right", 1.0)]
        .map(|(name, side)| Lamp {
            name: name.into(),
            position_m: camera.position_m + side * vehicle.lamp_offset_m * camera.right,
            forward: camera.forward,
            intensity: [vehicle.lamp_intensity; 3],
            spectrum: spectrum.cloned(),
            level_pct: 100.0,
            half_angle_deg: vehicle.lamp_half_angle_deg,
            falloff: falloff(vehicle),
            radius_m: 0.02,
        })
        .to_vec()
}

fn falloff(vehicle: &Vehicle) -> Falloff {
    let profile = vehicle.lamp_profile.as_ref();
    profile.map_or(Falloff::Cosine, |rows| {
        Falloff::Profile(rows.iter().map(|row| (row[0], row[1])).collect())
    })
}

/// A target across the optical axis. An upright one ends at the water surface, as a hull does.
fn quad(target: &Target, centre: DVec3, forward: DVec3, up: DVec3) -> Quad {
    let (mut centre_m, mut half_v) = (centre, TARGET_HALF_M * up);
    if !target.is_bottom() {
        let half_m = (0.5 * (BELOW_CENTRE_M - centre.z)).max(TARGET_HALF_M);
        centre_m.z = -half_m;
        half_v = half_m * DVec3::Z;
    }
    Quad {
        centre_m,
        half_u: TARGET_HALF_M * forward.cross(up),
        half_v,
        normal: -forward,
        tile_m: DVec2::splat(f64::from(target.pattern.tile_m())),
        material: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_assets::assets_dir;
    use uw_render::scene::Encoding;

    /// The view of the red hull from 1 m, 3 m deep.
    fn made(vehicle: &Vehicle, jerlov: &str) -> Scene {
        let water = WaterBody {
            jerlov: jerlov.parse().expect("a water"),
            backscatter_fraction: 0.0183,
        };
        let assets = assets_dir().expect("assets");
        let target = Target::read(Pattern::HullRed, &assets).expect("a target");
        let view = View::Target {
            depth_m: 3.0,
            distance_m: 1.0,
        };
        scene(vehicle, &water, &target, view).expect("a scene")
    }

    /// A scene file for people states the default vehicle as the program makes it.
    #[test]
    fn flat_hull_is_seen_by_the_default_vehicle() {
        let assets = assets_dir().expect("assets");
        let shipped = Scene::read(&assets.join("scenes/flat_hull.toml")).expect("a scene");
        let vehicle = Vehicle::default();
        let made = made(&vehicle, "3C");
        let text = |value: &dyn std::fmt::Debug| format!("{value:?}");
        assert_eq!(text(&shipped.sensor), text(&made.sensor));
        assert_eq!(text(&shipped.sky_radiance), text(&made.sky_radiance));
        // Numbers of two ways to the same: rounded differently.
        let close = |one: &[f64], other: &[f64], what: &str| {
            assert_eq!(one.len(), other.len(), "{what}");
            for (x, y) in one.iter().zip(other) {
                assert!((x - y).abs() < 1e-9 * (1.0 + x.abs()), "{what}: {x} {y}");
            }
        };
        let camera = |c: &Camera| {
            let size = [f64::from(c.width), f64::from(c.height)];
            let axes = [c.position_m, c.forward, c.right, c.down].map(|v| v.to_array());
            let lens = [c.focal_px, c.centre_px].map(|v| v.to_array());
            [&size[..], axes.as_flattened(), lens.as_flattened()].concat()
        };
        close(&camera(&shipped.camera), &camera(&made.camera), "camera");
        assert_eq!(shipped.lamps.len(), made.lamps.len());
        for (one, other) in shipped.lamps.iter().zip(&made.lamps) {
            let numbers = |lamp: &Lamp| {
                let places = [lamp.position_m, lamp.forward].map(|v| v.to_array());
                let single = [lamp.level_pct, lamp.half_angle_deg, lamp.radius_m];
                [places.as_flattened(), &lamp.intensity, &single].concat()
            };
            close(&numbers(one), &numbers(other), &one.name);
            assert_eq!((&one.name, &one.falloff), (&other.name, &other.falloff));
        }
        let sun = |scene: &Scene| {
            let sun = scene.sun.as_ref().expect("a sun");
            [&sun.travel_direction.to_array()[..], &sun.irradiance].concat()
        };
        close(&sun(&shipped), &sun(&made), "sun");
    }

    /// What is measured of a vehicle reaches the scenes: the beam in the place of the cosine, and the encoding.
    #[test]
    fn a_measured_vehicle_s_beam_and_encoding_are_those_of_its_scenes() {
        let vehicle = Vehicle {
            encoding: Encoding::Linear,
            lamp_profile: Some(vec![[0.0, 1.0], [20.0, 0.6], [45.0, 0.0]]),
            ..Vehicle::default()
        };
        let made = made(&vehicle, "IB");
        for lamp in &made.lamps {
            // Between the rows straight lines.
            assert!((lamp.falloff.relative(10.0) - 0.8).abs() < 1e-12);
        }
        assert_eq!(made.lamps.len(), 2);
        assert_eq!(made.sensor.map(|s| s.encoding), Some(Encoding::Linear));
    }
}
