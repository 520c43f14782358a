//! Scenes lit by lamps.

use uw_media::phase::Phase;
use uw_render::scene::{Falloff, Lamp, Scene, Texture, TextureFilter};

use super::*;
use crate::single_ray::point_lamp;

const GREY: [f64; 3] = [0.7, 0.5, 0.3];
/// A beam that falls to zero at 70° in straight lines.
const BEAM: [(f64, f64); 4] = [(0.0, 1.0), (20.0, 0.8), (45.0, 0.3), (70.0, 0.0)];

pub(super) fn cases() -> Vec<Case> {
    let mut cases = targets();
    cases.extend(peaks_in_view());
    cases.extend(lamps_close_by());
    cases.extend(under_a_surface());
    cases.extend(waters());
    cases.extend(limits_of_events());
    cases
}

/// Light that scatters often before it is seen. Bridges alone have a heavy tail here: the square of their light falls as albedo^(2k), their
/// probability no faster.
pub(super) fn in_bright_water() -> Vec<Case> {
    let mut diffuse = view(DVec3::ZERO, v(1.0, 0.0, 0.0), 10.0);
    diffuse.water = Some(water([0.01; 3], [0.99; 3], Phase::Isotropic));
    add_lamp(&mut diffuse, disk(v(0.0, 5.0, 0.0), v(0.0, -1.0, 0.0), 1.5));
    // Most bridges of late vertices of a walk would have more scatterings than they may.
    let mut murky = view(DVec3::ZERO, v(1.0, 0.3, 0.0), 10.0);
    murky.water = Some(water(
        [1.0, 0.6, 0.7],
        [24.0, 19.0, 22.0],
        henyey_greenstein(0.9),
    ));
    add_lamp(&mut murky, disk(v(1.5, 0.0, 0.0), v(-1.0, 0.0, 0.0), 0.5));

    vec![
        Case::new(
            "lamp behind a bright target, albedo 0.93",
            lamp_behind([0.1, 0.05, 0.2], [1.0, 0.7, 1.3], GREY),
        )
        .work(1000, 64),
        Case::new("lamp at an optical depth of 5, albedo 0.99", diffuse).work(200, 64),
        Case::new(
            "lamp at an optical depth of 29 to 38, albedo 0.96 to 0.97",
            murky,
        )
        .work(600, 128),
    ]
}

/// A disk that the camera looks at, itself and mirrored in the surface: one scattering close to it meets the peak of
/// the phase function and 1/r⁴ over the disk.
fn peaks_in_view() -> Vec<Case> {
    let peak = || fournier_forand(0.0183);
    let mut in_view = mild(peak());
    add_lamp(&mut in_view, lamp_in_view());
    vec![
        Case::new("lamp in view, FF 0.0183", in_view),
        Case::new(
            "lamp mirrored in the surface, FF 0.0183",
            lamp_in_mirror([0.3, 0.5, 0.4], peak()),
        )
        // With half as many samples one value was 2.1 % wide.
        .work(100, 200),
    ]
}

/// A plate 1.5 m in front of the camera in water of the given coefficients, not yet lit.
fn plate(a: [f64; 3], b: [f64; 3], phase: Phase) -> Scene {
    let mut scene = view(v(0.0, 0.0, 0.0), v(1.5, 0.1, 0.05), 10.0);
    scene.water = Some(water(a, b, phase));
    add_plate(&mut scene, v(1.5, 0.0, 0.0), v(-1.0, 0.2, 0.1), 1.0, GREY);
    scene
}

fn mild(phase: Phase) -> Scene {
    plate([0.2, 0.1, 0.15], [0.5, 0.6, 0.45], phase)
}

fn side_lamp() -> Lamp {
    disk(v(0.5, -0.9, 0.2), v(1.0, 0.8, -0.1), 0.7)
}

fn lamp_in_view() -> Lamp {
    disk(v(1.0, 0.15, 0.0), v(-1.0, 0.2, 0.1), 0.15)
}

