//! Scenes lit by the sun, the sky and emitting surfaces.

use uw_media::phase::Phase;
use uw_render::scene::Scene;

use super::*;

pub(super) fn cases() -> Vec<Case> {
    let mut cases = suns();
    cases.extend(skies());
    cases.extend(from_and_in_the_air());
    cases.extend(emitters());
    cases.extend(limits_of_events());
    cases
}

fn looking(mut scene: Scene, from: DVec3, to: DVec3) -> Scene {
    scene.camera = view(from, to, 15.0).camera;
    scene
}

fn suns() -> Vec<Case> {
    let (a, b) = ([0.3, 0.1, 0.2], [0.5, 0.8, 0.6]);
    let mut zenith = bottom(a, b, henyey_greenstein(0.6), true);
    zenith.sun = sun(0.0, 0.0, 3.0);

    let mut oblique = bottom(a, b, draine(0.5, 0.7), false);
    oblique.sun = sun(40.0, 70.0, 3.0);
    add_box(&mut oblique, v(0.5, 0.1, -1.0), v(0.1, 0.2, 0.1), [0.6; 3]);

    let mut low = bottom(a, b, rayleigh(), true);
    low.sun = sun(80.0, 200.0, 3.0);
    let low = looking(low, v(0.0, 0.0, -1.0), v(1.0, 0.0, -0.6));

    let mut all = bottom(a, b, henyey_greenstein(0.5), true);
    all.sun = sun(40.0, -30.0, 1.0);
    all.sky_radiance = SKY;
    add_lamp(&mut all, disk(v(0.2, -0.4, -0.8), v(0.5, 0.4, -0.7), 0.3));

    let mut deep = bottom(
        [0.2, 0.1, 0.15],
        [0.8, 0.4, 0.6],
        henyey_greenstein(0.6),
        true,
    );
    deep.quads[0].centre_m.z = -6.5;
    deep.quads[0].half_u *= 10.0;
    deep.quads[0].half_v *= 10.0;
    deep.sun = sun(30.0, 10.0, 3.0);
    let deep = looking(deep, v(0.0, 0.0, -5.0), v(0.4, 0.0, -6.5));

    vec![
        Case::new("sun at the zenith", zenith).work(59, 20),
        Case::new("sun at 40°, index-matched, shadow of a box", oblique).work(51, 24),
        Case::new("sun at 80°, looking up", low).work(20, 20),
        Case::new("sun, sky and a lamp", all).work(420, 42),
        Case::new("sun at an optical depth of 5", deep).work(320, 140),
    ]
}

fn skies() -> Vec<Case> {
    let sky = |mut scene: Scene| {
        scene.sky_radiance = SKY;
        scene
    };
    let open = |a: [f64; 3], b: [f64; 3], phase: Phase, depth: f64| {
        let mut scene = sky(bottom(a, b, phase, true));
        scene.quads.clear();
        looking(scene, v(0.0, 0.0, -depth), v(1.0, 0.0, 0.8 - depth))
    };
    let thin = [0.004, 0.003, 0.002];
    vec![
        Case::new(
            "sky over a plate, FF 0.005",
            sky(bottom(
                [0.3, 0.1, 0.2],
                [0.5, 0.8, 0.6],
                fournier_forand(0.005),
                true,
            )),
        )
        .work(140, 64),
        Case::new(
            "sky without a bottom, FF 0.0183",
            open(
                [0.2, 0.1, 0.3],
                [0.8, 0.9, 0.7],
                fournier_forand(0.0183),
                2.0,
            ),
        )
        .work(89, 84),
        Case::new(
            "sky, channels that differ by 30",
            open(
                [0.1, 0.2, 0.2],
                [0.1, 3.0, 0.5],
                fournier_forand(0.0183),
                2.0,
            ),
        )
        .work(68, 270),
        Case::new(
            "sky at an optical depth of 10, FF 0.1",
            open(
                [0.05, 0.07, 0.1],
                [0.95, 0.93, 0.9],
                fournier_forand(0.1),
                10.0,
            ),
        )
        .work(110, 160),
        Case::new(
            "sky, mixture",
            open([0.2, 0.1, 0.1], [0.6, 0.4, 0.8], sea_water(0.1), 2.0),
        )
        .work(68, 84),
        Case::new(
            "sky, optical depth 0.01",
            sky(bottom(thin, thin, fournier_forand(0.0183), true)),
        )
        .work(68, 20),
        Case::new(
            "sky, albedo 0.99",
            open(
                [0.01, 0.015, 0.02],
                [0.99, 1.485, 1.98],
                fournier_forand(0.0183),
                2.0,
            ),
        )
        .work(20, 56),
    ]
}

