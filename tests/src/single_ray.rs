//! Scenes made in code whose camera looks along one given ray.

use glam::{DVec2, DVec3};
use uw_media::{Iops, phase::Phase};
use uw_render::scene::{
    Camera, Falloff, Lamp, Layer, Lens, Material, Plume, Quad, RenderSettings, Scene, Sun, Water,
    WaterSurface,
};

use crate::discrete_ordinates::Travel;

/// Focal length, pixels, at which a pixel is a ray: it covers 1e-9 rad.
const FOCAL_PX: f64 = 1e9;

/// A camera of `width` equal pixels that all look from `origin` along `direction`.
pub fn camera(origin: DVec3, direction: DVec3, width: u32) -> Camera {
    let forward = direction.normalize();
    let (right, down) = forward.any_orthonormal_pair();
    Camera {
        position_m: origin,
        forward,
        right,
        down,
        width,
        height: 1,
        focal_px: DVec2::splat(FOCAL_PX),
        centre_px: DVec2::new(0.5 * f64::from(width), 0.5),
        lens: Lens::default(),
        opening: None,
        port: None,
    }
}

/// A camera of `width` equal pixels at a depth, which see light that travels so where sunlight travels towards +x.
pub fn camera_against(depth_m: f64, travel: Travel, width: u32) -> Camera {
    let (sin, cos) = travel.azimuth_deg.to_radians().sin_cos();
    let horizontal = (1.0 - travel.down * travel.down).sqrt();
    let view = DVec3::new(-horizontal * cos, -horizontal * sin, travel.down);
    camera(DVec3::new(0.0, 0.0, -depth_m), view, width)
}

/// A scene with nothing but a camera.
pub fn empty(camera: Camera) -> Scene {
    Scene {
        water: None,
        surface: None,
        sun: None,
        sky_radiance: [0.0; 3],
        camera,
        snow: None,
        spectral: None,
        lamps: Vec::new(),
        quads: Vec::new(),
        meshes: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        sensor: None,
        render: RenderSettings {
            samples_per_pixel: 1,
            max_bounces: 0,
        },
        warnings: Vec::new(),
    }
}

/// Water with coefficients in 1/m and refractive index 1.34.
pub fn water(a: [f64; 3], b: [f64; 3], phase: Phase) -> Water {
    Water {
        iops: Iops { a, b },
        phase,
        refractive_index: 1.34,
        variation: uw_render::scene::Variation::default(),
    }
}

/// Water of these coefficients, 1/m, at a depth, m.
pub fn layer(depth_m: f64, a: [f64; 3], b: [f64; 3]) -> Layer {
    Layer {
        depth_m,
        iops: Iops { a, b },
        spectrum: None,
    }
}

/// Gives the scene's water a profile and clouds; its own coefficients become those that stand for all of it.
///
/// # Panics
/// When the scene has no water.
pub fn vary(scene: &mut Scene, layers: Vec<Layer>, plumes: Vec<Plume>) {
    let water = scene.water.as_mut().expect("water");
    water.variation.layers = layers;
    water.variation.plumes = plumes;
    water.iops = water.variation.mean_iops(water.iops);
}

/// Sunlight towards +x with an irradiance in W/m² perpendicular to it.
pub fn sun(zenith_deg: f64, irradiance: [f64; 3]) -> Sun {
    let (sin, cos) = zenith_deg.to_radians().sin_cos();
    Sun {
        travel_direction: DVec3::new(sin, 0.0, -cos),
        irradiance,
    }
}

/// A surface at z = 0.
pub fn surface(refractive: bool) -> WaterSurface {
    WaterSurface {
        height_m: 0.0,
        refractive,
    }
}

/// A point lamp at 100 %.
pub fn point_lamp(position_m: DVec3, intensity: f64) -> Lamp {
    Lamp {
        name: "lamp".into(),
        position_m,
        forward: DVec3::Z,
        intensity: [intensity; 3],
        spectrum: None,
        level_pct: 100.0,
        half_angle_deg: 180.0,
        falloff: Falloff::Uniform,
        radius_m: 0.0,
    }
}

/// Adds an untextured square plate.
pub fn add_plate(
    scene: &mut Scene,
    centre_m: DVec3,
    normal: DVec3,
    half_m: f64,
    reflectance: [f64; 3],
) {
    let (u, v) = normal.any_orthonormal_pair();
    scene.materials.push(Material {
        reflectance,
        ..Material::default()
    });
    scene.quads.push(Quad {
        centre_m,
        half_u: half_m * u,
        half_v: half_m * v,
        normal,
        tile_m: DVec2::splat(2.0 * half_m),
        material: scene.materials.len() - 1,
    });
}