fn targets() -> Vec<Case> {
    let mut wide = mild(henyey_greenstein(0.6));
    add_lamp(&mut wide, side_lamp());

    let mut beam = mild(fournier_forand(0.0183));
    add_lamp(
        &mut beam,
        Lamp {
            falloff: Falloff::Profile(BEAM.to_vec()),
            half_angle_deg: 50.0,
            ..side_lamp()
        },
    );

    let mut two = plate([0.3, 0.1, 0.05], [0.8, 0.5, 0.3], fournier_forand(0.005));
    add_lamp(
        &mut two,
        Lamp {
            falloff: Falloff::Cosine,
            level_pct: 60.0,
            ..side_lamp()
        },
    );
    add_lamp(
        &mut two,
        Lamp {
            half_angle_deg: 30.0,
            level_pct: 35.0,
            intensity: [2.0, 6.0, 12.0],
            spectrum: None,
            ..disk(v(0.4, 0.7, 0.1), v(1.0, -0.5, 0.0), 0.3)
        },
    );

    let mut occluded = plate([0.3, 0.25, 0.2], [0.5, 0.6, 0.45], henyey_greenstein(0.6));
    add_lamp(&mut occluded, side_lamp());
    add_plate(
        &mut occluded,
        v(0.9, -0.4, 0.1),
        v(1.0, 0.9, 0.0),
        0.25,
        [0.9; 3],
    );

    let mut meshes = mild(fournier_forand(0.0183));
    add_lamp(&mut meshes, side_lamp());
    add_tetrahedron(&mut meshes, v(1.1, 0.05, 0.05), 0.15, [0.9, 0.8, 0.7]);
    add_box(&mut meshes, v(0.9, -0.4, 0.1), v(0.1, 0.15, 0.2), [0.5; 3]);

    vec![
        Case::new("disk lamp, plate", wide).work(430, 100),
        Case::new("cone and beam profile, FF 0.0183", beam).work(420, 38),
        Case::new("two lamps, FF 0.005", two).work(440, 31),
        Case::new("occluder between lamp and target", occluded).work(610, 300),
        Case::new("closed meshes, FF 0.0183", meshes).work(260, 170),
        Case::new("point lamps, textured corner, absorbing water", corner()).work(36, 50),
        Case::new("slope of a beam", edge_of_beam()).work(100, 16),
        Case::new("inside a closed box", closed_box()).work(830, 390),
    ]
}

/// A plate lit by the slope of a beam, about 50° off its axis.
fn edge_of_beam() -> Scene {
    let mut scene = plate([0.3, 0.1, 0.2], [0.0; 3], Phase::Isotropic);
    add_lamp(
        &mut scene,
        Lamp {
            forward: v(1.0, -1.0, 0.2).normalize(),
            half_angle_deg: 60.0,
            falloff: Falloff::Profile(BEAM.to_vec()),
            ..point_lamp(v(0.3, 0.0, 0.0), 5.0)
        },
    );
    scene
}

/// Two walls that light each other, one with a texture.
fn corner() -> Scene {
    let mut scene = plate([0.3, 0.1, 0.2], [0.0; 3], Phase::Isotropic);
    scene.textures.push(Texture {
        width: 2,
        height: 2,
        texels: vec![
            [0.9, 0.2, 0.4],
            [0.1, 0.8, 0.5],
            [0.3, 0.6, 1.0],
            [0.7, 0.4, 0.2],
        ]
        .into(),
        filter: TextureFilter::Bilinear,
    });
    scene.materials[0].texture = Some(0);
    scene.materials[0].reflectance = [1.0, 0.9, 0.8];
    scene.quads[0].tile_m *= 0.37;
    add_plate(
        &mut scene,
        v(1.0, 0.0, -0.5),
        v(0.0, 0.1, 1.0),
        1.0,
        [0.9, 0.8, 0.7],
    );
    add_lamp(&mut scene, point_lamp(v(0.3, -0.4, 0.4), 5.0));
    add_lamp(
        &mut scene,
        Lamp {
            forward: v(1.0, 0.0, -0.6).normalize(),
            half_angle_deg: 60.0,
            falloff: Falloff::Profile(BEAM.to_vec()),
            level_pct: 40.0,
            ..point_lamp(v(0.4, 0.5, 0.3), 9.0)
        },
    );
    scene
}

