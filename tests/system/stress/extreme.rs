//! Scenes drawn at random from the edges of what a user can write.

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use uw_media::phase::{FournierForand, HenyeyGreenstein, Phase};
use uw_render::scene::{
    Camera, Lamp, Lens, Material, Mesh, Scene, Sun, Texture, TextureFilter, Water,
};
use uw_tests::single_ray::{add_plate, empty, point_lamp, surface, water};

/// Largest scattering coefficient of lossless water, per unit of length: without absorption a path can only be
/// followed to its end.
const LN_LARGEST_LOSSLESS_B: f64 = 1.0;

/// Which coefficients vanish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// None of them.
    Both,
    /// Absorption: an albedo of 1.
    ScatteringOnly,
    /// Scattering: an albedo of 0.
    AbsorptionOnly,
    /// Absorption of red, scattering of green, both of blue.
    ByChannel,
}

/// What the camera or a lamp touches besides the plate in front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wall {
    /// Nothing.
    None,
    /// A closed mesh around the camera.
    AroundCamera,
    /// A plate whose plane holds the camera and its line of sight.
    AlongView,
    /// A plate whose plane holds the camera, facing the line of sight.
    AcrossView,
    /// A triangle with a corner at the camera.
    CornerAtCamera,
}

/// Triangles that have no business in a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// No mesh.
    None,
    /// Three times the same corner.
    Point,
    /// A height of 1e-12 of the length.
    Sliver,
    /// A good triangle; like the others it is there twice.
    Triangle,
}

/// What is varied; lengths are in units of `scale_m`.
#[derive(Clone, Debug)]
pub struct Extreme {
    pub law_index: f64,
    pub backscatter: f64,
    pub peaked: bool,
    pub ln_a: [f64; 3],
    pub ln_b: [f64; 3],
    pub loss: Loss,
    pub water_index: f64,
    pub scale_m: f64,
    pub offset_m: f64,
    pub camera_depth: f64,
    pub lamp: usize,
    pub lamp_radius: f64,
    pub surface: Option<bool>,
    pub sun_zenith_deg: f64,
    pub sky: f64,
    pub reflectance: f64,
    pub textured: bool,
    pub shape: Shape,
    pub wall: Wall,
    pub seed: u64,
}

pub fn extremes() -> impl Strategy<Value = Extreme> {
    let water = (
        // In (1.001, 1.5].
        (0.0..1.0f64).prop_map(|u| 1.5 - 0.499 * u),
        (1e-4f64.ln()..0.499f64.ln()).prop_map(f64::exp),
        any::<bool>(),
        prop::array::uniform3(-12.0..7.0f64),
        prop::array::uniform3(-12.0..7.0f64),
        prop_oneof![
            6 => Just(Loss::Both),
            1 => Just(Loss::ScatteringOnly),
            1 => Just(Loss::AbsorptionOnly),
            1 => Just(Loss::ByChannel),
        ],
        prop::sample::select(vec![1.0, 1.34, 2.0]),
    );
    let backend = (
        prop::sample::select(vec![1e-3, 1.0, 1e3]),
        prop::sample::select(vec![0.0, 1e6]),
        prop::sample::select(vec![-1e-9, 0.0, 1e-9, 0.3, 10.0]),
        prop::sample::select(vec![None, Some(false), Some(true)]),
    );
    let light = (
        0usize..5,
        prop::sample::select(vec![0.0, 1e-6, 0.05, 1e2]),
        prop::sample::select(vec![0.0, 45.0, 89.9]),
        prop::sample::select(vec![0.0, 0.1]),
    );
    let bodies = (
        prop::sample::select(vec![0.0, 0.5, 1.0]),
        any::<bool>(),
        prop::sample::select(vec![
            Shape::None,
            Shape::Point,
            Shape::Sliver,
            Shape::Triangle,
        ]),
        prop_oneof![
            4 => Just(Wall::None),
            1 => Just(Wall::AroundCamera),
            1 => Just(Wall::AlongView),
            1 => Just(Wall::AcrossView),
            1 => Just(Wall::CornerAtCamera),
        ],
    );
    (water, backend, light, bodies, any::<u64>()).prop_map(|(w, p, l, b, seed)| Extreme {
        law_index: w.0,
        backscatter: w.1,
        peaked: w.2,
        ln_a: w.3,
        ln_b: w.4,
        loss: w.5,
        water_index: w.6,
        scale_m: p.0,
        offset_m: p.1,
        camera_depth: p.2,
        lamp: l.0,
        lamp_radius: l.1,
        surface: p.3,
        sun_zenith_deg: l.2,
        sky: l.3,
        reflectance: b.0,
        textured: b.1,
        shape: b.2,
        wall: b.3,
        seed,
    })
}

