//! Layers of one render add up to its picture.

use glam::DVec3;
use uw_media::phase::{FournierForand, Phase};
use uw_render::{
    film::{Film, FilmLayer},
    scene::Scene,
};
use uw_tests::single_ray::{add_plate, camera, empty, point_lamp, surface, water};
use uw_tests::{gpu::everywhere, plan};

/// Sun, sky, two lamps at different levels, a plate and turbid water.
fn scene(b: f64) -> Scene {
    let mut scene = empty(camera(DVec3::new(0.0, 0.0, -2.0), DVec3::X, 50));
    let phase = Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"));
    scene.water = Some(water([0.3, 0.1, 0.05], [b, 0.8 * b, 1.2 * b], phase));
    scene.surface = Some(surface(true));
    scene.sky_radiance = [0.1, 0.2, 0.3];
    for (y, level_pct) in [(0.5, 100.0), (-0.4, 30.0)] {
        let mut lamp = point_lamp(DVec3::new(0.0, y, -2.0), 5.0);
        lamp.level_pct = level_pct;
        scene.lamps.push(lamp);
    }
    add_plate(
        &mut scene,
        DVec3::new(1.5, 0.0, -2.0),
        -DVec3::X,
        1.0,
        [0.5, 0.4, 0.3],
    );
    scene
}

fn largest_difference(film: &Film, sum: impl Fn(usize) -> [f64; 3]) -> f64 {
    let total = film.layer(FilmLayer::Total);
    (0..total.len())
        .flat_map(|i| {
            let s = sum(i);
            let t = total[i];
            (0..3).map(move |k| (s[k] / t[k] - 1.0).abs())
        })
        .fold(0.0, f64::max)
}

#[test]
fn ambient_and_lamps_at_their_levels_are_the_picture() {
    everywhere(|backend| {
        let film = backend.render(&scene(0.8), &plan(64, 1)).0;
        let ambient = film.layer(FilmLayer::Ambient);
        let lamps = [0, 1].map(|i| film.layer(FilmLayer::Lamp(i)));
        let difference = largest_difference(&film, |i| {
            std::array::from_fn(|k| ambient[i][k] + lamps[0][i][k] + 0.3 * lamps[1][i][k])
        });
        assert!(difference < 1e-12, "{difference}");
    });
}

#[test]
fn without_scattering_the_picture_is_direct_and_without_surfaces_it_is_backscatter() {
    let mut open = scene(0.8);
    open.quads.clear();
    everywhere(|backend| {
        // Sums of some 64 terms in one order and in another.
        let within = 1e-12 + backend.rounding();
        let film = backend.render(&scene(0.0), &plan(64, 1)).0;
        let direct = film.layer(FilmLayer::Direct);
        let difference = largest_difference(&film, |i| direct[i]);
        assert!(difference < within, "direct: {difference}");
        let backscatter = film.layer(FilmLayer::Backscatter);
        assert!(backscatter.iter().all(|&p| p == [0.0; 3]));

        let film = backend.render(&open, &plan(64, 1)).0;
        let backscatter = film.layer(FilmLayer::Backscatter);
        let difference = largest_difference(&film, |i| backscatter[i]);
        assert!(difference < within, "backscatter: {difference}");
    });
}

#[test]
fn direct_light_and_backscatter_leave_room_for_the_blurred_light() {
    everywhere(|backend| {
        let film = backend.render(&scene(0.8), &plan(256, 1)).0;
        let total = film.layer(FilmLayer::Total);
        let direct = film.layer(FilmLayer::Direct);
        let backscatter = film.layer(FilmLayer::Backscatter);
        for i in 0..total.len() {
            for k in 0..3 {
                let blurred = total[i][k] - direct[i][k] - backscatter[i][k];
                assert!(direct[i][k] > 0.0 && backscatter[i][k] > 0.0);
                assert!(blurred > 1e-3 * total[i][k], "pixel {i}: {blurred}");
            }
        }
    });
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    everywhere(|backend| {
        let film = |threads: usize| {
            let mut plan = plan(16, 5);
            plan.threads = Some(threads);
            backend.render(&scene(0.8), &plan).0.layer(FilmLayer::Total)
        };
        assert_eq!(film(1), film(3));
    });
}