fn closed_box() -> Scene {
    let mut scene = view(v(0.4, 0.0, 0.1), v(-1.0, 0.1, -0.2), 25.0);
    scene.water = Some(water([0.1, 0.2, 0.05], [0.3, 0.3, 0.4], draine(0.5, 0.7)));
    add_box(
        &mut scene,
        v(0.0, 0.0, 0.0),
        v(1.0, 0.8, 0.6),
        [0.8, 0.6, 0.4],
    );
    add_lamp(&mut scene, disk(v(0.2, 0.3, 0.3), v(-0.2, -0.3, -1.0), 0.2));
    scene
}

fn lamps_close_by() -> Vec<Case> {
    let mut in_view = plate([0.2, 0.1, 0.15], [0.1, 0.2, 0.05], rayleigh());
    add_lamp(&mut in_view, lamp_in_view());

    let mut near = mild(fournier_forand(0.0183));
    add_lamp(&mut near, disk(v(-0.05, 0.6, 0.0), v(1.0, -0.2, 0.0), 0.5));

    let mut touching = mild(henyey_greenstein(0.6));
    add_lamp(
        &mut touching,
        disk(v(1.42, 0.05, 0.05), v(1.0, -0.2, -0.1), 0.1),
    );

    let absorbing = lamp_behind([0.25, 0.2, 0.3], [0.8, 0.6, 1.0], [0.2, 0.15, 0.1]);
    vec![
        Case::new("lamp in view, weak scattering", in_view).work(20, 20),
        Case::new("lamp behind the target", absorbing).work(3400, 170),
        Case::new("lamp 0.1 m beside the camera", near).work(410, 20),
        Case::new("target 5 cm from the lamp", touching).work(370, 180),
    ]
}

/// A lamp that shines towards the camera from behind a small plate.
fn lamp_behind(a: [f64; 3], b: [f64; 3], reflectance: [f64; 3]) -> Scene {
    let mut scene = view(v(0.0, 0.0, 0.0), v(1.5, 0.1, 0.05), 10.0);
    scene.water = Some(water(a, b, henyey_greenstein(0.6)));
    add_plate(
        &mut scene,
        v(0.8, 0.0, 0.0),
        v(-1.0, 0.2, 0.1),
        0.25,
        reflectance,
    );
    add_lamp(&mut scene, disk(v(1.4, 0.0, 0.0), v(-1.0, 0.0, 0.0), 0.5));
    scene
}

fn under_a_surface() -> Vec<Case> {
    // The plate ends 5 cm below the surface.
    let below = |refractive: bool, phase: Phase| {
        let mut scene = view(v(0.0, 0.0, -0.5), v(1.5, 0.1, -0.35), 10.0);
        scene.water = Some(water([0.1, 0.05, 0.2], [0.5, 0.6, 0.45], phase));
        scene.surface = Some(surface(refractive));
        add_plate(
            &mut scene,
            v(1.5, 0.0, -0.95),
            v(-1.0, 0.0, 0.0),
            0.9,
            [0.8; 3],
        );
        add_lamp(&mut scene, disk(v(0.6, -0.5, -0.5), v(0.6, 0.4, 0.6), 0.3));
        scene
    };
    let mut from_air = below(true, henyey_greenstein(0.5));
    from_air.camera = view(v(0.5, 0.0, 0.5), v(1.0, 0.0, -0.3), 10.0).camera;

    let mut shadowed = below(true, henyey_greenstein(0.6));
    add_plate(
        &mut shadowed,
        v(1.1, 0.0, -0.05),
        v(0.0, 0.0, 1.0),
        0.2,
        [0.2; 3],
    );

    let mut mirrored = view(v(0.0, 0.0, -0.5), v(0.47, 0.0, 0.0), 4.0);
    mirrored.water = Some(water(
        [0.1, 0.05, 0.2],
        [0.3, 0.5, 0.4],
        fournier_forand(0.0183),
    ));
    mirrored.surface = Some(surface(true));
    add_lamp(
        &mut mirrored,
        disk(v(0.94, 0.0, -0.5), v(-1.0, 0.0, 1.0), 0.3),
    );

    vec![
        Case::new(
            "lamp under a refracting surface, FF 0.0183",
            below(true, fournier_forand(0.0183)),
        )
        .work(220, 25),
        Case::new(
            "lamp under an index-matched surface, FF 0.1",
            below(false, fournier_forand(0.1)),
        )
        .work(330, 35),
        Case::new("lamp in the water, camera in the air", from_air).work(1100, 260),
        Case::new("occluder below a reflecting surface", shadowed).work(520, 100),
        Case::new(
            "lamp seen mirrored in the surface",
            lamp_in_mirror([0.05, 0.1, 0.15], rayleigh()),
        )
        .work(180, 20),
    ]
}

