//! All instructions make one picture.

use std::{path::Path, sync::atomic::AtomicBool};

use crate::{
    film::{Film, FilmLayer},
    integrator::{Instructions, Plan, render_lanes_with},
    prepare::Prepared,
    scene::Scene,
};

const SCENE: &str = r#"
        format = "uw-scene/1"
        [water]
        a = [0.45, 0.20, 0.35]
        b = [0.9, 1.0, 1.1]
        phase = { model = "fournier-forand", n = 1.10, backscatter_fraction = 0.0183 }
        [camera]
        position_m = [0.0, 0.0, 0.0]
        forward = [1.0, 0.0, 0.0]
        hfov_deg = 60.0
        width = 37
        height = 11
        [surface]
        height_m = 2.0
        [sun]
        zenith_deg = 30.0
        azimuth_deg = 50.0
        irradiance = [1.0, 1.0, 1.0]
        [[lamp]]
        name = "disk"
        position_m = [0.0, -0.3, 0.0]
        forward = [1.0, 0.0, 0.0]
        intensity = [10.0, 10.0, 10.0]
        radius_m = 0.05
        [[object]]
        plane = { center_m = [1.5, 0.0, 0.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [2.0, 2.0] }
        reflectance = [0.2, 0.5, 0.7]
    "#;

fn film(scene: &Prepared, instructions: Instructions) -> Film {
    let plan = Plan {
        samples_per_pixel: Some(4),
        ..Plan::new(5)
    };
    let go_on = AtomicBool::new(false);
    let rendered = render_lanes_with(instructions, scene, &plan, &go_on, &|_| {});
    rendered.unwrap_or_else(|e| panic!("{e}")).0
}

/// With one seed all instructions make the same decisions but for rounding, in a picture whose rows are no whole number
/// of groups; where a number lies within the rounding of a decision, a pixel may differ.
#[test]
fn all_instructions_make_one_picture() {
    let scene = Scene::parse(SCENE, Path::new("."), "test").unwrap_or_else(|e| panic!("{e}"));
    let scene = Prepared::build(&scene);
    let baseline = film(&scene, Instructions::Baseline);
    let others = Instructions::ALL.into_iter().skip(1);
    for set in others.filter(|set| set.are_here()) {
        compare(&film(&scene, set), &baseline);
    }
}

fn compare(ours: &Film, baseline: &Film) {
    for layer in [
        FilmLayer::Ambient,
        FilmLayer::Lamp(0),
        FilmLayer::Backscatter,
    ] {
        let (ours, baseline) = (ours.layer(layer), baseline.layer(layer));
        let mean = baseline.iter().map(|p| p[1]).sum::<f64>() / baseline.len() as f64;
        assert!(mean > 0.0, "{layer:?} is black");
        let differ = |(a, b): &(&[f64; 3], &[f64; 3])| {
            (0..3).any(|k| (a[k] - b[k]).abs() > 1e-3 * b[k] + 1e-5 * mean)
        };
        let different = ours.iter().zip(&baseline).filter(differ).count();
        assert!(
            different <= 4,
            "{layer:?}: {different} of {} pixels",
            ours.len()
        );
    }
}
