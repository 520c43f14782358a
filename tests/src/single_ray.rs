//! Scenes made in code whose camera looks along one given ray.

use glam::{DVec2, DVec3};
use uw_media::{Iops, phase::Phase};
use uw_render::scene::{
    Camera, Falloff, Lamp, Material, Quad, RenderSettings, Scene, Water, WaterSurface,
};

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
        distortion: [0.0; 5],
    }
}

/// A scene with nothing but a camera.
pub fn empty(camera: Camera) -> Scene {
    Scene {
        water: None,
        surface: None,
        sun: None,
        sky_radiance: [0.0; 3],
        camera,
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
        spectrum: None,
        texture: None,
        emission: [0.0; 3],
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