/// A camera that looks up at the surface and sees a lamp in it, by partial reflection.
fn lamp_in_mirror(b: [f64; 3], phase: Phase) -> Scene {
    let mut scene = view(v(0.0, 0.0, -0.5), v(0.47, 0.0, 0.0), 4.0);
    scene.water = Some(water([0.1, 0.05, 0.2], b, phase));
    scene.surface = Some(surface(true));
    add_lamp(&mut scene, disk(v(0.94, 0.0, -0.5), v(-1.0, 0.0, 1.0), 0.3));
    scene
}

fn waters() -> Vec<Case> {
    let with_lamp = |a: [f64; 3], b: [f64; 3], phase: Phase| {
        let mut scene = plate(a, b, phase);
        add_lamp(&mut scene, side_lamp());
        scene
    };
    let mut thick = view(v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), 10.0);
    thick.water = Some(water(
        [0.2, 0.3, 0.1],
        [9.8, 9.0, 8.0],
        fournier_forand(0.0183),
    ));
    add_lamp(&mut thick, disk(v(1.0, 0.0, 0.0), v(-1.0, 0.0, 0.0), 0.5));

    let mut veil = view(v(0.0, 0.0, 0.0), v(1.0, 0.2, 0.0), 20.0);
    veil.water = Some(water([0.1; 3], [1.0, 2.0, 0.5], rayleigh()));
    add_lamp(&mut veil, disk(v(0.3, -0.6, 0.0), v(0.5, 1.0, 0.0), 0.5));

    vec![
        Case::new(
            "scattering 30 times stronger in one channel",
            with_lamp([0.1, 0.6, 0.2], [0.1, 3.0, 0.5], fournier_forand(0.0183)),
        )
        .work(480, 220),
        Case::new(
            "one channel without scattering",
            with_lamp([0.3, 0.1, 0.1], [0.0, 1.0, 0.4], henyey_greenstein(0.6)),
        )
        .work(380, 300),
        Case::new("albedo 0.99, in a box", white_box()).work(150, 270),
        Case::new(
            "optical depth 0.01",
            with_lamp(
                [0.003, 0.002, 0.001],
                [0.003, 0.004, 0.005],
                fournier_forand(0.005),
            ),
        )
        .work(350, 20),
        Case::new("optical depth 10, lamp ahead", thick).work(20, 89),
        Case::new("veil alone, Rayleigh", veil).work(210, 100),
        Case::new(
            "mixture",
            with_lamp([0.2, 0.1, 0.1], [0.6, 0.4, 0.8], sea_water(0.2)),
        )
        .work(260, 75),
    ]
}

fn white_box() -> Scene {
    let mut scene = closed_box();
    scene.water = Some(water(
        [0.01, 0.015, 0.02],
        [0.99, 1.485, 1.98],
        fournier_forand(0.1),
    ));
    scene
}

fn limits_of_events() -> Vec<Case> {
    let scene = || {
        let mut scene = closed_box();
        scene.camera = view(v(0.4, 0.0, 0.1), v(-1.0, 0.5, 0.6), 25.0).camera;
        scene
    };
    vec![
        Case::new("box, at most 1 event", scene())
            .work(1000, 430)
            .at_most(1),
        Case::new("box, at most 2 events", scene())
            .work(890, 280)
            .at_most(2),
        Case::new("box, at most 5 events", scene())
            .work(780, 270)
            .at_most(5),
    ]
}