fn from_and_in_the_air() -> Vec<Case> {
    let lit = |phase: Phase, refractive: bool| {
        let mut scene = bottom([0.3, 0.1, 0.2], [0.5, 0.8, 0.6], phase, refractive);
        scene.sky_radiance = SKY;
        scene
    };
    let mut seen = lit(henyey_greenstein(0.5), true);
    seen.sun = sun(40.0, 180.0, 2.0);
    let seen = looking(seen, v(-0.5, 0.0, 0.5), v(0.3, 0.0, -0.6));

    let mut shade = lit(henyey_greenstein(0.5), true);
    shade.sun = sun(40.0, 0.0, 2.0);
    add_plate(
        &mut shade,
        v(-0.8, 0.0, 0.6),
        v(0.3, 0.0, 1.0),
        0.5,
        [0.7, 0.6, 0.5],
    );

    let mut roof = lit(fournier_forand(0.0183), false);
    add_plate(
        &mut roof,
        v(0.3, 0.0, 0.8),
        v(0.3, 0.1, 1.0),
        0.7,
        [0.9, 0.7, 0.5],
    );
    let roof = looking(roof, v(0.0, 0.0, -0.5), v(0.3, 0.0, 0.8));

    vec![
        Case::new("camera in the air, sun and sky", seen).work(51, 68),
        Case::new("plate in the air shadows the water", shade).work(89, 88),
        Case::new("underside of a plate in the air, matched", roof).work(240, 340),
    ]
}

fn emitters() -> Vec<Case> {
    let mut glow = view(v(0.0, 0.0, 0.0), v(1.0, 0.3, 0.0), 10.0);
    glow.water = Some(water(
        [0.2, 0.1, 0.3],
        [0.8, 1.0, 0.5],
        fournier_forand(0.1),
    ));
    add_plate(
        &mut glow,
        v(1.2, 0.0, 0.0),
        v(-1.0, 0.3, 0.0),
        0.3,
        [0.5; 3],
    );
    light_up(&mut glow, [1.0, 2.0, 3.0]);
    add_plate(
        &mut glow,
        v(1.0, 0.7, 0.0),
        v(-1.0, -0.8, 0.0),
        0.4,
        [0.9; 3],
    );

    let mut air = view(v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), 10.0);
    add_plate(
        &mut air,
        v(1.0, 0.0, 0.0),
        v(-1.0, 0.3, 0.2),
        0.5,
        [0.9, 0.6, 0.3],
    );
    add_plate(
        &mut air,
        v(0.7, 0.5, 0.0),
        v(-0.2, -1.0, 0.0),
        0.3,
        [0.5; 3],
    );
    light_up(&mut air, [1.0, 2.0, 3.0]);
    air.sky_radiance = SKY;
    air.sun = sun(40.0, 20.0, 1.0);

    vec![
        Case::new("emitting plate, FF 0.1", glow).work(69, 240),
        Case::new("no water: sun, sky and an emitting plate", air).work(66, 25),
    ]
}

fn limits_of_events() -> Vec<Case> {
    let scene = || {
        let mut scene = bottom(
            [0.2, 0.1, 0.2],
            [1.0, 1.5, 0.8],
            henyey_greenstein(0.6),
            true,
        );
        scene.sun = sun(40.0, 70.0, 1.0);
        scene.sky_radiance = SKY;
        scene
    };
    vec![
        Case::new("sun and sky, at most 1 event", scene())
            .work(670, 310)
            .at_most(1),
        Case::new("sun and sky, at most 2 events", scene())
            .work(220, 180)
            .at_most(2),
        Case::new("sun and sky, at most 5 events", scene())
            .work(100, 120)
            .at_most(5),
    ]
}
