//! Irradiances as sums over the pictures of six cameras that look all around, which every processor can make, against
//! discrete ordinates.

use glam::{DVec2, DVec3};
use uw_media::interface::fresnel_reflectance;
use uw_render::{
    film::FilmLayer,
    scene::{Camera, Lens, Scene},
};
use uw_tests::{
    corpus_scene,
    discrete_ordinates::{Irradiances, Problem, irradiances},
    gpu::{Backend, everywhere},
    plan,
};

use crate::agreement::{Comparison, IRRADIANCE_MARGIN, assert_agreement};
use crate::radiative_transfer::B;

const DEPTHS_M: [f64; 2] = [1.0, 5.0];
/// Names of the quantities that cameras see.
const SEEN: [&str; 4] = ["E_d", "E_u", "E_od", "E_ou"];
/// Edge of the pictures, pixels: so many that a pixel's mean and its mean over solid angles are taken for one.
const EDGE: u32 = 32;
/// Parts of the edge of a pixel over which its weight is summed.
const PARTS: u32 = 4;
const SAMPLES_PER_PIXEL: u32 = 64;
const INDEX: f64 = 1.34;
const SUN_ZENITH_DEG: f64 = 60.0;

/// Sums of one channel over pixels and their variances: downward and upward, plane and scalar, in the order of [`SEEN`].
type Sums = [(f64, f64); 4];

/// A camera with a square field of 90° that looks along an axis.
fn face(depth_m: f64, forward: DVec3) -> Camera {
    let right = if forward.x == 0.0 { DVec3::X } else { DVec3::Y };
    Camera {
        position_m: DVec3::new(0.0, 0.0, -depth_m),
        forward,
        right,
        down: forward.cross(right),
        width: EDGE,
        height: EDGE,
        focal_px: DVec2::splat(0.5 * f64::from(EDGE)),
        centre_px: DVec2::splat(0.5 * f64::from(EDGE)),
        lens: Lens::default(),
        opening: None,
        port: None,
    }
}

/// Weights of a pixel's radiance in the sums of [`SEEN`], sr: the solid angles of its parts above and below the horizon
/// times their cosines against the vertical, and without them.
fn weights(camera: &Camera, column: u32, row: u32) -> [f64; 4] {
    let mut sums = [0.0; 4];
    let area = (camera.focal_px.x * f64::from(PARTS)).powi(-2);
    let part = |pixel: u32, i: u32| f64::from(pixel) + (f64::from(i) + 0.5) / f64::from(PARTS);
    for (i, j) in (0..PARTS).flat_map(|i| (0..PARTS).map(move |j| (i, j))) {
        let direction = camera.direction(part(column, i), part(row, j));
        let solid_angle = area * direction.dot(camera.forward).powi(3);
        // Light that travels down comes from above.
        let first = usize::from(direction.z < 0.0);
        sums[first] += solid_angle * direction.z.abs();
        sums[first + 2] += solid_angle;
    }
    sums
}

/// Sums over all directions at a depth, per channel, without the sun's beam, which no camera sees.
fn seen_around(backend: Backend, scene: &Scene, depth_m: f64, seed: u64) -> [Sums; 3] {
    let mut sums = [[(0.0, 0.0); 4]; 3];
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    for (forward, seed) in axes.into_iter().flat_map(|axis| [axis, -axis]).zip(seed..) {
        let mut scene = scene.clone();
        scene.camera = face(depth_m, forward);
        let film = backend
            .render(&scene, &plan(backend.samples(SAMPLES_PER_PIXEL), seed))
            .0;
        let pixels = film.layer(FilmLayer::Total).into_iter();
        let variances = film.layer(FilmLayer::Variance);
        for (i, (pixel, variance)) in (0..).zip(pixels.zip(variances)) {
            let weights = weights(&scene.camera, i % EDGE, i / EDGE);
            for (k, sums) in sums.iter_mut().enumerate() {
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    sum.0 += weight * pixel[k];
                    sum.1 += weight * weight * variance[k];
                }
            }
        }
    }
    sums
}

/// Downward plane and scalar irradiance of the sun's beam at optical depth `depth` in water.
fn beam(depth: f64) -> [f64; 2] {
    let (sine, cosine) = SUN_ZENITH_DEG.to_radians().sin_cos();
    let below = (1.0 - (sine / INDEX).powi(2)).sqrt();
    let entering = cosine * (1.0 - fresnel_reflectance(cosine, 1.0, INDEX));
    let plane = entering * (-depth / below).exp();
    [plane, plane / below]
}

#[test]
fn irradiances_in_molecular_water_are_the_sums_of_what_cameras_see_all_around() {
    let scene = corpus_scene("rt_rayleigh");
    let phase = &scene.water.as_ref().expect("water").phase;
    let solved: Vec<Vec<Irradiances>> = B
        .iter()
        .map(|&albedo| irradiances(&Problem::benchmark(phase, albedo), &DEPTHS_M, 32))
        .collect();
    everywhere(|backend| {
        let mut comparisons = Vec::new();
        for (level, depth_m) in DEPTHS_M.into_iter().enumerate() {
            let sums = seen_around(backend, &scene, depth_m, 1000 + 100 * level as u64);
            let [plane, scalar] = beam(depth_m);
            for (channel, sums) in sums.into_iter().enumerate() {
                let beams = [plane, 0.0, scalar, 0.0];
                for ((name, (sum, variance)), beam) in SEEN.into_iter().zip(sums).zip(beams) {
                    comparisons.push(Comparison {
                        what: format!("{name} at {depth_m} m, albedo {}", B[channel]),
                        value: sum + beam,
                        standard_error: variance.sqrt().hypot(backend.rounding() * sum),
                        reference: solved[channel][level].quantity(name),
                        margin: IRRADIANCE_MARGIN,
                    });
                }
            }
        }
        // Depths times hemispheres.
        assert_agreement(&comparisons, 2 * DEPTHS_M.len());
    });
}
