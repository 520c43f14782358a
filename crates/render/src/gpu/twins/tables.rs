//! Tables of a scene in a uniform buffer and in storage.

use super::{SEED, TURN, adapter, scene};
use crate::{
    gpu::{Gpu, Stepper},
    integrator::Plan,
    prepare::Prepared,
};

fn picture(gpu: &Gpu, scene: &Prepared) -> Vec<[f32; 3]> {
    let plan = Plan {
        samples_per_pixel: None,
        time_limit: None,
        target_error: None,
        seed: SEED,
        threads: None,
        max_bounces: 0,
        dark_lamps: false,
        share_walks: 1,
    };
    let mut stepper = Stepper::new(gpu, scene, &plan).expect("fits");
    assert!(stepper.step(1, &|| false).expect("runs"));
    stepper.radiance().expect("comes back")
}

/// An adapter reads them from one of the two; the picture is the same from the other.
#[test]
fn tables_are_the_same_in_both_places() {
    let Some(gpu) = adapter() else { return };
    let _turn = TURN.lock().unwrap_or_else(|e| e.into_inner());
    let mut other = gpu.clone();
    other.tables_in_uniform = !gpu.tables_in_uniform;
    let scene = scene();
    let (ours, theirs) = (picture(gpu, &scene), picture(&other, &scene));
    assert!(ours.as_flattened().iter().sum::<f32>() > 0.0);
    assert_eq!(ours, theirs);
}
