//! Numerical stability: scenes at the edges of what a user can write, none of which may give a picture with a value
//! that is not finite or negative.

use glam::{DVec2, DVec3};
use proptest::{prelude::*, test_runner::RngSeed};
use uw_media::phase::{FournierForand, HenyeyGreenstein, Phase};
use uw_render::{
    film::FilmLayer,
    scene::{Camera, Lamp, Material, Mesh, Scene, Sun},
};
use uw_tests::single_ray::{add_plate, empty, point_lamp, surface, water};
use uw_tests::{plan, render};

/// What is varied; lengths are in units of `scale_m`.
#[derive(Clone, Debug)]
struct Extreme {
    refractive_index: f64,
    backscatter: f64,
    peaked: bool,
    ln_a: [f64; 3],
    ln_b: [f64; 3],
    lossless: bool,
    scale_m: f64,
    offset_m: f64,
    camera_depth: f64,
    lamp: usize,
    lamp_radius: f64,
    surface: Option<bool>,
    sun_zenith_deg: f64,
    sky: f64,
    reflectance: f64,
    mesh: usize,
    seed: u64,
}

fn extremes() -> impl Strategy<Value = Extreme> {
    let water = (
        1.002..1.5f64,
        (1e-4f64.ln()..0.499f64.ln()).prop_map(f64::exp),
        any::<bool>(),
        prop::array::uniform3(-12.0..7.0f64),
        prop::array::uniform3(-12.0..7.0f64),
        prop::bool::weighted(0.15),
    );
    let place = (
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
    let rest = (
        prop::sample::select(vec![0.0, 0.5, 1.0]),
        0usize..4,
        any::<u64>(),
    );
    (water, place, light, rest).prop_map(|(w, p, l, r)| Extreme {
        refractive_index: w.0,
        backscatter: w.1,
        peaked: w.2,
        ln_a: w.3,
        ln_b: w.4,
        lossless: w.5,
        scale_m: p.0,
        offset_m: p.1,
        camera_depth: p.2,
        lamp: l.0,
        lamp_radius: l.1,
        surface: p.3,
        sun_zenith_deg: l.2,
        sky: l.3,
        reflectance: r.0,
        mesh: r.1,
        seed: r.2,
    })
}

impl Extreme {
    /// Coefficients of up to 1e3 per unit of length.
    fn water(&self) -> uw_render::scene::Water {
        let per_m = |ln: f64| ln.exp().min(1e3) / self.scale_m;
        let phase = if self.peaked {
            let ff = FournierForand::new(self.refractive_index, self.backscatter);
            Phase::FournierForand(ff.expect("valid"))
        } else {
            let g = 1.0 - 2.0 * self.backscatter;
            Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).expect("valid"))
        };
        let a = if self.lossless {
            [0.0; 3]
        } else {
            self.ln_a.map(per_m)
        };
        // Without absorption and with nothing else to end it, a path could only be followed to its end.
        let b = if self.lossless {
            self.ln_b.map(|ln| per_m(ln.min(1.0)))
        } else {
            self.ln_b.map(per_m)
        };
        water(a, b, phase)
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
            distortion: [0.0; 5],
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

    fn scene(&self) -> Scene {
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
        let half = 2.0 * self.scale_m;
        let reflectance = [self.reflectance; 3];
        add_plate(
            &mut scene,
            self.at(1.0, 0.0, 0.0),
            -DVec3::X,
            half,
            reflectance,
        );
        // A second plate in the same plane, and degenerate triangles.
        add_plate(
            &mut scene,
            self.at(1.0, 0.5, 0.0),
            -DVec3::X,
            half,
            reflectance,
        );
        self.add_mesh(&mut scene);
        scene
    }

    fn add_mesh(&self, scene: &mut Scene) {
        let corner = self.at(0.5, -0.2, -0.2);
        let e = self.scale_m;
        let triangle = match self.mesh {
            0 => return,
            1 => [corner, corner, corner],
            2 => [
                corner,
                corner + e * DVec3::Y,
                corner + e * DVec3::new(0.0, 1.0, 1e-12),
            ],
            _ => [
                corner,
                corner + 0.1 * e * DVec3::Y,
                corner + 0.1 * e * DVec3::Z,
            ],
        };
        scene.materials.push(Material {
            reflectance: [self.reflectance; 3],
            texture: None,
            emission: [0.0; 3],
        });
        scene.meshes.push(Mesh {
            positions: triangle.to_vec(),
            normals: Vec::new(),
            uvs: Vec::new(),
            // The same triangle twice.
            triangles: vec![[0, 1, 2], [0, 1, 2]],
            material: scene.materials.len() - 1,
        });
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 250, failure_persistence: None, rng_seed: RngSeed::Fixed(20),  ..ProptestConfig::default() })]

    #[test]
    fn every_value_of_every_layer_is_finite_and_not_negative(extreme in extremes()) {
        let (film, _) = render(&extreme.scene(), &plan(4, extreme.seed));
        let layers = [
            FilmLayer::Total,
            FilmLayer::Ambient,
            FilmLayer::Lamp(0),
            FilmLayer::Direct,
            FilmLayer::Backscatter,
        ];
        for layer in layers {
            for pixel in film.layer(layer) {
                prop_assert!(
                    pixel.iter().all(|v| v.is_finite() && *v >= 0.0),
                    "{layer:?}: {pixel:?}"
                );
            }
        }
    }
}
