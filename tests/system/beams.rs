//! What lies beside narrow beams, against water with a cloud that is far away: the same water, in which no way is led by the beams.
//! Few of its samples are bright, so that what many of them show is kept in `data/beams_plain.csv`, and few are taken again.

use glam::DVec3;
use uw_media::{
    Iops,
    phase::{FournierForand, HenyeyGreenstein, Phase},
};
use uw_render::scene::{Falloff, Gloss, Lamp, Plume, Scene, Texture, TextureFilter};
use uw_tests::{
    divided,
    gpu::{Backend, everywhere},
    plan,
    reference::{means, write_means},
    same_numbers::{Means, PART, assert_same},
    single_ray::{add_plate, camera, empty, layer, point_lamp, surface, vary, water},
};

const A: [f64; 3] = [0.2, 0.1, 0.15];
const B: [f64; 3] = [0.5, 0.6, 0.45];
/// Pixels along each edge of the picture, whose mean is compared.
const PARTS: u32 = 8;
const SAMPLES: u32 = 4096;
/// Samples of the water in which nothing is led, in the rows that are kept.
const PLAIN_SAMPLES: u32 = 65_536;
/// The same of those that are taken again.
const AGAIN: u32 = PLAIN_SAMPLES / 64;
/// Largest standard error of a comparison on the vector units, relative to the value; most are a fifth of that. Without being led few samples
/// are bright.
const SHARPNESS: f64 = 0.02;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn henyey_greenstein(g: f64) -> Phase {
    Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).expect("valid"))
}

fn fournier_forand() -> Phase {
    Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"))
}

/// A field of 10° from `from` towards `to`.
fn view(from: DVec3, to: DVec3, phase: Phase) -> Scene {
    let mut eye = camera(from, to - from, 1);
    eye.focal_px /= 2.0 * 5f64.to_radians().tan() * eye.focal_px.x;
    let mut scene = empty(eye);
    scene.water = Some(water(A, B, phase));
    divided(&scene, PARTS)
}

/// A wall across the view, which meets it at y = 0.1 m.
fn wall(phase: Phase) -> Scene {
    let mut scene = view(DVec3::ZERO, v(1.5, 0.1, 0.05), phase);
    add_wall(&mut scene, v(1.5, 0.0, 0.0), v(-1.0, 0.1, 0.1));
    scene
}

fn add_wall(scene: &mut Scene, centre: DVec3, normal: DVec3) {
    add_plate(scene, centre, normal.normalize(), 1.2, [0.8, 0.5, 0.3]);
}

/// A beam of 15° half angle onto a point of the wall beside the view.
fn beam() -> Lamp {
    Lamp {
        forward: v(1.3, -0.1, -0.2).normalize(),
        half_angle_deg: 15.0,
        ..point_lamp(v(0.2, -0.5, 0.2), 10.0)
    }
}

fn lit(mut scene: Scene, lamp: Lamp) -> Scene {
    scene.lamps.push(Lamp {
        name: format!("lamp{}", scene.lamps.len()),
        ..lamp
    });
    scene
}

fn on_wall() -> Scene {
    lit(wall(henyey_greenstein(0.6)), beam())
}

/// A disk whose beam falls off.
fn profile() -> Scene {
    let lamp = Lamp {
        half_angle_deg: 25.0,
        falloff: Falloff::Profile(vec![(0.0, 1.0), (8.0, 0.8), (20.0, 0.05), (25.0, 0.0)]),
        radius_m: 0.15,
        ..beam()
    };
    lit(wall(fournier_forand()), lamp)
}

/// Less than 0.6 free paths from the wall, where the water before it is joined to the lamp too.
fn close_to_wall() -> Scene {
    let lamp = Lamp {
        position_m: v(1.2, -0.2, 0.0),
        forward: v(1.0, -0.8, 0.1).normalize(),
        ..beam()
    };
    lit(wall(henyey_greenstein(0.6)), lamp)
}

/// Two beams, and two walls of which one has a texture, so that a walk has several landings to choose from.
fn corner() -> Scene {
    let mut scene = on_wall();
    scene.textures.push(Texture {
        width: 2,
        height: 1,
        texels: vec![[0.9, 0.2, 0.4], [0.1, 0.8, 0.5]].into(),
        filter: TextureFilter::Nearest,
    });
    scene.materials[0].texture = Some(0);
    scene.quads[0].tile_m *= 0.37;
    add_wall(&mut scene, v(1.0, 0.0, -0.5), v(0.0, 0.1, 1.0));
    let lamp = Lamp {
        forward: v(0.3, 0.1, -1.0).normalize(),
        half_angle_deg: 20.0,
        ..point_lamp(v(0.4, 0.5, 0.6), 4.0)
    };
    lit(scene, lamp)
}

fn glossy() -> Scene {
    let mut scene = on_wall();
    scene.materials[0].gloss = Some(Gloss {
        roughness: 0.5,
        metallic: 0.5,
        index: 1.5,
        texture: None,
    });
    scene
}

