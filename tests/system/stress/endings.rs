//! Paths that nothing absorbs come to an end, and the work is shared out without a trace in the picture.

use std::{
    thread,
    time::{Duration, Instant},
};

use glam::DVec3;
use uw_media::phase::Phase;
use uw_render::{film::FilmLayer, scene::Scene};
use uw_tests::single_ray::{add_plate, camera, empty, point_lamp, water};
use uw_tests::{
    corpus_scene,
    gpu::{Backend, PROCESSOR, everywhere},
    plan,
};

/// A closed white cube of lossless water. Light in it goes on for ever.
fn white_box() -> Scene {
    let view = DVec3::new(0.5, 0.6, -0.4);
    let mut scene = empty(camera(DVec3::new(0.1, 0.2, -0.1), view, 16));
    scene.water = Some(water([0.0; 3], [1.0; 3], Phase::Isotropic));
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for inwards in [axis, -axis] {
            add_plate(&mut scene, -0.5 * inwards, inwards, 0.5, [1.0; 3]);
        }
    }
    scene
}

/// Renders `scene` and fails if that does not end.
fn assert_ends(scene: &Scene) {
    everywhere(|backend| assert_ends_on(backend, scene.clone()));
}

fn assert_ends_on(backend: Backend, scene: Scene) {
    // Nothing can stop a path that does not end: its thread is left behind.
    let work = thread::spawn(move || backend.render(&scene, &plan(4, 1)).1);
    let start = Instant::now();
    while !work.is_finished() {
        assert!(
            start.elapsed() < Duration::from_secs(120),
            "paths go on after two minutes"
        );
        thread::sleep(Duration::from_millis(10));
    }
    let stats = work.join().expect("a picture");
    let vertices = stats.path_vertices / stats.paths;
    println!("{} paths of {vertices} vertices", stats.paths);
}

#[test]
fn lamp_light_between_white_walls_in_lossless_water_comes_to_an_end() {
    let mut scene = white_box();
    scene.lamps.push(point_lamp(DVec3::ZERO, 1.0));
    assert_ends(&scene);
}

#[test]
fn emitted_light_between_white_walls_in_lossless_water_comes_to_an_end() {
    let mut scene = white_box();
    scene.materials[0].emission = [1.0; 3];
    assert_ends(&scene);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let scenes = ["s3_sun", "s2_turbid"];
    for (name, backend) in scenes
        .into_iter()
        .flat_map(|s| PROCESSOR.map(|backend| (s, backend)))
    {
        let scene = corpus_scene(name);
        let films = [1, 2, 3].map(|threads| {
            let mut plan = plan(4, 1);
            plan.threads = Some(threads);
            backend.render(&scene, &plan).0
        });
        for layer in [FilmLayer::Total, FilmLayer::Variance] {
            let bits = |i: usize| -> Vec<[u64; 3]> {
                let pixels = films[i].layer(layer);
                pixels.iter().map(|p| p.map(f64::to_bits)).collect()
            };
            assert!(bits(0).iter().any(|p| *p != [0; 3]), "{name}: black");
            assert!(
                bits(0) == bits(1) && bits(0) == bits(2),
                "{name}, {}, {layer:?}",
                backend.name()
            );
        }
    }
}
