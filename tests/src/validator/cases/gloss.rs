//! Scenes with surfaces that shine.

use uw_media::phase::Phase;
use uw_render::scene::{Gloss, Scene};

use super::*;
use crate::single_ray::point_lamp;

pub(super) fn cases() -> Vec<Case> {
    let murky = ([0.3, 0.1, 0.2], [0.5, 0.8, 0.6]);
    let mut metal = view(DVec3::ZERO, v(1.0, 0.1, 0.0), 8.0);
    metal.water = Some(water(murky.0, murky.1, henyey_greenstein(0.6)));
    add_coloured_plate(&mut metal, v(1.2, 0.1, 0.0), v(-1.0, 0.4, 0.0), 1.0);
    polish(&mut metal, 0.6, 1.0, 1.5);
    let lamp = disk(v(0.2, 0.8, 0.1), v(0.9, -0.7, 0.0), 0.3);
    add_lamp(&mut metal, lamp);

    let mut varnish = view(DVec3::ZERO, v(1.0, 0.0, 0.0), 8.0);
    varnish.water = Some(water([0.1; 3], [0.4, 0.7, 0.2], Phase::Isotropic));
    add_coloured_plate(&mut varnish, v(1.0, 0.0, 0.0), v(-1.0, 0.3, 0.2), 0.8);
    polish(&mut varnish, 0.5, 0.0, 2.4);
    let disk = disk(v(0.3, 0.4, 0.2), v(0.8, -0.2, 0.0), 0.25);
    add_lamp(&mut varnish, disk);

    let facing = |air: bool| {
        let mut scene = view(v(0.0, 0.0, 0.3), v(1.0, 0.2, 0.2), 8.0);
        add_coloured_plate(&mut scene, v(1.2, 0.2, 0.2), v(-1.0, 0.2, 0.1), 0.8);
        polish(&mut scene, 0.5, 0.5, 1.5);
        add_coloured_plate(&mut scene, v(0.2, 0.9, 0.4), v(0.3, -1.0, 0.0), 0.6);
        polish(&mut scene, 0.7, 1.0, 1.5);
        if air {
            scene.water = Some(water(murky.0, murky.1, henyey_greenstein(0.5)));
            scene.surface = Some(surface(true));
            scene.sun = sun(50.0, 20.0, 3.0);
            scene.sky_radiance = SKY;
        } else {
            add_lamp(&mut scene, point_lamp(v(0.3, 0.2, 0.7), 2.0));
        }
        scene
    };

    let mut sunny = bottom(murky.0, murky.1, henyey_greenstein(0.5), true);
    polish(&mut sunny, 0.5, 1.0, 1.5);
    sunny.sun = sun(40.0, 160.0, 3.0);
    sunny.sky_radiance = SKY;

    vec![
        Case::new("rough metal in murky water, disk lamp", metal).work(400, 60),
        Case::new("varnish in murky water, disk lamp", varnish).work(400, 60),
        Case::new(
            "two plates that shine at each other, no water",
            facing(false),
        )
        .work(200, 60),
        Case::new(
            "two plates in the air over water, sun and sky",
            facing(true),
        )
        .work(300, 30),
        Case::new("metal bottom under sun and sky", sunny).work(300, 60),
    ]
}

/// Lets the plate that was added last shine.
fn polish(scene: &mut Scene, roughness: f64, metallic: f64, index: f64) {
    if let Some(material) = scene.materials.last_mut() {
        material.gloss = Some(Gloss {
            roughness,
            metallic,
            index,
            texture: None,
        });
    }
}