/// The camera looks past the beam and what it lights, so that all light is veil.
fn past_the_beam() -> Scene {
    let mut scene = view(DVec3::ZERO, DVec3::X, henyey_greenstein(0.6));
    add_wall(&mut scene, v(0.5, 0.8, 0.0), v(-0.1, -1.0, 0.1));
    let lamp = Lamp {
        forward: v(0.3, 1.0, 0.1).normalize(),
        half_angle_deg: 12.0,
        ..point_lamp(v(0.3, 0.15, 0.0), 10.0)
    };
    lit(scene, lamp)
}

/// A surface, which mirrors beam and spot.
fn below_surface() -> Scene {
    let mut scene = view(v(0.0, 0.0, -0.3), v(0.7, 0.1, -0.8), henyey_greenstein(0.6));
    scene.surface = Some(surface(true));
    add_wall(&mut scene, v(0.7, 0.0, -0.8), v(-0.1, 0.0, 1.0));
    let lamp = Lamp {
        forward: v(0.1, 0.8, -0.5).normalize(),
        half_angle_deg: 20.0,
        ..point_lamp(v(0.0, 0.1, -0.3), 10.0)
    };
    lit(scene, lamp)
}

/// A plate that part of the beam meets before it comes to the wall.
fn occluded() -> Scene {
    let mut scene = on_wall();
    add_plate(
        &mut scene,
        v(0.8, -0.55, 0.1),
        v(-1.0, 0.3, 0.0).normalize(),
        0.1,
        [0.9; 3],
    );
    scene
}

/// The same in water with a cloud far away.
fn plain(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let cloud = Plume {
        centre_m: v(0.0, 5000.0, -100.0),
        sigma_m: 0.01,
        iops: Iops { a: A, b: B },
    };
    vary(&mut scene, vec![layer(0.0, A, B)], vec![cloud]);
    scene
}

/// Mean over the picture and its standard error, at most `events` scatterings and reflections.
fn measured(backend: Backend, scene: &Scene, samples: u32, events: u32, seed: u64) -> Means {
    let mut plan = plan(samples, seed);
    plan.max_bounces = events;
    let film = backend.render(scene, &plan).0;
    let (mean, variance) = (film.mean(), film.variance_of_mean());
    let error = |k: usize| variance[k].sqrt().hypot(backend.rounding() * mean[k]);
    (mean, [0, 1, 2].map(error))
}

/// Names of scenes, and the most events of their walks.
fn cases() -> [(&'static str, Scene, u32); 9] {
    [
        ("wall", on_wall(), 0),
        ("wall, three events", on_wall(), 3),
        ("disk with a profile", profile(), 0),
        ("close to the wall", close_to_wall(), 0),
        ("corner with two beams", corner(), 0),
        ("glossy wall", glossy(), 0),
        ("past the beam", past_the_beam(), 0),
        ("below a surface", below_surface(), 0),
        ("plate in the beam", occluded(), 0),
    ]
}

/// Within four standard errors; returns that of the difference, relative to the value.
fn assert_near(name: &str, found: Means, expected: Means) -> [f64; 3] {
    std::array::from_fn(|k| {
        let error = found.1[k].hypot(expected.1[k]);
        let (z, relative) = ((found.0[k] - expected.0[k]) / error, error / expected.0[k]);
        let percent = |means: &Means| 100.0 * means.1[k] / means.0[k];
        println!(
            "{name:24} {k}: {:.6} ± {:.2} %, kept {:.6} ± {:.2} %, z {z:.2}",
            found.0[k],
            percent(&found),
            expected.0[k],
            percent(&expected),
        );
        assert!(z.abs() < 4.0, "{name}, channel {k}: z {z}");
        relative
    })
}

#[test]
fn what_beams_light_by_scattering_is_what_it_is_without_being_led_by_them() {
    let (cases, rows) = (cases(), means("beams_plain"));
    assert_eq!(cases.len(), rows.len());
    everywhere(|backend| {
        for ((name, scene, events), row) in cases.iter().zip(&rows) {
            assert_eq!(*name, row.0);
            if !matches!(backend, Backend::VectorUnits) {
                let theirs = measured(Backend::VectorUnits, scene, SAMPLES / PART, *events, 2);
                let ours = measured(backend, scene, SAMPLES / PART, *events, 2);
                assert_same(name, ours, theirs);
                continue;
            }
            let found = measured(backend, scene, SAMPLES, *events, 2);
            for (k, relative) in assert_near(name, found, row.1).into_iter().enumerate() {
                assert!(
                    relative < SHARPNESS,
                    "{name}, channel {k}: error {relative}"
                );
            }
        }
    });
}

/// The rows that are kept are those of these scenes.
#[test]
fn what_is_kept_of_water_without_leading_is_what_it_shows() {
    for ((name, scene, events), row) in cases().iter().zip(means("beams_plain")) {
        let again = measured(Backend::VectorUnits, &plain(scene), AGAIN, *events, 3);
        assert_near(name, again, row.1);
    }
}

#[test]
#[ignore = "makes data/beams_plain.csv, in minutes"]
fn rows_of_water_without_leading() {
    let cases = cases();
    let rows = cases.iter().map(|(name, scene, events)| {
        let (backend, scene) = (Backend::VectorUnits, plain(scene));
        (*name, measured(backend, &scene, PLAIN_SAMPLES, *events, 1))
    });
    write_means("beams_plain", rows);
}
