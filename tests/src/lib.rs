//! Harness of the system tests: renders of corpus scenes and their comparison with references.

pub mod discrete_ordinates;
pub mod gpu;
pub mod reference;
pub mod same_numbers;
pub mod single_ray;
pub mod tails;
pub mod tiles;
pub mod validator;

use std::path::{Path, PathBuf};

use uw_render::{
    film::{Film, FilmLayer},
    integrator::{Plan, RenderStats},
    prepare::Prepared,
    scene::Scene,
};

use gpu::{Backend, prepared};

/// The path of a file of this package.
pub fn file(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

/// Reads a scene of the corpus `scenes/`.
///
/// # Panics
/// When the scene cannot be read: the corpus is part of the tests.
pub fn corpus_scene(name: &str) -> Scene {
    let path = file(&format!("scenes/{name}.toml"));
    Scene::read(&path).unwrap_or_else(|e| panic!("{e}"))
}

/// A plan with a fixed number of samples and unlimited bounces.
pub fn plan(samples_per_pixel: u32, seed: u64) -> Plan {
    Plan {
        samples_per_pixel: Some(samples_per_pixel),
        ..Plan::new(seed)
    }
}

/// Renders `scene` to the end in double precision, with which the others are compared.
///
/// # Panics
/// When rendering fails.
pub fn render(scene: &Scene, plan: &Plan) -> (Film, RenderStats) {
    Backend::Double.render(scene, plan)
}

/// Mean and standard error of the pixels of a picture whose pixels all see the same, rendered by `backend` with its share of
/// `samples`; the error includes that of its arithmetic.
pub fn measure(
    backend: Backend,
    scene: &Scene,
    samples: u32,
    max_bounces: u32,
    seed: u64,
) -> ([f64; 3], [f64; 3]) {
    let samples = backend.samples(samples);
    measure_prepared(backend, &prepared(scene), samples, max_bounces, seed)
}

/// The same of a scene that has been prepared, with all of `samples`.
pub fn measure_prepared(
    backend: Backend,
    scene: &Prepared,
    samples: u32,
    max_bounces: u32,
    seed: u64,
) -> ([f64; 3], [f64; 3]) {
    let mut plan = plan(samples, seed);
    plan.max_bounces = max_bounces;
    let film = backend.render_prepared(scene, &plan).0;
    let pixels = film.layer(FilmLayer::Total);
    let n = pixels.len() as f64;
    let mean: [f64; 3] = std::array::from_fn(|k| pixels.iter().map(|p| p[k]).sum::<f64>() / n);
    let error = std::array::from_fn(|k| {
        let square = pixels.iter().map(|p| (p[k] - mean[k]).powi(2)).sum::<f64>();
        (square / (n * (n - 1.0)))
            .sqrt()
            .hypot(backend.rounding() * mean[k])
    });
    (mean, error)
}

/// The same view with `n` × `n` pixels for each one: their mean is what the one shows.
pub fn divided(scene: &Scene, n: u32) -> Scene {
    let mut scene = scene.clone();
    let camera = &mut scene.camera;
    (camera.width, camera.height) = (n * camera.width, n * camera.height);
    camera.focal_px *= f64::from(n);
    camera.centre_px *= f64::from(n);
    scene
}
