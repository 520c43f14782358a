//! Scenes whose water is not the same everywhere.

use uw_media::Iops;
use uw_render::scene::Plume;

use super::*;
use crate::single_ray::{layer, vary};

pub(super) fn cases() -> Vec<Case> {
    vec![
        Case::new("a thin turbid layer before a plate", behind_layer(broad())).work(2000, 64),
        Case::new(
            "the same, disk lamp and peaked function",
            behind_layer(disk_lamp()),
        )
        .work(2000, 64),
        Case::new(
            "a turbid layer over the bottom, sun and sky",
            bottom_layer(),
        )
        .work(200, 64),
        Case::new("a cloud between lamp and plate", cloud()).work(2000, 64),
        Case::new(
            "lamp in a layer under the refracting surface",
            under_surface(),
        )
        .work(2000, 64),
    ]
}

const CLEAR: ([f64; 3], [f64; 3]) = ([0.10, 0.06, 0.05], [0.15, 0.12, 0.1]);
const TURBID: ([f64; 3], [f64; 3]) = ([0.3, 0.2, 0.25], [4.0, 3.0, 2.0]);

/// Looking down at a plate through half a metre of turbid water.
fn behind_layer((phase, lamp): (Phase, Lamp)) -> Scene {
    let mut scene = view(v(0.0, 0.0, -1.0), v(0.2, 0.1, -3.0), 8.0);
    scene.water = Some(water(CLEAR.0, CLEAR.1, phase));
    scene.surface = Some(surface(false));
    let at = |depth, (a, b): ([f64; 3], [f64; 3])| layer(depth, a, b);
    let layers = vec![
        at(1.9, CLEAR),
        at(2.0, TURBID),
        at(2.3, TURBID),
        at(2.4, CLEAR),
    ];
    vary(&mut scene, layers, Vec::new());
    add_coloured_plate(&mut scene, v(0.2, 0.1, -3.0), v(-0.1, 0.0, 1.0), 1.5);
    add_lamp(&mut scene, lamp);
    scene
}

fn broad() -> (Phase, Lamp) {
    (
        henyey_greenstein(0.8),
        disk(v(0.3, 0.1, -0.9), v(0.0, 0.0, -1.0), 0.25),
    )
}

fn disk_lamp() -> (Phase, Lamp) {
    (
        fournier_forand(0.02),
        disk(v(0.4, 0.1, -0.9), v(-0.1, 0.0, -1.0), 0.25),
    )
}

/// Turbid water with a jump at its top, over the bottom.
fn bottom_layer() -> Scene {
    let mut scene = bottom(CLEAR.0, CLEAR.1, henyey_greenstein(0.7), true);
    let thick = ([0.3, 0.2, 0.25], [2.0, 1.5, 1.0]);
    let layers = vec![
        layer(0.3, CLEAR.0, CLEAR.1),
        layer(1.0, [0.2; 3], [0.3, 0.4, 0.5]),
        layer(1.0, thick.0, thick.1),
        layer(2.0, thick.0, [3.0, 2.5, 2.0]),
    ];
    vary(&mut scene, layers, Vec::new());
    scene.sun = sun(40.0, 70.0, 3.0);
    scene.sky_radiance = SKY;
    scene
}

fn cloud() -> Scene {
    let mut scene = view(v(0.0, 0.0, 0.0), v(2.0, 0.0, 0.0), 8.0);
    scene.water = Some(water([0.1; 3], [0.3, 0.2, 0.15], henyey_greenstein(0.8)));
    let plume = Plume {
        centre_m: v(1.1, 0.15, 0.05),
        sigma_m: 0.2,
        iops: Iops {
            a: [0.3, 0.4, 0.5],
            b: [4.0, 2.0, 1.0],
        },
    };
    vary(
        &mut scene,
        vec![layer(0.0, [0.1; 3], [0.3, 0.2, 0.15])],
        vec![plume],
    );
    add_coloured_plate(&mut scene, v(2.0, 0.0, 0.0), v(-1.0, 0.0, 0.1), 1.5);
    add_lamp(&mut scene, disk(v(0.0, 0.4, 0.1), v(1.0, -0.1, 0.0), 0.25));
    scene
}

fn under_surface() -> Scene {
    let mut scene = view(v(0.0, 0.0, -0.4), v(1.0, 0.1, -0.5), 10.0);
    scene.water = Some(water(CLEAR.0, CLEAR.1, fournier_forand(0.03)));
    scene.surface = Some(surface(true));
    let layers = vec![layer(0.0, TURBID.0, TURBID.1), layer(0.6, CLEAR.0, CLEAR.1)];
    vary(&mut scene, layers, Vec::new());
    add_coloured_plate(&mut scene, v(1.0, 0.1, -0.5), v(-1.0, 0.0, 0.2), 0.8);
    add_lamp(&mut scene, disk(v(0.1, -0.3, -0.3), v(0.8, 0.3, -0.2), 0.2));
    scene
}
