//! Tables of a scene in a uniform buffer and in storage.

use super::{TURN, adapter, picture::plan, scene_with};
use crate::{
    gpu::{AdapterStepper, Gpu, pipeline::UNIFORM_ROWS},
    kernels::{Tables, Tracer},
    prepare::Prepared,
};

fn picture(gpu: &Gpu, scene: &Prepared) -> Vec<[f32; 3]> {
    let plan = plan();
    let mut stepper = AdapterStepper::new(gpu, scene, &plan).expect("fits");
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
    let scene = scene_with("[sun]\nzenith_deg = 30.0\nirradiance = [1.0, 1.0, 1.0]\n");
    assert!(scene.sun_phase.is_some(), "its table is always in storage");
    let tables = Tables::build(&scene, &[0, 1], Tracer::Kernels).expect("fits");
    assert!(tables.common_rows <= UNIFORM_ROWS);
    let (ours, theirs) = (picture(gpu, &scene), picture(&other, &scene));
    assert!(ours.as_flattened().iter().sum::<f32>() > 0.0);
    assert_eq!(ours, theirs);
}
