//! Small scenes on which the renderer is compared with the validator.

mod air;
mod daylight;
mod gloss;
mod lamps;
mod layers;

use glam::{DVec2, DVec3};
use uw_media::phase::{Draine, FournierForand, HenyeyGreenstein, Mixture, Phase, Rayleigh};
use uw_render::scene::{Camera, Falloff, Lamp, Mesh, Scene, Sun};

use crate::single_ray::{self, camera, empty, surface, water};

/// Radiance of the sky, W/(m² sr).
const SKY: [f64; 3] = [0.3, 0.4, 0.5];

/// A scene and how much work it takes to bring both sides to an error of about one percent.
pub struct Case {
    /// What is special about it.
    pub name: &'static str,
    /// The scene; its picture is one pixel.
    pub scene: Scene,
    /// Largest number of scatterings and reflections; 0 for no limit.
    pub max_events: u32,
    /// Walks of the validator per channel.
    pub walks: u64,
    /// Samples of the renderer.
    pub samples: u32,
}

/// The scenes on which renderer and validator must agree.
pub fn all() -> Vec<Case> {
    let mut cases = lamps::cases();
    cases.extend(daylight::cases());
    cases.extend(layers::cases());
    cases.extend(gloss::cases());
    cases.extend(air::cases());
    cases.extend(lamps::in_bright_water());
    cases
}

impl Case {
    fn new(name: &'static str, scene: Scene) -> Self {
        Self {
            name,
            scene,
            max_events: 0,
            walks: 100_000,
            samples: 16_384,
        }
    }

    fn at_most(mut self, max_events: u32) -> Self {
        self.max_events = max_events;
        self
    }

    /// Thousands of walks per channel and of samples.
    fn work(mut self, kilo_walks: u64, kilo_samples: u32) -> Self {
        self.walks = 1000 * kilo_walks;
        self.samples = 1024 * kilo_samples;
        self
    }
}

/// An otherwise empty scene seen through one square pixel of `field_deg` from `from` towards `to`.
fn view(from: DVec3, to: DVec3, field_deg: f64) -> Scene {
    let focal_px = 0.5 / (0.5 * field_deg).to_radians().tan();
    empty(Camera {
        focal_px: DVec2::splat(focal_px),
        ..camera(from, to - from, 1)
    })
}

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn fournier_forand(backscatter_fraction: f64) -> Phase {
    Phase::FournierForand(FournierForand::new(1.10, backscatter_fraction).expect("valid"))
}

fn henyey_greenstein(g: f64) -> Phase {
    Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).expect("valid"))
}

fn draine(g: f64, alpha: f64) -> Phase {
    Phase::Draine(Draine::new(g, alpha).expect("valid"))
}

fn rayleigh() -> Phase {
    Phase::Rayleigh(Rayleigh::new(0.09).expect("valid"))
}

/// Particles and a share of pure water.
fn sea_water(share: f64) -> Phase {
    let parts = vec![(1.0 - share, fournier_forand(0.0183)), (share, rayleigh())];
    Phase::Mixture(Mixture::new(parts).expect("valid"))
}

/// A wide disk lamp facing `forward`, of any length.
fn disk(position_m: DVec3, forward: DVec3, radius_m: f64) -> Lamp {
    Lamp {
        name: "lamp".into(),
        position_m,
        forward: forward.normalize(),
        intensity: [10.0, 8.0, 5.0],
        spectrum: None,
        level_pct: 100.0,
        half_angle_deg: 90.0,
        falloff: Falloff::Uniform,
        radius_m,
    }
}

/// Half a metre below the surface, looking obliquely down at a plate 1.5 m deep.
fn bottom(a: [f64; 3], b: [f64; 3], phase: Phase, refractive: bool) -> Scene {
    let mut scene = view(v(0.0, 0.0, -0.5), v(0.7, 0.1, -1.5), 10.0);
    scene.water = Some(water(a, b, phase));
    scene.surface = Some(surface(refractive));
    add_coloured_plate(&mut scene, v(0.7, 0.0, -1.5), v(-0.1, 0.0, 1.0), 0.5);
    scene
}

/// Adds a lamp under a name of its own.
fn add_lamp(scene: &mut Scene, mut lamp: Lamp) {
    lamp.name = format!("lamp{}", scene.lamps.len() + 1);
    scene.lamps.push(lamp);
}

fn sun(zenith_deg: f64, azimuth_deg: f64, irradiance: f64) -> Option<Sun> {
    let (zenith, azimuth) = (zenith_deg.to_radians(), azimuth_deg.to_radians());
    Some(Sun {
        travel_direction: v(
            zenith.sin() * azimuth.cos(),
            zenith.sin() * azimuth.sin(),
            -zenith.cos(),
        ),
        irradiance: [irradiance, 0.9 * irradiance, 0.7 * irradiance],
    })
}

/// Adds a square plate of edge 2 `half_m` that faces `normal`, of any length.
fn add_plate(scene: &mut Scene, centre: DVec3, normal: DVec3, half_m: f64, reflectance: [f64; 3]) {
    single_ray::add_plate(scene, centre, normal.normalize(), half_m, reflectance);
}

/// Adds one that reflects the channels differently.
fn add_coloured_plate(scene: &mut Scene, centre: DVec3, normal: DVec3, half_m: f64) {
    add_plate(scene, centre, normal, half_m, [0.8, 0.5, 0.3]);
}

/// Lets the plate that was added last emit light.
fn light_up(scene: &mut Scene, emission: [f64; 3]) {
    if let Some(material) = scene.materials.last_mut() {
        material.emission = emission;
    }
}

/// Adds a closed box with its edges along the axes, as a mesh.
fn add_box(scene: &mut Scene, centre: DVec3, half: DVec3, reflectance: [f64; 3]) {
    add_plate(scene, DVec3::ZERO, DVec3::Z, 1.0, reflectance);
    scene.quads.pop();
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        centre + half * v(sign(0), sign(1), sign(2))
    };
    scene.meshes.push(Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: vec![
            [0, 1, 3],
            [0, 3, 2],
            [4, 5, 7],
            [4, 7, 6],
            [0, 1, 5],
            [0, 5, 4],
            [2, 3, 7],
            [2, 7, 6],
            [0, 2, 6],
            [0, 6, 4],
            [1, 3, 7],
            [1, 7, 5],
        ],
        material: scene.materials.len() - 1,
        ..Mesh::default()
    });
}

/// Adds a regular tetrahedron as a mesh.
fn add_tetrahedron(scene: &mut Scene, centre: DVec3, half: f64, reflectance: [f64; 3]) {
    add_plate(scene, DVec3::ZERO, DVec3::Z, 1.0, reflectance);
    scene.quads.pop();
    scene.meshes.push(Mesh {
        positions: [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
            .map(|p| centre + half * DVec3::from_array(p.map(f64::from)))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        material: scene.materials.len() - 1,
        ..Mesh::default()
    });
}
