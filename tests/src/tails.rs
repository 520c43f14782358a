//! Heavy tails among the samples of a pixel.

use uw_render::{film::FilmLayer, integrator::stepper::Stepper, prepare::Prepared, scene::Scene};

use crate::{divided, gpu::Backend, plan};

/// Share of the largest value in the sum of squares: falls as 1/N where the variance is finite, and stays of the order
/// of one where it is not.
pub fn largest_share(values: &[f64]) -> f64 {
    let largest = values.iter().copied().fold(0.0, f64::max);
    largest * largest / values.iter().map(|v| v * v).sum::<f64>()
}

/// Largest share, of the `root`² samples of each of some pixels (column, row), that one sample holds in the sum of
/// squares of its pixel.
pub fn largest_share_of(
    backend: Backend,
    scene: &Scene,
    pixels: impl Iterator<Item = (u32, u32)>,
    root: u32,
) -> f64 {
    pixels
        .map(|pixel| largest_share(&one_sample_each(backend, &only(scene, pixel), root)))
        .fold(0.0, f64::max)
}

/// Samples of a picture of one pixel: renders show no samples, but pictures of one sample a pixel, and `root` × `root` pixels
/// in the place of the one.
fn one_sample_each(backend: Backend, pixel: &Scene, root: u32) -> Vec<f64> {
    let film = backend.render(&divided(pixel, root), &plan(1, 9)).0;
    let pixels = film.layer(FilmLayer::Total);
    pixels.iter().map(|t| t[0] + t[1] + t[2]).collect()
}

/// The same over all pixels of a picture to which a processor adds `samples` samples one by one.
///
/// # Panics
/// On an adapter.
pub fn largest_share_in_steps(backend: Backend, scene: &Scene, samples: u32) -> f64 {
    let prepared = Prepared::build(scene);
    let plan = plan(samples, 9);
    let stepper = match backend {
        Backend::Double => Stepper::new(&prepared, &plan),
        Backend::VectorUnits => Stepper::on_lanes(&prepared, &plan),
        Backend::Adapter => panic!("an adapter takes too long for single samples"),
    };
    let mut stepper = stepper.expect("few triangles");
    let mut film = stepper.film();
    let pixels = film.layer(FilmLayer::Total).len();
    let (mut before, mut values) = (vec![0.0; pixels], vec![Vec::new(); pixels]);
    for step in 1..=samples {
        stepper.step(&mut film, 1, &|| false);
        let total = film.layer(FilmLayer::Total);
        for ((pixel, before), values) in total.iter().zip(&mut before).zip(&mut values) {
            let sum = f64::from(step) * pixel.iter().sum::<f64>();
            // Nothing is less than 0 but for the rounding of what has been added up before.
            values.push((sum - *before).max(0.0));
            *before = sum;
        }
    }
    values.iter().map(|v| largest_share(v)).fold(0.0, f64::max)
}

/// The scene with a camera that is left with one pixel (column, row).
pub fn only(scene: &Scene, (column, row): (u32, u32)) -> Scene {
    let mut scene = scene.clone();
    (scene.camera.width, scene.camera.height) = (1, 1);
    scene.camera.centre_px.x -= f64::from(column);
    scene.camera.centre_px.y -= f64::from(row);
    scene
}
