//! Scenes with lamps above the water.

use uw_media::phase::Phase;
use uw_render::scene::Falloff;

use super::*;

pub(super) fn cases() -> Vec<Case> {
    let murky = ([0.3, 0.1, 0.2], [0.5, 0.8, 0.6]);
    let down = disk(v(0.6, 0.3, 0.5), v(0.1, 0.0, -1.0), 0.4);

    let mut over_bottom = bottom(murky.0, murky.1, henyey_greenstein(0.5), true);
    add_lamp(&mut over_bottom, down.clone());

    let mut matched = bottom([0.1; 3], [0.4, 1.2, 0.2], Phase::Isotropic, false);
    let mut beam = down.clone();
    (beam.falloff, beam.half_angle_deg) = (Falloff::Cosine, 60.0);
    add_lamp(&mut matched, beam);
    add_plate(
        &mut matched,
        v(0.4, 0.2, 0.2),
        v(0.0, 0.3, 1.0),
        0.2,
        [0.3; 3],
    );

    let mut open = view(v(0.0, 0.0, -0.6), v(1.0, 0.2, -0.5), 10.0);
    open.water = Some(water(murky.0, murky.1, fournier_forand(0.1)));
    open.surface = Some(surface(true));
    add_lamp(&mut open, disk(v(0.5, 0.1, 0.3), v(0.0, 0.2, -1.0), 0.5));

    let mut upward = view(v(0.0, 0.0, -0.7), v(0.2, 0.1, 0.4), 20.0);
    upward.water = Some(water([0.2; 3], [0.5, 0.9, 0.3], rayleigh()));
    upward.surface = Some(surface(true));
    upward.sun = sun(40.0, 20.0, 0.5);
    upward.sky_radiance = SKY.map(|sky| 0.3 * sky);
    add_lamp(&mut upward, disk(v(0.5, 0.2, 0.6), v(-0.2, 0.0, -1.0), 0.3));

    // Nothing that the water's upper side could light: that is left out (docs/limits.md).
    let mut dry = view(v(0.0, 0.0, 0.6), v(0.75, 0.1, -0.3), 10.0);
    dry.water = Some(water(murky.0, murky.1, henyey_greenstein(0.6)));
    dry.surface = Some(surface(true));
    add_coloured_plate(&mut dry, v(0.9, 0.1, -0.5), v(-1.0, 0.2, 1.0), 0.4);
    add_lamp(&mut dry, disk(v(0.1, 0.5, 1.0), v(0.8, -0.4, -1.0), 0.5));

    vec![
        Case::new("disk above murky water over a bottom", over_bottom).work(1200, 30),
        Case::new("beam above a matched surface, plate in the air", matched).work(800, 60),
        Case::new("disk above open water, FF 0.1", open).work(800, 60),
        Case::new("looking up at a disk in the air, sun and sky", upward).work(300, 30),
        Case::new("plate in the water, camera and disk in the air", dry).work(900, 30),
    ]
}