impl Extreme {
    /// Coefficients of up to 1e3 per unit of length.
    fn water(&self) -> Water {
        let per_m = |ln: f64| ln.exp().min(1e3) / self.scale_m;
        let phase = if self.peaked {
            let ff = FournierForand::new(self.law_index, self.backscatter);
            Phase::FournierForand(ff.expect("valid"))
        } else {
            let g = 1.0 - 2.0 * self.backscatter;
            Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).expect("valid"))
        };
        let (mut a, mut b) = (self.ln_a.map(per_m), self.ln_b.map(per_m));
        match self.loss {
            Loss::Both => {}
            Loss::ScatteringOnly => {
                a = [0.0; 3];
                b = self.ln_b.map(|ln| per_m(ln.min(LN_LARGEST_LOSSLESS_B)));
            }
            Loss::AbsorptionOnly => b = [0.0; 3],
            Loss::ByChannel => {
                a = [0.0, a[1], 0.0];
                b = [per_m(self.ln_b[0].min(LN_LARGEST_LOSSLESS_B)), 0.0, 0.0];
            }
        }
        let mut water = water(a, b, phase);
        water.refractive_index = self.water_index;
        water
    }

    fn camera(&self) -> Camera {
        Camera {
            position_m: self.at(0.0, 0.0, 0.0),
            forward: DVec3::X,
            right: -DVec3::Y,
            down: -DVec3::Z,
            width: 4,
            height: 3,
            focal_px: DVec2::splat(3.0),
            centre_px: DVec2::new(2.0, 1.5),
            lens: Lens::default(),
            opening: None,
            port: None,
        }
    }

    /// A point relative to the camera.
    fn at(&self, x: f64, y: f64, z: f64) -> DVec3 {
        let height = -self.camera_depth * self.scale_m;
        DVec3::new(self.offset_m, -self.offset_m, height) + self.scale_m * DVec3::new(x, y, z)
    }

    fn lamp(&self) -> Lamp {
        // On the plate, in the camera, behind the plate, in view, beside the camera.
        let (position, forward) = [
            (self.at(1.0, 0.1, 0.0), -DVec3::X),
            (self.at(0.0, 0.0, 0.0), DVec3::X),
            (self.at(1.5, 0.0, 0.0), -DVec3::X),
            (self.at(0.7, 0.1, 0.0), -DVec3::X),
            (self.at(0.0, 0.3, 0.0), DVec3::X),
        ][self.lamp];
        let mut lamp = point_lamp(position, 1.0);
        lamp.forward = forward;
        lamp.radius_m = self.lamp_radius * self.scale_m;
        if self.surface.is_some() {
            lamp.position_m.z = lamp.position_m.z.min(-1e-6 * self.scale_m);
        }
        lamp
    }

    /// The scene.
    pub fn scene(&self) -> Scene {
        let mut scene = empty(self.camera());
        scene.water = Some(self.water());
        scene.surface = self.surface.map(surface);
        scene.sky_radiance = [self.sky; 3];
        let zenith = self.sun_zenith_deg.to_radians();
        scene.sun = Some(Sun {
            travel_direction: DVec3::new(zenith.sin(), 0.0, -zenith.cos()),
            irradiance: [1.0; 3],
        });
        scene.lamps.push(self.lamp());
        // A plate in front and a second one in the same plane.
        self.add_plate(&mut scene, self.at(1.0, 0.0, 0.0), -DVec3::X);
        self.add_plate(&mut scene, self.at(1.0, 0.5, 0.0), -DVec3::X);
        if self.textured {
            scene.textures.push(Texture {
                width: 1,
                height: 1,
                texels: vec![[1.0, 0.5, 0.0]].into(),
                filter: TextureFilter::Bilinear,
            });
            scene.materials[0].texture = Some(0);
            scene.quads[0].tile_m = DVec2::splat(1e-6 * self.scale_m);
        }
        self.add_shape(&mut scene);
        self.add_wall(&mut scene);
        scene
    }

    fn add_plate(&self, scene: &mut Scene, centre_m: DVec3, normal: DVec3) {
        let half_m = 2.0 * self.scale_m;
        add_plate(scene, centre_m, normal, half_m, [self.reflectance; 3]);
    }

    fn add_shape(&self, scene: &mut Scene) {
        let corner = self.at(0.5, -0.2, -0.2);
        let e = self.scale_m;
        let (second, third) = match self.shape {
            Shape::None => return,
            Shape::Point => (DVec3::ZERO, DVec3::ZERO),
            Shape::Sliver => (DVec3::Y, DVec3::new(0.0, 1.0, 1e-12)),
            Shape::Triangle => (0.1 * DVec3::Y, 0.1 * DVec3::Z),
        };
        let positions = vec![corner, corner + e * second, corner + e * third];
        // The same triangle twice.
        self.add_mesh(scene, positions, vec![[0, 1, 2], [0, 1, 2]]);
    }

    fn add_wall(&self, scene: &mut Scene) {
        let camera = self.at(0.0, 0.0, 0.0);
        match self.wall {
            Wall::None => {}
            Wall::AroundCamera => {
                // A tetrahedron.
                let corners = [(2, 0, -1), (-1, 2, -1), (-1, -2, -1), (0, 0, 2)];
                let at =
                    |(x, y, z)| self.at(0.1 * f64::from(x), 0.1 * f64::from(y), 0.1 * f64::from(z));
                let faces = vec![[0, 1, 2], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
                self.add_mesh(scene, corners.map(at).to_vec(), faces);
            }
            Wall::AlongView => self.add_plate(scene, camera, DVec3::Z),
            Wall::AcrossView => self.add_plate(scene, camera, DVec3::X),
            Wall::CornerAtCamera => {
                let positions = vec![camera, self.at(0.5, 0.1, 0.0), self.at(0.5, 0.0, 0.1)];
                self.add_mesh(scene, positions, vec![[0, 1, 2]]);
            }
        }
    }

    fn add_mesh(&self, scene: &mut Scene, positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) {
        scene.materials.push(Material {
            reflectance: [self.reflectance; 3],
            ..Material::default()
        });
        scene.meshes.push(Mesh {
            positions,
            normals: Vec::new(),
            uvs: Vec::new(),
            triangles,
            material: scene.materials.len() - 1,
        });
    }
}
